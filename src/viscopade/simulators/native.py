"""Native parameters: what a user's file says of a contact, and the collision that the program makes of it.

`Native` is what a module says of its simulator for `viscopade audit SIMULATOR --set "NAME=VALUE" … --speed V`. All eps
here are sampled (`viscopade.collision.contact`).
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field, replace
from decimal import Decimal
from typing import Any, NamedTuple

import numpy as np
from mpmath import mp
from numpy.typing import ArrayLike

from viscopade import arguments, quantity
from viscopade.arrays.checked import FloatArray
from viscopade.collision import adhesion
from viscopade.collision.adhesion import Sticking
from viscopade.collision.contact import (
    PHASES,
    Contact,
    SampledCollision,
    damping_factor,
    phase_range,
    resolved,
    sticking_speed,
)
from viscopade.collision.schemes import SEMI_IMPLICIT, Scheme
from viscopade.collision.weight import COUNTS, EARTH
from viscopade.simulators.formula import DampingFormula
from viscopade.simulators.setup import Units, with_two_digits
from viscopade.theory.law import Law

# Time steps in an undamped contact, below which a warning says that eps depends on where in a step contact begins: the
# force then acts in one or two steps.
_FEW_STEPS = 2
# More steps in a contact are computed as infinitely many. With 5000 the mean eps is off by up to 7e-5 with
# semi-implicit Euler's method and 9e-4 with implicit Euler's (measured for all formulas of the audit, eps from 0.1 to
# 0.9).
_MOST_STEPS = 5000
# With more steps in a contact the speed below which the weight keeps a body down is computed without steps: with 500
# eps differs over the phases by at most 0.002 (measured for all formulas of the audit), and steps would take minutes.
_FINE_STEPS = 500
SAME = 1e-4
"""Difference of two eps that count as one: eps is printed with four decimals."""
SPREAD = 0.02
"""Range of eps over where in a step contact begins, above which texts warn of it; chosen by hand."""


@dataclass(frozen=True)
class Parameter:
    """What a user's file says of a contact: numbers, or a word.

    Attributes
    ----------
    name : str
        As in the file.
    unit : str
        SI unit of the numbers; "" if they have none, or are in the units of the file.
    default : str or None
        The program's; None if the parameter may be missing.
    accepted : str
        What is expected, in words.
    allowed : callable
        Whether numbers, a tuple, are accepted.
    max_numbers : int
        How many numbers it has at most; the default has those that a file leaves out.
    per_body : bool
        Whether each of both bodies has a number, or a word; a single one is that of both. If a body has several
        numbers, a comma stands between those of both bodies, "0.02 1, 0.01 0.5", and the value is two tuples.
    words : tuple of str
        The accepted words, if it has no numbers.
    least_epsilon : float or None
        If the parameter is a coefficient of restitution, the least one that is written instead of the user's.
    other_units : mapping of str to str
        SI units that differ from `unit`, by the integrator with which the program has them.
    """

    name: str
    unit: str = ""
    default: str | None = None
    accepted: str = "a number >= 0"
    allowed: Callable[[tuple[float, ...]], bool] = lambda numbers: all(x >= 0 for x in numbers)
    max_numbers: int = 1
    per_body: bool = False
    words: tuple[str, ...] = ()
    least_epsilon: float | None = None
    other_units: Mapping[str, str] = field(default_factory=dict)

    @property
    def summary(self) -> str:
        """Name, accepted values, unit and default, such as "kn (a number > 0, Pa)", for a list of parameters."""
        # The unit may depend on the integrator, such as "N/m or 1/s^2 with implicit".
        unit = " or ".join((self.unit, *(f"{other} with {name}" for name, other in self.other_units.items())))
        what = "|".join(self.words) if self.words else self.accepted + (f", {unit}" if unit else "")
        if self.per_body:
            what += (
                ", one for both bodies or two"
                if self.max_numbers == 1
                else ", of both bodies, or of each with a comma between"
            )
        return f"{self.name} ({what}{'' if self.default is None else f'; default {self.default}'})"

    def value(self, text: str) -> Any:
        """Return the word, the number or the numbers that a text says; a tuple if there may be several.

        Raises
        ------
        ValueError
            If it is not accepted.
        """
        text = text.strip()

        # A word, or one of each body.
        if self.words:
            words = text.split() if self.per_body else [text]
            if not 0 < len(words) <= 2 or not {*words} <= {*self.words}:
                two = ", or two of them" if self.per_body else ""
                raise ValueError(f"{self.name} is {text!r}: expected {', '.join(self.words)}{two}")
            return (words[0], words[-1]) if self.per_body else text

        # Several numbers of each body, with a comma between both: each side is the text of one body.
        if self.per_body and self.max_numbers > 1:
            bodies = text.split(",")
            # "0.02, 1" may be two numbers of one body, or one number of each of two.
            if len(bodies) > 2 or (len(bodies) == 2 and max(len(body.split()) for body in bodies) == 1):
                separated = "numbers apart by spaces, and at most one comma, between both bodies"
                raise ValueError(f"{self.name} is {text!r}: expected {separated}")
            first, *second = (replace(self, per_body=False).value(body) for body in bodies)
            return (first, *second) if second else (first, first)

        # One number, one of each body, or several of the contact.
        numbers = self._numbers(text)
        if numbers is None or not all(map(math.isfinite, numbers)) or not self.allowed(numbers):
            unit = f", in {self.unit}" if self.unit else ""
            raise ValueError(f"{self.name} is {text!r}: expected {self.accepted}{unit}")
        return numbers if self.max_numbers > 1 or self.per_body else numbers[0]

    def text(self, value: Any) -> str:
        """Return a value as a file has it: the inverse of `value`. Equal numbers of both bodies stand once."""
        items = value if isinstance(value, tuple) else (value,)
        different = items[:1] if self.per_body and items[0] == items[-1] else items
        if self.per_body and self.max_numbers > 1:
            return ", ".join(replace(self, per_body=False).text(body) for body in different)
        # 8 digits of a number: they decide eps to 1e-8, and four decimals of eps are printed.
        return " ".join(item if isinstance(item, str) else f"{item:.8g}" for item in different)

    def _numbers(self, text: str) -> tuple[float, ...] | None:
        """Return the numbers in `text`, in `unit`, completed by those of the default; None if they are none."""
        # Plain numbers have spaces or commas between them. Numbers with a unit, "3 kN/m, 4 N/m", have commas.
        numbers = [_plain(word) for word in text.replace(",", " ").split()]
        if None in numbers and self.unit:
            numbers = [quantity.decimal_in(part, self.unit) for part in text.split(",")]
        if not 0 < len(numbers) <= (2 if self.per_body else self.max_numbers) or None in numbers:
            return None
        # A single number is that of both bodies; numbers that a file leaves out at the end are those of the default.
        if self.per_body and len(numbers) == 1:
            numbers *= 2
        rest = self.default.split()[len(numbers) :] if self.default and not self.per_body else []
        return (*(float(number) for number in numbers if number is not None), *map(float, rest))


def _plain(text: str) -> Decimal | None:
    """Return the double nearest to a number without a unit; None if the text is no number below 1e300."""
    try:
        # 1e300 is below the largest double, 1.8e308.
        number = arguments.exact_number("", text, "", lambda x: abs(x) < 10**300)
    except ValueError:
        return None
    return Decimal(float(number))


class Rule(NamedTuple):
    """A rule by which programs make one number of those of two bodies.

    Attributes
    ----------
    words : str
        Its name, such as "the mean".
    number : callable
        From the numbers of both bodies to that of their contact.
    """

    words: str
    number: Callable[[float, float], float]

    def mix(self, first: Any, second: Any) -> Any:
        """Return the number of the contact of two bodies; of tuples of numbers the tuple, number by number."""
        return tuple(map(self.number, first, second)) if isinstance(first, tuple) else self.number(first, second)


MEAN = Rule("the mean", lambda first, second: (first + second) / 2)
HARMONIC = Rule("the harmonic mean", lambda first, second: 2 * first * second / (first + second) if first else 0.0)
SERIES = Rule("half of the harmonic mean", lambda first, second: HARMONIC.number(first, second) / 2)
SUM = Rule("the sum", lambda first, second: first + second)
SMALLER, LARGER = Rule("the smaller", min), Rule("the larger", max)


def weighted_mean(weights: tuple[float, float], words: str) -> Rule:
    """Return the rule of the mean with the `weights` of both bodies, > 0 in sum; `words` says what they are."""
    share = weights[0] / sum(weights)
    return Rule(f"the mean, weighted by {words},", lambda first, second: share * first + (1 - share) * second)


class Mixed(NamedTuple):
    """A number of a contact that a program makes of different ones of two bodies.

    Attributes
    ----------
    value : float, or tuple of float
    rule : str
        Words of the rule.
    meaning : str
        What the numbers of the bodies are, "" if they are the parameter's.
    bodies : tuple
        The values of both.
    source : str
        Function of the program that has the rule.
    """

    value: Any
    rule: str
    meaning: str
    bodies: tuple[Any, Any]
    source: str

    def sentence(self, name: str) -> str:
        """Return "NAME = 15, the mean of 10 and 20 (mixContact)" for the number called `name`; without a full stop."""
        # The number of the contact and those of both bodies as texts, with 8 digits as in a file.
        value, first, second = (
            " ".join(f"{number:.8g}" for number in (value if isinstance(value, tuple) else (value,)))
            for value in (self.value, *self.bodies)
        )
        meaning = f"{self.meaning}, " if self.meaning else ""
        return f"{name} = {value}, {self.rule} of {meaning}{first} and {second} ({self.source})"


class Values(dict[str, Any]):
    """Values of parameters by name; one that is missing is asked for in one line.

    Attributes
    ----------
    read : set of str
        Names of those that were looked up.
    mixed : mapping of str to Mixed
        Numbers that are not those of both bodies, by name.
    """

    def __init__(self, *values: Any) -> None:
        super().__init__(*values)
        self.read: set[str] = set()
        self.mixed: dict[str, Mixed] = {}

    def mix(
        self, name: str, rule: Rule, source: str, bodies: tuple[float, float] | None = None, meaning: str = ""
    ) -> Any:
        """Return the number of a contact, and remember the rule if it is not the number of both bodies.

        Parameters
        ----------
        name : str
            Of the number.
        rule : Rule
        source : str
            Function of the program that has the rule.
        bodies : tuple of float, optional
            Numbers of both bodies; by default those of the parameter of that name.
        meaning : str, optional
            What they are, if they are not the parameter's.
        """
        first, second = self[name] if bodies is None else bodies  # `self[name]`: two numbers, or two tuples of them
        value = rule.mix(first, second)
        # A product or a sum of two equal numbers is another number, too.
        is_other = bodies is None and isinstance(value, float) and not math.isclose(value, first)
        if first != second or is_other:
            self.mixed[name] = Mixed(value, rule.words, meaning, (first, second), source)
        return value

    def single(self, name: str, reason: str) -> float:
        """Return the one number of a parameter; ValueError with the reason if there are different ones."""
        first, second = self[name]
        if first != second:
            raise ValueError(f"{name} is {first:g} {second:g}: expected one number, {reason}")
        return float(first)

    def __getitem__(self, name: str) -> Any:
        """Return a value."""
        self.read.add(name)
        return super().__getitem__(name)

    def __contains__(self, name: object) -> bool:
        """Return whether there is a value, which decides what a contact is."""
        self.read.add(str(name))
        return super().__contains__(name)

    def __missing__(self, name: str) -> Any:
        """Raise ValueError."""
        raise ValueError(f'{name} is not set, and the program has no default: expected --set "{name}=…"')


@dataclass(frozen=True)
class FileUnits(Units):
    """The units of all numbers in a user's file: their names, and their sizes in SI units."""

    metres: float = 1.0
    kilograms: float = 1.0
    seconds: float = 1.0
    unsized: str = ""
    """If the units have no size: why a quantity cannot have a unit."""

    @property
    def energy(self) -> str:
        """Unit of energies."""
        return "J" if self == FileUnits() else f"{self.mass} {self.length}^2/{self.time}^2"


