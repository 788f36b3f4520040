"""Programs whose contacts have a law of their own: the damping for a wanted eps, and a stiffness of one's choice.

MuJoCo, Drake, Simbody, Chrono and JaxDEM have no viscoelastic law. Each has another power-law contact
(`viscopade.theory.law`), with a damping that is exact at one impact speed. At other speeds eps is that of the program's
law, so it is off: `OwnLawContact.errors` says by how much. The error may be largest between the slowest and the fastest
speed.

The stiffness is free: a stiff contact is short and shallow, and needs short time steps. With a force k x^a it is stated
as k/m (m is the effective mass), which follows from the contact time or from the largest penetration alone. Without
weight and time steps the damping does not depend on it. What weight and time steps do depends on the duration of
contact, so with them damping and stiffness are solved together.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import cache, cached_property
from typing import Any, NamedTuple

import numpy as np
from mpmath import mp

from viscopade.arrays import double
from viscopade.arrays.checked import FloatArray
from viscopade.collision import exact
from viscopade.collision.contact import PHASES, SampledCollision, resolved, root
from viscopade.collision.schemes import SEMI_IMPLICIT, Scheme
from viscopade.collision.spheres import beta_from_restitution, v_star
from viscopade.collision.weight import EARTH, FallingContact, loaded, loss_slope
from viscopade.simulators import simulator_with
from viscopade.simulators.audit import largest_step
from viscopade.simulators.formula import (
    DampingFormula,
    TooFewSteps,
    identity,
    kappa_for_epsilon,
    kappa_in_steps,
    law_epsilon,
    stepped_collision,
)
from viscopade.simulators.input_file import (
    SPEEDS,
    Row,
    SpeedErrors,
    in_percent,
    input_text,
    program_number,
    speed_errors,
)
from viscopade.simulators.setup import NO_WEIGHT, SI, NamedContact, Units
from viscopade.simulators.simulator import OwnLaw, Simulator
from viscopade.theory.law import VISCOELASTIC, Law

STEP_ERROR = 0.01
"""Relative error of eps by the time step, for the longest step that the files state."""
CHOSEN_STEPS = 20
"""Time steps in a contact of which nothing else says how long it is."""
FEWEST_STEPS = 10
"""Time steps in a contact from which on texts advise a damping for the step; for fewer ones, a longer contact."""
SPREAD = 0.02
"""Difference of eps in single collisions, by where in a step contact begins, from which on texts warn."""
_CLOSE = 1e-12  # square of the difference of the greatest and the least error, where they are balanced
_DIGITS = 15
_LEAST = 1e-30
_SLOWEST, _WIDEST = 1e-12, 1e6  # impact speed, and range of speeds
_LEAST_STEP = 1e-3  # in contact times
MOST_STEPS = 400
"""Time steps in the longest contact that texts advise."""
_BRIEF_STEPS = 100  # in a contact that gets shorter together with its steps, at first
_STRETCH, _MOST_STRETCHES, _MOST_BROYDEN = 0.2, 40, 20  # search for a contact with weight, or with time steps
_ALIKE = 1e-12  # error at which it ends without time steps
_NARROW = 1e-7  # width at which it ends where the duration jumps
_UNLIKE = 0.02  # error by such a jump, from which on the contact is another one than was asked for
_MADE_UP = 0.01  # difference of eps from the wanted one up to which the damping makes up for a time step


@dataclass(frozen=True)
class Wanted:
    """The collisions that a program's contact must come close to.

    Attributes
    ----------
    name : str
        Of the contact.
    beta : float
        eq:betadef, of typical bodies; of another law kappa at the speed 1.
    slowest, typical, fastest : float
        Impact speeds; at the typical one eps must be exact.
    mass : float, optional
        Effective.
    contact_time : float, optional
        Of the viscoelastic contact at the typical speed.
    extremes : tuple of float
        The least and the largest beta, if the bodies' sizes are distributed; else empty.
    gravity : float
        Acceleration that presses the bodies together; 0 for two that both fall.
    with_weight : float, optional
        Wanted eps at the typical speed with this weight, instead of that without.
    law : Law
        That of the collisions.
    spheres : FallingContact, optional
        The viscoelastic contact with this weight, if the bodies are known.
    """

    name: str
    beta: float
    slowest: float
    typical: float
    fastest: float
    mass: float | None = None
    contact_time: float | None = None
    extremes: tuple[float, ...] = ()
    gravity: float = EARTH
    with_weight: float | None = None
    law: Law = VISCOELASTIC
    spheres: FallingContact | None = None

    def __post_init__(self) -> None:
        if self.mass is not None and not _LEAST <= self.mass <= 1 / _LEAST:
            raise ValueError(f"mass is {self.mass!r}: expected a number from {_LEAST:g} to {1 / _LEAST:g}")

    @classmethod
    def at(
        cls,
        epsilon: float,
        speed: float,
        speeds: tuple[float, float] | None,
        mass: float | None,
        gravity: float | None = None,
        law: Law = VISCOELASTIC,
    ) -> Wanted:
        """Return collisions with an eps at a speed, between bodies of which no more is known."""
        slowest, fastest = speeds or (speed, speed)
        if law == VISCOELASTIC:
            beta = float(beta_from_restitution(speed, epsilon))
        else:
            beta = float(kappa_for_epsilon(law, repr(epsilon))) / speed ** float(2 * law.c)
        found = cls("contact", beta, slowest, speed, fastest, mass, law=law)
        return found if gravity is None else replace(found, gravity=gravity, with_weight=epsilon)

    @classmethod
    def of(cls, contact: NamedContact, weighty: bool = False) -> Wanted:
        """Return the collisions of a contact."""
        pair = contact.pair
        spheres = contact.falling if weighty and contact.falls else None
        if spheres is not None and not spheres.contact(contact.typical).collide().parts:
            spheres = None  # no damping makes a contact that has eps = 0
        return cls(
            contact.name,
            pair.beta,
            contact.slowest,
            contact.typical,
            contact.fastest,
            pair.m_eff,
            float(pair.contact_time(contact.typical)),
            tuple(size.beta for size in (contact.extremes[:1] + contact.extremes[-1:])),
            contact.gravity if contact.falls else 0.0,
            None if spheres is None else float(spheres.epsilon([contact.typical])[0]),
            spheres=spheres,
        )

    def epsilon(self, speed: float, beta: float | None = None) -> float:
        """Return eps at a speed, of typical bodies or with another beta."""
        factor = self.beta if beta is None else beta
        if self.law == VISCOELASTIC:
            return float(double.epsilon(v_star(speed, factor)))
        return float(law_epsilon(self.law, mp.mpf(factor * speed ** float(2 * self.law.c))))


@dataclass(frozen=True)
class Softness:
    """How soft a contact is, by one number; if none is given, it has the duration of the viscoelastic contact.

    Attributes
    ----------
    stiffness : float, optional
        k of the force k x^a.
    stiffness_over_mass : float, optional
        k/m.
    contact_time : float, optional
        At the typical speed.
    penetration : float, optional
        Largest compression at the fastest speed.

    Raises
    ------
    ValueError
        If more than one is given, or one is below 1e-30 or above 1e30.
    """

    stiffness: float | None = None
    stiffness_over_mass: float | None = None
    contact_time: float | None = None
    penetration: float | None = None

    def __post_init__(self) -> None:
        given = {name: value for name, value in vars(self).items() if value is not None}
        if len(given) > 1:
            raise ValueError(f"{' and '.join(map(_option, given))} are given: expected one of them")
        for name, value in given.items():
            if not _LEAST <= value <= 1 / _LEAST:
                raise ValueError(f"{_option(name)} is {value!r}: expected a number from {_LEAST:g} to {1 / _LEAST:g}")


def _option(name: str) -> str:
    """Return the option of the command line that gives a number of `Softness`."""
    return "--" + name.removesuffix("_over_mass").replace("_", "-")


class _Course(NamedTuple):
    epsilon: float
    depth: float
    duration: float


@dataclass(frozen=True)
class OwnLawContact:
    """A program's contact that has the wanted eps at the typical speed.

    If eps is wanted of a body that falls, all numbers of the collision are with its weight. With a time step they are
    means over where in a step contact begins.

    Attributes
    ----------
    formula : DampingFormula
        The program's, with its law, end of contact and integrator.
    wanted : Wanted
    softness : Softness
    time_step : float or None
        If given, the damping makes up for it. If nothing else says how long contact lasts, it lasts 20 steps.
    carried : float
        The part of a weight that the program's contact carries without a penetration.
    units : Units
        Of all numbers.

    Raises
    ------
    ValueError
        If there is a weight or a time step and the contact's duration is not known, or no damping gives the wanted eps.
    """

    formula: DampingFormula
    wanted: Wanted
    softness: Softness = Softness()
    time_step: float | None = None
    carried: float = 0.0
    units: Units = SI

    def __post_init__(self) -> None:
        slowest, fastest = self.wanted.slowest, self.wanted.fastest
        if self.formula.law.nu != 2 and not _SLOWEST <= slowest <= fastest <= min(1 / _SLOWEST, _WIDEST * slowest):
            raise ValueError(
                f"speeds of {self.wanted.name} are {slowest:g} to {fastest:g}: expected {_SLOWEST:g} to "
                f"{1 / _SLOWEST:g}, and at most {_WIDEST:g} times the slowest"
            )
        if self.time_step is not None and self.formula.scheme is None:
            raise ValueError("a time step is given: expected none, as the program chooses its own")
        if self._parameter(self.kappa) is None:
            dampings = (self.formula.kappa(mp.mpf(end)) for end in self.formula.accepted)
            least, most = sorted(float(law_epsilon(self.formula.law, kappa)) for kappa in dampings)
            raise ValueError(
                f"epsilon is {self.epsilon:.6g}: expected {least:.4g} to {most:.4g}, which {self.formula.parameter} "
                f"from {self.formula.accepted[0]} to {self.formula.accepted[1]} gives"
            )

    @property
    def epsilon(self) -> float:
        """The wanted eps, at the typical speed."""
        alone = self.wanted.epsilon(self.wanted.typical)
        return alone if self.wanted.with_weight is None else self.wanted.with_weight

    @property
    def kappa(self) -> float:
        """Damping of the scaled equation at the typical speed; it makes up for a time step, and for a weight."""
        return self._solution[0]

    @property
    def stiffness_over_mass(self) -> float | None:
        """k/m of the force k x^a; None if nothing is known of it."""
        return self._solution[1]

    @cached_property
    def _solution(self) -> tuple[float, float | None]:
        """The damping kappa at the typical speed and k/m, solved together."""
        given, wanted, law = self.softness, self.wanted, self.formula.law
        over_mass = given.stiffness_over_mass
        if given.stiffness is not None and wanted.mass is not None:
            over_mass = given.stiffness / wanted.mass
        if over_mass is not None:
            return self._damping(over_mass), over_mass

        # Else a depth or a duration is asked for, at one of the speeds.
        asked, speed = given.penetration, wanted.fastest
        if asked is None:
            asked, speed = self._asked_duration, wanted.typical
        if asked is None or given.stiffness is not None:
            missing = "a contact time" + (", or a time step" if self.formula.scheme is not None else "")
            missing = "a mass with the stiffness" if given.stiffness is not None else missing
            for name, counts in (("gravity", wanted.with_weight), ("time-step", self.time_step)):
                if counts is not None:
                    raise ValueError(f"{name} needs the contact's duration: expected {missing}")
            return self._continuum, None

        def measured(course: _Course) -> float:
            return course.duration if given.penetration is None else course.depth

        # Lengths and times of the scaled equation are in proportion to (k/m)^(-1/(a+1)): without weight and time steps
        # this gives k/m.
        power = float(law.elastic) + 1
        plain = (measured(self._plain(speed, self._continuum, 1.0)) / asked) ** power
        if wanted.with_weight is None and self.time_step is None:
            return self._continuum, plain

        # With them the contact is stretched or compressed until it is as asked. The mean duration in time steps is a
        # staircase: with the next step, one of `PHASES` ends a step later.
        def stretched(stretch: float) -> float:
            return float(plain * math.exp(-power * stretch))

        step = self._step(speed, plain)
        error = _ALIKE if step is None else step / len(PHASES)

        # Damping and stretch are first found together, from where ln(-ln eps) grows like ln(kappa) and the logarithm of
        # the duration or the depth like the stretch.
        def misses(logarithms: FloatArray) -> FloatArray:
            kappa, k_m = math.exp(logarithms[0]), stretched(float(logarithms[1]))
            typical = self._course(wanted.typical, kappa, k_m)
            course = typical if speed == wanted.typical else self._course(speed, kappa, k_m)
            loss = math.log(typical.epsilon) / math.log(self.epsilon)
            return np.array([math.log(loss), math.log(measured(course) / asked)])

        kappa, stretch = self._damping(plain), 0.0
        if kappa:
            with suppress(ValueError, OverflowError):  # such as where bodies do not part
                logarithm, stretch = _broyden(misses, np.array([math.log(kappa), 0.0]), error / 2).tolist()
                kappa = math.exp(logarithm)

        # Then the stretch alone, with the damping that each has: also where the duration jumps.
        def excess(stretch: float) -> float:
            nonlocal kappa
            kappa = self._damping(stretched(stretch), kappa)
            off = math.log(measured(self._course(speed, kappa, stretched(stretch))) / asked)
            return off if abs(off) >= error else 0.0

        stretch = _zero(excess, stretch)
        over_mass = stretched(stretch)
        if abs(excess(stretch)) > _UNLIKE:
            name = "contact-time" if given.penetration is None else "penetration"
            refused = (
                f"{name} is {asked:.4g}: no contact with eps = {self.epsilon:g}, weight and time steps is like that"
            )
            if self.time_step is not None:
                raise TooFewSteps(refused)
            raise ValueError(f"{refused}, expected another one")
        return kappa, over_mass

    @property
    def _asked_duration(self) -> float | None:
        """The duration of contact that is asked for; None if nothing says how long it is."""
        duration = self.wanted.contact_time if self.softness.contact_time is None else self.softness.contact_time
        return CHOSEN_STEPS * self.time_step if self.is_chosen and self.time_step is not None else duration

    @property
    def is_chosen(self) -> bool:
        """Whether contact lasts `CHOSEN_STEPS` time steps because nothing else says how long it lasts."""
        return self.time_step is not None and self.softness == Softness() and self.wanted.contact_time is None

    @property
    def _continuum(self) -> float:
        """The kappa without weight and time steps."""
        return float(kappa_for_epsilon(self.formula.law, repr(self.epsilon)))

    def _damping(self, over_mass: float, near: float | None = None) -> float:
        """Return the kappa at the typical speed that gives the wanted eps with a k/m, by the program's own steps.

        The search begins at the kappa `near`, by default at that without weight and time steps.
        """
        speed, scheme = self.wanted.typical, self.formula.scheme or SEMI_IMPLICIT
        load = 0.0 if self.wanted.with_weight is None else self._load(speed, over_mass)
        step = self._step(speed, over_mass)
        if not load and step is None:
            return self._continuum
        self._check_step(over_mass)
        return kappa_in_steps(self.formula.law, self.epsilon, step, scheme, load, self.carried, near)

    def _check_step(self, over_mass: float) -> None:
        """Raise ValueError if the time step is longer than the undamped contact, or needlessly short."""
        step = self._step(self.wanted.typical, over_mass)
        if step is None or self.time_step is None or _LEAST_STEP <= step <= 1:
            return
        if step < 1:
            raise ValueError(f"time-step is {step:.4g} contact times: so short a one needs no number, leave it out")
        raise TooFewSteps(f"time-step is {step:.4g} contact times")

    def _course(self, speed: float, kappa: float, over_mass: float, falls: bool | None = None) -> _Course:
        """Return the collision at a speed, with the program's own time steps; arguments as of `delivered`."""
        weight = self.wanted.with_weight is not None if falls is None else falls
        load = self._load(speed, over_mass) if weight else 0.0
        step, scheme = self._step(speed, over_mass), self.formula.scheme
        if not load and step is None:
            return self._plain(speed, kappa, over_mass)
        law, damping, time = self.formula.law, self._at(kappa, speed), self._time_scale(speed, over_mass)
        found = _mean_collision(law, damping, load, self.carried, step, scheme)
        return _Course(found.epsilon, found.depth * time * speed, found.duration * time)

    def _plain(self, speed: float, kappa: float, over_mass: float) -> _Course:
        """Return the collision without weight and time steps."""
        time = self._time_scale(speed, over_mass)
        found = _proven(self.formula.law, self._at(kappa, speed))
        return _Course(found["epsilon"], found["x_max"] * time * speed, found["tau_c"] * time)

    def _at(self, kappa: float, speed: float) -> float:
        """Return kappa at a speed, from that at the typical one."""
        return float(kappa * (speed / self.wanted.typical) ** float(2 / self.formula.law.nu - 1))

    def _time_scale(self, speed: float, over_mass: float) -> float:
        """Return the unit of tau at a speed."""
        return self.formula.law.time_scale(speed, k=over_mass, mass=1.0)

    def _load(self, speed: float, over_mass: float) -> float:
        """Return G of the scaled equation for a body that falls."""
        return self.wanted.gravity * self._time_scale(speed, over_mass) / speed

    def _step(self, speed: float, over_mass: float) -> float | None:
        """Return the time step in undamped contact times at a speed."""
        if self.time_step is None:
            return None
        return self.time_step / (self.formula.law.contact_time * self._time_scale(speed, over_mass))

    @property
    def falling(self) -> FallingContact | None:
        """The contact with a weight; None if there is none, or the duration of contact is not known."""
        speed, over_mass = self.wanted.typical, self.stiffness_over_mass
        if over_mass is None or not self.wanted.gravity:
            return None
        time = self._time_scale(speed, over_mass)
        return FallingContact(self.formula.law, self.kappa, time, speed, self.wanted.gravity, self.carried)

    @property
    def parameter(self) -> float:
        """What the program's formula takes for `kappa`."""
        parameter = self._parameter(self.kappa)
        assert parameter is not None  # a contact without one is refused
        return parameter

    def _parameter(self, kappa: float) -> float | None:
        found = self.formula.parameter_of(mp.mpf(kappa))
        return None if found is None else float(found)

    @property
    def stiffness(self) -> float | None:
        """Constant k of the force k x^a; None if it or the mass is not known."""
        mass, over_mass = self.wanted.mass, self.stiffness_over_mass
        return self.softness.stiffness if mass is None or over_mass is None else over_mass * mass

    @property
    def contact_time(self) -> float | None:
        """Duration of contact at the typical speed."""
        over_mass = self.stiffness_over_mass
        return None if over_mass is None else self._course(self.wanted.typical, self.kappa, over_mass).duration

    @property
    def penetration(self) -> float | None:
        """Largest compression at the fastest speed."""
        over_mass = self.stiffness_over_mass
        return None if over_mass is None else self._course(self.wanted.fastest, self.kappa, over_mass).depth

    def delivered(self, speed: float, kappa: float | None = None, falls: bool | None = None) -> float:
        """Return eps at a speed; with a time step its mean over where in a step contact begins.

        Parameters
        ----------
        speed : float
        kappa : float, optional
            Damping at the typical speed, instead of `kappa`.
        falls : bool, optional
            Whether the weight counts; by default if eps is wanted with it.
        """
        damping, over_mass = self.kappa if kappa is None else kappa, self.stiffness_over_mass
        if over_mass is None or (self.time_step is None and self.wanted.with_weight is None):
            return float(law_epsilon(self.formula.law, mp.mpf(self._at(damping, speed))))
        return self._course(speed, damping, over_mass, falls).epsilon

    def stepped(self, time_step: float | None = None) -> SampledCollision | None:
        """Return eps at the typical speed with its time step, or with another one; None if there is none.

        Single collisions differ.
        """
        over_mass, scheme, speed = self.stiffness_over_mass, self.formula.scheme, self.wanted.typical
        step = self.time_step if time_step is None else time_step
        if over_mass is None or scheme is None or step is None:
            return None
        step /= self.formula.law.contact_time * self._time_scale(speed, over_mass)
        load = 0.0 if self.wanted.with_weight is None else self._load(speed, over_mass)
        return stepped_collision(self.formula.law, self.kappa, step, scheme, load, self.carried)

    def errors(self, kappa: float | None = None) -> list[SpeedErrors]:
        """Return the errors over the speeds, for typical and for extreme sizes; with another kappa if one is given."""
        wanted = self.wanted
        speeds = np.geomspace(wanted.slowest, wanted.fastest, SPEEDS if wanted.slowest < wanted.fastest else 1)
        own = np.array([self.delivered(speed, kappa) for speed in speeds.tolist()])
        betas = (wanted.beta, *wanted.extremes)
        return [
            speed_errors(own / np.array([wanted.epsilon(speed, beta) for speed in speeds.tolist()]) - 1)
            for beta in betas
        ]

    def balanced(self) -> tuple[float, float] | None:
        """Return the parameter whose largest error over the speeds and sizes is smallest, and that error.

        None if there is one speed only. All errors fall with the damping, so the largest is smallest where the greatest
        and the least are opposite: a constant eps is then the harmonic mean of the largest and the smallest wanted one.
        """
        wanted = self.wanted
        if wanted.slowest == wanted.fastest or self.kappa == 0:
            return None
        if self.formula.law.nu == 2 and self.time_step is None:
            betas = (wanted.beta, *wanted.extremes)
            most = max(wanted.epsilon(wanted.slowest, beta) for beta in betas)
            least = min(wanted.epsilon(wanted.fastest, beta) for beta in betas)
            return self._with_error(float(kappa_for_epsilon(self.formula.law, repr(2 * least / (1 + least / most)))))

        def spread(logarithm: Any) -> Any:
            errors = self.errors(float(mp.exp(logarithm)))
            return max(each.greatest for each in errors) + min(each.least for each in errors)

        start = math.log(self.kappa)
        return self._with_error(math.exp(float(mp.findroot(spread, (start, start + 0.1), solver="secant", tol=_CLOSE))))

    def _with_error(self, kappa: float) -> tuple[float, float] | None:
        parameter = self._parameter(kappa)
        return None if parameter is None else (parameter, max(each.largest for each in self.errors(kappa)))

    def longest_step(self, error: float = STEP_ERROR) -> float | None:
        """Return the longest time step with a relative error of eps, without a damping that makes up for it.

        It is without weight. None if there is no time step, or the duration of contact is not known.
        """
        over_mass, law, scheme = self.stiffness_over_mass, self.formula.law, self.formula.scheme
        if over_mass is None or scheme is None:
            return None
        unit = law.contact_time * self._time_scale(self.wanted.typical, over_mass)
        return largest_step(law, self._continuum, error, self.epsilon, scheme) * unit


