"""Exact and proven arithmetic: balls, balls of functions, Chebyshev points, compensated sums, formats, decimals."""

__all__ = [
    "balls",
    "chebyshev",
    "compensated",
    "decimals",
    "formats",
    "function_balls",
]
