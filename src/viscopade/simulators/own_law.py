"""Programs whose contacts have a law of their own: the damping for a goal eps, and a stiffness of one's choice.

    viscopade simulators mujoco --epsilon 0.5 --speed 1 --contact-time "31 ms" --time-step "2 ms"
    viscopade simulators drake --epsilon 0.9 --speed "1 m/s" --mass "1 kg" --gravity 9.81 --penetration "7 mm"
    viscopade simulators simbody --epsilon 0.8 --speed 1 --speeds 0.1:3 --contact-time "20 ms"

MuJoCo, Drake, Simbody, Chrono and JaxDEM have no viscoelastic law. Each has another power-law contact
(`viscopade.theory.law`), with a damping that is exact at one impact speed. At other speeds eps is that of the program's
law, so it is off: `OwnLawContact.errors` says by how much. The error may be largest between the slowest and the fastest
speed.

The stiffness is free: a stiff contact is short and shallow, and needs short time steps. With a force k x^a it is stated
as k/m (m is the effective mass), which follows from the contact time or from the largest penetration alone. Without
weight and time steps the damping does not depend on it. What weight and time steps do depends on the duration of
contact, so with them damping and stiffness are solved together.

Symbols (docs/theory/mathematics.md, section 2.9): the contact m x'' + k x^a + c x^b x' = 0 is, in the units T of time
and T v of length of a speed of impact v, x'' + x^a + kappa x^b x' = 0 with x'(0) = 1. There nu = (a + 1)/(b + 1),
T = (k/m)^(-1/(a+1)) v^((1-a)/(a+1)), and kappa = (c/m) (k/m)^(-1/nu) v^(2/nu - 1). `Law.contact_time` is the duration
of contact without damping in units of T, pi for the linear spring.
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
from viscopade.simulators.native import SPREAD
from viscopade.simulators.setup import NO_WEIGHT, SI, NamedContact, Units, with_two_digits
from viscopade.simulators.simulator import OwnLaw, Simulator
from viscopade.theory.law import VISCOELASTIC, Law

# Numbers of time steps are chosen by hand. What they mean for the linear spring with eps = 0.5 in semi-implicit Euler's
# method, whose damping makes up for the step: single collisions, by where in a step contact begins, differ by 0.085
# with 10 steps in a contact, by 0.041 with 20, by 0.008 with 100, and by 0.002 with 400 (measured).
STEP_ERROR = 0.01
"""Relative error of eps by the time step, for the longest step that the files state; `--step-error` changes it."""
CHOSEN_STEPS = 20
"""Time steps in a contact of which nothing else says how long it is."""
FEWEST_STEPS = 10
"""Time steps in a contact from which on texts advise a damping for the step; for fewer ones, a longer contact."""
MOST_STEPS = 400
"""Time steps in the longest contact that texts advise: an even softer contact would narrow eps by less than 0.002."""
_BRIEF_STEPS = 100  # time steps at first in a contact that gets shorter with its steps: MOST_STEPS leaves a factor of 4

_DIGITS = 15  # of proven collisions: all decimals that a double has
# Masses and stiffnesses are from 1e-30 to 1e30, far more than bodies have: products and powers of them, such as
# (k/m)^(-1/(a+1)) or k = (k/m) m, stay within the range of double precision, 1e-308 to 1e308.
_SMALLEST = 1e-30
# Impact speeds are from 1e-12 to 1e12, the fastest at most 1e6 times the slowest: kappa grows like v^(2/nu - 1), with
# Drake's law like v. Over a factor of 1e6 `best_parameter` converges, over 1e9 it does not, and over 1e12 eps at the
# fastest speed cannot be computed (all measured with Drake's law). With nu = 2 kappa is the same at all speeds.
_SLOWEST, _WIDEST = 1e-12, 1e6
# Shortest time step in contact times: with 1000 steps in a contact the mean eps is off by 1e-4 in semi-implicit Euler's
# method, by 4e-3 in implicit Euler's, without a damping that makes up for it (measured; linear spring, eps = 0.5, 0.9).
_SHORTEST_STEP = 1e-3
# `best_parameter` ends where the greatest and the least error add up to less than the root of this, 1e-6 (mpmath
# compares the square): texts have three digits of the error and six of the number.
_BALANCED_SQUARE = 1e-12

# The search for a contact that has a goal eps and, with weight or in time steps, a given duration or depth.
# At most 20 of Broyden's steps: 37 contacts of five programs took 1 to 8 (measured); more mean that it diverges.
_MOST_BROYDEN = 20
# Where it fails, the bracket of the logarithm of the duration grows by 0.2 at a time, up to 40 times: from any start
# it reaches contacts that are e^8 = 3000 times as long, or as short.
_STRETCH, _MOST_STRETCHES = 0.2, 40
_ALIKE = 1e-12  # relative error of the duration without time steps: that of `Contact.collide`, which computes it
_NARROW = 1e-7  # width of the bracket of that logarithm where the duration jumps; texts have six digits of a duration
# Relative error of the duration by a jump, from which on no contact is as asked. The stairs of the mean over 64 phases
# are 1/640 with 10 steps in a contact: 0.02 is no stair, the motion itself jumps (the choice is by hand).
_JUMP = 0.02
# Difference of eps from the goal, up to which texts say that the damping makes up for the step. A damping that was
# found gives the goal to 1e-13. None is found for eps = 1 only: implicit Euler's method then takes 0.05 with 100 steps
# in a contact, and 0.01 with 500.
_MADE_UP = 0.01


@dataclass(frozen=True)
class Goal:
    """The collisions that a program's contact must come close to.

    Attributes
    ----------
    name : str
        Of the contact.
    beta : float
        The paper's Eq. 8, v* = beta^(1/2) v^(1/10), of typical bodies; of another law kappa at the speed 1.
    slowest, typical, fastest : float
        Impact speeds; at the typical one eps must be exact.
    mass : float, optional
        Effective.
    contact_time : float, optional
        Of the viscoelastic contact at the typical speed, a time.
    extremes : tuple of float
        The least and the largest beta, if the bodies' sizes are distributed; else empty.
    gravity : float
        Acceleration that presses the bodies together; 0 for two that both fall.
    epsilon_with_weight : float, optional
        Eps at the typical speed with this weight, the goal instead of that without.
    law : Law
        That of the collisions.
    spheres : FallingContact, optional
        The viscoelastic contact with this weight, if the bodies are known.

    Raises
    ------
    ValueError
        If the mass is below 1e-30 or above 1e30.
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
    epsilon_with_weight: float | None = None
    law: Law = VISCOELASTIC
    spheres: FallingContact | None = None

    def __post_init__(self) -> None:
        if self.mass is not None and not _SMALLEST <= self.mass <= 1 / _SMALLEST:
            raise ValueError(f"mass is {self.mass!r}: expected a number from {_SMALLEST:g} to {1 / _SMALLEST:g}")

    @classmethod
    def from_epsilon(
        cls,
        epsilon: float,
        speed: float,
        speeds: tuple[float, float] | None,
        mass: float | None,
        gravity: float | None = None,
        law: Law = VISCOELASTIC,
    ) -> Goal:
        """Return collisions with an eps at an impact speed, between bodies of which no more is known.

        Parameters
        ----------
        epsilon : float
            Eps at `speed`, > 0 and <= 1: with weight if a gravity is given, else without.
        speed : float
            Impact speed, a length/time.
        speeds : tuple of float or None
            The slowest and the fastest impact; None if all have the one speed.
        mass : float or None
            Effective mass, if it is known.
        gravity : float, optional
            Acceleration that presses the bodies together.
        law : Law
            Law of the collisions at the other speeds.
        """
        slowest, fastest = speeds or (speed, speed)
        if law == VISCOELASTIC:
            beta = float(beta_from_restitution(speed, epsilon))
        else:
            # kappa = kappa(1) v^(2 c) with 2 c = 2/nu - 1.
            beta = float(kappa_for_epsilon(law, repr(epsilon))) / speed ** float(2 * law.c)
        goal = cls("contact", beta, slowest, speed, fastest, mass, law=law)
        return goal if gravity is None else replace(goal, gravity=gravity, epsilon_with_weight=epsilon)

    @classmethod
    def from_contact(cls, contact: NamedContact, weighty: bool = False) -> Goal:
        """Return the collisions of viscoelastic bodies: their beta, speeds, mass and contact time.

        Parameters
        ----------
        contact : NamedContact
            Two spheres, or a sphere and a wall.
        weighty : bool
            Whether the goal is eps with the weight of a sphere that falls on a wall.
        """
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
            # The sizes are in order of v*, so the first and the last have the least and the largest beta.
            tuple(size.beta for size in (contact.extremes[:1] + contact.extremes[-1:])),
            contact.gravity if contact.falls else 0.0,
            None if spheres is None else float(spheres.epsilon([contact.typical])[0]),
            spheres=spheres,
        )

    def epsilon(self, speed: float, beta: float | None = None) -> float:
        """Return eps at an impact speed without weight, of typical bodies or with another beta."""
        damping = self.beta if beta is None else beta
        if self.law == VISCOELASTIC:
            return float(double.epsilon(v_star(speed, damping)))
        # Of another law beta is kappa at the speed 1, and kappa = beta v^(2 c).
        return float(law_epsilon(self.law, mp.mpf(damping * speed ** float(2 * self.law.c))))


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
        At the typical speed, a time.
    penetration : float, optional
        Largest compression at the fastest speed, a length.

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
        numbers = {name: value for name, value in vars(self).items() if value is not None}
        if len(numbers) > 1:
            raise ValueError(f"{' and '.join(map(_option, numbers))} are given: expected one of them")
        for name, value in numbers.items():
            if not _SMALLEST <= value <= 1 / _SMALLEST:
                limits = f"{_SMALLEST:g} to {1 / _SMALLEST:g}"
                raise ValueError(f"{_option(name)} is {value!r}: expected a number from {limits}")


