"""The one writer of input files: a comment that says what the file is for and what eps it gives, and the code."""

from __future__ import annotations

import math
import re
import sys
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from textwrap import wrap
from typing import Any

from viscopade.collision.weight import loss_slope
from viscopade.generated import WIDTH, harmless, marker_lines, written_template, xml_comment
from viscopade.simulators import simulator_with
from viscopade.simulators.formula import TooFewSteps
from viscopade.simulators.setup import NO_WEIGHT, SI, Setup, Units
from viscopade.simulators.simulator import Comment, InputFile, OwnLaw, Simulator
from viscopade.simulators.soft import (
    CHOSEN_STEPS,
    FEWEST_STEPS,
    MOST_STEPS,
    SPREAD,
    STEP_ERROR,
    SoftContact,
    Softness,
    Wanted,
    best_line,
    outweighs,
    ways_out,
    weighed_lines,
)
from viscopade.simulators.stated import error_lines, program_number
from viscopade.theory.law import VISCOELASTIC

_FRAMES: Mapping[Comment, tuple[str, str, str]] = {
    "#": ("", "# ", ""),
    "//": ("", "// ", ""),
    "/*": ("/*\n", " * ", " */\n"),
    "<!--": ("<!--\n", "    ", "-->\n"),
}
"""Before a comment of several lines, before each line, and after the comment."""
_MADE_UP = 0.01  # difference of eps from the wanted one up to which the damping makes up for a time step
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
    return _written(file, command, values["setup"].opening, values)


def render_own_law(
    target: str,
    wanted: Sequence[Wanted],
    command: str,
    *,
    opening: Sequence[str],
    softness: Softness | None = None,
    time_step: float | None = None,
    step_error: float = STEP_ERROR,
    units: Units = SI,
) -> str:
    """Return the text for a simulator whose contacts have a law of their own.

    Parameters
    ----------
    target : str
        Its target.
    wanted : sequence of Wanted
        Its contacts.
    command : str
        The command line that makes the text.
    opening : sequence of str
        Lines at its beginning.
    softness : Softness, optional
        Of all contacts; that of viscoelastic ones if it is not given.
    time_step : float, optional
        The damping makes up for it.
    step_error : float
        Relative error of eps for which the text states the longest time step.
    units : Units
        Of all numbers.

    Raises
    ------
    ValueError
        If no contact of the program has the wanted eps.
    """
    simulator = simulator_with(target)
    own = simulator.texts[target]
    assert isinstance(own, OwnLaw)
    contacts = []
    for each in wanted:
        formula = simulator.formula(own.formula)
        given = softness or Softness()
        try:
            contact = SoftContact(formula, each, given, time_step, own.carried, units)
        except TooFewSteps as error:
            assert time_step is not None
            light = SoftContact(formula, replace(each, with_weight=None), given, None, own.carried, units)
            raise ValueError(_refused(str(error), light, each, time_step)) from None
        stiffness = contact.stiffness_over_mass if own.per_mass else contact.stiffness
        if own.per_mass and stiffness is None:
            raise ValueError(
                f"{simulator.title} needs a stiffness: expected --stiffness, --contact-time, --penetration, or "
                "--time-step for a contact of 20 steps"
            )
        steps = _on_steps(contact, simulator, units, step_error)
        contacts.append(
            {
                "name": each.name,
                "lines": [*_facts(contact, own, units), *steps],
                "stiffness": None if stiffness is None else program_number(stiffness),
                own.number: program_number(_number(contact, own, contact.parameter)),
            }
        )
    return _written(own, command, opening, {"contacts": contacts, "units": units, "time_step": time_step})


def _written(file: InputFile | OwnLaw, command: str, opening: Sequence[str], values: Mapping[str, Any]) -> str:
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


def _number(contact: SoftContact, own: OwnLaw, parameter: float) -> float:
    """Return the number that the text has for a parameter of the formula."""
    if own.per_mass:
        assert contact.stiffness_over_mass is not None
        return parameter * math.sqrt(contact.stiffness_over_mass)
    return parameter / contact.wanted.typical if own.per_speed else parameter


