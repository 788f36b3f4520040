"""Laws of contact m xi'' + k xi^a + c xi^b xi' = 0; the paper's law of viscoelastic spheres is (3/2, 1/2).

xi is the compression of two bodies in contact, m their effective mass. In the units `Law.length_scale` and
`Law.time_scale` it is x'' + x^a + kappa x^b x' = 0, x(0) = 0, x'(0) = 1. For the coefficient of restitution eps the
family has one parameter, nu = (a + 1)/(b + 1). With the maximal compression x_max, r = (x/x_max)^((b+1)/n_b) and a
scaled speed g(r), nu = n_a/n_b, loading obeys

    d(g^2)/dr = -n_a r^(n_a-1) - n_a K g r^(n_b-1),    g(1) = 0,    V(K) = g(0),

and unloading the same with -K. eps0 = V(-K)/V(K) is the coefficient of restitution if contact ends at x = 0.
`derivations/15_laws.py` derives these formulas.
"""

from __future__ import annotations

import math
import sys
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from fractions import Fraction
from functools import cached_property
from typing import Literal, NamedTuple

from viscopade import arguments

End = Literal["force", "return"]
ENDS: tuple[End, ...] = ("force", "return")
Exponent = str | int | float | Fraction

# What is accepted is a choice; the theory has no such limits. The singularities of the flow in r, the roots of
# r^n_a = 1, come as near to r = 1 as 2 sin(pi/n_a), so that larger powers need more and more terms.
LARGEST_EXPONENT = 10  # of a and b; the laws with names below have 1 to 2 for a by default
LARGEST_POWER = 40  # of r = (x/x_max)^(1/m) in the polynomial flow of `viscopade.collision.flow`
LEAST_ELASTIC = Fraction(1, 1000)  # a number that a message can name for a > 0; m (a + 1) <= 40 allows a >= 1/39 anyway

_HALF = Fraction(1, 2)


class OwnDamping(NamedTuple):
    """A law's usual damping constant, such as a damping ratio: c is factor constant k^power mass^(1 - power)."""

    symbol: str
    definition: str
    """The constant in terms of c, k and the effective mass m."""
    unit: str
    factor: float
    power: Fraction

    def value(self, c: float, *, k: float, mass: float) -> float:
        """Return the constant, in `unit`, of the force k xi^a + c xi^b xi' between bodies of this effective mass.

        All arguments are numbers in SI units: c in N s/m^(b+1), k in N/m^a, mass in kg.
        """
        return float(c / (self.factor * k ** float(self.power) * mass ** float(1 - self.power)))


