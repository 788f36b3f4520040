"""Coverage of the intervals of `viscopade.fit`: how often they contain the true value, on data from other programs.

LAMMPS and MuJoCo make collisions and bounces (`viscopade_lab.runs.fit_data`). Errors are added to them, Gaussian or
skewed: two exponential functions of different slope, as Montaine et al. (2011) measured. Each kind of data has `--sets`
sets, and the verdicts of the first `--judged` of them are counted. A correct 68 % interval contains the true value in
68 % of the sets; with 2000 sets the standard error of that number is 1.0 %, and 0.5 % for 95 %.

Run as `python -m viscopade_lab.studies.coverage`: it prints the table of docs/results/fit.md. It needs the program
`lmp` and the package `mujoco`. With `--verdicts 400` it prints the table of verdicts on made data of a constant eps and
of the viscoelastic law, over one decade of speeds; that needs neither, and takes half an hour.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from itertools import product
from typing import TYPE_CHECKING

import click
import numpy as np

from viscopade import Pair, Points, Sphere
from viscopade.arrays.checked import FloatArray
from viscopade.extras import MissingPackage, require
from viscopade.fitting.damping import LEVELS, DampingFit
from viscopade.fitting.flight import Flight
from viscopade.progress import track
from viscopade_lab.runs import fit_data
from viscopade_lab.studies.laws import markdown

# Chosen as an experimenter's data might be; the rates hold for these kinds of data.
POINTS, MANY = 12, 48  # points of eps(v): few and many
SLOWEST, FASTEST = 0.05, 3.0  # m/s: falls from 0.1 mm to 0.5 m
SIGMA = 0.01  # of eps
CONTACT_SIGMA = 0.02  # of contact times, relative
RESOLUTION = 5e-4  # s: of a detector of contacts
HEIGHT_RESOLUTION = 1e-3  # m: of a measured height
DROPS, BOUNCES = 5, 6  # drops, and bounces of each
SINGLE, SMALL = 10, 0.003  # bounces of a single drop, and their scatter, smaller than the detector's
SLOPES = 3.0  # ratio of both exponential functions of the skewed errors: losses three times as long as gains
SEED = 20  # any: other seeds move the rates by their standard error
WORDS = ("holds", "holds with a limit", "does not hold", "undecided")
EPSILONS, SIGMAS, NUMBERS = (0.3, 0.6, 0.9, 0.99), (0.01, 0.03), (5, 6, 8, 12)
"""Data for verdicts: eps in the middle of a decade of speeds, its standard errors, and numbers of points."""

if TYPE_CHECKING:
    from viscopade.fitting.contacts import ContactTime

Random = np.random.Generator
Errors = Callable[[Random, int], FloatArray]


def gaussian(random: Random, number: int) -> FloatArray:
    """Return errors of variance 1."""
    return random.standard_normal(number)


def skewed(random: Random, number: int) -> FloatArray:
    """Return errors of mean 0 and variance 1 whose density is two exponential functions; most are small gains."""
    # gain - loss has the mean 1 - SLOPES and the variance 1 + SLOPES^2, because an exponential variable's deviation is
    # its mean.
    loss, gain = random.exponential(SLOPES, number), random.exponential(1.0, number)
    return np.asarray((gain - loss + SLOPES - 1) / np.hypot(SLOPES, 1))


ERRORS: dict[str, Errors] = {"Gaussian": gaussian, "skewed": skewed}


@dataclass(frozen=True)
class Case:
    """A kind of data: a function from random numbers and errors to points, and what fits should find.

    `truths` has the true value of each fitted quantity: "beta" in (s/m)^(1/5), "A" in s, "Y" in Pa, or "eps".
    """

    name: str
    made: Callable[[Random, Errors], Points]
    truths: dict[str, float]


@dataclass(frozen=True)
class Rate:
    """Rates of one kind of data with one kind of errors.

    Attributes
    ----------
    data, errors, quantity : str
    inside : tuple of float
        Fractions of sets whose 68 % and 95 % intervals contain the true value.
    bias : float
        Mean of fitted / true value, minus 1.
    verdicts : dict
        Fractions of verdicts.
    """

    data: str
    errors: str
    quantity: str
    inside: tuple[float, ...]
    bias: float
    verdicts: dict[str, float]


def _ball() -> Sphere:
    """Return the ball of `fit_data`; 4/3 E_eff is its stiffness at a hard wall, and at a ball like it."""
    return Sphere(
        radius=fit_data.RADIUS,
        density=fit_data.DENSITY,
        young_modulus=2 * 0.75 * fit_data.STIFFNESS,  # E_eff = Y/2 for two such balls, and 3/4 undoes the 4/3
        poisson_ratio=0,
        dissipative_constant=0,
    )


def cases() -> list[Case]:
    """Return all kinds of data, from runs of both programs.

    Each is made by a function from a random generator and a kind of errors to points: speeds and eps measured, with
    contact times, or bounces.
    """
    from viscopade.fitting import bounces, likelihood, verdict  # these load SciPy

    # Exact collisions of LAMMPS at some speeds, with both laws, and bounces of both programs.
    law, linear = fit_data.collisions(), fit_data.collisions(viscoelastic=False)
    speed = np.geomspace(SLOWEST, FASTEST, POINTS)
    epsilon, duration = law.interpolated(speed)
    constant = linear.interpolated(speed)[0]
    flight = Flight(fit_data.GRAVITY)
    ball = _ball()
    wall = Sphere.wall(young_modulus=ball.young_modulus, poisson_ratio=0, dissipative_constant=0)
    contact = Pair(ball, wall)
    lammps_instants, (mujoco_instants, mujoco_contact) = fit_data.lammps_bounces(), fit_data.mujoco_bounces()
    pair, beta = Pair(ball, ball), fit_data.PAIR_BETA
    stiffness = {"beta": beta, "A": float(pair.dissipative_constant(beta)), "Y": ball.young_modulus}

    def scattered(
        speed: FloatArray, epsilon: FloatArray, sigma: float | None = SIGMA
    ) -> Callable[[Random, Errors], Points]:
        """Return a maker of points (v, eps) with errors of eps; `sigma` is what the fit is told, None for nothing."""

        def made(random: Random, errors: Errors) -> Points:
            return Points.measured(speed, epsilon + SIGMA * errors(random, len(speed)), sigma_epsilon=sigma)

        return made

    many = np.geomspace(SLOWEST, FASTEST, MANY)

    def with_contacts(random: Random, errors: Errors) -> Points:
        """Return points (v, eps, contact time) with errors of both."""
        times = duration * (1 + CONTACT_SIGMA * errors(random, POINTS))
        return Points.measured(speed, epsilon + SIGMA * errors(random, POINTS), contact_time=times)

    def detected(instants: FloatArray, contact: ContactTime = 0.0) -> Callable[[Random, Errors], Points]:
        """Return a maker of points from the instants of one drop with a detector's errors, but no scatter of eps."""

        def made(random: Random, errors: Errors) -> Points:
            seen = instants + RESOLUTION * errors(random, len(instants))
            points = bounces.of_times([(seen, _labels(seen))], flight, sigma=RESOLUTION, contact_time=contact)
            return points.without_scatter()

        return made

    def launches(random: Random, errors: Errors, number: int, sigma: float) -> FloatArray:
        """Return the speeds (m/s) of the fall and of successive flights: eps of LAMMPS at each, with scatter sigma."""
        speeds = [random.uniform(2.0, 3.0)]  # of the fall, from 0.2 to 0.46 m
        for error in errors(random, number):
            eps_with_error = float(law.interpolated(np.array([speeds[-1]]))[0][0]) + sigma * float(error)
            speeds.append(speeds[-1] * min(eps_with_error, 1 - 1e-9))  # below 1: a passive body loses energy
        return np.array(speeds)

    def dropped(drops: int, number: int, sigma: float) -> Callable[[Random, Errors], Points]:
        """Return a maker of points from the instants of drops, each with `number` bounces after the first contact."""

        def made(random: Random, errors: Errors) -> Points:
            instants = []
            for _ in range(drops):
                # A flight that starts with the speed u takes 2 u/g. The first contact is 0.3 s after any zero of time.
                flights = 2 * launches(random, errors, number, sigma)[1:] / fit_data.GRAVITY
                seen = np.concatenate([[0.3], 0.3 + np.cumsum(flights)]) + RESOLUTION * errors(random, number + 1)
                instants.append((seen, _labels(seen)))
            return bounces.of_times(instants, flight, sigma=RESOLUTION)

        return made

    def risen(random: Random, errors: Errors) -> Points:
        """Return points from the heights v^2/(2 g) of successive flights of `DROPS` drops."""
        drops = []
        for _ in range(DROPS):
            heights = launches(random, errors, BOUNCES, SIGMA) ** 2 / (2 * fit_data.GRAVITY)
            seen = heights + HEIGHT_RESOLUTION * errors(random, len(heights))
            drops.append((seen, _labels(seen)))
        return bounces.of_heights(drops, flight, sigma=HEIGHT_RESOLUTION)

    # MuJoCo's eps is that of a fit of the constant model, MODELS[1], to instants without errors; no seed matters.
    bounced = detected(mujoco_instants, mujoco_contact)
    without_errors = bounced(np.random.default_rng(0), lambda _, number: np.zeros(number))
    mujoco_fit = likelihood.fit_law(without_errors, verdict.MODELS[1])
    return [
        Case("LAMMPS, v and eps, standard errors known", scattered(speed, epsilon), {"beta": beta}),
        Case("LAMMPS, v and eps, scatter unknown", scattered(speed, epsilon, None), {"beta": beta}),
        Case(f"the same, {MANY} points", scattered(many, law.interpolated(many)[0], None), {"beta": beta}),
        Case("LAMMPS, v, eps and contact times", with_contacts, stiffness),
        Case(
            "LAMMPS, instants of a drop, --no-scatter",
            detected(lammps_instants, contact),
            {"beta": fit_data.WALL_BETA},
        ),
        Case(f"eps of LAMMPS, instants of a drop, scatter {SMALL:g}", dropped(1, SINGLE, SMALL), {"beta": beta}),
        Case("eps of LAMMPS, instants of five drops", dropped(DROPS, BOUNCES, SIGMA), {"beta": beta}),
        Case("eps of LAMMPS, heights of five drops", risen, {"beta": beta}),
        Case("LAMMPS with spring and dashpot", scattered(speed, constant), {"eps": float(constant[0])}),
        Case(
            "MuJoCo, instants of a drop, --no-scatter",
            bounced,
            {"eps": float(mujoco_fit.epsilon(mujoco_fit.points.speed)[0])},
        ),
    ]


