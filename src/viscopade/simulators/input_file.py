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
from viscopade.generated import WIDTH, harmless, marker_lines, text_template, xml_comment
from viscopade.simulators import simulator_with
from viscopade.simulators.setup import NamedContact, Setup
from viscopade.simulators.simulator import Comment, InputFile, OwnLaw
from viscopade.theory.law import VISCOELASTIC

STEPS = 100
"""Time steps in the shortest contact, chosen by hand; the texts state the error of eps that they leave."""
PHASES = (0.0, 0.25, 0.5, 0.75)
"""Where in a step contact begins, as a part of it: errors of time steps are the largest over these. With 100 steps in a
contact, 64 parts find errors that are at most 5 % larger (measured for eps from 0.07 to 0.999)."""
WAY_OUT = "`classes = N` in the radius of the scene makes N types and divides the error by about N"
"""What to do in programs whose types have one size."""
SPEEDS = 13
"""Number of speeds at which errors are computed. With a parabola through three of them, the largest error of a
Hunt-Crossley contact over four decades of speed is right to 1e-3 (eps = 0.5 at the middle; reference: 193 speeds)."""
_ROUNDING = 1e-13  # errors of eps below it are printed as 0: they are round-off of eps in double precision
_TABLE = 120  # columns of the widest line of a table; other lines of a comment have at most `WIDTH` = 100
_LEGEND = (
    "Contacts: speeds and exact eps, without weight, are of the slowest, the typical and the fastest impact; the "
    "duration is that of the fastest. In parentheses: how far off one eps is over the speeds and sizes."
)

Row = Mapping[tuple[str, str], str]
"""A row of a table: texts by the name and the unit of their columns, the row's own name first."""
# Most time steps in a contact in `timestep_error`. More would take longer, and with 2000 the error is below 1e-3
# already (measured for eps from 0.07 to 0.999).
_MOST_STEPS = 2000
# A collision that lasts 20 times as long as the exact contact does not end. 10 and 40 give the same errors (measured
# for eps from 0.07 to 0.999).
_PATIENCE = 20
_FRAMES: Mapping[Comment, tuple[str, str, str]] = {
    "#": ("", "# ", ""),
    "//": ("", "// ", ""),
    "/*": ("/*\n", " * ", " */\n"),
    "<!--": ("<!--\n", "    ", "-->\n"),
}
"""Before a comment of several lines, before each line, and after the comment."""
_OPTION = re.compile(r"(?<!\S)--(?=[a-z])")  # the hyphens of an option such as --gravity


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
    # `contact.extremes` are the pairs of the smallest and the largest bodies.
    for contact in setup.contacts:
        for pair in (contact.pair, *contact.extremes):
            # Where eps is no normal number, errors relative to it would be infinite.
            if float(pair.epsilon(contact.fastest)) < sys.float_info.min:
                raise ValueError(
                    f"{contact.name}: eps is too small for double precision at the fastest impact, with v* = "
                    f"{float(pair.v_star(contact.fastest)):.3g}: expected less damping, or slower impacts"
                )
    # The program's own numbers: `file.values` is a function of its module, which may replace the setup.
    file = simulator_with(target).texts[target]
    assert isinstance(file, InputFile)
    values = {"setup": setup, "units": setup.units, "command": command, **file.values(setup, **options)}
    # What all files have: sentences on the bodies and on sizes at the beginning, and tables of types and contacts.
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
    opening_mark, line_mark, closing_mark = _FRAMES[file.comment]
    use, code = (text_template(text).render(values, number=program_number) for text in (file.use, file.code))
    if file.comment == "<!--":  # sentences name an option without its hyphens, which a comment of XML cannot have
        use, *facts = (_OPTION.sub("the option ", text) for text in (use, *facts))
    # The last line of `_paragraphs` is empty: a blank line stands before each block below.
    blocks: list[list[str]] = [
        [line for text in opening for line in _wrapped(text)],
        [*_paragraphs(use)][:-1],
        [*(line for text in facts for line in _wrapped(text)), *tables],
    ]
    if file.comment == "<!--":  # a comment of XML has no "--", but a processing instruction may
        opening_mark = f"<?{harmless(command).replace('?>', '? >')}?>\n{opening_mark}"
        command = "the command is in the first line"
    lines = [*marker_lines(command), *(line for block in blocks for line in ["", *block])]
    # `harmless` escapes what a program would obey in a comment, and `xml_comment` what XML would take for its end.
    lines = [harmless(line) for line in lines]
    if file.comment == "<!--":
        lines = [xml_comment(line) for line in lines]
    head = "".join(f"{line_mark}{line}".rstrip() + "\n" for line in lines)
    return f"{opening_mark}{head}{closing_mark}{code}"


