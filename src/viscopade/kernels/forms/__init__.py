"""Forms of kernels: for each form, its coefficients and its proven bounds."""

__all__ = [
    "minimax",
    "quotient",
    "table_free",
]
