"""Forms of measured data: which columns a sheet has, what their headers are called, and what they give.

`QUANTITIES` and `FORMS` are the only description of forms. Recognition of headers, units, columns of errors, refusals
and the first lines of docs/usage/fitting.md read these two tables.
"""

from __future__ import annotations

import re
import unicodedata
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import NamedTuple

from viscopade.quantity import DIMENSIONS, decimal_in

_HEIGHT = "height, h, H, Höhe, Hoehe, hauteur, altura, altezza, altitude"


class MeasuredQuantity(NamedTuple):
    """A measured quantity that a column may have.

    Attributes
    ----------
    dimension : str
        One of `DIMENSIONS`; "" for a plain number, "label" for a text.
    names : str
        Names in headers. Case, accents and separators do not matter, except for a single capital letter. In a series a
        number follows the name.
    least : str
        Condition on the numbers, " > 0" or " >= 0".
    """

    dimension: str
    names: str
    least: str = ""


QUANTITIES: Mapping[str, MeasuredQuantity] = {
    "speed": MeasuredQuantity(
        "speed",
        "speed, v, velocity, impact speed, impact velocity, speed in, v in, speed before, v before, Geschwindigkeit, "
        "Aufprallgeschwindigkeit, vitesse, velocidad, velocità",
        " > 0",
    ),
    "speed_out": MeasuredQuantity("speed", "speed out, v out, rebound speed, rebound velocity, speed after, v after"),
    "epsilon": MeasuredQuantity(
        "",
        "epsilon, eps, COR, restitution, coefficient of restitution, restitution coefficient, Restitutionskoeffizient, "
        "Stoßzahl, coefficient de restitution, coeficiente de restitución, coefficiente di restituzione",
    ),
    "e": MeasuredQuantity("", "e"),  # eps, except in a track
    "energy": MeasuredQuantity("", "E"),  # eps only if no other form fits
    "contact_time": MeasuredQuantity("time", "contact time, t_c, tc, Kontaktzeit", " > 0"),
    "time": MeasuredQuantity(
        "time", "time, t, bounce time, instant, event time, impact time, Zeit, temps, tiempo, tempo"
    ),
    "release_time": MeasuredQuantity("time", "release time"),
    "interval": MeasuredQuantity(
        "time", "interval, flight time, time of flight, time between bounces, Flugzeit, Intervall", " > 0"
    ),
    "frame": MeasuredQuantity("", "frame, slice, image"),
    "height": MeasuredQuantity("length", _HEIGHT, " > 0"),
    "drop_height": MeasuredQuantity(
        "length",
        "drop height, release height, initial height, starting height, height before, drop, height, H, Höhe, Fallhöhe",
        " > 0",
    ),
    "rebound_height": MeasuredQuantity(
        "length", "rebound height, bounce height, height after, rebound, h, Rücksprunghöhe, Sprunghöhe", " > 0"
    ),
    "position": MeasuredQuantity("length", f"position, y, z, y position, position y, {_HEIGHT}"),
    "drop": MeasuredQuantity("label", "drop, run, series, trial"),
}
"""Quantities of one column."""

SERIES: Mapping[str, MeasuredQuantity] = {
    "bounces": MeasuredQuantity("time", "bounce, stop"),
    "flights": MeasuredQuantity("time", "t", " > 0"),
    "heights": MeasuredQuantity("length", "h, height, rebound, rebound height, bounce height, Höhe", " > 0"),
}
"""Quantities of several columns, of which each row has the values in succession: h0, h1, …"""


class Form(NamedTuple):
    """A set of columns that is read.

    Attributes
    ----------
    kind : str
        "speeds", "instants", "heights" or "positions".
    needed, optional : tuple of str
        Names in `QUANTITIES` and `SERIES`.
    measured : tuple of str
        Those of `needed` whose errors are used.
    header : str
        An example.
    row : str
        What a row is.
    epsilon : str
        The name in `QUANTITIES` that stands for eps.
    """

    kind: str
    needed: tuple[str, ...]
    optional: tuple[str, ...]
    measured: tuple[str, ...]
    header: str
    row: str
    epsilon: str = "epsilon"

    def names(self) -> set[str]:
        """Return the names that --column may give to columns of this form."""
        return {*self.needed, *self.optional, "sigma", *(f"sigma_{name}" for name in self.measured)}


