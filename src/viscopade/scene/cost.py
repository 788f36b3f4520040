"""Costs of kernels: a weighted count of operations."""

from __future__ import annotations

from dataclasses import dataclass

# In multiplications: about what these take on processors of our days (docs/results/benchmark.md).
DIVISION, POWER, CUBE_ROOT = 4, 50, 50
COSTS = f"a count of operations (a division counts {DIVISION}, a power {POWER}, a cube root {CUBE_ROOT})"


@dataclass(frozen=True)
class Operations:
    """Operations of one evaluation.

    Attributes
    ----------
    simple : int
        Sums, products, and those on bits that find the row of a table.
    divisions, powers, cube_roots : int
    """

    simple: int = 0
    divisions: int = 0
    powers: int = 0
    cube_roots: int = 0

    @property
    def count(self) -> int:
        """The weighted number of operations."""
        return self.simple + DIVISION * self.divisions + POWER * self.powers + CUBE_ROOT * self.cube_roots
