"""The rows of a deck, against closed forms and SciPy."""

import math
from pathlib import Path

import pytest
from scipy.integrate import solve_ivp

from viscopade.simulators import simulator_of
from viscopade.simulators.deck import Deck, DeckContact, DeckRun, Line, Size
from viscopade.simulators.deck_rows import TOO_DEEP, contact_rows
from viscopade.simulators.native import FileUnits, delivery

LINE = Line(Path("in.x"), 7, "pair_coeff 1 1 ...")
HOOKE = {"normal": "hooke", "coefficients": "1e5 0.5", "damping": "coeff_restitution", "limit_damping": "yes"}
SI = {"units": "si"}
CGS = FileUnits("cm", "g", "s", 1e-2, 1e-3)


def contact(settings, *sizes, name="type 1 - type 1", falls=False, **more):
    return DeckContact(name, LINE, settings, sizes, falls, **more)


def deck(*runs, units=None, program="lammps"):
    return Deck(simulator_of(program), Path("in.x"), units or FileUnits(), runs)


def run(*contacts, step=None, gravity=0.0):
    return DeckRun(None, step, gravity, contacts)


BEAD, BALL = Size(1e-3, 1e-5), Size(2e-3, 8e-5)


def test_a_linear_contact_of_two_spheres():
    """Design 2.9, nu = 2: asked for by exp(-pi zeta/w) = 0.5, delivered exp(-zeta (pi - 2 asin zeta)/w)."""
    (row,) = contact_rows(deck(run(contact(HOOKE | SI, (BEAD, BALL)))), 1.0)
    zeta = math.log(2) / math.hypot(math.pi, math.log(2))
    eps = math.exp(-zeta * (math.pi - 2 * math.asin(zeta)) / math.sqrt(1 - zeta**2))
    mass = 1e-5 * 8e-5 / 9e-5
    assert row.answer.collision.epsilon == pytest.approx(eps, rel=1e-9)
    assert (row.impact.mass, row.impact.radius, row.radii) == (pytest.approx(mass), None, (1e-3, 2e-3))
    assert row.answer.contact_time == pytest.approx(math.pi * math.sqrt(mass / 1e5))
    assert (row.answer.falling, row.steps, row.g_t_c_over_v) == (None, None, None)


@pytest.mark.parametrize(("speed", "is_too_deep"), [(180.0, True), (140.0, False)])
@pytest.mark.parametrize(("units", "name", "length"), [(FileUnits(), "si", 1.0), (CGS, "cgs", 100.0)])
def test_an_overlap_beyond_the_radius_is_a_warning(speed, is_too_deep, units, name, length):
    """Of an undamped linear contact it is v sqrt(m/k): 1 mm at 157 m/s, for m = 1e-5*8e-5/9e-5 kg and k = 2.2e5 N/m."""
    k = 157**2 * (8e-5 / 9) / 1e-3**2 * (1e3 if name == "cgs" else 1)  # 1 N/m is 1000 dyn/cm
    settings = {"normal": "hooke", "coefficients": f"{k!r} 0", "damping": "velocity", "units": name}
    sizes = [Size(size.radius * length, size.mass / units.kilograms) for size in (BEAD, BALL)]
    (row,) = contact_rows(deck(run(contact(settings, tuple(sizes))), units=units), speed * length)
    assert (TOO_DEEP in row.answer.warnings) == is_too_deep


def test_weight_and_time_steps_at_a_wall():
    k, c, m, g, v, step = 1e5, 1.0, 8e-5, 9.81, 0.02, 1e-5
    settings = SI | {"normal": "hooke", "coefficients": f"{k} {c}", "damping": "velocity", "limit_damping": "yes"}
    wall = contact(settings, (BALL, None), falls=True)
    (fine,), (stepped,) = (contact_rows(deck(run(wall, gravity=g, step=h)), v) for h in (None, step))

    def acceleration(x, rate):
        return -max(0.0, k * x + c * rate) / m * (x > 0)

    def back(_, y):
        return y[0]

    back.terminal, back.direction = True, -1
    # Lengths of 1e-6 m need small tolerances.
    exact = {"events": back, "rtol": 1e-10, "atol": 1e-14, "max_step": 2e-6}
    solution = solve_ivp(lambda _, y: (y[1], g + acceleration(*y)), (0, 1e-3), (0, v), **exact)
    assert fine.answer.falling.epsilon == pytest.approx(-solution.y[1, -1] / v, abs=1e-6)
    t_c = math.pi * math.sqrt(m / k)
    assert fine.g_t_c_over_v == pytest.approx(g * t_c / v, rel=1e-6)
    assert stepped.steps == pytest.approx(t_c / step, rel=1e-6)

    # LAMMPS: the force of the newest state, then a drift. Contact begins at some phase of a step.
    rebounds = []
    for i in range(1000):
        x, rate = -(i + 0.5) / 1000 * step * v, v
        x += step * rate
        while x > 0:
            rate += step * acceleration(x, rate)
            x += step * rate
        rebounds.append(-rate / v)
    collision = stepped.answer.collision
    assert (collision.least, collision.largest) == pytest.approx((min(rebounds), max(rebounds)), abs=2e-4)
    assert collision.epsilon == pytest.approx(sum(rebounds) / len(rebounds), abs=2e-3)