def _labels(values: FloatArray) -> list[str]:
    """Return "0", "1", …: the names of rows of a made file, which messages would show."""
    return [str(i) for i in range(len(values))]


def rates(case: Case, errors: str, sets: int, judged: int) -> list[Rate]:
    """Return the rates of one kind of data, for each true value.

    `errors` is a key of `ERRORS`. Of all `sets` the intervals are counted, of the first `judged` the verdicts.
    """
    from viscopade.fitting import verdict

    # Random numbers that are the same in each run. Lengths of names make them differ between most kinds of data (three
    # names have 40 letters); they need not be independent of each other.
    random = np.random.default_rng([SEED, len(case.name), len(errors)])
    # By fitted quantity: how many sets' intervals of each level contain the truth, and value/truth of each set.
    inside = {name: np.zeros(len(LEVELS)) for name in case.truths}
    ratios: dict[str, list[float]] = {name: [] for name in case.truths}
    words: Counter[str] = Counter()
    for i in range(sets):
        points = case.made(random, ERRORS[errors])
        for name, (value, spans) in _estimates(points, case).items():
            truth = case.truths[name]
            inside[name] += [low <= truth <= high for low, high in spans]
            ratios[name].append(value / truth)
        if i < judged:
            words[verdict.judged(points)[1].word] += 1
    shares = {word: words[word] / judged for word in WORDS} if judged else {}
    return [
        Rate(
            case.name,
            errors,
            name,
            tuple((inside[name] / sets).tolist()),
            float(np.mean(ratios[name])) - 1,
            shares,
        )
        for name in case.truths
    ]


