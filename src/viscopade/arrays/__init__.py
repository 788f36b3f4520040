"""Functions of NumPy arrays: eps, its inverse, x_max and tau_c in double precision, from the proven table of panels."""

__all__ = [
    "checked",
    "double",
    "panels",
]
