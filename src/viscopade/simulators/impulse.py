"""Engines with impulses: PhysX, Bullet, Jolt and Box2D, and SolverXPBD of Newton.

    material = physics.createMaterial(0.5, 0.5, 0.8)                          PhysX; restitution_combine_mode of Isaac
    p.changeDynamics(ball, -1, restitution=0.8)                               Bullet, by PyBullet
    settings.mRestitution = 0.8f                                              Jolt
    fixture.restitution = 0.8f, or shapeDef.material.restitution = 0.8f       Box2D 2.4, or 3

Such an engine has no force: in one step it makes a rebound of an approach. In the limit of short steps eps is the
combined restitution of both bodies above a threshold speed, and 0 below it. In steps of h five things change eps, and
each function of a step below says which of them its engine has:

1. Gravity kicks the body by g h before the rebound. If the speed that is reflected contains the kick, eps is right on
   average; if not, the rebound lacks g h.
2. The threshold is compared with the speed with the kick, or without it.
3. A margin: bodies touch before they meet, and rebound from where they are at the start of the step.
4. A body that is not within the margin overlaps first, and is pushed out: by its position, or by its speed.
5. Continuous collision stops a fast body on its path.

What a rebound has lost or gained in height counts in eps, which is that of the flight after it.

    p.changeDynamics(ball, -1, contactStiffness=1e4, contactDamping=10)       Bullet
    compliant_contact_stiffness=1e4, compliant_contact_damping=10             PhysX, by Isaac: a material

A stiffness makes the contact soft: the step of such an engine then has the force of a `Spring`.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator, Mapping
from functools import partial
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from viscopade.arrays.checked import FloatArray
from viscopade.collision.contact import PHASES, Contact, sticking_speed
from viscopade.collision.schemes import SEMI_IMPLICIT
from viscopade.simulators import native
from viscopade.simulators.formula import LINEAR, Row, force_end_kappa, formulas
from viscopade.simulators.native import Impact, Impulse, Parameter, Rule, Values
from viscopade.simulators.simulator import Simulator

_MOST_STEPS = 1000  # until a body has left a hard contact
_MOST_SOFT = 10_000  # steps in a soft contact
_LEAD = 2  # steps before contact, from which on a margin may act
_LEAST_WRITTEN = 1e-15  # restitution
_REST = 1e-6  # change of a rate in a step, over the speed of impact, of a body that stays

PRODUCT = Rule("the product", lambda first, second: first * second)
_RULES = {"average": native.MEAN, "min": native.SMALLER, "multiply": PRODUCT, "max": native.LARGER}
"""Rules that make one restitution of two; if two materials of PhysX name different ones, the later counts."""


class Spring(NamedTuple):
    """A soft contact: a spring and a damper whose force is that at the end of a step, as of implicit Euler's method.

    Attributes
    ----------
    stiffness, damping : float
    mass : float
        The effective one of both bodies.
    """

    stiffness: float
    damping: float
    mass: float

    def erp(self, step: float) -> float:
        """Return the part of an overlap that a step removes if nothing else acts, in ODE's words."""
        # ERP = h k/(h k + c)
        return step * self.stiffness / (step * self.stiffness + self.damping)

    def share(self, step: float) -> float:
        """Return the part of the way to a wanted rate that a step goes."""
        # 1/(1 + m CFM/h), CFM = 1/(h k + c): the force (w_wanted - w)/CFM acts on the mass
        impulse = step * (step * self.stiffness + self.damping)
        return impulse / (impulse + self.mass)

    def contact(self, impact: Impact, force: Callable[[FloatArray, FloatArray], FloatArray] | None = None) -> Contact:
        """Return the contact in the limit of short steps, with the force k x + c v unless another is given."""
        k, c = self.stiffness, self.damping
        return Contact(force or (lambda x, v: k * x + c * v), self.mass, self.mass * impact.gravity)


class Ground(NamedTuple):
    """A plane with which a body may collide in a time step.

    Attributes
    ----------
    restitution : float
        That of the contact.
    threshold : float
        Speed above which a body rebounds; infinite without restitution.
    margin : float
        Distance at which the engine is_seen the contact.
    gravity, step : float
    radius : float
        That of the body; infinite if it is not known.
    numbers : mapping of str to float
        Other parameters of the engine by name.
    spring : Spring or None
        That of a soft contact.
    """

    restitution: float
    threshold: float
    margin: float
    gravity: float
    step: float
    radius: float = math.inf
    numbers: Mapping[str, float] = {}
    spring: Spring | None = None


