"""Figures: those of the paper, and further ones; here their names and file formats, without loading Matplotlib."""

NAMES = (
    *(
        "materials",
        "truncated-series-diverge",
        "pade-at-large-v-star",
        "local-exponent",
        "pade-on-linear-axes",
        "pade-errors",
    ),
    *("poles-and-zeros", "ice-pade-and-measured-fit", "cooling"),
    *("universal-curves", "damping-formulas", "audit", "eps-over-speed", "weight"),
)
FORMATS = ("svg", "pdf", "png")