def _facts(contact: SoftContact, own: OwnLaw, units: Units) -> Iterator[str]:
    """Yield lines on a contact: its eps over the speeds, how long and deep it is, and what weight does."""
    wanted, law = contact.wanted, contact.formula.law
    of = "without weight" if wanted.with_weight is None else "of a body that falls on a plane"
    yield (
        f"{wanted.name}: eps = {contact.epsilon:.6g} at {wanted.typical:.6g} {units.speed} {of}; the law is "
        f"{law.equation}, kappa = {contact.kappa:.10g}, and contact ends where the force vanishes"
    )
    if wanted.with_weight is not None:
        yield from weighed_lines(contact)
    elif wanted.slowest < wanted.fastest:
        yield from _over_speeds(contact, own, units)
    elif law.nu != 2:
        yield "  at other speeds eps is different: --speeds MIN:MAX states its error"
    if contact.contact_time is not None and contact.penetration is not None:
        weight = ", without weight" if wanted.with_weight is None and wanted.gravity else ""
        chosen = f" ({CHOSEN_STEPS} time steps, as nothing else says how long)" if contact.is_chosen else ""
        lasts = f"lasts {contact.contact_time:.6g} {units.time}{chosen}"
        lasts = lasts if contact.contact_time < math.inf else "does not end in some collisions"
        yield (
            f"  contact {lasts} at the typical speed, the penetration reaches {contact.penetration:.4g} {units.length} "
            f"at the fastest{weight}"
        )
    yield from _on_stiffness(contact, own, units)
    yield from _on_weight(contact, units)


def _on_stiffness(contact: SoftContact, own: OwnLaw, units: Units) -> Iterator[str]:
    """Yield a line on the stiffness that the text has: whether it is over a mass."""
    k, k_m, mass, law = contact.stiffness, contact.stiffness_over_mass, contact.wanted.mass, contact.formula.law
    power, length = ("", "") if law.elastic == 1 else (f"^({law.elastic})", f" {units.length}^({law.elastic - 1})")
    unit = law.stiffness_unit if units == SI else f"{units.mass}/({units.time}^2{length})"
    of = "" if mass is None else f" of the effective mass {mass:.6g} {units.mass}"
    if own.per_mass and k_m is not None:
        whole = "" if k is None else f": k = {k:.6g} {unit}{of}"
        yield f"  stiffness {k_m:.6g} 1/{units.time}^2, which is per effective mass{whole}"
    elif k is not None:
        yield f"  stiffness {k:.6g} {unit}, not per mass: k of the force k x{power}"


def _over_speeds(contact: SoftContact, own: OwnLaw, units: Units) -> Iterator[str]:
    wanted = contact.wanted
    ends = wanted.slowest, wanted.fastest
    own_values, others = ([f"{value:.6g}" for value in map(eps, ends)] for eps in (contact.delivered, wanted.epsilon))
    of = "viscoelastic spheres" if wanted.law == VISCOELASTIC else f"the law {wanted.law}"
    yield (
        f"  eps at {ends[0]:.6g} and {ends[1]:.6g} {units.speed}: {' and '.join(own_values)}; of {of} "
        f"{' and '.join(others)}"
    )
    yield from error_lines(contact.errors())
    yield from best_line(contact, own.number, lambda parameter: _number(contact, own, parameter))


