"""Hostile command lines and files: from a grammar, then mutated; the same for the same seed and number.

The grammar is what `viscopade --help` says, so that a new command is tried without a change here. What would take
long if it were accepted is spoiled: something that must be refused is added, of the kind that is noticed last.
"""

import json
import re
from collections.abc import Mapping, Sequence
from copy import deepcopy
from dataclasses import dataclass, field
from random import Random
from typing import Any

SCENE, RESULT, DATA = "scene.toml", "result.json", "data.csv"
"""The files that come with an input."""

LONG = "x" * 5000
NUMBERS = (
    "0", "-0", "0.0", "1", "2", "-1", "+3", "0.3", "1.5", ".5", "5.", "1e-3", "1e-5", "1e7", "2500", "nan", "NaN",
    "-nan",
    "inf", "-inf", "Infinity", "1e400", "-1e400", "1e-400", "1e-1000", "1e101", "1e300", "1e308", "5e-324",
    "1e999999999",
    "1e9999999999", "0x10", "0b1", "1_000", "1,5", "1e", "e5", "--1", "1-1", "1/3", "١٢", "３", "½", "²", "1 000",
    " 1", "1 ", "1\n", "\t2", "9" * 400, "9" * 5000, "0." + "0" * 400 + "1", "1" * 30000, "1j", "True", "None", "1+1",
    "1d5",
    "0.9999999999999999999999999", "1.0000000000000000000000001", "0.22", "0.5", "6001",
)  # fmt: skip
WORDS = (
    "", " ", "\n", "\r\n", "\t", "a\nb", "\x1b[31mred", "\x1b]0;title\x07", "\x07", "\x7f", "\x85", "\u2028",
    "\u202egpj.exe", "\ufeff",
    "\udcff", "\udc80\udc81", "é" * 50, "ε", "😀" * 20, "%s%n", "{0}", "{}", "$(id)", "`id`", "; rm", "'", '"', "\\",
    "''", "*/", "/*",
    "//", "--", "-", "---", "-h", "--help", "-x", "-o", "--version", "--=", "--format=", "--order=", "=", LONG,
    "nothing", "../..",
    "__import__('os')", "[red]bold[/red]", "[/]", "\\textbf{x}", "&amp;<script>",
)  # fmt: skip
FILES = (
    SCENE, SCENE, SCENE, SCENE, SCENE, RESULT, "missing.toml", "directory", "directory/", ".", "",
    "/dev/null",
    "/dev/zero", "/dev/full", "/proc/self/mem", "/proc/self", "foreign.h", "link", "dangling", "loop", "loop/x",
    "foreign.h/x",
    "x" * 300, "y/" * 3000, "odd\x1b[31m.toml", "odd\nname.toml", "odd*\u2044name.toml", "\udcff.toml", "-", "~",
    "~nobody/x", "link/../x",
)  # fmt: skip
TARGETS = (
    "new.h", "new.h", "new.json", "new/deeper", "ours.h", "foreign.h", "directory", "directory/new.h", "taken",
    "link", "dangling", "loop",
    "loop/x.h", "missing/x.h", "/dev/null", "/dev/full", "/proc/nowhere/x.h", "foreign.h/x", "x" * 300, "y/" * 3000,
    "", ".", "..",
    "new\x1b[31m", "new\nline", "\udcff", "-", "~", "new.svg", "new.pdf",
)  # fmt: skip
UNITS = (
    "1 m", "1 mm", "70 GPa", "2500 kg/m^3", "1 m/s", "1 cm/s", "1e-5 s", "1 cm^2/s^2", "1e999 m", "1e-999 m", "-1 m",
    "nan m", "inf m",
    "1 m/s/s", "1 parsec^-0.5", "1 m; import os", "__import__('os')", "1 delta_degC", "20 degC", "5 percent", "5 %",
    "2**2**2**2**9999 m",
    "m", "1", "1m", "1 m m", "1 m*m/m", "1 (m)", "1 " + "(" * 50 + "m" + ")" * 50, "1 " + "m*" * 25 + "m", "1 метр",
    "1 μm", "1 µm", "1 м",
    "1 light_year", "1 planck_length", "1 quectometer", "1 Qm", "1 pint", "1 dB", "1 dBm", "1 pH", "1 kg/m³",
    "1 m²/s²", "1 m^9/m^8", "1 s^-1",
    "1 eV", "1 c", "1 h", "1 hbar", "1 yottaGPa", "1 MMm", "1 m\u0000", "1 m\n", "1  m", "١ m", "1 m/0", "1 0",
    "1 1/m", "1 m^1000", "1 m**-1",
    "1e308 km", "1e-308 nm", "1 nm", "1 fs", "1e10 kg/m^3", "1 Å", "1 °", "1 rad m", "1 count m", "1 bit",
    "1 mol*m/mol", "1 furlong",
)  # fmt: skip
RAW = (
    "0", "-0.0", "1", "-1", "0.5", "1e-3", "1e400", "-1e400", "5e-324", "1e308", "1e-308", "nan", "inf", "-inf",
    "true", "false", "0x10",
    "0x" + "f" * 5000, "0o7", "0b1", "1_000", "9" * 400, "9" * 5000, "1e999999999", "1979-05-27", "07:32:00",
    "1979-05-27T07:32:00Z", "[]", "{}",
    "[[]]", "[1, 2]", '["ball", "wall"]', '["ball", "ball", "ball"]', '["ball"]', '["wall", "wall"]', "{ a = 1 }",
    "{ min = 1, max = 2 }",
    "{ min = 2, max = 1 }", "{ mean = 1e-3, deviation = 1e-4 }", "{ mean = 1e-3, deviation = 1 }",
    "{ median = 1e-3, geometric_deviation = 2 }",
    "{ median = 1e-3, geometric_deviation = 100, tail = 1e-299 }", "{ median = 1e300, geometric_deviation = 99 }",
    '""', '"\\u0000"',
    '"\\u001b[31m"', '"\\n"', '"\\u202e"', "'''\n'''", '"' + "x" * 3000 + '"', "[" * 60 + "]" * 60,
    "[" * 5000 + "]" * 5000,
    "{a=" * 300 + "1" + "}" * 300, "[" + "1," * 3000 + "]", '"c"', '"python"', '"cobol"', '"float"', '"glass"',
    '"ball"', '"wall"', '"sphere"',
    "{ granular_temperature = 1 }", "{ granular_temperature = 1e300 }",
    "{ granular_temperature = 1e-320, tail = 0.499 }", "١", "=", "",
)  # fmt: skip
JSON_VALUES: tuple[Any, ...] = (
    None, True, False, 0, 1, -1, 10**400, -(10**400), 1e308, 5e-324, -0.0, float("nan"), float("inf"), -float("inf"),
    0.5, "", " ", "x", "\n",
    "\x1b[31m", "\u202e", "\x00", "\ud800", "x" * 5000, "1e400", "0.57 ulp", "1 ulp + 1", "nan", [], {}, [[]], [None],
    {"": 1}, {"a": {}}, [1] * 3000,
    "double", "float", "ours", "rival", "latency", "throughput", "<script>alert(1)</script>", "$\\alpha$", "$x",
    "\\frac", "log", "<=",
)  # fmt: skip
# What an option takes, where its name says so: seldom another thing.
OPTIONS: Mapping[str, Sequence[str]] = {
    "--order": ("0", "5", "20", "40", "-1", "1001", "2.5"),
    "--digits": ("1", "8", "30", "40", "0", "-5", "5001"),
    "--v-star": ("0", "inf", "1e-30", "0.3", "1", "1e20", "1e-1000", "1e101", "-1"),
    "--epsilon": ("0.9", "0.5", "1e-3", "0.999999", "1", "1e-30", "0", "1.01"),
    "--program": ("lammps", "yade", "textbook", "mujoco", "", "x" * 500),
    "--time-step": ("0.02", "0.3", "1e-3", "1", "0", "-1", "1e-9", "2 ms", "1e-300"),
    "--contact-time": ("1", "0.1", "10", "0", "-1", "1e299", "31 ms", "1 m"),
    "--stiffness": ("1e4", "1", "1e20", "0", "-1", "1e299", "1e-299"), "--penetration": ("1 mm", "1e-3", "0", "1e299"),
    "--mass": ("1", "2 g", "0", "1e299", "1e-299"), "--speeds": ("1e-3:10", "1:20 cm/s", "2:1", ":", "0:1", "1e-299:1"),
    "--yield-strength": ("50 MPa", "1e7", "0", "1e-300"),
    "--step-error": ("0.01", "0.1", "1", "1e-8", "0", "-1"),
    "--one-minus-epsilon": ("1e-30", "0.1", "0.5", "1e-8", "0", "1", "1e-2000"),
    "--young-modulus": ("1e7", "70 GPa", "7e10", "1", "1e20", "0", "-1", "1e299", "1e-300"),
    "--poisson-ratio": ("0.3", "0.5", "-0.99", "0", "-1", "0.51"),
    "--density": ("2500", "2.5 g/cm^3", "1", "1e-5", "1e20", "0", "1e-300", "1e299"),
    "--radius": ("0.01", "1 cm", "1e-6", "1", "1e10", "1e290", "1e-290", "0"),
    "--dissipative-constant": ("1e-5", "1e-9", "1", "1e10", "0", "1e299", "1e-300", "-1"),
    "--speed": ("1", "10 cm/s", "1 kg", "0.001", "1e10", "1e-20", "1e-299", "1e299", "0", "-1"),
    "--beta": ("1.307", "1.307 (s/cm)^(1/5)", "1 s", "1", "1e10", "1e-20", "1e-90", "0"),
    "--pade": ("3/6", "1/4", "300/1", "3-6", "1/1", "٣/٦", "3/6/1", "/", "-3/6"),
    "--out": TARGETS, "--output": TARGETS, "--scene": TARGETS, "--plot": ("x.png", "x.svg", "x", *TARGETS),
    "--data": (DATA, *FILES), "--law": ("1,1", "viscoelastic", "tsuji:2", "nothing", "1,2,3", ""),
    "--column": ("speed=w", "epsilon=e", "foo=bar", "speed", "=", "time=speed"), "--without": ("2", "3", "0", "x"),
    "--resolution": ("1 ms", "1 mm", "1e-3", "0", "-1"), "--gravity": ("9.81 m/s^2", "1.62", "0", "-1", "1 m"),
    "--air-density": ("1.2", "0", "-1", "1e9"), "--drag-coefficient": ("0.47", "0", "-1", "1e300"),
    "--to": ("10", "1 km/s", "0", "-1", "1e299"), "--points": ("2", "20", "1", "1e3", "10001"),
    "--headers": FILES, "--costs": (RESULT, *FILES), "--from": (RESULT, "0.1", "1 cm/s", *FILES),
    "--cc": ("no-such-compiler", "", "'unbalanced", "a b c", "$(id)", "--"),
    "--only": ("nothing", "", "twenty-terms", "localSlope", "3-6"),
    "--unit": ("cm/s", "", "\n", "x" * 500, "*/", "\x1b[31m"),
    "--memory-elements": ("1024", "0", "1e3", "999999999999"),
    "--example": ("ice_rings", "nothing", "", "../examples/ice_rings", "ice_rings.toml", "x" * 500),
    "--rounds": ("1", "0", "-1", "10001"),
}  # fmt: skip
MATERIAL = ("--young-modulus", "--poisson-ratio", "--density", "--radius")
LINES: Mapping[str, Sequence[Sequence[str]]] = {
    "epsilon": (
        ("--v-star",),
        ("--v-star", "--digits"),
        ("--beta", "--speed"),
        (*MATERIAL, "--dissipative-constant", "--speed"),
    ),
    "invert": (
        ("--epsilon",),
        ("--one-minus-epsilon", "--digits"),
        ("--epsilon", "--speed"),
        ("--epsilon", "--speed", *MATERIAL),
    ),
    "simulators": (
        (*MATERIAL, "--epsilon", "--speed"),
        (*MATERIAL, "--dissipative-constant", "--speed", "--speeds"),
        ("--epsilon", "--speed", "--contact-time"),
        ("--epsilon", "--speed", "--speeds", "--stiffness", "--mass", "--time-step"),
        ("--epsilon", "--speed", "--speeds", "--penetration", "--step-error"),
        (),
    ),
}
"""Options that go together."""
REFUSED = (
    "nan",
    "inf",
    "",
    "-1",
    "1e400",
    "0x10",
    "1_000",
    "abc",
    "9" * 400,
    "1e-400",
    "1e-99",
    "١e-3",
    "1e-3x",
    "1\x1b",
    "\udcff",
)
TAIL: Mapping[str, Sequence[Sequence[str]]] = {
    "reproduce": (("--format", "nothing"), ("extra", "extra"), ("--out", "taken"), ("--out", "foreign.h")),
    "claims": (("--only", "nothing"),),
    "figures": (("--only", "nothing"), ("--format", "gif")),
    "hardcases": (("--only", "nothing"),),
    "audit": (("--program", "mercurydpm", "--epsilon", "0.5"), ("--program", "nothing"), ("--epsilon", "2")),
    "export": (("--full", "--inverse", "1"), ("--full", "--from-speed", "1e-3"), ("--size", "small", "--pade", "3/6")),
}
"""What is refused, for commands that would take long."""
HEAVY = (
    "--minimax",
    "--accuracy",
    "--inverse",
    "--from-speed",
    "--full",
    "--v-star",
    "--measure",
    "--size",
    "--epsilon-min",
)
FREE = 300  # one scene in so many is chosen a kernel for, one result in so many is drawn


