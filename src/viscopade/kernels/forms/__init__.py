"""The forms that a kernel may have: what each consists of, and what is proven of it."""

__all__ = [
    "lacunary_rounding",
    "last_place",
    "minimax",
    "quotient",
    "speed_kernel",
    "speed_table",
    "speed_table_last_place",
    "table_free",
]