@dataclass(frozen=True, init=False)
class Law:
    """Law of contact x'' + x^a + kappa x^b x' = 0 with an end of contact.

    Parameters
    ----------
    elastic : str, int, float or Fraction
        Exponent a of the elastic force, > 0; taken exactly.
    damping : str, int, float or Fraction
        Exponent b of the compression in the damping, >= 0.
    end : str
        "force": contact ends where the force vanishes, x'' = 0. "return": it ends where x = 0 again.
        For nu <= 1 both are the same.

    Raises
    ------
    TypeError, ValueError
        If an exponent is not a number, is out of range, or has too large a denominator.

    Examples
    --------
    >>> Law("3/2", "1/2").nu
    Fraction(5, 3)
    """

    elastic: Fraction
    damping: Fraction
    end: End

    def __init__(self, elastic: Exponent, damping: Exponent, end: str = "force") -> None:
        """Check the exponents, which become fractions, and the end."""
        fields = {
            "elastic": _exponent("a", elastic, least=LEAST_ELASTIC),
            "damping": _exponent("b", damping, least=Fraction(0)),
            "end": end,
        }
        for name, value in fields.items():
            object.__setattr__(self, name, value)  # the class is frozen
        if str(end) not in ENDS:  # an array is compared with no text
            raise ValueError(arguments.refusal("end", end, "'force' or 'return'"))
        # Up to 40, a choice (above). The exact function integrates a polynomial flow in r with the powers m (a + 1) and
        # m (b + 1).
        if max(self.powers) > LARGEST_POWER:
            raise ValueError(
                f"the exponents {self} have too large denominators: expected a and b such that m (a + 1) and m (b + 1) "
                f"are integers up to {LARGEST_POWER} for some m, such as 3/2,1/4"
            )

    def __str__(self) -> str:
        """Return the exponents as A,B, the form of the command line."""
        return f"{self.elastic},{self.damping}"

    @property
    def equation(self) -> str:
        """The scaled equation of motion as text."""
        elastic, damping = map(_power_of_x, (self.elastic, self.damping))
        return f"x'' + {elastic} + kappa{damping and ' '}{damping} x' = 0"

    @property
    def force(self) -> str:
        """The force of the constants k and c as text."""
        elastic, damping = map(_power_of_x, (self.elastic, self.damping))
        return f"k {elastic} + c{damping and ' '}{damping} x'"

    @property
    def stiffness_unit(self) -> str:
        """SI unit of the constant k of the force k xi^a."""
        return f"N/{_metres(self.elastic)}"

    @property
    def damping_unit(self) -> str:
        """SI unit of the constant c of the force c xi^b xi'."""
        return f"N s/{_metres(self.damping + 1)}"

    @property
    def own_damping(self) -> OwnDamping | None:
        """The constant that papers and programs use in place of c, such as a damping ratio; None if there is none."""
        # nu = 2, oscillators: zeta = kappa/(2 sqrt(b + 1)), kappa = c/sqrt(k m), so c = 2 sqrt(b + 1) zeta sqrt(k m).
        # From zeta = 1 on, the end "return" does not exist.
        if self.nu == 2:
            root = "(2 sqrt(k m))" if self.damping == 0 else f"sqrt({4 * (self.damping + 1)} k m)"
            return OwnDamping("zeta", f"c/{root}", "", 2 * math.sqrt(self.damping + 1), _HALF)
        # a = b, Hunt and Crossley: the force is k xi^a (1 + d xi'), so c = d k.
        if self.elastic == self.damping:
            return OwnDamping("d", "c/k", "s/m", 1.0, Fraction(1))
        # b = a - 1, material of Kelvin and Voigt: the damping is A d(k xi^a)/dt, so c = a A k (the paper's Eq. 2: 3/2 A
        # rho).
        if self.elastic == self.damping + 1:
            top, bottom = self.elastic.numerator, self.elastic.denominator
            definition = f"{bottom} c/({top} k)" if bottom > 1 else f"c/({top} k)"
            return OwnDamping("A", definition, "s", float(self.elastic), Fraction(1))
        return None

    @cached_property
    def nu(self) -> Fraction:
        """(a + 1)/(b + 1), the only parameter of eps as a function."""
        return (self.elastic + 1) / (self.damping + 1)

    @property
    def n_a(self) -> int:
        """Numerator of nu in lowest terms; the elastic force is like r^(n_a - 1) in the turning point equation."""
        return self.nu.numerator

    @property
    def n_b(self) -> int:
        """Denominator of nu in lowest terms: the damping is g r^(n_b - 1) there."""
        return self.nu.denominator

    @cached_property
    def m(self) -> int:
        """The smallest m for which x = x_max r^m makes both forces polynomials in r; 2 for Hertz."""
        return math.lcm(self.elastic.denominator, self.damping.denominator)

    @cached_property
    def powers(self) -> tuple[int, int]:
        """M (a + 1) and m (b + 1), a multiple of n_a and n_b."""
        return int(self.m * (self.elastic + 1)), int(self.m * (self.damping + 1))

    @cached_property
    def delayed(self) -> bool:
        """Whether the force vanishes before x = 0, and contact ends there (the paper's Eq. 6)."""
        return self.end == "force" and self.nu > 1

    @cached_property
    def d(self) -> int:
        """Eps is a power series in v* = kappa^(1/d): 2 for the paper's law, v* = kappa^(1/2)."""
        return self.n_a - self.n_b if self.delayed else 1

    @property
    def c(self) -> Fraction:
        """1/nu - 1/2: kappa ~ v^(2 c), and ln eps0 is an odd function of kappa eps0^c."""
        return 1 / self.nu - Fraction(1, 2)

    @property
    def e(self) -> Fraction:
        """Exponent in eps = eps0 H(delta), delta = 2/(a+1) v*^n_a eps0^e: 1/2 for the paper's law."""
        return Fraction(2 * self.n_b - self.n_a, self.d)

    @property
    def kappa_scale(self) -> tuple[Fraction, Fraction]:
        """Base and exponent of ((a + 1)/2)^(1 - 1/nu), for kappa = base^exponent K V(K)^(2 c)."""
        return (self.elastic + 1) / 2, 1 - 1 / self.nu

    @property
    def bounded(self) -> bool:
        """Whether the end exists for small kappa only: "return", nu >= 2 (for nu = 2 below damping ratio 1)."""
        return self.end == "return" and self.nu >= 2

    @property
    def decay(self) -> Fraction | None:
        """Exponent p of eps ~ kappa^-p as kappa -> infinity, or None if the end does not exist there.

        With delayed recovery p = nu, because eps -> K^-nu; else p = nu/(2 - nu).
        """
        if self.delayed:
            return self.nu
        return None if self.bounded else self.nu / (2 - self.nu)

    @property
    def excess(self) -> int:
        """The k of the approximants [m/m+k] that decay nearly like eps: 3 for the paper's law, eps ~ v*^(-10/3)."""
        return 0 if self.decay is None else max(round(self.decay * self.d), 1)

    @cached_property
    def contact_time(self) -> float:
        """Duration of the undamped contact, tau_c at kappa = 0: pi for the linear spring, 3.218 for Hertz'."""
        # In units of `time_scale`: 2 int_0^x_max dx/sqrt(1 - 2 x^(a+1)/(a+1)), with x_max^(a+1) = (a+1)/2: a Beta
        # function of 1/(a+1) and 1/2.
        power = float(self.elastic) + 1
        gammas = math.gamma(1 + 1 / power) / math.gamma(0.5 + 1 / power)
        return 2 * math.sqrt(math.pi) * float((power / 2) ** (1 / power)) * gammas

    def kappa(self, speed: float, *, k: float, c: float, mass: float) -> float:
        """Return kappa = (c/mass) (k/mass)^(-(b+1)/(a+1)) v^(2/nu - 1).

        Parameters
        ----------
        speed : float
            Impact speed v > 0, length/time.
        k, c : float
            Constants of the force k xi^a + c xi^b xi', in N/m^a and N s/m^(b+1) if they are quantities with a unit. For
            Hertz' contact k is `Pair.rho`.
        mass : float
            Effective mass, `Pair.m_eff`.

        Raises
        ------
        TypeError, ValueError
            If a value is not a positive number (c and speed may be 0).
        """
        number = self._physical(speed=speed, k=k, damping=c, mass=mass)
        # (b+1)/(a+1) = 1/nu, and 2 c = 2/nu - 1.
        return number["damping"] / number["mass"] * _power(number, 1 / self.nu, 2 * self.c)

    def damping_constant(self, kappa: float, speed: float, *, k: float, mass: float) -> float:
        """Return c, `kappa` solved for it; the other arguments as for `kappa`."""
        return kappa / self.kappa(speed, k=k, c=1.0, mass=mass)

    def length_scale(self, speed: float, *, k: float, mass: float) -> float:
        """Return the unit of x, (k/mass)^(-1/(a+1)) v^(2/(a+1)), a length; arguments as for `kappa`."""
        power = 1 / (self.elastic + 1)
        return _power(self._physical(speed=speed, k=k, mass=mass), power, 2 * power)

    def time_scale(self, speed: float, *, k: float, mass: float) -> float:
        """Return the unit of tau, (k/mass)^(-1/(a+1)) v^((1-a)/(a+1)), a time; arguments as for `kappa`."""
        power = 1 / (self.elastic + 1)
        return _power(self._physical(speed=speed, k=k, mass=mass), power, 2 * power - 1)

    def _physical(self, **values: float) -> dict[str, float]:
        """Return checked physical quantities by their names: speed, k, damping (the constant c), mass.

        Speed and damping may be 0, the others are positive; quantities with a unit (of Astropy or Pint) are converted.
        """
        # The units of k and c depend on the exponents; `arguments` has those of speed (m/s) and mass (kg), and its
        # `exact_number` returns a number, or a quantity in this unit, as a fraction.
        units = {"k": self.stiffness_unit, "damping": self.damping_unit}
        accepted = "a positive number (speed and damping may be 0)"

        def number(name: str, value: float) -> float:
            # From 0 or the smallest positive double to the largest double; the exact number is then rounded to a
            # double.
            low = Fraction(0.0 if name in ("speed", "damping") else math.ulp(0))
            high = Fraction(sys.float_info.max)
            return float(arguments.exact_number(name, value, accepted, lambda x: low <= x <= high, units.get(name)))

        return {name: number(name, value) for name, value in values.items()}


