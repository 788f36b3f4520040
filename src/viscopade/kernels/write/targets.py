"""What an exported file may be: code in a language, or a table of numbers."""

from viscopade.kernels.write import languages

TABLES = ("csv", "json", "latex", "certificates", "vectors")
TARGETS = (*languages.NAMES, *TABLES)
SERIES_ORDER, SERIES_DIGITS = 60, 50
"""Highest power and digits of a file with the coefficients h_k, unless the request has others."""
LATEX_DIGITS = 15
"""Digits of the coefficients in a table in LaTeX, unless the request has others."""
