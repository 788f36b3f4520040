"""The report on a benchmark: one HTML page, and the picture of time against error."""

FORMATS = ("svg", "png")
