"""What the error of an approximant is relative to."""

from typing import Literal, get_args

Measure = Literal["both", "relative"]
"""The smaller of eps and 1 - eps, so that slow and fast collisions come out right; or eps."""
MEASURES: tuple[Measure, ...] = get_args(Measure)