@cache
def _proven(law: Law, kappa: float) -> dict[str, float]:
    """Return the collision without weight and time steps, proven."""
    return exact.collision(kappa=repr(kappa), law=law, digits=_DIGITS).floats()


@cache
def _mean_collision(
    law: Law, kappa: float, load: float, carried: float, step: float | None, scheme: Scheme | None
) -> SampledCollision:
    """Return a collision with a load and a time step in undamped contact times; with the mean of phases, no range."""
    contact = loaded(law, kappa, load, carried)
    if step is None or scheme is None:
        return contact.collide()
    return contact.collide(step=step * law.contact_time, scheme=scheme, phases=PHASES)


def _zero(function: Callable[[float], float], start: float) -> float:
    """Return where an increasing function is 0, or jumps from below to above 0; it is near `start`."""
    low = high = start
    below = above = function(start)
    for _ in range(_MOST_STRETCHES):
        if below <= 0 <= above:
            return root(function, (low, below), (high, above), _NARROW)
        if below > 0:
            high, above, low = low, below, low - _STRETCH
            below = function(low)
        else:
            low, below, high = high, above, high + _STRETCH
            above = function(high)
    return low


def _broyden(function: Callable[[FloatArray], FloatArray], x: FloatArray, error: float) -> FloatArray:
    """Return where a function of vectors is 0 up to an error, by Broyden's method from a Jacobian of 1.

    Raises
    ------
    ValueError
        If it does not converge.
    """
    values, jacobian = function(x), np.eye(len(x))
    for _ in range(_MOST_BROYDEN):
        if np.abs(values).max() < error:
            return x
        move = -np.linalg.solve(jacobian, values)
        x, values = x + move, function(x + move)
        if not np.isfinite(values).all():
            break
        # The smallest change of the Jacobian J with which J move is the change of the values; J move was -values.
        jacobian += np.outer(values, move) / (move @ move)
    raise ValueError("no convergence")