@dataclass(frozen=True)
class Impact:
    """Two bodies that collide, or one and a plane, in the units of the user's file.

    Attributes
    ----------
    speed : float
        Impact speed > 0.
    mass, radius : float or None
        Effective mass and radius; None if nothing is known of them.
    gravity : float
        Acceleration that presses the bodies together.
    step : float or None
        Time step; None for infinitely fine ones.
    """

    speed: float
    mass: float | None = None
    radius: float | None = None
    gravity: float = 0.0
    step: float | None = None

    @property
    def effective_mass(self) -> float:
        """The mass; ValueError if it is not known."""
        if self.mass is None:
            raise ValueError(
                "mass is missing: expected --mass, the effective mass m1 m2/(m1 + m2); at a plane, the sphere's mass"
            )
        return self.mass

    @property
    def effective_radius(self) -> float:
        """The radius; ValueError if it is not known."""
        if self.radius is None:
            raise ValueError(
                "radius is missing: expected --radius, the effective radius R1 R2/(R1 + R2); at a plane, the sphere's "
                "radius"
            )
        return self.radius

    def in_units(self, units: FileUnits) -> Impact:
        """Return the same impact in the units of a file; its own numbers are in SI units."""
        # `units.metres` is the size of the file's unit of length in metres; so are kilograms and seconds.
        metres, seconds = units.metres, units.seconds
        return Impact(
            self.speed * seconds / metres,
            None if self.mass is None else self.mass / units.kilograms,
            None if self.radius is None else self.radius / metres,
            self.gravity * seconds**2 / metres,
            None if self.step is None else self.step / seconds,
        )


