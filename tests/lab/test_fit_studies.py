"""The studies of fits: rates on a case whose answer is known, the examples."""

import re
from pathlib import Path

import numpy as np
import pytest

import viscopade as vp
from tests.simulators.two_balls import need
from viscopade import Points
from viscopade.arrays import double
from viscopade.fitting import read
from viscopade.fitting.read import Options
from viscopade_lab.figures.paper import FIT_EXPONENT, FIT_SPEEDS
from viscopade_lab.runs import fit_data
from viscopade_lab.studies import coverage

ROOT = Path(__file__).parents[2]
SPEED = np.geomspace(0.05, 3, 12)


def case(truth):
    """Return data with beta = 0.09, of which `truth` is said to be the true value."""

    def made(random, errors):
        epsilon = double.epsilon(np.sqrt(0.09) * SPEED**0.1) + 0.005 * errors(random, 12)
        return Points.measured(SPEED, epsilon, sigma_epsilon=0.005)

    return coverage.Case("synthetic", made, {"beta": truth})


def test_rates_of_a_right_interval_and_of_a_wrong_truth():
    (right,) = coverage.rates(case(0.09), "Gaussian", 100, 3)
    assert 0.5 < right.inside[0] < 0.85
    assert right.inside[1] > 0.87
    assert abs(right.bias) < 0.01
    assert sum(right.verdicts.values()) == pytest.approx(1)
    (wrong,) = coverage.rates(case(0.12), "Gaussian", 20, 0)
    assert wrong.inside == (0.0, 0.0)


def test_verdicts_on_made_data_are_rarely_wrong():
    """Sampled, one kind of data; all are in the next test."""
    constant, law = (coverage.Cell(viscoelastic, False, 0.9, 0.01, 5).verdicts(20) for viscoelastic in (False, True))
    assert max(constant["holds"] + constant["holds with a limit"], law["does not hold"]) <= 1
    assert min(constant["does not hold"], law["holds"]) > 8


@pytest.mark.slow
def test_wrong_verdicts_on_made_data_are_five_per_cent_at_most():
    *_, sentence = coverage.table_of_verdicts(400)
    assert max(map(float, re.findall(r"([0-9.]+) %", sentence))) <= 5


@pytest.mark.parametrize("errors", coverage.ERRORS)
def test_errors_have_mean_0_and_variance_1(errors):
    sample = coverage.ERRORS[errors](np.random.default_rng(1), 200_000)
    assert sample.mean() == pytest.approx(0, abs=0.01)
    assert sample.std() == pytest.approx(1, rel=0.02)
    skewness = float(np.mean(sample**3))
    assert (skewness < -1) == (errors == "skewed")


def test_the_example_is_what_lammps_gives():
    need("lammps")
    committed = (ROOT / "examples" / "collisions.csv").read_bytes()
    ours, theirs = (
        read.recording([(text, "x.csv")]).points for text in (fit_data.example("collisions").encode(), committed)
    )
    assert ours.epsilon == pytest.approx(theirs.epsilon, abs=2e-3)
    assert ours.contact_time == pytest.approx(theirs.contact_time, rel=2e-3)
    assert pytest.approx(0.0899230777771491) == fit_data.PAIR_BETA


def test_the_drop_has_the_true_beta_within_its_error():
    """True by LAMMPS's own constants: eta, K, the radius and the mass."""
    import viscopade as vp
    from viscopade.fitting.flight import Flight

    ball = coverage._ball()
    wall = vp.Sphere.wall(young_modulus=ball.young_modulus, poisson_ratio=0, dissipative_constant=0)
    contact = vp.Pair(ball, wall)
    options = Options(flight=Flight(fit_data.GRAVITY), resolution="0.5 ms", contact_time=contact)
    found = vp.fit(read.recording([((ROOT / "examples" / "drop.csv").read_bytes(), "drop.csv")], options).points)
    assert abs(found.beta - fit_data.WALL_BETA) < 3 * found.beta_standard_error


def test_published_curves_of_ice_have_the_verdicts_of_the_page():
    """The same numbers as on the page, at the speeds that the figure of ice has."""
    page = (Path(__file__).parents[2] / "docs" / "results" / "fit.md").read_text("utf-8")
    rows = re.findall(r"^\| ice.* factor (\S+), .* \| (.*) \| (\S+) to (\S+) \|$", page, re.MULTILINE)
    assert len(rows) == 2
    speed = np.geomspace(*FIT_SPEEDS, 24)
    for factor, word, *ends in rows:
        epsilon = np.minimum(float(factor) * speed**FIT_EXPONENT, 1)
        verdict = vp.fit(vp.Points.measured(speed / 100, epsilon, sigma_epsilon=np.full(24, 0.02))).verdict
        assert verdict.word == word
        assert f"from {ends[0]} to {ends[1]} (95 %)" in " ".join(verdict.reasons)
