"""Headers from speed to eps, checked by `table_checker` from their text alone; the truth is integrated to 40 digits."""

import json
from dataclasses import replace
from fractions import Fraction
from functools import cache
from pathlib import Path
from random import Random

import pytest

from table_checker import (
    Machine,
    Wrong,
    check_points,
    check_shape,
    evaluate,
    falls,
    main,
    point,
    read,
    rounded,
    share_of_formula,
    shares_of_results,
    ulp,
)
from viscopade.collision import exact
from viscopade.kernels import catalogue

EXPORTS = Path(__file__).parents[2] / "exports"
FILES = {tier: EXPORTS / f"viscopade_speed_{tier.replace('-', 'm')}.h" for tier in catalogue.TIERS}
TEXTS = {tier: path.read_text() for tier, path in FILES.items()}
EVERY = pytest.mark.parametrize("tier", TEXTS)


@cache
def header_of(tier):
    return read(TEXTS[tier])


def truth(w):
    found = exact.collision(beta="1", speed=w, digits=30).decimals()
    return point(w, found["epsilon"], found["one_minus_epsilon"])


def somewhere(header, index, random):
    """Return a w of a row; its ends, where errors of interpolation are large, half of the time."""
    exponent, low, high = header.interval(index)
    place = random.choice([Fraction(0), Fraction(random.randrange(2**30), 2**30), 1 - Fraction(1, 2**30)])
    return (low + (high - low) * place) * Fraction(2) ** exponent


@EVERY
def test_rows_are_within_the_stated_bounds_where_the_motion_is_integrated(tier):
    header, random = header_of(tier), Random(tier)
    switch = next(i for i in range(len(header.rows)) if not header.base(i))
    last = len(header.rows) - 1
    rows = [0, switch - 1, switch, last, last - header.to_an_octave + 1, *random.sample(range(last), 5)]
    worst = check_points(header, [truth(somewhere(header, index, random)) for index in rows])
    assert worst > (Fraction(1, 100) if header.full else Fraction(1, 3))


@EVERY
def test_signs_monotonicity_and_rises_of_all_rows(tier):
    check_shape(header_of(tier))


@EVERY
def test_results_of_machine_arithmetic_are_within_the_bounds(tier):
    """For the exact beta^5 speed, with and without fused operations; w is off by at most five roundings."""
    header, random = header_of(tier), Random(7)
    for kind in [kind for kind in ("double", "float") if kind in header.bounds or (header.full and kind == "double")]:
        precision = {"double": 53, "float": 24}[kind]
        for _ in range(5):
            beta = rounded(Fraction(random.randrange(2**60), 2**60) + Fraction(1, 2), precision)
            w = somewhere(header, random.randrange(header.to_an_octave, len(header.rows) - header.to_an_octave), random)
            value = rounded(w / beta**5, precision)
            at = truth(beta**5 * value)
            for fused in (False, True):
                shares = shares_of_results(header, Machine(kind, fused), value, beta, at)
                assert max(shares) <= 1, (kind, fused, float(value).hex(), float(beta).hex())


def test_results_beyond_a_power_of_two_have_the_larger_unit():
    """The rounding of w lifts eps across 2^-10; eps of the exact w is below."""
    speed, beta = (Fraction(float.fromhex(word)) for word in ("0x1.1541d56f95b7dp31", "0x1.00aed821bbca0p0"))
    at = truth(beta**5 * speed)
    assert at.epsilon[1] < Fraction(1, 2**10)
    for fused in (False, True):
        shares = shares_of_results(header_of("full"), Machine("double", fused), speed, beta, at)
        assert 0.7 < max(shares) <= 1


@pytest.mark.parametrize("tier", ["1e-5", "full"])
def test_a_changed_table_is_refused(tier):
    header = header_of(tier)
    index = 3 * len(header.rows) // 4
    exponent, low, high = header.interval(index)
    at = truth((low + (high - low) * Fraction(1, 5)) * Fraction(2) ** exponent)
    change = Fraction(1, 2**51) if header.full else header.bounds["error"] * 3
    row = (header.rows[index][0] * (1 + change), *header.rows[index][1:])
    wrong = replace(header, rows=(*header.rows[:index], row, *header.rows[index + 1 :]))
    assert share_of_formula(header, at) < 1
    with pytest.raises(Wrong, match="of its bound"):
        check_points(wrong, [at])
    shifted = replace(header, rows=(*header.rows[1:], header.rows[-1]))
    with pytest.raises(Wrong, match="of its bound"):
        check_points(shifted, [at])
    with pytest.raises(Wrong, match="is not eps - base"):
        check_shape(shifted)


