"""NumPy in, NumPy out: eps, its inverse and their companions in double precision, from the proven table of panels."""

__all__ = [
    "checked",
    "double",
    "fallback",
    "native",
    "panels",
]