class Power(NamedTuple):
    """The force F = k x^a + c x^b v of the compression x and its rate v.

    Attributes
    ----------
    law : Law
        The exponents a (elastic) and b (damping), and the end of contact.
    k, c : float
        Stiffness and damping constant, in units of the file: k x^a and c x^b v are forces.
    """

    law: Law
    k: float
    c: float

    def contact(self, impact: Impact) -> Contact:
        """Return the contact with this force; its load is the weight m g of the effective mass of `impact`."""
        a, b, mass = float(self.law.elastic), float(self.law.damping), impact.effective_mass
        k, c = self.k, self.c
        return Contact(lambda x, v: k * x**a + c * x**b * v, mass, mass * impact.gravity, self.law.end)

    def damping_number(self, kappa: float, impact: Impact) -> float:
        """Return the number of a file that gives the scaled damping `kappa`.

        This force is the one with the number 1 in the file, and c is in proportion to that number. kappa is
        (c/m) (k/m)^(-(b+1)/(a+1)) v^(2/nu - 1) with the speed v of `impact`.
        """
        return self.law.damping_constant(kappa, impact.speed, k=self.k, mass=impact.effective_mass) / self.c


def power_force(formula: DampingFormula, number: float, k: float, mass: float) -> Power:
    """Return the force that a program makes of `number`, by its formula for a law with nu = (a + 1)/(b + 1) = 2.

    `k` is the stiffness and `mass` the effective mass, in units of the file.
    """
    # kappa = (c/m) (k/m)^(-1/nu) v^(2/nu - 1), which for nu = 2 is c/sqrt(k m) at every speed.
    return Power(formula.law, k, float(formula.kappa(mp.mpf(number))) * math.sqrt(k * mass))


