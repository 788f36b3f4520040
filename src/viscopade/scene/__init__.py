"""Scenes: from the description of a simulation to the cheapest kernel within its tolerance."""

__all__ = [
    "check",
    "choice",
    "description",
    "read",
    "render",
    "sense",
    "tables",
    "units",
]
