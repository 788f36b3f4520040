"""Rows of a deck: the eps of each contact and pair of sizes, computed as those of `viscopade audit SIMULATOR --set`."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from functools import cache
from typing import NamedTuple

from viscopade.collision.contact import SampledCollision
from viscopade.progress import track
from viscopade.simulators.deck import Deck, DeckContact, DeckRun, Size
from viscopade.simulators.native import (
    FileUnits,
    Impact,
    Native,
    delivery,
    effective,
    energy_warnings,
    names_without_effect,
)

TOO_DEEP = "The overlap is larger than the radius: the bodies pass through each other, whatever eps is"


class Answer(NamedTuple):
    """What a contact gives.

    Attributes
    ----------
    collision : SampledCollision or None
        The collision without weight, with its range over the phases of a time step; None if `reason` says why not.
    falling : SampledCollision or None
        The collision with weight; None for bodies that both fall, or without gravity.
    contact_time : float or None
        Duration of the undamped contact, in the unit of the file; None for an impulse, or if the bodies do not part
        without damping.
    sticking_speed : float or None
        Speed below which bodies stay together, by adhesion or by the weight; None if it is not known.
    depth : float
        The largest overlap, in the units of the file.
    instead : mapping of str to str or None
        The parameters that give the wanted eps, with the weight if there is one; None if nothing gives it.
    warnings : tuple of str
        Sentences, without their full stops.
    reason : str
        Why there is no number; "" if there is one.
    """

    collision: SampledCollision | None = None
    falling: SampledCollision | None = None
    contact_time: float | None = None
    sticking_speed: float | None = None
    depth: float = 0.0
    instead: Mapping[str, str] | None = None
    warnings: tuple[str, ...] = ()
    reason: str = ""

    @property
    def with_weight(self) -> SampledCollision:
        """The collision with weight, if there is one; else that without."""
        collision = self.falling or self.collision
        assert collision is not None
        return collision


class DeckRow(NamedTuple):
    """Two sizes of a contact in a run, and what they give; all numbers are in the units of the file.

    Attributes
    ----------
    run : DeckRun
    contact : DeckContact
    radii : tuple of float
        Those of the spheres, without a wall; empty if eps depends neither on them nor on the mass.
    impact : Impact
        Without the effective mass or radius if eps does not depend on it.
    answer : Answer
    lines : tuple of str
        Those to write for the wanted eps; empty without one, or if nothing gives it.
    reached : float or None
        The eps that these lines give, if several rows share them.
    """

    run: DeckRun
    contact: DeckContact
    radii: tuple[float, ...]
    impact: Impact
    answer: Answer
    lines: tuple[str, ...] = ()
    reached: float | None = None

    @property
    def steps(self) -> float | None:
        """The undamped contact time in time steps."""
        time, step = self.answer.contact_time, self.impact.step
        return None if time is None or step is None else time / step

    @property
    def stays_down(self) -> bool:
        """Whether the weight keeps the body down."""
        return self.answer.falling is not None and not self.answer.falling.parts

    @property
    def g_t_c_over_v(self) -> float | None:
        """Gravity times the undamped contact time over the speed; None without weight."""
        time, gravity = self.answer.contact_time, self.impact.gravity
        return None if time is None or not gravity else gravity * time / self.impact.speed


def contact_rows(deck: Deck, speed: float, epsilon: float | None = None) -> list[DeckRow]:
    """Return a row for each contact and pair of sizes: of a later run those that differ from the run before it.

    Parameters
    ----------
    deck : Deck
    speed : float
        Impact speed, in the units of the file.
    epsilon : float, optional
        The eps for which each row says what to write instead, > 0 and < 1.
    """
    native, units = deck.program.native, deck.units
    assert native is not None
    # A unit of the file is `units.metres` metres long. So the SI unit is 1/`units.metres` units of the file, and
    # `to_si` makes SI numbers of those of the file.
    to_si = FileUnits(metres=1 / units.metres, kilograms=1 / units.kilograms, seconds=1 / units.seconds)

    # Types, sizes and runs of a file have many equal collisions: each is computed once.
    @cache
    def effective_values(settings: tuple[tuple[str, str], ...], impact: Impact) -> Impact:
        """Return the impact without the mass or radius on which eps does not depend."""
        useless = names_without_effect(native, dict(settings), replace(impact, step=None).in_units(to_si))
        mass, radius = (None if name in useless else getattr(impact, name) for name in ("mass", "radius"))
        return replace(impact, mass=mass, radius=radius)

    @cache
    def answer(settings: tuple[tuple[str, str], ...], impact: Impact) -> Answer:
        """Return what the settings of a contact, names and texts, give for an impact in the units of the file."""
        # What the program makes of the settings, and what to write instead. The file says whether there is weight:
        # without gravity both bodies fall, and no warning says what weight would do.
        result = delivery(native, dict(settings), impact.in_units(to_si), epsilon, weight_is_known=True)
        collision, falling = result.collision, None
        # With gravity the collision is that of a body that falls; without it, it is computed once more.
        if impact.gravity:
            light = replace(impact, gravity=0.0).in_units(to_si)
            falling, collision = collision, delivery(native, dict(settings), light, weight_is_known=True).collision
        # Results are in the units of the program's parameters. Those of LIGGGHTS are SI units, whatever the units of
        # its file are.
        time = None if result.contact_time is None else result.contact_time * result.units.seconds / units.seconds
        sticking_speed = result.sticking and result.sticking.speed
        if sticking_speed is not None:
            sticking_speed *= result.units.metres / units.metres * units.seconds / result.units.seconds
        depth = result.collision.depth * result.units.metres / units.metres
        warnings = (*dict.fromkeys((*result.warnings, *energy_warnings(collision, impact.step))),)
        return Answer(collision, falling, time, sticking_speed, depth, result.instead, warnings)

    # A contact without a number, or without sizes, has one row, with two bodies of which nothing is known.
    unknown: tuple[tuple[Size | None, Size | None], ...] = ((None, None),)
    pairs = [
        (i, contact, sizes)
        for i, run in enumerate(deck.runs)
        for contact in run.contacts
        for sizes in (unknown if contact.reason else contact.sizes or unknown)
    ]
    # Of each run: its rows by all that decides them.
    tables: list[dict[object, DeckRow]] = [{} for _ in deck.runs]
    for number in track(range(len(pairs)), "contacts"):
        i, contact, sizes = pairs[number]
        run, settings = deck.runs[i], (*sorted(contact.settings.items()),)
        bodies = [size for size in sizes if size is not None]
        mass, radius = effective([size.mass for size in bodies]), effective([size.radius for size in bodies])
        impact = Impact(speed, mass, radius, run.gravity * contact.falls, run.step)
        try:
            if contact.reason:
                raise ValueError(contact.reason)
            impact = effective_values(settings, impact)
            result = answer(settings, impact)
        except ValueError as error:
            impact, result = Impact(speed), Answer(reason=str(error))
        # Spheres that overlap by more than the smaller radius have no contact in the sense of any law.
        sphere_radii = [size.radius for size in bodies if size.radius is not None]
        if sphere_radii and result.depth > min(sphere_radii):
            result = result._replace(warnings=(*result.warnings, TOO_DEEP))
        # The radii of bodies say their masses, too: they name the row if eps depends on either.
        radii = () if impact.mass is impact.radius is None else (*sphere_radii,)
        # Sizes on which eps does not depend make one row.
        key = (contact.name, settings, radii, impact, result.reason)
        lines = contact.lines_with(result.instead) if result.instead else ()
        tables[i].setdefault(key, DeckRow(run, contact, radii, impact, result, lines))

    # The first run has all rows, and a later one those that the run before it does not have.
    previous_tables = [{}, *tables[:-1]]
    rows = [
        row
        for table, previous in zip(tables, previous_tables, strict=True)
        for key, row in table.items()
        if key not in previous
    ]

    # Rows of one command, such as types at a wall or sizes of a type, get one line: of several the last one would
    # count for all. Lines of one command begin alike: "pair_coeff 1 2", "fix ID group".
    groups: dict[object, list[int]] = {}
    for i, row in enumerate(rows):
        if row.answer.instead:
            groups.setdefault((id(row.run), *(tuple(line.split()[:3]) for line in row.lines)), []).append(i)
    for numbers in groups.values():
        group = [rows[i] for i in numbers]
        for i, row in zip(numbers, _with_one_line(group, native, to_si), strict=True):
            rows[i] = row
    return rows


def _with_one_line(rows: list[DeckRow], native: Native, to_si: FileUnits) -> list[DeckRow]:
    """Return rows of one command with one line, that for the row in the middle, by eps, and the eps that each gets.

    Rows whose lines differ with the same number, such as pairs in a matrix of all types, stay as they are. `native` is
    the program's contact, and `to_si` makes SI numbers of those of the file.
    """
    # Of two rows the one with the smaller eps, whose number damps less: 0.70 to 0.85 is better than 0.45 to 0.70.
    middle = sorted(rows, key=lambda row: row.answer.with_weight.epsilon)[(len(rows) - 1) // 2]
    instead = middle.answer.instead or {}
    if len(rows) == 1 or len({row.contact.lines_with(instead) for row in rows}) > 1:
        return rows
    one_line_rows = []
    for row in rows:
        settings, impact = {**row.contact.settings, **instead}, row.impact.in_units(to_si)
        reached = delivery(native, settings, impact, weight_is_known=True).collision.epsilon
        answer = row.answer._replace(instead=instead)
        one_line_rows.append(row._replace(answer=answer, lines=middle.lines, reached=reached))
    return one_line_rows