def effective_modulus(values: Values, young: tuple[float, float], poisson: tuple[float, float], source: str) -> float:
    """Return E_eff of Hertz' contact, a pressure, from the Young moduli and Poisson ratios of both bodies.

    `values` remembers it as a number that `source`, a function of the program, makes of two.
    """
    # 1/E_eff = (1 - nu_1^2)/E_1 + (1 - nu_2^2)/E_2
    first, second = (modulus / (1 - nu**2) for modulus, nu in zip(young, poisson, strict=True))
    return float(values.mix("E_eff", SERIES, source, (first, second), "E/(1 - nu^2)"))


def effective(values: Sequence[float | None]) -> float | None:
    """Return x y/(x + y) of the masses or radii of two bodies, x of one body at a wall; None if a number is missing."""
    numbers = [value for value in values if value is not None]
    if not numbers or len(numbers) < len(values):
        return None
    return numbers[0] if len(numbers) == 1 else math.prod(numbers) / sum(numbers)


def positive(name: str, unit: str, default: str | None = None, *, per_body: bool = False) -> Parameter:
    """Return a parameter that is > 0."""
    return Parameter(name, unit, default, "a number > 0", lambda numbers: min(numbers) > 0, per_body=per_body)


def poisson_ratios(name: str, default: str | None = None, *, per_body: bool = True) -> Parameter:
    """Return the parameter for the Poisson ratios of both bodies, or of a wall alone."""
    return Parameter(
        name, "", default, "from -1 to 1/2", lambda pair: all(-1 < nu <= 0.5 for nu in pair), per_body=per_body
    )


def restitution(
    name: str,
    default: str | None = None,
    *,
    above: float | None = 0,
    least_epsilon: float = 1e-15,
    per_body: bool = False,
) -> Parameter:
    """Return the parameter called `name` for a coefficient of restitution, > `above` and <= 1.

    An `above` of None accepts 0, too. `default` is the program's, None if it has none.
    `least_epsilon` is the least eps that is suggested: 1e-15 is > 0, and its logarithm is a number. `per_body` says
    whether each body has an eps.
    """
    # The double after `above` is the least number that is accepted.
    least = math.nextafter(above, 1) if above is not None else 0.0
    allowed: Callable[[tuple[float, ...]], bool] = lambda pair: all(least <= e <= 1 for e in pair)  # noqa: E731
    accepted = "a number from 0 to 1" if above is None else f"a number > {above:g} and <= 1"
    return Parameter(name, "", default, accepted, allowed, per_body=per_body, least_epsilon=least_epsilon)


@dataclass(frozen=True)
class Impulse:
    """A collision that a program resolves at once, without a compression.

    Attributes
    ----------
    epsilon : callable
        From phases, where in a time step contact begins, to the eps of each.
    sticking_speed : callable
        Returns the speed below which bodies stay together, wherever in a time step contact begins; None if there is
        none.
    """

    epsilon: Callable[[FloatArray], ArrayLike]
    sticking_speed: Callable[[], float | None] = lambda: None

    def collide(
        self,
        speed: float = 1.0,
        *,
        step: float | None = None,
        scheme: Scheme = SEMI_IMPLICIT,
        phases: ArrayLike | None = None,
    ) -> SampledCollision:
        """Return the collision: its mean eps, and the range, over the parts of a time step at which contact begins.

        The arguments are those of `Contact.collide`. `speed` and `scheme` change nothing, as `epsilon` knows them.
        Phases are by default the midpoints of 64 equal parts of a step.
        """
        # Without a time step eps depends on no phase: the middle of a step stands for all.
        sampled = np.asarray(0.5 if step is None else PHASES if phases is None else phases, float).ravel()
        epsilons = np.broadcast_to(np.asarray(self.epsilon(sampled), float), sampled.shape)
        if step is not None and phases is None:
            # Least and largest eps over all phases, and the error of both; + 0 * p makes an array of a constant.
            all_epsilons = lambda p: np.asarray(self.epsilon(p), float) + 0 * p  # noqa: E731
            least, largest, error = phase_range(all_epsilons, sampled, epsilons)
        else:
            least, largest, error = float(epsilons.min()), float(epsilons.max()), 0.0
        # A jump between two of n phases moves their mean by at most the jump over n.
        jump = float(np.abs(np.diff(epsilons)).max()) if len(epsilons) > 1 else 0.0
        errors = {"epsilon": jump / len(epsilons), "least": error, "largest": error, "depth": 0.0, "duration": 0.0}
        # An impulse has neither depth nor duration. The bodies part if eps is > 0 at some phase.
        return SampledCollision(float(epsilons.mean()), least, largest, 0.0, 0.0, largest > 0, errors)