def _wrapped(text: str) -> list[str]:
    """Return `text` as lines of at most `WIDTH` = 100 columns, those after the first indented by two blanks more."""
    line = harmless(text)
    indent = line[: len(line) - len(line.lstrip())]
    return wrap(
        line, WIDTH, initial_indent="", subsequent_indent=f"{indent}  ", break_long_words=False, break_on_hyphens=False
    )


def _paragraphs(text: str) -> Iterator[str]:
    """Yield the lines of `text`, sentences wrapped anew to 100 columns; indented and empty lines are as they are."""
    # Lines of sentences are collected until an indented or empty line ends the paragraph; the last line added is empty.
    sentences = list[str]()
    for line in [*text.strip("\n").split("\n"), ""]:
        if line and not line.startswith(" "):
            sentences.append(line)
            continue
        yield from wrap(" ".join(sentences), WIDTH, break_long_words=False, break_on_hyphens=False)
        sentences = []
        yield line


class SpeedErrors(NamedTuple):
    """The least and the greatest relative error of a program's eps over a range of speeds, eps/(exact eps) - 1."""

    least: float
    greatest: float

    @property
    def largest(self) -> float:
        """The largest error in absolute value."""
        return max(self.greatest, -self.least)


def speed_errors(errors: FloatArray) -> SpeedErrors:
    """Return the range of relative errors of eps, given at speeds in a geometric sequence; parabolas are in between."""
    return SpeedErrors(-_peak(-errors), _peak(errors))


def _peak(values: FloatArray) -> float:
    """Return the maximum of a smooth function from its `values` at equal distances.

    It is that of the parabola through the greatest value and both neighbours; at an end it is the greatest value.
    """
    i = int(np.argmax(values))
    if i in (0, len(values) - 1):
        return float(values[i])
    # With values l, m, r at -1, 0, 1 the parabola is m + (r - l)/2 x - (2 m - l - r)/2 x^2. Its derivative vanishes at
    # x = (r - l)/(2 (2 m - l - r)), where it is m + (r - l)^2/(8 (2 m - l - r)).
    left, middle, right = values[i - 1 : i + 2].tolist()
    return float(middle + (right - left) ** 2 / (8 * (2 * middle - left - right)))


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
    """Return the function from a pair to the pair that a program has in place of it: with the beta of `typical`."""
    return lambda pair: pair if pair is typical else pair.damped(float(pair.dissipative_constant(typical.beta)))


def damping_per_mass(pair: Pair) -> float:
    """Return 2 A E_eff/m_eff, in 1/(length time): `eta_n0` of LAMMPS, `gamman` of LIGGGHTS.

    Times m_eff it is the factor of sqrt(R_eff d) d' in the viscoelastic force, with the compression d.
    """
    return 2 * pair.A * (pair.E_eff / pair.m_eff)


def same_damping_per_mass(typical: Pair) -> Callable[[Pair], Pair]:
    """Return the function from a pair to the pair that a program has in place of it.

    The program's damping constant is that of `typical`, and is multiplied with the effective mass of each pair.
    """
    # 2 A E_eff/m_eff is the same for all sizes, and so is E_eff: A is in proportion to m_eff.
    return lambda pair: pair.damped(typical.A * (pair.m_eff / typical.m_eff))


def size_warning(contacts: Sequence[Mapping[str, Any]], way_out: str) -> Iterator[str]:
    """Yield a warning about the contact whose eps is most off at the ends of its sizes, if sizes are distributed.

    `contacts` are those of `template_contact`, and `way_out` says what to do.
    """
    distributed = [contact for contact in contacts if contact["errors"]]
    if distributed:
        worst = max(distributed, key=lambda contact: max(error.largest for error in contact["errors"]))
        where = worst["name"] + (", the worst contact" if len(distributed) > 1 else "")
        yield f"Warning: at the ends of the sizes eps is off by {in_percent(worst['errors'])} ({where}); {way_out}."


def table(rows: Sequence[Row]) -> Iterator[str]:
    """Yield the lines of a table; what all `rows` have in common stands once, before it."""
    if not rows:
        return
    # A column is the pair of its name and unit. The first one names the row.
    label, *others = dict.fromkeys(column for row in rows for column in row)
    common = [column for column in others if len({row.get(column) for row in rows}) == 1]
    if common:
        subject = f"Each {label[0]}" if len(rows) > 1 else f"{label[0].capitalize()} {rows[0][label]}"
        facts = "; ".join(f"{name} {rows[0][name, unit]} {unit}".rstrip() for name, unit in common)
        yield from _wrapped(f"{subject}: {facts}")

    # The other columns, in as many parts below one another as the width of the lines (120) demands. Two blanks separate
    # columns.
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
    """Return the least and the greatest of several relative errors, such as "-21.3 to +47 %"."""
    # In percent, with three digits, which are enough of an error; one number if both texts are equal.
    ends = min(error.least for error in errors), max(error.greatest for error in errors)
    return " to ".join(dict.fromkeys("0" if abs(end) < _ROUNDING else f"{100 * end:+.3g}" for end in ends)) + " %"


