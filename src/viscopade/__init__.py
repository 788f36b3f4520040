"""The coefficient of restitution of viscoelastic spheres (Müller & Pöschel 2011), exactly and fast.

>>> import viscopade as vp
>>> vp.series(order=8, digits=12).decimals()[2]
'-1.15344885810'
>>> vp.pade(3, 6).decimals(6)[0]
('1', '1.07232', '0.574198', '0.141552')
>>> vp.exact.collision("1.5", digits=20).decimals()["epsilon"]
'0.18648967473177858239'
>>> vp.epsilon([0, 0.5, 1.5]).round(12).tolist()
[1.0, 0.760037160544, 0.186489674732]
"""

from importlib.metadata import version

from viscopade import double, exact
from viscopade.double import epsilon, one_minus_epsilon
from viscopade.model import Pair, Sphere, beta_from_restitution
from viscopade.native import backend, restitution
from viscopade.pade import pade
from viscopade.series import series

__version__ = version("viscopade")

__all__ = [
    "Pair",
    "Sphere",
    "__version__",
    "backend",
    "beta_from_restitution",
    "double",
    "epsilon",
    "exact",
    "one_minus_epsilon",
    "pade",
    "restitution",
    "series",
]