_SPEEDS = ("speed", "epsilon")
FORMS = (
    Form("speeds", _SPEEDS, ("contact_time",), _SPEEDS, "speed (m/s), epsilon", "a collision"),
    Form("speeds", ("speed", "speed_out"), (), ("speed", "speed_out"), "v_in (m/s), v_out (m/s)", "a collision"),
    Form("positions", ("time", "position"), ("drop",), ("position",), "time (s), y (m)", "a frame of a track"),
    Form("positions", ("frame", "position"), ("drop",), ("position",), "frame, y (mm)", "a frame, with --rate"),
    Form("instants", ("bounces",), (), ("bounces",), "bounce 0 (s), bounce 1 (s), bounce 2 (s)", "a drop"),
    Form("instants", ("flights",), (), ("flights",), "T0 (s), T1 (s), T2 (s)", "a drop, by its times of flight"),
    Form("speeds", _SPEEDS, ("contact_time",), _SPEEDS, "v_cm_s, e", "a collision", "e"),
    Form(
        "heights", ("drop_height", "rebound_height"), (), ("drop_height", "rebound_height"), "H (cm), h (cm)", "a drop",
    ),
    Form("heights", ("drop_height", "heights"), (), ("drop_height", "heights"), "H (cm), h1 (cm), h2 (cm)", "a drop"),
    Form("heights", ("heights",), (), ("heights",), "h0 (cm), h1 (cm), h2 (cm)", "a drop"),
    Form("heights", ("height",), ("drop",), ("height",), "height (cm)", "the release, then each rebound"),
    Form("instants", ("time",), ("release_time", "contact_time", "drop"), ("time",), "time (s)", "an impact"),
    Form("instants", ("interval",), ("contact_time", "drop"), ("interval",), "interval (ms)", "a flight"),
    Form("speeds", _SPEEDS, ("contact_time",), _SPEEDS, "v (m/s), E", "a collision", "energy"),
)  # fmt: skip
"""The forms; the first one that fits is read."""

OPTIONS = tuple(dict.fromkeys(name for form in FORMS for name in sorted(form.names())))
"""Names of quantities in options."""

ERRORS = (
    "±, sigma, delta, sd, std, stdev, deviation, se, err, error, uncertainty, d, u, Fehler, Unsicherheit, incertitude, "
    "incertidumbre, incertezza, erreur, errore"
)
"""Words for a standard error, alone beside a quantity or with its name; d and u only with its name."""

_MARKS = str.maketrans({"ε": " epsilon ", "σ": " sigma ", "Δ": " delta ", "δ": " delta ", "±": " ± "})
_SUPERSCRIPTS = str.maketrans({"⁻": "-", "−": "-", "¹": "1", "²": "2", "³": "3", "μ": "µ"})
_FILLERS = {"of", "in", "on", "the", "der", "des", "von", "de", "di", "standard"}
_RUN = re.compile(
    r"^[^:]*:|(?<=.)\s+Run\s*#?[0-9]+$"
)  # "Latest: Time (s)" of Logger Pro, "Time (s) Run #1" of Capstone
_BRACKETS = re.compile(r"(.+?)[\s/_,]*[(\[]([^()\[\]]*)[)\]]")
_SEPARATOR = re.compile(r"\s*[/,]\s*|\s+in\s+|[\s_]+")
# A word that may be a unit: short, or the full name of one.
_WORD = r"(?:[^\W\d_]{1,4}|(?:milli|centi|kilo|micro)?(?:met(?:er|re)s?|seconds?)|inches|pixels?|frames)"
_LIKE_A_UNIT = re.compile(rf"%|{_WORD}(?:[\W\d_]+{_WORD})*[\W\d_]*")
# Units that may follow a name after a blank or _; others, such as c and a, may mean something else.
_COMMON = re.compile(
    r"[kcmuµn]?m|[muµn]?s|sec|in|inch|ft|(?:milli|centi)?met(?:er|re)s?|(?:milli)?seconds?|%|[kcm]?m.*s.*"
)
_PER_SECOND = re.compile(r"([kcm]?m)[\s_/.·*]?s(?:\^?[({]?-1[)}]?)?")  # m/s, m s^-1, ms-1, m_s, and ms of a speed
_PIXELS = {"px", "pixel", "pixels"}
_LONGEST = 200  # characters of a header

