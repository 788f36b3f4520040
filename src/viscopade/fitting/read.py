"""Reader of measured data, from several files and sheets at once, with units in the headers.

A sheet has one of these sets of columns, and may have others besides:

- `speed`, `epsilon`, and if known `sigma_epsilon`, `sigma_speed` (standard errors) and `contact_time`;
- `speed`, `speed_out`: speeds before and after collisions;
- `time`: the instants at which a body hits the plane, and if known `release_time`, when it leaves the plane, or
  `contact_time`; or `interval`, the times between these instants;
- `height`: the height of release, then those of the rebounds; or `drop_height` and `rebound_height`;
- `time` or `frame`, and `position`: a vertical coordinate of a body that falls on a plane;
- `bounce 0`, `bounce 1`, …: the instants of one drop in a row, as phyphox exports them (also `Start`, `Stop 1`, …).

A column `drop` tells the drops apart in a sheet with several. The column `sigma` has the standard errors of instants or
heights.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import PurePath
from typing import NamedTuple

import numpy as np

from viscopade.arrays.checked import FloatArray
from viscopade.fitting import bounces, tracks
from viscopade.fitting.columns import IN_VACUUM, Columns, Options, known_columns, places_of
from viscopade.fitting.points import Points
from viscopade.fitting.sheets import Sheet, sheets

ACCEPTED = (
    "speed and epsilon, or speed and speed_out; or time, the instants of bounces; or height, of release and rebounds; "
    "or drop_height and rebound_height; or time (or frame) and position; or phyphox's bounce 0, bounce 1, …"
)
SLOWEST, FASTEST, FASTEST_FLIGHT = 1e-9, 1e4, 100.0
"""Speeds that are read, and of bodies that fall, in m/s."""

_EVEN = 4, 1e-3  # intervals, and their relative range: eps of bounces is less alike, and less than 1
_SAME = 6  # decimals of instants, in seconds, that are equal in two sheets


PLAIN = Options()


@dataclass(frozen=True)
class Recording:
    """What was read.

    Attributes
    ----------
    points : Points
        In SI units.
    kind : str
        "speeds", "instants", "heights" or "positions".
    sheets : tuple
        Names of all sheets, and how many points each gives, or why it is not read.
    left_out : tuple
        Labels of sounds that are no bounces with an eps, and why.
    """

    points: Points
    kind: str
    sheets: tuple[tuple[str, int | str], ...]
    left_out: tuple[tuple[str, str], ...]


def recording(contents: Sequence[tuple[bytes, str]], options: Options = PLAIN) -> Recording:
    """Return the points in files, given by their contents and names.

    In each file, all sheets of the same kind as the first one are read: speeds, instants, heights, or positions. A
    sheet whose instants are all in other sheets is not.

    Raises
    ------
    ValueError
        One line that names the file, the line in it, what is there and what is expected.
    """
    readers: list[_Reader] = []
    unread: list[tuple[str, str]] = []
    for content, source in contents:
        readers += _of_file(content, source, options, unread)
    first = readers[0]
    for reader in readers:
        if reader.form.kind != first.form.kind:
            kinds = f"{reader.form.kind}, {first.sheet.file} has {first.form.kind}"
            raise ValueError(f"{reader.sheet.file}: the file has {kinds}: expected files of one kind")
    for name in (*options.columns, *options.units):
        if not any(name in reader.known for reader in readers):
            raise _no_column(first.sheet, options, name)
    if (cells := sum(reader.counted for reader in readers)) > bounces.MOST_INSTANTS:
        text = f"there are {cells} {first.form.kind}: expected up to {bounces.MOST_INSTANTS}"
        raise ValueError(f"{first.sheet.file}: {text}")
    for reader in _twice(readers):
        unread.append((reader.sheet.name, "its instants are in other sheets"))
        readers.remove(reader)
    labels = _leave_out(readers, options.without)
    read: list[tuple[str, int]] = []
    parts: list[Points] = []
    for reader in readers:
        reader.prefix = f"{reader.sheet.name}, " * (len(readers) > 1)
        try:
            parts.append(reader.points())
            read.append((reader.sheet.name, len(parts[-1])))
        except bounces.TooFew as error:
            unread.append((reader.sheet.name, str(error)))
        except ValueError as error:
            message = str(error)
            named = message.startswith(reader.sheet.file)
            raise ValueError(message if named else f"{reader.sheet.source}: {message}") from None
    if not parts:
        raise ValueError(f"{readers[-1].sheet.source}: {unread[-1][1]}")
    points = parts[0] if len(parts) == 1 else bounces.together(parts)
    points = points.without(labels) if labels else points
    points = points.without_scatter() if options.scatter is False else points
    return Recording(
        points, first.form.kind, (*read, *unread), tuple(each for reader in readers for each in reader.left_out)
    )


def _of_file(content: bytes, source: str, options: Options, unread: list[tuple[str, str]]) -> list[_Reader]:
    """Return the readers of the sheets of a file; `unread` gets those without data, or with others than the first."""
    readers: list[_Reader] = []
    found = sheets(content, source, lambda header: _form(known_columns(header, options)) is not None)
    chosen = [sheet for sheet in found if not options.sheets or sheet.sheet in options.sheets]
    if not chosen:
        names = ", ".join(repr(sheet.sheet) for sheet in found if sheet.sheet) or "none"
        raise ValueError(f"{source}: there is no sheet {options.sheets[0]!r}: its sheets are {names}")
    for sheet in chosen:
        form = _form(known_columns(sheet.header, options))
        if form and (not readers or form.kind == readers[0].form.kind):
            readers.append(_Reader(sheet, form, options))
        else:
            unread.append((sheet.name, f"{form.kind} beside others" if form else "no columns of data"))
    if not readers:
        raise _no_column(chosen[0], options)
    return readers


def _twice(readers: Sequence[_Reader]) -> list[_Reader]:
    """Return the sheets of instants that larger sheets of their file have, too; unreadable ones are looked at later."""
    every: list[tuple[_Reader, set[float]]] = []
    for reader in readers if len(readers) > 1 else ():
        with suppress(ValueError):
            if reader.form.kind == "instants":
                every.append((reader, {round(t, _SAME) for drop in reader.instants() for t in drop.instants.tolist()}))
    seen: dict[str, set[float]] = {}
    twice = []
    for reader, mine in sorted(every, key=lambda each: -len(each[1])):
        others = seen.setdefault(reader.sheet.file, set())
        twice += [reader] if mine <= others else []
        others |= mine
    return twice


def _no_column(sheet: Sheet, options: Options, name: str = "") -> ValueError:
    """Return the error for a sheet without the columns that are needed, or without one that an option names."""
    header = ", ".join(repr(cell.strip()) for cell in sheet.header[:12])
    missing = [text for text in options.columns.values() if not places_of(sheet.header, text)]
    if missing:
        return ValueError(f"{sheet.source}: there is no column {missing[0]!r}: {header}")
    if name:
        return ValueError(f"{sheet.source}: there is no column {name!r}, for which a unit is given")
    return ValueError(
        f"{sheet.source}: the columns are {header}: expected {ACCEPTED}; --column NAME=HEADER names others"
    )


def _leave_out(readers: Sequence[_Reader], without: Sequence[str]) -> list[str]:
    """Take lines out; return the labels of points among `without`."""
    labels = []
    for text in dict.fromkeys(without):
        name, _, line = text.rpartition(":")
        with_line = [reader for reader in readers if line.isdecimal() and int(line) in reader.lines]
        places = [each for each in with_line if name in ("", each.sheet.sheet, PurePath(each.sheet.file).name)]
        if len(places) > 1:
            raise ValueError(f"line {line} is in {len(places)} sheets or files: expected NAME:{line}")
        if places:
            places[0].leave_out(int(line))
        elif line.isdecimal():
            ends = " to ".join(map(str, readers[0].lines[:1] + readers[0].lines[-1:])) or "none"
            raise ValueError(f"{readers[0].sheet.source}: there is no line {text} with data: expected are {ends}")
        else:
            labels.append("line " + text.removeprefix("line "))
    return labels


class _Reader(Columns):
    """A sheet of one form."""

    def __init__(self, sheet: Sheet, form: Form, options: Options) -> None:
        super().__init__(sheet, options, form.needed[0])
        self.form = form
        self.left_out: list[tuple[str, str]] = []

    @property
    def counted(self) -> int:
        """Number of cells with instants or heights of bounces."""
        each = max(1, sum(name.startswith("bounce_") for name in self.known))
        return len(self.rows) * each if self.form.kind in ("instants", "heights") else 0

    def instants(self) -> list[Drop]:
        """Return the drops of a sheet of instants."""
        if "bounce_0" in self.form.needed:
            names = sorted((name for name in self.known if name.startswith("bounce_")), key=lambda name: int(name[7:]))
            every, sigma = np.array([self.numbers(name, "time", blank=True) for name in names]).T, self.sigma("time")
            kept = [np.flatnonzero(np.isfinite(row)) for row in every]
            names = [name.replace("_", " ") for name in names]
            return [
                Drop(row[seen], [f"{label}, {names[k]}" for k in seen], np.full(len(seen), error))
                for row, seen, label, error in zip(every, kept, self.labels, sigma, strict=True)
            ]
        of_intervals = "interval" in self.form.needed
        times = self.numbers(self.form.needed[0], blank=of_intervals)
        lasting = self.numbers("contact_time", least=" > 0") if "contact_time" in self.known else None
        sigma, labels, drops = self.sigma("time"), self.labels, []
        if "release_time" in self.known:
            lasting = self.numbers("release_time") - times
            if (lasting < 0).any():
                label = labels[int(np.argmax(lasting < 0))]
                raise ValueError(f"{label}: the release_time is before the impact: expected later ones")
        for rows in self.drops():
            of = [i for i in rows if math.isfinite(times[i])]
            made = Drop(times[of], [labels[i] for i in of], sigma[of], None if lasting is None else lasting[of])
            if of_intervals and of:
                start, error = np.append(0.0, np.cumsum(times[of])), np.append(sigma[of[0]], sigma[of])
                made = Drop(start, [f"the bounce before {made.labels[0]}", *made.labels], error)
            drops.append(made)
        return drops

    def points(self) -> Points:
        """Return the points."""
        options, form = self.options, self.form
        if form.kind == "speeds" and options.flight != IN_VACUUM:
            raise ValueError("gravity or drag is given: accepted with speed and epsilon are no options of a flight")
        if form.kind == "speeds" and options.contact_time and isinstance(options.contact_time, float):
            raise ValueError("a contact time is given: expected with it are bounces; here a column contact_time")
        for name, column in (("rate", "frame"), ("length_per_unit", "position")):
            value, flag = getattr(options, name), "--" + name.replace("_", "-")
            if value is not None and column not in form.needed:
                raise ValueError(f"{flag} is given: expected with it is a column {column}")
            if value is not None and not 0 < value < math.inf:
                raise ValueError(f"{flag} is {value:g}: expected a number > 0")
        if not self.rows:
            raise bounces.TooFew("it has no rows with data")
        if self.sheet.comma:
            text = "".join(cell for name in self.known if name != "drop" for cell in self.cells(name))
            if "," in text and "." in text:
                raise ValueError(
                    "numbers have decimal commas and decimal points: expected one of them, and no thousands"
                )
        made = form.points(self)
        _require_sense(made, form.kind != "speeds")
        return made


# --- from columns to points -------------------------------------------------------------------------------------------


def _require_sense(made: Points, falls: bool) -> None:
    """Refuse speeds of a wrong unit, and errors as large as eps."""
    fastest = FASTEST_FLIGHT if falls else FASTEST
    if (bad := ~((made.speed >= SLOWEST) & (made.speed <= fastest))).any():
        i = int(np.argmax(bad))
        raise ValueError(
            f"{made.labels[i]}: the speed is {made.speed[i]:.3g} m/s: expected {SLOWEST:g} to {fastest:g} m/s; is "
            "the unit right? (--unit NAME=UNIT)"
        )
    errors = made.standard_errors
    if (errors >= 1).any():
        i = int(np.argmax(errors >= 1))
        raise ValueError(f"{made.labels[i]}: the standard error of eps is {errors[i]:.3g}: expected less than 1")


def _pairs(reader: _Reader) -> Points:
    if "epsilon" in reader.known and reader.options.resolution is not None:
        raise ValueError("--resolution is given: accepted with speed and epsilon is a column sigma_epsilon")
    speed = reader.numbers("speed", least=" > 0")
    others = ("sigma_epsilon", "sigma_speed", "contact_time")
    sigma, sigma_speed, times = (reader.numbers(name) if name in reader.known else None for name in others)
    if "epsilon" not in reader.known:
        sigma_speed = reader.sigma("speed") if sigma_speed is None else sigma_speed
        return bounces.of_speeds(speed, reader.numbers("speed_out"), sigma=sigma_speed, labels=reader.labels)
    return Points.measured(
        speed,
        reader.numbers("epsilon"),
        sigma_epsilon=sigma,
        sigma_speed=0.0 if sigma_speed is None else sigma_speed,
        contact_time=times,
        scatter=reader.options.scatter,
        labels=reader.labels,
    )


def _instants(reader: _Reader) -> Points:
    """Return the points of the bounces among instants; the reader keeps what is left out, and why."""
    runs: list[Drop] = []
    for drop in filter(len, reader.instants()):
        bounces.require_ascending(drop.instants, drop.labels)
        spans = np.diff(drop.instants)
        if len(spans) > _EVEN[0] and np.ptp(spans) <= _EVEN[1] * spans[0]:
            raise ValueError(
                "the times are evenly spaced, as in a recording: expected are those of bounces, or a column position"
            )
        sigma = float(np.mean(drop.sigma)) or bounces.HEARING
        found, left_out = bounces.heard(drop.instants, sigma)
        reader.left_out += [(drop.labels[i], why) for i, why in left_out]
        runs += [drop.part(of) for of in found]
    if not runs:
        why = "".join(f"; {label}: {why}" for label, why in reader.left_out[:3])
        raise bounces.TooFew(f"no drop has three bounces in succession: expected are three or more, for one eps{why}")
    durations = [run.durations for run in runs if run.durations is not None]
    return bounces.of_times(
        [(run.instants, run.labels) for run in runs],
        reader.options.flight,
        sigma=[run.sigma for run in runs],
        contact_time=reader.options.contact_time,
        durations=durations,
    )


def _positions(reader: _Reader) -> Points:
    """Return the points of the contacts in tracks; frames without a position are skipped."""
    first, options = reader.form.needed[0], reader.options
    if first == "frame" and options.rate is None:
        raise ValueError("frames have no times: expected is --rate, their number per second")
    times = reader.numbers(first, blank=True) / (options.rate if first == "frame" and options.rate else 1.0)
    positions, sigma, labels = reader.numbers("position", blank=True), reader.sigma("length"), reader.labels
    made = []
    for rows in reader.drops():
        of = [i for i in rows if math.isfinite(times[i]) and math.isfinite(positions[i])]
        kept, contact = [labels[i] for i in of], options.contact_time
        made.append(
            tracks.of_track(times[of], positions[of], kept, options.flight, sigma=sigma[of], contact_time=contact)
        )
    return bounces.together(made)


def _heights(reader: _Reader) -> Points:
    heights, sigma, labels = reader.numbers("height"), reader.sigma("length"), reader.labels
    rows = reader.drops()
    drops = [(heights[of], [labels[i] for i in of]) for of in rows]
    contact = reader.options.contact_time
    return bounces.of_heights(drops, reader.options.flight, sigma=[sigma[of] for of in rows], contact_time=contact)


def _height_pairs(reader: _Reader) -> Points:
    pairs = np.array([reader.numbers("drop_height"), reader.numbers("rebound_height")]).T
    drops = [(pair, [label] * 2) for pair, label in zip(pairs, reader.labels, strict=True)]
    sigma, contact = [np.full(2, s) for s in reader.sigma("length")], reader.options.contact_time
    return bounces.of_heights(drops, reader.options.flight, sigma=sigma, contact_time=contact)


@dataclass(frozen=True)
class Drop:
    """Instants at which a body hits the plane, their labels and standard errors, and durations of contacts if known."""

    instants: FloatArray
    labels: list[str]
    sigma: FloatArray
    durations: FloatArray | None = None

    def __len__(self) -> int:
        """Return the number of instants."""
        return len(self.instants)

    def part(self, of: list[int]) -> Drop:
        """Return some of the bounces."""
        durations = None if self.durations is None else self.durations[of]
        return Drop(self.instants[of], [self.labels[i] for i in of], self.sigma[of], durations)


class Form(NamedTuple):
    """A set of columns: what is measured, the names of the columns, and how they become points."""

    kind: str
    needed: tuple[str, ...]
    points: Callable[[_Reader], Points]


_FORMS = (
    Form("speeds", ("speed", "epsilon"), _pairs),
    Form("speeds", ("speed", "speed_out"), _pairs),
    Form("instants", ("bounce_0", "bounce_1"), _instants),
    Form("heights", ("drop_height", "rebound_height"), _height_pairs),
    Form("positions", ("time", "position"), _positions),
    Form("positions", ("frame", "position"), _positions),
    Form("heights", ("height",), _heights),
    Form("instants", ("time",), _instants),
    Form("instants", ("interval",), _instants),
)


def _form(known: Mapping[str, object]) -> Form | None:
    return next((form for form in _FORMS if all(name in known for name in form.needed)), None)
