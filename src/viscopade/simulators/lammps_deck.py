"""The reader of inputs of LAMMPS and LIGGGHTS."""

from __future__ import annotations

import shlex
from collections.abc import Sequence

from viscopade.simulators.lammps import GranularLine, granular_line
from viscopade.simulators.liggghts import ModelLine, model_line


def line_settings(text: str) -> dict[str, str]:
    """Return the parameters of the program's `Native` that one line of an input says, but for its units.

    Lines of LAMMPS are `pair_coeff` and `fix … wall/gran granular …` of granular contacts, and `pair_style gran/…` and
    `fix … wall/gran` with a style such as `hertz/history`; those of LIGGGHTS are `pair_style gran model …` and
    `fix … wall/gran model …`, whose materials stand in other lines.

    Raises
    ------
    OtherModel
        If the contact has a model that is not computed here; a ValueError.
    ValueError
        If it is no such line.

    Examples
    --------
    >>> line_settings("pair_coeff 1 1 hertz/material 1e6 0.8 0.4 tangential mindlin NULL 1 0.5 damping tsuji")
    {'normal': 'hertz/material', 'coefficients': '1e6 0.8 0.4', 'damping': 'tsuji', 'limit_damping': 'no'}
    """
    lines = text.replace("&\n", " ").partition("#")[0].strip()
    try:
        words = shlex.split(lines)
    except ValueError:
        raise ValueError(f"{lines!r} is no line of an input: expected a quote at the end of its text") from None
    return contact_line(words).settings


def contact_line(words: Sequence[str]) -> GranularLine | ModelLine:
    """Return what the words of a line say of a contact.

    Raises
    ------
    ValueError
        If it is no line that says what a contact is.
    """
    command = words[0] if words else ""
    if command == "pair_coeff" and len(words) > 3:
        # A hybrid style has the name of its sub-style before the coefficients.
        return granular_line(words, 4 if words[3] == "granular" else 3)
    if command == "pair_style" and words[1:2] == ["gran"]:
        return model_line(words, 2)
    if command == "pair_style" and len(words) > 1 and words[1].startswith("gran/"):
        # LIGGGHTS has at most one or two numbers here, LAMMPS six.
        return granular_line(words, 1) if len(words) > 7 else model_line(words, 1)
    if command == "fix" and len(words) > 4 and words[3].startswith("wall/gran"):
        if words[3] not in ("wall/gran", "wall/gran/region"):
            return model_line(words, 3)
        return model_line(words, 4) if words[4] == "model" else granular_line(words, 5 if words[4] == "granular" else 4)
    accepted = "pair_coeff 1 1 hertz …, pair_style gran/…, pair_style gran model … or fix … wall/gran …"
    raise ValueError(f"{' '.join(words)!r} is no line of a contact: expected {accepted}")