def data(random: Random) -> bytes:
    """Return measured data, now and then with something wrong in them."""
    header = random.choice(
        (
            "speed (cm/s),epsilon", "v;eps;sigma_epsilon", "time (s)", "height\tdrop", "drop_height,rebound_height",
            "bounce 0 (s),bounce 1 (s),bounce 2 (s)", "speed,speed,epsilon", "speed (kg),epsilon", "a,b",
        )
    )  # fmt: skip
    delimiter = next((each for each in ",;\t" if each in header), ",")
    rows = []
    for i in range(random.choice((0, 1, 2, 3, 5, 12, 40))):
        cells = [
            f"{random.uniform(0.5, 0.95) * (1 + i if 'time' in header else 1):.6g}" for _ in header.split(delimiter)
        ]
        if random.random() < 0.02:
            cells[random.randrange(len(cells))] = random.choice((*NUMBERS, "", "x"))
        rows.append(delimiter.join(cells))
    return "\n".join([header, *rows]).encode("utf-8", "surrogateescape")


@dataclass(frozen=True)
class Option:
    """An option of a command: its flags, and whether it takes a value; choices if the help lists them."""

    flags: tuple[str, ...]
    takes_value: bool
    choices: tuple[str, ...] = ()


@dataclass(frozen=True)
class Attempt:
    """A command line without the program's name, and the files that come with it."""

    words: tuple[str, ...]
    files: Mapping[str, bytes] = field(default_factory=dict)

    @property
    def command(self) -> str:
        """The command, as far as the words name one."""
        return self.words[0] if self.words else ""