_NAMES: dict[str, tuple[str, ...]] = {}
_ERROR_WORDS = {word.casefold() for word in ERRORS.split(", ")}


def plain(text: str) -> str:
    """Return a name in lower case without accents, with _ for other characters."""
    folded = unicodedata.normalize("NFKD", text.translate(_MARKS).casefold())
    return re.sub(r"[^a-z0-9±%*']+", "_", re.sub(r"[\u0300-\u036f]", "", folded)).strip("_")


for _quantity, (_, _names, _) in {**QUANTITIES, **SERIES}.items():
    for _name in _names.split(", "):
        _key = _name if len(_name) == 1 and _name.isupper() else plain(_name)
        _key += "\n" * (_quantity in SERIES)  # a number follows
        _NAMES[_key] = (*_NAMES.get(_key, ()), _quantity)


def quantities(name: str) -> tuple[str, ...]:
    """Return the quantities that a name may stand for; those of a series with their number, such as "heights 2"."""
    key = name.strip() if name.strip() in _NAMES else plain(name)  # a capital letter may have a meaning of its own
    if key in _NAMES:
        return _NAMES[key]
    if key in ("start", "stop"):  # of phyphox, beside stop_2, …
        return (f"bounces {int(key == 'stop')}",)
    if numbered := re.fullmatch(r"(.*?)_?([0-9]{1,3})", key):
        return tuple(f"{name} {int(numbered[2])}" for name in _NAMES.get(f"{numbered[1]}\n", ()))
    # A word and its symbol: "Geschwindigkeit v".
    word, _, symbol = name.strip().replace(" ", "_").rpartition("_")
    return _common(word, symbol) if word else ()


def _common(word: str, symbol: str) -> tuple[str, ...]:
    """Return the quantities for which a word and its symbol stand."""
    same = {"epsilon" if name == "e" else name for name in quantities(symbol)}
    return tuple(name for name in quantities(word) if name in same)


def measured_quantity(name: str) -> MeasuredQuantity:
    """Return the description of a quantity, of a series or of one column in it."""
    return QUANTITIES.get(name) or SERIES[name.partition(" ")[0]]


@dataclass(frozen=True)
class Header:
    """A column's header, taken apart.

    Attributes
    ----------
    name : str
        Without the unit.
    unit : str
        As written; empty if there is none.
    quantities : tuple of str
        The quantities that it may be.
    error_of : str or None
        Name of the quantity whose errors it may have; "" for that of a neighbour.
    doubtful : bool
        Whether its end may be a unit, or a part of another name.
    """

    name: str
    unit: str = ""
    quantities: tuple[str, ...] = ()
    error_of: str | None = None
    doubtful: bool = False


