"""Exact and proven arithmetic: balls, balls of functions, Chebyshev polynomials, compensated sums, binary formats."""

__all__ = [
    "balls",
    "chebyshev",
    "compensated",
    "decimals",
    "formats",
    "function_balls",
]
