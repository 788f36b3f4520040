"""Tracks of a ball whose speeds and eps are known: made of exact flights, noise and drag, 200 frames per second."""

import re
from pathlib import Path

import numpy as np
import pytest

from viscopade.arrays import double
from viscopade.fitting import read
from viscopade.fitting.bounces import TooFew
from viscopade.fitting.flight import Flight
from viscopade.fitting.read import Options
from viscopade.fitting.tracks import of_track

DATA = Path(__file__).with_name("data")
RATE, NOISE, BETA, CONTACTS = 200, 1e-3, 0.2, 5
FLIGHTS = {"vacuum": Flight(), "air": Flight.of_sphere(0.02, 84.0, air_density=1.2)}


def law(speed):
    return float(double.epsilon(BETA**0.5 * speed**0.1))


def track(random, flight, *, held=0.2, height=1.0, duration=0.0):
    """Return times and heights of frames, and the speeds and eps of all contacts.

    The ball is held, falls, and is caught before it would bounce once more.
    """
    fine = np.linspace(0, 2, 20_001)
    start = held + np.interp(height, flight.fall(fine)[0], fine)
    parts, speed = [(held, start, held, height)], float(flight.impact(flight.launch_to(np.array([height])))[0])
    speeds, epsilon = [], []
    for _ in range(CONTACTS):
        speeds.append(speed)
        epsilon.append(law(speed))
        launch = np.array([speed * epsilon[-1]])
        start += duration
        end = start + float(flight.duration(launch)[0])
        rise = np.interp(-launch[0], flight.fall(-fine[::-1])[1], -fine[::-1])
        parts.append((start, end, start - rise, float(flight.fall(np.array([rise]))[0][0])))
        start, speed = end, float(flight.impact(launch)[0])
    time = np.arange(0, end - 0.1, 1 / RATE)
    true = np.where(time < held, height, 0.0)
    for begin, end, apex, top in parts:
        inside = (time >= begin) & (time < end)
        true[inside] = top - flight.fall(time[inside] - apex)[0]
    return time, true + NOISE * random.standard_normal(len(time)), np.array(speeds), np.array(epsilon)


def labels(time):
    return [f"line {k}" for k in range(len(time))]


@pytest.mark.parametrize("number", [40, pytest.param(300, marks=pytest.mark.slow)])
@pytest.mark.parametrize("duration", [0.0, 0.008])
@pytest.mark.parametrize("air", FLIGHTS)
def test_intervals_hold_the_true_speeds_and_eps(air, duration, number):
    random, flight = np.random.default_rng(4), FLIGHTS[air]
    off = []
    for _ in range(number):
        time, height, speed, epsilon = track(random, flight, held=0.3 * random.random(), duration=duration)
        found = of_track(time, height, labels(time), flight, contact_time=duration).points
        errors = np.sqrt((found.speed_errors.toarray() ** 2).sum(axis=1))
        off.append([(found.speed - speed) / errors, (found.epsilon - epsilon) / found.standard_errors])
    for each in np.moveaxis(np.abs(off), 1, 0):
        slack = 3 / np.sqrt(each.size / 2)  # two neighbours share a flight
        assert np.mean(each < 1) == pytest.approx(0.683, abs=0.47 * slack)
        assert np.mean(each < 1.96) == pytest.approx(0.95, abs=0.22 * slack)


@pytest.mark.parametrize(
    ("header", "options"),
    [
        ("t (s),y (m)", {}),
        ("mass A,\nt,y\ns,m", {}),
        ("Slice,Y (px)", {"rate": RATE, "length_per_unit": -0.002}),
        ("# frame z", {"rate": RATE, "length_per_unit": 0.002}),
    ],
)
def test_files_of_programs(header, options):
    """Positions in an image grow downward; a frame in which the ball was not found is blank."""
    time, height, speed, epsilon = track(np.random.default_rng(6), FLIGHTS["vacuum"])
    scale = options.pop("length_per_unit", 1.0)
    separator = " " if "#" in header else ","
    first = np.arange(len(time)) if options else time
    rows = [f"{a:.6g}{separator}{b:.6f}" for a, b in zip(first, height / scale, strict=True)]
    if "Slice" in header:
        rows[60] = "60,"
    if options:
        options["length_per_unit"] = abs(scale)
    content = "\n".join([header, *rows]).encode()
    found = read.recording([(content, "track.csv")], Options(**options)).points
    assert found.speed == pytest.approx(speed, abs=5e-3)
    assert found.epsilon == pytest.approx(epsilon, abs=3e-3)
    assert found.labels[0].startswith("line ")