def _on_weight(contact: SoftContact, units: Units) -> Iterator[str]:
    """Yield lines on the weight of a body that falls on a plane."""
    wanted, falling = contact.wanted, contact.falling
    if not wanted.gravity:
        yield f"  {NO_WEIGHT}"
    elif falling is None:
        factor = f"1 + {loss_slope(contact.formula.law):.3f} g t_c/v"
        yield f"  weight multiplies the loss 1 - eps by about {factor}; nothing says how long contact lasts"
    else:
        note, fall = falling.sentences(wanted.slowest, wanted.fastest, units.speed, wanted.with_weight is not None)
        yield f"  {note}"
        if fall is not None and contact.time_step is not None:  # that sentence is without steps
            speeds = list(dict.fromkeys((wanted.fastest, wanted.slowest)))
            heavy, light = (
                " and ".join(f"{contact.delivered(v, falls=falls):.4f}" for v in speeds) for falls in (True, False)
            )
            fall = (
                f"a body that falls on a plane at {' and '.join(f'{v:.4g}' for v in speeds)} {units.speed} rebounds "
                f"with eps = {heavy} (mean, sampled), without weight {light}"
            )
        if fall is not None:
            yield f"  {'Warning: ' if wanted.with_weight is None else ''}{fall}"


def _refused(error: str, light: SoftContact, wanted: Wanted, time_step: float) -> str:
    """Return an error of a contact in time steps, with options that mend it; `light` has neither steps nor weight."""
    ways = list(ways_out(light, wanted, time_step))
    expected = " or ".join(ways) or f"a contact of more than {MOST_STEPS} time steps"
    reason = "" if any(way.startswith("--contact-time") for way in ways) else ", and a longer contact does not help"
    if outweighs(wanted, time_step):
        gained = f"{wanted.gravity * time_step:.3g} {light.units.speed}"
        reason = f", as the weight changes the speed by {gained} in a step: only shorter steps help"
    return f"{error}{reason}: expected {expected}"


def _on_steps(contact: SoftContact, simulator: Simulator, units: Units, step_error: float) -> Iterator[str]:
    """Yield lines on the time step for which the damping makes up, or on that of the program."""
    found, default = contact.stepped(), simulator.default_step
    if found is not None and contact.time_step is not None:
        makes_up = "the damping" if abs(found.epsilon - contact.epsilon) < _MADE_UP else "no damping"
        yield (
            f"  with the time step {contact.time_step:.6g} {units.time}, for which {makes_up} makes up: eps = "
            f"{found.epsilon:.6g} on average, {found.least:.6g} to {found.largest:.6g} in single collisions"
        )
        if found.largest - found.least > SPREAD and found.duration < math.inf:
            way = next(ways_out(contact, contact.wanted, contact.time_step, SPREAD), None)
            if way is not None:
                yield f"  with {way} single collisions differ by {SPREAD:g} at most"
        return
    longest = contact.longest_step(step_error)
    if contact.formula.scheme is not None and longest is None:
        yield "  the longest time step is not known, as nothing says how long contact lasts"
    if longest is not None:
        light = "" if contact.wanted.with_weight is None else ", without weight"
        yield (
            f"  Time steps up to {longest:.4g} {units.time} change eps by at most {100 * step_error:g} %"
            f"{light}. For a longer step, give --time-step: viscopade then adapts the damping."
        )
    if default is not None and longest is not None and default > longest:
        yield from default_step_warning(contact, simulator.title, default, units)


def default_step_warning(contact: SoftContact, title: str, step: float, units: Units) -> Iterator[str]:
    """Yield a warning if a program's default time step is too long for a contact."""
    assert contact.contact_time is not None
    steps, name = contact.contact_time / step, f"{title}'s default step of {units.time_text(step)}"
    found = contact.stepped(step) if steps >= FEWEST_STEPS else None
    off = f"{name} is {1 / steps:.2g} contacts long"
    if found is not None:
        off = (
            f"with {name} eps is {found.epsilon:.4g} on average, {found.least:.4g} to {found.largest:.4g} in single "
            "collisions"
        )
        try:
            adapted = replace(contact, time_step=step)
        except ValueError:  # no damping gives this eps in so few steps
            adapted = None
        if adapted is not None:
            yield f'  Warning: {off}; --time-step "{units.time_text(step)}" adapts the damping'
            return
    way = next(ways_out(contact, contact.wanted, step), None)
    if way is None:
        yield f"  Warning: {off}"
    elif way.startswith("--contact-time"):
        yield f"  Warning: {off}; {way} makes a contact that it resolves"
    else:
        yield f"  Warning: {off}; shorter steps are necessary: {way}"
