"""Forms of kernels: for each form, its coefficients and its proven bounds."""

__all__ = [
    "formulas",
    "last_place",
    "minimax",
    "quotient",
    "speed_kernel",
    "speed_table",
    "speed_table_last_place",
    "table_free",
]
