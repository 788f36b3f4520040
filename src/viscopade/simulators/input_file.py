"""Input files for programs: the one writer, and what the comment at their beginning says.

It says what the file is for, what all contacts have in common, then tables of the types and of the contacts.
"""

from __future__ import annotations

import re
import sys
from collections.abc import Callable, Iterator, Mapping, Sequence
from textwrap import wrap
from typing import Any, NamedTuple

import numpy as np

from viscopade.arrays import double
from viscopade.arrays.checked import FloatArray
from viscopade.collision.contact import Contact
from viscopade.collision.spheres import Pair
from viscopade.generated import WIDTH, harmless, marker_lines, written_template, xml_comment
from viscopade.simulators import simulator_with
from viscopade.simulators.setup import NamedContact, Setup
from viscopade.simulators.simulator import Comment, InputFile, OwnLaw
from viscopade.theory.law import VISCOELASTIC

STEPS = 100
"""Time steps in the shortest contact; the texts state the error of eps that they leave."""
PHASES = (0.0, 0.25, 0.5, 0.75)
"""Where in a step contact begins: errors of time steps are the largest over these."""
LONG = 10
"""Times the stated time step, from which on a program's own default one is too long: 10 steps in a contact."""
WAY_OUT = "`classes = N` in the radius of the scene makes N types and divides the error by about N"
"""What to do in programs whose types have one size."""
SPEEDS = 13  # at which errors are computed
_ROUNDING = 1e-13
_TABLE = 120  # widest line of a table
_LEGEND = (
    "Contacts: speeds and exact eps, without weight, are of the slowest, the typical and the fastest impact; the "
    "duration is that of the fastest. In parentheses: how far off one eps is over the speeds and sizes."
)

Row = Mapping[tuple[str, str], str]
"""A row of a table: texts by the name and the unit of their columns, the row's own name first."""
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
    contacts = values["contacts"]
    opening = [*values["setup"].opening, *size_warning(contacts, file.way_out)]
    tables = *table(values.get("types", [])), *_wrapped(_LEGEND), *table([contact["row"] for contact in contacts])
    return input_text(file, command, opening, values, tables=tables)