def _option(name: str) -> str:
    """Return the option of the command line that gives a number of `Softness`; k and k/m have the same one."""
    return "--" + name.removesuffix("_over_mass").replace("_", "-")


class _Collision(NamedTuple):
    """Eps, the largest compression (a length) and the duration (a time) of a collision, means in time steps."""

    epsilon: float
    depth: float
    duration: float


class BestParameter(NamedTuple):
    """The number for a program's formula whose largest relative error of eps is smallest, and this error."""

    parameter: float
    largest_error: float


class _Solution(NamedTuple):
    """The damping of the scaled equation at the typical speed, and k/m; None if nothing is known of k/m."""

    kappa: float
    stiffness_over_mass: float | None


@dataclass(frozen=True)
class OwnLawContact:
    """A program's contact that has the goal eps at the typical speed.

    If the goal is eps of a body that falls, all numbers of the collision are with its weight. With a time step they are
    means over where in a step contact begins.

    Attributes
    ----------
    formula : DampingFormula
        The program's, with its law, end of contact and integrator.
    goal : Goal
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
        If there is a weight or a time step and the contact's duration is not known, or no damping gives the goal eps.
    """

    formula: DampingFormula
    goal: Goal
    softness: Softness = Softness()
    time_step: float | None = None
    carried: float = 0.0
    units: Units = SI

    def __post_init__(self) -> None:
        slowest, fastest = self.goal.slowest, self.goal.fastest
        # With nu = 2 the damping is the same at all speeds, so none is too slow or too fast.
        if self.formula.law.nu != 2 and not _SLOWEST <= slowest <= fastest <= min(1 / _SLOWEST, _WIDEST * slowest):
            raise ValueError(
                f"speeds of {self.goal.name} are {slowest:g} to {fastest:g}: expected {_SLOWEST:g} to "
                f"{1 / _SLOWEST:g}, and at most {_WIDEST:g} times the slowest"
            )
        if self.time_step is not None and self.formula.scheme is None:
            raise ValueError("a time step is given: expected none, as the program chooses its own")
        # No number that the program accepts gives this damping: say which eps the ends of its range give.
        if self._parameter_for(self.kappa) is None:
            dampings = (self.formula.kappa(mp.mpf(end)) for end in self.formula.accepted)
            lowest, highest = sorted(float(law_epsilon(self.formula.law, kappa)) for kappa in dampings)
            raise ValueError(
                f"epsilon is {self.epsilon:.6g}: expected {lowest:.4g} to {highest:.4g}, which {self.formula.parameter}"
                f" from {self.formula.accepted[0]} to {self.formula.accepted[1]} gives"
            )

    @property
    def epsilon(self) -> float:
        """The goal eps, at the typical speed: with weight if that is asked for."""
        alone = self.goal.epsilon(self.goal.typical)
        return alone if self.goal.epsilon_with_weight is None else self.goal.epsilon_with_weight

    @property
    def kappa(self) -> float:
        """Damping of the scaled equation at the typical speed; it makes up for a time step, and for a weight."""
        return self._solution.kappa

    @property
    def stiffness_over_mass(self) -> float | None:
        """k/m of the force k x^a; None if nothing is known of it."""
        return self._solution.stiffness_over_mass

    @cached_property
    def _solution(self) -> _Solution:
        """The damping and the stiffness that give the goal eps and the asked duration or depth, solved together."""
        softness, goal, law = self.softness, self.goal, self.formula.law
        k_over_m = softness.stiffness_over_mass
        if softness.stiffness is not None and goal.mass is not None:
            k_over_m = softness.stiffness / goal.mass
        if k_over_m is not None:
            return _Solution(self._kappa_with(k_over_m), k_over_m)

        # Else a depth at the fastest speed or a duration at the typical one is asked for, or nothing: then eps must
        # not depend on k/m.
        size, speed = softness.penetration, goal.fastest
        if size is None:
            size, speed = self._asked_duration, goal.typical
        if size is None or softness.stiffness is not None:
            expected = "a contact time" + (", or a time step" if self.formula.scheme is not None else "")
            expected = "a mass with the stiffness" if softness.stiffness is not None else expected
            for name, number in (("gravity", goal.epsilon_with_weight), ("time-step", self.time_step)):
                if number is not None:
                    raise ValueError(f"{name} needs the contact's duration: expected {expected}")
            return _Solution(self._continuum_kappa, None)

        def size_of(collision: _Collision) -> float:
            return collision.duration if softness.penetration is None else collision.depth

        # Lengths and times of the scaled equation are in proportion to (k/m)^(-1/(a+1)). So without weight and time
        # steps k/m = (size with k/m = 1 / size)^(a+1).
        power = float(law.elastic) + 1
        light_k_over_m = (size_of(self._light_collision(speed, self._continuum_kappa, 1.0)) / size) ** power
        if goal.epsilon_with_weight is None and self.time_step is None:
            return _Solution(self._continuum_kappa, light_k_over_m)

        # With them k/m is varied until the size is as asked: sizes are exp(stretch) times as large in the scaled
        # equation. In time steps the mean duration is a staircase: with the next step, one of the 64 `PHASES` ends a
        # step later, so a duration is found to 1/64 of a step.
        def k_over_m_at(stretch: float) -> float:
            return float(light_k_over_m * math.exp(-power * stretch))

        step = self._step_in_contact_times(speed, light_k_over_m)
        error = _ALIKE if step is None else step / len(PHASES)

        # First damping and stretch together by Broyden's method, in ln(kappa) and stretch. There ln(-ln eps) grows
        # about like ln(kappa), and the logarithm of the size like the stretch: the Jacobian is about 1.
        def residuals(logarithms: FloatArray) -> FloatArray:
            kappa, k_m = math.exp(logarithms[0]), k_over_m_at(float(logarithms[1]))
            typical = self._collision(goal.typical, kappa, k_m)
            sized = typical if speed == goal.typical else self._collision(speed, kappa, k_m)
            loss_ratio = math.log(typical.epsilon) / math.log(self.epsilon)
            return np.array([math.log(loss_ratio), math.log(size_of(sized) / size)])

        kappa, stretch = self._kappa_with(light_k_over_m), 0.0
        if kappa:  # without damping there is no ln(kappa)
            with suppress(ValueError, OverflowError):  # such as where bodies do not part: ln 0
                # Half of the error: the search below then ends at once.
                log_kappa, stretch = _broyden(residuals, np.array([math.log(kappa), 0.0]), error / 2).tolist()
                kappa = math.exp(log_kappa)

        # Then the stretch alone, with the damping that each stretch needs. This works also where the duration jumps;
        # where Broyden's method converged, it computes one collision, and is done.
        def log_size_excess(stretch: float) -> float:
            nonlocal kappa
            kappa = self._kappa_with(k_over_m_at(stretch), kappa)
            excess = math.log(size_of(self._collision(speed, kappa, k_over_m_at(stretch))) / size)
            return excess if abs(excess) >= error else 0.0

        stretch = _increasing_root(log_size_excess, stretch)
        k_over_m = k_over_m_at(stretch)
        if abs(log_size_excess(stretch)) > _JUMP:
            name = "contact-time" if softness.penetration is None else "penetration"
            refusal = (
                f"{name} is {size:.4g}: no contact with eps = {self.epsilon:g}, weight and time steps is like that"
            )
            if self.time_step is not None:
                raise TooFewSteps(refusal)
            raise ValueError(f"{refusal}, expected another one")
        return _Solution(kappa, k_over_m)

    @property
    def _asked_duration(self) -> float | None:
        """The duration of contact that is asked for, a time; None if nothing says how long it is."""
        duration = self.goal.contact_time if self.softness.contact_time is None else self.softness.contact_time
        return CHOSEN_STEPS * self.time_step if self.is_chosen and self.time_step is not None else duration

    @property
    def is_chosen(self) -> bool:
        """Whether contact lasts `CHOSEN_STEPS` time steps because nothing else says how long it lasts."""
        return self.time_step is not None and self.softness == Softness() and self.goal.contact_time is None

    @property
    def _continuum_kappa(self) -> float:
        """The kappa with the goal eps, without weight and time steps."""
        return float(kappa_for_epsilon(self.formula.law, repr(self.epsilon)))

    def _kappa_with(self, k_over_m: float, near: float | None = None) -> float:
        """Return the kappa at the typical speed that gives the goal eps with a k/m, by the program's own steps.

        The search begins at the kappa `near`, by default at that without weight and time steps.

        Raises
        ------
        ValueError
            If the time step is longer than the undamped contact, or needlessly short, or no kappa gives this eps.
        """
        speed, scheme = self.goal.typical, self.formula.scheme or SEMI_IMPLICIT
        load = 0.0 if self.goal.epsilon_with_weight is None else self._load(speed, k_over_m)
        step = self._step_in_contact_times(speed, k_over_m)
        if not load and step is None:
            return self._continuum_kappa
        if step is not None and step < _SHORTEST_STEP:
            raise ValueError(
                f"time-step is {step:.4g} contact times: expected at least {_SHORTEST_STEP}, or none, with which the "
                "mean eps differs by less than 0.005"
            )
        if step is not None and not step <= 1:
            raise TooFewSteps(f"time-step is {step:.4g} contact times")
        # A search for the kappa whose mean eps, in these steps and with this load, is the goal.
        return kappa_in_steps(self.formula.law, self.epsilon, step, scheme, load, self.carried, near)

    def _collision(self, speed: float, kappa: float, k_over_m: float, falls: bool | None = None) -> _Collision:
        """Return the collision at an impact speed, with the program's own time steps.

        Parameters
        ----------
        speed : float
        kappa : float
            Damping of the scaled equation at the typical speed.
        k_over_m : float
            k/m of the force k x^a.
        falls : bool, optional
            Whether the weight counts; by default if the goal is eps with it.
        """
        weight = self.goal.epsilon_with_weight is not None if falls is None else falls
        load = self._load(speed, k_over_m) if weight else 0.0
        step, scheme = self._step_in_contact_times(speed, k_over_m), self.formula.scheme
        if not load and step is None:
            return self._light_collision(speed, kappa, k_over_m)
        law, damping, time = self.formula.law, self._kappa_at(kappa, speed), self._time_scale(speed, k_over_m)
        scaled = _mean_collision(law, damping, load, self.carried, step, scheme)
        # The unit of length is that of time, times the speed.
        return _Collision(scaled.epsilon, scaled.depth * time * speed, scaled.duration * time)

    def _light_collision(self, speed: float, kappa: float, k_over_m: float) -> _Collision:
        """Return the collision at a speed without weight and time steps; arguments as of `_collision`."""
        time = self._time_scale(speed, k_over_m)
        scaled = _proven_collision(self.formula.law, self._kappa_at(kappa, speed))
        return _Collision(scaled["epsilon"], scaled["x_max"] * time * speed, scaled["tau_c"] * time)

    def _kappa_at(self, kappa: float, speed: float) -> float:
        """Return kappa at a speed from that at the typical one: kappa ~ v^(2/nu - 1)."""
        return float(kappa * (speed / self.goal.typical) ** float(2 / self.formula.law.nu - 1))

    def _time_scale(self, speed: float, k_over_m: float) -> float:
        """Return T, the time that is 1 in the scaled equation at a speed."""
        return self.formula.law.time_scale(speed, k=k_over_m, mass=1.0)

    def _load(self, speed: float, k_over_m: float) -> float:
        """Return G = g T/v, the load of the scaled equation for a body that falls: g over its unit v/T."""
        return self.goal.gravity * self._time_scale(speed, k_over_m) / speed

    def _step_in_contact_times(self, speed: float, k_over_m: float) -> float | None:
        """Return the time step over the duration of the undamped contact at a speed; None if there is none."""
        if self.time_step is None:
            return None
        return self.time_step / (self.formula.law.contact_time * self._time_scale(speed, k_over_m))

    @property
    def falling(self) -> FallingContact | None:
        """The contact with a weight; None if there is none, or the duration of contact is not known."""
        speed, k_over_m = self.goal.typical, self.stiffness_over_mass
        if k_over_m is None or not self.goal.gravity:
            return None
        time = self._time_scale(speed, k_over_m)
        return FallingContact(self.formula.law, self.kappa, time, speed, self.goal.gravity, self.carried)

    @property
    def parameter(self) -> float:
        """The number from which the program's formula makes `kappa`."""
        parameter = self._parameter_for(self.kappa)
        assert parameter is not None  # a contact without one is refused
        return parameter

    def _parameter_for(self, kappa: float) -> float | None:
        """Return the number from which the program's formula makes a kappa; None if none in its range does."""
        parameter = self.formula.parameter_of(mp.mpf(kappa))
        return None if parameter is None else float(parameter)

    @property
    def stiffness(self) -> float | None:
        """Constant k of the force k x^a; None if it or the mass is not known."""
        mass, k_over_m = self.goal.mass, self.stiffness_over_mass
        return self.softness.stiffness if mass is None or k_over_m is None else k_over_m * mass

    @property
    def contact_time(self) -> float | None:
        """Duration of contact at the typical speed, a time; None if k/m is not known."""
        k_over_m = self.stiffness_over_mass
        return None if k_over_m is None else self._collision(self.goal.typical, self.kappa, k_over_m).duration

    @property
    def penetration(self) -> float | None:
        """Largest compression at the fastest speed, a length; None if k/m is not known."""
        k_over_m = self.stiffness_over_mass
        return None if k_over_m is None else self._collision(self.goal.fastest, self.kappa, k_over_m).depth

    def delivered(self, speed: float, kappa: float | None = None, falls: bool | None = None) -> float:
        """Return eps at an impact speed; with a time step its mean over where in a step contact begins.

        Parameters
        ----------
        speed : float
        kappa : float, optional
            Damping at the typical speed, instead of `kappa`.
        falls : bool, optional
            Whether the weight counts; by default if the goal is eps with it.
        """
        damping, k_over_m = self.kappa if kappa is None else kappa, self.stiffness_over_mass
        # Without weight and steps eps depends on kappa alone, and k/m may be unknown.
        if k_over_m is None or (self.time_step is None and self.goal.epsilon_with_weight is None):
            return float(law_epsilon(self.formula.law, mp.mpf(self._kappa_at(damping, speed))))
        return self._collision(speed, damping, k_over_m, falls).epsilon

    def collision_in_steps(self, time_step: float | None = None) -> SampledCollision | None:
        """Return eps at the typical speed with its time step, or with another one: mean, least and largest.

        None if there is no step, the program chooses its own, or k/m is not known.
        """
        k_over_m, scheme, speed = self.stiffness_over_mass, self.formula.scheme, self.goal.typical
        step = self.time_step if time_step is None else time_step
        if k_over_m is None or scheme is None or step is None:
            return None
        step /= self.formula.law.contact_time * self._time_scale(speed, k_over_m)
        load = 0.0 if self.goal.epsilon_with_weight is None else self._load(speed, k_over_m)
        return stepped_collision(self.formula.law, self.kappa, step, scheme, load, self.carried)

    def errors(self, kappa: float | None = None) -> list[SpeedErrors]:
        """Return the errors of eps over the speeds, eps/(goal eps) - 1: of typical sizes, then of both extreme ones.

        Another damping at the typical speed may be given, `kappa`.
        """
        goal = self.goal
        # `SPEEDS` speeds in a geometric sequence; `speed_errors` takes the errors for parabolas between them.
        speeds = np.geomspace(goal.slowest, goal.fastest, SPEEDS if goal.slowest < goal.fastest else 1)
        program_eps = np.array([self.delivered(speed, kappa) for speed in speeds.tolist()])
        betas = (goal.beta, *goal.extremes)
        return [
            speed_errors(program_eps / np.array([goal.epsilon(speed, beta) for speed in speeds.tolist()]) - 1)
            for beta in betas
        ]

    def best_parameter(self) -> BestParameter | None:
        """Return the parameter whose largest error over the speeds and sizes is smallest, and that error.

        None if there is one speed only. All errors fall with the damping, so the largest is smallest where the greatest
        and the least are opposite.
        """
        goal = self.goal
        if goal.slowest == goal.fastest or self.kappa == 0:
            return None
        if self.formula.law.nu == 2 and self.time_step is None:
            # The law has one eps e for all speeds. With the goals from e_1 to e_2 the errors are opposite where
            # e/e_1 - 1 = 1 - e/e_2: e is the harmonic mean 2 e_1 e_2/(e_1 + e_2) = 2 e_1/(1 + e_1/e_2).
            betas = (goal.beta, *goal.extremes)
            largest = max(goal.epsilon(goal.slowest, beta) for beta in betas)
            smallest = min(goal.epsilon(goal.fastest, beta) for beta in betas)
            harmonic_mean = 2 * smallest / (1 + smallest / largest)
            return self._parameter_and_error(float(kappa_for_epsilon(self.formula.law, repr(harmonic_mean))))

        def imbalance(log_kappa: Any) -> Any:
            errors = self.errors(float(mp.exp(log_kappa)))
            return max(error.greatest for error in errors) + min(error.least for error in errors)

        # The first secant is between the damping at the typical speed and one that is e^0.1 times as large (by hand).
        start = math.log(self.kappa)
        log_kappa = mp.findroot(imbalance, (start, start + 0.1), solver="secant", tol=_BALANCED_SQUARE)
        return self._parameter_and_error(math.exp(float(log_kappa)))

    def _parameter_and_error(self, kappa: float) -> BestParameter | None:
        """Return the program's number for a kappa, and its largest error over the speeds and sizes; None without."""
        parameter = self._parameter_for(kappa)
        return None if parameter is None else BestParameter(parameter, max(e.largest for e in self.errors(kappa)))

    def longest_step(self, error: float = STEP_ERROR) -> float | None:
        """Return the longest time step, a time, with at most this relative error of eps, of the damping without steps.

        It is without weight. None if there is no time step, or the duration of contact is not known.
        """
        k_over_m, law, scheme = self.stiffness_over_mass, self.formula.law, self.formula.scheme
        if k_over_m is None or scheme is None:
            return None
        # `largest_step` is in units of the undamped contact time.
        undamped_duration = law.contact_time * self._time_scale(self.goal.typical, k_over_m)
        return largest_step(law, self._continuum_kappa, error, self.epsilon, scheme) * undamped_duration