@dataclass(frozen=True)
class Native:
    """The contact of a program in the parameters of a user's file.

    Attributes
    ----------
    parameters : tuple of Parameter
        All but the integrator.
    force : callable
        From the values and an `Impact` to a `Power`, a `Contact` with any force, or an `Impulse`. The load of a contact
        is the mass times the gravity of the impact.
    source : str
        File of the program.
    schemes : mapping of str to Scheme or None
        Integrators by the program's own names, its default first; None for one that chooses its own steps.
    integrator : str
        What the file calls it.
    damping : str or callable
        Name of the parameter that is the damping, or a function of the values that returns it: an eps, or a number to
        which the damping of a `Power` is proportional.
    damped_values : callable or None
        For a damping that `damping` cannot say: from the values, a number c and an impact to the values, by name, that
        make the contact so damped. eps falls with c, and c = 1 is of the order of eps = 0.5.
    integrator_contact : callable
        From the contact and the values to the contact that the integrator makes of it.
    warnings : callable
        From the values and an impact to sentences, without their full stops.
    units : callable
        From the values to the units of the file.
    hints : mapping of str to str
        For names of the program that are no parameters here: what is expected, in words.
    """

    parameters: tuple[Parameter, ...]
    force: Callable[[Values, Impact], Power | Contact | Impulse]
    source: str
    schemes: Mapping[str, Scheme | None] = field(default_factory=lambda: {"semi-implicit Euler": SEMI_IMPLICIT})
    integrator: str = "scheme"
    damping: str | Callable[[Values], str] = ""
    damped_values: Callable[[Values, float, Impact], Mapping[str, Any]] | None = None
    integrator_contact: Callable[[Contact, Values], Contact] = lambda contact, values: contact
    warnings: Callable[[Values, Impact], Iterable[str]] = lambda values, impact: ()
    units: Callable[[Values], FileUnits] = lambda values: FileUnits()
    hints: Mapping[str, str] = field(default_factory=dict)

    def contact(self, values: Values, impact: Impact) -> Contact | Impulse:
        """Return the contact, or impulse, that the program makes of a file; `impact` is in the units of the file."""
        force = self.force(values, impact)
        contact = force.contact(impact) if isinstance(force, Power) else force
        return contact if isinstance(contact, Impulse) else self.integrator_contact(contact, values)

    def with_damping(self, values: Values, c: float, impact: Impact) -> Mapping[str, Any]:
        """Return the parameters, value by name, that make the damping c > 0: eps falls with c.

        c is -ln eps for a parameter that is a coefficient of restitution, and kappa for one that is a damping
        constant. The values of the other parameters are `values`, and `impact` is in the units of the file.
        """
        if self.damped_values is not None:
            return self.damped_values(values, c, impact)
        name = self.damping if isinstance(self.damping, str) else self.damping(values)
        parameter = self.parameters_by_name[name]
        if parameter.least_epsilon is not None:
            # eps = exp(-c), or the least eps that the program accepts
            number = max(math.exp(-c), parameter.least_epsilon)
        else:
            # The damping constant is in proportion to the number: kappa of the number 1 says which one gives c.
            unit_force = self.force(Values({**values, name: (1.0, 1.0) if parameter.per_body else 1.0}), impact)
            assert isinstance(unit_force, Power)
            number = unit_force.damping_number(c, impact)
        return {name: (number, number) if parameter.per_body else number}

    @property
    def parameters_by_name(self) -> dict[str, Parameter]:
        """All parameters by name, the integrator too, whose default is the first of its words."""
        names = tuple(self.schemes)
        integrator = Parameter(self.integrator, default=names[0], words=names)
        return {parameter.name: parameter for parameter in (*self.parameters, integrator)}

    def values(self, settings: Mapping[str, str]) -> Values:
        """Return the values of all parameters that are set or have a default; `settings` are texts of the file by name.

        Raises
        ------
        ValueError
            If there is no such parameter, or a value is not accepted.
        """
        parameters = self.parameters_by_name
        for name in settings:
            if name not in parameters:
                # ": did you mean …?", or "" if no name looks like it
                near = "" if name in self.hints else arguments.suggestion(name, parameters)
                expected = self.hints.get(name) or "; ".join(parameter.summary for parameter in parameters.values())
                raise ValueError(f"there is no parameter {name!r}{near or f': expected {expected}'}")

        # Defaults of the program, replaced by what the file sets. Some units depend on the integrator.
        texts = {name: parameter.default for name, parameter in parameters.items() if parameter.default is not None}
        texts |= settings
        scheme = texts[self.integrator]
        values = Values()
        for name, text in texts.items():
            parameter = parameters[name]
            unit = parameter.other_units.get(scheme, parameter.unit)
            values[name] = replace(parameter, unit=unit).value(text)

        # A word without a default decides the law, and must be set. Missing numbers are asked for where they are read.
        for name, parameter in parameters.items():
            if parameter.words and name not in values:
                choice = " or ".join(f'"{name}={word}"' for word in parameter.words)
                raise ValueError(f"{name} is not set: expected --set {choice}")
        return values

    def texts(self, values: Mapping[str, Any]) -> dict[str, str]:
        """Return the texts of values, by parameter, as a file has them."""
        return {name: self.parameters_by_name[name].text(value) for name, value in values.items()}


