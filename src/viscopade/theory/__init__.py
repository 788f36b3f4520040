"""Theory of eps(v*): the scaled equation of motion, its derivation and series, Padé approximants, the paper."""

__all__ = [
    "derivation",
    "equation",
    "law",
    "pade",
    "paper",
    "series",
]