def _estimates(points: Points, case: Case) -> dict[str, tuple[float, list[tuple[float, float]]]]:
    """Return, for each quantity of `case.truths`, the fitted value and its intervals of 68 % and 95 %, (low, high)."""
    from viscopade.fitting import likelihood, verdict

    # MODELS[1] is a constant eps; the fit has its kappa, which falls as eps rises: the ends of intervals change places.
    if "eps" in case.truths:
        fit = likelihood.fit_law(points, verdict.MODELS[1])
        speed = points.speed[:1]  # any speed: eps is the same
        ends = [fit.interval(level) for level in LEVELS]
        spans = [
            (float(fit.epsilon(speed, np.array([b]))[0]), float(fit.epsilon(speed, np.array([a]))[0])) for a, b in ends
        ]
        return {"eps": (float(fit.epsilon(speed)[0]), spans)}

    # MODELS[0] is the viscoelastic law. The verdict of a `DampingFit` is not used here.
    main = likelihood.fit_law(points, verdict.MODELS[0])
    damping_fit = DampingFit(points, (main,), verdict.Verdict("holds", ()), ())
    estimates = {"beta": (damping_fit.beta, [damping_fit.interval(level) for level in LEVELS])}
    if "Y" in case.truths:  # A and Y from contact times, with symmetric intervals: quantile times standard error
        for name, constant in zip("AY", damping_fit.stiffness(_ball(), False), strict=True):
            widths = [main.quantile(level) * constant.standard_error for level in LEVELS]
            estimates[name] = (constant.value, [(constant.value - r, constant.value + r) for r in widths])
    return estimates


