"""The simulators that the command line offers before it loads one are those of the renderers."""

from viscopade.simulators import TARGETS
from viscopade.simulators.render import _RENDERERS


def test_targets_are_those_of_the_renderers():
    assert set(TARGETS) == set(_RENDERERS)
