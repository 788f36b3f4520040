"""The calculator: one HTML file with our JavaScript export, tables of ready laws, and facts of other packages."""

__all__ = ["page"]