@lru_cache(maxsize=4096)
def header(text: str) -> Header:
    """Take a header apart; the unit is in brackets, or after /, a comma, "in", a blank or _."""
    if len(text) > _LONGEST or not any(letter.isalpha() or letter in "±/" for letter in text):
        return Header(text)
    text = _RUN.sub("", text).replace("+/-", "±").strip()
    if (match := _BRACKETS.fullmatch(text)) and not _error_of(f"{match[1]} {match[2]}"):
        name, unit = match[1], match[2].strip()
        if symbol := _common(name, unit):
            return Header(name, "", symbol)
        found = tuple(each for each in quantities(name) if measured_quantity(each).dimension != "label")
        return Header(name, unit, found, None if found else _error_of(name))
    if quantities(text) or _error_of(text) is not None:
        return Header(text, "", quantities(text), None if quantities(text) else _error_of(text))
    for separator in reversed(list(_SEPARATOR.finditer(text))):
        name, end = text[: separator.start()], text[separator.end() :]
        found, error = quantities(name), _error_of(name)
        if (found or error is not None) and _LIKE_A_UNIT.fullmatch(end) and not quantities(end):
            dimensions = {measured_quantity(each).dimension for each in found or quantities(error or "")} or {
                *DIMENSIONS
            }
            sure = bool(separator[0].strip(" _") or _COMMON.fullmatch(end))
            sure = sure and any(size(end, each) is not None for each in dimensions)
            return Header(name, end, found, None if found else error, doubtful=not sure)
    return Header(text)


def _error_of(name: str) -> str | None:
    """Return the name of the quantity whose errors a name stands for: "v" for "sigma_v"; None if it is no error."""
    words = [word for word in re.split(r"[\s_()]+", name.translate(_MARKS)) if word and word.casefold() not in _FILLERS]
    first, last = 0, len(words)
    while first < last and words[first].casefold() in _ERROR_WORDS:
        first += 1
    while first == 0 < last and words[last - 1].casefold() in _ERROR_WORDS:
        last -= 1
    target = " ".join(words[first:last])
    if not target:
        return "" if any(len(word) > 1 or word == "±" for word in words) else None
    return target if last - first < len(words) and quantities(target) else None


def size(unit: str, dimension: str) -> float | None:
    """Return a unit of a dimension in SI units; None for any other text."""
    text = unit.translate(_SUPERSCRIPTS).strip()
    if dimension not in DIMENSIONS:
        return {"%": 0.01, "-": 1.0, "1": 1.0}.get(text)
    if dimension == "speed" and (match := _PER_SECOND.fullmatch(text)):
        text = f"{match[1]}/s"
    if text.lower() in _PIXELS:  # Pint has one of a fixed length
        return None
    sizes = (decimal_in(f"1 {each}", DIMENSIONS[dimension][0]) for each in (text, text.lower()))
    return next((float(each) for each in sizes if each is not None), None)


@dataclass(frozen=True)
class SheetLayout:
    """The columns of a sheet that a form reads.

    Attributes
    ----------
    form : Form
    cells : tuple of str
        The headers as written.
    headers : tuple of Header
    places : mapping
        Indices of the columns of each quantity; a series has several, another quantity more than one if they are
        ambiguous.
    """

    form: Form
    cells: tuple[str, ...]
    headers: tuple[Header, ...]
    places: Mapping[str, tuple[int, ...]]

    def columns(self, name: str) -> tuple[int, ...]:
        """Return the columns of a quantity.

        Raises
        ------
        ValueError
            If two columns have this quantity, or a number of a series is missing.
        """
        places = self.places[name]
        if name in SERIES:
            members = [self.headers[i].quantities[0] for i in places]
            first = int(members[0].partition(" ")[2])
            wanted = [f"{name} {k}" for k in range(first, first + len(members))]
            if members != wanted:
                shown = ", ".join(repr(self.cells[i].strip()) for i in places)
                raise ValueError(f"the columns {shown} are no series: expected successive numbers")
        elif len(places) > 1:
            one, two = (f"{self.cells[i].strip()!r} (column {i + 1})" for i in places[:2])
            raise ValueError(f"{one} and {two} are both {name}: expected one; choose with --column {name}=NUMBER")
        return places

    def errors(self) -> dict[int, int]:
        """Return the column with the standard errors of each column that has them.

        Raises
        ------
        ValueError
            If a column of errors may belong to several quantities.
        """
        found: dict[int, int] = {}
        alone = [*self.places.get("sigma", ())]
        chosen = {i for name, places in self.places.items() if name.startswith("sigma") for i in places}
        values = {i: name for name in self.form.measured for i in self.places[name]}
        for j, head in enumerate(self.headers):
            if head.error_of == "" and j not in chosen:
                alone.append(j)
            elif head.error_of and j not in chosen:
                meant = {"epsilon" if name == self.form.epsilon else name for name in quantities(head.error_of)}
                of = [i for i, name in values.items() if {name, *self.headers[i].quantities[:1]} & meant]
                found |= dict.fromkeys(of[:1], j)
        for name in self.form.measured:
            found |= {i: j for j in self.places.get(f"sigma_{name}", ()) for i in self.places[name]}
        # One column of errors beside one quantity, or a column of errors to the right of each.
        for j in alone:
            if len(self.form.measured) == 1 and len(alone) == 1:
                found |= {i: j for i in values if i not in found}
            elif j - 1 in values and (len(alone) > 1 or "±" in self.cells[j] or "+/-" in self.cells[j]):
                found[j - 1] = j
            else:
                cell = self.cells[j].strip()
                options = " or ".join(f"--column sigma_{name}={cell!r}" for name in self.form.measured)
                raise ValueError(f"the errors {cell!r} are of {' or of '.join(self.form.measured)}: expected {options}")
        return found