def names_without_effect(native: Native, settings: Mapping[str, str], impact: Impact) -> tuple[str, ...]:
    """Return the names, "mass", "radius" or those of set parameters, on which the contact does not depend.

    `settings` are the texts of a user's file by parameter, and `impact` is in SI units. An impulse after which a body
    stays shows no dependence on mass and radius: neither name is returned.

    Raises
    ------
    ValueError
        As `Native.values` does.
    """
    # `Values` remembers in `read` which parameters the collision looks up; what `values` itself has read does not
    # count.
    values = native.values(settings)
    values.read.clear()
    file_impact = impact.in_units(native.units(values))

    def collision(file_impact: Impact) -> SampledCollision | None:
        """Return the collision; None if it is not accepted, for instance because a mass is missing."""
        try:
            return program_collision(native, values, file_impact)
        except ValueError:
            return None

    file_impact, _ = _in_steps(native, values, file_impact)
    reference = collision(file_impact)
    if reference is None:
        return ()
    # The mass or the radius has no effect if the collision without it is the same.
    impacts_without = {"mass": replace(file_impact, mass=None), "radius": replace(file_impact, radius=None)}
    if not (reference.parts or reference.depth):
        impacts_without.clear()
    bodies = [name for name, less in impacts_without.items() if less != file_impact and collision(less) == reference]
    return (*bodies, *(name for name in settings if name not in values.read))


@dataclass(frozen=True)
class Delivery:
    """What the contact of a user's file gives.

    Attributes
    ----------
    values : Values
        Of all parameters, with sentences on those that were mixed.
    scheme : str
        The program's name of its integrator.
    collision : SampledCollision
    instead : mapping of str to str or None
        What to write for the wanted eps, by parameter; None if no eps is wanted, or nothing gives it.
    warnings : tuple of str
        Sentences.
    units : FileUnits
        Of depth and duration.
    falling : SampledCollision or None
        That of a body that falls on a plane, if nothing was said of weight, and it would count.
    stepped : bool
        Whether both collisions are those of the program in its time steps.
    contact_time : float or None
        That of the undamped contact; None for an impulse, or if the bodies do not part without damping.
    sticking : Sticking or None
        The speed below which bodies stay together, and what adhesion costs; None where neither is known. That of bodies
        which the weight keeps together is known only if they stay at the speed of the impact.
    """

    values: Values
    scheme: str
    collision: SampledCollision
    instead: Mapping[str, str] | None
    warnings: tuple[str, ...]
    units: FileUnits
    falling: SampledCollision | None
    stepped: bool
    contact_time: float | None
    sticking: Sticking | None


