"""The command line `viscopade`: one module for each group of commands."""

__all__ = [
    "console",
    "main",
    "writer",
]