Motion = tuple[FloatArray, FloatArray]
"""Distances of bodies from the plane, negative if they overlap, and the rates of these distances."""
Step = Callable[[FloatArray, FloatArray, Ground], Motion]
"""The motion after a step of an engine, from that before it."""


def flight_epsilon(step: Step, ground: Ground, speed: float, phases: FloatArray) -> FloatArray:
    """Return the eps of a body for each phase, from the flight after contact; 0 if it stays."""
    g, h = ground.gravity, ground.step

    # The flight before contact passes through (gap, rate) = (0, -speed) at a phase of a step. It begins some steps
    # earlier, but not before the body's highest point.
    lead = phases * h if g == 0 else np.minimum(phases * h, speed / g)
    lead = lead + h * (_LEAD if g == 0 else np.clip((speed / g - lead) // h, 0, _LEAD))

    # In flight gap + h (rate - g h) is the next gap. That is a parabola if its rate at the start is rate - g h/2.
    gap, rate = lead * speed - g / 2 * lead**2, g * lead - speed + g * h / 2
    epsilon, has_left = np.zeros_like(phases), np.zeros(phases.shape, bool)
    # A soft contact without damping lasts for pi sqrt(m/k).
    soft_time = 0.0 if ground.spring is None else math.pi * math.sqrt(ground.spring.mass / ground.spring.stiffness)
    if soft_time > _MOST_SOFT * h:
        steps = f"an undamped contact lasts {soft_time:.3g} s, and at most {_MOST_SOFT} steps are computed"
        raise ValueError(f"time-step is {h:g} s: expected a longer one, or a stiffer contact: {steps}")
    for _ in range(_MOST_STEPS + int(3 * soft_time / h)):
        last_gap, last_rate = gap, rate
        gap, rate = step(gap, rate, ground)
        leaves = ~has_left & (gap >= 0) & (rate > g * h / 2)
        # eps^2 = (v^2 + 2 g gap)/speed^2, the energy at the level of contact
        epsilon = np.where(leaves, np.sqrt((rate - g * h / 2) ** 2 + 2 * g * np.maximum(gap, 0)) / speed, epsilon)
        has_left |= leaves
        rests = (np.abs(gap - last_gap) < _REST * speed * h) & (np.abs(rate - last_rate) < _REST * speed)
        if (has_left | rests).all():
            break
    return epsilon


def xpbd(gap: FloatArray, rate: FloatArray, ground: Ground) -> Motion:
    """SolverXPBD of Newton 1.8.0: newton/_src/solvers/xpbd/restitution_kernels.py.

    The reflected speed contains the kick; the threshold is 2 g h. Two iterations each leave a fifth of an overlap.
    """
    h = ground.step
    kicked = rate - ground.gravity * h
    drifted = gap + h * kicked
    solved = np.where(drifted < 0, 0.2**2 * drifted, drifted)
    rebounding = (drifted < 0) & (-kicked > ground.threshold)
    return solved, np.where(rebounding, -ground.restitution * kicked, (solved - gap) / h)


def _physx_pgs(gap: FloatArray, rate: FloatArray, ground: Ground) -> Motion:
    """PhysX, constructContactConstraint of DyContactPrepShared.h.

    Reflected speed and threshold contain the kick. A body that would meet the plane in this step rebounds at once, from
    where it is. Others come to the plane, or move out of it by 0.8 of an overlap, which is no speed afterwards. (Up to
    5.3.1 they come only 0.8 of the way, and lose speed.)

    A compliant contact is an implicit step of its spring, and acts also in the step in which bodies meet
    (`computeCompliantContactCoefficients`).
    """
    h = ground.step
    kicked = rate - ground.gravity * h
    is_seen = gap < ground.margin
    if (spring := ground.spring) is not None:
        target = -spring.erp(h) / h * gap
        acts = is_seen & ((gap < 0) | (gap + h * kicked < 0))
        new = np.where(acts, kicked + spring.share(h) * np.maximum(target - kicked, 0), kicked)
        return gap + h * new, new
    rebounding = is_seen & (gap + h * kicked < 0) & (-kicked > ground.threshold)
    to_plane = -gap / h * np.where(gap < 0, 0.8, 1)  # invDtp8
    rebound = -ground.restitution * kicked

    # The first pass moves the body; gaps above ccdMaxSeparation are closed in the step of a rebound, too.
    target = np.where(rebounding, rebound + np.where(gap > 0.04, to_plane, 0), to_plane)
    moving = np.where(is_seen, np.maximum(kicked, target), kicked)

    # The second pass gives it its speed.
    target = np.where(rebounding, rebound, np.minimum(to_plane, 0))
    return gap + h * moving, np.where(is_seen, np.maximum(kicked, target), kicked)


def _physx_tgs(gap: FloatArray, rate: FloatArray, ground: Ground) -> Motion:
    """PhysX, constructContactConstraintStep and solveDynamicContactsStep of DyTGSContactPrep.cpp.

    As with PGS, but the position iterations are short steps, in which the place of a rebound has a target, too. The
    velocity iterations leave a body no more speed than what would close its gap in a short step: one that meets the
    plane early in the next step is slowed down before. (Up to 5.4.1 it rebounds a short step earlier instead.) A
    compliant contact is an implicit step of its spring in each short step.
    """
    n_position, n_velocity = (
        int(ground.numbers[f"solver_{kind}_iteration_count"]) for kind in ("position", "velocity")
    )
    h = ground.step
    kicked = rate - ground.gravity * h
    is_seen = gap < ground.margin
    rebounding = is_seen & (gap + h * kicked < 0) & (-kicked > ground.threshold)
    target = np.where(rebounding, -ground.restitution * kicked, 0)
    # At a time t of the step, a rebound is to be at the place target (t - h - gap/kicked): at the end of the step, at
    # the target times the time of the impact, -gap/kicked.
    error = gap + target * (h + gap / np.where(rebounding, kicked, 1))
    # A short step closes a gap, and leaves an overlap by mBiasCoefficient, at most 0.8.
    rate_of_error = np.where(gap > 0, 1, min(0.8, 2 / math.sqrt(n_position))) * n_position / h
    share, acts = 1.0, is_seen
    if (spring := ground.spring) is not None:
        if n_velocity:
            raise ValueError(
                f"solver_velocity_iteration_count is {n_velocity}: expected 0, as others are not computed with TGS and "
                "a compliant contact"
            )
        target, error, share = np.zeros_like(gap), gap, spring.share(h / n_position)
        rate_of_error = np.full_like(gap, spring.erp(h / n_position) * n_position / h)
        acts = is_seen & ((gap < 0) | (gap + h * kicked < 0))

    place, speed, impulse = gap, kicked, np.zeros_like(gap)
    for i in range(n_position + n_velocity):
        remaining = error + place - gap - target * min(i, n_position) * h / n_position
        if i >= n_position:  # velocity iterations remove no overlap, and do not move the body
            remaining = np.maximum(remaining, 0)
        # The sum of all pushes is no pull.
        push = np.where(acts, np.maximum(share * (target - rate_of_error * remaining - speed), -impulse), 0)
        impulse, speed = impulse + push, speed + push
        if i < n_position:
            place = place + h / n_position * speed
    return place, speed


def _physx_warnings(values: Values, impact: Impact) -> Iterator[str]:
    if impact.step and "compliant_contact_stiffness" in values:
        yield "Compliant contacts are those of the source of PhysX, which was not run with them"
    if values["solver_type"] == "TGS" and values["solver_velocity_iteration_count"]:
        text = "Velocity iterations of TGS take the speed of some rebounds"
        yield f"{text}: from the source of PhysX 5.4.2 and later, which was not run"


def _bullet(gap: FloatArray, rate: FloatArray, ground: Ground, is_multi_body: bool = True) -> Motion:
    """Bullet, setupMultiBodyContactConstraint, and setupContactConstraint of btSequentialImpulseConstraintSolver.cpp.

    Reflected speed and threshold contain the kick, except for a btRigidBody. A body within the margin rebounds at once,
    and loses gap/h of its rate: all of it if the gap is larger than restitution times speed times h. So nothing
    rebounds in steps that are short against the margin. An overlap adds erp overlap/h to the rate. A soft contact goes
    a share of the way to that rate, and pushes only.
    """
    h, slop = ground.step, 1e-5  # contactSlop of PyBullet
    erp, share = ground.numbers["contactERP"], 1.0
    if ground.spring is not None:
        erp, share = ground.spring.erp(h), ground.spring.share(h)
    kicked = rate - ground.gravity * h
    reflected = kicked if is_multi_body else rate
    rebound = np.where(-reflected < ground.threshold, 0, -ground.restitution * reflected)
    distance = gap + slop
    correction = -distance / h * np.where(distance > 0, 1, erp)

    # Deep overlaps of btRigidBody move the body, without a speed afterwards (m_splitImpulsePenetrationThreshold).
    is_seen = gap < ground.margin
    moves = is_seen & (distance <= -0.04) & (not is_multi_body)
    target = rebound + np.where(moves, 0, correction)
    new = np.where(is_seen, kicked + share * np.maximum(target - kicked, 0), kicked)
    return gap + h * (new + np.where(moves, share * correction, 0)), new


def _bullet_warnings(values: Values, impact: Impact) -> Iterator[str]:
    if impact.step is None and values["contactBreakingThreshold"]:
        yield "A sphere on a plane rebounds less the shorter the steps are, because of its margin: give --time-step"


def _jolt(gap: FloatArray, rate: FloatArray, ground: Ground) -> Motion:
    """Jolt, CalculateNonPenetrationConstraintProperties of ContactConstraintManager.cpp.

    The threshold contains the kick, the reflected speed does not. A body that would meet the plane in this step
    rebounds at once, from where it is. Overlaps above mPenetrationSlop are removed without a speed afterwards.
    """
    h, slop = ground.step, 0.02  # mPenetrationSlop
    kicked = rate - ground.gravity * h
    approach = np.maximum(gap, 0) / h
    is_seen = gap < ground.margin
    rebounding = is_seen & (-kicked > np.maximum(ground.threshold, approach))
    new = np.where(rebounding, -ground.restitution * rate, np.where(is_seen, np.maximum(kicked, -approach), kicked))
    place = gap + h * new
    for _ in range(2):  # mNumPositionSteps, each with mBaumgarte = 0.2, and mMaxPenetrationDistance = 0.2
        place = place - np.where(is_seen, np.clip(0.2 * (place + slop), -0.2, 0), 0)
    return place, new


def _box2d_2(gap: FloatArray, rate: FloatArray, ground: Ground) -> Motion:
    """Box2D 2, b2_contact_solver.cpp and b2World::SolveTOI; 3 position iterations.

    Reflected speed and threshold contain the kick. The plane has a skin of 2 b2_linearSlop. A body that overlaps it at
    the start of a step rebounds then; one whose path goes deeper than 3 slops into it rebounds there.
    """
    slop, h = 0.005, ground.step  # b2_linearSlop
    kicked, start = rate - ground.gravity * h, gap - 2 * slop

    def reflected(rate: FloatArray) -> FloatArray:
        return np.where(-rate > ground.threshold, -ground.restitution * rate, np.maximum(rate, 0))

    def corrected(place: FloatArray, active: NDArray[np.bool_], share: float, enough: float, most: int) -> FloatArray:
        """Return the place after iterations that each remove a share of the overlap, until it was small enough."""
        for _ in range(most):
            is_enough = place >= enough
            place = place - np.where(active, np.clip(share * (place + slop), -0.2, 0), 0)  # b2_maxLinearCorrection
            active = active & ~is_enough
        return place

    # b2_baumgarte and 3 iterations, or b2_toiBaumgarte and 20; each has its own least overlap.
    touches = start <= 0
    new = np.where(touches, reflected(kicked), kicked)
    end = corrected(start + h * new, touches, 0.2, -3 * slop, 3)

    # The time of impact, found by halving the path once and then by a secant, is exact to a quarter of the slop.
    is_deep = start < -2.75 * slop
    meets = is_deep | (end < -3.25 * slop)
    middle = (start + end) / 2
    secant = (start + 3 * slop) / np.where(meets & ~is_deep, start - end, 1)
    time = np.where(is_deep, 0, np.where(np.abs(middle + 3 * slop) < slop / 4, 0.5, secant))
    # 1e-6: two iterations are enough, although rounding may say that they miss it
    place = corrected(start + time * (end - start), meets, 0.75, -1.5 * slop - 1e-6, 20)
    new = np.where(meets, reflected(new), new)
    return np.where(meets, place + (1 - time) * h * new, end) + 2 * slop, new


def _box2d_3(gap: FloatArray, rate: FloatArray, ground: Ground) -> Motion:
    """Box2D 3, contact_solver.c and b2SolveContinuous of solver.c.

    Reflected speed and threshold are those before the step, without the kick. The contact is a soft spring in
    subStepCount short steps, after which a body that was pushed gets its rebound. A fast one is put back to the place
    where it met the plane, and rebounds in the next step.
    """
    substeps, slop = int(ground.numbers["subStepCount"]), 0.005  # B2_LINEAR_SLOP
    h = ground.step / substeps

    # b2MakeSoft with contactHertz = 30, at most 1/(8 h), twice for static bodies; contactDampingRatio = 10
    omega, zeta = 2 * math.pi * 2 * min(30.0, 0.125 / h), 10
    stiffness = h * omega * (2 * zeta + h * omega)
    mass_scale = stiffness / (1 + stiffness)
    bias_rate = omega / (2 * zeta + h * omega)

    is_seen, is_pushed = gap <= ground.margin, np.zeros(gap.shape, bool)
    place, new = gap, rate
    for _ in range(substeps):
        kicked = new - ground.gravity * h
        # A gap is closed at most; an overlap is left by bias_rate, at most at maxContactPushSpeed = 3 m/s.
        bias = np.where(place > 0, place / h, np.maximum(bias_rate * place, -3 / mass_scale))
        push = np.where(is_seen, np.maximum(-np.where(place > 0, 1, mass_scale) * (kicked + bias), 0), 0)
        place = place + h * (kicked + push)
        # The relaxation takes back what was for the place alone.
        new = np.where(is_seen, np.maximum(kicked, -np.maximum(place, 0) / h), kicked)
        is_pushed |= (push > 0) | (new > kicked)

    rebounding = is_pushed & (-rate >= ground.threshold)
    new = np.where(rebounding, np.maximum(new, -ground.restitution * rate), new)
    # Time of impact: at an overlap of the slop, to a quarter of it.
    is_fast = np.abs(new) * ground.step > ground.radius / 2
    meets = is_fast & (gap > -0.75 * slop) & (place < -1.25 * slop)
    return np.where(meets, -slop, place), new


class Soft(NamedTuple):
    """Parameters of an engine's soft contact, which is chosen by setting the stiffness.

    Attributes
    ----------
    stiffness, damping : Parameter
    combined : callable
        From values with a stiffness to the stiffness and the damping of the contact, which is hard without stiffness.
    rebounds : bool
        Whether restitution acts, too.
    """

    stiffness: Parameter
    damping: Parameter
    combined: Callable[[Values], tuple[float, float]]
    rebounds: bool

    def spring(self, values: Values, impact: Impact) -> Spring | None:
        """Return the spring of both bodies; None if the contact is hard."""
        if self.stiffness.name not in values:
            return None
        stiffness, damping = self.combined(values)
        return Spring(stiffness, damping, impact.effective_mass) if stiffness > 0 else None


def _springs_in_series(values: Values) -> tuple[float, float]:
    source = "btManifoldResult::addContactPoint"
    return values.mix("contactStiffness", native.SERIES, source), values.mix("contactDamping", native.SUM, source)


def _compliance(values: Values) -> tuple[float, float]:
    """Return what PhysX makes of both materials, of which one may be hard."""
    source, stiffness, dampings = "PxsCombineMaterials", "compliant_contact_stiffness", (0.0, 0.0)
    if "compliant_contact_damping" in values:
        dampings = values["compliant_contact_damping"]
    # PhysX combines the restitutions, which are -k: the least is the stiffest.
    mode = max(values["restitution_combine_mode"], key=[*_RULES].index)
    of_stiffness = {"average": native.MEAN, "min": native.LARGER, "multiply": PRODUCT, "max": native.SMALLER}[mode]
    of_damping = native.MEAN
    if min(values[stiffness]) == 0:  # that of the compliant material
        of_stiffness = of_damping = native.LARGER
    damping = values.mix("compliant_contact_damping", of_damping, source, dampings)
    return values.mix(stiffness, of_stiffness, source), damping


class Engine(NamedTuple):
    """What a user sets in an engine, and what the engine does in a step.

    Attributes
    ----------
    title, version, source : str
        As of `Simulator` and `Native`.
    combining : str
        Function of the engine that makes one restitution of two.
    combination : Parameter
        What chooses its rule.
    restitution : str
        Name of the restitution of a body.
    threshold : Parameter
        Speed up to which there is no rebound.
    others : tuple of Parameter
    margin : callable
        From the values and an impact to the distance at which the engine is_seen a contact.
    choice : str
        Name of what chooses a step.
    steps : mapping of str to callable
        By that choice.
    warnings : callable
        As of `Native`.
    soft : Soft or None
        Its soft contacts.
    """

    title: str
    version: str
    source: str
    combining: str
    combination: Parameter
    restitution: str
    threshold: Parameter
    others: tuple[Parameter, ...]
    margin: Callable[[Values, Impact], float]
    choice: str
    steps: Mapping[str, Step]
    warnings: Callable[[Values, Impact], Iterable[str]] = lambda values, impact: ()
    soft: Soft | None = None

    def collision(self, values: Values, impact: Impact) -> Impulse | Contact:
        """Return the collision, a contact only if it is soft and has no time steps."""
        # Of the rules that two materials name, the later of `_RULES` counts.
        chosen = values[self.combination.name]
        rule = max(chosen if self.combination.per_body else (chosen,), key=[*_RULES].index)
        combined = values.mix(self.restitution, _RULES[rule], self.combining)
        threshold = values[self.threshold.name] if combined > 0 else math.inf
        spring = None if self.soft is None else self.soft.spring(values, impact)
        sticks = 0 < threshold < math.inf and spring is None
        if spring is not None and impact.step is None:
            # Up to the rebound's rate e v, the damper acts on v + e v.
            k, c = spring.stiffness, spring.damping
            e = combined if self.soft is not None and self.soft.rebounds else 0.0
            return spring.contact(impact, lambda x, v: k * x + c * v * (1 + e * (v > threshold)))
        if impact.step is None:
            epsilon = combined if impact.speed > threshold else 0.0
            return Impulse(lambda phases: np.full_like(phases, epsilon), lambda: threshold if sticks else None)
        numbers = {parameter.name: values[parameter.name] for parameter in self.others}
        radius, margin = impact.radius or math.inf, self.margin(values, impact)
        ground = Ground(combined, threshold, margin, impact.gravity, impact.step, radius, numbers, spring)
        flight = partial(flight_epsilon, self.steps[values[self.choice]], ground)

        def parts(thresholds: float) -> bool:
            return bool(flight(thresholds * threshold, PHASES).any())

        def slowest() -> float | None:
            # A body at a thousandth of the threshold rests, and should not part.
            return sticking_speed(parts, threshold) if sticks and not parts(1e-3) else None

        return Impulse(partial(flight, impact.speed), slowest)

    def all_warnings(self, values: Values, impact: Impact) -> Iterator[str]:
        """Yield the engine's warnings, and those of a threshold that keeps the body down, and of a large kick."""
        threshold = values.get(self.threshold.name, 0.0)
        is_soft = self.soft is not None and values.get(self.soft.stiffness.name) is not None
        if impact.speed <= threshold and not is_soft:
            yield f"{self.threshold.name} is {threshold:g} m/s: slower bodies do not rebound; write less"
        if impact.speed < (kick := impact.gravity * (impact.step or 0)):
            yield f"Gravity adds {kick:.3g} m/s in a time step, more than the speed: expected a shorter step"
        yield from self.warnings(values, impact)

    def damped(self, values: Values, c: float, impact: Impact) -> Mapping[str, Any]:
        """Return for both bodies the damping of a soft contact, c sqrt(k m) together, else the restitution exp(-c)."""
        spring = None if self.soft is None else self.soft.spring(values, impact)
        if self.soft is None or spring is None:
            return {self.restitution: (max(math.exp(-c), _LEAST_WRITTEN),) * 2}
        one = self.soft.combined(Values({**values, self.soft.damping.name: (1.0, 1.0)}))[1]
        return {self.soft.damping.name: (c * math.sqrt(spring.stiffness * spring.mass) / one,) * 2}

    def simulator(self, name: str) -> Simulator:
        """Return the engine as a simulator."""
        # People write the wanted eps for both bodies; a product is then its square.
        note = "There is no contact: eps is applied above a threshold speed."
        row: Row = f"{self.restitution} of both bodies", LINEAR, force_end_kappa, "exact", note
        if self.combination.default == "multiply":
            row = row[0], LINEAR, lambda e: force_end_kappa(e**2), "two bodies", note
        rows = formulas(self.restitution, ("0.04", "1"), self.source, row, scheme=None, is_impulse=True)
        parameters = (self.combination, self.threshold, *self.others)
        if self.soft is not None:
            parameters = (*parameters, self.soft.stiffness, self.soft.damping)
        contact = native.Native(
            (native.restitution(self.restitution, "0", above=None, per_body=True), *parameters),
            self.collision,
            self.source,
            schemes=dict.fromkeys(self.steps, SEMI_IMPLICIT),
            integrator=self.choice,
            damped_values=self.damped,
            warnings=self.all_warnings,
        )
        return Simulator(name, self.title, self.version, rows, native=contact)


def _count(name: str, least: int, default: str) -> Parameter:
    accepted = f"an integer from {least} to 100"
    return Parameter(name, "", default, accepted, lambda number: number[0] in range(least, 101))


_ENGINES = {
    "physx": Engine(
        "PhysX and Isaac",
        "5.6.1, commit a3d8a641; 5.3.1 was run, in SAPIEN 3.0.3",
        "physx/source/lowleveldynamics/src/DyContactPrepShared.h",
        "PxsCombineMaterials",
        Parameter("restitution_combine_mode", default="average", words=tuple(_RULES), per_body=True),
        "restitution",
        Parameter("bounce_threshold_velocity", "m/s", "0.2"),
        (
            Parameter("contact_offset", "m", "0.02", per_body=True),
            _count("solver_position_iteration_count", 1, "4"),
            _count("solver_velocity_iteration_count", 0, "1"),
        ),
        lambda values, impact: float(sum(values["contact_offset"])),
        "solver_type",
        {"PGS": _physx_pgs, "TGS": _physx_tgs},
        _physx_warnings,
        Soft(
            Parameter("compliant_contact_stiffness", "N/m", per_body=True),
            Parameter("compliant_contact_damping", "N s/m", per_body=True),
            _compliance,
            rebounds=False,
        ),
    ),
    "bullet": Engine(
        "Bullet",
        "3.27, commit 6c888f4a; run in PyBullet 3.2.7",
        "src/BulletDynamics/Featherstone/btMultiBodyConstraintSolver.cpp",
        "btManifoldResult::calculateCombinedRestitution",
        Parameter("gCalculateCombinedRestitutionCallback", default="multiply", words=tuple(_RULES)),
        "restitution",
        Parameter("restitutionVelocityThreshold", "m/s", "0.2"),
        (Parameter("contactBreakingThreshold", "", "0.02"), Parameter("contactERP", "", "0.08")),
        # getContactBreakingThreshold: the number times the radius of the sphere around a box around the ball
        lambda values, impact: float(values["contactBreakingThreshold"] * math.sqrt(3) * impact.effective_radius),
        "body",
        {"btMultiBody": _bullet, "btRigidBody": partial(_bullet, is_multi_body=False)},
        _bullet_warnings,
        soft=Soft(
            native.positive("contactStiffness", "N/m", per_body=True),
            Parameter("contactDamping", "N s/m", per_body=True),
            _springs_in_series,
            rebounds=True,
        ),
    ),
    "jolt": Engine(
        "Jolt",
        "5.5.1, commit 3b47ec39; run in JoltPhysics.js 1.1.0",
        "Jolt/Physics/Constraints/ContactConstraintManager.cpp",
        "ContactConstraintManager::mCombineRestitution",
        Parameter("SetCombineRestitution", default="max", words=tuple(_RULES)),
        "mRestitution",
        Parameter("mMinVelocityForRestitution", "m/s", "1"),
        (Parameter("mSpeculativeContactDistance", "m", "0.02"),),
        lambda values, impact: float(values["mSpeculativeContactDistance"]),
        "mMotionQuality",
        {"Discrete": _jolt},
    ),
    "box2d": Engine(
        "Box2D",
        "3.1.1, commit 8c661469, and 2.4.1, commit 9ebbbcd9; 3.1.1 and 2.3.10 were run",
        "src/contact_solver.c",
        "b2MixRestitution",
        Parameter("restitutionCallback", default="max", words=tuple(_RULES)),
        "restitution",
        Parameter("restitutionThreshold", "m/s", "1"),
        (_count("subStepCount", 1, "4"),),
        lambda values, impact: 0.02,  # B2_SPECULATIVE_DISTANCE
        "version",
        {"3": _box2d_3, "2.4": _box2d_2},
    ),
}
SIMULATORS = {name: engine.simulator(name) for name, engine in _ENGINES.items()}