_LINE = re.compile(r"^  ((?:-{1,2}[\w-]+(?: ?[,/] ?)?)+)(?: ([A-Z\[][^ ]*))?", re.MULTILINE)


def commands_of(text: str) -> tuple[str, ...]:
    """Return the names of the commands in what `viscopade --help` prints."""
    return tuple(re.findall(r"^  ([a-z][a-z-]*)", text.partition("Commands:")[2], re.MULTILINE))


def options_of(text: str) -> tuple[Option, ...]:
    """Return the options in what `viscopade COMMAND --help` prints."""
    found = []
    for flags, value in _LINE.findall(text.partition("Options:")[2]):
        names = tuple(re.findall(r"-{1,2}[\w-]+", flags))
        choices = tuple(value.strip("[]").split("|")) if value.startswith("[") and "|" in value else ()
        found.append(Option(names, bool(value), choices))
    return tuple(found)


def targets_of(text: str) -> tuple[str, ...]:
    """Return the first argument's choices in the usage that the help begins with."""
    match = re.search(r"[{]([^}]*)[}]", text.partition("Options:")[0])
    return tuple(re.sub(r"\s", "", match[1]).split("|")) if match else ()  # it is broken into lines anywhere


@dataclass(frozen=True)
class Grammar:
    """The commands with their options, and the choices of their first arguments."""

    options: Mapping[str, tuple[Option, ...]]
    targets: Mapping[str, tuple[str, ...]]

    def attempt(self, seed: int, number: int) -> Attempt:
        """Return the input of a number."""
        return self.made(Random(f"{seed} {number}"))

    def made(self, random: Random) -> Attempt:
        """Return an input that depends on these dice only."""
        command = random.choices(list(self.options), [4 if name == "scene" else 1 for name in self.options])[0]
        words = self._line(random, command)
        return Attempt(tuple(words), self._files(random, words))

    # --- command lines ------------------------------------------------------------------------------------------------

    def _line(self, random: Random, command: str) -> list[str]:
        if command == "export" and random.random() < 0.3:
            return self._refused_export(random)
        hostility = random.choice((0.0, 0.05, 0.1, 0.4))
        words = self._arguments(random, command, hostility)
        if len(words) < 2 or command != "simulators" or random.random() < 0.2:  # which takes a scene or options
            words += self._some_options(random, command, hostility)
        for _ in range(random.choice((0, 0, 0, 0, 1, 1, 2, 5))):
            words = self._mutated(random, command, words)
        if random.random() < 0.01:
            return _cheap([_hostile(random), *words])  # not even a command
        return _cheap([command, *words, *self._tail(random, command, words)])

    def _arguments(self, random: Random, command: str, hostility: float) -> list[str]:
        if command == "pade":
            return [_number(random, hostility, ("0", "1", "2", "3", "5", "6", "201")) for _ in range(2)]
        words = []
        if command in self.targets:
            words.append(_hostile(random) if random.random() < hostility else random.choice(self.targets[command]))
        if command == "fit":
            words.append(random.choice(FILES) if random.random() < hostility else DATA)
        if command == "scene" or (command == "simulators" and random.random() < 0.5):
            words.append(random.choice(FILES) if random.random() < hostility else SCENE)
        return words

    def _some_options(self, random: Random, command: str, hostility: float) -> list[str]:
        options = self.options[command]
        words: list[str] = []
        if command in LINES and random.random() < 0.6:
            for name in random.choice(LINES[command]):
                words += [name, _number(random, hostility, OPTIONS[name])]
            return words
        for option in random.sample(options, random.randint(0, min(len(options), random.choice((1, 3, 9))))):
            if "--help" not in option.flags:
                words += self._option(random, option, hostility)
        return words

    def _option(self, random: Random, option: Option, hostility: float) -> list[str]:
        flag = random.choice(option.flags)
        if not option.takes_value:
            return [f"{flag}={_hostile(random)}" if random.random() < hostility / 4 else flag]
        named = next((OPTIONS[name] for name in option.flags if name in OPTIONS), option.choices)
        value = _number(random, hostility, named) if named else random.choice(NUMBERS)
        if random.random() < 0.2:
            return [f"{flag}={value}"]
        return [flag] if random.random() < hostility / 4 else [flag, value]

    def _mutated(self, random: Random, command: str, words: list[str]) -> list[str]:
        """Return the words with one of them dropped, doubled, moved, changed or added."""
        words, at = list(words), random.randrange(len(words) + 1)
        kind = random.randrange(7)
        if kind == 0 or not words:
            words.insert(at, _hostile(random))
        elif kind == 1:
            del words[at % len(words)]
        elif kind == 2:
            words.insert(at, words[at % len(words)])
        elif kind == 3:
            words.insert(at, words.pop(random.randrange(len(words))))
        elif kind == 4:
            words[at % len(words)] = _hostile(random)
        elif kind == 5:
            words[at % len(words)] = _garbled(random, words[at % len(words)])
        else:
            others = self.options[random.choice(list(self.options))]
            words[at:at] = self._option(random, random.choice(others), 0.1) if others else []
        return words

    def _tail(self, random: Random, command: str, words: list[str]) -> Sequence[str]:
        if command == "scene":
            free = random.randrange(FREE) == 0
            return ("--no-check", *(() if free else ("--costs", RESULT)))
        if command == "export" and not any(word.startswith(HEAVY) for word in words):
            return ("--pade", "3/6")  # what is exported if nothing is asked for takes half a minute
        if command in TAIL:
            return random.choice(TAIL[command])
        if command not in KNOWN:
            return ("--no-such-option",)
        return ()

    def _refused_export(self, random: Random) -> list[str]:
        """Return a line that would take long, but for a value that nobody accepts."""
        bad = random.choice(REFUSED)
        lines = (
            ["--accuracy", bad], ["--accuracy", bad, "--v-star-max", "5"], ["--inverse", bad],
            ["--minimax", "1/4", "--v-star-max", bad],
            ["--inverse", "1e-5", "--epsilon-min", random.choice(("nan", "2", "-1", "x", ""))], ["--v-star-max", bad],
            ["--from-speed", bad],
            ["--minimax", random.choice(("1/40", "300/1", "1/1", "x", "")), "--v-star-max", "5"], ["--size", "small"],
            ["--measure", bad],
        )  # fmt: skip
        words = random.choice(lines)
        return ["export", random.choice(("c", "json", "csv")), *words]

    # --- files --------------------------------------------------------------------------------------------------------

    def _files(self, random: Random, words: Sequence[str]) -> dict[str, bytes]:
        """Return the files that the words may name."""
        files = {}
        text = "\0".join(words)
        if words[0] in ("scene", "simulators"):
            files[SCENE] = scene(random)
        if words[0] == "fit" or DATA in text:
            files[DATA] = data(random)
        if RESULT in text:
            spoiled = words[0] != "report" or random.randrange(FREE) > 0
            files[RESULT] = _document(random, result(spoiled))
        return files


