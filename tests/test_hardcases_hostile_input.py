"""Hostile input: the quick run passes, its measure sees what is wrong, and inputs that broke something stay mended."""

import json
import os
import selectors
import subprocess
import sys
from pathlib import Path
from random import Random

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.hard_case import assert_passes
from tests.patience import HANGS
from viscopade.records import Node
from viscopade.scene.read import from_toml
from viscopade_lab.hard_cases import hostile_input, inputs, trial
from viscopade_lab.hard_cases.inputs import Attempt
from viscopade_lab.hard_cases.trial import Answer


@pytest.fixture(scope="module")
def found():
    return list(hostile_input.tried(hostile_input.SEED, hostile_input.INPUTS))


def test_the_quick_run_passes(found):
    result = hostile_input.assess(found)
    assert_passes(result)
    assert len(found) == hostile_input.INPUTS
    assert {entry["outcome"] for entry in found} >= {"answered", "refused"}


@pytest.mark.slow
def test_the_thorough_run_passes():
    result = hostile_input.CASE.run(True)
    assert_passes(result)


def test_every_command_is_tried(found):
    assert {entry["command"] for entry in found} >= {*inputs.KNOWN}
    program = trial.Program()
    assert {*program.grammar().options} == {*inputs.KNOWN}


def test_inputs_depend_on_seed_and_number_only():
    grammar = trial.Program().grammar()
    attempts = [grammar.attempt(1, number) for number in range(300)]
    assert [grammar.attempt(1, number) for number in reversed(range(300))] == attempts[::-1]
    assert len({attempt.words for attempt in attempts}) > 200


def test_what_takes_long_is_never_accepted():
    """Else a hundred thousand inputs would take days."""
    grammar = trial.Program().grammar()
    attempts = [grammar.attempt(2, number) for number in range(3000)]
    for command in ("claims", "figures", "reproduce", "hardcases"):
        ends = [tuple(tail) for tail in (*inputs.TAIL[command], ("--from", inputs.FINDINGS))]
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


def test_every_fault_is_in_one_class():
    listed = [word for begins in hostile_input.CLASSES.values() for word in begins]
    assert len(listed) == len({*listed})
    assert hostile_input._unlisted([{"faults": ["a silent NaN"]}, {"faults": ["another thing"]}]) == 1


class Clock(selectors.DefaultSelector):
    """A selector that waits without an end, until a file says that nothing will come any more."""

    asleep: Path

    def select(self, timeout=None):
        assert timeout == hostile_input.HANGS
        while not (ready := super().select(0.01)):
            if self.asleep.exists() and not (ready := super().select(0)):
                self.asleep.unlink()
                return []
        return ready


def test_an_input_that_hangs_or_kills_is_counted(monkeypatch, tmp_path):
    """The stand-in for the program answers two inputs, and then is killed; another one sleeps."""
    stand_in, Clock.asleep = tmp_path / "stand_in", tmp_path / "asleep"
    line = json.dumps({"command": "pade", "outcome": "answered", "faults": []})
    stand_in.write_text(
        f"#!{sys.executable}\nimport os, sys, time\nfirst, last = map(int, sys.argv[4:])\n"
        f"for i in range(first, last):\n"
        f"    if i == 2: os.kill(os.getpid(), 11)\n"
        f"    if i == 4: open({str(Clock.asleep)!r}, 'w').close(); time.sleep({HANGS})\n"
        f"    print({line!r}, flush=True)\n"
    )
    stand_in.chmod(0o755)
    monkeypatch.setattr(hostile_input.sys, "executable", str(stand_in))
    monkeypatch.setattr(hostile_input.selectors, "DefaultSelector", Clock)
    found = list(hostile_input.tried(1, 6))
    assert [entry["faults"] for entry in found] == [[], [], ["ended with -11: input 2"], [], ["hangs: input 4"], []]
    assert hostile_input.assess(found).checks[0].measured == 2


# --- what broke once --------------------------------------------------------------------------------------------------


def run(*words, **options):
    return subprocess.run(
        [sys.executable, "-m", "viscopade", *words], capture_output=True, text=True, timeout=HANGS, **options
    )


def test_an_endless_file_is_refused():
    if not os.path.exists("/dev/zero"):
        pytest.skip("there is no endless file")
    result = run("report", "--from", "/dev/zero", "--out", "nowhere")
    assert result.returncode == 2
    assert result.stderr == (
        "viscopade: /dev/zero has more than 16777216 bytes: accepted is what `viscopade bench --out` wrote\n"
    )


def test_an_endless_word_does_not_hide_the_remedy():
    result = run("hardcases", "--only", "1" * 30_000)
    assert result.returncode == 2
    assert "accepted are" in result.stderr
    assert len(result.stderr) < 2000


def test_control_characters_are_shown_and_not_sent_to_the_terminal(tmp_path):
    (tmp_path / "a\x1b[31m\u202e.toml").write_text("x = [")
    result = run("scene", "a\x1b[31m\u202e.toml", cwd=tmp_path)
    assert result.stderr.startswith(r"viscopade: a\x1b[31m\u202e.toml: no TOML")
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