def _power_of_x(power: Fraction) -> str:
    """Return x^power as text."""
    return "" if power == 0 else "x" if power == 1 else f"x^{power}" if power.denominator == 1 else f"x^({power})"


def _metres(power: Fraction) -> str:
    """Return the unit m^power as text."""
    return _power_of_x(power).replace("x", "m")


def _exponent(name: str, value: object, least: Fraction) -> Fraction:
    """Return `value` as an exact exponent of a law, from `least` to 10; a string may be a fraction, such as 3/2.

    `name` is that of the exponent in messages, such as a. The largest exponent, 10, is a choice (`LARGEST_EXPONENT`).
    """
    accepted = f"a rational number such as 3/2 or 0.25, from {least} to {LARGEST_EXPONENT}"
    if isinstance(value, str) and value.count("/") == 1:
        # Numerator and denominator; a number with ten digits or more (a choice) is no exponent that anybody means.
        top, bottom = (
            arguments.exact_number(name, part, accepted, lambda x: abs(x) < 10**9) for part in value.split("/")
        )
        if not (bottom and least <= top / bottom <= LARGEST_EXPONENT):
            raise ValueError(f"{name} is {value!r}: expected {accepted}")
        value = top / bottom
    return arguments.exact_number(name, value, accepted, lambda x: least <= x <= LARGEST_EXPONENT)