KNOWN = (
    "audit", "bench", "calculator", "claims", "coefficients", "epsilon", "export", "figures", "hardcases", "invert",
    "pade", "report", "fit", "plot", "reproduce", "scene", "simulators", "table", "verification",
)  # fmt: skip


def _number(random: Random, hostility: float, good: Sequence[str]) -> str:
    if random.random() >= hostility:
        return random.choice(good if random.random() < 0.2 else good[:4])
    return random.choice(NUMBERS) if random.random() < 0.6 else _hostile(random)


def _hostile(random: Random) -> str:
    return random.choice(random.choice((NUMBERS, WORDS, FILES)))


def _garbled(random: Random, word: str) -> str:
    """Return a word with one character dropped, doubled, or replaced."""
    if not word:
        return random.choice(WORDS)
    at = random.randrange(len(word))
    new: str = random.choice(("", word[at] * 2, *"0-+.eE/=_ \n\x1b٣\u202e\udc80"))
    return word[:at] + new + word[at + 1 :]


_INTEGER = re.compile(r"(.*=|-\w)?\s*[+-]?0*([0-9]{1,12})\s*", re.DOTALL)
_DEGREES = re.compile(r"(.*?)([0-9]{1,3})/([0-9]{1,3})(.*)", re.DOTALL)


