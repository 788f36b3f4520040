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

# Steps until a body has left a hard contact or rests: the longest way measured is 644, of a body that Bullet pushes out
# of an overlap by 8 % of it a step, at 1 m/s with steps of 0.1 ms.
_MOST_STEPS = 1000
_MOST_SOFT = 10_000  # steps in a soft contact: what is computed in seconds; more are as good as infinitely many
# Steps before contact at which the flight begins. An engine acts on a gap up to (1 + e) v h < 2 v h at most: Bullet,
# whose rebound e v - gap/h then exceeds the rate -v; the others up to v h.
_LEAD = 2
# Least restitution that is written, in place of 0; that of other programs is the same.
_LEAST_WRITTEN = 1e-15
# A body rests if a step changes its rate by less than 1e-6 of the speed of impact v, and its place by less than 1e-6 of
# v h. In flight a step moves it by about v h. Chosen by hand: far above rounding, 1e-16, and far below what eps shows.
_REST = 1e-6

PRODUCT = Rule("the product", lambda first, second: first * second)
# The order is that of PxCombineMode: average, min, multiply, max.
_RULES = {"average": native.MEAN, "min": native.SMALLER, "multiply": PRODUCT, "max": native.LARGER}
"""Rules that make one restitution of two; if two materials of PhysX name different ones, the later counts."""


class Spring(NamedTuple):
    """A soft contact: a spring and a damper whose force is that at the end of a step, as of implicit Euler's method.

    Attributes
    ----------
    stiffness, damping : float
        k in N/m and c in N s/m.
    mass : float
        The effective one of both bodies, m, in kg.
    """

    stiffness: float
    damping: float
    mass: float

    def erp(self, step: float) -> float:
        """Return the part of an overlap that a step h removes if nothing else acts, ODE's error reduction parameter."""
        # The force k (x + h x') + c x' at the end of the step is 0 with x' = -k x/(h k + c): ERP = h k/(h k + c).
        return step * self.stiffness / (step * self.stiffness + self.damping)

    def share(self, step: float) -> float:
        """Return the part of the way from a rate w_0 to the rate w_1 of `erp` that a step h goes."""
        # The force at the end of the step is (w_1 - w)/CFM with ODE's CFM = 1/(h k + c), and m (w - w_0) = h times it:
        # (w - w_0)/(w_1 - w_0) = 1/(1 + m CFM/h) = h (h k + c)/(h (h k + c) + m).
        impulse = step * (step * self.stiffness + self.damping)
        return impulse / (impulse + self.mass)

    def contact(self, impact: Impact, force: Callable[[FloatArray, FloatArray], FloatArray] | None = None) -> Contact:
        """Return the contact in the limit of short steps, with the force k x + c v unless another F(x, v) is given.

        The gravity of the impact presses the bodies together.
        """
        k, c = self.stiffness, self.damping
        return Contact(force or (lambda x, v: k * x + c * v), self.mass, self.mass * impact.gravity)