@cache
def _proven_collision(law: Law, kappa: float) -> dict[str, float]:
    """Return the scaled collision without weight and time steps, proven: "epsilon", "x_max" and "tau_c"."""
    return exact.collision(kappa=repr(kappa), law=law, digits=_DIGITS).floats()


@cache
def _mean_collision(
    law: Law, kappa: float, load: float, carried: float, step: float | None, scheme: Scheme | None
) -> SampledCollision:
    """Return a scaled collision with a load G, in time steps with the mean over the phases, without their range.

    `step` is in undamped contact times; `carried` is the part of the load that the contact carries undeformed.
    """
    contact = loaded(law, kappa, load, carried)
    if step is None or scheme is None:
        return contact.collide()
    return contact.collide(step=step * law.contact_time, scheme=scheme, phases=PHASES)


def _increasing_root(function: Callable[[float], float], start: float) -> float:
    """Return where an increasing function is 0, or jumps from below to above 0; the search begins at `start`."""
    low = high = start
    at_low = at_high = function(start)
    # Move the bracket by `_STRETCH` towards the root until it contains it, then narrow it down.
    for _ in range(_MOST_STRETCHES):
        if at_low <= 0 <= at_high:
            return root(function, (low, at_low), (high, at_high), _NARROW)
        if at_low > 0:
            high, at_high, low = low, at_low, low - _STRETCH
            at_low = function(low)
        else:
            low, at_low, high = high, at_high, high + _STRETCH
            at_high = function(high)
    return low


