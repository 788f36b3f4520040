"""Names in requests for kernels: targets, accuracies and table sizes."""

from viscopade.kernels.write import languages

LANGUAGES = languages.NAMES

TABLES = ("csv", "json", "latex", "certificates", "vectors")
"""Targets that are tables of numbers."""
TARGETS = (*LANGUAGES, *TABLES)
"""Kinds of files with kernels: languages, and tables of numbers."""
SERIES_ORDER, SERIES_DIGITS = 60, 50
"""Highest power and digits of a file with the coefficients h_k, unless the request has others."""

FULL = "full"
TIERS = ("1e-5", "1e-10", FULL)
"""Accuracies of the kernels from speed to eps with tables."""
COMPACT = ("1e-3", "1e-5", "1e-7")
"""Accuracies of the ready kernels from speed to eps without tables."""
FAST, SMALL = "fast", "small"
"""Sizes of their tables."""
