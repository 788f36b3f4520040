"""The part of `viscopade audit` that prints the eps of all contacts of a file: a deck.

    viscopade audit examples/in.hopper --speed 1
    viscopade audit examples/in.hopper --epsilon 0.8

Numbers in sentences have 4 to 6 figures (`.4g`), chosen by hand to be read; JSON and CSV have all digits.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from viscopade import arguments, files
from viscopade.cli.audit_contact import BETWEEN, si_number, values_by_name
from viscopade.cli.console import say, show, text_width
from viscopade.generated import printable

if TYPE_CHECKING:
    from viscopade.simulators.deck import Deck, Line
    from viscopade.simulators.deck_rows import DeckRow

_NUMBERS = (
    *(
        ("eps", "delivered", ".4f"),
        ("from", "least", ".4f"),
        ("to", "largest", ".4f"),
        ("falling", "falling", ".4f"),
    ),
    *(("g t_c/v", "g_t_c_over_v", ".2g"), ("t_c/step", "steps", ".3g"), ("sticks below", "sticking_speed", ".3g")),
)
"""Columns of numbers, each with its name in JSON and its format.

The figures are chosen for a table of 100 columns: eps to 1e-4, ratios to 1 %, and g t_c/v, a rule of thumb, to 10 %.
"""
_NUMBER = r"\d[\d.]*(e[+-]?\d+)?"  # as Python prints it, without a sign
DECKS = "an input of LAMMPS or LIGGGHTS, or a model of MuJoCo"


def show_deck(
    file: Path,
    epsilon: str | None,
    time_step: str | None,
    style: str,
    *,
    settings: Sequence[str],
    variable: Sequence[str],
    radius: Sequence[str],
    density: Sequence[str],
    **quantities: str | None,
) -> None:
    """Print a row for each contact of a file.

    Parameters
    ----------
    file : Path
        An input of LAMMPS or LIGGGHTS, or a model of MuJoCo.
    epsilon : str or None
        The wanted eps: also print the lines to write for it.
    time_step : str or None
        A time, instead of the file's.
    style : str
        Format of the output: text, csv or json.
    settings : sequence of str
        Empty, or "damping=tsuji (2026)", which says how the program reads `damping tsuji`.
    variable, radius, density : sequence of str
        NAME=VALUE: variables of the file, and radius or density of a type of particles that the file does not say.
    **quantities : str or None
        Texts of speed (without it 1 m/s) and gravity (instead of the file's).
    """
    from viscopade.simulators import lammps_deck, mujoco_model
    from viscopade.simulators.deck import TSUJI_2026, DeckOptions, DeckRun
    from viscopade.simulators.deck_rows import contact_rows
    from viscopade.simulators.native import Impact

    # Options with numbers become SI units; those with a unit are refused where the units of the file have no size.
    sized: list[str] = []

    # "1=0.25mm:1mm": of type 1 the least and the largest radius.
    for option, typed in (("radius", radius), ("density", density)):
        if several := next((text for text in typed if "," in text), None):
            raise click.UsageError(f"--{option} is {several}: expected one type, and --{option} again for another")
    radii: dict[str, tuple[float, ...]] = {}
    for name, text in values_by_name("--radius", radius, "1=0.25mm:1mm").items():
        radii[name] = tuple(si_number("radius", part, sized) for part in text.split(":"))
        if len(radii[name]) > 2 or radii[name][0] > radii[name][-1]:
            raise click.UsageError(f"--radius is {name}={text}: expected one radius, or the least and the largest")
    densities = {
        name: si_number("density", text, sized) for name, text in values_by_name("--density", density, "1=2500").items()
    }
    newer = f"damping={TSUJI_2026}"
    if any(text != newer for text in settings):
        raise click.UsageError(f'--set is given with a file: expected --set "{newer}", or the file with other numbers')
    said = DeckOptions(values_by_name("--variable", variable, "n=5"), radii, densities, bool(settings))
    texts = {**quantities, "time-step": time_step}
    si = {name: None if text is None else si_number(name, text, sized) for name, text in texts.items()}
    target = None
    if epsilon is not None:
        if "=" in epsilon:
            rows = "expected one number, and a command for each eps, of which you take the lines of some rows"
            raise click.UsageError(f"--epsilon is {epsilon!r}: {rows}")
        target = float(arguments.exact_number("--epsilon", epsilon, BETWEEN, lambda e: 0 < e < 1))

    if file.is_fifo():  # a file is read more than once, and names others beside it
        raise click.UsageError(f"{file} is a pipe: expected a file")
    # A model of MuJoCo is XML; no command of LAMMPS begins as XML does.
    content = files.content(file, DECKS).removeprefix(b"\xef\xbb\xbf").lstrip()
    is_xml = content.startswith(b"<")
    if is_xml and not re.search(rb"<(mujoco|robot)", content):  # MJCF or URDF, which MuJoCo reads
        raise click.UsageError(f"{file} is a file of another program: expected {DECKS}")
    if settings and is_xml:
        raise click.UsageError("--set is given with a model of MuJoCo: expected the file with other numbers")
    deck = mujoco_model.read_model(file, said) if is_xml else lammps_deck.read_input(file, said)
    if deck.missing:
        # A file that was not found may be why.
        raise click.UsageError(". ".join((f"{file} does not say {'; '.join(deck.missing)}", *deck.warnings)))
    if deck.units.unsized and sized:
        reason = deck.units.unsized.partition(", or --set")[0]  # a file says its units itself
        raise click.UsageError(f"--{sized[0]} has a unit, and {reason}")

    contacts = [contact for run in deck.runs for contact in run.contacts]
    if settings and not any(contact.settings.get("damping") == TSUJI_2026 for contact in contacts):
        raise click.UsageError(f"--set has no effect: {file} has no damping tsuji")
    if si["gravity"] is not None and not any(contact.falls for contact in contacts):
        raise click.UsageError(f"--gravity has no effect: {file} has no contact with a wall or the ground")

    # Step and gravity of an option replace those of all runs. Without --speed it is 1 m/s, chosen by hand; the output
    # says so.
    impact = Impact(si["speed"] or 1.0, gravity=si["gravity"] or 0.0, step=si["time-step"]).in_units(deck.units)
    runs = (
        DeckRun(
            run.line, impact.step or run.step, run.gravity if si["gravity"] is None else impact.gravity, run.contacts
        )
        for run in deck.runs
    )
    deck = replace(deck, runs=tuple(runs))
    # A row for each contact and pair of sizes.
    table = contact_rows(deck, impact.speed, target)
    if all(row.answer.collision is None for row in table):
        reasons = "; ".join(dict.fromkeys(row.answer.reason for row in table))
        number = " with a number" * bool(reasons)
        raise click.UsageError(f"{file} has no contact{number}: {reasons or 'expected geoms that may touch'}")
    if style == "text":
        _say_deck(deck, table, epsilon, "" if si["speed"] else ", as --speed is not given")
        return
    units = deck.units
    fields_of_rows = [_fields(row) for row in table]
    json_object = {
        "file": str(file),
        "program": deck.program.name,
        "units": {"length": units.length, "mass": units.mass, "time": units.time},
        "speed": impact.speed,
        "contacts": fields_of_rows,
        "unread": [_line_fields(line) for line in deck.unread],
        "warnings": [*dict.fromkeys([*deck.warnings, *(text for row in table for text in row.answer.warnings)])],
    }
    cells = [[_cell(value) for value in fields.values()] for fields in fields_of_rows]
    show(style, [*fields_of_rows[0]], cells, json_object)


def _fields(row: DeckRow) -> dict[str, Any]:
    """Return a row as JSON has it; numbers are in the units of the file, and None where there is none."""
    # `x and x.y`: None without a collision (`answer.reason` says why), else a number of it.
    run, contact, answer = row.run, row.contact, row.answer
    collision = answer.collision
    return {
        # Both bodies, the line that decides their contact, and how many pairs of bodies have it.
        "name": contact.name,
        "line": _line_fields(contact.line),
        "run": run.line and _line_fields(run.line),
        "pairs": contact.count,
        # Radii of the spheres, and the effective mass m1 m2/(m1 + m2).
        "radius": list(row.radii),
        "mass": row.impact.mass,
        # eps and its range over where in a step contact begins; with the weight of a body that falls on a plane.
        "delivered": collision and collision.epsilon,
        "least": collision and collision.least,
        "largest": collision and collision.largest,
        "falling": answer.falling and answer.falling.epsilon,
        # g t_c/v says how much the weight matters; `steps` is the undamped contact time t_c over the time step.
        "gravity": run.gravity,
        "g_t_c_over_v": row.g_t_c_over_v,
        "step": run.step,
        "steps": row.steps,
        "sticking_speed": answer.sticking_speed,
        # The lines to write for the wanted eps, and the eps that they give a row that shares them with others.
        "instead": None if answer.instead is None else list(row.lines),
        "reached": row.reached,
        "reason": answer.reason,
        "marks": list(contact.marks),
        "warnings": list(answer.warnings),
    }


def _line_fields(line: Line) -> dict[str, Any]:
    """Return a line of a file as JSON has it; a file in XML has no numbers of lines, 0 there and None in JSON."""
    return {"file": str(line.file), "number": line.number or None, "text": line.text}


def _cell(value: Any) -> object:
    """Return a value of JSON as CSV has it: a line as file:number, a list in lines."""
    if isinstance(value, dict):
        return f"{value['file']}:{value['number'] or ''}"
    return "\n".join(map(str, value)) if isinstance(value, list) else "" if value is None else value


def _say_deck(deck: Deck, table: Sequence[DeckRow], epsilon: str | None, speed_source: str) -> None:
    """Print what was read, a table for each run, and each remark and warning once.

    Parameters
    ----------
    deck : Deck
        What the file says of contacts.
    table : sequence of DeckRow
        A row for each contact and pair of sizes of each run.
    epsilon : str or None
        The wanted eps, as it was typed.
    speed_source : str
        What to add behind the speed: ", as --speed is not given", or "".
    """
    from viscopade.simulators.native import SPREAD

    # The first sentence counts runs, pairs of bodies and contacts; equal numbers, and no run, are not worth a word.
    units, speed = deck.units, table[0].impact.speed
    pairs = {contact.name: contact.count for run in deck.runs for contact in run.contacts}
    counts = {"run": len(deck.runs), "pair": sum(pairs.values()), "contact": len(pairs)}
    if deck.runs[0].line is None:
        del counts["run"]
    if counts["pair"] == counts["contact"]:
        del counts["pair"]
    words = ", ".join(f"{count} {name}{'s' * (count > 1)}" for name, count in counts.items())
    say(
        f"{deck.file}: {deck.program.title} in {units.length}, {units.mass} and {units.time}; {words}; eps at "
        f"{speed:.6g} {units.speed}{speed_source}, sampled"
    )

    # A table for each run.
    numbered = [*enumerate(table, 1)]
    for run in deck.runs:
        cells = [_columns(i, row, deck) for i, row in numbered if row.run is run]
        heads = [head for head in (cells[0] if cells else ()) if any(row[head] for row in cells)]
        # A terminal that is too narrow does without these, which JSON has. A column takes 2 characters beside its text.
        for optional in ("g t_c/v", f"m_eff ({units.mass})", "line"):
            width = sum(2 + max(len(row[head]) for row in ({head: head}, *cells)) for head in heads)
            if width > text_width() and optional in heads:
                heads.remove(optional)
        step = "no time step" if run.step is None else f"time step {run.step:.4g} {units.time}"
        title = f"{step}, gravity {run.gravity:.4g} {units.length}/{units.time}^2"
        if run.line is not None:
            title = f"{run.line.text}, line {_place(run.line, deck)}: {title}"
        if cells:
            say(title)
            show("text", heads, [[row[head] for head in heads] for row in cells], {})

    # Equal remarks and lines are printed once, and so are warnings that differ in their numbers only. `sentences`: from
    # kind and text, without numbers, to the full text by row. `replacements`: from weight, place and lines to rows.
    sentences: dict[tuple[str, str], dict[int, str]] = {}
    replacements: dict[tuple[str, str, tuple[str, ...]], list[int]] = {}
    for i, row in numbered:
        reasons = [f"no number: {row.answer.reason}"] if row.answer.reason else []
        if row.stays_down:
            slowest = row.answer.sticking_speed
            below = "" if slowest is None else f" below {slowest:.3g} {units.speed}"
            reasons.append(f"with its weight the body stays down{below}, and falling is 0")
        kinds = {"": (*reasons, *row.contact.marks), "Warning, ": row.answer.warnings}
        for kind, text in ((kind, text) for kind, texts in kinds.items() for text in texts):
            sentences.setdefault((kind, re.sub(_NUMBER, "#", text) if kind else text), {})[i] = text
        if row.lines:
            weight = " with weight, the column falling," if row.answer.falling else ""
            place = _position(row.lines, row.contact.line, deck)
            replacements.setdefault((weight, place, row.lines), []).append(i)
    for text in deck.warnings:  # first, as a default of the file may be why a row has a warning
        say(f"Warning: {text}.")
    for (kind, _), texts in sentences.items():
        i, text = next(iter(texts.items()))
        source = f" (the numbers of row {i})" if {*texts.values()} != {text} else ""
        say(f"{kind}{_rows([*texts])}: {text}{source}.")
    is_compromise = False
    for (weight, place, lines), numbers in replacements.items():
        # One line for several rows gives each its own eps.
        reached = sorted(eps for i in numbers if (eps := table[i - 1].reached) is not None)
        ends = [f"{eps:.4f}" for eps in (*reached[:1], *reached[-1:])]
        between = f" ({' to '.join(ends)})" if len({*ends}) > 1 else ""
        is_compromise |= bool(reached) and reached[-1] - reached[0] > SPREAD
        # Rows for which no number gives the wanted eps share a line that is replaced, too.
        shared = table[numbers[0] - 1].contact.line if place.startswith(" instead of line") else None
        is_compromise |= any(row.contact.line == shared and not row.lines for row in table)
        say(f"for eps = {epsilon}{between}{weight} in {_rows(numbers)} write{place}")
        click.echo("\n".join(f"    {printable(line)}" for line in lines))
    if is_compromise:
        say("A line has one number for all its rows. For closer eps give sizes types of their own.")
        if any("wall/gran" in line for _, _, lines in replacements for line in lines):
            say("For a number of its own at a wall a type needs a group, made before fix pour, which pours into it.")
    # Lines to write may contradict each other. A command names what it sets in its first three words ("pair_coeff 1 2",
    # "fix ID group"); a model has one <option>.
    written = dict.fromkeys(line for _, _, lines in replacements for line in lines)
    if len({(*line.split()[: 1 if line.startswith("<option") else 3],) for line in written}) < len(written):
        say("Of lines that begin alike the last one counts: each is for its rows alone. Give sizes types of their own.")
    if deck.unread:
        names = [_command(line.text.split()) for line in deck.unread]
        places = [f"{name} (line {_place(line, deck)})" for name, line in zip(names, deck.unread, strict=True)]
        say(f"not read: {', '.join(places)}")


def _position(lines: Sequence[str], line: Line, deck: Deck) -> str:
    """Return where in a file `lines`, which are to be written, belong; `line` of the `deck` is that of the contact."""
    command = lines[-1].split()[0]
    if command.startswith("<"):
        places = {"<geom": " in both geoms of each pair", "<pair": " in <contact>"}
        # A second <pair> of the same geoms would act beside the first.
        if command == "<pair" and line.text.startswith("<pair"):
            places[command] = " in <contact> instead of the <pair> of the same geoms"
            if line.number and len(lines) == 1:
                return f" instead of the <pair> in line {_place(line, deck)}"
        return places.get(command, "")
    # "fix ID all property/global …": the fix of this name, and not the line of the contact.
    if "property/global" in lines[-1]:
        return f" instead of {' '.join(lines[-1].split()[:2])}"
    # A later pair_coeff replaces an earlier one; a wall would be there twice.
    return f" {'after' if command == 'pair_coeff' else 'instead of'} line {_place(line, deck)}"


def _rows(numbers: Sequence[int]) -> str:
    """Return "row 1", or "rows 1 to 3, 5": three consecutive numbers or more are a range."""
    # Collect runs of consecutive numbers; "1, 2" is shorter than "1 to 2".
    ranges: list[list[int]] = []
    for i in numbers:
        if ranges and ranges[-1][-1] == i - 1:
            ranges[-1].append(i)
        else:
            ranges.append([i])
    words = (f"{run[0]} to {run[-1]}" if len(run) > 2 else ", ".join(map(str, run)) for run in ranges)
    return f"row{'s' * (len(numbers) > 1)} {', '.join(words)}"


def _command(words: Sequence[str]) -> str:
    """Return the name of a command, of a fix with its style: "fix ID group style" has it as the fourth word."""
    return " ".join(words[:4:3] if words[0] == "fix" else words[:1])


def _place(line: Line, deck: Deck) -> str:
    """Return the number of a line, after the name of its file if this is an included one."""
    return f"{line.number or ''}" if line.file == deck.file else f"{line.file.name}:{line.number}"


def _columns(i: int, row: DeckRow, deck: Deck) -> dict[str, str]:
    """Return the cells of row `i`, with the heads of their columns as keys; an empty cell is ""."""
    # In LAMMPS "type 1 - type 2" is short as "1 - 2" in a column "types". Four figures of a radius or mass tell sizes
    # of a mixture apart.
    fields, contact, units = _fields(row), row.contact, deck.units
    if row.impact.step is None:  # then there is no range over phases
        fields |= {"least": None, "largest": None}
    if row.stays_down:  # a sentence has this speed
        fields |= {"sticking_speed": None}
    typed = contact.name.startswith("type ")
    pairs = f" ({contact.count} pairs)" if contact.count > 1 else ""
    return {
        "row": str(i),
        "types" if typed else "contact": contact.name.replace("type ", "") if typed else contact.name + pairs,
        "line": _place(contact.line, deck),
        f"radius ({units.length})": ", ".join(f"{radius:.4g}" for radius in row.radii),
        f"m_eff ({units.mass})": "" if row.impact.mass is None else f"{row.impact.mass:.4g}",
    } | {head: "" if fields[key] is None else f"{fields[key]:{figures}}" for head, key, figures in _NUMBERS}
