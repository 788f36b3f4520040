"""What the headers state of v* = sqrt(beta) pow(speed, 0.1): computed as they compute it, and eps there."""

import math
import random
import re
from fractions import Fraction
from pathlib import Path

import pytest
from mpmath import mp, mpf, workdps

from tests.compiled import build
from viscopade.arithmetic.decimals import at_most
from viscopade.arithmetic.formats import DOUBLE, FLOAT
from viscopade.collision import exact
from viscopade.kernels.v_star import USUAL, of_v_star

EXPORTS = Path(__file__).parents[2] / "exports"
FILES = (
    "viscopade_pade.h",
    "viscopade_pade.py",
    "viscopade_minimax.h",
    "viscopade_minimax.py",
)
# The speed and beta of a file for v* <= 0.5 whose other errors are 8.5e-16 in all.
FOUND = (1.3312625370939427e270, 2.352719384662437e-55)
OTHER_ERRORS = 8.5e-16


@pytest.fixture(scope="module")
def library(tmp_path_factory):
    return build(tmp_path_factory.mktemp("v_star"), [(EXPORTS / "viscopade_minimax.h").read_text()], "c99")


def change_of_eps(library, form, speed, beta):
    """Return by what part of min(eps, 1 - eps) the computed v* changes eps."""
    computed = Fraction(library[f"v_star{form.suffix}"](speed, beta))
    with workdps(60):
        true = Fraction(str(mp.sqrt(mpf(beta)) * mp.root(mpf(speed), 10)))
    at, at_computed = (exact.collision(v_star, 24) for v_star in (true, computed))
    differences = [
        Fraction(at_computed.decimals()[name]) / Fraction(at.decimals()[name]) - 1
        for name in ("epsilon", "one_minus_epsilon")
    ]
    return float(max(map(abs, differences)))


def draws(form, largest, number, seed):
    """Yield speeds at both ends of a range and within it, with a beta for v* from 1e-3 to 1e3, numbers of the type."""
    draw = random.Random(seed)
    end = math.log10(largest)
    for i in range(number):
        exponent = draw.choice((-1, 1)) * (end if i % 2 else draw.uniform(0, end)) * (1 - 1e-9)
        speed = float(form.nearest(Fraction(10**exponent)))
        v_star = 10 ** draw.uniform(-3, 3)
        beta = v_star**2 / speed**0.2
        yield speed, form.nearest(Fraction(beta))


def test_a_large_speed_is_off_by_more_than_the_other_errors(library):
    """So these headers need a bound of their own for functions of the speed."""
    change = change_of_eps(library, DOUBLE, *FOUND)
    assert 2 * OTHER_ERRORS < change <= of_v_star()


@pytest.mark.parametrize(("form", "largest"), [(DOUBLE, 1e30), (DOUBLE, 1e307), (FLOAT, 1e30), (FLOAT, 1e37)])
def test_eps_changes_by_no_more_than_stated(library, form, largest):
    bound = of_v_star(form, USUAL if largest == 1e30 else None)
    changes = [change_of_eps(library, form, *given) for given in draws(form, largest, 12, seed=5)]
    assert max(changes) <= bound
    assert max(changes) > bound / 8  # pow is far better than it is assumed to be, but not its exponent 0.1


def test_the_usual_speeds_have_a_smaller_bound():
    for form in (DOUBLE, FLOAT):
        assert of_v_star(form, Fraction(1)) < of_v_star(form, USUAL) < of_v_star(form)
    assert of_v_star(DOUBLE, USUAL) < of_v_star(DOUBLE) / 3


@pytest.mark.parametrize("name", FILES)
def test_files_state_it(name):
    """Every file that has functions of the speed states the bounds, of its types only."""
    text = " ".join(re.sub(r"^( \*|#) ?", "", (EXPORTS / name).read_text(), flags=re.MULTILINE).split())
    usual, every = re.search(
        r"rounding of v\* changes eps, relative to min\(eps, 1 - eps\), by at most (.*?) for 1e-30 <= speed <= 1e30, "
        r"and by at most (.*?) for every other speed \(proven\)",
        text,
    ).groups()
    forms = (DOUBLE, FLOAT) if name.endswith(".h") else (DOUBLE,)
    for stated, largest in ((usual, USUAL), (every, None)):
        assert stated == " and ".join(f"{at_most(of_v_star(f, largest), 2)} in type {f.name}" for f in forms)
    assert "the results of" in text
    assert "within 4 units in the last place" in text
