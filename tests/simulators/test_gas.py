"""The cooling gas: what must be conserved, what is known exactly, and simulation and quadrature against each other."""

from __future__ import annotations

import math
import re
from functools import cache, partial
from pathlib import Path

import nbformat
import numpy as np
import pytest

import viscopade as vp
from tests.kernels.speed_headers import Functions, header, named_compiler
from viscopade.approximation import half_line
from viscopade.collision.spheres import v_star
from viscopade.kernels.registry_arrays import half_line_values
from viscopade.simulators import gas
from viscopade_lab.figures import cooling

BETA = 1.307


def exact(speed):
    return vp.restitution(speed, BETA)


@cache
def constant(epsilon):
    return lambda speed: np.full_like(speed, epsilon)


elastic = constant(1.0)


@cache
def cooled(restitution, time, seed=0, particles=2000, temperature=1.0):
    return gas.cool(restitution, particles=particles, temperature=temperature, time=time, seed=seed)


def mean_and_error(values):
    return np.mean(values), np.std(values, ddof=1) / math.sqrt(len(values))


# --- what is conserved ------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("restitution", [elastic, constant(0.5), constant(0.0), exact], ids=["1", "0.5", "0", "exact"])
def test_momentum_stays_zero_and_energy_never_grows(restitution):
    found = cooled(restitution, 50.0)
    assert np.max(np.abs(found.velocities.sum(axis=0))) < 1e-11
    assert np.all(np.diff(found.temperatures) <= 4e-16 * found.temperatures[:-1])
    assert found.temperatures[-1] == pytest.approx(np.var(found.velocities, axis=0).mean(), rel=1e-12, abs=0)


def test_the_energy_lost_is_that_of_the_collisions():
    found = cooled(constant(0.7), 20.0)
    lost = (1 - 0.7**2) / 4 * np.sum(found.impact_speeds**2)
    assert 1.5 * len(found.velocities) * (1 - found.temperatures[-1]) == pytest.approx(lost, rel=1e-12)


def test_an_elastic_gas_keeps_its_temperature():
    found = cooled(elastic, 20.0)
    assert np.all(np.abs(found.temperatures - 1) < 1e-12)


def test_starts_at_the_temperature_asked_for():
    found = cooled(exact, 1.0, temperature=2.5)
    assert found.temperatures[0] == pytest.approx(2.5, rel=1e-14, abs=0)
    assert found.times[0] == found.collisions[0] == 0


# --- how often and how fast -------------------------------------------------------------------------------------------


def test_an_elastic_gas_collides_once_per_mean_collision_time():
    found = cooled(elastic, 20.0, particles=4000)
    number = len(found.impact_speeds)
    assert found.collisions[-1] == 2 * number / 4000
    assert number == pytest.approx(20 * 4000 / 2, abs=4 * math.sqrt(20 * 4000 / 2))


def test_impact_speeds_of_a_gas_in_equilibrium():
    speeds = np.sort(cooled(elastic, 20.0, particles=4000, temperature=2.5).impact_speeds)
    distribution = 1 - np.exp(-(speeds**2) / (4 * 2.5))
    number = len(speeds)
    distance = np.max(np.abs(distribution - (np.arange(number) + 0.5) / number))
    assert distance * math.sqrt(number) < 1.63  # Kolmogorov: exceeded by 1 % of samples
    assert np.mean(speeds**2) == pytest.approx(4 * 2.5, rel=4 / math.sqrt(number))


def test_velocities_stay_maxwellian_and_isotropic_in_equilibrium():
    found = cooled(elastic, 20.0, particles=4000)
    assert abs(np.mean(found.sonine[10:])) < 0.03
    assert np.var(found.velocities, axis=0) == pytest.approx(np.ones(3), abs=4 * math.sqrt(2 / 4000))


def test_collisions_follow_the_temperature():
    found = cooled(exact, 1e4)
    steps = np.diff(found.times) * (np.sqrt(found.temperatures[1:]) + np.sqrt(found.temperatures[:-1])) / 2
    assert found.collisions[-1] == pytest.approx(steps.sum(), rel=0.02)


def test_mean_collision_time():
    assert gas.mean_collision_time(2.0, 3.0, 0.5) == pytest.approx(1 / (4 * math.sqrt(math.pi * 2) * 3 * 0.25))


# --- constant eps -----------------------------------------------------------------------------------------------------


def sonine_of(epsilon):
    """a_2 of the cooling state (van Noije & Ernst 1998)."""
    return 16 * (1 - epsilon) * (1 - 2 * epsilon**2) / (81 - 17 * epsilon + 30 * epsilon**2 * (1 - epsilon))