def with_two_digits(number: float, rounded: Callable[[float], int] = math.ceil) -> float:
    """Return the next larger number with two digits, or with `math.floor` the next smaller one."""
    unit = 10.0 ** (math.floor(math.log10(number) + 1e-12) - 1)
    slack = -1e-9 if rounded is math.ceil else 1e-9
    return rounded(number / unit * (1 + slack)) * unit


def outweighs(wanted: Wanted, time_step: float) -> bool:
    """Return whether in one time step the weight changes the speed by more than the speed of impact."""
    return wanted.with_weight is not None and wanted.gravity * time_step >= wanted.typical


def ways_out(contact: OwnLawContact, wanted: Wanted, time_step: float, spread: float = math.inf) -> Iterator[str]:
    """Yield options of the command line with which a contact in time steps has the wanted eps; each was tried.

    The first is `--contact-time` for a longer contact in these time steps, if there is one; then come shorter steps.

    Parameters
    ----------
    contact : OwnLawContact
        One that exists, so without these steps, or without the weight.
    wanted : Wanted
        The collisions, with the weight.
    time_step : float
        The steps that are too long.
    spread : float
        Wanted difference of eps in single collisions, at most.
    """
    given, text = contact.softness, contact.units.time_text
    lasts = contact.contact_time
    known = lasts is not None and lasts < math.inf and not contact.is_chosen
    lasts = lasts if lasts is not None and known else CHOSEN_STEPS * time_step
    longest, shortest = max(lasts, CHOSEN_STEPS * time_step), min(time_step, lasts / CHOSEN_STEPS)
    brief = min(lasts, _BRIEF_STEPS * time_step)

    def shorter(factor: float) -> float:
        return with_two_digits(shortest / factor, math.floor)

    # From a factor to the contact and the steps: a longer contact, shorter steps in the same one, both shorter.
    ways: tuple[Callable[[float], tuple[Softness, float]], ...] = (
        lambda factor: (Softness(contact_time=with_two_digits(longest * factor)), time_step),
        lambda factor: (given, shorter(factor)),
        lambda factor: (Softness(contact_time=with_two_digits(brief / math.sqrt(factor))), shorter(factor)),
    )
    for number, way in enumerate(ways):
        if not number and outweighs(wanted, time_step):
            continue  # how long contact lasts does not matter then

        def collision(factor: float, way: Callable[[float], tuple[Softness, float]] = way) -> SampledCollision:
            softness, step = way(factor)
            duration = lasts if softness == given and known else softness.contact_time or CHOSEN_STEPS * step
            if not CHOSEN_STEPS * (1 - 1e-9) <= duration / step <= MOST_STEPS:
                raise ValueError
            made = replace(contact, wanted=wanted, softness=softness, time_step=step).stepped()
            assert made is not None
            return made

        factor = resolved(collision, spread)
        if factor is not None:
            softness, step = way(factor)
            options = [f'--time-step "{text(step)}"'] if number else []
            if softness != given and softness.contact_time is not None:
                options.append(f'--contact-time "{text(softness.contact_time)}"')
            yield " ".join(options)
            if number:
                return