def _broyden(function: Callable[[FloatArray], FloatArray], x: FloatArray, error: float) -> FloatArray:
    """Return where a function of vectors is 0 up to an error, by Broyden's method from `x` and a Jacobian of 1.

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
        # J += (df - J dx) dx^T/|dx|^2, the smallest change with which J dx is df. J dx was minus the old values, so
        # df - J dx is the new ones.
        jacobian += np.outer(values, move) / (move @ move)
    raise ValueError("no convergence")


def outweighs(goal: Goal, time_step: float) -> bool:
    """Return whether in one time step h the weight changes the speed by more than the speed of impact, g h >= v."""
    return goal.epsilon_with_weight is not None and goal.gravity * time_step >= goal.typical


def ways_out(contact: OwnLawContact, goal: Goal, time_step: float, spread: float = math.inf) -> Iterator[str]:
    """Yield options of the command line with which a contact in time steps has the goal eps; each was tried.

    The first is `--contact-time` for a longer contact in these time steps, if there is one; then come shorter steps.

    Parameters
    ----------
    contact : OwnLawContact
        One that exists, so without these steps, or without the weight.
    goal : Goal
        The collisions, with the weight.
    time_step : float
        The steps that are too long.
    spread : float
        Largest difference of eps in single collisions, by where in a step contact begins.
    """
    softness, text = contact.softness, contact.units.time_text
    duration = contact.contact_time
    has_duration = duration is not None and duration < math.inf and not contact.is_chosen
    duration = duration if duration is not None and has_duration else CHOSEN_STEPS * time_step
    # Where the three searches begin: at 20 steps in a contact, or at the contact or steps that there are.
    longest, shortest = max(duration, CHOSEN_STEPS * time_step), min(time_step, duration / CHOSEN_STEPS)
    brief = min(duration, _BRIEF_STEPS * time_step)

    # From a factor >= 1 to a contact and its steps, each with more steps in the contact. The third is for contacts that
    # have to be short as well, because the weight acts as long: with steps shorter by the factor, and a contact by its
    # root, both the duration and the step in contact times fall.
    def longer_contact(factor: float) -> tuple[Softness, float]:
        return Softness(contact_time=with_two_digits(longest * factor)), time_step

    def shorter_steps(factor: float) -> tuple[Softness, float]:
        return softness, with_two_digits(shortest / factor, math.floor)

    def both_shorter(factor: float) -> tuple[Softness, float]:
        brief_contact = Softness(contact_time=with_two_digits(brief / math.sqrt(factor)))
        return brief_contact, with_two_digits(shortest / factor, math.floor)

    for way in (longer_contact, shorter_steps, both_shorter):
        changes_step = way is not longer_contact
        if not changes_step and outweighs(goal, time_step):
            continue  # how long contact lasts does not matter then

        def collision(factor: float, way: Callable[[float], tuple[Softness, float]] = way) -> SampledCollision:
            """Return the collision with a factor; ValueError if it has too few or too many steps, or not this eps."""
            tried_softness, step = way(factor)
            if tried_softness == softness and has_duration:
                tried_duration = duration
            else:
                tried_duration = tried_softness.contact_time or CHOSEN_STEPS * step
            # 1e-9: `with_two_digits` may make a duration shorter by that.
            if not CHOSEN_STEPS * (1 - 1e-9) <= tried_duration / step <= MOST_STEPS:
                raise ValueError
            sampled = replace(contact, goal=goal, softness=tried_softness, time_step=step).collision_in_steps()
            assert sampled is not None
            return sampled

        # `resolved` returns the factor from which on single collisions differ by at most `spread`, None without one.
        factor = resolved(collision, spread)
        if factor is not None:
            tried_softness, step = way(factor)
            options = [f'--time-step "{text(step)}"'] if changes_step else []
            if tried_softness != softness and tried_softness.contact_time is not None:
                options.append(f'--contact-time "{text(tried_softness.contact_time)}"')
            yield " ".join(options)
            if changes_step:
                return


# --- lines of the comment at the beginning of a file ------------------------------------------------------------------
#
# Digits are chosen by hand, for people who compare and copy: six of what is exact or asked for, four of depths and time
# steps, four decimals of a sampled eps, three of an error in percent, and ten of kappa.


def best_line(contact: OwnLawContact, name: str, number: Callable[[float], float] = identity) -> Iterator[str]:
    """Yield a line on the program's number whose largest error of eps over the speeds is smallest.

    `name` is what the program calls it; `number` makes it of the formula's parameter.
    """
    best = contact.best_parameter()
    if best is not None:
        percent = 100 * best.largest_error
        yield f"  the largest error is smallest, {percent:.3g} %, with {name} {number(best.parameter):.6g}"


def constant_row(contact: OwnLawContact, name: str, number: Callable[[float], float] = identity) -> Row:
    """Return columns on a contact whose law has one eps for all speeds: the number for the one at the typical speed.

    Behind it stands the range of errors over the speeds and sizes, or with weight eps at the speeds. The keys of the
    row are names and units of columns; `name` and `number` are as of `best_line`.
    """
    goal, text = contact.goal, program_number(number(contact.parameter))
    if goal.epsilon_with_weight is None:
        return {(name, ""): f"{text} ({in_percent(contact.errors())})"}
    varied = goal.slowest < goal.fastest
    speeds = (goal.slowest, goal.typical, goal.fastest) if varied else (goal.typical,)
    epsilons = " ".join(f"{contact.delivered(speed):.4f}" for speed in speeds)
    return {(name, ""): text, (f"{name}: eps with weight", ""): epsilons}


def best_row(contact: OwnLawContact, name: str, number: Callable[[float], float] = identity) -> Row:
    """Return a column with the number whose largest error is smallest, and this error in percent.

    None with weight, or at one speed; `name` and `number` are as of `best_line`.
    """
    best = None if contact.goal.epsilon_with_weight is not None else contact.best_parameter()
    if best is None:
        return {}
    return {(f"best {name}", ""): f"{number(best.parameter):.6g} ({100 * best.largest_error:.3g} %)"}


def weight_lines(contact: OwnLawContact) -> Iterator[str]:
    """Yield a line on eps with weight at the slowest and the fastest speed, and on that of viscoelastic spheres."""
    goal = contact.goal
    if goal.slowest == goal.fastest:
        return
    ends = goal.slowest, goal.fastest
    program_eps = " and ".join(f"{contact.delivered(speed):.4f}" for speed in ends)
    spheres_eps = "" if goal.spheres is None else " and ".join(f"{e:.4f}" for e in goal.spheres.epsilon(ends).tolist())
    speeds = f"{ends[0]:.6g} and {ends[1]:.6g} {contact.units.speed}"
    yield f"  with weight eps at {speeds}: {program_eps}{spheres_eps and f'; of viscoelastic spheres {spheres_eps}'}"


def render_own_law(
    target: str,
    goals: Sequence[Goal],
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
        A word of `viscopade simulators`, such as "mujoco".
    goals : sequence of Goal
        The collisions of each contact.
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
        If no contact of the program has the goal eps.
    """
    simulator = simulator_with(target)
    text = simulator.texts[target]
    assert isinstance(text, OwnLaw)
    # What the template has of each contact: its name, lines for the comment, the stiffness and the damping's number.
    contacts = list[dict[str, Any]]()
    for goal in goals:
        formula = simulator.formula(text.formula)
        asked_softness = softness or Softness()
        try:
            contact = OwnLawContact(formula, goal, asked_softness, time_step, text.carried, units)
        except TooFewSteps as error:
            # Advise a longer contact or shorter steps, from the contact that exists without weight and steps.
            assert time_step is not None
            light_goal = replace(goal, epsilon_with_weight=None)
            light = OwnLawContact(formula, light_goal, asked_softness, None, text.carried, units)
            raise ValueError(_advice(str(error), light, goal, time_step)) from None
        stiffness = contact.stiffness_over_mass if text.per_mass else contact.stiffness
        if text.per_mass and stiffness is None:
            raise ValueError(
                f"{simulator.title} needs a stiffness: expected --stiffness, --contact-time, --penetration, or "
                f"--time-step for a contact of {CHOSEN_STEPS} steps"
            )
        steps = _step_lines(contact, simulator, units, step_error)
        contacts.append(
            {
                "name": goal.name,
                "lines": [*_contact_lines(contact, text, units), *steps],
                "stiffness": None if stiffness is None else program_number(stiffness),
                text.number: program_number(_number(contact, text, contact.parameter)),
            }
        )
    # A line that all contacts have stands once, at the end.
    first_lines, *other_lines = (contact["lines"] for contact in contacts)
    common = [line for line in first_lines if other_lines and all(line in lines for lines in other_lines)]
    facts = [line for contact in contacts for line in contact["lines"] if line not in common]
    facts += ["In all contacts:", *common] if common else []
    return input_text(text, command, opening, {"contacts": contacts, "units": units, "time_step": time_step}, facts)


