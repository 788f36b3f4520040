"""The live calculator: one HTML file with our JavaScript export, tables of ready laws, and the facts of other wings."""

__all__ = ["page"]
