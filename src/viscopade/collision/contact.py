"""One collision of any contact in double precision: any force, a constant load, an end of contact, an integrator.

The compression x and its rate v obey

    m dv/dt = load - F(x, v),    dx/dt = v,    x(0) = 0,  v(0) = the speed of impact,

where F acts while x > 0. With the end "force" the contact never pulls: the force is max(F, 0), and it may act again
until the bodies are back at x = 0. With the end "return" F may pull until x = 0. With the end "break" bodies adhere: a
neck that has formed where contact begins pulls at x < 0, too, until it breaks. The coefficient of restitution eps is
the speed at which the bodies are back at x = 0, or where contact begins, over the speed of impact.

A power law (`viscopade.Law`) is one kind of force. Every number here is sampled: computed in floating point, with an
estimate of its error, not proven.

Without a time step the equation of motion itself is solved. In the variables s = x^(1/4) and sigma, dt = 4 s^3 dsigma,

    ds/dsigma = v,    dv/dsigma = 4 s^3 (load - F(s^4, v))/m,

which is smooth at x = 0 for forces in powers of x^(1/4), Hertz's and Tsuji's among them, and at the turning point.
Gauss's collocation method of order 40 solves it in pieces (Hairer, Norsett, Wanner, Solving Ordinary Differential
Equations I, section II.7). Pieces end where the motion turns back, where the force vanishes or acts again, and at
x = 0, so that a force with a kink there is smooth in every piece. The difference from a second solution, of order 32
and with other pieces, estimates the error. Where a neck breaks at x_b < 0, s is (x - x_b)^(1/4), because the force of
a neck may have a root there, as that of JKR has.

With a time step a program's own map is iterated, from many phases, because contact begins anywhere in a step. As a
function of the phase, eps is smooth in pieces. The range over all phases includes both ends of a step as limits. More
phases are computed between neighbours where eps may go beyond the range, until little can be missing.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from functools import cache
from typing import Any, Literal, NamedTuple

import numpy as np
from numpy.polynomial import legendre
from numpy.typing import ArrayLike, NDArray

from viscopade.arguments import integer, refusal, without_unit
from viscopade.arrays import checked
from viscopade.arrays.checked import Accepted, FloatArray
from viscopade.collision.schemes import IMPLICIT, SCHEMES, SEMI_IMPLICIT, Rebounds, Scheme, rebounds
from viscopade.theory.law import ENDS, Law, law_of

__all__ = [
    "PHASES",
    "SCHEMES",
    "Contact",
    "SampledCollision",
    "damping_factor",
    "phase_range",
    "resolving_factor",
    "root",
    "sticking_speed",
]

Force = Callable[[FloatArray, FloatArray], ArrayLike]
ContactEnd = Literal["force", "return", "break"]

PHASES = np.arange(0.5, 64) / 64
"""Phases, which are parts of a step at which contact begins, of a mean: the midpoints of 64 equal parts."""

# Nothing here is proven, and most numbers are choices. "Measured" is for ten contacts: viscoelastic with kappa from
# 0.01 to 100, linear, with damping on the way back only, and three with a jump of the force. eps of the viscoelastic
# ones is right to 1e-15 (`exact`), with an error said to be 1e-12.

# Number of nodes (half of the order); error of a piece over the largest speed. The second solution only estimates the
# error of the first. Measured: 12 and 28 nodes, and 1e-10 and 1e-13, take the same time within a fifth, and eps is as
# good.
_METHODS = ((20, 1e-12), (16, 1e-11))
# Error of the equations of a piece, about 50 roundings. Measured: from 1e-15 to 1e-12 eps is the same, as with
# `_NEWTON` from 8 to 50 and `_LANDING` from 20 to 200.
_SOLVED = 1e-14
# Length in sigma of a piece where a force has a jump, which is passed with 1e-12 of the way. Measured: with 1e-9 eps of
# a contact with a jump is off by 1e-11, with 1e-14 it is the same.
_SHORTEST = 1e-12
_ESCAPES = 1e6  # speed over the speed of impact from which on a piece cannot be solved: no contact makes bodies so fast
# Rounding error of a number (two roundings), and of the error of a piece (about a hundred, in the sums over its nodes).
# Measured: ten times smaller or larger, `_ROUNDED` gives the same eps.
_ROUNDING, _ROUNDED = 4e-16, 2e-14
_NEWTON = 20  # largest number of steps to solve a piece
# Largest number of pieces to find an event; halving finds that of a force that jumps, to 2^-60 of a piece.
_LANDING = 60
_RATE_ERROR = 3e-15  # relative error of a rate, about 15 roundings (measured: 3e-16 to 3e-13 give the same eps)
_PIECES = 10_000  # largest number of pieces of a collision; measured: 37 to 117, and 356 with a jump of the force
_SUBSTEPS = 1_000_000  # largest number of parts of a time step, so that a typing error is no step of 0
_LAST_PHASE = 1 - 1e-12  # stands for the limit at the end of a step, where bodies touch at first by rounding only
# Into how many parts an interval of phases is divided, and how often: 1/64 of a step divided by 8^12 is below 1e-12.
_PARTS, _DIVISIONS = 8, 12
_MOST_PHASES = 10_000  # of a range; with very long steps eps may have a thousand extrema
# Error of the least and the largest eps over all phases: programs and experiments know fewer digits.
_RANGE_ERROR = 1e-6
_NARROW, _SAME_PHASE = 1e-5, 1e-12  # lengths up to which intervals with a jump, or any intervals, are divided
_ROUNDS = 30  # largest number of attempts to find a resolving factor, each at least 1.1 times the last one
_STEPS = 100_000  # largest number of steps in a contact, roughly: a choice, beyond which no step is meant
# Of intervals of compressions at a jump, down to 2^-40 of an interval, and how many places there are. Measured: two
# halvings are enough for three contacts with a jump.
_HALVINGS, _MOST_PLACES = 40, 100_000
_ZOOMS = 9  # into a 64th of the compressions, to find where a force begins to act
# Error of the work in an interval over the largest energy: it only decides about units (1e-2 does, too).
_WORK_ERROR = 1e-4
_EXPECTED = "expected a function of compression and rate that pushes bodies apart"
_NOISY = 10  # error of a piece over the unit roundoff of the force, which its nodes add up
_CREEP = 1e-12  # share of the speed of impact: slower bodies that slow down do not part (1e-9 does as well)
_WORST = 1e-3  # error of eps, and relative error of the depth, of what is not refused; a choice
_FAR = 10  # lengths, and in s, that is 10^4 lengths: bodies that come so far are not stopped
_NUDGE = 1e-7  # step of differences, for derivatives of the force to half of the digits (1e-9 to 1e-5 do as well)
_EDGE = 1e-3  # share of the part of a piece without nodes, from its end: close to it, but not on it (1e-6 to 0.1 do)
_PATIENCE = 60  # undamped contact times, after which bodies that still touch do not part; a choice
_NECK = 10.0  # lengths, up to which a neck whose breaking a function says is followed; a choice
_QUADRATURE = 60  # nodes for the energy of a neck; measured: 10 give that of JKR to 1e-14, others may be less smooth
# Ratio of successive speeds in the search for a sticking speed, and its relative error; choices.
_SPEED_RATIO, _SAME_SPEED = 4.0, 1e-4
_NEAR, _WIDEST = 0.1, 10  # search for a damping factor: a step of a factor of e^0.1, which is doubled 10 times
_BEYOND = 1.1  # first step of that search, over the step to where the damping factor should be
_CLOSE = 1e-13  # relative error of a damping factor, about that of eps

_POSITIVE = Accepted("a finite number > 0", lambda x: (x > 0) & (x < math.inf))
_FINITE = Accepted("a finite number", lambda x: abs(x) < math.inf)
_NEGATIVE = Accepted("a finite number < 0, or a function of compression and rate", lambda x: (x < 0) & (x > -math.inf))
_RESTITUTION = Accepted("a number > 0 and < 1", lambda x: (x > 0) & (x < 1))
PHASE = Accepted("a number from 0 to 1", lambda x: (x >= 0) & (x <= 1))


@dataclass(frozen=True)
class SampledCollision:
    """One collision in double precision, or its range over the phases of a time step.

    Attributes
    ----------
    epsilon, least, largest : float
        Coefficient of restitution: its mean over 64 phases, its least and its largest value over all. 0 for bodies that
        do not part.
    depth : float
        Largest compression, a length; with a time step its mean, of compressions at the ends of steps.
    duration : float
        Time from first contact to the last moment at which the force acts; infinite for bodies that do not part.
    parts : bool
        Whether the bodies part, with a time step in at least one phase. They do not part if the motion turns back
        before x = 0, or before their neck breaks, or creeps at less than 1e-12 of the speed of impact.
    errors : dict of str to float
        An estimate of the absolute error of each of these numbers.
    status : str
        "sampled": no number here is proven.
    """

    epsilon: float
    least: float
    largest: float
    depth: float
    duration: float
    parts: bool
    errors: dict[str, float]
    status: Literal["sampled"] = field(default="sampled", init=False)


# --- contacts ---------------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Contact:
    """A contact of two bodies with any force of compression and rate.

    Parameters
    ----------
    force : callable
        F(x, v) of NumPy arrays: compression x >= 0, a length, and its rate v, a length/time, positive while the bodies
        approach. It counts positive if it pushes the bodies apart.
    mass : float
        Effective mass.
    load : float
        Constant force that presses the bodies together, such as the weight of a body that falls on a plane.
    end : str
        "force": the force never pulls, it is max(F, 0). "return": it may pull until x = 0. "break": it may pull until
        the neck breaks; then it is defined at compressions x < 0, too.
    begin : float
        With the end "break", the compression at which contact forms; eps compares speeds there.
    break_at : float or callable
        With the end "break", the compression < 0 at which the neck breaks, or a function of compression and rate that
        is positive while a neck holds; it counts on the way back, from `begin` on.

    Raises
    ------
    TypeError, ValueError
        If the force is not callable, a number is not finite, the mass is not positive, the end is not known, or a neck
        breaks where it cannot.

    Examples
    --------
    A linear contact, which ends where the force vanishes, of 1 kg that falls on a plane at 1 m/s:

    >>> contact = Contact(lambda x, v: 1e5 * x + 139 * v, mass=1.0, load=9.81)
    >>> found = contact.collide(1.0)
    >>> f"{found.epsilon:.6f} {found.depth:.6e} m, {found.status}"
    '0.522597 2.400827e-03 m, sampled'

    The same spring with a neck, which pulls until it has 0.2 mm:

    >>> contact = Contact(lambda x, v: 1e5 * x, mass=1.0, end="break", break_at=-2e-4)
    >>> f"{contact.collide(0.1).epsilon:.6f} {contact.neck_energy:.3g} J"
    '0.774597 0.002 J'
    """

    force: Force
    mass: float = 1.0
    load: float = 0.0
    end: ContactEnd = "force"
    begin: float = 0.0
    break_at: float | Force | None = None

    def __post_init__(self) -> None:
        """Check the arguments, and make them floats."""
        if not callable(self.force):
            raise TypeError(refusal("force", self.force, "a function of compression and rate"))
        object.__setattr__(self, "mass", checked.number("mass", self.mass, _POSITIVE))
        object.__setattr__(self, "load", checked.number("load", self.load, _FINITE))
        if str(self.end) not in (*ENDS, "break"):
            raise ValueError(refusal("end", self.end, "'force', 'return' or 'break'"))
        object.__setattr__(self, "begin", checked.number("begin", self.begin, _FINITE))
        # break_at belongs to the end "break" and no other; begin needs it.
        if (self.break_at is None) != (self.end != "break") or (self.begin and self.break_at is None):
            accepted = "begin and break_at with the end 'break', and break_at always with it"
            raise ValueError(
                f"end is {self.end!r}, begin {self.begin:g}, break_at {self.break_at}: expected {accepted}"
            )
        if self.break_at is not None and not callable(self.break_at):
            object.__setattr__(self, "break_at", checked.number("break_at", self.break_at, _NEGATIVE))
            if self.begin < self.floor:
                raise ValueError(f"begin is {self.begin:g}: expected at least break_at, {self.floor:g}")

    @classmethod
    def of_law(cls, law: Law | str, kappa: ArrayLike, load: float = 0.0) -> Contact:
        """Return the contact x'' + x^a + kappa x^b x' = load of the scaled equation, for collisions at speed 1.

        Parameters
        ----------
        law : Law or str
            Exponents a, b and the end of contact.
        kappa : float or array
            Damping of the scaled equation; an array is for `rebounds` only.
        load : float
            G of the scaled equation.
        """
        law = law_of(law)
        a, b, damping = float(law.elastic), float(law.damping), checked.array("kappa", kappa, _FINITE)
        return cls(lambda x, v: x**a + damping * x**b * v, load=load, end=law.end)

    def collide(
        self,
        speed: float = 1.0,
        *,
        step: float | None = None,
        scheme: Scheme = SEMI_IMPLICIT,
        substeps: int = 1,
        phases: ArrayLike | None = None,
    ) -> SampledCollision:
        """Return the collision at a speed of impact.

        Parameters
        ----------
        speed : float
            Speed of impact > 0, a length/time.
        step : float, optional
            Time step > 0. By default the equation of motion itself is solved.
        scheme : Scheme
            Integrator, if a time step is given.
        substeps : int
            Number of parts of a time step; each is one step of the scheme.
        phases : array_like, optional
            Parts of the first (sub-)step at which contact begins, from 0 to 1. By default the mean is that of `PHASES`,
            and the range is that of all phases.

        Raises
        ------
        TypeError, ValueError
            If an argument is out of range, a step is below about 1e-5 of a contact, the force is not real or not
            finite, or it does not stop the bodies; without a step, if the estimated error is above 1e-3.
        """
        v = checked.number("speed", speed, _POSITIVE)
        if step is None:
            return _without_steps(self, v)
        h = checked.number("step", step, _POSITIVE) / integer("substeps", substeps, 1, _SUBSTEPS)
        # Units of the collision: a compression and the largest speed. An undamped linear contact takes pi length/speed.
        length, fastest = _scales(self, v)
        shortest = math.pi * length / fastest / _STEPS
        if h < shortest:
            raise ValueError(
                f"step is {h:g}: expected a number >= {shortest:.3g}, that is {_STEPS} steps in a contact, or no step"
            )
        begins = PHASES if phases is None else checked.array("phases", phases, PHASE).ravel()
        if not begins.size:
            raise ValueError("phases is empty: expected at least one number from 0 to 1")
        if not isinstance(scheme, Scheme):
            raise TypeError(refusal("scheme", scheme, f"a Scheme, such as SCHEMES[{next(iter(SCHEMES))!r}]"))
        if self.end == "break" and scheme is IMPLICIT:  # its equations are solved for forces that push at x > 0
            raise ValueError("scheme is implicit Euler, and the contact has a neck: expected an explicit scheme")
        # A collision for each phase, and more where eps may go beyond the range so far.
        with np.errstate(over="ignore", invalid="ignore"):
            longest = _PATIENCE * math.pi * length / v
            collisions = self.rebounds(v, h, begins, scheme, longest)
            least, largest, error = float(collisions.epsilon.min()), float(collisions.epsilon.max()), 0.0
            if phases is None:
                least, largest, error = phase_range(
                    lambda p: self.rebounds(v, h, p, scheme, longest).epsilon, begins, collisions.epsilon
                )
        if not (math.isfinite(largest - least) and np.isfinite(collisions.depth).all()):
            raise ValueError(f"step is {step:g}: expected a smaller one, because speeds exceed double precision")
        if np.isinf(collisions.duration).all() and collisions.depth.min() > _FAR * length:
            raise _never_stops(self, v)
        # The means over the phases. Their error: the largest step between neighbours may be a jump anywhere between
        # them.
        mean, errors = {}, {}
        for name, values in collisions._asdict().items():
            mean[name] = float(values.mean())
            with np.errstate(invalid="ignore"):  # of infinite durations
                jumps = np.nan_to_num(np.abs(values - np.roll(values, 1)))
            errors[name] = float(jumps.max()) / len(values)
        errors["least"] = errors["largest"] = error
        parts = bool(np.isfinite(collisions.duration).any())
        return SampledCollision(mean["epsilon"], least, largest, mean["depth"], mean["duration"], parts, errors)

    @property
    def roundoff(self) -> float:
        """Unit roundoff of the force, which may be in single precision; twice that of rounding to nearest."""
        kind = np.asarray(without_unit("force", self.force(np.ones(1), np.ones(1)))).dtype
        return float(np.finfo(kind if kind.kind == "f" else float).eps)

    def contact_time(self, speed: float) -> float:
        """Return the undamped contact time at a speed of impact: the duration under F(x, 0), without a load.

        Free flight up to the compression from which on a force acts does not count.
        """
        # 0 * v has the shape of v.
        elastic = replace(self, force=lambda x, v: self.force(x, 0 * v), load=0.0)
        undamped = elastic.collide(speed)
        # Narrow down where the force begins to act, to a 64th in each round (65 places), and subtract the flight up to
        # there. Nine rounds are 2^-54 of the depth, a rounding error.
        low, high = self.begin, undamped.depth
        for _ in range(_ZOOMS):
            x = np.linspace(low, high, 65)
            i = max(int(np.argmax(elastic.forces(x, 0 * x) != 0)), 1)
            low, high = float(x[i - 1]), float(x[i])
        return undamped.duration - (low - self.begin) / speed

    @property
    def floor(self) -> float:
        """Compression from which on the force may act: where a neck breaks, -inf if a function says that, or 0."""
        return 0.0 if self.break_at is None else -math.inf if callable(self.break_at) else self.break_at

    def touches(self, x: FloatArray, v: FloatArray, formed: Any) -> NDArray[np.bool_]:
        """Return whether the force acts at compressions and rates; `formed` says where it acted a moment before."""
        # Without a neck the force acts at x > 0. A neck forms where x exceeds `begin`, and then holds until it breaks.
        if self.break_at is None:
            return x > 0
        holds = self.neck(x, v) > 0 if callable(self.break_at) else x > self.break_at
        return np.asarray((x > self.begin) | (formed & holds))

    def neck(self, x: FloatArray, v: FloatArray) -> FloatArray:
        """Return the values of the function `break_at`."""
        assert callable(self.break_at)
        holds = _values(self.break_at, "break_at", x, v)
        return np.where(np.isnan(holds), -1, holds)  # where the function has no value there is no neck

    @property
    def neck_energy(self) -> float:
        """Energy that bodies lose in the neck if nothing is damped: its work, from the break to where contact begins.

        Raises
        ------
        ValueError
            If a function says when the neck breaks: then the energy depends on the motion.
        """
        if self.floor == -math.inf:
            raise ValueError("break_at is a function: expected a compression, for the energy of the neck")
        # -integral of F dx from the break to `begin`, by Gauss's rule on [0, 1]: nodes (x + 1)/2, weights w/2.
        nodes, weights = legendre.leggauss(_QUADRATURE)
        energy = 0.0
        # In each part x = low + width u^4: the force may have a root at the break, and a kink at x = 0.
        for low, high in ((self.floor, min(self.begin, 0.0)), (0.0, max(self.begin, 0.0))):
            u, width = (nodes + 1) / 2, high - low
            pull = -self.forces(low + width * u**4, np.zeros_like(u))
            energy += float(weights / 2 @ (4 * u**3 * width * pull))
        return energy

    def softened(self, factor: float) -> Contact:
        """Return the contact whose motion without a load is the same, but `factor` times as long and as deep."""
        # With y = factor x(t/factor): y' = x', and y'' = -F(x, x')/(factor m) = -F(y/factor, y')/(factor m).
        neck: Any = self.break_at
        scaled = (lambda x, v: neck(x / factor, v)) if callable(neck) else None if neck is None else neck * factor
        force = lambda x, v: np.asarray(self.force(x / factor, v)) / factor  # noqa: E731
        return replace(self, force=force, begin=self.begin * factor, break_at=scaled)

    def forces(self, x: FloatArray, v: FloatArray) -> FloatArray:
        """Return the force at compressions and rates in double precision.

        Raises
        ------
        ValueError
            If the force is not real, or has another shape.
        """
        return _values(self.force, "the force", x, v)

    def rebounds(
        self,
        speed: float,
        step: ArrayLike,
        phase: ArrayLike,
        scheme: Scheme = SEMI_IMPLICIT,
        longest: float | None = None,
    ) -> Rebounds:
        """Return collisions by a program's integrator, for every step and phase; arguments are not checked.

        Parameters
        ----------
        speed : float
            Speed of impact > 0.
        step, phase : array_like
            Time steps > 0, and parts of the first step at which contact begins, from 0 to 1; they are broadcast.
        scheme : Scheme
        longest : float, optional
            Time after which bodies that still touch do not part, by default about 60 undamped contact times. It is
            necessary for a force with arrays of parameters, such as many kappa.
        """
        h, begin = np.broadcast_arrays(np.asarray(step, float), np.asarray(phase, float))
        # m dv/dt = load - F, where F acts; with the end "force" it is max(F, 0). Beyond the break of a neck, where the
        # force need not be defined, it is asked for at the break.
        g, pushes = self.load / self.mass, self.end == "force"
        if longest is None:
            longest = _PATIENCE * math.pi * _scales(self, speed).length / speed

        def acceleration(x: FloatArray, v: FloatArray, formed: NDArray[np.bool_]) -> FloatArray:
            """Return dv/dt; `formed` says where the force acted a moment before."""
            force = self.forces(np.maximum(x, self.floor), v) / self.mass
            return g - np.where(self.touches(x, v, formed), np.maximum(force, 0) if pushes else force, 0)

        return rebounds(scheme, acceleration, self.touches, self.begin, g, speed, h, begin, longest)


def _values(function: Force, name: str, x: FloatArray, v: FloatArray) -> FloatArray:
    """Return the values of a user's function, called `name` in messages, at compressions x and rates v.

    It gets copies, because it may change its arguments.
    """
    force = function(np.array(x), np.array(v))
    # Numbers of NumPy's kinds b, i, u, f (bool, integer, unsigned, float) or O (Python's objects) in some shape.
    if type(force) is np.ndarray and force.dtype == float and force.shape == np.shape(x):
        return force  # as almost all are: the checks below take as long as a simple force
    force = without_unit("force", force)
    try:
        numbers = np.asarray(force)
        if numbers.dtype.kind not in "biufO" or numbers.dtype == np.float16:  # such as complex numbers
            raise TypeError
        return np.broadcast_to(numbers.astype(float), np.shape(x))
    except (TypeError, ValueError, OverflowError):  # such as 10**400
        expected = "a real number in single or double precision for each compression"
        raise ValueError(refusal(name, force, expected)) from None


def damping_factor(
    family: Callable[[float], Contact],
    epsilon: float,
    near: float,
    *,
    speed: float = 1.0,
    step: float | None = None,
    scheme: Scheme = SEMI_IMPLICIT,
    phases: ArrayLike = PHASES,
) -> float:
    """Return the damping factor c > 0 of a one-parameter family of contacts whose (mean) eps is `epsilon`.

    Parameters
    ----------
    family : callable
        Function that returns the `Contact` of a c; eps decreases with c.
    epsilon : float
        Wanted coefficient of restitution, > 0 and < 1.
    near : float
        Start of the search, > 0. The search extends over a factor of e^204 to either side.
    speed, step, scheme, phases
        As for `Contact.collide`.

    Raises
    ------
    TypeError, ValueError
        If an argument is out of range, or no damping factor gives this eps.

    Examples
    --------
    >>> c = damping_factor(lambda c: Contact(lambda x, v: 1e5 * x + c * v, load=9.81), 0.5, near=100.0)
    >>> f"{c:.4f}"
    '149.3849'
    """
    if not callable(family):
        raise TypeError(refusal("family", family, "a function that returns the Contact of a damping factor"))
    # Search in ln c, because c may have any size. `tried` are the eps so far.
    tried: list[float] = []
    target, start = checked.number("epsilon", epsilon, _RESTITUTION), math.log(checked.number("near", near, _POSITIVE))

    def excess(log_c: float) -> float:
        """Return eps at the damping factor e^log_c less the wanted one; it falls with c."""
        # A family may come from a user, who may return anything.
        contact = family(math.exp(log_c))
        if not hasattr(contact, "collide"):
            raise TypeError(refusal("the result of family", contact, "a Contact"))
        tried.append(contact.collide(speed, step=step, scheme=scheme, phases=phases).epsilon)
        return tried[-1] - target

    first = low = high = excess(start)  # at a and at b
    a = b = start

    # -ln eps is roughly in proportion to c, so the first step goes a little beyond where c then is: ln c changes by
    # ln(ln target/ln eps). Other steps are 0.1, 0.2, 0.4, … of ln c, in sum 200 or so.
    widths = [_NEAR * 2**i for i in range(_WIDEST + 1)]
    if 0 < tried[0] < 1:
        widths.insert(0, _BEYOND * abs(math.log(math.log(target) / math.log(tried[0]))))
    if widths[0] < _CLOSE:
        return near
    # Step away from the start until eps is on either side of the wanted one: a < b, low >= 0 >= high. Then solve.
    for width in widths:
        try:
            if first > 0:
                a, low, b = b, high, b + width
                high = excess(b)
            else:
                b, high, a = a, low, a - width
                low = excess(a)
        except ValueError:  # so far from the start, a contact is no longer computed
            break
        if low >= 0 >= high:
            return math.exp(root(excess, (a, low), (b, high), _CLOSE))
    # No such place. The search ended where it began, although eps changes on the way: then eps grows with c.
    if max(tried) > tried[0] == min(tried) if first > 0 else min(tried) < tried[0] == max(tried):
        raise ValueError(f"epsilon grows with the damping{'' if step is None else ' in time steps so long'}")
    reached = f"at least {min(tried):.4g}" if first > 0 else f"at most {max(tried):.4g}"
    raise ValueError(f"epsilon is {target:g}: expected {reached}, which this kind of damping can reach")


def root(
    function: Callable[[float], float], left: tuple[float, float], right: tuple[float, float], error: float
) -> float:
    """Return a zero of `function` between `left` and `right`, points (x, f(x)) with f of both signs.

    Chandrupatla's method (Advances in Engineering Software 28 (1997), 145): inverse quadratic interpolation where that
    is safe, and bisection elsewhere. `error` is that of x.
    """
    # a is the newest point, b the one with the other sign of f, c the one before; the next x is a + t (b - a).
    (b, fb), (a, fa) = left, right
    c, fc, t = a, fa, 0.5  # bisection at first
    while fb != 0 and abs(a - b) > error:
        x = a + t * (b - a)
        fx = function(x)
        if (fx > 0) == (fa > 0):
            c, fc = a, fa
        else:
            c, b, fc, fb = b, a, fb, fa
        a, fa = x, fx
        # Done where secants to either side, through the points before, move it by less than the error.
        if abs(fa) <= error * min(abs((fa - fb) / (a - b)), abs((fa - fc) / (a - c))):
            return a
        # Places and values scaled so that b is 0 and c is 1: Chandrupatla's criterion for a monotonic parabola x(f).
        xi, phi = (a - b) / (c - b), (fa - fb) / (fc - fb)
        t = 0.5
        if phi**2 < xi and (1 - phi) ** 2 < 1 - xi:  # inverse quadratic interpolation lies inside
            t = fa / (fb - fa) * fc / (fb - fc) + (c - a) / (b - a) * fa / (fc - fa) * fb / (fc - fb)
        # At least half of the error away from a and b, so that the interval shrinks from both sides.
        nearest = error / 2 / abs(b - a)
        t = min(max(t, nearest), 1 - nearest)
    return b if fb == 0 or abs(fb) < abs(fa) else a


def sticking_speed(parts: Callable[[float], bool], near: float, widest: float = 1e6) -> float | None:
    """Return the speed below which bodies do not part, with a relative error of 1e-4; None if none is found.

    Parameters
    ----------
    parts : callable
        Whether bodies part at a speed, which is a multiple of `near`.
    near : float
        Start of the search, and unit of speed.
    widest : float
        The factor over which it extends to either side; 1e6 is a choice.
    """
    # Go down or up by factors of 4 until bodies part at `fast` and not at `slow`.
    fast, slow = 1.0, 1 / _SPEED_RATIO
    while parts(slow):
        fast, slow = slow, slow / _SPEED_RATIO
        if slow < 1 / widest:
            return None
    while not parts(fast):
        slow, fast = fast, fast * _SPEED_RATIO
        if fast > widest:
            return None
    # Halve the interval, on a scale of logarithms.
    while fast > (1 + _SAME_SPEED) * slow:
        between = math.sqrt(slow * fast)
        slow, fast = (slow, between) if parts(between) else (between, fast)
    return near * fast


def resolving_factor(
    family: Callable[[float], Contact],
    epsilon: float,
    near: float,
    spread: float,
    *,
    speed: float = 1.0,
    step: float,
    scheme: Scheme = SEMI_IMPLICIT,
) -> float | None:
    """Return the factor of longer contacts whose eps differs by at most `spread` over the phases of a step.

    The other arguments (`family`, `near`, `speed`, `step`, `scheme`) are those of `damping_factor`: each longer contact
    is damped so that its mean eps is `epsilon`. None if no factor is found.
    """

    def longer(factor: float) -> SampledCollision:
        """Return the collision of the contact that is `factor` times as long, at the damping that gives epsilon."""
        # Each search begins with the damping factor of the last one.
        nonlocal near
        near = damping_factor(
            lambda c: family(c).softened(factor), epsilon, near, speed=speed, step=step, scheme=scheme
        )
        return family(near).softened(factor).collide(speed, step=step, scheme=scheme)

    return resolved(longer, spread)


def resolved(collision: Callable[[float], SampledCollision], spread: float) -> float | None:
    """Return a factor >= 1 of steps in a contact with which eps differs by at most `spread` over the phases, or None.

    `collision` returns the collision with a factor. It raises a ValueError where no damping gives the wanted eps.
    """
    factor = 1.0
    for _ in range(_ROUNDS):
        try:
            sampled = collision(factor)
        except ValueError:  # no damping gives this eps with so few steps: twice as many, by hand
            factor *= 2
            continue
        difference = sampled.largest - sampled.least
        if difference <= spread:
            return factor
        # eps differs in proportion to the step, or to its square; the square root is right for the latter and too small
        # for the former, and the next round goes on. 1.1: so that close to the spread it ends.
        factor *= max(1.1, math.sqrt(difference / spread))
    return None


def phase_range(
    epsilon: Callable[[FloatArray], FloatArray], phases: FloatArray, values: FloatArray
) -> tuple[float, float, float]:
    """Return the least and the largest eps over all phases, and an estimate of their error.

    Parameters
    ----------
    epsilon : callable
        From phases to the eps of each. It is smooth in pieces, and has a period of one step.
    phases, values : array
        Phases in order, and their eps.
    """
    # Both ends of a step are limits: the force acts from just after the start of a step, or from its end on.
    ends = np.array([0.0, _LAST_PHASE])
    at_start, at_end = epsilon(ends)
    p, e = np.concatenate((ends[:1], phases, ends[1:])), np.concatenate(([at_start], values, [at_end]))
    split = np.ones(len(p) - 1, bool)  # all intervals at first
    for _ in range(_DIVISIONS):
        # Divide the marked intervals into equal parts, and insert eps there.
        width = np.diff(p)
        more = (p[:-1, None] + width[:, None] * np.arange(1, _PARTS) / _PARTS)[split].ravel()
        p, e = np.concatenate((p, more)), np.concatenate((e, epsilon(more)))
        order = np.argsort(p)
        p, e = p[order], e[order]

        # An interval may contain a jump or an extremum. On either side of it, eps goes on with about the slope that it
        # has in the interval before or after; the flatter one of two, because the other may contain a jump, too.
        width = np.diff(p)
        slope = np.abs(np.diff(e)) / width
        rise = 2 * width * np.minimum(np.roll(slope, 1), np.roll(slope, 2))
        fall = 2 * width * np.minimum(np.roll(slope, -1), np.roll(slope, -2))
        # (2: a slope may grow towards an extremum; by hand.)
        above = np.maximum(e[:-1] + rise, e[1:] + fall) - e.max()
        below = e.min() - np.minimum(e[:-1] - rise, e[1:] - fall)
        beyond = np.maximum(above, below)
        # A jump: eps changes more than four times as much as its neighbours' slopes allow. It may be steep in front of
        # the jump, so the place is narrowed down, too.
        jumps = np.abs(np.diff(e)) > 4 * np.maximum(rise, fall)
        split = ((beyond > _RANGE_ERROR) & (width > _SAME_PHASE)) | (jumps & (width > _NARROW))
        if not split.any() or len(p) + split.sum() * _PARTS > _MOST_PHASES:
            break
    return float(e.min()), float(e.max()), float(beyond.max())


# --- without a time step ----------------------------------------------------------------------------------------------


class _Rule(NamedTuple):
    """Gauss's collocation method on [0, 1]: nodes, weights, integrals up to each node, and the last coefficients.

    `gap` is the length of the two outermost parts, which have no nodes. `inner` and `values` are integrals up to a
    place in each of them, close to 0 and 1, and the values there.
    """

    nodes: FloatArray
    weights: FloatArray
    integrals: FloatArray
    last: FloatArray
    gap: float
    inner: FloatArray
    values: FloatArray


@cache
def _rule(n: int) -> _Rule:
    """Return the method with n nodes, by Legendre polynomials P_k, whose integral is (P_(k+1) - P_(k-1))/(2k + 1)."""
    # On [-1, 1]: nodes and weights of Gauss, and P_0 … P_n there and at two places near the ends.
    x, weights = legendre.leggauss(n)
    k, gap = np.arange(n), float(x[0] + 1)
    p = legendre.legvander(np.concatenate((x, [_EDGE * gap - 1, 1 - _EDGE * gap])), n)
    # f = sum_k f_k P_k with f_k = (k + 1/2) sum_i w_i P_k(x_i) f(x_i), because the integral of P_k^2 is 1/(k + 1/2).
    coefficients = (k[:, None] + 0.5) * p[:n, :n].T * weights
    below = np.column_stack([-np.ones(n + 2), p[:, : n - 1]])  # P_(-1) = -1 gives the right integral of P_0
    integrals = (p[:, 1:] - below) / (2 * k + 1) @ coefficients / 2
    values = p[n:, :n] @ coefficients
    # On [0, 1] lengths are halved. The last three coefficients estimate the error of a piece.
    return _Rule((x + 1) / 2, weights / 2, integrals[:n], coefficients[-3:], gap / 2, integrals[n:], values)


class _Piece(NamedTuple):
    """A piece of the motion: s and v at the nodes and, last, at its end; its duration, and an estimate of its error."""

    s: FloatArray
    v: FloatArray
    time: float
    error: float


class _Event(NamedTuple):
    """A turn, a turn back or the end of the motion, a zero of the force or of x: its place in a piece, with bounds.

    `part`, `low` and `high` are parts of the piece's length. Names are those of `_Motion.quantity`.
    """

    part: float
    low: float
    high: float
    name: str


class _Phase(NamedTuple):
    """Whether the force acts, whether the bodies approach, and whether x is above 0."""

    acts: bool
    approaches: bool
    above: bool


class _Motion:
    """The motion of a contact in the variables s and sigma, in units in which the largest speed is about 1.

    The compression is s^4 + floor, where the neck breaks at the floor, or at last there if a function says when.
    """

    def __init__(self, contact: Contact, speed: float, scales: _Scales, nodes: int, tolerance: float) -> None:
        """Prepare the motion of a contact from a speed of impact, in units of `scales`.

        `nodes` is the number of nodes in a piece, `tolerance` the error of a piece over the largest speed.
        """
        self.contact, (self.length, self.speed) = contact, scales
        self.floor = -_NECK if callable(contact.break_at) else contact.floor / self.length
        self.begin = contact.begin / self.length
        self.unit, self.start = contact.mass * self.speed**2 / self.length, speed / self.speed
        self.load, self.pushes = contact.load / self.unit, contact.end == "force"
        # In single precision the force has noise, so nothing can be solved to more digits.
        coarser = contact.roundoff / float(np.finfo(float).eps)
        self.rule, self.tolerance = _rule(nodes), float(max(tolerance, _NOISY * contact.roundoff))
        self.solved, self.rounded, self.nudge = _SOLVED * coarser, _ROUNDED * coarser, _NUDGE * math.sqrt(coarser)
        self.rate_error = _RATE_ERROR * coarser

    def force(self, s: FloatArray, v: FloatArray) -> FloatArray:
        """Return the force over m speed^2/length at x = s^4 + floor and v, in these units."""
        return self.contact.forces(self.length * (s**4 + self.floor), self.speed * v) / self.unit

    def force_at(self, s: float, v: float) -> float:
        """Return the force at one place."""
        return float(self.force(np.array([s]), np.array([v]))[0])

    def noise(self, s: FloatArray, v: FloatArray) -> FloatArray:
        """Return the error of the force due to that of rates: with strong damping the force is close to 0 for long."""
        return np.abs(self.force(s, v * (1 + self.rate_error)) - self.force(s, v))

    def rate(self, s: float, v: float, acts: bool) -> float:
        """Return dv/dsigma."""
        return 4 * s**3 * (self.load - (self.force_at(s, v) if acts else 0))

    def collide(self) -> tuple[float, float, float, float]:
        """Return eps (0 if the bodies do not part), depth, duration and the sum of the errors of all pieces."""
        # s = (x - floor)^(1/4). A first piece of 0.25 is about a quarter of the way in s; if it is too long it is
        # shortened. The force acts at once if it pushes just after contact begins (s = 1e-3 is x = 1e-12 lengths).
        first = s = (self.begin - self.floor) ** 0.25
        v, time, error, h, depth, acted = self.start, 0.0, 0.0, 0.25, 0.0, 0.0
        phase = _Phase(not self.pushes or self.force_at(1e-3, v) >= 0, True, self.begin >= 0)
        # The error of a piece falls with its length like the power `nodes`, that of the first coefficient left out. A
        # speed below ten errors of the equations is not known.
        power, creep = 1 / len(self.rule.nodes), max(_CREEP * self.start, 10 * self.solved)
        for _ in range(_PIECES):
            # Solve a piece of length h; if something happens in it, shorten it so that it ends there.
            piece = self.piece(s, v, h, phase.acts)
            event = self.event(piece, s, v, phase)
            if event and event.name == "turns back" and (piece.error <= self.tolerance or h <= _SHORTEST):
                return 0.0, depth, math.inf, error / self.start
            # In the shorter, better piece an earlier event may show; three rounds, as there are at most four kinds.
            for _ in range(3):
                if not event or event.name == "turns back":
                    break
                piece, h = self.landed(event, s, v, h, phase)
                earlier = self.event(piece, s, v, phase)
                if not earlier or earlier.name == event.name:
                    break
                event = earlier
            # Too large an error: shorten the piece to where it is just small enough, 0.9 for safety, but by factors
            # from 1/5 to 1/2, because the error of a bad piece is no measure. Above 1, the largest speed, it says
            # nothing.
            if not piece.error <= self.tolerance and h > _SHORTEST:
                shorter = 0.9 * (self.tolerance / piece.error) ** power
                h *= min(0.5, max(0.2, shorter)) if piece.error < 1 else 0.2
                continue
            if not piece.error < 1:
                break
            # Accept the piece.
            s, v, time, error = float(piece.s[-1]), float(piece.v[-1]), time + piece.time, error + piece.error
            if s > _FAR + first:
                raise _never_stops(self.contact, self.start * self.speed)
            depth = max(depth, s**4 + self.floor)
            if phase.acts and self.force(piece.s, piece.v).any():  # the force may be 0 up to some compression
                acted = time
            if event and event.name == "end":
                # With a load, v^2/2 - load x is constant from here to where contact begins.
                square = v * v - 2 * self.load * (s**4 + self.floor - self.begin)
                return math.sqrt(max(square, 0.0)) / self.start, depth, acted, error / self.start
            if event and event.name == "far":
                break
            if event and event.name == "turn":
                v, phase = 0.0, phase._replace(approaches=False)
                # A force that acts in the approach only does not push bodies apart: they stay at the turning point.
                if self.rate(s, -creep, phase.acts) >= 0:
                    return 0.0, depth, math.inf, error / self.start
            elif event and event.name == "force":
                phase = phase._replace(acts=not phase.acts)
            elif event and event.name == "level":
                phase = phase._replace(above=not phase.above)
            # Bodies that creep stay: s would not change in a unit of sigma by v or by the rate, or they slow down
            # further.
            rate = self.rate(s, v, phase.acts)
            if abs(v) < creep and (s * abs(rate) < creep or (v * rate < 0 and not phase.approaches)):
                return 0.0, depth, math.inf, error / self.start
            # The next piece: as long as its error may be, 0.8 for safety, between 0.3 and 4 times as long as this one
            # (by hand). The part of the error due to rounding does not fall with the length; 1/1000 stands for 0.
            truncated = max(piece.error - self.rounded, self.rounded / 1000)
            h *= min(4.0, max(0.3, 0.8 * (self.tolerance / truncated) ** power))
        where = f"compression {self.length * (s**4 + self.floor):.4g} and rate {self.speed * v:.4g}"
        if event and event.name == "far":
            raise ValueError(f"break_at is still > 0 at {where}: expected a function that is 0 where a neck breaks")
        raise ValueError(f"the force cannot be integrated at {where}: expected a finite force, without noise")

    def piece(self, s: float, v: float, h: float, acts: bool) -> _Piece:
        """Return the piece of length h in sigma from s and v: the collocation equations, solved by Newton's method.

        `acts` says whether the force acts in it; derivatives of the force are differences.
        """
        # v_i = v + h sum_j I_ij rate_j at the nodes, on the path s_i = s + h sum_j I_ij v_j, with rate = dv/dsigma.
        nodes, weights, integrals, last, gap, inner, values = self.rule
        n, v_nodes = len(nodes), np.full(len(nodes), v)
        for _ in range(_NEWTON):
            # One call of the force for all nodes, with s or v changed a little. (1e-3: s may be 0; a thousandth of a
            # unit is the least scale.)
            path = s + h * (integrals @ v_nodes)
            nudge = self.nudge * (np.abs(path) + 1e-3)
            all_s, all_v = (
                np.concatenate((path, path + nudge, path)),
                np.concatenate((v_nodes, v_nodes, v_nodes + self.nudge)),
            )
            rates = 4 * all_s**3 * (self.load - (self.force(all_s, all_v) if acts else 0))  # dv/dsigma = 4 s^3 dv/dt
            rate = rates[:n]
            residual = v_nodes - v - h * (integrals @ rate)
            # The residual, and its Jacobian 1 - h d rate/dv I - h^2 d rate/ds I I; derivatives are differences.
            d_rate_ds, d_rate_dv = (rates[n : 2 * n] - rate) / nudge, (rates[2 * n :] - rate) / self.nudge
            jacobian = np.eye(n) - h * (integrals * d_rate_dv) - h * h * ((integrals * d_rate_ds) @ integrals)
            try:
                move = np.linalg.solve(jacobian, residual) if np.isfinite(residual).all() else residual
            except np.linalg.LinAlgError:  # the piece is too long for a steep force
                move = np.full(n, np.inf)
            size = float(np.abs(move).max())
            v_nodes = v_nodes - move
            # The rate at the new nodes, to first order: strong damping multiplies what is left of v's error.
            rate = rate - d_rate_dv * move - d_rate_ds * (h * (integrals @ move))
            if size < self.solved * (1 + abs(v)) or not size < _ESCAPES:
                break
        # Strong damping reduces errors by the factor 1 - h d rate/dv of an implicit step.
        relaxed = 1 + h * max(float(-d_rate_dv.max()), 0)
        # The rate between the nodes by the force, against that of the polynomial: they differ where there is a
        # kink between the last node and the end.
        edges = s + h * (inner @ v_nodes)
        rate_at_edges = 4 * edges**3 * (self.load - (self.force(edges, v + h * (inner @ rate)) if acts else 0))
        missed = gap * float(np.abs(rate_at_edges - values @ rate).max())
        # The error of v: the last coefficients of the rate, or what is missed at the edges, times h; and the last move
        # of Newton's method if it did not get small (10: a few roundings).
        error = h * max(float(np.abs(last @ rate).max()), missed) / relaxed + (size if size > 10 * self.solved else 0)
        end = float(s + h * (weights @ v_nodes)), float(v + h * (weights @ rate))
        # Its duration is the integral of dt = 4 s^3 dsigma.
        return _Piece(np.append(path, end[0]), np.append(v_nodes, end[1]), h * float(weights @ (4 * path**3)), error)

    def quantity(self, name: str, s: Any, v: Any, phase: _Phase) -> Any:
        """Return what falls below 0 where the event of this name happens, at numbers or arrays s and v.

        `phase` says what acts before the event. "turn": the bodies stop. "turns back": they approach again. "force":
        the force vanishes, or acts again. "level": x = 0 where there is a neck. "end": they part. "far": a neck that a
        function breaks is still there at 10 lengths.
        """
        # The sign is that before the event. x = s^4 + floor is 0 at s = (-floor)^(1/4).
        if name == "force":
            return (1 if phase.acts else -1) * self.force(s, v)
        if name == "level":
            return (1 if phase.above else -1) * (s - (-self.floor) ** 0.25)
        # A function that says when a neck breaks counts below `begin` only.
        if name == "end" and callable(self.contact.break_at):
            x = s**4 + self.floor
            return np.where(x > self.begin, 1, self.contact.neck(self.length * x, self.speed * v))
        return {"turn": v, "turns back": -v}.get(name, s)

    def event(self, piece: _Piece, s: float, v: float, phase: _Phase) -> _Event | None:
        """Return the first event in a piece from s and v, or None; `phase` is that of the piece."""
        # What can happen next.
        names = ["turn"] if phase.approaches else ["end", "turns back"]
        names += ["force"] if self.pushes else ["level"] if self.floor else []
        names += ["far"] if callable(self.contact.break_at) else []
        places, events = np.append(self.rule.nodes, 1), []
        start_s, start_v = np.array([s]), np.array([v])
        for name in names:
            values = self.quantity(name, piece.s, piece.v, phase)
            if name == "force":
                values = values + self.noise(piece.s, piece.v)
            if (values < 0).any():
                # Between the first node i where the quantity is negative and the node before, or the start, where it is
                # positive or, at an event that has just been, 0 up to its sign. A secant gives the place.
                i = int(np.argmax(values < 0))
                low, value = float(places[i - 1]), values[i - 1]
                if not i:
                    low, value = 0.0, abs(float(self.quantity(name, start_s, start_v, phase)[0]))
                high = float(places[i])
                events.append(_Event(low + (high - low) * float(value / (value - values[i])), low, high, name))
        return min(events, default=None)

    def landed(self, event: _Event, s: float, v: float, h: float, phase: _Phase) -> tuple[_Piece, float]:
        """Return the piece from s and v that ends with an event of the piece of length h, and its own length.

        `phase` is that before the event. The place is a zero of `quantity`, found by Newton's method between bounds.
        """
        # Lengths in sigma. A computed quantity has noise: the derivative along the motion is a difference.
        low, high, h = event.low * h, event.high * h, event.part * h
        acts, computed = phase.acts, event.name == "force" or (event.name == "end" and callable(self.contact.break_at))
        for _ in range(_LANDING):
            piece = self.piece(s, v, h, acts)
            # The quantity at the end of the piece, and its slope: v' = rate for "turn", s' = v for others. It is close
            # enough to 0 below a tenth of the error of the equations, or where the force is only noise.
            end_s, end_v = piece.s[-1:], piece.v[-1:]
            value, close = float(self.quantity(event.name, end_s, end_v, phase)[0]), self.solved / 10
            rate = self.rate(float(end_s[0]), float(end_v[0]), acts)
            if computed:
                ahead = self.quantity(event.name, end_s + self.nudge * end_v, end_v + self.nudge * rate, phase)
                slope = (float(ahead[0]) - value) / self.nudge
            else:
                slope = rate if event.name == "turn" else float(end_v[0])
                slope = -slope if event.name == "level" and not phase.above else slope
            if event.name == "force":
                close = float(self.noise(end_s, end_v)[0])
            # The bounds, and Newton's step. It ends where the step or the quantity is as small as their errors.
            low, high = (h, high) if value > 0 else (low, h)
            move = -value / slope if slope else math.inf
            if abs(move) < self.solved * max(h, 1) or abs(value) < close:
                return piece, h
            if high - low < self.solved * max(h, 1):
                if not computed:  # s and v do not jump: the longer piece was wrong
                    break
                h = max(low, self.solved)  # the force jumps: this piece ends in front of the jump
                return self.piece(s, v, h, acts), h
            h = h + move if low < h + move < high else (low + high) / 2
        # Not converged: an error that says so makes `collide` shorten the piece.
        return (piece if abs(move) < _CREEP * max(h, 1) else piece._replace(error=math.inf)), h


class _Scales(NamedTuple):
    """Units of a collision: its compression, and the largest speed, roughly."""

    length: float
    speed: float


def _scales(contact: Contact, speed: float) -> _Scales:
    """Return scales of a contact: a compression and the largest speed, roughly.

    At this compression the work of the force, at rate 0 or else at the speed of impact, stops the bodies. It is the
    unit of length of a collision; 1e-3 of the largest energy is exact enough. The largest speed is that of
    bodies that the load accelerates over this length, and a force that pulls. `speed` is that of impact.
    """
    energy = contact.mass * speed * speed / 2
    if not (0 < speed * speed < math.inf and 0 < 2 * energy < math.inf):
        raise ValueError(
            f"speed is {speed:g}, mass is {contact.mass:g}: expected m v^2 in the range of double precision"
        )
    for rate in (0.0, speed):
        # Compressions from 1e-40 to 1e40, a hundred a decade: no unit of length is presumed.
        x = contact.begin + np.concatenate(([0.0], np.logspace(-40, 40, 8001)))
        for _ in range(_HALVINGS):
            with np.errstate(all="ignore"):
                # By the trapezoidal rule up to each x: the work of force - load, and the largest work of a pulling
                # force, which adds to the energy. `largest_work` is at least the work of the force, `work_error` the
                # rule's error at a jump, and `scale` the largest energy up to each x.
                force = contact.forces(x, np.full(len(x), rate))
                force = np.maximum(force, 0) if contact.end == "force" else force
                width, finite = np.diff(x), np.where(np.isfinite(force), force, 0)
                pull = np.maximum.accumulate(np.maximum(-np.cumsum((finite[1:] + finite[:-1]) / 2 * width), 0))
                force = np.where(np.isfinite(force), force - contact.load, 0)
                work = np.cumsum((force[1:] + force[:-1]) / 2 * width)
                scale = energy + max(contact.load, 0) * x[1:] + pull
                largest_work = np.cumsum(np.maximum(force[1:], force[:-1]) * width)
                work_error = np.abs(np.diff(force)) * width

            # Where the force may jump, intervals are halved, as far as the bodies may come.
            reached = largest_work >= energy
            halved = (work_error > _WORK_ERROR * scale) & (np.arange(len(width)) <= np.argmax(reached))
            if not reached.any() or not halved.any() or len(x) > _MOST_PLACES:
                break
            x = np.sort(np.concatenate((x, (x[1:] - width / 2)[halved])))
        # m v^2/2 = m speed^2/2 + load length/2 + pull: half of the load's work, because the force takes up the rest (by
        # hand; it is a unit).
        if (work >= energy).any():
            stop = int(np.argmax(work >= energy))
            length, pulled = float(x[1 + stop] - contact.begin), float(pull[stop])
            square = speed**2 + max(contact.load, 0) / contact.mass * length + 2 * pulled / contact.mass
            return _Scales(length, math.sqrt(square))
    raise _never_stops(contact, speed)


def _never_stops(contact: Contact, speed: float) -> ValueError:
    """Return the error of a force that does not stop bodies at a speed of impact."""
    return ValueError(f"the force does not stop a body of mass {contact.mass:g} at speed {speed:g}: {_EXPECTED}")


def _without_steps(contact: Contact, speed: float) -> SampledCollision:
    """Return the collision of a contact at a speed without a time step.

    It is the finer of two solutions, with their differences as errors.
    """
    with np.errstate(all="ignore"):  # overflow in steps that are too long
        scales = _scales(contact, speed)
        motions = [_Motion(contact, speed, scales, *method) for method in _METHODS]
        fine, coarse = (motion.collide() for motion in motions)
    motion, names = motions[0], ("epsilon", "depth", "duration")
    units = 1.0, motion.length, motion.length / motion.speed
    numbers = {name: value * unit for name, value, unit in zip(names, fine, units, strict=False)}
    # The difference of both solutions, the errors of the finer one's pieces and the rounding of its numbers, of which
    # the largest speed, 1/start speeds of impact, is one. Bodies that stay (an infinite duration) have eps = 0 exactly.
    errors = {}
    for name, finer, coarser, unit in zip(names, fine, coarse, units, strict=False):
        rounding = 0.0 if fine[2] == math.inf and name != "depth" else fine[-1] + _ROUNDING * (finer + 1 / motion.start)
        errors[name] = unit * ((abs(finer - coarser) if finer != coarser else 0.0) + rounding)
    if not (errors["epsilon"] < _WORST and errors["depth"] < _WORST * numbers["depth"]):
        outcome = f"eps = {fine[0]:.4g} with an error of {errors['epsilon']:.2g}"
        raise ValueError(f"the force gives {outcome} at speed {speed:g}: expected a smoother force, or a time step")
    errors["least"] = errors["largest"] = errors["epsilon"]
    return SampledCollision(least=fine[0], largest=fine[0], parts=fine[2] < math.inf, errors=errors, **numbers)
