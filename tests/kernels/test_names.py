"""The names that the command line offers before it loads a kernel are those of the kernels."""

from viscopade.kernels import names
from viscopade.kernels.speed_table import TABLES


def test_tiers_and_sizes_are_those_of_the_tables():
    assert tuple(dict.fromkeys(tier for tier, _ in TABLES)) == names.TIERS
    assert {size for _, size in TABLES} == {names.FAST, names.SMALL}
