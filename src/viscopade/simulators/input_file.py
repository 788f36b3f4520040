"""Input files for programs: the one writer, and what the comment at their beginning says.

It says what the file is for, the numbers of each contact, errors of eps over its speeds, and the time step.
"""

from __future__ import annotations

import re
import sys
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from textwrap import wrap
from typing import Any

import numpy as np

from viscopade.arrays import double
from viscopade.arrays.checked import FloatArray
from viscopade.collision.contact import Contact
from viscopade.collision.spheres import Pair
from viscopade.generated import WIDTH, harmless, marker_lines, written_template, xml_comment
from viscopade.simulators import simulator_with
from viscopade.simulators.setup import NamedContact, Setup, Units
from viscopade.simulators.simulator import Comment, InputFile, OwnLaw
from viscopade.theory.law import VISCOELASTIC

STEPS = 100
"""Time steps in the shortest contact; the texts state the error of eps that they leave."""
PHASES = (0.0, 0.25, 0.5, 0.75)
"""Where in a step contact begins: errors of time steps are the largest over these."""
LONG = 10
"""Times the stated time step, from which on a program's own default one is too long: 10 steps in a contact."""
LARGE = 0.01
"""Relative error of eps over the sizes from which on texts warn."""
SPEEDS = 13  # at which errors are computed
_ROUNDING = 1e-13
_MOST_STEPS = 2000  # of one collision in `timestep_error`
_PATIENCE = 20  # a collision that takes so many times as long as it should does not end
_FRAMES: Mapping[Comment, tuple[str, str, str]] = {
    "#": ("", "# ", ""),
    "//": ("", "// ", ""),
    "/*": ("/*\n", " * ", " */\n"),
    "<!--": ("<!--\n", "    ", "-->\n"),
}
"""Before a comment of several lines, before each line, and after the comment."""
_OPTION = re.compile(r"(?<!\S)--(?=[a-z])")


def render(target: str, setup: Setup, command: str, **options: str) -> str:
    """Return the text for a simulator that has the viscoelastic law, or what is nearest to it.

    Parameters
    ----------
    target : str
        Its target.
    setup : Setup
        Bodies, contacts and speeds.
    command : str
        The command line that makes the text.
    **options : str
        Those of the simulator's own values, such as the tier of REBOUND's kernel.

    Raises
    ------
    ValueError
        For contacts that the simulator cannot have.
    """
    for contact in setup.contacts:
        for pair in (contact.pair, *contact.extremes):
            # Where eps is no normal number, errors relative to it would be infinite.
            if float(pair.epsilon(contact.fastest)) < sys.float_info.min:
                raise ValueError(
                    f"{contact.name}: eps is too small for double precision at the fastest impact, with v* = "
                    f"{float(pair.v_star(contact.fastest)):.3g}: expected less damping, or slower impacts"
                )
    file = simulator_with(target).texts[target]
    assert isinstance(file, InputFile)
    values = {"setup": setup, "units": setup.units, "command": command, **file.values(setup, **options)}
    return written(file, command, values["setup"].opening, values)


def written(file: InputFile | OwnLaw, command: str, opening: Sequence[str], values: Mapping[str, Any]) -> str:
    """Return the text of a file."""
    before, mark, after = _FRAMES[file.comment]
    use, code = (written_template(text).render(values, number=program_number) for text in (file.use, file.code))
    facts = [text for contact in values["contacts"] for text in contact["lines"]]
    if file.comment == "<!--":  # sentences name an option without its hyphens, which a comment of XML cannot have
        use, *facts = (_OPTION.sub("the option ", text) for text in (use, *facts))
    parts: list[list[str]] = [
        [line for text in opening for line in _wrapped(text)],
        [*_paragraphs(use)][:-1],
        [line for text in facts for line in _wrapped(text)],
    ]
    if file.comment == "<!--":  # a comment of XML has no "--", but a processing instruction may
        before = f"<?{harmless(command).replace('?>', '? >')}?>\n{before}"
        command = "the command is in the first line"
    lines = [harmless(line) for line in [*marker_lines(command), *(line for part in parts for line in ["", *part])]]
    if file.comment == "<!--":
        lines = [xml_comment(line) for line in lines]
    head = "".join(f"{mark}{line}".rstrip() + "\n" for line in lines)
    return f"{before}{head}{after}{code}"