def _number(contact: OwnLawContact, text: OwnLaw, parameter: float) -> float:
    """Return the number that the text has for a parameter of the formula, which has no unit.

    It is the parameter times sqrt(k/m) where the text has k/m, over the impact speed v where the parameter is a number
    times v (such as d v), and else the parameter.
    """
    if text.per_mass:
        assert contact.stiffness_over_mass is not None
        return parameter * math.sqrt(contact.stiffness_over_mass)
    return parameter / contact.goal.typical if text.per_speed else parameter


def _contact_lines(contact: OwnLawContact, text: OwnLaw, units: Units) -> Iterator[str]:
    """Yield lines on a contact: its eps over the speeds, how long and deep it is, and what weight does."""
    goal, law = contact.goal, contact.formula.law
    bodies = "without weight" if goal.epsilon_with_weight is None else "of a body that falls on a plane"
    yield (
        f"{goal.name}: eps = {contact.epsilon:.6g} at {goal.typical:.6g} {units.speed} {bodies}, kappa = "
        f"{contact.kappa:.10g}"
    )
    yield f"  the law is {law.equation}, and contact ends where the force vanishes"

    # eps at other speeds
    if goal.epsilon_with_weight is not None:
        yield from weight_lines(contact)
    elif goal.slowest < goal.fastest:
        yield from _speed_lines(contact, text, units)
    elif law.nu != 2:  # with nu = 2 eps is the same at all speeds
        yield "  at other speeds eps is different: --speeds MIN:MAX states its error"

    # duration and depth, if k/m is known
    if contact.contact_time is not None and contact.penetration is not None:
        weight = ", without weight" if goal.epsilon_with_weight is None and goal.gravity else ""
        chosen = f" ({CHOSEN_STEPS} time steps, as nothing else says how long)" if contact.is_chosen else ""
        lasts = f"lasts {contact.contact_time:.6g} {units.time}{chosen}"
        lasts = lasts if contact.contact_time < math.inf else "does not end in some collisions"
        yield (
            f"  contact {lasts} at the typical speed, the penetration reaches {contact.penetration:.4g} {units.length} "
            f"at the fastest{weight}"
        )
    yield from _stiffness_lines(contact, text, units)
    yield from _gravity_lines(contact, units)


