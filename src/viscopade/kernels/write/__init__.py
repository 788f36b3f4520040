"""Code of kernels: one writer of functions, and a module of data for each language."""

__all__ = ["file", "language", "languages", "runners", "tables", "targets"]
