"""Programs whose contacts have a law of their own: the damping for a wanted eps, and a stiffness of one's choice.

MuJoCo, Drake, Simbody, Chrono and JaxDEM have no viscoelastic law. Each has another power-law contact
(`viscopade.theory.law`), with a damping that is exact at one impact speed. At other speeds eps is that of the program's
law, so it is off: `SoftContact.errors` says by how much. The error may be largest between the slowest and the fastest
speed.

The damping does not depend on the stiffness. That is free: a stiff contact is short and shallow, and needs short time
steps. With a force k x^a it is stated as k/m (m is the effective mass), which follows from the contact time or from the
largest penetration alone.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
from mpmath import mp

from viscopade.arrays import double
from viscopade.collision import exact
from viscopade.collision.contact import SampledCollision
from viscopade.collision.schemes import SEMI_IMPLICIT
from viscopade.collision.spheres import beta_from_restitution, v_star
from viscopade.collision.weight import EARTH, FallingContact
from viscopade.simulators.audit import Advice, advised
from viscopade.simulators.formula import DampingFormula, compensated, epsilon_of, same, stepped_collision, wanted_kappa
from viscopade.simulators.setup import NamedContact
from viscopade.simulators.stated import SPEEDS, SpeedErrors, error_lines, program_number, speed_errors
from viscopade.theory.law import VISCOELASTIC, Law

STEP_ERROR = 0.01
"""Relative error of eps by the time step, for the longest step that the files state."""
_CLOSE = 1e-12  # square of the difference of the greatest and the least error, where they are balanced
_DIGITS = 15
_LEAST = 1e-30
_SLOWEST, _WIDEST = 1e-12, 1e6  # impact speed, and range of speeds
_LEAST_STEP = 1e-3  # in contact times


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
            beta = float(wanted_kappa(law, repr(epsilon))) / speed ** float(2 * law.c)
        found = cls("contact", beta, slowest, speed, fastest, mass, law=law)
        return found if gravity is None else replace(found, gravity=gravity, with_weight=epsilon)

    @classmethod
    def of(cls, contact: NamedContact, weighty: bool = False) -> Wanted:
        """Return the collisions of a contact."""
        pair = contact.pair
        return cls(
            contact.name,
            pair.beta,
            contact.slowest,
            contact.typical,
            contact.fastest,
            pair.m_eff,
            float(pair.contact_time(contact.typical)),
            tuple(size.beta for size in contact.extremes),
            contact.gravity if contact.falls else 0.0,
            float(contact.falling.epsilon([contact.typical])[0]) if weighty and contact.falls else None,
        )

    def epsilon(self, speed: float, beta: float | None = None) -> float:
        """Return eps at a speed, of typical bodies or with another beta."""
        factor = self.beta if beta is None else beta
        if self.law == VISCOELASTIC:
            return float(double.epsilon(v_star(speed, factor)))
        return float(epsilon_of(self.law, mp.mpf(factor * speed ** float(2 * self.law.c))))


@dataclass(frozen=True)
class Softness:
    """How soft a contact is, by one of three numbers; the viscoelastic contact's duration if none is given.

    Attributes
    ----------
    stiffness : float, optional
        k of the force k x^a; for MuJoCo k/m.
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
    contact_time: float | None = None
    penetration: float | None = None

    def __post_init__(self) -> None:
        given = {name: value for name, value in vars(self).items() if value is not None}
        if len(given) > 1:
            raise ValueError(f"{' and '.join(given)} are given: expected one of them")
        for name, value in given.items():
            if not _LEAST <= value <= 1 / _LEAST:
                raise ValueError(f"{name} is {value!r}: expected a number from {_LEAST:g} to {1 / _LEAST:g}")


