"""Targets: the code of kernels in each language, and tables of numbers."""

__all__ = [
    "language",
    "languages",
    "syntax",
]
