"""Scenes: from the description of a simulation to the cheapest kernel within its tolerance."""

__all__ = [
    "check",
    "choice",
    "description",
    "model_limits",
    "read",
    "render",
    "tables",
    "units",
]