def _power(number: dict[str, float], compliance: Fraction, speed: Fraction) -> float:
    """Return (mass/k)^compliance v^speed, two given powers of the values in `number`: "mass", "k" and "speed" (v)."""
    # At v = 0 a negative power is infinite, where Python's raises an error.
    v = number["speed"]
    factor = math.inf if v == 0 and speed < 0 else float(v ** float(speed))
    return float((number["mass"] / number["k"]) ** float(compliance)) * factor


# --- laws with names --------------------------------------------------------------------------------------------------


class NamedLaw(NamedTuple):
    """A law of the literature; some have an exponent n."""

    exponents: Callable[[Fraction], tuple[Fraction, Fraction]]
    n: Fraction | None = None
    """The default of the exponent; None for a law without an exponent."""


NAMED = {
    # viscoelastic spheres: the paper's law, its Eq. 2
    "viscoelastic": NamedLaw(lambda _: (Fraction(3, 2), _HALF)),
    # spring-dashpot
    "linear": NamedLaw(lambda _: (Fraction(1), Fraction(0))),
    # Hertz' spring with the damping of Tsuji et al. 1992
    "tsuji": NamedLaw(lambda _: (Fraction(3, 2), Fraction(1, 4))),
    # force k xi^n (1 + d xi')
    "hunt-crossley": NamedLaw(lambda n: (n, n), Fraction(3, 2)),
    # axisymmetric body of profile r^n made of a Kelvin-Voigt material, cone 1, sphere 2
    "kelvin-voigt": NamedLaw(lambda n: (1 + 1 / n, 1 / n), Fraction(2)),
}

ACCEPTED_LAWS = (
    ", ".join(name if named.n is None else f"{name}[:n]" for name, named in NAMED.items())
    + ", or the exponents a,b such as 3/2,1/4"
)

VISCOELASTIC = Law(Fraction(3, 2), _HALF)
"""The paper's law."""


def law_of(text: str | Law, end: str | None = None) -> Law:
    """Return the law of a name such as "tsuji" or "hunt-crossley:1", or of exponents such as "3/2,1/4".

    Parameters
    ----------
    text : str or Law
        A law is returned unchanged, except for its end.
    end : str, optional
        "force" or "return". By default the end of the given law, and "force" for a name.

    Raises
    ------
    TypeError, ValueError
        If the law is not known, or its exponents are out of range (`Law`).

    Examples
    --------
    >>> law_of("kelvin-voigt:1").nu
    Fraction(3, 2)
    """
    if isinstance(text, Law):
        return text if end is None else Law(text.elastic, text.damping, end)
    if not isinstance(text, str):
        raise TypeError(arguments.refusal("law", text, f"{ACCEPTED_LAWS}, or a Law"))
    name, _, n = text.strip().partition(":")
    numbers = text.split(",")
    # A name, and for some laws an exponent: "hunt-crossley:3/2". n from 1/10 on, as Kelvin-Voigt bodies have b = 1/n,
    # and b is 10 at most (`LARGEST_EXPONENT`, a choice). Laws without an exponent get 1, which they do not use.
    if name in NAMED and (not n or NAMED[name].n is not None):
        named = NAMED[name]
        exponent = _exponent("n", n, Fraction(1, LARGEST_EXPONENT)) if n else named.n or Fraction(1)
        exponents: Sequence[Exponent] = named.exponents(exponent)
    # Two exponents, "3/2,1/4".
    elif len(numbers) == 2:
        exponents = [number.strip() for number in numbers]
    else:
        near = arguments.suggestion(name, NAMED) if name not in NAMED else ""
        raise ValueError(f"law is {text!r}{near or f': expected {ACCEPTED_LAWS}'}")
    a, b = exponents
    return Law(a, b, end or "force")
