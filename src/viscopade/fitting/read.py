"""Reader of measured data, from several files and sheets at once, with units in the headers.

A sheet has one of these sets of columns, and may have other columns too:

- `speed`, `epsilon`, and if known `sigma_epsilon`, `sigma_speed` (standard errors) and `contact_time`;
- `speed`, `speed_out`: speeds before and after collisions;
- `time`: the instants at which a body hits the plane, and if known `release_time`, the instants at which it leaves
  the plane, or `contact_time`; or `interval`, the times between the impacts;
- `height`: the height of release, then the heights of the rebounds; or `drop_height` and `rebound_height`;
- `time` or `frame`, and `position`: a vertical coordinate of a body that falls on a plane;
- `bounce 0`, `bounce 1`, …: the instants of one drop in a row, as phyphox exports them (also `Start`, `Stop 1`, …).

In a sheet with several drops, a column `drop` numbers them. The column `sigma` has the standard errors of instants or
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
"""Range of speeds that is read, and the largest one of a body that falls, in m/s."""

_EVEN = 4, 1e-3  # more intervals than this, equal to this relative range, are no bounces: eps varies more
_SAME = 6  # decimals, in seconds, to which equal instants in two sheets agree


PLAIN = Options()


@dataclass(frozen=True)
class Recording:
    """Measured points, with a report on the sheets they come from.

    Attributes
    ----------
    points : Points
        In SI units.
    kind : str
        "speeds", "instants", "heights" or "positions".
    sheets : tuple
        Name of each sheet with its number of points, or with the reason why it is not read.
    left_out : tuple
        Labels of sounds that give no eps, each with the reason.
    """

    points: Points
    kind: str
    sheets: tuple[tuple[str, int | str], ...]
    left_out: tuple[tuple[str, str], ...]


def recording(contents: Sequence[tuple[bytes, str]], options: Options = PLAIN) -> Recording:
    """Return the points in files, given by their contents and names.

    In each file, all sheets of the same kind as the first one are read: speeds, instants, heights, or positions. A
    sheet is skipped if all its instants are in other sheets.

    Raises
    ------
    ValueError
        One line that names the file, the line in it, the value and the expected one.
    """
    readers: list[_Reader] = []
    unread: list[tuple[str, str]] = []
    for content, source in contents:
        readers += _of_file(content, source, options, unread)
    first = readers[0]
    for reader in readers:
        if reader.form.kind != first.form.kind:
            kinds = f"{reader.form.kind}, but {first.sheet.file} has {first.form.kind}"
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
    """Return the readers of a file's sheets; add sheets without data, or with another kind of it, to `unread`."""
    readers: list[_Reader] = []
    every = sheets(content, source, lambda header: _form(known_columns(header, options)) is not None)
    chosen = [sheet for sheet in every if not options.sheets or sheet.sheet in options.sheets]
    if not chosen:
        names = ", ".join(repr(sheet.sheet) for sheet in every if sheet.sheet) or "none"
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
    """Return the sheets whose instants are all in larger sheets of their file; errors in them are reported later."""
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
    """Return the error for a sheet that lacks the necessary columns, or one that an option names."""
    header = ", ".join(repr(cell.strip()) for cell in sheet.header[:12])
    missing = [text for text in options.columns.values() if not places_of(sheet.header, text)]
    if missing:
        return ValueError(f"{sheet.source}: there is no column {missing[0]!r}: {header}")
    if name:
        return ValueError(f"{sheet.source}: there is no column {name!r}: expected one, because --unit names it")
    return ValueError(
        f"{sheet.source}: the columns are {header}: expected {ACCEPTED}; if yours have other names, use "
        "--column NAME=HEADER"
    )