@pytest.mark.parametrize("epsilon", [0.3, math.sqrt(0.5), 0.9])
def test_haffs_law(epsilon):
    runs = [cooled(constant(epsilon), 300.0, seed=seed) for seed in range(6)]
    rates = []
    for run in runs:
        root = run.temperature_at([60.0, 300.0]) ** -0.5
        rates.append((root[1] - root[0]) / 240 / ((1 - epsilon**2) / 6))
    rate, error = mean_and_error(rates)
    assert error < 0.01
    assert rate == pytest.approx(1 + 3 / 16 * sonine_of(epsilon), abs=4 * error)
    late = [np.mean(run.sonine[run.collisions > 8]) for run in runs]
    assert np.mean(late) == pytest.approx(sonine_of(epsilon), abs=0.02)


@pytest.mark.parametrize("epsilon", [0.0, 0.3, 0.9, 1.0])
def test_quadrature_gives_haffs_law(epsilon):
    times = np.array([0.0, 0.0, 0.01, 3.0, 3.0, 1e3, 1e9])
    found = gas.maxwellian(constant(epsilon), times, temperature=7.0)
    assert found == pytest.approx(7.0 / (1 + times * (1 - epsilon**2) / 6) ** 2, rel=1e-8, abs=0)


# --- viscoelastic spheres ---------------------------------------------------------------------------------------------


@pytest.mark.parametrize("temperature", [1e-12, 1e-3, 1.0, 50.0])
def test_loss_by_another_quadrature(temperature):
    u, h = np.linspace(-80, 5, 85001, retstep=True)
    u = np.exp(u)
    star = v_star(np.sqrt(4 * temperature * u), BETA)
    terms = vp.one_minus_epsilon(star) * (1 + vp.epsilon(star)) * u**2 * np.exp(-u)
    assert gas.loss(exact, temperature) == pytest.approx(h * terms.sum(), rel=1e-12, abs=0)


def test_loss_has_the_shape_of_the_temperatures():
    given = np.array([[1e-3, 1.0, 4.0]])
    found = gas.loss(exact, given)
    assert found.shape == (1, 3)
    assert found[0, 1] == pytest.approx(gas.loss(exact, 1.0), rel=1e-14, abs=0)
    assert gas.loss(constant(0.6), 3.0) == pytest.approx(0.64, rel=1e-12, abs=0)


def test_the_quadratures_steps_are_small_enough(monkeypatch):
    times = np.array([1.0, 1e2, 1e4, 1e8])
    found = gas.maxwellian(exact, times)
    monkeypatch.setattr(gas, "_LARGEST_STEP", 0.005)
    assert found == pytest.approx(gas.maxwellian(exact, times), rel=1e-8, abs=0)


@pytest.mark.parametrize("time", [1.0, 10.0, 100.0])
def test_simulation_and_quadrature_agree(time):
    expected = gas.maxwellian(exact, np.array([time]))[0]
    ratio, error = mean_and_error([cooled(exact, 100.0, seed).temperature_at(time) / expected for seed in range(6)])
    assert error < 0.012
    assert ratio == pytest.approx(1, abs=4 * error + 0.005)  # velocities are not quite Maxwellian


@pytest.mark.parametrize(("restitution", "slope"), [(exact, None), (constant(0.5), -2.0)], ids=["exact", "constant"])
def test_late_slopes(restitution, slope):
    times = np.geomspace(1e4, 1e7, 13)
    found = np.polyfit(np.log(times), np.log(cooled(restitution, 1e7, particles=1000).temperature_at(times)), 1)[0]
    expected = np.polyfit(np.log(times), np.log(gas.maxwellian(restitution, times)), 1)[0]
    assert found == pytest.approx(expected, abs=0.02)
    if slope is None:
        assert -1.8 < expected < -5 / 3
    else:
        assert expected == pytest.approx(slope, abs=1e-3)


# --- randomness -------------------------------------------------------------------------------------------------------


def test_the_same_seed_gives_the_same_bits_and_another_one_does_not():
    first, again, other = (gas.cool(exact, particles=500, time=20, seed=seed) for seed in (3, 3, 4))
    for name in ("times", "temperatures", "collisions", "sonine", "impact_speeds", "velocities"):
        assert np.array_equal(getattr(first, name), getattr(again, name))
    assert not np.array_equal(first.temperatures, other.temperatures)


def test_units_do_not_matter():
    one = gas.cool(exact, particles=500, time=20)
    other = gas.cool(lambda speed: exact(speed / 2), particles=500, time=20, temperature=4.0)
    assert np.array_equal(one.temperatures * 4, other.temperatures)
    assert np.array_equal(one.times, other.times)


def test_gases_with_nearly_the_same_eps_stay_close_for_some_collisions():
    near = gas.cool(lambda speed: exact(speed) * (1 - 1e-9), collisions=5)
    far = gas.cool(lambda speed: exact(speed) * (1 - 1e-2), collisions=5)
    true = gas.cool(exact, collisions=5)
    at = np.linspace(0, 5, 6)
    assert near.temperature_at(at) == pytest.approx(true.temperature_at(at), rel=1e-7)
    assert not np.allclose(far.temperature_at(at)[1:], true.temperature_at(at)[1:], rtol=1e-3, atol=0)