def test_numbers_are_in_the_units_of_the_file():
    si = contact(HOOKE | SI, (BEAD, None), falls=True)
    # 1 N/m = 1000 dyn/cm; 10 us, 1 mm, 1e-5 kg
    cgs = contact(HOOKE | {"units": "cgs", "coefficients": "1e8 0.5"}, (Size(0.1, 0.01), None), falls=True)
    (one,) = contact_rows(deck(run(si, step=1e-5, gravity=9.81)), 0.1)
    (other,) = contact_rows(deck(run(cgs, step=1e-5, gravity=981), units=CGS), 10.0)
    assert other.answer.falling.epsilon == pytest.approx(one.answer.falling.epsilon, rel=1e-9)
    assert (other.steps, other.g_t_c_over_v) == pytest.approx((one.steps, one.g_t_c_over_v))
    assert (other.impact.mass, other.radii) == (0.01, (0.1,))
    # LIGGGHTS's parameters are in SI units; sizes, step and gravity are in those of the file.
    steel = {"model": "hertz", "youngsModulus": "1e7", "poissonsRatio": "0.3", "coefficientRestitution": "0.5"}
    kinds = (BEAD, FileUnits(), 1e-5, 1.0), (Size(0.1, 0.01), CGS, 1e-5, 100.0)
    first, second = (
        contact_rows(deck(run(contact(steel, (size, size)), step=step), units=units, program="liggghts"), v)[0]
        for size, units, step, v in kinds
    )
    assert second.steps == pytest.approx(first.steps)
    assert second.answer.collision.epsilon == pytest.approx(first.answer.collision.epsilon)


def test_sizes_that_do_not_matter_are_one_row():
    solref = contact({"solref": "-2500 -20"}, (BEAD, BEAD), (BEAD, BALL), (BALL, BALL), name="a - b", count=12)
    (row,) = contact_rows(deck(run(solref), program="mujoco"), 1.0)
    assert (row.radii, row.impact.mass, row.contact.count) == ((), None, 12)
    # coeff_restitution: eps does not depend on the mass, but the duration does.
    three = contact(HOOKE | SI, (BEAD, BEAD), (BEAD, BALL), (BALL, BALL))
    assert [row.radii for row in contact_rows(deck(run(three)), 1.0)] == [(1e-3, 1e-3), (1e-3, 2e-3), (2e-3, 2e-3)]


def test_what_to_write_instead():
    """Design 2.9, nu = 2: the number e whose exp(-pi zeta/w) = e gives eps = 0.5 with the end "force"."""
    lines = contact(HOOKE | SI, (BEAD, BEAD), lines_with=lambda texts: (f"pair_coeff 1 1 {texts['coefficients']}",))
    (row,) = contact_rows(deck(run(lines)), 1.0, 0.5)
    e = float(row.contact.lines_with(row.answer.instead)[0].split()[-1])
    zeta = -math.log(e) / math.hypot(math.pi, math.log(e))
    assert math.exp(-zeta * (math.pi - 2 * math.asin(zeta)) / math.sqrt(1 - zeta**2)) == pytest.approx(0.5, abs=1e-7)


def test_later_runs_have_the_rows_that_differ():
    pair, wall = contact(HOOKE | SI, (BEAD, BEAD)), contact(HOOKE | SI, (BEAD, None), name="type 1 - wall", falls=True)
    other = contact(HOOKE | SI | {"coefficients": "1e5 0.9"}, (BEAD, BEAD))
    runs = run(pair, wall), run(pair, wall, gravity=9.81), run(other, wall, gravity=9.81), run(pair, wall, step=1e-6)
    shown = [(runs.index(row.run), row.contact.name) for row in contact_rows(deck(*runs), 1.0)]
    both = ["type 1 - type 1", "type 1 - wall"]
    assert shown == [(0, both[0]), (0, both[1]), (1, both[1]), (2, both[0]), (3, both[0]), (3, both[1])]


def test_a_contact_without_a_number_leaves_the_others():
    bad = contact(HOOKE | SI | {"damping": "none"}, (BEAD, BEAD), (BEAD, BALL), name="bad")
    jkr = contact({}, (BEAD, BEAD), (BALL, BALL), name="jkr", reason="jkr is not computed")
    good = contact(HOOKE | SI, (BEAD, BEAD))
    # The later run has another time step, which makes a difference to the third contact only.
    first, second, third, later = contact_rows(deck(run(jkr, bad, good), run(jkr, bad, good, step=1e-6)), 1.0)
    assert (first.answer.reason, first.answer.collision) == ("jkr is not computed", None)
    assert second.answer.reason.startswith("damping is 'none': expected velocity")
    assert third.answer.collision is not None
    assert (later.contact, later.steps) == (good, pytest.approx(math.pi * math.sqrt(5e-6 / 1e5) / 1e-6))


def test_equal_collisions_are_computed_once(monkeypatch):
    """Four pairs, in two runs whose gravity does not matter to them."""
    computed = []

    def counted(*arguments, **options):
        computed.append(arguments)
        return delivery(*arguments, **options)

    monkeypatch.setattr("viscopade.simulators.deck_rows.delivery", counted)
    pairs = [contact(HOOKE | SI, (BALL, BALL), name=name) for name in ("1 - 1", "1 - 2", "2 - 1", "2 - 2")]
    assert len(contact_rows(deck(run(*pairs), run(*pairs, gravity=9.81)), 1.0)) == 4
    assert len(computed) == 1
