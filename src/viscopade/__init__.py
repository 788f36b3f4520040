"""The coefficient of restitution of viscoelastic spheres (Müller & Pöschel 2011), exactly and fast.

>>> import viscopade as vp
>>> vp.series(order=8, digits=12).decimals()[2]
'-1.15344885810'
>>> vp.pade(3, 6).decimals(6)[0]
('1', '1.07232', '0.574198', '0.141552')
"""

from importlib.metadata import version

from viscopade.model import Pair, Sphere
from viscopade.pade import pade
from viscopade.series import series

__version__ = version("viscopade")

__all__ = ["Pair", "Sphere", "__version__", "pade", "series"]