class Ground(NamedTuple):
    """A plane with which a body may collide in a time step.

    Attributes
    ----------
    restitution : float
        That of the contact.
    threshold : float
        Speed above which a body rebounds, in m/s; infinite without restitution.
    margin : float
        Gap up to which the engine sees the contact, in m.
    gravity, step : float
        g in m/s^2 and the time step h in s.
    radius : float
        That of the body, in m; infinite if it is not known.
    numbers : mapping of str to float
        Other parameters of the engine by its names for them.
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
"""The motion after a step of an engine, from that before it: (gap, rate, ground) -> (gap, rate)."""


def flight_epsilon(step: Step, ground: Ground, speed: float, phases: FloatArray) -> FloatArray:
    """Return the eps of a body for each phase, from the flight after contact; 0 if it stays.

    Parameters
    ----------
    step : callable
        One of the steps of an engine below.
    ground : Ground
    speed : float
        Impact speed v, in m/s.
    phases : array
        Where in a step contact begins, from 0 to 1.

    Raises
    ------
    ValueError
        If a soft contact lasts too many steps.
    """
    g, h = ground.gravity, ground.step

    # The flight before contact passes through (gap, rate) = (0, -speed) at a phase of a step. It begins `_LEAD` steps
    # earlier, but not before the body's highest point, a time speed/g before contact.
    lead = phases * h if g == 0 else np.minimum(phases * h, speed / g)
    lead = lead + h * (_LEAD if g == 0 else np.clip((speed / g - lead) // h, 0, _LEAD))

    # An engine flies with gap + h (rate - g h) for the next gap. Its gaps are those of the parabola
    # gap = t v - g t^2/2 (t before contact) if its rate is that of the parabola plus g h/2, at all steps.
    gap, rate = lead * speed - g / 2 * lead**2, g * lead - speed + g * h / 2
    epsilon, has_left = np.zeros_like(phases), np.zeros(phases.shape, bool)

    # A soft contact without damping lasts pi sqrt(m/k), half a period; under a weight a whole period at most, as it
    # then swings about the compression at rest. Three times that is enough.
    soft_time = 0.0 if ground.spring is None else math.pi * math.sqrt(ground.spring.mass / ground.spring.stiffness)
    if soft_time > _MOST_SOFT * h:
        steps = f"an undamped contact lasts {soft_time:.3g} s, and at most {_MOST_SOFT} steps are computed"
        raise ValueError(f"time-step is {h:g} s: expected a longer one, or a stiffer contact: {steps}")
    for _ in range(_MOST_STEPS + int(3 * soft_time / h)):
        last_gap, last_rate = gap, rate
        gap, rate = step(gap, rate, ground)
        # A body has left when it is above the plane and its parabola rises: eps^2 = (w^2 + 2 g gap)/v^2, the energy at
        # the level of contact, with the parabola's rate w.
        leaves = ~has_left & (gap >= 0) & (rate > g * h / 2)
        epsilon = np.where(leaves, np.sqrt((rate - g * h / 2) ** 2 + 2 * g * np.maximum(gap, 0)) / speed, epsilon)
        has_left |= leaves
        rests = (np.abs(gap - last_gap) < _REST * speed * h) & (np.abs(rate - last_rate) < _REST * speed)
        if (has_left | rests).all():
            break
    return epsilon


# --- a step of each engine --------------------------------------------------------------------------------------------
#
# Gaps are in m and rates in m/s, positive away from the plane; arrays have a body for each phase. In all steps `kicked`
# is the rate after gravity has acted for the step, and `is_seen` says where the engine sees a contact. Numbers are the
# engines' own constants, whose names stand beside them.


def xpbd(gap: FloatArray, rate: FloatArray, ground: Ground) -> Motion:
    """Return gap and rate after a step of SolverXPBD of Newton 1.8.0: newton/_src/solvers/xpbd/restitution_kernels.py.

    The reflected speed contains the kick; the threshold is 2 g h. Two iterations each leave a fifth of an overlap.
    """
    h = ground.step
    kicked = rate - ground.gravity * h
    drifted = gap + h * kicked
    # iterations = 2, each of which removes rigid_contact_relaxation = 0.8 of an overlap and leaves 0.2
    solved = np.where(drifted < 0, 0.2**2 * drifted, drifted)
    rebounding = (drifted < 0) & (-kicked > ground.threshold)
    # Without a rebound the rate is that of the positions.
    return solved, np.where(rebounding, -ground.restitution * kicked, (solved - gap) / h)


def _physx_pgs(gap: FloatArray, rate: FloatArray, ground: Ground) -> Motion:
    """Return gap and rate after a step of PhysX with PGS, constructContactConstraint of DyContactPrepShared.h.

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
        # The spring brings the rate towards ERP/h times the overlap, and pushes only.
        target = -spring.erp(h) / h * gap
        acts = is_seen & ((gap < 0) | (gap + h * kicked < 0))
        new = np.where(acts, kicked + spring.share(h) * np.maximum(target - kicked, 0), kicked)
        return gap + h * new, new
    rebounding = is_seen & (gap + h * kicked < 0) & (-kicked > ground.threshold)
    to_plane = -gap / h * np.where(gap < 0, 0.8, 1)  # invDtp8 = 0.8/h: 0.8 of an overlap in a step
    rebound = -ground.restitution * kicked

    # The first pass moves the body; gaps above ccdMaxSeparation = 0.04 m are closed in the step of a rebound, too.
    target = np.where(rebounding, rebound + np.where(gap > 0.04, to_plane, 0), to_plane)
    moving = np.where(is_seen, np.maximum(kicked, target), kicked)

    # The second pass gives it its speed.
    target = np.where(rebounding, rebound, np.minimum(to_plane, 0))
    return gap + h * moving, np.where(is_seen, np.maximum(kicked, target), kicked)


