"""Kernels from speed to eps: a speed table over w = beta^5 speed = v*^10, and a kernel of v* beyond its ends."""

from __future__ import annotations

from dataclasses import dataclass
from fractions import Fraction
from functools import cached_property
from itertools import chain
from types import MappingProxyType
from typing import NamedTuple

from viscopade.arithmetic.decimals import at_most, identifier
from viscopade.arithmetic.formats import DOUBLE, FLOAT, Format
from viscopade.kernels.forms import last_place
from viscopade.kernels.forms.kernel import identity_of
from viscopade.kernels.forms.lacunary_kernels import HalfLineKernel
from viscopade.kernels.forms.speed_table import Table
from viscopade.kernels.forms.speed_table_last_place import LastPlaceTable
from viscopade.kernels.names import FAST, SMALL

FIRST = -96

TABLES = MappingProxyType(
    {
        ("1e-5", FAST): Table(6, FIRST, 1, FLOAT),
        ("1e-5", SMALL): Table(2, FIRST, 3, FLOAT),
        ("1e-10", FAST): Table(4, FIRST, 5, DOUBLE),
    }
)
"""By accuracy and size, the tables that are exported."""


class Beyond(NamedTuple):
    """What is stated of eps and 1 - eps outside a table, besides what v*'s rounding does."""

    formula: Fraction
    """Error relative to the smaller of eps and 1 - eps."""
    of_epsilon: Fraction
    of_loss: Fraction
    """Relative rounding errors of eps and of 1 - eps."""
    underflow: Fraction
    """Error of eps and of 1 - eps besides, in the smallest numbers."""


@dataclass(frozen=True)
class SpeedKernel:
    """A speed table, and the kernel of v* for speeds beyond it.

    Attributes
    ----------
    tier : str
        The accuracy asked for, or "full".
    table : Table or LastPlaceTable
    slow : HalfLineKernel or None
        For w outside the table; None for the function of full accuracy.
    """

    tier: str
    table: Table | LastPlaceTable
    slow: HalfLineKernel | None

    @property
    def bytes(self) -> int:
        """Size of the table in memory."""
        return self.table.bytes

    @cached_property
    def bound(self) -> str:
        """Proven bound of |eps - formula|/min(eps, 1 - eps), for all speeds; without rounding."""
        if isinstance(self.table, LastPlaceTable):
            return at_most(self.table.proven.relative)
        beyond = [at_most(self.slow.variant(DOUBLE).certificate.bound)] if self.slow else []
        return max([at_most(self.table.proven.error), *beyond], key=Fraction)

    @property
    def name(self) -> str:
        """The end of the functions' names, which lasts: "1em5", "full"."""
        return identifier(self.tier)

    @cached_property
    def identity(self) -> str:
        """A number that other tables do not have, for include guards."""
        return identity_of(" ".join(map(float.hex, chain(*self.table.rows))))

    @property
    def file(self) -> str:
        """Name of the header in exports/."""
        return file_of(self.tier)

    @cached_property
    def beyond(self) -> Beyond:
        """What is stated where w is not in the table."""
        if self.slow is None:
            eps, loss = (last_place.largest_ulp(of) for of in last_place.FUNCTIONS)
            return Beyond(Fraction(0), eps * Fraction(DOUBLE.epsilon), loss * Fraction(DOUBLE.epsilon), Fraction(1, 2))
        variant = self.slow.variant(DOUBLE)
        eps, loss = (Fraction(variant.rounding(of)) for of in last_place.FUNCTIONS)
        return Beyond(variant.error, eps, loss, max(Fraction(size.underflow) for _, size in variant.sizes))

    def computed_in(self, form: Format) -> Format:
        """Return the type in which the sums of the functions of a type are computed."""
        return form if form in self.formats else DOUBLE

    @property
    def formats(self) -> tuple[Format, ...]:
        """The types in which the sums are computed."""
        return self.table.types if isinstance(self.table, Table) else (DOUBLE,)


def file_of(tier: str) -> str:
    """Return the name of a kernel's header in exports/."""
    return f"viscopade_speed_{tier.replace('-', 'm')}.h"