def best_line(contact: OwnLawContact, name: str, number: Callable[[float], float] = identity) -> Iterator[str]:
    """Yield a line on the number with the smallest largest error; `number` makes it of the parameter."""
    best = contact.balanced()
    if best is not None:
        yield f"  the largest error is smallest, {100 * best[1]:.3g} %, with {name} {number(best[0]):.6g}"


def constant_row(contact: OwnLawContact, name: str, number: Callable[[float], float] = identity) -> Row:
    """Return columns on a contact whose law has one eps for all speeds: the number for the one at the typical speed.

    Behind it stands the range of errors over the speeds and sizes, or with weight eps at the speeds.
    """
    collisions, text = contact.wanted, program_number(number(contact.parameter))
    if collisions.with_weight is None:
        return {(name, ""): f"{text} ({in_percent(contact.errors())})"}
    varied = collisions.slowest < collisions.fastest
    speeds = (collisions.slowest, collisions.typical, collisions.fastest) if varied else (collisions.typical,)
    epsilons = " ".join(f"{contact.delivered(speed):.4f}" for speed in speeds)
    return {(name, ""): text, (f"{name}: eps with weight", ""): epsilons}


def best_row(contact: OwnLawContact, name: str, number: Callable[[float], float] = identity) -> Row:
    """Return a column with the number whose largest error is smallest; none with weight, or at one speed."""
    best = None if contact.wanted.with_weight is not None else contact.balanced()
    return {} if best is None else {(f"best {name}", ""): f"{number(best[0]):.6g} ({100 * best[1]:.3g} %)"}


