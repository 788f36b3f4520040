"""Theory of eps(v*): the scaled equation of motion, its series, Padé approximants and the paper's numbers."""

__all__ = [
    "equation",
    "law",
    "pade",
    "paper",
    "series",
]
