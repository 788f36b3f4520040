"""The names that the command line offers before it loads a kernel are those of the kernels."""

from viscopade.kernels import names
from viscopade.kernels.forms.speed_kernel import TABLES


def test_tiers_and_sizes_are_those_of_the_tables():
    assert (*dict.fromkeys(tier for tier, _ in TABLES), names.FULL) == names.TIERS
    assert {size for _, size in TABLES} == {names.FAST, names.SMALL}
