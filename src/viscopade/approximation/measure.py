"""Measures of an approximant's error: relative to eps, or to the smaller of eps and 1 - eps."""

from typing import Literal, get_args

Measure = Literal["both", "relative"]
"""The smaller of eps and 1 - eps, so that slow and fast collisions are accurate; or eps."""
MEASURES: tuple[Measure, ...] = get_args(Measure)
RELATIVE_TO = {"both": "min(eps, 1 - eps)", "relative": "eps"}
"""The quantity to which the error is relative, as text, by measure."""


def measure_of(measure: str) -> Measure:
    """Check the name of a measure.

    Raises
    ------
    ValueError
        If the measure is not known.
    """
    if measure not in MEASURES:
        raise ValueError(f"measure is {measure!r}: expected 'both' or 'relative'")
    return measure