def delivery(
    native: Native,
    settings: Mapping[str, str],
    impact: Impact,
    epsilon: float | None = None,
    *,
    weight_is_known: bool = False,
) -> Delivery:
    """Return what the contact of a user's file gives, and what to write for a wanted eps.

    Parameters
    ----------
    native : Native
    settings : mapping of str to str
        Texts of the file by parameter.
    impact : Impact
        In SI units.
    epsilon : float, optional
        The wanted eps, > 0 and < 1.
    weight_is_known : bool
        Whether an impact without gravity is one of bodies that both fall; else a warning says what weight would do.

    Raises
    ------
    ValueError
        If a parameter is unknown, missing or not accepted, or the contact stops no body.
    """
    # Read the file. A scheme of None is an integrator that chooses its own steps.
    values = native.values(settings)
    values.read.clear()
    units = native.units(values)
    file_impact, name = impact.in_units(units), values[native.integrator]
    if native.schemes[name] is None and file_impact.step is not None:
        fixed_step_names = [integrator for integrator, scheme in native.schemes.items() if scheme is not None]
        others = f"; expected with one --scheme {', '.join(fixed_step_names)}" if fixed_step_names else ""
        raise ValueError(f"time-step is given: {name} chooses its own steps{others}")

    # With very many time steps in a contact the step is left out; with very few a warning says so.
    file_impact, step_warnings = _in_steps(native, values, file_impact)
    warnings = [*native.warnings(values, file_impact), *step_warnings]

    # Both numbers, with and without weight, are those of the program: in its time steps, if there are some.
    contact = native.contact(values, file_impact)
    collision, falling = program_collision(native, values, file_impact), None
    duration = contact_time(native, values, file_impact)
    warnings += energy_warnings(collision, file_impact.step)

    # Weight counts from g t_c/v = 0.02 (`COUNTS`) on: then eps of a body that falls on a plane is computed, too. In
    # units of unknown size, such as LAMMPS's lj, g = 9.81 m/s^2 is no number.
    # An impulse has no t_c, and weight acts on it in each time step.
    gravity = 0.0 if units.unsized else EARTH * units.seconds**2 / units.metres
    ratio, is_impulse = gravity * (duration or 0.0) / file_impact.speed, isinstance(contact, Impulse)
    if not (file_impact.gravity or weight_is_known) and (ratio >= COUNTS or (is_impulse and gravity)):
        with suppress(ValueError):  # too strong a damping
            heavy = program_collision(native, values, replace(file_impact, gravity=gravity))
            # Weight alone costs nothing: without damping eps is 1 with it, too.
            falling = heavy if abs(heavy.epsilon - collision.epsilon) > SAME else None
        if falling is not None:
            result = f"{falling.epsilon:.4f}" if falling.parts else "0, as it does not leave the plane"
            words = "eps" if is_impulse else f"g t_c/v = {ratio:.2g}, and eps"
            warnings.append(f"Without weight. A body that falls on a plane has {words} = {result}: --gravity 9.81")

    # What to write instead: the damping with which the mean eps of the program is the wanted one.
    instead = None
    if epsilon is not None and not native.damping and native.damped_values is None:
        warnings.append("No parameter is a damping: there is nothing to write instead")
    elif epsilon is not None:
        instead, damping_warnings = _texts_instead(native, values, file_impact, epsilon, duration)
        warnings += damping_warnings

    # The speed below which bodies stay together: by a threshold of an impulse, by adhesion, or by the weight. Only
    # adhesion has a neck, which costs an energy.
    def contact_of_speed(speed: float) -> Any:
        return native.contact(values, replace(file_impact, speed=speed))

    if isinstance(contact, Impulse):
        slowest = contact.sticking_speed()
        sticking = None if slowest is None else Sticking(slowest, 0.0)
    else:
        sticking = adhesion.sticking(contact_of_speed, file_impact.speed)
        if file_impact.gravity and not collision.parts and sticking is None:
            slowest = _slowest_rebound(native, values, file_impact, duration)
            sticking = None if slowest is None else Sticking(slowest, 0.0)
    stepped = file_impact.step is not None
    return Delivery(values, name, collision, instead, tuple(warnings), units, falling, stepped, duration, sticking)


def _texts_instead(
    native: Native, values: Values, file_impact: Impact, epsilon: float, duration: float | None
) -> tuple[dict[str, str] | None, list[str]]:
    """Return what to write for the mean eps `epsilon`, text by parameter, or None if nothing gives it; and warnings.

    `values` are those of the user's file, `file_impact` is the impact in the file's units, and `duration` is the
    undamped contact time, None if there is none.
    """
    units, scheme = native.units(values), native.schemes[values[native.integrator]] or SEMI_IMPLICIT

    def damping(impact: Impact, near: float) -> float:
        """Return the damping c that gives eps on average with the time step of an impact; the search begins at near."""
        return damping_factor(
            lambda c: native.contact(damped(c, impact), impact),  # type: ignore[arg-type,return-value]
            epsilon,
            near,
            speed=impact.speed,
            step=impact.step,
            scheme=scheme,
        )

    def damped(c: float, impact: Impact) -> Values:
        return Values({**values, **native.with_damping(values, c, impact)})

    def shorter_step() -> str:
        """Return the option with a step in which eps depends little on where in it contact begins, in words, or ""."""
        if (step := file_impact.step) is None or duration is None:
            return ""
        near = 1.0

        def collision(factor: float) -> SampledCollision:
            """Return the collision in steps that are shorter by a factor; each search begins at the last damping."""
            nonlocal near
            shorter = with_two_digits(step / factor, math.floor)
            if duration > _MOST_STEPS * shorter:
                raise ValueError("this is as good as no step")
            finer = replace(file_impact, step=shorter)
            near = damping(finer, near)
            return program_collision(native, damped(near, finer), finer)

        factor = resolved(collision, SPREAD)
        if factor is None:
            return ""
        # Where the units have no size a plain number is in them.
        number = f"{with_two_digits(step / factor, math.floor):.2g}"
        typed = number if units.unsized else f'"{number} {units.time}"'
        return f"; with a shorter step, --time-step {typed}, its range is below {SPREAD:g}"

    # Searches for the damping c start at 1, which is of the order of eps = 0.5.
    try:
        c = damping(file_impact, 1.0)
        instead = native.texts(native.with_damping(values, c, file_impact))
        # A program that finds its damping by some steps of a method jumps over an eps. The digits that are written
        # decide on which side of the jump it is: so the eps of the texts themselves is computed.
        written = {name: native.parameters_by_name[name].value(text) for name, text in instead.items()}
        reached = program_collision(native, Values({**values, **written}), file_impact)
    except ValueError as error:
        return None, [f"No damping gives {epsilon:g}: {error}{shorter_step()}"]
    warnings = list[str]()
    if abs(reached.epsilon - epsilon) > SAME:
        warnings.append(f"No number gives {epsilon:g}: the one to write gives {reached.epsilon:.4f}")
    if reached.largest - reached.least > SPREAD and (way := shorter_step()):
        eps = "eps with weight" if file_impact.gravity else "eps"
        range_text = f"{reached.least:.4f} to {reached.largest:.4f}"
        warnings.append(f"With {epsilon:g} on average, {eps} is {range_text}{way}")
    return instead, warnings


