"""From a description of a simulation to the cheapest kernel that is good enough for it."""

__all__ = [
    "check",
    "choice",
    "cost",
    "description",
    "quantity",
    "read",
    "render",
    "runners",
    "tables",
    "units",
]