def _physx_tgs(gap: FloatArray, rate: FloatArray, ground: Ground) -> Motion:
    """Return gap and rate after a step of PhysX with TGS: constructContactConstraintStep of DyTGSContactPrep.cpp.

    As with PGS, but the position iterations are short steps (solveDynamicContactsStep), in which the place of a rebound
    has a target, too. The velocity iterations leave a body no more speed than what would close its gap in a short step:
    one that meets the plane early in the next step is slowed down before. (Up to 5.4.1 it rebounds a short step earlier
    instead.) A compliant contact is an implicit step of its spring in each short step.
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
    # A short step h/n closes a gap, and removes the part mBiasCoefficient = 2/sqrt(n) of an overlap, at most 0.8.
    rate_of_error = np.where(gap > 0, 1, min(0.8, 2 / math.sqrt(n_position))) * n_position / h
    share, acts = 1.0, is_seen  # of the way to the target: a hard contact goes all of it
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
        # What is left of the error after i short steps: the way so far, less the way of the target.
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
    """Yield what was not run in PhysX: compliant contacts, and velocity iterations of TGS."""
    if impact.step and "compliant_contact_stiffness" in values:
        yield "Compliant contacts are those of the source of PhysX, which was not run with them"
    if values["solver_type"] == "TGS" and values["solver_velocity_iteration_count"]:
        text = "Velocity iterations of TGS take the speed of some rebounds"
        yield f"{text}: from the source of PhysX 5.4.2 and later, which was not run"


def _bullet(gap: FloatArray, rate: FloatArray, ground: Ground, is_multi_body: bool = True) -> Motion:
    """Return gap and rate after a step of Bullet, of a btMultiBody (PyBullet's bodies) or of a btRigidBody.

    setupMultiBodyContactConstraint, and setupContactConstraint of btSequentialImpulseConstraintSolver.cpp. Reflected
    speed and threshold contain the kick, except for a btRigidBody. A body within the margin rebounds at once, and loses
    gap/h of its rate: all of it if the gap is larger than restitution times speed times h. So nothing rebounds in steps
    that are short against the margin. An overlap adds erp overlap/h to the rate. A soft contact goes a share of the way
    to that rate, and pushes only.
    """
    h, slop = ground.step, 1e-5  # contactSlop of PyBullet, in m: a distance that counts as an overlap of 0
    erp, share = ground.numbers["contactERP"], 1.0  # a hard contact goes the whole way to its target
    if ground.spring is not None:
        erp, share = ground.spring.erp(h), ground.spring.share(h)
    kicked = rate - ground.gravity * h
    # A rebound reflects the rate with the kick, of a btRigidBody that without it. A gap is closed, or the part erp of
    # an overlap removed.
    reflected = kicked if is_multi_body else rate
    rebound = np.where(-reflected < ground.threshold, 0, -ground.restitution * reflected)
    distance = gap + slop
    correction = -distance / h * np.where(distance > 0, 1, erp)

    # Overlaps of btRigidBody above 0.04 m (m_splitImpulsePenetrationThreshold) move it, without a speed afterwards.
    is_seen = gap < ground.margin
    moves = is_seen & (distance <= -0.04) & (not is_multi_body)
    target = rebound + np.where(moves, 0, correction)
    new = np.where(is_seen, kicked + share * np.maximum(target - kicked, 0), kicked)
    return gap + h * (new + np.where(moves, share * correction, 0)), new


def _bullet_warnings(values: Values, impact: Impact) -> Iterator[str]:
    """Yield a warning that eps without time steps is no limit of short ones, because of the margin."""
    if impact.step is None and values["contactBreakingThreshold"]:
        yield "A sphere on a plane rebounds less the shorter the steps are, because of its margin: give --time-step"


def _jolt(gap: FloatArray, rate: FloatArray, ground: Ground) -> Motion:
    """Return gap and rate after a step of Jolt.

    CalculateNonPenetrationConstraintProperties of ContactConstraintManager.cpp: the threshold contains the kick, the
    reflected speed does not. A body that would meet the plane in this step rebounds at once, from where it is. Overlaps
    above mPenetrationSlop are removed without a speed afterwards.
    """
    h, slop = ground.step, 0.02  # mPenetrationSlop, in m: an overlap that is left as it is
    kicked = rate - ground.gravity * h
    approach = np.maximum(gap, 0) / h  # the speed that closes the gap in this step
    is_seen = gap < ground.margin
    rebounding = is_seen & (-kicked > np.maximum(ground.threshold, approach))
    new = np.where(rebounding, -ground.restitution * rate, np.where(is_seen, np.maximum(kicked, -approach), kicked))
    place = gap + h * new
    # mNumPositionSteps = 2, each of which removes mBaumgarte = 0.2 of an overlap, of mMaxPenetrationDistance = 0.2 m at
    # most.
    for _ in range(2):
        place = place - np.where(is_seen, np.clip(0.2 * (place + slop), -0.2, 0), 0)
    return place, new


def _box2d_2(gap: FloatArray, rate: FloatArray, ground: Ground) -> Motion:
    """Return gap and rate after a step of Box2D 2: b2_contact_solver.cpp and b2World::SolveTOI, 3 position iterations.

    Reflected speed and threshold contain the kick. The plane has a skin of 2 b2_linearSlop. A body that overlaps it at
    the start of a step rebounds then; one whose path goes deeper than 3 slops into it rebounds there.
    """
    slop, h = 0.005, ground.step  # b2_linearSlop, in m
    # `start` and `end` are distances from the skin (b2_polygonRadius = 2 b2_linearSlop) before and after the step.
    kicked, start = rate - ground.gravity * h, gap - 2 * slop

    def reflected(rate: FloatArray) -> FloatArray:
        """Return the rate after a contact: -e rate above the threshold, else 0 or what leads away."""
        return np.where(-rate > ground.threshold, -ground.restitution * rate, np.maximum(rate, 0))

    def corrected(place: FloatArray, active: NDArray[np.bool_], share: float, enough: float, most: int) -> FloatArray:
        """Return the place after at most `most` iterations, each of which removes a share of the overlap beyond a slop.

        They stop after the iteration that began at an overlap that was small `enough`. One moves by
        b2_maxLinearCorrection = 0.2 m at most.
        """
        for _ in range(most):
            is_enough = place >= enough
            place = place - np.where(active, np.clip(share * (place + slop), -0.2, 0), 0)
            active = active & ~is_enough
        return place

    # A body in the skin rebounds, and 3 iterations of b2_baumgarte = 0.2 leave up to 3 slops of its overlap.
    touches = start <= 0
    new = np.where(touches, reflected(kicked), kicked)
    end = corrected(start + h * new, touches, 0.2, -3 * slop, 3)

    # b2TimeOfImpact: one whose path goes deeper than 3 slops stops there, to a quarter of the slop. A body that begins
    # within that quarter, at 2.75 slops, stops at once. Else the path is halved once, and then cut by a secant; it
    # counts as a hit if it ends beyond 3.25 slops.
    is_deep = start < -2.75 * slop
    meets = is_deep | (end < -3.25 * slop)
    middle = (start + end) / 2
    secant = (start + 3 * slop) / np.where(meets & ~is_deep, start - end, 1)
    time = np.where(is_deep, 0, np.where(np.abs(middle + 3 * slop) < slop / 4, 0.5, secant))
    # At most 20 iterations of b2_toiBaumgarte = 0.75, until 1.5 slops of overlap are left. From 3 slops the first comes
    # to 1.5 slops exactly, and the second sees that; rounding may hide it, hence 1e-6 m.
    place = corrected(start + time * (end - start), meets, 0.75, -1.5 * slop - 1e-6, 20)
    new = np.where(meets, reflected(new), new)
    return np.where(meets, place + (1 - time) * h * new, end) + 2 * slop, new


def _box2d_3(gap: FloatArray, rate: FloatArray, ground: Ground) -> Motion:
    """Return gap and rate after a step of Box2D 3: contact_solver.c and b2SolveContinuous of solver.c.

    Reflected speed and threshold are those before the step, without the kick. The contact is a soft spring in
    subStepCount short steps, after which a body that was pushed gets its rebound. A fast one is put back to the place
    where it met the plane, and rebounds in the next step.
    """
    substeps, slop = int(ground.numbers["subStepCount"]), 0.005  # B2_LINEAR_SLOP, in m
    h = ground.step / substeps

    # b2MakeSoft: the angular frequency of contactHertz = 30, at most 1/(8 h), twice that for static bodies, and
    # contactDampingRatio = 10. h^2 k/m = (h omega)^2 and h c/m = 2 zeta h omega add up to `stiffness`. An implicit step
    # goes the part `mass_scale` of the way to the rate with which `bias_rate` of an overlap goes away in a time.
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
    # A body is fast if it moves by more than half of its radius in the step (minExtent). It then stops at an overlap of
    # the slop, to a quarter of it: from 0.75 slops the path counts, to 1.25 slops it has to go.
    is_fast = np.abs(new) * ground.step > ground.radius / 2
    meets = is_fast & (gap > -0.75 * slop) & (place < -1.25 * slop)
    return np.where(meets, -slop, place), new


class Soft(NamedTuple):
    """Parameters of an engine's soft contact, which is chosen by setting the stiffness.

    Attributes
    ----------
    stiffness, damping : Parameter
    combined : callable
        From values with a stiffness to the stiffness in N/m and the damping in N s/m of the contact, which is hard if
        the stiffness is 0.
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


def _bullet_compliance(values: Values) -> tuple[float, float]:
    """Return stiffness and damping that Bullet makes of both bodies: springs in series, and the sum of the dampings."""
    source = "btManifoldResult::addContactPoint"
    return values.mix("contactStiffness", native.SERIES, source), values.mix("contactDamping", native.SUM, source)


def _physx_compliance(values: Values) -> tuple[float, float]:
    """Return stiffness and damping that PhysX makes of both materials, of which one may be hard (stiffness 0)."""
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
        From the values and an impact to the gap up to which the engine sees a contact, in m.
    choice : str
        Name of the parameter that chooses a step.
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
        """Return the collision that the engine makes of values: a contact if it is soft and has no time steps."""
        # Of the rules that two materials name, the later of `_RULES` counts.
        chosen = values[self.combination.name]
        rule = max(chosen if self.combination.per_body else (chosen,), key=[*_RULES].index)
        combined = values.mix(self.restitution, _RULES[rule], self.combining)
        threshold = values[self.threshold.name] if combined > 0 else math.inf
        spring = None if self.soft is None else self.soft.spring(values, impact)
        sticks = 0 < threshold < math.inf and spring is None
        if spring is not None and impact.step is None:
            # In the limit of short steps each step goes a share of the way from the rate -v to the rebound's rate e v,
            # by c/m (v + e v) a time: the damper acts on v + e v above the threshold.
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
            """Return whether a body with a multiple of the threshold speed leaves the plane, in at least one phase."""
            return bool(flight(thresholds * threshold, PHASES).any())

        def slowest() -> float | None:
            # A body at a thousandth of the threshold rests, and should not part: where it does, an overlap throws it
            # out, and there is no speed below which bodies stay.
            return sticking_speed(parts, threshold) if sticks and not parts(1e-3) else None

        return Impulse(partial(flight, impact.speed), slowest)

    def all_warnings(self, values: Values, impact: Impact) -> Iterator[str]:
        """Yield the engine's warnings, and those of a threshold that keeps the body down, a large kick and no step."""
        threshold = values.get(self.threshold.name, 0.0)
        is_soft = self.soft is not None and values.get(self.soft.stiffness.name) is not None
        if impact.speed <= threshold and not is_soft:
            yield f"{self.threshold.name} is {threshold:g} m/s: slower bodies do not rebound; write less"
        if impact.speed < (kick := impact.gravity * (impact.step or 0)):
            yield f"Gravity adds {kick:.3g} m/s in a time step, more than the speed: expected a shorter step"
        if impact.step is None and not is_soft:
            yield "Only the rule and the threshold count here. In time steps weight and gaps change eps: --time-step"
        yield from self.warnings(values, impact)

    def damping_values(self, values: Values, c: float, impact: Impact) -> Mapping[str, Any]:
        """Return what to write for a damping c, a number without unit, by parameter and for both bodies.

        It is the damping of a soft contact, c sqrt(k m) for both together, else the restitution exp(-c).
        """
        spring = None if self.soft is None else self.soft.spring(values, impact)
        if self.soft is None or spring is None:
            return {self.restitution: (max(math.exp(-c), _LEAST_WRITTEN),) * 2}
        # The contact's damping is in proportion to that of both bodies: what 1 N s/m of both makes is the factor.
        _, damping_of_ones = self.soft.combined(Values({**values, self.soft.damping.name: (1.0, 1.0)}))
        return {self.soft.damping.name: (c * math.sqrt(spring.stiffness * spring.mass) / damping_of_ones,) * 2}

    def simulator(self, name: str) -> Simulator:
        """Return the engine as a simulator with this name, for the audit."""
        # People write the wanted eps for both bodies; a product is then its square.
        note = "There is no contact: eps is applied above a threshold speed."
        row: Row = f"{self.restitution} of both bodies", LINEAR, force_end_kappa, "exact", note
        if self.combination.default == "multiply":
            row = row[0], LINEAR, lambda e: force_end_kappa(e**2), "two bodies", note
        # The linear law has one eps for all speeds, as an impulse has. 0.04 is chosen by hand: eps of the product is
        # then 0.0016.
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
            damped_values=self.damping_values,
            warnings=self.all_warnings,
        )
        return Simulator(name, self.title, self.version, rows, native=contact)


def _count(name: str, least: int, default: str) -> Parameter:
    """Return the parameter of a number of iterations from `least` to 100 (by hand: more take long)."""
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
            _physx_compliance,
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
        # getContactBreakingThreshold: the number times the radius of the sphere around a box around the ball, sqrt(3) R
        lambda values, impact: float(values["contactBreakingThreshold"] * math.sqrt(3) * impact.effective_radius),
        "body",
        {"btMultiBody": _bullet, "btRigidBody": partial(_bullet, is_multi_body=False)},
        _bullet_warnings,
        soft=Soft(
            native.positive("contactStiffness", "N/m", per_body=True),
            Parameter("contactDamping", "N s/m", per_body=True),
            _bullet_compliance,
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
        lambda values, impact: 0.02,  # B2_SPECULATIVE_DISTANCE = 4 slops of 0.005 m
        "version",
        {"3": _box2d_3, "2.4": _box2d_2},
    ),
}
SIMULATORS = {name: engine.simulator(name) for name, engine in _ENGINES.items()}