def weighed_lines(contact: OwnLawContact) -> Iterator[str]:
    """Yield a line on eps with weight at the slowest and the fastest speed, and on that of viscoelastic spheres."""
    wanted = contact.wanted
    if wanted.slowest == wanted.fastest:
        return
    ends = wanted.slowest, wanted.fastest
    own = " and ".join(f"{contact.delivered(speed):.4f}" for speed in ends)
    others = "" if wanted.spheres is None else " and ".join(f"{e:.4f}" for e in wanted.spheres.epsilon(ends).tolist())
    at = f"{ends[0]:.6g} and {ends[1]:.6g} {contact.units.speed}"
    yield f"  with weight eps at {at}: {own}{others and f'; of viscoelastic spheres {others}'}"


def render_own_law(
    target: str,
    wanted: Sequence[Wanted],
    command: str,
    *,
    opening: Sequence[str],
    softness: Softness | None = None,
    time_step: float | None = None,
    step_error: float = STEP_ERROR,
    units: Units = SI,
) -> str:
    """Return the text for a simulator whose contacts have a law of their own.

    Parameters
    ----------
    target : str
        Its target.
    wanted : sequence of Wanted
        Its contacts.
    command : str
        The command line that makes the text.
    opening : sequence of str
        Lines at its beginning.
    softness : Softness, optional
        Of all contacts; that of viscoelastic ones if it is not given.
    time_step : float, optional
        The damping makes up for it.
    step_error : float
        Relative error of eps for which the text states the longest time step.
    units : Units
        Of all numbers.

    Raises
    ------
    ValueError
        If no contact of the program has the wanted eps.
    """
    simulator = simulator_with(target)
    own = simulator.texts[target]
    assert isinstance(own, OwnLaw)
    contacts = list[dict[str, Any]]()
    for each in wanted:
        formula = simulator.formula(own.formula)
        given = softness or Softness()
        try:
            contact = OwnLawContact(formula, each, given, time_step, own.carried, units)
        except TooFewSteps as error:
            assert time_step is not None
            light = OwnLawContact(formula, replace(each, with_weight=None), given, None, own.carried, units)
            raise ValueError(_refused(str(error), light, each, time_step)) from None
        stiffness = contact.stiffness_over_mass if own.per_mass else contact.stiffness
        if own.per_mass and stiffness is None:
            raise ValueError(
                f"{simulator.title} needs a stiffness: expected --stiffness, --contact-time, --penetration, or "
                f"--time-step for a contact of {CHOSEN_STEPS} steps"
            )
        steps = _on_steps(contact, simulator, units, step_error)
        contacts.append(
            {
                "name": each.name,
                "lines": [*_facts(contact, own, units), *steps],
                "stiffness": None if stiffness is None else program_number(stiffness),
                own.number: program_number(_number(contact, own, contact.parameter)),
            }
        )
    # A line that all contacts have stands once.
    first, *others = (contact["lines"] for contact in contacts)
    common = [line for line in first if others and all(line in lines for lines in others)]
    facts = [line for contact in contacts for line in contact["lines"] if line not in common]
    facts += ["In all contacts:", *common] if common else []
    return input_text(own, command, opening, {"contacts": contacts, "units": units, "time_step": time_step}, facts)