def _stiffness_lines(contact: OwnLawContact, text: OwnLaw, units: Units) -> Iterator[str]:
    """Yield a line on the stiffness that the text has: k/m if it is per mass, else k; none if it is not known."""
    k, k_m, mass, law = contact.stiffness, contact.stiffness_over_mass, contact.goal.mass, contact.formula.law
    # k of k x^a is in N/m^a: mass/(time^2 length^(a-1)).
    power, length = ("", "") if law.elastic == 1 else (f"^({law.elastic})", f" {units.length}^({law.elastic - 1})")
    unit = law.stiffness_unit if units == SI else f"{units.mass}/({units.time}^2{length})"
    mass_text = "" if mass is None else f" of the effective mass {mass:.6g} {units.mass}"
    if text.per_mass and k_m is not None:
        whole = "" if k is None else f": k = {k:.6g} {unit}{mass_text}"
        yield f"  stiffness {k_m:.6g} 1/{units.time}^2, which is per effective mass{whole}"
    elif k is not None:
        yield f"  stiffness {k:.6g} {unit}, not per mass: k of the force k x{power}"


def _speed_lines(contact: OwnLawContact, text: OwnLaw, units: Units) -> Iterator[str]:
    """Yield lines on eps at the slowest and the fastest speed, its errors, and the number with the smallest ones."""
    goal = contact.goal
    ends = goal.slowest, goal.fastest
    program_eps, goal_eps = (
        " and ".join(f"{value:.6g}" for value in map(eps, ends)) for eps in (contact.delivered, goal.epsilon)
    )
    bodies = "viscoelastic spheres" if goal.law == VISCOELASTIC else f"the law {goal.law}"
    yield f"  eps at {ends[0]:.6g} and {ends[1]:.6g} {units.speed}: {program_eps}; of {bodies} {goal_eps}"
    sizes = " and sizes" if goal.extremes else ""
    yield f"  relative error of eps over the speeds{sizes}: {in_percent(contact.errors())}"
    yield from best_line(contact, text.number, lambda parameter: _number(contact, text, parameter))


