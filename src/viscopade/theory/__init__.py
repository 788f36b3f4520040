"""Theory of eps(v*): the scaled equation of motion, its series, Padé approximants, both limits, singularities."""

__all__ = [
    "asymptotics",
    "equation",
    "law",
    "pade",
    "paper",
    "series",
    "singularity",
    "symbolic",
]
