"""Soft contacts: ODE, Gazebo Classic with its own ODE, and BEPU.

    contact.surface.soft_erp = h*kp/(h*kp + kd);  contact.surface.soft_cfm = 1/(h*kp + kd);          ODE
    <contact><ode><kp>1e5</kp><kd>10</kd><max_vel>1</max_vel></ode></contact>                          Gazebo Classic
    pairMaterial.SpringSettings = new SpringSettings(30, 1);                                           BEPU

The contact is a spring and a damper with their force at the end of a step, as of implicit Euler's method, which damps,
too: `viscopade.simulators.impulse.Spring`, in steps of `viscopade.simulators.impulse.flight_epsilon`. It pushes only.

- ODE, `dxJointContact::getInfo2` of ode/src/joints/contact.cpp (odedevs/ode at commit 624b1c17; 0.16.2 was run):
  ERP/h times the overlap, less that of the surface layer, is the speed out of an overlap, with the maximum correcting
  speed at most. A rebound, of the speed without the kick of gravity, is not limited. The contact begins in the step
  after the bodies met.
- Gazebo, `ODEPhysics::Collide` (gazebo-classic at commit 73be8911): 1/kp adds up over both bodies, and so does kd; the
  smaller number of others counts. deps/opende/src/quickstep.cpp (commit 9ca8b87a), quickstep_update_bodies.cpp (commit
  2217b19e): `max_vel`, 0.01 m/s by default, limits the speed of a body after a step, also that of a rebound, and not
  its way in this step. `contact_residual_smoothing` is 0.01 in `dWorldCreate` of ode.cpp (commit 6e3233b5).
- BEPU, bepu/bepuphysics2 at commit 956a679f: `ComputeSpringiness` of BepuPhysics/Constraints/SpringSettings.cs makes
  k = w^2 and c = 2 zeta w per effective mass of the frequency w/(2 pi) and the damping ratio zeta, in each substep.
  `Solve` of Constraints/Contact/PenetrationLimit.cs closes a gap at most, so that the contact acts in the step in which
  bodies meet; MaximumRecoveryVelocity limits the speed out of an overlap. A material is the user's; the defaults here
  are those of the demos.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from functools import partial
from typing import Any

import numpy as np

from viscopade.arrays.checked import FloatArray
from viscopade.collision.contact import Contact
from viscopade.collision.schemes import IMPLICIT, SEMI_IMPLICIT
from viscopade.simulators import native
from viscopade.simulators.formula import LINEAR, formulas, identity, kappa_from_ratio, linear_kappa, ratio_for_return
from viscopade.simulators.impulse import Ground, Motion, Spring, flight_epsilon
from viscopade.simulators.native import SERIES, SMALLER, SUM, Impact, Impulse, Native, Parameter, Values
from viscopade.simulators.simulator import Simulator

_NOT_RUN = "This is from the source of {}, which was not run"
# Steps in an undamped contact; with fewer it is as good as hard: one step goes most of the way to the rebound's rate,
# so the restitution decides, not the damping (by hand).
_FEW_STEPS = 2


def _ode(gap: FloatArray, rate: FloatArray, ground: Ground, is_gazebo: bool = False) -> Motion:
    """Return gap and rate after a step of ODE, `dWorldStep` and `dWorldQuickStep`, or of Gazebo's `dWorldQuickStep`.

    Gaps in m are negative if bodies overlap, rates in m/s are positive away from the plane. `ground` has the spring,
    and the numbers "max_vel" and "min_depth" of the surface, in Gazebo "contact_residual_smoothing", too.
    """
    h, fastest, spring = ground.step, ground.numbers["max_vel"], ground.spring
    assert spring is not None
    kicked = rate - ground.gravity * h
    # The rate of a rebound is that of the approach, without the kick; the rate out of an overlap is ERP/h times it,
    # less the surface layer.
    rebound = np.where(-rate > ground.threshold, -ground.restitution * rate, 0)
    pushout = spring.erp(h) / h * np.maximum(-gap - ground.numbers["min_depth"], 0)

    def pushed(target: FloatArray, share: float) -> FloatArray:
        """Return the rate of bodies that overlap: the share of the way up to the target; a contact never pulls."""
        return np.where(gap <= 0, kicked + share * np.maximum(target - kicked, 0), kicked)

    if not is_gazebo:
        new = pushed(np.maximum(np.minimum(pushout, fastest), rebound), spring.share(h))
        return gap + h * new, new
    # In Gazebo the way of the step has no limit by max_vel, the speed after it has. For the speed,
    # contact_residual_smoothing s leaves 1 - s of CFM = 1/(h k + c): k and c are 1/(1 - s) times as large.
    target, k, c = np.maximum(pushout, rebound), spring.stiffness, spring.damping
    cfm_share = 1 - ground.numbers["contact_residual_smoothing"]
    stiffer = Spring(k / cfm_share, c / cfm_share, spring.mass)
    return gap + h * pushed(target, spring.share(h)), pushed(np.minimum(target, fastest), stiffer.share(h))


def _bepu(gap: FloatArray, rate: FloatArray, ground: Ground) -> Motion:
    """Return gap and rate after a step of BEPU, with substeps for bodies that may meet in the step.

    Gaps are in m, rates in m/s, positive away from the plane; the numbers of `ground` are BEPU's by their names.
    """
    n, spring = int(ground.numbers["SubstepCount"]), ground.spring
    assert spring is not None
    h = ground.step / n
    kicked = rate - ground.gravity * ground.step
    place, new = gap, rate
    for _ in range(n):
        # The spring's rate out of an overlap is ERP/h times it, and limited; a gap is closed at most.
        free = new - ground.gravity * h
        pushout = np.minimum(-spring.erp(h) / h * place, ground.numbers["MaximumRecoveryVelocity"])
        target = np.minimum(-place / h, pushout)
        new = free + spring.share(h) * np.maximum(target - free, 0)
        place = place + h * new
    # A body whose way in the step is shorter than the gap (the speculative margin) flies on instead.
    is_seen = gap <= ground.step * np.abs(kicked)
    return np.where(is_seen, place, gap + ground.step * kicked), np.where(is_seen, new, kicked)


def _without_steps(reason: str) -> Impulse:
    """Return a collision that is only known in time steps: its eps is a ValueError with the reason."""

    def epsilon(phases: FloatArray) -> FloatArray:
        raise ValueError(f"time-step is missing: expected --time-step, {reason}")

    return Impulse(epsilon)


def _is_hard(spring: Spring, impact: Impact) -> bool:
    """Return whether a contact without damping, pi sqrt(m/k), has so few steps that it is as good as hard."""
    return math.pi * math.sqrt(spring.mass / spring.stiffness) < _FEW_STEPS * (impact.step or 0)


def _ode_ground(values: Values, impact: Impact) -> Ground:
    """Return the plane that ODE makes of soft_erp = h k/(h k + c) and soft_cfm = 1/(h k + c), with the time step h."""
    # Solved for the spring: k = ERP/(h CFM), c = (1 - ERP)/CFM.
    h, erp, cfm = impact.step or math.nan, values["soft_erp"], values["soft_cfm"]
    spring = Spring(erp / (h * cfm), (1 - erp) / cfm, impact.effective_mass)
    # `values.get` would not note that the parameter was read. The margin, 0, is not used: contact begins at a gap of 0.
    fastest = values["max_vel"] if "max_vel" in values else math.inf  # noqa: SIM401
    numbers = {"max_vel": fastest, "min_depth": values["min_depth"]}
    return Ground(values["bounce"], values["bounce_vel"], 0, impact.gravity, h, numbers=numbers, spring=spring)


def _ode_collision(values: Values, impact: Impact) -> Impulse:
    """Return the collision of ODE in time steps: without one soft_erp and soft_cfm say no stiffness."""
    if impact.step is None:
        return _without_steps("of which soft_erp and soft_cfm are made")
    return Impulse(partial(flight_epsilon, _ode, _ode_ground(values, impact), impact.speed))


def _ode_damping_values(values: Values, c: float, impact: Impact) -> Mapping[str, Any]:
    """Return what to write for a damping c, a number without unit: the same k with the damping c sqrt(k m).

    Of a hard contact it is bounce = exp(-c).
    """
    spring, h = _ode_ground(values, impact).spring, impact.step or math.nan
    assert spring is not None
    if _is_hard(spring, impact):
        return {"bounce": math.exp(-c)}
    damped = spring._replace(damping=c * math.sqrt(spring.stiffness * spring.mass))
    return {"soft_erp": damped.erp(h), "soft_cfm": 1 / (h * damped.stiffness + damped.damping)}


def _gazebo_ground(values: Values, impact: Impact) -> Ground:
    """Return the plane that Gazebo makes of the surfaces of both bodies.

    1/kp adds up over both, as of springs in series, and so does kd; of other numbers the smaller one counts.
    """
    source = "ODEPhysics::Collide"
    stiffness, damping = values.mix("kp", SERIES, source), values.mix("kd", SUM, source)
    e, threshold, fastest, depth = (
        values.mix(name, SMALLER, source) for name in ("restitution_coefficient", "threshold", "max_vel", "min_depth")
    )
    numbers = {
        "max_vel": min(fastest, values["contact_max_correcting_vel"]),
        "min_depth": depth,
        "contact_residual_smoothing": values["contact_residual_smoothing"],
    }
    spring = Spring(stiffness, damping, impact.effective_mass)
    return Ground(e, threshold, 0, impact.gravity, impact.step or 0.0, numbers=numbers, spring=spring)


def _gazebo_collision(values: Values, impact: Impact) -> Impulse | Contact:
    """Return the collision of Gazebo; without a time step the contact in the limit of short ones.

    That one is not computed if max_vel is below the speed, because each step then takes a part of the rebound.
    """
    ground = _gazebo_ground(values, impact)
    if impact.step is not None:
        return Impulse(partial(flight_epsilon, partial(_ode, is_gazebo=True), ground, impact.speed))
    if ground.numbers["max_vel"] < impact.speed:
        return _without_steps("as max_vel is below the speed")
    assert ground.spring is not None
    e, threshold, depth = ground.restitution, ground.threshold, ground.numbers["min_depth"]
    k, c = ground.spring.stiffness, ground.spring.damping

    def force(x: FloatArray, v: FloatArray) -> FloatArray:
        # max(k x, c e v) + c v: the damper acts on the difference to the larger one of the rebound's rate e v and the
        # rate k x/c out of an overlap
        return np.maximum(k * np.maximum(x - depth, 0), np.where(v > threshold, c * e * v, 0)) + c * v

    return ground.spring.contact(impact, force)


def _gazebo_damping_values(values: Values, c: float, impact: Impact) -> Mapping[str, Any]:
    """Return what to write for a damping c, a number without unit: kd of both bodies, of which the sum is c sqrt(k m).

    Of a hard contact it is a rebound of e v, e = exp(-c), with max_vel = e v.
    """
    spring = _gazebo_ground(values, impact).spring
    assert spring is not None
    if _is_hard(spring, impact):
        e = math.exp(-c)
        numbers = {"restitution_coefficient": e, "threshold": 0.0, "max_vel": e * impact.speed}
        return {name: (number, number) for name, number in numbers.items()}
    return {"kd": (c * math.sqrt(spring.stiffness * spring.mass) / 2,) * 2}


def _gazebo_warnings(values: Values, impact: Impact) -> Iterator[str]:
    """Yield warnings: Gazebo was not run; a threshold, or max_vel, above the speed takes the rebound."""
    if impact.step:
        yield _NOT_RUN.format("Gazebo")
    ground = _gazebo_ground(values, impact)
    numbers = ground.numbers
    if ground.restitution and impact.speed <= ground.threshold:
        yield f"threshold is {ground.threshold:g} m/s: slower bodies do not rebound; write less"
    if numbers["max_vel"] < impact.speed:
        yield f"max_vel is {numbers['max_vel']:g} m/s: after a step in contact no body is faster, nor is a rebound"


def _bepu_collision(values: Values, impact: Impact) -> Impulse | Contact:
    """Return the collision of BEPU, per effective mass; without a time step the contact in the limit of short ones."""
    # k/m = w^2 and c/m = 2 zeta w, with w = 2 pi Frequency
    omega = 2 * math.pi * values["Frequency"]
    spring = Spring(omega**2, 2 * values["DampingRatio"] * omega, 1.0)
    numbers = {name: values[name] for name in ("MaximumRecoveryVelocity", "SubstepCount")}
    if impact.step is not None:
        # No restitution, so a threshold that is never passed, and a margin without limit: `_bepu` has its own.
        ground = Ground(0, math.inf, math.inf, impact.gravity, impact.step, numbers=numbers, spring=spring)
        return Impulse(partial(flight_epsilon, _bepu, ground, impact.speed))
    if numbers["MaximumRecoveryVelocity"] < impact.speed:
        return _without_steps("as MaximumRecoveryVelocity is below the speed")
    return spring.contact(impact)


_CAPPED = "{} is above the speed of the rebound."
# What people write is the damping of the damping ratio for contact that ends at x = 0. Up to 1e3 eps falls to 1e-6: a
# contact that ends at force 0 has about eps = 1/kappa^2 for strong damping.
_row = partial(formulas, "kd/sqrt(kp m)", ("0", "1e3"), usual_parameter=linear_kappa, scheme=IMPLICIT)
_SOURCE, _GAZEBO_SOURCE = "ode/src/joints/contact.cpp", "deps/opende/src/joints/contact.cpp"
_BEPU_SOURCE = "BepuPhysics/Constraints/Contact/PenetrationLimit.cs"
_ENGINES = (
    Simulator(
        "ode",
        "ODE",
        "commit 624b1c17; 0.16.2 was run",
        _row(_SOURCE, ("soft_erp and soft_cfm of kp and kd", LINEAR, identity, "other end")),
        native=Native(
            (
                Parameter("soft_erp", "", "0.2", "a number > 0 and <= 1", lambda pair: 0 < pair[0] <= 1),
                native.positive("soft_cfm", "", "1e-10"),
                Parameter("max_vel", "m/s"),
                Parameter("min_depth", "m", "0"),
                native.restitution("bounce", "0", above=None),
                Parameter("bounce_vel", "m/s", "0"),
            ),
            _ode_collision,
            _SOURCE,
            schemes={"dWorldStep": SEMI_IMPLICIT, "dWorldQuickStep": SEMI_IMPLICIT},
            integrator="solver",
            damped_values=_ode_damping_values,
        ),
    ),
    Simulator(
        "gazebo",
        "Gazebo Classic",
        "gazebo-classic at commits 73be8911 and 9ca8b87a; from the source, not run",
        _row(_GAZEBO_SOURCE, ("kp and kd", LINEAR, identity, "other end", _CAPPED.format("max_vel"))),
        native=Native(
            (
                native.positive("kp", "N/m", "1e12", per_body=True),
                Parameter("kd", "N s/m", "1", per_body=True),
                Parameter("max_vel", "m/s", "0.01", per_body=True),
                Parameter("min_depth", "m", "0", per_body=True),
                native.restitution("restitution_coefficient", "0", above=None, per_body=True),
                Parameter("threshold", "m/s", "100000", per_body=True),
                Parameter("contact_max_correcting_vel", "m/s", "100"),
                Parameter("contact_residual_smoothing", "", "0.01", "a number < 1", lambda part: 0 <= part[0] < 1),
            ),
            _gazebo_collision,
            _GAZEBO_SOURCE,
            schemes={"quick": SEMI_IMPLICIT},
            integrator="solver",
            damped_values=_gazebo_damping_values,
            warnings=_gazebo_warnings,
        ),
        default_step=0.001,
    ),
    Simulator(
        "bepu",
        "BEPU",
        "bepuphysics2 at commit 956a679f; from the source, not run",
        formulas(
            "DampingRatio",
            ("0", "1e3"),
            _BEPU_SOURCE,
            ("SpringSettings", LINEAR, kappa_from_ratio, "other end", _CAPPED.format("MaximumRecoveryVelocity")),
            usual_parameter=ratio_for_return,
            scheme=None,
        ),
        native=Native(
            (
                native.positive("Frequency", "", "30"),
                Parameter("DampingRatio", "", "1"),
                Parameter("MaximumRecoveryVelocity", "m/s", "2"),
                Parameter("SubstepCount", "", "1", "an integer from 1 to 100", lambda count: count[0] in range(1, 101)),
            ),
            _bepu_collision,
            _BEPU_SOURCE,
            schemes={"velocity iterations": SEMI_IMPLICIT},
            integrator="solver",
            damped_values=lambda values, c, impact: {"DampingRatio": c / 2},
            warnings=lambda values, impact: [_NOT_RUN.format("BEPU")] * bool(impact.step),
        ),
    ),
)
SIMULATORS = {engine.name: engine for engine in _ENGINES}
