"""From the equation of motion to numbers: the scaled equation, its series, Padé approximants, limits, singularities."""

__all__ = [
    "asymptotics",
    "equation",
    "pade",
    "paper",
    "series",
    "singularity",
]
