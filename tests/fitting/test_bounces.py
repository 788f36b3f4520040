"""Which sounds are bounces: series of known eps, in which bounces are missing and echoes are heard."""

import numpy as np
import pytest

import viscopade as vp
from viscopade.fitting.bounces import audible_bounces, unseen_rebounds

SOUNDS, FIRST, SIGMA = 8, 0.6, 1e-3  # bounces of a series, its first flight and the error of an instant, in s


def series(random, epsilon, missed, echoes):
    """Return instants, and for each the number of its bounce, or -1."""
    flights = FIRST * epsilon ** np.arange(SOUNDS - 1)
    instants = np.append(0, np.cumsum(flights)) + SIGMA * random.standard_normal(SOUNDS)
    kept = np.delete(np.arange(SOUNDS), random.choice(np.arange(1, SOUNDS - 1), missed, replace=False))
    after = random.integers(len(kept) - 1, size=echoes)
    begin, end = instants[kept[after]], instants[kept[after + 1]]
    times = np.concatenate([instants[kept], begin + (end - begin) * random.random(echoes)])
    order = np.argsort(times)
    return times[order], np.append(kept, [-1] * echoes)[order]


def wrong_and_kept(epsilon, missed, echoes, number):
    """Return the share of series with an eps of other flights than two successive ones, and of eps that are found."""
    random = np.random.default_rng(7)
    wrong = found = possible = 0
    for _ in range(number):
        instants, bounce = series(random, epsilon, missed, echoes)
        runs, left_out = audible_bounces(instants, SIGMA)
        triples = [bounce[run[k : k + 3]] for run in runs for k in range(len(run) - 2)]
        good = [bool(three.min() >= 0 and (np.diff(three) == 1).all()) for three in triples]
        wrong += not all(good)
        found += sum(good)
        heard_ones = set(bounce.tolist()) - {-1}
        possible += sum({k - 1, k + 1} <= heard_ones for k in heard_ones)
        inside = {i for run in runs for i in run[1:-1]}
        assert sorted([*inside, *(i for i, _ in left_out)]) == list(range(1, len(instants) - 1))
    return wrong / number, found / possible


CASES = [(0, 0), (1, 0), (0, 1), (1, 1)]
MOST_WRONG = {0.6: 0.06, 0.7: 0.06, 0.8: 0.02, 0.9: 0.02}


@pytest.mark.parametrize("number", [40, pytest.param(200, marks=pytest.mark.slow)])
@pytest.mark.parametrize("epsilon", MOST_WRONG)
def test_a_wrong_eps_is_hardly_ever_kept(epsilon, number):
    for missed, echoes in CASES:
        wrong, kept = wrong_and_kept(epsilon, missed, echoes, number)
        assert wrong <= MOST_WRONG[epsilon] + (0.03 if number < 200 else 0)
        assert kept > 0.9


def test_each_sound_that_is_left_out_has_a_reason():
    flights = 0.6 * 0.8 ** np.arange(7)
    instants = np.append(0, np.cumsum(flights))
    assert audible_bounces(instants) == ([list(range(8))], [])
    echo = np.sort(np.append(instants, instants[3] + 0.1))
    assert audible_bounces(echo) == ([[0, 1, 2, 3, 5, 6, 7, 8]], [(4, "an echo or another sound")])
    missed = np.delete(instants, 3)
    before, after = "the bounce before it was not heard", "the bounce after it was not heard"
    assert audible_bounces(missed) == ([[0, 1, 2], [3, 4, 5, 6]], [(2, after), (3, before)])
    two = np.concatenate([instants, instants + 9])
    ends = "the first or last bounce of a drop"
    assert audible_bounces(two) == ([list(range(8)), list(range(8, 16))], [(7, ends), (8, ends)])


def test_a_long_flight_or_a_missed_bounce_is_ambiguous():
    """Of eps < 0.62, two flights are shorter than the one before them."""
    runs, left_out = audible_bounces(np.cumsum([0, 0.5, 0.3, 0.288]))
    assert runs == []
    assert all(why.startswith("ambiguous: ") for _, why in left_out)


RELEASE, REBOUNDS, BLUR = 0.3, 6, 3e-4  # height of release in m, measured rebounds, and the error of a height in m


def heights(random, epsilon, exponent, skipped):
    """Return heights with -ln eps ~ v^exponent, `epsilon` at first, without the rebound number `skipped`."""
    fallen = [RELEASE]
    for _ in range(REBOUNDS + 1):
        fallen.append(fallen[-1] * epsilon ** (2 * (fallen[-1] / RELEASE) ** (exponent / 2)))
    measured = np.array(fallen) + BLUR * np.append(0, random.standard_normal(REBOUNDS + 1))
    return np.delete(measured, skipped)


@pytest.mark.parametrize("number", [40, pytest.param(400, marks=pytest.mark.slow)])
@pytest.mark.parametrize("exponent", [0, 0.2, 1])  # of the compared laws
@pytest.mark.parametrize("epsilon", [0.7, 0.8, 0.9])
def test_an_unseen_rebound_is_hardly_ever_taken_for_a_loss(epsilon, exponent, number):
    """A rebound that was measured is hardly ever left out, either: docs/usage/fitting.md has both shares."""
    random = np.random.default_rng(11)
    used = lost = 0
    for _ in range(number):
        skipped = int(random.integers(1, REBOUNDS + 1))
        for rebound in (skipped, REBOUNDS + 1):  # the second one is the last
            drop = heights(random, epsilon, exponent, rebound)
            (unseen,) = unseen_rebounds([(drop, np.zeros_like(drop))])
            indices = {k for k, _ in unseen}
            used += rebound not in indices and rebound <= REBOUNDS
            lost += len(indices - {rebound})
    assert used / number <= 0.01 + (0.03 if number < 200 else 0)
    assert lost / number <= 0.06 + (0.03 if number < 200 else 0)


@pytest.mark.parametrize("a", [8e-5, 3e-4])
def test_the_fall_of_eps_by_the_weight_is_no_unseen_rebound(a):
    """A rubber ball whose heights are those of collisions with the weight; any rebound may be left out."""
    rubber = {"young_modulus": 2e6, "poisson_ratio": 0.45, "dissipative_constant": a}
    pair = vp.Pair(vp.Sphere(radius=0.02, density=1100, **rubber), vp.Sphere.wall(**rubber))
    speeds = [3.0]
    while speeds[-1] > 0.4:
        speeds.append(speeds[-1] * pair.epsilon(speeds[-1], gravity=9.81))
    drop = np.square(speeds)
    assert unseen_rebounds([(drop, 0 * drop)]) == [[]]
    for k in range(1, len(drop) - 1):
        rest = np.delete(drop, k)
        assert [index for index, _ in unseen_rebounds([(rest, 0 * rest)])[0]] == [k]


def test_a_height_that_may_be_the_second_one_is_ambiguous():
    """Drops share one law: the second one has a single ratio, which is the square of those of the first."""
    first, second = 0.3 * 0.64 ** np.arange(7), np.array([0.3, 0.3 * 0.64**2])
    unseen = unseen_rebounds([(first, 0 * first), (second, 0 * second)])
    assert unseen == [[], [(1, "a rebound before it was not measured")]]
    ((index, why),) = unseen_rebounds([(np.array([0.3, 0.131, 0.0874, 0.0584, 0.0409, 0.028]), np.zeros(6))])[0]
    assert (index, why.partition(":")[0]) == (1, "ambiguous")


def test_fewer_than_three_sounds():
    assert audible_bounces(np.array([1.0, 2.0])) == ([], [])
    assert audible_bounces(np.array([1.0])) == ([], [])
