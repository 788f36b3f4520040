"""Which sounds are bounces: series of known eps, in which bounces are missing and echoes are heard."""

import numpy as np
import pytest

from viscopade.fitting.bounces import audible_bounces

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


def test_fewer_than_three_sounds():
    assert audible_bounces(np.array([1.0, 2.0])) == ([], [])
    assert audible_bounces(np.array([1.0])) == ([], [])