def _gravity_lines(contact: OwnLawContact, units: Units) -> Iterator[str]:
    """Yield lines on what the weight of a body does that falls on a plane, whether eps is asked for with it or not."""
    goal, falling = contact.goal, contact.falling
    if not goal.gravity:
        yield f"  {NO_WEIGHT}"
    elif falling is None:
        # Weight multiplies a small loss 1 - eps by 1 + s g t_c/v; `loss_slope` is s.
        loss_factor = f"1 + {loss_slope(contact.formula.law):.3f} g t_c/v"
        yield f"  weight multiplies the loss 1 - eps by about {loss_factor}; nothing says how long contact lasts"
    else:
        is_asked = goal.epsilon_with_weight is not None
        note, fall = falling.sentences(goal.slowest, goal.fastest, units.speed, is_asked)
        yield f"  {note}"
        if fall is not None and contact.time_step is not None:  # that sentence is without steps
            speeds = list(dict.fromkeys((goal.fastest, goal.slowest)))
            heavy, light = (
                " and ".join(f"{contact.delivered(v, falls=falls):.4f}" for v in speeds) for falls in (True, False)
            )
            fall = (
                f"a body that falls on a plane at {' and '.join(f'{v:.4g}' for v in speeds)} {units.speed} rebounds "
                f"with eps = {heavy} (mean, sampled), without weight {light}"
            )
        if fall is not None:
            yield f"  {'' if is_asked else 'Warning: '}{fall}"


