"""The paper's printed numbers (Müller & Pöschel 2011), and their comparison with ours."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from decimal import ROUND_HALF_EVEN, Decimal

from viscopade import arguments
from viscopade.theory.pade import Pade, pade

CITATION = "Müller & Pöschel (2011), Collision of viscoelastic spheres: compact expressions, the paper's Table I"

# (a_0 … a_m, b_0 … b_n) as printed in the paper's Table I.
TABLE: Mapping[tuple[int, int], tuple[tuple[str, ...], tuple[str, ...]]] = {
    (0, 3): (("1.",), ("1", "0", "1.15345", "0")),
    (1, 4): (("1.", "0.501086"), ("1.", "0.501086", "1.15345", "0.577977", "0.532178")),
    (2, 5): (
        ("1.", "0.553528", "-0.128445"),
        ("1.", "0.553528", "1.025", "0.638466", "0.384023", "0.027908"),
    ),
    (3, 6): (
        ("1.", "1.07232", "0.574198", "0.141552"),
        ("1.", "1.07232", "1.72765", "1.37842", "1.19449", "0.467273", "0.235585"),
    ),
}

# The table has at least five decimals, without zeros at the end: "1.025" stands for 1.02500 and "1." for 1.00000.
LEAST_DECIMALS = 5

# Material constant of ice, beta in (s/cm)^(1/5) (after the paper's Eq. 6; from Bridges et al.).
BETA_ICE_CGS = "1.307"


def last_digit(printed: str) -> Decimal:
    """Return one unit in a number's last printed digit, with trailing zeros that the table omits restored."""
    return Decimal(1).scaleb(-max(len(printed.partition(".")[2]), LEAST_DECIMALS))


@dataclass(frozen=True)
class PrintedCoefficient:
    """A printed coefficient of the paper's Table I beside ours.

    Attributes
    ----------
    m, n : int
        The approximant.
    symbol : str
        "a" or "b".
    index : int
    printed : str
        The number in the paper.
    ours : str
        Our value, to more digits.
    """

    m: int
    n: int
    symbol: str
    index: int
    printed: str
    ours: str

    @property
    def name(self) -> str:
        """The coefficient's name, such as b_3."""
        return f"{self.symbol}_{self.index}"

    @property
    def rounded(self) -> str:
        """Our value rounded to the digits of the paper."""
        return str(Decimal(self.ours).quantize(last_digit(self.printed), ROUND_HALF_EVEN))

    @property
    def agrees(self) -> bool:
        """Whether the printed and our rounded value are equal."""
        return Decimal(self.printed) == Decimal(self.rounded)


def approximants(digits: int) -> tuple[Pade, ...]:
    """Return the approximants of the paper's table, derived to 12 digits or more, because `compare` rounds them.

    The table has up to six digits; the other six, a choice, tell to which of these ours rounds. The most digits are a
    choice of `arguments`, against typing errors.
    """
    digits = arguments.integer("digits", digits, 12, arguments.MAX_DIGITS)
    return tuple(pade(m, n, digits) for m, n in TABLE)


def compare(ours: Iterable[Pade]) -> tuple[PrintedCoefficient, ...]:
    """Return every entry of the paper's table beside ours, in the printed order (32 entries for all four)."""
    # For each approximant first the a_k, then the b_k; `decimals` has ours in this order, too.
    return tuple(
        PrintedCoefficient(p.m, p.n, symbol, index, printed, our_decimal)
        for p in ours
        for symbol, row, decimals in zip("ab", TABLE[p.m, p.n], p.decimals(), strict=True)
        for index, (printed, our_decimal) in enumerate(zip(row, decimals, strict=True))
    )