def _wrapped(text: str) -> list[str]:
    """Return a line as lines that are not too long, those after the first indented."""
    line = harmless(text)
    indent = line[: len(line) - len(line.lstrip())]
    return wrap(
        line, WIDTH, initial_indent="", subsequent_indent=f"{indent}  ", break_long_words=False, break_on_hyphens=False
    )


def _paragraphs(text: str) -> Iterator[str]:
    """Yield the lines of sentences, wrapped anew; indented and empty lines are as they are."""
    sentences = list[str]()
    for line in [*text.strip("\n").split("\n"), ""]:
        if line and not line.startswith(" "):
            sentences.append(line)
            continue
        yield from wrap(" ".join(sentences), WIDTH, break_long_words=False, break_on_hyphens=False)
        sentences = []
        yield line


@dataclass(frozen=True)
class SpeedErrors:
    """Errors of a program's eps over a range of speeds, eps/(wanted eps) - 1.

    Attributes
    ----------
    slowest, fastest : float
        At the ends.
    greatest, least : float
        Of all.
    """

    slowest: float
    fastest: float
    greatest: float
    least: float

    @property
    def largest(self) -> float:
        """The largest error in absolute value."""
        return max(self.greatest, -self.least)


def speed_errors(errors: FloatArray) -> SpeedErrors:
    """Return what is stated of errors at speeds in a geometric sequence; between them they are parabolas."""
    return SpeedErrors(float(errors[0]), float(errors[-1]), _peak(errors), -_peak(-errors))


def _peak(values: FloatArray) -> float:
    """Return the maximum of a smooth function: that of the parabola through its greatest value and both neighbours."""
    i = int(np.argmax(values))
    if i in (0, len(values) - 1):
        return float(values[i])
    before, at, after = values[i - 1 : i + 2].tolist()
    return float(at + (after - before) ** 2 / (8 * (2 * at - before - after)))


def size_errors(contact: NamedContact, program: Callable[[Pair], Pair]) -> list[SpeedErrors]:
    """Return the errors for typical and for extreme sizes, of a program with the viscoelastic law.

    Parameters
    ----------
    contact : NamedContact
    program : callable
        From a pair to the pair with the A that it has in the program.
    """
    speeds = np.geomspace(contact.slowest, contact.fastest, SPEEDS if contact.slowest < contact.fastest else 1)
    pairs = (contact.pair, *contact.extremes)
    return [speed_errors(np.asarray(program(pair).epsilon(speeds) / pair.epsilon(speeds) - 1)) for pair in pairs]


def same_beta(typical: Pair) -> Callable[[Pair], Pair]:
    """Return the pairs of a program that has the beta of the typical pair for all sizes."""
    return lambda pair: pair if pair is typical else pair.damped(float(pair.dissipative_constant(typical.beta)))


def damping_per_mass(pair: Pair) -> float:
    """Return 2 A E_eff/m_eff: over the effective mass, the factor of sqrt(R_eff d) d' in the viscoelastic force."""
    return 2 * pair.A * (pair.E_eff / pair.m_eff)


def same_damping_per_mass(typical: Pair) -> Callable[[Pair], Pair]:
    """Return the pairs of a program whose damping constant is multiplied with the effective mass of each pair."""
    return lambda pair: pair.damped(typical.A * (pair.m_eff / typical.m_eff))


def error_lines(found: Sequence[SpeedErrors]) -> Iterator[str]:
    """Yield a line for typical sizes and, if there are others, one for each extreme."""
    for label, each in zip(("", "sizes with the least v*: ", "sizes with the largest v*: "), found, strict=False):
        ends = each.slowest, each.fastest
        most = max(map(abs, ends))
        between = f", up to {each.largest:.2e} between" if each.largest > max(most, _ROUNDING) else ""
        slow, fast = map(_signed, ends)
        yield f"  {label}relative error of eps: {slow} at the slowest, {fast} at the fastest speed{between}"