def test_contact_times_matter():
    time, height, speed, epsilon = track(np.random.default_rng(6), FLIGHTS["vacuum"], duration=0.008)
    number = of_track(time, height, labels(time), Flight(), contact_time=0.008).points
    assert np.abs((number.epsilon - epsilon) / number.standard_errors).max() < 4
    without = of_track(time, height, labels(time), Flight()).points
    assert np.abs((without.epsilon - epsilon) / without.standard_errors).max() > 10
    assert speed == pytest.approx(number.speed, abs=5e-3)


def test_one_contact_is_enough():
    time, height, speed, epsilon = track(np.random.default_rng(6), FLIGHTS["vacuum"])
    some = time < 0.85  # the ball hits the plane at 0.65 s
    found = of_track(time[some], height[some], labels(time[some]), Flight()).points
    assert found.epsilon == pytest.approx(epsilon[:1], abs=4 * found.standard_errors[0])
    assert found.speed == pytest.approx(speed[:1], abs=5e-3)


def test_what_is_no_track_of_a_falling_ball_is_refused():
    time, height, *_ = track(np.random.default_rng(6), FLIGHTS["vacuum"])
    with pytest.raises(ValueError, match="line 9: the time is not later than the one before"):
        of_track(np.where(time == time[9], 0, time), height, labels(time), Flight())
    with pytest.raises(TooFew, match="the track has 5 frames"):
        of_track(time[:5], height[:5], labels(time[:5]), Flight())
    with pytest.raises(TooFew, match="no contact has a free flight of 5 frames"):
        of_track(time[45:100], height[45:100], labels(time[45:100]), Flight())
    text = "frame,y\n" + "\n".join(f"{k},{y}" for k, y in enumerate(height.tolist()))
    with pytest.raises(ValueError, match="frames have no times: expected --rate"):
        read.recording([(text.encode(), "a.csv")])
    with pytest.raises(ValueError, match="--rate is 0: expected a number > 0"):
        read.recording([(text.encode(), "a.csv")], Options(rate=0.0))
    with pytest.raises(ValueError, match="--rate is given: expected a column frame with it"):
        read.recording([(b"speed,epsilon\n1,0.9\n", "a.csv")], Options(rate=200.0))


def test_a_ball_that_was_held():
    """The hand moves up and down, and lets go at 1.6 s: the ball falls 0.8 m, and eps is 0.78."""
    found = read.recording([((DATA / "held_then_dropped_synthetic.csv").read_bytes(), "a.csv")])
    assert found.points.epsilon == pytest.approx([0.78] * 3, abs=3 * found.points.standard_errors.max())
    assert found.points.speed[0] == pytest.approx((2 * 9.80665 * 0.8) ** 0.5, abs=0.03)
    assert found.points.labels == ("line 52", "line 68", "line 80")
    assert [flight.first for flight in found.flights][1:] == ["line 53", "line 68", "line 81"]
    assert all(abs(each.acceleration - 9.81) < 3 * each.standard_error for each in found.flights)
    assert (found.left_out, found.warnings) == ((("line 90", "no free flight of 5 frames or more after it"),), ())


@pytest.mark.parametrize("factor", [0.3048, -0.0254, 1000.0])
def test_a_wrong_unit_is_named_and_does_not_change_eps(factor):
    time, height, speed, epsilon = track(np.random.default_rng(6), FLIGHTS["vacuum"])
    rows = "\n".join(f"{t:.4f},{y!r}" for t, y in zip(time, (factor * height).tolist(), strict=True))
    found = read.recording([(f"t (s),y (m)\n{rows}".encode(), "a.csv")])
    assert found.points.epsilon == pytest.approx(epsilon, abs=5 * found.points.standard_errors.max())
    assert found.points.speed == pytest.approx(abs(factor) * speed, rel=3e-3)
    (warning,) = found.warnings
    scale = float(re.search(r"--length-per-unit '([0-9.e+]+) mm' gives", warning)[1])
    assert scale == pytest.approx(1000 / abs(factor), rel=6e-3)
    frames = "\n".join(f"{k},{y!r}" for k, y in enumerate(height.tolist()))
    of_rate = read.recording([(f"frame,y (m)\n{frames}".encode(), "a.csv")], Options(rate=2 * RATE)).warnings[0]
    assert float(re.search(r"or --rate ([0-9.]+), gives", of_rate)[1]) == pytest.approx(RATE, rel=2e-3)
    right = read.recording([(f"t (s),y\n{rows}".encode(), "a.csv")], Options(length_per_unit=scale / 1000))
    assert right.points.speed == pytest.approx(speed, rel=1e-2)
    assert right.warnings == ()