def template_contact(
    contact: NamedContact, setup: Setup, errors: Sequence[SpeedErrors] = (), row: Row | None = None, **values: Any
) -> dict[str, Any]:
    """Return what templates have of a contact, by "name", "contact", "errors", "row" and the names of `values`.

    Parameters
    ----------
    contact : NamedContact
    setup : Setup
        The contact is one of its contacts.
    errors : sequence of SpeedErrors
        Those of the program's eps with a viscoelastic law, for typical, smallest and largest bodies; empty if it has no
        such law.
    row : mapping, optional
        More columns of the table.
    **values
        What the template of the code has.
    """
    pair, units = contact.pair, setup.units
    varied = contact.slowest < contact.fastest
    speeds = (contact.slowest, contact.typical, contact.fastest) if varied else (contact.typical,)
    # Texts by the name and the unit of their columns. Numbers have six digits, and eps seven, as 1 - eps may be small.
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
        # Eps with weight is sampled, not proven: four decimals.
        columns["eps with weight", ""] = " ".join(f"{eps:.4f}" for eps in contact.falling.epsilon(speeds))
    return {"name": contact.name, "contact": contact, "errors": errors, "row": columns | {**(row or {})}, **values}


def type_rows(setup: Setup, kind: str, labels: Mapping[str, str]) -> list[Row]:
    """Return the table of a program's types, materials or species: radius, mass and the range of radii of each.

    Parameters
    ----------
    setup : Setup
    kind : str
        Name of the first column, such as "type".
    labels : mapping of str to str
        What stands in it, by the name of a body.
    """
    units, rows = setup.units, list[Row]()
    for name, label in labels.items():
        body, (low, high) = setup.bodies[name], setup.radii.get(name, (None, None))
        row = {(kind, ""): harmless(label)}
        # 10 digits, as people copy these numbers into their own files. A wall has neither radius nor mass.
        if not body.is_wall:
            row["R", units.length], row["m", units.mass] = f"{body.radius:.10g}", f"{body.mass:.10g}"
        if low is not None:
            row["for radii", units.length] = f"{low:.10g} to {high:.10g}"
        rows.append(row)
    return rows


def shortest_contact(setup: Setup) -> float:
    """Return the shortest duration of a contact of `setup`, in its unit of time: that of the fastest impact.

    It is taken over all contacts, and over the smallest and largest bodies of each.
    """
    return min(
        float(pair.contact_time(contact.fastest))
        for contact in setup.contacts
        for pair in (contact.pair, *contact.extremes)
    )


def timestep_error(contact: NamedContact, timestep: float) -> float:
    """Return the largest relative error of eps with `timestep`, a time in the unit of the contact's numbers.

    It is taken over three speeds, the sizes and `PHASES`. LAMMPS, LIGGGHTS, YADE and MercuryDPM have the same scheme,
    semi-implicit Euler's: what they compute agrees with this to all digits. Of a contact that lasts more than 2000
    steps it is the error with 2000 steps, which is larger.
    """
    # One row for each pair of sizes and speed, one column for each phase.
    speeds = np.array([contact.slowest, contact.typical, contact.fastest])
    pairs = (contact.pair, *contact.extremes)
    v_star = np.concatenate([pair.v_star(speeds) for pair in pairs])[:, None]
    time_unit = np.concatenate([pair.time_scale(speeds) for pair in pairs])[:, None]
    # The scaled time step, but at most `_MOST_STEPS` steps in a contact, which lasts tau_c(v*).
    h = np.maximum(timestep / time_unit, double.tau_c(v_star) / _MOST_STEPS)
    # A step may be longer than the contact: then a collision is followed for 50 `_PATIENCE` = 1000 steps.
    longest = _PATIENCE * max(float(double.tau_c(v_star).max()), 50 * float(h.max()))
    # Scaled impact speed 1 and kappa = v*^2.
    epsilons = Contact.of_law(VISCOELASTIC, v_star**2).rebounds(1.0, h, PHASES, longest=longest).epsilon
    return float(np.abs(epsilons / double.epsilon(v_star) - 1).max())


def time_step(setup: Setup) -> dict[str, str]:
    """Return a time step with `STEPS` = 100 in the shortest contact, for templates.

    Under "timestep" is its number in the unit of time of `setup`, under "time_step" a sentence on the error of eps.
    """
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