def test_waves_are_disjoint_complete_and_in_order():
    random = np.random.default_rng(1)
    first, second = random.integers(20, size=(2, 300))
    second = (first + 1 + second % 19) % 20
    last, seen = np.full(20, -1), []
    for wave in gas.waves(first, second, 20):
        members = np.concatenate([first[wave], second[wave]])
        assert len(set(members)) == len(members)
        assert np.all(last[members] < np.concatenate([wave, wave]))
        last[members] = np.concatenate([wave, wave])
        seen += wave.tolist()
    assert sorted(seen) == list(range(300))


def test_waves_give_what_one_collision_after_the_other_gives(monkeypatch):
    together = gas.cool(exact, particles=100, time=10)
    monkeypatch.setattr(gas, "waves", lambda first, second, particles: np.arange(len(first))[:, None])
    alone = gas.cool(exact, particles=100, time=10)
    assert np.array_equal(together.velocities, alone.velocities)
    assert np.array_equal(together.temperatures, alone.temperatures)
    assert len(together.impact_speeds) > 100


# --- ends and interpolation -------------------------------------------------------------------------------------------


def test_ends_at_the_time_or_after_the_collisions():
    assert gas.cool(exact, particles=100, time=3.25).times[-1] == 3.25
    found = gas.cool(exact, particles=100, collisions=3)
    assert found.collisions[-2] < 3 <= found.collisions[-1] < 3.6
    nothing = gas.cool(exact, particles=100, time=0)
    assert len(nothing.times) == 1
    assert nothing.impact_speeds.shape == (0,)


def test_temperature_between_the_recorded_times():
    found = cooled(constant(0.5), 100.0)
    assert found.temperature_at(found.times) == pytest.approx(found.temperatures, rel=1e-14, abs=0)
    middle = (found.times[1:] + found.times[:-1]) / 2
    between = found.temperature_at(middle)
    assert np.all(between <= found.temperatures[:-1])
    assert np.all(between >= found.temperatures[1:])
    with pytest.raises(ValueError, match=r"times is 100\.5: accepted is a number from 0 to 100\.0"):
        found.temperature_at(np.array([1.0, 100.5]))


def test_cools_until_double_precision_ends_and_says_so():
    with pytest.raises(ValueError, match="the temperature falls below 1e-290: accepted is an earlier end"):
        gas.cool(constant(0.5), particles=10, temperature=1e-280, time=1e30)


# --- bad input --------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("kind", "message", "changed"),
    [
        (TypeError, "neither given, accepted is exactly one", {"time": None}),
        (TypeError, "both given, accepted is exactly one", {"collisions": 1}),
        (ValueError, "time is -1: accepted is a finite number >= 0", {"time": -1}),
        (ValueError, "time is inf", {"time": math.inf}),
        (ValueError, "collisions is nan", {"time": None, "collisions": math.nan}),
        (ValueError, "particles is 9: accepted is an integer >= 10", {"particles": 9}),
        (TypeError, "particles is 10.0", {"particles": 10.0}),
        (TypeError, "particles is True", {"particles": True}),
        (ValueError, "temperature is 0: accepted is a finite number > 0", {"temperature": 0}),
        (TypeError, "temperature is '1'", {"temperature": "1"}),
        (ValueError, "seed is -1: accepted is an integer >= 0", {"seed": -1}),
        (TypeError, "seed is None", {"seed": None}),
        (ValueError, r"returns 1\.1 at speed .*: accepted is 0 <= eps <= 1", {"restitution": constant(1.1)}),
        (ValueError, r"returns -0\.1 at", {"restitution": constant(-0.1)}),
        (ValueError, "returns nan at", {"restitution": constant(math.nan)}),
        (ValueError, r"of shape \(\) for speeds of shape", {"restitution": lambda speed: np.float64(0.5)}),
        (ValueError, "accepted is an array of eps", {"restitution": lambda speed: np.ones_like(speed, dtype=int)}),
    ],
)
def test_bad_input(kind, message, changed):
    given = {"restitution": exact, "particles": 10, "time": 1} | changed
    with pytest.raises(kind, match=message) as caught:
        gas.cool(given.pop("restitution"), **given)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("kind", "message", "call"),
    [
        (
            ValueError,
            "times is .*: accepted is a one-dimensional array",
            lambda: gas.maxwellian(exact, np.array([2, 1])),
        ),
        (ValueError, "accepted is a one-dimensional", lambda: gas.maxwellian(exact, np.ones((2, 2)))),
        (ValueError, "times is -1", lambda: gas.maxwellian(exact, np.array([-1.0]))),
        (ValueError, "temperature is -1", lambda: gas.maxwellian(exact, np.array([1.0]), temperature=-1)),
        (ValueError, "nodes is 0", lambda: gas.loss(exact, 1.0, nodes=0)),
        (ValueError, "temperature is 0", lambda: gas.loss(exact, np.array([1.0, 0.0]))),
        (ValueError, "returns 2.0 at", lambda: gas.loss(constant(2.0), 1.0)),
        (ValueError, "diameter is 0", lambda: gas.mean_collision_time(1, 1, 0)),
        (ValueError, "number_density is inf", lambda: gas.mean_collision_time(1, math.inf, 1)),
        (ValueError, "temperature is 0", lambda: gas.mean_collision_time(0, 1, 1)),
    ],
)
def test_bad_input_elsewhere(kind, message, call):
    with pytest.raises(kind, match=message) as caught:
        call()
    assert "\n" not in str(caught.value)


