"""Best approximants of eps and its inverse: Remez exchange, minimax and lacunary quotients."""

__all__ = [
    "cheapest",
    "half_line",
    "inverse",
    "lacunary",
    "lawson",
    "minimax",
    "remez",
]
