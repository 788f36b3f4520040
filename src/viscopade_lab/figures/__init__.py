"""The paper's figures, and those that it could not show."""

NAMES = (
    *(
        "materials",
        "seriesDiverging",
        "seriesErrors",
        "tryingDifferentPade",
        "localSlope",
        "tryingDifferentPadeLin",
        "padeErrors",
    ),
    *("polesAndZeros", "expVsAnaVsNum", "iceErrors", "minimaxErrors", "cooling"),
    *("universalCurves", "dampingFormulas", "audit", "epsOverSpeed", "weight"),
)
FORMATS = ("svg", "pdf", "png")
