"""Costs of kernels: a weighted count of operations."""

from __future__ import annotations

from dataclasses import dataclass

# In multiplications: about what these take on processors of our days (docs/results/benchmark.md).
DIVISION, POWER = 4, 50
COSTS = f"a count of operations (a division counts {DIVISION}, a power {POWER})"


@dataclass(frozen=True)
class Operations:
    """Operations of one evaluation.

    Attributes
    ----------
    simple : int
        Sums, products, and those on bits that find the row of a table.
    divisions, powers : int
    """

    simple: int = 0
    divisions: int = 0
    powers: int = 0

    @property
    def count(self) -> int:
        """The weighted number of operations."""
        return self.simple + DIVISION * self.divisions + POWER * self.powers