def test_a_rise_and_a_row_that_does_not_fall_are_refused():
    header = header_of("1e-5")
    with pytest.raises(Wrong, match="eps rises by"):
        check_shape(replace(header, bounds={**header.bounds, "rise": header.bounds["rise"] * Fraction(9, 10)}))
    rows = list(header.rows)
    rows[4000] = (rows[4000][0] + 2 * rows[4000][1], -rows[4000][1] / 10**6)
    assert falls(header, 4000)
    with pytest.raises(Wrong, match=r"row 4000 of .* does not fall"):
        check_shape(replace(header, rows=tuple(rows)))


def test_texts_that_do_not_fit_are_refused():
    text = TEXTS["1e-5"]
    # The first row: several are on its line.
    first = text.index("    {", text.index("viscopade_table_")) + 4
    end = text.index("},", first) + 2
    row = text[first:end]
    assert text[end : end + 2] == " {"
    for changed, message in (
        (text[:first] + text[end + 1 :], "has not 128 octaves of 64 rows"),
        (text[:first] + text[text.index("\n", first) + 1 :], "has not 128 octaves of 64 rows"),
        (text[:first] + f"{row} {row}" + text[end:], "has not 128 octaves of 64 rows"),
        (text[:first] + row.replace("},", ", 0x1p+0f},") + text[end:], "has not 128 octaves of 64 rows"),
        (text[:first] + row.replace(",", "},{", 1) + text[end:], "has not 128 octaves of 64 rows"),
        (text[:end] + " 0x1p+0f," + text[end:], "something else than rows"),
        (text[: end - 1] + text[end:], "something else than rows"),
        (text[:first] + f"{{{row}}}," + text[end:], "something else than rows"),
        (text[:first] + f"/* {row} */" + text[end:], "something else than rows"),
        (text.replace(" rows of coefficients", " rows"), "the comment has no"),
        (text.replace("VISCOPADE_TABLE float viscopade_table_", "static float viscopade_"), "there is no table"),
        (text[:first] + "{1.5, 0x1p+0f}," + text[end:], "no hexadecimal constant"),
        (text[:first] + "{0x1.00000001p+0f, 0x1p+0f}," + text[end:], "no normal number of type float"),
    ):
        with pytest.raises(Wrong, match=message):
            read(changed)


def test_the_checker_s_arithmetic():
    assert rounded(Fraction(1, 3), 53) == Fraction(1 / 3)
    assert rounded(1 + Fraction(1, 2**53), 53) == 1  # ties to even
    assert rounded(-1 - Fraction(3, 2**53), 53) == -1 - Fraction(4, 2**53)
    assert ulp(Fraction(1), 53) == Fraction(1, 2**52) == 2 * ulp(Fraction(999, 1000), 53)
    machine = Machine("double", False)
    c = [Fraction(n + 1) for n in range(6)]
    assert machine.in_pairs(c, Fraction(3), Fraction(9)) == sum((n + 1) * 3**n for n in range(6))
    a = Fraction(1 + 2**-30)
    assert Machine("double", True).times_plus(a, a, Fraction(-1)) != machine.times_plus(a, a, Fraction(-1))
    with pytest.raises(Wrong, match="subnormal"):
        machine.round(Fraction(1, 2**1030))
    at = point(Fraction(1), "0.25e-3", "1.5")
    assert at.epsilon == (Fraction("0.245e-3"), Fraction("0.255e-3"))
    assert at.loss == (Fraction("1.45"), Fraction("1.55"))


def test_w_outside_the_table_is_refused():
    for w in (Fraction(2) ** 32, Fraction(2) ** -97):
        with pytest.raises(Wrong, match="not in the table"):
            evaluate(header_of("1e-5"), Machine("double", False), w, Fraction(1))


def test_command_line(tmp_path, capsys):
    points = []
    for w in (Fraction(1, 8), Fraction(7, 3), Fraction(2) ** 40):
        found = exact.collision(beta="1", speed=w, digits=30).decimals()
        points.append({"w": str(w), **{key: found[key] for key in ("epsilon", "one_minus_epsilon")}})
    file = tmp_path / "points.json"
    file.write_text(json.dumps(points))
    assert main([str(FILES["1e-5"]), "--points", str(file)]) == 0
    assert "8192 rows, 2 points: 0." in capsys.readouterr().out