def _slowest_rebound(native: Native, values: Values, file_impact: Impact, duration: float | None) -> float | None:
    """Return the speed below which the weight keeps bodies down, wherever in a step contact begins; None if unknown.

    In an impact of `values` and `file_impact` the bodies stay down; `duration` is the undamped contact time.
    """
    scheme = native.schemes[values[native.integrator]] or SEMI_IMPLICIT
    if file_impact.step is not None and duration is not None and duration > _FINE_STEPS * file_impact.step:
        file_impact = replace(file_impact, step=None)

    def parts(factor: float) -> bool:
        impact = replace(file_impact, speed=factor * file_impact.speed)
        # 64 phases are enough to know whether bodies part: the range over all phases takes long.
        phases = None if impact.step is None else PHASES
        return (
            native.contact(values, impact).collide(impact.speed, step=impact.step, scheme=scheme, phases=phases).parts
        )

    try:
        return sticking_speed(parts, file_impact.speed)
    except ValueError:  # some speed in the search is too fast for an integration
        return None


def _in_steps(native: Native, values: Values, file_impact: Impact) -> tuple[Impact, list[str]]:
    """Return the impact, without its time step if a contact has very many, and warnings of very many or few steps.

    `values` are those of the user's file, and `file_impact` is the impact in the file's units.
    """
    # The undamped contact time is that which the parameters say; in its steps a program may soften the contact.
    duration = contact_time(native, values, replace(file_impact, step=None))
    if file_impact.step is None or duration is None:
        return file_impact, []
    steps = duration / file_impact.step
    # More than 5000 steps are computed as infinitely many; from 2 on there is nothing to say.
    if steps > _MOST_STEPS:
        return replace(file_impact, step=None), [
            f"A contact has {steps:.2g} time steps: this is eps with infinitely many, which differs by less than 0.001"
        ]
    if steps >= _FEW_STEPS:
        return file_impact, []
    few = f"A contact has {steps:.2g} time steps only"
    long = f"A time step is {1 / steps:.2g} contacts long"
    return file_impact, [f"{few if steps >= 1 else long}: eps depends on where in a step contact begins"]


def energy_warnings(collision: SampledCollision, step: float | None) -> list[str]:
    """Return a warning if the bodies gain energy by a time step `step`; of half of `SPREAD` at some phases none."""
    if step is None or (collision.epsilon <= 1 + SAME and collision.largest <= 1 + SPREAD / 2):
        return []
    return [f"eps is up to {collision.largest:.4g}, above 1: the bodies gain energy, as the time step is too long"]


def program_collision(native: Native, values: Values, file_impact: Impact) -> SampledCollision:
    """Return the collision that a program makes of a file, with the weight and time step of `file_impact`."""
    scheme = native.schemes[values[native.integrator]] or SEMI_IMPLICIT
    return native.contact(values, file_impact).collide(file_impact.speed, step=file_impact.step, scheme=scheme)


def contact_time(native: Native, values: Values, file_impact: Impact) -> float | None:
    """Return the contact time without damping and weight, in the unit of the file.

    None for an impulse, or if the bodies do not part without damping.
    """
    contact = native.contact(values, replace(file_impact, gravity=0.0))
    try:
        # An impulse has no duration: infinity stands for none, as of bodies that do not part.
        duration = math.inf if isinstance(contact, Impulse) else contact.contact_time(file_impact.speed)
    except ValueError:
        return None
    return duration if duration < math.inf else None
