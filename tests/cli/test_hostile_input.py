"""Hostile input: command lines and files made to break the program end in an answer or in one clear line.

They come from a grammar of every command and are then mutated: numbers that are none, other scripts' digits, control
characters, endless words, options of other commands, directories and devices as files, scenes and results with wrong
types, units, nesting and bytes. `trial.faults` says what must not be; what broke once stays mended.
"""

import json
import os
import subprocess
import sys
from pathlib import Path
from random import Random

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.cli import called, inputs, trial
from tests.cli.inputs import Attempt
from tests.cli.trial import Answer
from viscopade.records import Node
from viscopade.scene.read import from_toml

SEED = 20
INPUTS, THOROUGH_INPUTS = 600, 100_000


ROOT = str(Path(__file__).parents[2])


def tried(count, spoil="pass"):
    """Return what came of each input; where the process ends before them, say at which, and how."""
    code = ("import sys", f"sys.path[0] = {ROOT!r}", "from tests.cli import trial", spoil)
    code = "\n".join((*code, f"trial.trials({SEED}, {count})"))
    run = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    found = [json.loads(line) for line in run.stdout.splitlines()]
    assert (len(found), run.returncode) == (count, 0), f"input {len(found)}: {run.returncode}, {run.stderr[-2000:]}"
    return found


def faulty(found):
    return [entry for entry in found if entry["faults"]]


@pytest.fixture(scope="module")
def found():
    return tried(INPUTS)


@pytest.fixture(scope="module")
def grammar():
    return trial.grammar()


def test_every_end_is_an_answer_or_one_clear_line(found):
    assert faulty(found) == []
    assert {entry["status"] for entry in found} >= {0, 2}


@pytest.mark.slow
def test_every_end_of_many_is_an_answer_or_one_clear_line():
    assert faulty(tried(THOROUGH_INPUTS)) == []


def test_every_command_is_tried(found, grammar):
    assert {entry["command"] for entry in found} >= {*inputs.KNOWN}
    assert {*grammar.options} == {*inputs.KNOWN}


def test_inputs_depend_on_seed_and_number_only(grammar):
    attempts = [grammar.attempt(1, number) for number in range(300)]
    assert [grammar.attempt(1, number) for number in reversed(range(300))] == attempts[::-1]
    assert len({attempt.words for attempt in attempts}) > 200


def test_what_takes_long_is_never_accepted(grammar):
    """Else a hundred thousand inputs would take days."""
    attempts = [grammar.attempt(2, number) for number in range(3000)]
    for command in ("claims", "figures", "reproduce", "hardcases"):
        ends = [tuple(tail) for tail in inputs.TAIL[command]]
        words = [a.words for a in attempts if a.command == command and not {"-h", "--help", "--version"} & {*a.words}]
        assert len(words) > 100
        assert [line for line in words if not any(line[-len(end) :] == end for end in ends)] == []


# --- the measure sees what is wrong -----------------------------------------------------------------------------------

GOOD = "viscopade: order is -1: accepted is an integer from 0 to 1000\n"


def wrong(answer, changed=(), words=("epsilon",)):
    return trial.faults(Attempt(tuple(words)), answer, list(changed))


def test_a_good_refusal_and_a_good_answer_have_no_fault():
    assert wrong(Answer(2, "", GOOD)) == []
    assert wrong(Answer(0, "quantity 1\n", "")) == []


@pytest.mark.parametrize(
    ("answer", "fault"),
    [
        (Answer(None, "", "", "KeyError: 'x'"), "exception"),
        (Answer(3, "", GOOD), "exit status 3"),
        (Answer(2, "", ""), "a refusal is not one printable line"),
        (Answer(2, "", GOOD + GOOD), "a refusal is not one printable line"),
        (Answer(2, "", GOOD.replace("-1", "\x1b[31m")), "a refusal is not one printable line"),
        (Answer(2, "", GOOD.replace("-1", "1" * 9000)), "a refusal is too long"),
        (Answer(2, "something", GOOD), "output with a refusal"),
        (Answer(2, "", "viscopade: list index out of range\n"), "a refusal does not say what is accepted"),
        (Answer(1, "", "viscopade: float division by zero\n"), "a refusal does not say what is accepted"),
        (Answer(0, "beta nan\n", ""), "a silent NaN"),
        (Answer(0, '{"a": NaN}\n', ""), "a silent NaN"),
        (Answer(0, '{"a": Infinity}\n', ""), "no strict JSON"),
        (Answer(0, "x\n", "RuntimeWarning: overflow\n"), "an answer with something on standard error"),
        (Answer(0, "x\x1b[31m\n", ""), "an answer with unprintable characters"),
    ],
)
def test_a_fault_is_seen(answer, fault):
    assert any(found.startswith(fault) for found in wrong(answer))