def input_text(
    file: InputFile | OwnLaw,
    command: str,
    opening: Sequence[str],
    values: Mapping[str, Any],
    facts: Sequence[str] = (),
    tables: Sequence[str] = (),
) -> str:
    """Return the text of a file; `facts` are lines on its contacts that are wrapped, those of `tables` are not."""
    before, mark, after = _FRAMES[file.comment]
    use, code = (written_template(text).render(values, number=program_number) for text in (file.use, file.code))
    if file.comment == "<!--":  # sentences name an option without its hyphens, which a comment of XML cannot have
        use, *facts = (_OPTION.sub("the option ", text) for text in (use, *facts))
    parts: list[list[str]] = [
        [line for text in opening for line in _wrapped(text)],
        [*_paragraphs(use)][:-1],
        [*(line for text in facts for line in _wrapped(text)), *tables],
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


class SpeedErrors(NamedTuple):
    """The least and the greatest error of a program's eps over a range of speeds, eps/(wanted eps) - 1."""

    least: float
    greatest: float

    @property
    def largest(self) -> float:
        """The largest error in absolute value."""
        return max(self.greatest, -self.least)


def speed_errors(errors: FloatArray) -> SpeedErrors:
    """Return what is stated of errors at speeds in a geometric sequence; between them they are parabolas."""
    return SpeedErrors(-_peak(-errors), _peak(errors))


def _peak(values: FloatArray) -> float:
    """Return the maximum of a smooth function: that of the parabola through its greatest value and both neighbours."""
    i = int(np.argmax(values))
    if i in (0, len(values) - 1):
        return float(values[i])
    before, at, after = values[i - 1 : i + 2].tolist()
    return float(at + (after - before) ** 2 / (8 * (2 * at - before - after)))


def size_errors(contact: NamedContact, program: Callable[[Pair], Pair]) -> list[SpeedErrors]:
    """Return the errors for typical and for extreme sizes, if there are any, of a program with the viscoelastic law.

    Parameters
    ----------
    contact : NamedContact
    program : callable
        From a pair to the pair with the A that it has in the program.
    """
    speeds = np.geomspace(contact.slowest, contact.fastest, SPEEDS if contact.slowest < contact.fastest else 1)
    pairs = (contact.pair, *contact.extremes) if contact.extremes else ()
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


def size_warning(contacts: Sequence[Mapping[str, Any]], way_out: str) -> Iterator[str]:
    """Yield a warning about the contact whose eps is most off at the ends of its sizes, if sizes are distributed."""
    spread = [contact for contact in contacts if contact["errors"]]
    if spread:
        worst = max(spread, key=lambda contact: max(error.largest for error in contact["errors"]))
        where = worst["name"] + (", the worst contact" if len(spread) > 1 else "")
        yield f"Warning: at the ends of the sizes eps is off by {in_percent(worst['errors'])} ({where}); {way_out}."


def table(rows: Sequence[Row]) -> Iterator[str]:
    """Yield the lines of a table; what all rows have in common stands once, before it."""
    if not rows:
        return
    label, *others = dict.fromkeys(column for row in rows for column in row)
    common = [column for column in others if len({row.get(column) for row in rows}) == 1]
    if common:
        subject = f"Each {label[0]}" if len(rows) > 1 else f"{label[0].capitalize()} {rows[0][label]}"
        facts = "; ".join(f"{name} {rows[0][name, unit]} {unit}".rstrip() for name, unit in common)
        yield from _wrapped(f"{subject}: {facts}")

    # The other columns, in as many parts below one another as the width of the lines demands.
    columns = [column for column in others if column not in common]
    cells = {
        (name, unit): [f"{name} ({unit})" if unit else name, *(row.get((name, unit), "") for row in rows)]
        for name, unit in (label, *columns)
    }
    width = {column: max(map(len, texts)) + 2 for column, texts in cells.items()}
    while columns:
        part = [label, columns.pop(0)]
        while columns and sum(width[column] for column in (*part, columns[0])) <= _TABLE:
            part.append(columns.pop(0))
        for line in zip(*(cells[column] for column in part), strict=True):
            texts = (text.ljust(width[column]) for text, column in zip(line, part, strict=True))
            yield f"  {''.join(texts)}".rstrip()


def in_percent(errors: Sequence[SpeedErrors]) -> str:
    """Return the least and the greatest of several errors, such as "-21.3 to +47 %"."""
    ends = min(error.least for error in errors), max(error.greatest for error in errors)
    return " to ".join(dict.fromkeys("0" if abs(end) < _ROUNDING else f"{100 * end:+.3g}" for end in ends)) + " %"


def template_contact(
    contact: NamedContact, setup: Setup, errors: Sequence[SpeedErrors] = (), row: Row | None = None, **values: Any
) -> dict[str, Any]:
    """Return a contact for templates.

    Parameters
    ----------
    contact : NamedContact
    setup : Setup
        The contact is one of its contacts.
    errors : sequence of SpeedErrors
        Those of the program's viscoelastic law over the sizes; empty if it has none.
    row : mapping, optional
        More columns of the table.
    **values
        What the template of the code has.
    """
    pair, units = contact.pair, setup.units
    varied = contact.slowest < contact.fastest
    speeds = (contact.slowest, contact.typical, contact.fastest) if varied else (contact.typical,)
    columns = {
        ("contact", ""): contact.name,
        ("m_eff", units.mass): f"{pair.m_eff:.6g}",
        ("R_eff", units.length): f"{pair.R_eff:.6g}",
        ("E_eff", f"{units.mass}/({units.length} {units.time}^2)"): f"{pair.E_eff:.6g}",
        ("A", units.time): f"{pair.A:.6g}",
        ("beta", units.beta): f"{pair.beta:.6g}",
        ("speeds", units.speed): " ".join(f"{speed:.6g}" for speed in speeds),
        ("exact eps at them", ""): " ".join(f"{float(pair.epsilon(speed)):.7g}" for speed in speeds),
        ("lasts", units.time): f"{pair.contact_time(contact.fastest):.6g}",
    }
    if errors:
        columns["eps off by sizes", ""] = in_percent(errors)
    if contact.falls and setup.weighty:
        columns["eps with weight", ""] = " ".join(f"{eps:.4f}" for eps in contact.falling.epsilon(speeds))
    return {"name": contact.name, "contact": contact, "errors": errors, "row": columns | {**(row or {})}, **values}


def type_rows(setup: Setup, kind: str, labels: Mapping[str, str]) -> list[Row]:
    """Return the table of a program's types, materials or species: their radii, and the class of each."""
    units, rows = setup.units, list[Row]()
    for name, label in labels.items():
        body, (low, high) = setup.bodies[name], setup.radii.get(name, (None, None))
        row = {(kind, ""): harmless(label)}
        if not body.is_wall:
            row["R", units.length], row["m", units.mass] = f"{body.radius:.10g}", f"{body.mass:.10g}"
        if low is not None:
            row["for radii", units.length] = f"{low:.10g} to {high:.10g}"
        rows.append(row)
    return rows


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
