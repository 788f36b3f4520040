"""Taylor coefficients of the flow of a collision, one by one (docs/theory/exact-function.md).

With r = 1 - u, Y = u', S = r^common and V = elastic r^e + viscous r^v Y the flow is u'' = S V, and

    (j+1) (j+2) u_{j+2} = sum_i S_i V_{j-i}.

Coefficients are integers in units of 2^-bits, and every product is rounded down. The extension (native/recursion.c)
computes the same integers. No proof trusts either: `validation` bounds the residual of what they return.
"""

from collections.abc import Iterable
from operator import mul
from typing import Any, NamedTuple

from flint import fmpz

from viscopade.compiled import extension

# Of the extension's digits: 7 whole bytes, and products of two digits leave 16 bits of 128 for their sums.
DIGIT_BITS = 56
SPARE_BITS = 8  # by which coefficients may exceed 1 in the extension
FMPZ_FROM_BITS = 500  # FLINT's integers are faster than Python's from there on (measured)


class Recursion(NamedTuple):
    """A flow and its first two coefficients; both constants are dyadic numbers, mantissa 2^exponent."""

    start: int
    slope: int
    elastic: tuple[int, int]
    viscous: tuple[int, int]
    powers: tuple[int, int, int]
    """The exponents common, e and v."""
    bits: int

    def coefficients(self, terms: int) -> list[int]:
        """Return the coefficients u_0, u_1, … ."""
        integers = self.compiled(terms)
        return self.in_python(terms) if integers is None else integers

    def compiled(self, terms: int) -> list[int] | None:
        """Return the first `terms` coefficients by the extension; None without it, or if a number is too long."""
        if extension is None:
            return None
        constants = self.start, self.slope, self.elastic[0], self.viscous[0]
        # Numbers of the extension have digits of 56 bits; the longest one decides how many.
        digits = max(self.bits + SPARE_BITS, *(c.bit_length() for c in constants)) // DIGIT_BITS + 1
        size = DIGIT_BITS // 8 * digits  # bytes of a number, 8 bits each
        # The powers of r that occur, in the order in which the extension computes them: 1, r, and products of two
        # earlier ones. It takes a power as its position in this order, and numbers as bytes, least first, in two's
        # complement.
        products = products_for(self.powers)
        powers = [0, 1, *(power for power, _, _ in products)]
        packed = extension.taylor(
            digits,
            b"".join(c.to_bytes(size, "little", signed=True) for c in constants),
            (-self.elastic[1], -self.viscous[1]),
            self.bits,
            terms,
            bytes(powers.index(factor) for _, *factors in products for factor in factors),
            bytes(map(powers.index, self.powers)),
        )
        if packed is None:
            return None
        return [int.from_bytes(packed[i : i + size], "little", signed=True) for i in range(0, len(packed), size)]

    def in_python(self, terms: int) -> list[int]:
        """Return the first `terms` coefficients by Python's integers, or FLINT's."""
        # u, Y = u' and r = 1 - u as lists of coefficients; then s = r^common, spring = r^e and drag = r^v.
        kind: Any = fmpz if self.bits >= FMPZ_FROM_BITS else int
        u, y = [kind(self.start), kind(self.slope)], [kind(self.slope)]
        r = [(1 << self.bits) - u[0], -u[1]]
        products = products_for(self.powers)
        powers_of_r: dict[int, list[Any]] = {0: [], 1: r} | {power: [] for power, _, _ in products}
        s, spring, drag = (powers_of_r[power] for power in self.powers)
        v: list[Any] = []
        # elastic = stiffness 2^stiffness_exponent, viscous = damper 2^damper_exponent
        (stiffness, stiffness_exponent), (damper, damper_exponent) = self.elastic, self.viscous
        for j in range(terms - 2):
            powers_of_r[0].append(0 if j else 1 << self.bits)  # r^0 = 1 + 0 z + 0 z^2 + …
            # The powers of r: a square needs half of its products, 2 sum_{i<j/2} r_i r_{j-i}, and the middle one.
            half = (j + 1) // 2
            for power, first, second in products:
                left = powers_of_r[first]
                if first == second:
                    value = 2 * sum(map(mul, left[:half], left[j : j - half : -1])) if half else 0
                    value += left[half] ** 2 if j % 2 == 0 else 0
                else:
                    value = sum(map(mul, left, powers_of_r[second][j::-1]))
                powers_of_r[power].append(value >> self.bits)
            # V_j = elastic (r^e)_j + viscous (r^v Y)_j, then u_{j+2} by the recursion, r = 1 - u and Y = u'.
            damping = sum(map(mul, drag, reversed(y))) >> self.bits if self.powers[2] else y[j]
            v.append(shifted(stiffness * spring[j], stiffness_exponent) + shifted(damper * damping, damper_exponent))
            u.append((sum(map(mul, s, reversed(v))) >> self.bits) // ((j + 1) * (j + 2)))
            r.append(-u[-1])
            y.append((j + 2) * u[-1])
        return list(map(int, u))


def products_for(powers: Iterable[int]) -> list[tuple[int, int, int]]:
    """Return how powers are found: the powers above 1 that this takes, ascending, each with its two factors.

    An even power is a square, an odd one the power before it times the first.
    """
    # From the largest power down: the factors that a power needs are needed, too.
    needed = set(powers)
    for power in range(max(needed), 1, -1):
        if power in needed:
            needed.add(power - 1 if power % 2 else power // 2)
    return [(n, n - 1, 1) if n % 2 else (n, n // 2, n // 2) for n in sorted(needed - {0, 1})]


def shifted(number: int, exponent: int) -> int:
    """Return number 2^exponent, rounded down."""
    return number << exponent if exponent >= 0 else number >> -exponent