def _cheap(words: list[str]) -> list[str]:
    """Replace numbers that are accepted, but would take long: orders and digits, and degrees."""
    most = 6 if words[0] == "pade" else 40
    accepted = {"30", "20"}
    cheap = []
    for word in words:
        match = _INTEGER.fullmatch(word)
        if (
            match
            and most < int(match[2]) <= 5000
            and match[2] not in accepted
            and words[0] in ("pade", "coefficients", "epsilon", "invert", "export")
        ):
            word = f"{match[1] or ''}5001"
        match = _DEGREES.fullmatch(word)
        if match and 6 < max(int(match[2]), int(match[3])) <= 200:
            word = f"{match[1]}300/1{match[4]}"
        cheap.append(word)
    return cheap


BASE = (
    """\
name = "two"
title = "Two"
[material.glass]
young_modulus = "70 GPa"
poisson_ratio = 0.22
density = "2500 kg/m^3"
restitution = { epsilon = 0.97, speed = "1 m/s", radius = "1.5 mm", partner = "wall" }
yield_strength = "1 GPa"
source = "none"
[body.ball]
material = "glass"
radius = "1.5 mm"
[body.wall]
material = "glass"
wall = true
[speed]
min = "1 cm/s"
max = "2 m/s"
[tolerance]
epsilon = 1e-3
dissipation = 0.1
absolute = 0.1
[code]
language = "c"
format = "double"
use = "scalar"
argument = "speed"
largest_table = 4096
[gas]
volume_fraction = 0.1
[units]
length = "mm"
mass = "g"
time = "us"
""",
    """\
[material.ice]
young_modulus = 1e7
poisson_ratio = 0.3
density = 900
dissipative_constant = "1e-5 s"
[material.steel]
young_modulus = 2e11
poisson_ratio = 0.28
density = 7800
dissipative_constant = 0
[body.ball]
material = "ice"
radius.median = "1 mm"
radius.geometric_deviation = 1.2
radius.tail = 1e-3
[body.wall]
material = "steel"
wall = true
[body.shot]
material = "steel"
radius = { mean = 1e-3, deviation = 1e-5 }
[[contact]]
between = ["ball", "wall"]
speed = { granular_temperature = "1 cm^2/s^2", tail = 1e-3 }
[[contact]]
between = ["ball", "shot"]
dissipative_constant = "1 us"
speed = { min = 0.1, max = 1 }
[[contact]]
between = ["ball", "ball"]
restitution = { one_minus_epsilon = 0.1, speed = 1 }
[speed]
granular_temperature = 1
[tolerance]
absolute = 0.05
[code]
language = "python"
use = "batch"
""",
)


