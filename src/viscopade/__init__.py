"""The coefficient of restitution of viscoelastic spheres (Müller & Pöschel 2011): exact numbers and fast kernels.

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

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from viscopade.arrays import double
    from viscopade.arrays.double import epsilon, one_minus_epsilon
    from viscopade.collision import contact, exact
    from viscopade.collision.contact import Contact
    from viscopade.collision.curve import curve
    from viscopade.collision.spheres import Pair, Sphere, beta_from_restitution
    from viscopade.compiled import backend
    from viscopade.fitting.damping import fit
    from viscopade.fitting.points import Points
    from viscopade.generated import __version__
    from viscopade.kernels.native import restitution
    from viscopade.shipped import get_include
    from viscopade.theory.law import Law
    from viscopade.theory.pade import pade
    from viscopade.theory.series import series

__all__ = [
    "Contact",
    "Law",
    "Pair",
    "Points",
    "Sphere",
    "__version__",
    "backend",
    "beta_from_restitution",
    "contact",
    "curve",
    "double",
    "epsilon",
    "exact",
    "fit",
    "get_include",
    "one_minus_epsilon",
    "pade",
    "restitution",
    "series",
]

# The module of each public name, which is imported when the name is first used, so that the command line starts fast.
_MODULES = {
    "contact": "viscopade.collision.contact",
    "double": "viscopade.arrays.double",
    "exact": "viscopade.collision.exact",
}
_HOME = {
    **dict.fromkeys(("Pair", "Sphere", "beta_from_restitution"), "viscopade.collision.spheres"),
    **dict.fromkeys(("epsilon", "one_minus_epsilon"), "viscopade.arrays.double"),
    "Contact": "viscopade.collision.contact",
    "Law": "viscopade.theory.law",
    "__version__": "viscopade.generated",
    "backend": "viscopade.compiled",
    "Points": "viscopade.fitting.points",
    "fit": "viscopade.fitting.damping",
    "curve": "viscopade.collision.curve",
    "get_include": "viscopade.shipped",
    "pade": "viscopade.theory.pade",
    "restitution": "viscopade.kernels.native",
    "series": "viscopade.theory.series",
}


def __getattr__(name: str) -> Any:
    """Return a public name, a module or an object in one; it is imported now, and kept for the next use."""
    if name in _MODULES:
        value: Any = import_module(_MODULES[name])
    elif name in _HOME:
        value = getattr(import_module(_HOME[name]), name)
    else:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted(__all__)
