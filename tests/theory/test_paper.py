"""The paper's table, entry by entry."""

from dataclasses import replace

import pytest

from viscopade.theory.paper import approximants, compare

ENTRIES = compare(approximants(20))


def test_there_are_32_printed_numbers():
    assert len(ENTRIES) == 32
    assert [(e.m, e.n) for e in ENTRIES[:5]] == [(0, 3)] * 5


@pytest.mark.parametrize("entry", ENTRIES, ids=lambda e: f"[{e.m}/{e.n}] {e.name}")
def test_entry_agrees_at_the_printed_digits(entry):
    assert entry.agrees


@pytest.mark.parametrize("entry", ENTRIES, ids=lambda e: f"[{e.m}/{e.n}] {e.name}")
def test_a_unit_in_the_last_place_is_a_disagreement(entry):
    """The comparison can fail: it does for a printed number that is off by one in its fifth or sixth decimal."""
    decimals = max(len(entry.printed.partition(".")[2]), 5)
    assert not replace(entry, printed=f"{float(entry.printed) + 10**-decimals:.{decimals}f}").agrees


def test_too_few_digits_to_compare_are_refused():
    with pytest.raises(ValueError, match="from 12 to"):
        approximants(7)