def _advice(error: str, light: OwnLawContact, goal: Goal, time_step: float) -> str:
    """Return an error of a contact in time steps, with options that mend it; `light` has neither steps nor weight."""
    ways = list(ways_out(light, goal, time_step))
    expected = " or ".join(ways) or f"a contact of more than {MOST_STEPS} time steps"
    reason = "" if any(way.startswith("--contact-time") for way in ways) else ", and a longer contact does not help"
    if outweighs(goal, time_step):
        gained = f"{goal.gravity * time_step:.3g} {light.units.speed}"
        reason = f", as the weight changes the speed by {gained} in a step: only shorter steps help"
    return f"{error}{reason}: expected {expected}"


def _step_lines(contact: OwnLawContact, simulator: Simulator, units: Units, step_error: float) -> Iterator[str]:
    """Yield lines on the time step for which the damping makes up, or on the longest one without that.

    `step_error` is the relative error of eps that the longest step may add.
    """
    sampled, default = contact.collision_in_steps(), simulator.default_step
    if sampled is not None and contact.time_step is not None:
        makes_up = "the damping" if abs(sampled.epsilon - contact.epsilon) < _MADE_UP else "no damping"
        yield (
            f"  with the time step {contact.time_step:.6g} {units.time}, for which {makes_up} makes up: eps = "
            f"{sampled.epsilon:.6g} on average, {sampled.least:.6g} to {sampled.largest:.6g} in single collisions"
        )
        if sampled.largest - sampled.least > SPREAD and sampled.duration < math.inf:
            way = next(ways_out(contact, contact.goal, contact.time_step, SPREAD), None)
            if way is not None:
                yield f"  with {way} single collisions differ by {SPREAD:g} at most"
        return
    longest = contact.longest_step(step_error)
    if contact.formula.scheme is not None and longest is None:
        yield "  the longest time step is not known, as nothing says how long contact lasts"
    if longest is not None:
        light = "" if contact.goal.epsilon_with_weight is None else ", without weight"
        yield (f"  Time steps up to {longest:.4g} {units.time} change eps by at most {100 * step_error:g} %{light}")
        yield "  For a longer step, give --time-step: viscopade then adapts the damping"
    if default is not None and longest is not None and default > longest:
        yield from default_step_warning(contact, simulator.title, default, units)


def default_step_warning(contact: OwnLawContact, title: str, step: float, units: Units) -> Iterator[str]:
    """Yield a warning if a program's default time step is too long for a contact, with an option that mends it.

    Parameters
    ----------
    contact : OwnLawContact
        One without a time step, whose duration is known.
    title : str
        The program's.
    step : float
        Its default time step, in the unit of time.
    units : Units
    """
    assert contact.contact_time is not None
    steps, name = contact.contact_time / step, f"{title}'s default step of {units.time_text(step)}"
    # From `FEWEST_STEPS` on in a contact, eps in single collisions is said, and a damping for the step advised.
    sampled = contact.collision_in_steps(step) if steps >= FEWEST_STEPS else None
    fault = f"{name} is {1 / steps:.2g} contacts long"
    if sampled is not None:
        fault = (
            f"with {name} eps is {sampled.epsilon:.4g} on average, {sampled.least:.4g} to {sampled.largest:.4g} in "
            "single collisions"
        )
        try:
            adapted = replace(contact, time_step=step)
        except ValueError:  # no damping gives this eps in so few steps
            adapted = None
        if adapted is not None:
            yield f'  Warning: {fault}; --time-step "{units.time_text(step)}" adapts the damping'
            return
    # Else a longer contact, or shorter steps.
    way = next(ways_out(contact, contact.goal, step), None)
    if way is None:
        yield f"  Warning: {fault}"
    elif way.startswith("--contact-time"):
        yield f"  Warning: {fault}; {way} makes a contact that it resolves"
    else:
        yield f"  Warning: {fault}; shorter steps are necessary: {way}"