def places_of(cells: Sequence[str], text: str) -> list[int]:
    """Return the indices of the columns that an option names: by their header, without its unit, or by their number."""
    exact = [i for i, cell in enumerate(cells) if cell.strip() == text]
    same = exact or [i for i, cell in enumerate(cells) if plain(header(cell).name) == plain(header(text).name) != ""]
    return same or ([int(text) - 1] if text.isdecimal() and 0 < int(text) <= len(cells) else [])


def layout(cells: Sequence[str], columns: Mapping[str, str]) -> SheetLayout | None:
    """Return the first form that fits a row of headers, and that has all columns that options name; None if none does.

    Parameters
    ----------
    cells : sequence of str
    columns : mapping
        Header or number of columns, by the names of quantities; "-" omits the columns that may be a quantity.
    """
    headers = tuple(map(header, cells))
    chosen = {name: tuple(places_of(cells, text)) for name, text in columns.items()}
    taken = {i for places in chosen.values() for i in places}
    omitted = {name for name, text in columns.items() if text == "-"}
    taken |= {i for i, head in enumerate(headers) if omitted & {*head.quantities}}
    places: dict[str, tuple[int, ...]] = {}
    for doubtful in (True, False):  # names without a doubtful end count more
        of: dict[str, list[int]] = {}
        for i, head in enumerate(headers):
            for name in head.quantities if head.doubtful == doubtful and i not in taken else ():
                of.setdefault(name, []).append(i)
        places |= {name: tuple(found) for name, found in of.items()}
    for series in SERIES:
        members = sorted(
            (int(name.partition(" ")[2]), i) for name, of in places.items() if name.startswith(f"{series} ") for i in of
        )
        if members:
            places[series] = tuple(i for _, i in members)
    places = {name: of for name, of in places.items() if name not in columns} | {
        k: of for k, of in chosen.items() if of
    }
    explicit = {*columns} - omitted
    for form in FORMS:
        own = places if form.epsilon not in places else places | {"epsilon": places[form.epsilon]}
        if not all(name in own for name in form.needed) or not explicit <= form.names():
            continue
        if "heights" in form.needed or {"bounces", "flights"} & {*form.needed}:
            series = form.needed[-1]
            first = headers[own[series][0]].quantities[0].partition(" ")[2]
            if len(own[series]) < 3 - len(form.needed) or (len(form.needed) > 1 and first == "0"):
                continue
        used = form.names()
        return SheetLayout(form, tuple(cells), headers, {name: of for name, of in own.items() if name in used})
    return None