def _leave_out(readers: Sequence[_Reader], without: Sequence[str]) -> list[str]:
    """Leave lines out of the readers; return the labels of points among `without`."""
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
            raise ValueError(f"{readers[0].sheet.source}: there is no line {text} with data: expected {ends}")
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
        """Number of instants or heights in the sheet, blank cells included."""
        each = max(1, sum(name.startswith("bounce_") for name in self.known))
        return len(self.rows) * each if self.form.kind in ("instants", "heights") else 0

    def instants(self) -> list[Drop]:
        """Return the drops in a sheet of instants."""
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
                raise ValueError(f"{label}: the release_time is before the impact: expected a later one")
        for rows in self.drops():
            of = [i for i in rows if math.isfinite(times[i])]
            made = Drop(times[of], [labels[i] for i in of], sigma[of], None if lasting is None else lasting[of])
            if of_intervals and of:
                start, error = np.append(0.0, np.cumsum(times[of])), np.append(sigma[of[0]], sigma[of])
                made = Drop(start, [f"the bounce before {made.labels[0]}", *made.labels], error)
            drops.append(made)
        return drops

    def points(self) -> Points:
        """Check the options against the columns, and return the points."""
        options, form = self.options, self.form
        if form.kind == "speeds" and options.flight != IN_VACUUM:
            raise ValueError("columns speed and epsilon need no flight: expected no gravity and no drag")
        if form.kind == "speeds" and options.contact_time and isinstance(options.contact_time, float):
            raise ValueError("--contact-time is for bounces: expected a column contact_time beside speed and epsilon")
        for name, column in (("rate", "frame"), ("length_per_unit", "position")):
            value, flag = getattr(options, name), "--" + name.replace("_", "-")
            if value is not None and column not in form.needed:
                raise ValueError(f"{flag} is given: expected a column {column} with it")
            if value is not None and not 0 < value < math.inf:
                raise ValueError(f"{flag} is {value:g}: expected a number > 0")
        if not self.rows:
            raise bounces.TooFew("there are no rows with data")
        self.refuse_surplus_cells()
        if self.sheet.comma:
            text = "".join(cell for name in self.known if name != "drop" for cell in self.cells(name))
            if "," in text and "." in text:
                raise ValueError(
                    "numbers have both commas and points: expected one decimal sign, and no thousands separators"
                )
        points, fastest = form.points(self), FASTEST if form.kind == "speeds" else FASTEST_FLIGHT
        if (bad := ~((points.speed >= SLOWEST) & (points.speed <= fastest))).any():
            i = int(np.argmax(bad))
            raise ValueError(
                f"{points.labels[i]}: the speed is {points.speed[i]:.3g} m/s: expected {SLOWEST:g} to {fastest:g} m/s; "
                "is the unit right? (--unit NAME=UNIT)"
            )
        if ((errors := points.standard_errors) >= 1).any():
            i = int(np.argmax(errors >= 1))
            raise ValueError(f"{points.labels[i]}: the standard error of eps is {errors[i]:.3g}: expected less than 1")
        return points


# --- from columns to points -------------------------------------------------------------------------------------------


def _pairs(reader: _Reader) -> Points:
    if "epsilon" in reader.known and reader.options.resolution is not None:
        raise ValueError("--resolution is for instants, heights or speeds: expected a column sigma_epsilon")
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
    """Return the points of the bounces among instants; add other sounds to the reader's `left_out`."""
    runs: list[Drop] = []
    for drop in filter(len, reader.instants()):
        bounces.require_ascending(drop.instants, drop.labels)
        spans = np.diff(drop.instants)
        if len(spans) > _EVEN[0] and np.ptp(spans) <= _EVEN[1] * spans[0]:
            raise ValueError(
                "the times are evenly spaced, as in a recording: expected times of bounces, or a column position too"
            )
        sigma = float(np.mean(drop.sigma)) or bounces.HEARING
        heard, left_out = bounces.heard(drop.instants, sigma)
        reader.left_out += [(drop.labels[i], why) for i, why in left_out]
        runs += [drop.part(places) for places in heard]
    if not runs:
        why = "".join(f"; {label}: {why}" for label, why in reader.left_out[:3])
        raise bounces.TooFew(f"no drop has three bounces in succession: expected three or more, for one eps{why}")
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
        raise ValueError("frames have no times: expected --rate, the number of frames per second")
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

    def part(self, places: list[int]) -> Drop:
        """Return the bounces at these indices."""
        durations = None if self.durations is None else self.durations[places]
        return Drop(self.instants[places], [self.labels[i] for i in places], self.sigma[places], durations)


class Form(NamedTuple):
    """A set of columns: the measured quantity, the names of the columns, and the function that makes points of them."""

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
