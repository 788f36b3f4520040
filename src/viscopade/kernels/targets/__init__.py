"""Targets: the code of kernels in each language, and tables of numbers."""

__all__ = [
    "last_place",
    "speed",
    "table_free",
    "tables",
]
