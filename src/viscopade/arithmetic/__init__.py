"""Exact and proven arithmetic: balls, balls of functions, Chebyshev polynomials, binary formats."""

__all__ = [
    "balls",
    "chebyshev",
    "decimals",
    "formats",
    "function_balls",
]