@dataclass(frozen=True)
class Cell:
    """Kind of made data whose verdict is known: points over the decade from 0.1 to 1 m/s.

    Attributes
    ----------
    viscoelastic : bool
        Whether they follow the viscoelastic law; else eps is constant.
    with_errors : bool
        Whether the fit is given the standard errors.
    epsilon, sigma : float
        eps in the middle, and the standard deviation of its Gaussian errors.
    number : int
        Of points.
    """

    viscoelastic: bool
    with_errors: bool
    epsilon: float
    sigma: float
    number: int

    def verdicts(self, sets: int) -> Counter[str]:
        """Return the number of sets with each verdict."""
        from viscopade.fitting import likelihood, verdict

        # Models: the viscoelastic law, kappa ~ v^(1/5), and a constant eps (exponent None).
        law, constant, *_ = verdict.MODELS
        model, speed = law if self.viscoelastic else constant, np.geomspace(0.1, 1, self.number)
        # kappa is that of epsilon at the middle of the decade on the logarithmic axis, 10^(-1/2) m/s.
        kappa = likelihood.kappa_of(law.law, np.array([self.epsilon])) * (speed / 10**-0.5) ** (model.exponent or 0)
        # Each kind of data has random numbers of its own; 100 times eps and sigma are whole numbers here.
        hundredths = (round(100 * x) for x in (self.epsilon, self.sigma))
        seed = [SEED, self.viscoelastic, self.with_errors, *hundredths, self.number]
        random, words = np.random.default_rng(seed), Counter[str]()
        for _ in range(sets):
            # A measured eps cannot be negative.
            measured = np.maximum(model.epsilon(kappa) + self.sigma * random.standard_normal(self.number), 0)
            points = Points.measured(speed, measured, sigma_epsilon=self.sigma if self.with_errors else None)
            words[verdict.judged(points)[1].word] += 1
        return words


def table_of_verdicts(sets: int) -> Iterator[str]:
    """Yield the table of verdicts on made data without standard errors, and a sentence on the wrong ones.

    A row for each sigma and eps; a cell has the percentages of `sets` sets with a verdict, for all `NUMBERS` of points.
    """
    rows: list[list[str]] = []
    # Largest share of wrong verdicts on data that follow the viscoelastic law (True), and on a constant eps (False).
    wrong = {True: 0.0, False: 0.0}
    grid = list(product(SIGMAS, EPSILONS))
    for i in track(range(len(grid)), "kinds of data"):
        sigma, epsilon = grid[i]
        cells = []
        for viscoelastic in (False, True):
            counted = [Cell(viscoelastic, False, epsilon, sigma, number).verdicts(sets) for number in NUMBERS]
            for word in ("holds", "does not hold"):
                # "holds with a limit" counts as "holds".
                shares = [sum(words[w] for w in WORDS if w.startswith(word)) / sets for words in counted]
                cells.append(" / ".join(f"{100 * share:.1f}" for share in shares))
                if viscoelastic == (word == "does not hold"):
                    wrong[viscoelastic] = max(wrong[viscoelastic], *shares)
        rows.append([f"{sigma:g}", f"{epsilon:g}", *cells])
    columns = (f"{truth}: {word}" for truth, word in product(("constant", "law"), ("holds", "does not hold")))
    yield markdown(("sigma", "eps", *columns), rows)
    yield (
        f'At most {100 * wrong[False]:.1f} % of the sets with a constant eps get "holds", and at most '
        f'{100 * wrong[True]:.1f} % of the sets that follow the viscoelastic law get "does not hold".'
    )


@click.command()
@click.option("--sets", type=click.IntRange(1), default=2000, show_default=True, help="Sets of each kind of data.")
@click.option("--judged", type=click.IntRange(0), default=100, show_default=True, help="Sets whose verdict counts.")
@click.option("--verdicts", type=click.IntRange(1), help="Print the verdicts on so many made sets of a kind instead.")
def main(sets: int, judged: int, verdicts: int | None) -> None:
    """Print the rates of all kinds of data as a table in Markdown."""
    try:
        require("coverage", "scipy")
    except MissingPackage as error:
        click.echo(error, err=True)
        raise SystemExit(2) from None
    if verdicts is not None:
        click.echo("\n\n".join(table_of_verdicts(verdicts)))
        return
    pairs = [(case, errors) for case in cases() for errors in ERRORS]
    rows = []
    for i in track(range(len(pairs)), "kinds of data"):
        for rate in rates(*pairs[i], sets, judged):
            inside = (f"{100 * share:.1f} %" for share in rate.inside)
            words = (f"{100 * rate.verdicts.get(word, 0):.0f} %" for word in WORDS)
            rows.append([rate.data, rate.errors, rate.quantity, *inside, f"{100 * rate.bias:+.2f} %", *words])
    click.echo(markdown(("data", "errors", "quantity", "68 %", "95 %", "bias", *WORDS), rows))


if __name__ == "__main__":
    main()