def scene(random: Random) -> bytes:
    """Return a scene file: one that is right, changed in a few places."""
    lines = random.choice(BASE).splitlines()
    for _ in range(random.choice((0, 1, 1, 1, 2, 3, 8))):
        lines = _changed_line(random, lines)
    text = random.choice(("\n",) * 9 + ("\r\n",)).join(lines)
    content = text.encode("utf-8", "surrogatepass")
    return _broken(random, content) if random.random() < 0.15 else content


def _changed_line(random: Random, lines: list[str]) -> list[str]:
    at = random.randrange(len(lines))
    key, equals, value = lines[at].partition("=")
    kind = random.randrange(10)
    if kind <= 5 and equals:
        raw = f'"{random.choice(UNITS)}"' if random.random() < 0.5 else random.choice(RAW)
        inner = re.search(r"= ([^,}]+)([,}])", value) if value.startswith(" {") and random.random() < 0.7 else None
        new = f"{key}={value[: inner.start(1)]}{raw} {value[inner.start(2) :]}" if inner else f"{key}= {raw}"
        return [*lines[:at], new, *lines[at + 1 :]]
    if kind == 6:
        return lines[:at] + lines[at + 1 :]
    if kind == 7:
        return [*lines[:at], lines[at], *lines[at:]]
    if kind == 8:
        other = random.randrange(len(lines))
        return [*lines[:at], lines[other], *lines[at + 1 :]]
    name = random.choice(
        ("x", "a.b", '""', '"\\u001b"', "é", "'" + "n" * 100 + "'", "radius", "wall", "__class__", "1")
    )
    table = random.choice(("[{}]", "[material.{}]", "[body.{}]", "[[{}]]", "{} = 1", "[speed.{}]", "[[contact.{}]]"))
    return [*lines[:at], table.format(name), *lines[at:]]