def _number(contact: OwnLawContact, own: OwnLaw, parameter: float) -> float:
    """Return the number that the text has for a parameter of the formula."""
    if own.per_mass:
        assert contact.stiffness_over_mass is not None
        return parameter * math.sqrt(contact.stiffness_over_mass)
    return parameter / contact.wanted.typical if own.per_speed else parameter


def _facts(contact: OwnLawContact, own: OwnLaw, units: Units) -> Iterator[str]:
    """Yield lines on a contact: its eps over the speeds, how long and deep it is, and what weight does."""
    wanted, law = contact.wanted, contact.formula.law
    of = "without weight" if wanted.with_weight is None else "of a body that falls on a plane"
    yield (
        f"{wanted.name}: eps = {contact.epsilon:.6g} at {wanted.typical:.6g} {units.speed} {of}, kappa = "
        f"{contact.kappa:.10g}"
    )
    yield f"  the law is {law.equation}, and contact ends where the force vanishes"
    if wanted.with_weight is not None:
        yield from weighed_lines(contact)
    elif wanted.slowest < wanted.fastest:
        yield from _over_speeds(contact, own, units)
    elif law.nu != 2:
        yield "  at other speeds eps is different: --speeds MIN:MAX states its error"
    if contact.contact_time is not None and contact.penetration is not None:
        weight = ", without weight" if wanted.with_weight is None and wanted.gravity else ""
        chosen = f" ({CHOSEN_STEPS} time steps, as nothing else says how long)" if contact.is_chosen else ""
        lasts = f"lasts {contact.contact_time:.6g} {units.time}{chosen}"
        lasts = lasts if contact.contact_time < math.inf else "does not end in some collisions"
        yield (
            f"  contact {lasts} at the typical speed, the penetration reaches {contact.penetration:.4g} {units.length} "
            f"at the fastest{weight}"
        )
    yield from _on_stiffness(contact, own, units)
    yield from _on_weight(contact, units)