def size_lines(contact: NamedContact, program: Callable[[Pair], Pair], way_out: str) -> Iterator[str]:
    """Yield lines on the errors for typical and for extreme sizes, and a warning with a way out if they are large."""
    errors = size_errors(contact, program)
    yield from error_lines(errors)
    if max(each.largest for each in errors) > LARGE:
        yield f"  Warning: over the sizes and speeds eps is off by {in_percent(errors)} of the right one; {way_out}"


def in_percent(errors: Sequence[SpeedErrors]) -> str:
    """Return the least and the greatest of several errors, such as "-21 % to +47 %"."""
    least, greatest = min(each.least for each in errors), max(each.greatest for each in errors)
    return f"{100 * least:+.0f} % to {100 * greatest:+.0f} %"


def _signed(error: float) -> str:
    """Return an error as text; what is left of the same law twice is rounding."""
    return "0" if abs(error) < _ROUNDING else f"{error:+.2e}"


def described(contact: NamedContact, units: Units, *more: str, **values: Any) -> dict[str, Any]:
    """Return a contact for templates: with lines on its numbers, speeds and eps, more lines, and other values."""
    pair = contact.pair
    speeds = (contact.slowest, contact.typical, contact.fastest)
    lines = [
        f"{contact.name}: m_eff {pair.m_eff:.6g} {units.mass}, R_eff {pair.R_eff:.6g} {units.length},",
        f"  E_eff {pair.E_eff:.6g} {units.mass}/({units.length} {units.time}^2), A {pair.A:.6g} {units.time}, "
        f"beta {pair.beta:.6g} {units.beta}",
        f"  speeds (slowest, typical, fastest): {', '.join(f'{v:.6g}' for v in speeds)} {units.speed}",
        f"  exact eps at them, without weight: {', '.join(f'{pair.epsilon(v):.8f}' for v in speeds)}",
        f"  the fastest contact lasts {pair.contact_time(contact.fastest):.6g} {units.time}",
        *more,
    ]
    return {"name": contact.name, "contact": contact, "pair": pair, "lines": lines, **values}


def shortest_contact(setup: Setup) -> float:
    """Return the shortest duration of contact, a time."""
    return min(
        float(pair.contact_time(contact.fastest))
        for contact in setup.contacts
        for pair in (contact.pair, *contact.extremes)
    )


def timestep_error(contact: NamedContact, timestep: float) -> float:
    """Return the largest relative error of eps with a time step, over the contact's three speeds and `PHASES`.

    LAMMPS, LIGGGHTS, YADE and MercuryDPM have the same scheme: what they compute agrees with this to all digits. Of a
    contact that lasts more than 2000 steps it is the error with 2000 steps, which is larger.
    """
    speeds = np.array([contact.slowest, contact.typical, contact.fastest])
    pairs = (contact.pair, *contact.extremes)
    v_star = np.concatenate([pair.v_star(speeds) for pair in pairs])[:, None]
    unit = np.concatenate([pair.time_scale(speeds) for pair in pairs])[:, None]
    h = np.maximum(timestep / unit, double.tau_c(v_star) / _MOST_STEPS)
    longest = _PATIENCE * max(float(double.tau_c(v_star).max()), 50 * float(h.max()))
    found = Contact.of_law(VISCOELASTIC, v_star**2).rebounds(1.0, h, PHASES, longest=longest).epsilon
    return float(np.abs(found / double.epsilon(v_star) - 1).max())


def time_step(setup: Setup) -> dict[str, str]:
    """Return a time step with `STEPS` in the shortest contact for templates, and a sentence on the error of eps."""
    step = shortest_contact(setup) / STEPS
    error = max(timestep_error(contact, step) for contact in setup.contacts)
    return {
        "timestep": f"{step:.6g}",
        "time_step": f"Time step: {step:.6g} {setup.units.time} is {STEPS} steps in the shortest contact. With it eps "
        f"is off by up to {error:.1e} (computed with the program's scheme). The error falls in proportion to the step.",
    }


def program_number(number: float) -> str:
    """Return a number as a program reads it: 12 digits, which do not depend on the last bit of a math library."""
    return f"{number:.12g}"