@dataclass(frozen=True)
class SoftContact:
    """A program's contact that has the wanted eps at the typical speed.

    Attributes
    ----------
    formula : DampingFormula
        The program's, with its law, end of contact and integrator.
    wanted : Wanted
    softness : Softness
    per_mass : bool
        Whether the program's stiffness is k/m.
    time_step : float or None
        If given, the damping makes up for it.
    carried : float
        The part of a weight that the program's contact carries without a penetration.

    Raises
    ------
    ValueError
        If a time step is given and the contact's duration is not known, or no damping gives the wanted eps.
    """

    formula: DampingFormula
    wanted: Wanted
    softness: Softness = Softness()
    per_mass: bool = False
    time_step: float | None = None
    carried: float = 0.0

    def __post_init__(self) -> None:
        slowest, fastest = self.wanted.slowest, self.wanted.fastest
        if self.formula.law.nu != 2 and not _SLOWEST <= slowest <= fastest <= min(1 / _SLOWEST, _WIDEST * slowest):
            raise ValueError(
                f"speeds of {self.wanted.name} are {slowest:g} to {fastest:g}: expected {_SLOWEST:g} to "
                f"{1 / _SLOWEST:g}, and at most {_WIDEST:g} times the slowest"
            )
        if self.wanted.with_weight is not None and self.stiffness_over_mass is None:
            raise ValueError("gravity needs the contact's duration: expected a contact time with it")
        if self.time_step is not None and self.formula.scheme is None:
            raise ValueError("a time step is given: expected none, as the program chooses its own")
        if self.time_step is not None and self.stiffness_over_mass is None:
            raise ValueError("a time step needs the contact's duration: expected a contact time with it")
        step = self._step(self.wanted.typical)
        if step is not None and not _LEAST_STEP <= step <= 1:
            raise ValueError(
                f"time-step is {step:.4g} contact times: expected {_LEAST_STEP:g} to 1; shorter ones need no number"
            )
        if self._parameter(self.kappa) is None:
            dampings = (self.formula.kappa(mp.mpf(end)) for end in self.formula.accepted)
            least, most = sorted(float(epsilon_of(self.formula.law, kappa)) for kappa in dampings)
            raise ValueError(
                f"epsilon is {self.epsilon:.6g}: expected {least:.4g} to {most:.4g}, which {self.formula.parameter} "
                f"from {self.formula.accepted[0]} to {self.formula.accepted[1]} gives"
            )

    @property
    def epsilon(self) -> float:
        """The wanted eps, at the typical speed."""
        alone = self.wanted.epsilon(self.wanted.typical)
        return alone if self.wanted.with_weight is None else self.wanted.with_weight

    @cached_property
    def kappa(self) -> float:
        """Damping of the scaled equation at the typical speed; it makes up for a time step, and for a weight."""
        step, scheme, load = self._step(self.wanted.typical), self.formula.scheme, self._load
        if not load and (step is None or scheme is None):
            return self._continuum
        return compensated(self.formula.law, self.epsilon, step, scheme or SEMI_IMPLICIT, load, self.carried)

    @property
    def falling(self) -> FallingContact | None:
        """The contact with a weight; None if there is none, or the duration of contact is not known."""
        speed = self.wanted.typical
        time = self._time_scale(speed)
        if time is None or not self.wanted.gravity:
            return None
        return FallingContact(self.formula.law, self.kappa, time, speed, self.wanted.gravity, self.carried)

    @property
    def _load(self) -> float:
        """G of the scaled equation at the typical speed that the damping makes up for."""
        time = None if self.wanted.with_weight is None else self._time_scale(self.wanted.typical)
        return 0.0 if time is None else self.wanted.gravity * time / self.wanted.typical

    @property
    def _continuum(self) -> float:
        """The kappa without a time step."""
        return float(wanted_kappa(self.formula.law, repr(self.epsilon)))

    @property
    def parameter(self) -> float:
        """What the program's formula takes for `kappa`."""
        parameter = self._parameter(self.kappa)
        assert parameter is not None  # a contact without one is refused
        return parameter

    def _parameter(self, kappa: float) -> float | None:
        found = self.formula.parameter_of(mp.mpf(kappa))
        return None if found is None else float(found)

    @cached_property
    def stiffness_over_mass(self) -> float | None:
        """k/m of the force k x^a; None if nothing is known of it."""
        given, wanted, law = self.softness, self.wanted, self.formula.law
        if given.stiffness is not None:
            if self.per_mass:
                return given.stiffness
            return None if wanted.mass is None else given.stiffness / wanted.mass
        power = float(law.elastic) + 1
        kappa = self._continuum  # a step is known only in units of what is computed here
        if given.penetration is not None:
            length = given.penetration / self._scaled(self._at(kappa, wanted.fastest))["x_max"]
            return float((wanted.fastest ** (2 / power) / length) ** power)
        duration = wanted.contact_time if given.contact_time is None else given.contact_time
        if duration is None:
            return None
        time = duration / self._scaled(kappa)["tau_c"]
        return float((wanted.typical ** (2 / power - 1) / time) ** power)

    @property
    def stiffness(self) -> float | None:
        """Constant k of the force k x^a; None if it or the mass is not known."""
        if self.softness.stiffness is not None and not self.per_mass:
            return self.softness.stiffness
        mass, over_mass = self.wanted.mass, self.stiffness_over_mass
        return None if mass is None or over_mass is None else over_mass * mass

    @property
    def contact_time(self) -> float | None:
        """Duration of contact at the typical speed."""
        unit = self._time_scale(self.wanted.typical)
        return None if unit is None else self._scaled(self.kappa)["tau_c"] * unit

    @property
    def penetration(self) -> float | None:
        """Largest compression at the fastest speed."""
        speed = self.wanted.fastest
        unit = self._time_scale(speed)
        return None if unit is None else self._scaled(self._at(self.kappa, speed))["x_max"] * unit * speed

    def delivered(self, speed: float, kappa: float | None = None) -> float:
        """Return eps at a speed; with a time step its mean over where in a step contact begins.

        Parameters
        ----------
        speed : float
        kappa : float, optional
            Damping at the typical speed, instead of `kappa`.
        """
        damping, step = self._at(self.kappa if kappa is None else kappa, speed), self._step(speed)
        if step is None or self.formula.scheme is None:
            return float(epsilon_of(self.formula.law, mp.mpf(damping)))
        return stepped_collision(self.formula.law, damping, step, self.formula.scheme).epsilon

    @property
    def range(self) -> SampledCollision | None:
        """Eps at the typical speed with the time step: single collisions differ."""
        step = self._step(self.wanted.typical)
        if step is None or self.formula.scheme is None:
            return None
        return stepped_collision(self.formula.law, self.kappa, step, self.formula.scheme, self._load, self.carried)

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
            return self._with_error(float(wanted_kappa(self.formula.law, repr(2 * least / (1 + least / most)))))

        def spread(logarithm: Any) -> Any:
            errors = self.errors(float(mp.exp(logarithm)))
            return max(each.greatest for each in errors) + min(each.least for each in errors)

        start = math.log(self.kappa)
        return self._with_error(math.exp(float(mp.findroot(spread, (start, start + 0.1), solver="secant", tol=_CLOSE))))

    def _with_error(self, kappa: float) -> tuple[float, float] | None:
        parameter = self._parameter(kappa)
        return None if parameter is None else (parameter, max(each.largest for each in self.errors(kappa)))

    def advice(self, error: float = STEP_ERROR) -> Advice | None:
        """Return how eps depends on the time step without a damping that makes up for it, in units of time.

        None if there is no time step, or the duration of contact is not known.
        """
        unit = self._unit_of_steps(self.wanted.typical)
        if unit is None:
            return None
        found = advised(self.formula, self._continuum, self.epsilon, error)
        return None if found is None else Advice(error, found.largest_step * unit, found.slope / unit)

    def _scaled(self, kappa: float) -> dict[str, float]:
        """Return the numbers of the scaled equation."""
        return exact.collision(kappa=repr(kappa), law=self.formula.law, digits=_DIGITS).floats()

    def _at(self, kappa: float, speed: float) -> float:
        """Return kappa at a speed, from that at the typical one."""
        return float(kappa * (speed / self.wanted.typical) ** float(2 / self.formula.law.nu - 1))

    def _time_scale(self, speed: float) -> float | None:
        """Return the unit of tau at a speed."""
        over_mass = self.stiffness_over_mass
        return None if over_mass is None else self.formula.law.time_scale(speed, k=over_mass, mass=1.0)

    def _unit_of_steps(self, speed: float) -> float | None:
        """Return the undamped contact time at a speed."""
        unit = self._time_scale(speed)
        return None if unit is None else self.formula.law.contact_time * unit

    def _step(self, speed: float) -> float | None:
        """Return the time step in undamped contact times at a speed."""
        unit = self._unit_of_steps(speed)
        return None if unit is None or self.time_step is None else self.time_step / unit


def best_line(contact: SoftContact, name: str, number: Callable[[float], float] = same) -> Iterator[str]:
    """Yield a line on the number with the smallest largest error; `number` makes it of the parameter."""
    best = contact.balanced()
    if best is not None:
        yield f"  the largest error is smallest, {best[1]:.2e}, with {name} {number(best[0]):.6g}"


def constant_lines(contact: SoftContact, name: str, number: Callable[[float], float] = same) -> Iterator[str]:
    """Yield lines on a contact with one eps for all speeds: the number for it, and its errors."""
    written = program_number(number(contact.parameter))
    yield f"  {name} {written} gives eps = {program_number(contact.epsilon)}, the exact one at the typical speed"
    yield from error_lines(contact.errors())
    yield from best_line(contact, name, number)