def _on_stiffness(contact: OwnLawContact, own: OwnLaw, units: Units) -> Iterator[str]:
    """Yield a line on the stiffness that the text has: whether it is over a mass."""
    k, k_m, mass, law = contact.stiffness, contact.stiffness_over_mass, contact.wanted.mass, contact.formula.law
    power, length = ("", "") if law.elastic == 1 else (f"^({law.elastic})", f" {units.length}^({law.elastic - 1})")
    unit = law.stiffness_unit if units == SI else f"{units.mass}/({units.time}^2{length})"
    of = "" if mass is None else f" of the effective mass {mass:.6g} {units.mass}"
    if own.per_mass and k_m is not None:
        whole = "" if k is None else f": k = {k:.6g} {unit}{of}"
        yield f"  stiffness {k_m:.6g} 1/{units.time}^2, which is per effective mass{whole}"
    elif k is not None:
        yield f"  stiffness {k:.6g} {unit}, not per mass: k of the force k x{power}"


def _over_speeds(contact: OwnLawContact, own: OwnLaw, units: Units) -> Iterator[str]:
    wanted = contact.wanted
    ends = wanted.slowest, wanted.fastest
    own_values, others = ([f"{value:.6g}" for value in map(eps, ends)] for eps in (contact.delivered, wanted.epsilon))
    of = "viscoelastic spheres" if wanted.law == VISCOELASTIC else f"the law {wanted.law}"
    yield (
        f"  eps at {ends[0]:.6g} and {ends[1]:.6g} {units.speed}: {' and '.join(own_values)}; of {of} "
        f"{' and '.join(others)}"
    )
    sizes = " and sizes" if wanted.extremes else ""
    yield f"  relative error of eps over the speeds{sizes}: {in_percent(contact.errors())}"
    yield from best_line(contact, own.number, lambda parameter: _number(contact, own, parameter))