def test_rows_of_different_lengths_are_seen():
    assert wrong(Answer(0, "a,b\n1\n", ""), words=("epsilon", "--format", "csv")) == ["rows of different lengths"]


def test_files_that_nobody_asked_for_are_seen(tmp_path):
    (tmp_path / "foreign.h").write_text("mine")
    changed = [str(tmp_path / "foreign.h")]
    assert wrong(Answer(0, "", ""), changed) == ["files that nobody asked for"]
    assert wrong(Answer(0, "", ""), changed, ("export", "c", "-o", "x")) == ["a file that is not ours was changed"]
    assert wrong(Answer(2, "", GOOD), changed)[0].startswith("a refusal that left")


@pytest.mark.parametrize(
    ("end", "said"),
    [("os.kill(os.getpid(), 11)", "input 2: -11"), ("time.sleep(9999)", "input 2: 1, Timeout")],
    ids=["killed", "hangs"],
)
def test_an_input_that_hangs_or_kills_is_named(end, said):
    spoil = f"""
import os, time
from itertools import count
numbers, trial.HANGS = count(), 0.1
trial.trial = lambda sandbox, attempt: {end} if next(numbers) == 2 else {{}}
"""
    with pytest.raises(AssertionError, match=said):
        tried(5, spoil)


# --- what broke once --------------------------------------------------------------------------------------------------


@pytest.mark.skipif(not os.path.exists("/dev/zero"), reason="there is no endless file")
def test_an_endless_file_is_refused():
    result = called("bench", "--from", "/dev/zero")
    assert result.returncode == 2
    assert result.stderr == (
        "viscopade: /dev/zero has more than 16777216 bytes: accepted is what `viscopade bench --out` wrote\n"
    )


def test_an_endless_word_does_not_hide_the_remedy():
    result = called("hardcases", "--only", "1" * 30_000)
    assert result.returncode == 2
    assert "expected one of" in result.stderr
    assert len(result.stderr) < 2000


def test_control_characters_are_shown_and_not_sent_to_the_terminal(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "a\x1b[31m\u202e.toml").write_text("x = [")
    result = called("scene", "a\x1b[31m\u202e.toml")
    assert result.stderr.startswith(r"viscopade: a\x1b[31m\u202e.toml: the text is not TOML")
    assert result.stderr[:-1].isprintable()


def test_an_integer_too_long_to_be_written_is_refused_by_name():
    """TOML has no limit for hexadecimal integers, Python has one for writing them."""
    text = f"title = 0x{'f' * 5000}\n[material.g]\nyoung_modulus = 0x{'f' * 5000}\n"
    with pytest.raises(ValueError, match=r"^s.toml: material.g.young_modulus is .*thousands of digits: accepted is"):
        from_toml(text, "s.toml")


def test_numbers_beyond_all_doubles_are_refused_by_name():
    with pytest.raises(ValueError, match=r"^x: y is .*: accepted is a number$"):
        Node("x", "y", 10**400).within("a number", lambda number: True)
    with pytest.raises(ValueError, match=r"^x: y is .*: accepted is a positive integer"):
        Node("x", "y", 2**60).count()


# --- more of them, by hypothesis --------------------------------------------------------------------------------------


def clean(text):
    line = "s.toml: "
    try:
        from_toml(text, "s.toml")
    except ValueError as error:
        line = str(error)
    assert line.startswith("s.toml: ")
    assert "\n" not in line


@settings(max_examples=150)
@given(st.integers())
def test_changed_scenes_are_read_or_refused_by_name(seed):
    clean(inputs.scene(Random(seed)))


@settings(max_examples=100)
@given(st.binary(max_size=200))
def test_any_bytes_are_refused_by_name(content):
    clean(content)