@pytest.mark.parametrize("seed", range(5))
def test_short_flights_and_the_contacts_between_shorter_ones(seed):
    """30 frames a second: rebounds of 10 and 6 cm have 8 and 7 frames; a third of 4 cm has too few after a contact."""
    random, speed = np.random.default_rng(seed), (2 * 9.80665 * 0.16) ** 0.5
    time, begin = np.arange(0.5, 1.6, 1 / 30), [0.7]
    height = np.where(time < begin[0], 0.16 - 9.80665 / 2 * (time - begin[0] + speed / 9.80665).clip(0) ** 2, 0.0)
    for launch in speed * 0.78 ** np.arange(1, 6):
        begin.append(begin[-1] + 2 * launch / 9.80665)
        inside = (time >= begin[-2]) & (time < begin[-1])
        height[inside] = launch * (time[inside] - begin[-2]) - 9.80665 / 2 * (time[inside] - begin[-2]) ** 2
    found = of_track(time, height + 5e-4 * random.standard_normal(len(time)), labels(time), Flight())
    between = [k for k, label in enumerate(found.points.labels) if abs(time[int(label[5:])] - begin[1]) < 1 / 30]
    assert found.points.epsilon[between] == pytest.approx([0.78], abs=4 * found.points.standard_errors.max())
    for label, why in found.left_out:
        assert min(abs(time[int(label[5:])] - np.array(begin))) < 1 / 20
        assert why.startswith("no free flight of 5 frames or more")
    assert len(found.points) + len(found.left_out) >= 3


@pytest.mark.parametrize(("digits", "missing"), [(2, ()), (3, range(9, 1000, 19))])
def test_times_that_are_rounded_and_frames_that_are_missing(digits, missing):
    """67 frames a second, with two digits: the rounding of 5 ms would be an error of 2 cm."""
    time, height, speed, epsilon = track(np.random.default_rng(6), FLIGHTS["vacuum"])
    kept = [3 * k for k in range(len(time) // 3) if k not in missing]
    rows = "\n".join(f"{time[k]:.{digits}f},{height[k]:.4f}" for k in kept)
    found = read.recording([(f"t (s),y (m)\n{rows}".encode(), "a.csv")])
    assert found.points.speed[:4] == pytest.approx(speed[:4], abs=0.02)
    assert found.points.epsilon[:4] == pytest.approx(epsilon[:4], abs=0.01)


@pytest.mark.parametrize(("step", "scale"), [(1, 0.3), (6, 1.0), (6, 1000.0)])
def test_standard_errors_of_eps_and_of_accelerations_at_other_rates_and_scales(step, scale):
    random, off, falls = np.random.default_rng(8), [], []
    for _ in range(30):
        time, height, speed, epsilon = track(random, FLIGHTS["vacuum"], held=0.3 * random.random())
        time, height = time[::step], scale * height[::step]
        found = of_track(time, height, labels(time), Flight())
        assert found.agrees == (scale == 1)
        falls += [(each.acceleration - scale * 9.80665) / each.standard_error for each in found.flights]
        for v, e, error in zip(found.points.speed, found.points.epsilon, found.points.standard_errors, strict=True):
            off.append((e - epsilon[np.argmin(np.abs(speed - v / scale))]) / error)
    assert len(off) > 100
    for each in (off, falls):
        assert (np.mean(each), np.std(each)) == pytest.approx((0, 1), abs=0.25)


def test_standard_errors_that_are_given_are_those_that_the_residuals_have():
    random, ratios = np.random.default_rng(8), []
    for _ in range(10):
        time, height, *_ = track(random, FLIGHTS["vacuum"])
        own, given = (of_track(time, height, labels(time), Flight(), sigma=sigma).points for sigma in (0, NOISE))
        ratios += (given.standard_errors / own.standard_errors).tolist()
    assert np.mean(ratios) == pytest.approx(1, abs=0.03)


@pytest.mark.parametrize("rate", [30, 240])
def test_a_ball_that_is_lifted_and_dropped_again(rate):
    """Two drops with eps = 0.75 until the ball rests; a hand lifts it from 5 s to 6.5 s."""
    time = np.arange(0, 8.9, 1 / rate)
    height = np.where(time < 5, 0.0, 0.4 - 0.4 * np.cos(np.pi * np.clip((time - 5) / 1.5, 0, 1)))
    for release, top in ((0.5, 1.0), (7.0, 0.8)):
        height[(time < release) & (time > release - 0.5)] = top
        begin, launch = release - (2 * top / 9.80665) ** 0.5, (2 * 9.80665 * top) ** 0.5
        for _ in range(25):  # each flight begins at a contact; the first one, at its apex
            inside = (time >= max(begin, release)) & (time < begin + 2 * launch / 9.80665)
            height[inside] = (launch * (time - begin) - 9.80665 / 2 * (time - begin) ** 2)[inside]
            begin, launch = begin + 2 * launch / 9.80665, 0.75 * launch
        height[(time >= begin) & (time < 5)] = 0.0
    found = of_track(time, height + 1e-3 * np.random.default_rng(1).standard_normal(len(time)), labels(time), Flight())
    assert len(found.points) >= 9
    assert np.abs((found.points.epsilon - 0.75) / found.points.standard_errors).max() < 4
    assert found.agrees