def _on_weight(contact: OwnLawContact, units: Units) -> Iterator[str]:
    """Yield lines on the weight of a body that falls on a plane."""
    wanted, falling = contact.wanted, contact.falling
    if not wanted.gravity:
        yield f"  {NO_WEIGHT}"
    elif falling is None:
        factor = f"1 + {loss_slope(contact.formula.law):.3f} g t_c/v"
        yield f"  weight multiplies the loss 1 - eps by about {factor}; nothing says how long contact lasts"
    else:
        note, fall = falling.sentences(wanted.slowest, wanted.fastest, units.speed, wanted.with_weight is not None)
        yield f"  {note}"
        if fall is not None and contact.time_step is not None:  # that sentence is without steps
            speeds = list(dict.fromkeys((wanted.fastest, wanted.slowest)))
            heavy, light = (
                " and ".join(f"{contact.delivered(v, falls=falls):.4f}" for v in speeds) for falls in (True, False)
            )
            fall = (
                f"a body that falls on a plane at {' and '.join(f'{v:.4g}' for v in speeds)} {units.speed} rebounds "
                f"with eps = {heavy} (mean, sampled), without weight {light}"
            )
        if fall is not None:
            yield f"  {'Warning: ' if wanted.with_weight is None else ''}{fall}"


def _refused(error: str, light: OwnLawContact, wanted: Wanted, time_step: float) -> str:
    """Return an error of a contact in time steps, with options that mend it; `light` has neither steps nor weight."""
    ways = list(ways_out(light, wanted, time_step))
    expected = " or ".join(ways) or f"a contact of more than {MOST_STEPS} time steps"
    reason = "" if any(way.startswith("--contact-time") for way in ways) else ", and a longer contact does not help"
    if outweighs(wanted, time_step):
        gained = f"{wanted.gravity * time_step:.3g} {light.units.speed}"
        reason = f", as the weight changes the speed by {gained} in a step: only shorter steps help"
    return f"{error}{reason}: expected {expected}"


def _on_steps(contact: OwnLawContact, simulator: Simulator, units: Units, step_error: float) -> Iterator[str]:
    """Yield lines on the time step for which the damping makes up, or on that of the program."""
    found, default = contact.stepped(), simulator.default_step
    if found is not None and contact.time_step is not None:
        makes_up = "the damping" if abs(found.epsilon - contact.epsilon) < _MADE_UP else "no damping"
        yield (
            f"  with the time step {contact.time_step:.6g} {units.time}, for which {makes_up} makes up: eps = "
            f"{found.epsilon:.6g} on average, {found.least:.6g} to {found.largest:.6g} in single collisions"
        )
        if found.largest - found.least > SPREAD and found.duration < math.inf:
            way = next(ways_out(contact, contact.wanted, contact.time_step, SPREAD), None)
            if way is not None:
                yield f"  with {way} single collisions differ by {SPREAD:g} at most"
        return
    longest = contact.longest_step(step_error)
    if contact.formula.scheme is not None and longest is None:
        yield "  the longest time step is not known, as nothing says how long contact lasts"
    if longest is not None:
        light = "" if contact.wanted.with_weight is None else ", without weight"
        yield (f"  Time steps up to {longest:.4g} {units.time} change eps by at most {100 * step_error:g} %{light}")
        yield "  For a longer step, give --time-step: viscopade then adapts the damping"
    if default is not None and longest is not None and default > longest:
        yield from default_step_warning(contact, simulator.title, default, units)


def default_step_warning(contact: OwnLawContact, title: str, step: float, units: Units) -> Iterator[str]:
    """Yield a warning if a program's default time step is too long for a contact."""
    assert contact.contact_time is not None
    steps, name = contact.contact_time / step, f"{title}'s default step of {units.time_text(step)}"
    found = contact.stepped(step) if steps >= FEWEST_STEPS else None
    off = f"{name} is {1 / steps:.2g} contacts long"
    if found is not None:
        off = (
            f"with {name} eps is {found.epsilon:.4g} on average, {found.least:.4g} to {found.largest:.4g} in single "
            "collisions"
        )
        try:
            adapted = replace(contact, time_step=step)
        except ValueError:  # no damping gives this eps in so few steps
            adapted = None
        if adapted is not None:
            yield f'  Warning: {off}; --time-step "{units.time_text(step)}" adapts the damping'
            return
    way = next(ways_out(contact, contact.wanted, step), None)
    if way is None:
        yield f"  Warning: {off}"
    elif way.startswith("--contact-time"):
        yield f"  Warning: {off}; {way} makes a contact that it resolves"
    else:
        yield f"  Warning: {off}; shorter steps are necessary: {way}"
