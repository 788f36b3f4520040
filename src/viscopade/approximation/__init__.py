"""Best approximants of eps and its inverse: Remez exchange, minimax and lacunary quotients, machine coefficients."""

__all__ = [
    "cheapest",
    "half_line",
    "inverse",
    "lacunary",
    "lawson",
    "machine_coefficients",
    "minimax",
    "remez",
    "target",
]