# --- the kernel of speed ----------------------------------------------------------------------------------------------


def test_the_kernel_of_the_figure_is_that_of_the_header(tmp_path):
    functions = Functions(tmp_path, [header("1e-3")], named_compiler("cc", "c99"))

    def compiled(speed):
        return functions("array", "restitution", header("1e-3"), speed, np.array(BETA))

    given = cooling.kernel_restitution("1e-3")
    speeds = np.geomspace(1e-35, 1e35, 100001)
    assert given(speeds) == pytest.approx(compiled(speeds), rel=1e-12, abs=0)
    one, other = (gas.cool(f, particles=500, time=3.0) for f in (given, compiled))
    assert one.temperatures == pytest.approx(other.temperatures, rel=1e-10)


def test_errors_of_the_kernel_are_what_it_promises():
    speeds = np.geomspace(1e-12, 10, 100001)
    star = v_star(speeds, BETA)
    error = np.abs(cooling.kernel_restitution("1e-3")(speeds) - vp.epsilon(star))
    assert np.max(error / np.minimum(vp.epsilon(star), vp.one_minus_epsilon(star))) < 4.1e-4


# --- what is written about it -----------------------------------------------------------------------------------------

ROOT = Path(__file__).parents[2]


@cache
def written():
    """Texts of the documentation and of the notebook's cells and outputs."""
    notebook = nbformat.read(ROOT / "notebooks" / "06_granular_gas.ipynb", as_version=4)
    cells = [cell.source for cell in notebook.cells]
    shown = [output.get("text", "") for cell in notebook.cells for output in cell.get("outputs", [])]
    return (ROOT / "docs" / "results" / "gas.md").read_text(encoding="utf-8"), "\n".join([*cells, *shown])


def test_documented_numbers_are_those_of_the_notebook():
    docs, notebook = written()
    for found in re.findall(r"-\d\.\d+ \+- \d\.\d+", docs):
        assert found in notebook
    for label, name in (
        ("constant eps, right at the start", "constant"),
        ("the paper's [1/4]", "[1/4]"),
        ("the paper's [3/6]", "[3/6]"),
        ("kernel of speed, 1e-3", "kernel 1e-3"),
        ("kernel of speed, 1e-5", "kernel 1e-5"),
    ):
        (row,) = re.findall(rf"\| {re.escape(label)} \|(.*)\|", docs)
        (line_shown,) = re.findall(rf"^ *{re.escape(name)} +((?:-?\d+e[+-]\d+ *){{5}})$", notebook, re.MULTILINE)
        assert [float(number) for number in row.split("|")] == [float(number) for number in line_shown.split()]


def test_written_terms_of_the_slope():
    h = vp.series(6, 20).floats()
    first, second, third = (
        term * math.gamma(2 + k / 20) for k, term in ((2, -2 * h[2]), (4, -2 * h[4] - h[2] ** 2), (5, -2 * h[5]))
    )
    for text in written():
        assert f"{-second / first / 5:.4f}" in text
        assert f"{-third / first / 3:.4f}" in text


def test_a_kernel_that_is_good_in_epsilon_only_is_not_good_for_a_slow_gas():
    late = np.array([1e10])
    errors = {}
    for measure, powers in (("relative", half_line.RELATIVE[0]), ("both", half_line.BOTH[1])):  # to 1e-3
        quotient = half_line.fit_half_line(powers, measure).quotient
        of = partial(half_line_values, powers, *(tuple(map(float, part)) for part in (quotient.a, quotient.b)))
        found = gas.maxwellian(lambda v, of=of: np.minimum(of(v_star(v, BETA))[0], 1), late)
        errors[measure] = float(np.abs(found / gas.maxwellian(exact, late) - 1)[0])
    assert f"{errors['relative']:.0e}" == "4e-03"
    assert "4e-3 at $t$ = 1e10" in written()[0]
    assert errors["both"] < 1e-3