def _broken(random: Random, content: bytes) -> bytes:
    """Return bytes with a few of them changed, cut off, or with a mark at the beginning."""
    kind = random.randrange(5)
    if kind == 0:
        return b"\xef\xbb\xbf" + content
    if kind == 1:
        return content[: random.randrange(len(content) + 1)]
    if kind == 2:
        return content.decode("utf-8", "replace").encode("utf-16")
    changed = bytearray(content)
    for _ in range(random.choice((1, 2, 5))):
        if changed:
            changed[random.randrange(len(changed))] = random.choice(b"\x00\xff\xc3\n\"'[]{}=.,#0e-\x1b\r")
    return bytes(changed)


def result(spoiled: bool) -> dict[str, Any]:
    """Return a small result of a benchmark; a spoiled one is refused for its last entry."""

    def row(name: str, group: str, measure: str) -> dict[str, Any]:
        return {
            "id": name, "label": name, "group": group, "format": "double", "speeds": "log-uniform", "measure": measure,
            "ns": {"min": 1.0, "median": 1.5, "spread": 0.1}, "ratio_to_3_6": 0.5, "ratio_to_copy": None,
        }  # fmt: skip

    def error(name: str, group: str) -> dict[str, Any]:
        return {
            "id": name, "label": name, "group": group, "format": "double", "relative": 1e-6, "loss": 1e-5,
            "proven": "1e-5 + 1 ulp",
            "note": "",
        }  # fmt: skip

    machine = dict.fromkeys(("cpu", "compiler", "system", "python", "numpy"), "x")
    return {
        "command": "viscopade bench",
        "machine": machine,
        "settings": {
            "rounds": 3,
            "scene": {"beta": 1.3, "speed_min": 1e-3, "speed_max": 1e3, "unit": "cm/s"},
            "memory_elements": 4096,
            "cache_elements": 1024,
            "flags": {"scalar": "-O2", "array": "-O3"},
        },
        "rows": [row(*names) for names in (("speed-1e-5", "ours", "throughput"), ("pow", "rival", "latency"))],
        "errors": [error("speed-1e-5", "ours"), error("pow", "rival")],
        "targets": [{"what": "a", "target": "b", "measured": 1.5, "reached": None, "note": ""}],
        "curves": [{"id": "a", "label": "A", "v_star": [0.1, 1.0], "error": [1e-6] if spoiled else [1e-6, 1e-5]}],
    }


def _document(random: Random, whole: dict[str, Any]) -> bytes:
    """Return a JSON file: one that is right (but for its end), changed in a few places."""
    for _ in range(random.choice((0, 1, 1, 1, 2, 3))):
        _change(random, whole)
    kind = random.randrange(20)
    if kind == 0:
        return b"[" * 100_000
    text = json.dumps(whole).encode()
    return _broken(random, text) if kind < 4 else text


def _change(random: Random, whole: Any) -> None:
    """Replace, remove or add a value somewhere."""
    at: Any = whole
    while True:
        keys = list(at) if isinstance(at, dict) else list(range(len(at)))
        if not keys:
            return
        key = random.choice(keys)
        if isinstance(at[key], dict | list) and random.random() < 0.85:
            at = at[key]
            continue
        kind = random.randrange(8)
        if kind == 0:
            del at[key]
        elif kind == 1 and isinstance(at, dict):
            at[random.choice(("", "x", "\x1b[31m", "id"))] = deepcopy(random.choice(JSON_VALUES))
        elif kind == 2 and isinstance(at, list):
            at.append(deepcopy(at[key]))
        else:
            at[key] = deepcopy(random.choice(JSON_VALUES))
        return
