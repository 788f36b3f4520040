"""Forms of measured data: the columns that a sheet has, what their headers are called, and what they give.

    v (cm/s), sigma_v, COR          a collision in each row
    time (s), y (mm)                a frame of a track
    H (cm), h1 (cm), h2 (cm)        a drop and its rebounds

A form is a set of columns that gives speeds and eps, instants of bounces, heights, or positions. A header is a name and
a unit. `QUANTITIES`, `SERIES` and `FORMS` are the only description of forms. Recognition of headers, units, columns of
errors, refusals and the first lines of docs/usage/fitting.md read these tables.
"""

from __future__ import annotations

import re
import unicodedata
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import NamedTuple

from viscopade.quantity import DIMENSIONS, PIXELS, unit_in_si


class MeasuredQuantity(NamedTuple):
    """A quantity that a column may have.

    Attributes
    ----------
    dimension : str
        One of `DIMENSIONS`; "" for a plain number, "label" for a text.
    names : str
        Names in headers. Case, accents and separators do not matter, except for a single capital letter. In a series a
        number follows the name.
    condition : str
        That on the numbers, " > 0" or " >= 0"; "" if any finite number may stand there.
    """

    dimension: str
    names: str
    condition: str = ""


class Form(NamedTuple):
    """A set of columns that is read.

    Attributes
    ----------
    kind : str
        "speeds", "instants", "heights" or "positions".
    needed, optional : tuple of str
        Names in `QUANTITIES` and `SERIES`.
    header, row : str
        An example of the headers, and what a row is.
    epsilon : str
        The name in `QUANTITIES` that stands for eps.
    """

    kind: str
    needed: tuple[str, ...]
    optional: tuple[str, ...]
    header: str
    row: str
    epsilon: str = "epsilon"

    @property
    def measured(self) -> tuple[str, ...]:
        """Those of `needed` whose errors are used."""
        return self.needed[1:] if self.kind == "positions" else self.needed

    def names(self) -> set[str]:
        """Return the names that --column may give to columns of this form."""
        return {*self.needed, *self.optional, "sigma", *(f"sigma_{name}" for name in self.measured)}


# fmt: off
_Q, _HEIGHT = MeasuredQuantity, "height, h, H, Höhe, Hoehe, hauteur, altura, altezza, altitude"
_REBOUND = ("rebound, rebound height, bounce height, Rücksprung, Rücksprunghöhe, Rückprall, Rückprallhöhe, Sprunghöhe, "
            "rebond, hauteur de rebond, rebote, altura de rebote, rimbalzo, altezza di rimbalzo")
QUANTITIES: Mapping[str, MeasuredQuantity] = {
    "speed": _Q("speed", "speed, v, velocity, impact speed, impact velocity, speed in, v in, v i, v impact, v before, "
                "speed before, speed before impact, velocity before impact, Geschwindigkeit, Aufprallgeschwindigkeit, "
                "Auftreffgeschwindigkeit, Einschlaggeschwindigkeit, "
                "vitesse, velocidad, velocità", " > 0"),
    "speed_out": _Q("speed", "speed out, v out, v f, rebound speed, rebound velocity, speed after, v after, "
                    "speed after impact, velocity after impact, v rebound"),
    "epsilon": _Q("", "epsilon, eps, COR, restitution, coefficient of restitution, restitution coefficient, Stoßzahl, "
                  "Restitutionskoeffizient, coefficient de restitution, coeficiente de restitución, "
                  "coefficiente di restituzione"),
    "e": _Q("", "e"),  # eps, except in a track
    "energy": _Q("", "E"),  # eps only if no other form fits
    "contact_time": _Q("time", "contact time, t_c, tc, Kontaktzeit", " > 0"),
    "time": _Q("time", "time, t, bounce time, instant, event time, impact time, time of bounce, time of impact, Zeit, "
               "temps, tiempo, tempo"),
    "release_time": _Q("time", "release time"),
    "interval": _Q("time", "interval, flight time, time of flight, time between bounces, Flugzeit, Intervall", " > 0"),
    "frame": _Q("", "frame, slice, image"),
    "height": _Q("length", _HEIGHT, " > 0"),
    "drop_height": _Q("length", "drop height, release height, initial height, starting height, height before, drop, "
                      "height, H, Höhe, Fallhöhe, Starthöhe, Ausgangshöhe, Anfangshöhe, Abwurfhöhe, "
                      "hauteur initiale, hauteur de chute, altura inicial, altezza iniziale", " > 0"),
    "rebound_height": _Q("length", f"height after, h, {_REBOUND}", " > 0"),
    "position": _Q("length", f"position, y, z, y position, position y, {_HEIGHT}"),
    "drop": _Q("label", "drop, run, series, trial, Versuch"),
}
"""Quantities of one column."""

SERIES: Mapping[str, MeasuredQuantity] = {
    "bounces": _Q("time", "bounce, stop"),
    "flights": _Q("time", "t", " > 0"),
    "heights": _Q("length", f"h, height, Höhe, hauteur, altura, altezza, {_REBOUND}", " > 0"),
}
"""Quantities of several columns, of which each row has the values in succession: h0, h1, …"""

FORMS = (
    Form("speeds", ("speed", "epsilon"), ("contact_time",), "speed (m/s), epsilon", "a collision"),
    Form("speeds", ("speed", "speed_out"), (), "v_in (m/s), v_out (m/s)", "a collision"),
    Form("positions", ("time", "position"), ("drop",), "time (s), y (m)", "a frame of a track"),
    Form("positions", ("frame", "position"), ("drop",), "frame, y (mm)", "a frame of a track, with --rate"),
    Form("instants", ("bounces",), (), "bounce 0 (s), bounce 1 (s), bounce 2 (s)", "a drop, by its impacts"),
    Form("instants", ("flights",), (), "T0 (s), T1 (s), T2 (s)", "a drop, by its times of flight"),
    Form("speeds", ("speed", "epsilon"), ("contact_time",), "v_cm_s, e", "a collision", "e"),
    Form("heights", ("drop_height", "rebound_height"), (), "H (cm), h (cm)", "a drop and its rebound"),
    Form("heights", ("drop_height", "heights"), (), "H (cm), h1 (cm), h2 (cm)", "a drop and its rebounds"),
    Form("heights", ("heights",), (), "h0 (cm), h1 (cm), h2 (cm)", "a drop and its rebounds"),
    Form("heights", ("height",), ("drop",), "height (cm)", "the release, then each rebound"),
    Form("instants", ("time",), ("release_time", "contact_time", "drop"), "time (s)", "an impact"),
    Form("instants", ("interval",), ("drop",), "interval (ms)", "a flight"),
    Form("speeds", ("speed", "epsilon"), ("contact_time",), "v (m/s), E", "a collision", "energy"),
)
"""The forms; the first one that fits is read."""
# fmt: on

OPTIONS = tuple(dict.fromkeys(name for form in FORMS for name in sorted(form.names())))
"""Names of quantities in options."""

_ERROR_WORD = re.compile(
    "±|sigma|delta|sd|std|stdev|stddev|dev|deviation|se|sem|stderr|d|u|s|err|errors?|unc|uncert|uncertainty|"
    "uncertainties|(standard)?abweichung|(standard|mess)?fehler|(standard|mess)?unsicherheit|ecart|ecarttype|"
    "incertitude|incertidumbre|incertezza|erreur|errore|desviacion|deviazione"
)
"""Words for a standard error, with a quantity's name or alone beside it; d, u and s not alone, and s only before it.

By hand: the usual words and abbreviations in the languages of `QUANTITIES`, as `plain` writes them, without separators.
"""

# Words between those for an error and for its quantity: "standard error of the height", "Fehler der Höhe". By hand.
_FILLER = re.compile("of|in|on|the|der|des|von|de|di|standard|estandar|type|mean|bars?")
# Greek letters, with the two Unicode forms of epsilon and of Delta, and ± as words
_MARKS = str.maketrans(
    {"ε": " epsilon ", "σ": " sigma ", "Δ": " delta ", "δ": " delta ", "∆": " delta ", "±": " ± ", "ϵ": " epsilon "}
)
# Names of data sets, which programs add: what ends in a colon, "Latest: Time (s)" of Logger Pro; a number of a run
# behind the name, "Time (s) Run #1" of Capstone.
_DATA_SET = re.compile(r"^[^:]*:|(?<=.)\s+Run\s*#?[0-9]+$")
# "v (m/s)", "v_[m/s]", "v / (m/s)": the name, and the text in brackets at the end; signs between them belong to neither
_BRACKETS = re.compile(r"(.+?)[\s/_,]*[(\[]([^()\[\]]*)[)\]]")
# Signs and blanks before a unit that is not in brackets
_SEPARATOR = re.compile(r"\s*[/,]\s*|\s+in\s+|[\s_]+")
# Units that may follow a name after a blank or _: lengths, times and speeds, such as "cm", "µs", "cm_s", "cm s^-1",
# "km h", "kph", "ft_s". `[kcm]?m.*s.*` takes any metres with an s behind. Other ends, such as c (of light) and a (a
# year), may mean something else.
_COMMON_UNIT = re.compile(
    r"[kcmuµn]?m|[muµn]?s|sec|in|inch|ft|(?:milli|centi)?met(?:er|re)s?|(?:milli)?seconds?|%|[kcm]?m.*s.*"
    r"|km[\s_/]?p?h|[mk]ph|fps|(?:ft|in)[\s_/].*s"
)
# The same, or dots: R writes "v..cm.s." for "v (cm/s)"
_SEPARATOR_OR_DOT = re.compile(r"\s*[/,]\s*|\s+in\s+|[\s_.]+")
# A letter for an error, joined to its quantity, which ends the word: "dv", "ueps", "dv_after", but not "dvd". Not the
# word "se", a standard error of any quantity. Nor uh, uy, sh and sy: u is also a speed, and s a way, which have such
# components beside a height or a y; chosen by hand.
_JOINED = re.compile(r"^(d|u(?![hy])|s(?![hy]|e(?![a-z])))(v|e|eps|cor|h|y)(?![^\W_])", re.I)
# Characters and words of a header that is taken apart, at most: a longer text is a sentence, and each end of it is
# tried as a unit. Chosen by hand: "standard deviation of the velocity before impact (cm/s)" has 55 characters.
_LONGEST, _MOST_WORDS = 80, 12
# Characters of a unit without a sign in it, at most, by hand: "measured" begins with m and has an s, but is no unit;
# "cms" and "inch" are.
_LONG_WORD = 4

# Name as `plain` writes it, or a single capital letter -> quantities. Names of series, which need a number behind them,
# end in a line feed here: no other name has one.
_NAMES: dict[str, tuple[str, ...]] = {}


def plain(text: str) -> str:
    """Return a name in lower case without accents, with _ for other characters, such as blanks and brackets.

    The signs ± and % (an error, a unit), and * and ' (v* and v' are not v) stay.
    """
    # NFKD separates letters and their accents, which are U+0300 to U+036F.
    folded = unicodedata.normalize("NFKD", text.translate(_MARKS).casefold())
    return re.sub(r"[^a-z0-9±%*']+", "_", re.sub(r"[\u0300-\u036f]", "", folded)).strip("_")


for _quantity, (_, _names, _) in {**QUANTITIES, **SERIES}.items():
    for _name in _names.split(", "):
        _key = (_name if len(_name) == 1 and _name.isupper() else plain(_name)) + "\n" * (_quantity in SERIES)
        _NAMES[_key] = (*_NAMES.get(_key, ()), _quantity)


def quantities(name: str) -> tuple[str, ...]:
    """Return the quantities that a name may stand for; those of a series with their number, such as "heights 2"."""
    key = name.strip() if name.strip() in _NAMES else plain(name)  # a capital letter may have a meaning of its own
    if key in ("start", "stop"):  # of phyphox, the instants of bounces 0 and 1, beside stop_2, …
        return (f"bounces {int(key == 'stop')}",)
    # "h2", "h_2", "bounce 12": a series. By hand, a number has up to three digits: a longer one, such as a year, is no
    # column's.
    if numbered := re.fullmatch(r"(.*?)_?([0-9]{1,3})", key):
        return tuple(f"{series} {int(numbered[2])}" for series in _NAMES.get(f"{numbered[1]}\n", ()))
    # "v", or else "velocity v"
    word, _, symbol = name.strip().replace(" ", "_").rpartition("_")
    return _NAMES.get(key) or (_quantities_of_both(word, symbol) if word else ())


def _quantities_of_both(word: str, symbol: str) -> tuple[str, ...]:
    """Return the quantities for which both a word and its symbol stand: "Geschwindigkeit v"."""
    of_symbol = {"epsilon" if name == "e" else name for name in quantities(symbol)}
    return tuple(name for name in quantities(word) if name in of_symbol)


def measured_quantity(name: str) -> MeasuredQuantity:
    """Return the description of a quantity, of its errors, of a series or of one column in it."""
    name = name.removeprefix("sigma_").partition(" ")[0]
    return QUANTITIES.get(name) or SERIES[name]


class Header(NamedTuple):
    """A column's header, taken apart.

    Attributes
    ----------
    name, unit : str
        As written.
    quantities : tuple of str
        The quantities that it may be.
    error_of : str or None
        Name of the quantity whose errors it may have; "" for that of a neighbour.
    """

    name: str
    unit: str = ""
    quantities: tuple[str, ...] = ()
    error_of: str | None = None


# Rows of many sheets are tried as headers, and repeat each other: 4096 texts are more than its first rows have.
@lru_cache(maxsize=4096)
def header(text: str) -> Header:
    """Return a header, taken apart: the unit is in brackets, or after /, a comma, "in", a blank or _.

    `text` is a cell such as "v (cm/s)".
    """
    # A long text, or one without letters, is no header; ± and / are signs of errors and of a unit, as in "±" and "/s".
    text = text.replace("+/-", "±").replace("+-", "±")
    is_short = len(text) <= _LONGEST and len(_SEPARATOR_OR_DOT.findall(text)) < _MOST_WORDS
    if not is_short or not any(letter.isalpha() or letter in "±/" for letter in text):
        return Header(text)
    text = _DATA_SET.sub("", " ".join(text.split())).strip()
    # "v (m/s)": a name with its unit in brackets; or "velocity (v)", a name with its symbol. A label has no
    # unit, so "run (s)" is none. Texts in which brackets belong to the name of an error, "error (v)", are below.
    if (match := _BRACKETS.fullmatch(text)) and not _error_of(f"{match[1]} {match[2]}"):
        name, unit = match[1], match[2].strip()
        if meanings := _quantities_of_both(name, unit):
            return Header(name, "", meanings)
        meanings = tuple(meaning for meaning in quantities(name) if measured_quantity(meaning).dimension != "label")
        return Header(name, unit, meanings, None if meanings else _error_of(name))
    # A name without a unit.
    if (meanings := quantities(text)) or (error := _error_of(text)) is not None:
        return Header(text, "", meanings, None if meanings else error)
    # "v / cm s^-1", "t in ms", "v_cm_s": the shortest end first. After a blank or _, only common units count.
    for separator in reversed(list(_SEPARATOR.finditer(text))):
        name, end = text[: separator.start()], text[separator.end() :]
        if (separator[0].strip(" _") or _COMMON_UNIT.fullmatch(end)) and not quantities(end):
            meanings, error = quantities(name), _error_of(name)
            if meanings or error is not None:
                return Header(name, end, meanings, None if meanings else error)
    return Header(text)


@lru_cache(maxsize=4096)  # texts, as for `header`
def _split_off_unit(head: Header, dimension: str) -> Header:
    """Return the header of a column that an option names for a quantity: its end may be a unit, after any name.

    `head` is what `header` gives, and `dimension` that of the quantity.
    """
    # Each way to cut the name into a name, a separator and an end, unless it is taken apart already, or too long
    ends = [] if head.unit or head.quantities or head.error_of is not None else [*_SEPARATOR_OR_DOT.finditer(head.name)]
    ends = ends if len(head.name) <= _LONGEST and len(ends) < _MOST_WORDS else []
    cuts = [(head.name[: sign.start()], sign[0], head.name[sign.end() :].strip(" ._")) for sign in ends]
    # An end that is a unit of the dimension; a single letter only if it is common, because a and c are units, too.
    for name, _, end in cuts:
        if name and unit_in_si(end, dimension) and (len(end) > 1 or _COMMON_UNIT.fullmatch(end)):
            return Header(name, end)
    # An end that is a unit of something else, or looks like one: it is refused later, when the unit is read. Single
    # letters do not count, because many are units: a of time, c of speed.
    for name, sign, end in cuts if dimension in DIMENSIONS else ():
        is_unit = end.lower() in PIXELS or (
            len(end) > 1 and any(unit_in_si(end, any_dimension) for any_dimension in DIMENSIONS)
        )
        is_common = _COMMON_UNIT.fullmatch(end) and not (end.isalpha() and len(end) > _LONG_WORD)
        if name and (sign.strip(" _.") or is_unit or is_common) and not quantities(end):
            return Header(name, end)
    return head


def has_unit(text: str, dimension: str) -> bool:
    """Return whether a column's header (`text`) ends in a unit of a dimension of `DIMENSIONS`."""
    return unit_in_si(_split_off_unit(header(text), dimension).unit, dimension) is not None


def _error_of(name: str) -> str | None:
    """Return the name of the quantity whose errors a name stands for, as written: "v" for "sigma_v", "dv", "v error".

    `name` is a header, with or without its unit. "": a word for errors alone, which are those of a neighbour's
    quantity. None: no error, or `quantities` does not know the name that is left.
    """
    # Words are between blanks, _ and brackets; each may be one for an error, such as sigma. An s behind others is the
    # unit of seconds: "v s". With another unit the name that is left is
    # unknown; `header` tries the text without its unit, too.
    words = [word for word in re.split(r"[\s_()]+", _JOINED.sub(r"\1 \2", name).translate(_MARKS)) if word]
    keys = [plain(word).replace("_", "") for word in words]  # "std.", "écart-type"
    is_error = [bool(_ERROR_WORD.fullmatch(key)) and (k == 0 or key != "s") for k, key in enumerate(keys)]
    # The quantity's name is from the first to the last word that is neither an error nor a filler. A word for an error
    # counts outside of this name only: "v err after" is no error.
    inner = [k for k, key in enumerate(keys) if not (is_error[k] or _FILLER.fullmatch(key))]
    if not inner:  # one letter, d, u or s, needs a name; the sign ± does not
        stands_alone = any(error and (len(key) > 1 or key == "±") for error, key in zip(is_error, keys, strict=True))
        return "" if stands_alone else None
    quantity_name = " ".join(words[inner[0] : inner[-1] + 1])
    is_error_outside = is_error[: inner[0]] + is_error[inner[-1] + 1 :]
    return quantity_name if any(is_error_outside) and quantities(quantity_name) else None


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
        Indices of the columns of each quantity: several of a series, or if they are ambiguous.
    """

    form: Form
    cells: tuple[str, ...]
    headers: tuple[Header, ...]
    places: Mapping[str, tuple[int, ...]]

    def __len__(self) -> int:
        """Return the number of columns that are read."""
        return sum(map(len, self.places.values()))

    def columns(self, name: str) -> tuple[int, ...]:
        """Return the indices of the columns of a quantity, by its name in `places`.

        ValueError: two columns have it, or a number of a series is missing.
        """
        places = self.places[name]
        # The quantities of a series end in their numbers, "heights 2": the second word.
        numbers = [int(self.headers[i].quantities[0].split()[1]) for i in places if name in SERIES]
        shown = " and ".join(f"{self.cells[i]!r} (column {i + 1})" for i in places)
        if name not in SERIES and len(places) > 1:
            raise ValueError(f"{shown} are both {name}: expected one; choose with --column {name}=NUMBER")
        if numbers and numbers != [*range(numbers[0], numbers[0] + len(numbers))]:
            raise ValueError(f"the columns {shown} are no series: expected successive numbers")
        return places

    def errors(self) -> dict[int, int]:
        """Return the column of the standard errors of each column that has one: index of values -> index of errors.

        Indices are from 0. ValueError: a column of errors may belong to several quantities.
        """
        # The columns whose errors are used: index -> name of the quantity
        values = {i: name for name in self.form.measured for i in self.places[name]}
        # Columns that options name for the errors of a quantity.
        chosen = {name: self.columns(f"sigma_{name}") for name in {*values.values()} if f"sigma_{name}" in self.places}
        error_columns = {i: j for i, name in values.items() for j in chosen.get(name, ())}
        # Options decide on the errors of their quantities; headers, of the columns that are not read as values, on
        # those of the others. The option sigma, for the errors of the only quantity, leaves no header to ask.
        undecided = {i: name for i, name in values.items() if name not in chosen}
        by_option, read_columns = len(undecided) < len(values), {i for indices in self.places.values() for i in indices}
        heads = {j: head for j, head in enumerate(self.headers) if j not in read_columns and "sigma" not in self.places}
        for j, head in heads.items():
            targets = [i for i in self._columns_meant(head.error_of) if i in undecided] if head.error_of else []
            names = {undecided[i] for i in targets}
            self._assign_errors(j, targets, error_columns, names if len(names) > 1 else ())
        # One column of errors beside one quantity, or a column of errors to the right of each.
        unnamed = [*self.places.get("sigma", ()), *(j for j, head in heads.items() if head.error_of == "")]
        for j in unnamed:
            # ± belongs to the column on its left; if this is not read, it may be of another quantity, or unknown.
            is_plus_minus = "±" in self.headers[j].name
            left = self.headers[j - 1] if j in heads and j > 0 and j - 1 not in values else Header("")
            is_of_another, is_unknown = bool(left.quantities), bool(left.name) and is_plus_minus
            # The only column of errors is that of the only quantity; one of several, or with ±, that of the column on
            # its left. Else it may be of any quantity, and an option has to say.
            if len(self.form.measured) == len(unnamed) == 1 and not (is_of_another or is_unknown):
                error_columns = dict.fromkeys(undecided, j) | error_columns
            elif j - 1 in values and (len(unnamed) > 1 or is_plus_minus):
                self._assign_errors(j, [j - 1] if j - 1 in undecided else [], error_columns)
            elif not (by_option or is_of_another):
                self._assign_errors(j, [], error_columns, self.form.measured)
        # Of the speeds before and after, the errors of one are those of the other, too, unless options name both.
        speeds = [i for name in ("speed", "speed_out") for i in self.places.get(name, ()) if i in values]
        if len(speeds) == 2 and not {"sigma_speed", "sigma_speed_out"} <= {*self.places}:
            error_columns |= {
                i: error_columns[j] for i, j in (speeds, speeds[::-1]) if i not in error_columns and j in error_columns
            }
        return error_columns

    def _assign_errors(
        self, j: int, targets: Sequence[int], error_columns: dict[int, int], names: Collection[str] = ()
    ) -> None:
        """Make column j, of errors, that of the columns `targets` in `error_columns` (values -> errors).

        ValueError: it may be of several quantities, `names`, or a column has errors already.
        """
        # The option that says which one is meant has the header, or the number of the column.
        cell = self.cells[j]
        if names:
            names = [name for name in self.form.measured if name in names]
            options = " or ".join(f"--column sigma_{name}={cell!r}" for name in names)
            raise ValueError(f"the errors {cell!r} are of {' or of '.join(names)}: expected {options}")
        for i in targets:
            if i in error_columns:
                name = next(name for name in self.form.measured if i in self.places[name])
                shown = (
                    f"{self.cells[error_columns[i]]!r} (column {error_columns[i] + 1}) and {cell!r} (column {j + 1})"
                )
                raise ValueError(f"{shown} are both errors of {name}: expected --column sigma_{name}=NUMBER")
            error_columns[i] = j

    def _columns_meant(self, target: str) -> list[int]:
        """Return the columns for which the name of errors, `target`, stands: "v" of "sigma_v".

        They have the same name, or else the same quantity.
        """

        def spelling(name: str) -> str:
            """Return a name as written, with _ between words."""
            return "_".join(re.split(r"[\s_]+", name.translate(_MARKS).strip()))

        heads = {i: head for i, head in enumerate(self.headers) if head.error_of is None}
        for key in (spelling, plain):  # H is not h, if there are both: case counts first
            # The errors of h are those of h1 and h2.
            names = {i: {key(head.name), key(head.name.rstrip("0123456789"))} for i, head in heads.items()}
            if matches := [i for i in heads if key(target) in names[i]]:
                return matches
        # No column has the name: all columns of this quantity. A word for heights, not the letter h or H, is of drops
        # and of rebounds.
        meant = {"epsilon" if name in ("e", self.form.epsilon) else name for name in quantities(target)}
        values = {i: name for name in self.form.measured for i in self.places[name]}
        all_heights = "height" in meant and len(target) > 1
        # A header's first quantity is its own meaning; the others are those that it may stand for ("y" is a height, and
        # then H or h): errors of y are not those of both.
        meanings = {i: {name, *self.headers[i].quantities[:1]} for i, name in values.items()}
        lengths = {i for i, name in values.items() if all_heights and measured_quantity(name).dimension == "length"}
        return [i for i in values if meanings[i] & meant or i in lengths]


def places_of(cells: Sequence[str], text: str) -> tuple[int, ...]:
    """Return the indices of the columns that an option names: by their header, without its unit, or by their number.

    `cells` are the headers, and `text` the option's value.
    """
    same_text = tuple(i for i, cell in enumerate(cells) if cell.strip() == text)
    same_name = tuple(i for i, cell in enumerate(cells) if plain(header(cell).name) == plain(header(text).name) != "")
    is_number = text.isdecimal() and 0 < int(text) <= len(cells)
    return same_text or same_name or ((int(text) - 1,) if is_number else ())


def layout(cells: Sequence[str], columns: Mapping[str, str]) -> SheetLayout | None:
    """Return the first form that fits a row of headers, and that has all columns that options name; None if none does.

    Parameters
    ----------
    cells : sequence of str
    columns : mapping
        Header or number of columns, by the names of quantities; "-" omits the columns that may be a quantity.
    """
    # Columns that options name or omit; an omitted eps is omitted under all its names.
    headers = tuple(map(header, cells))
    omitted = {name for name, text in columns.items() if text == "-"}
    omitted |= {"e", "energy"} if "epsilon" in omitted else set()
    chosen = {name: places_of(cells, text) for name, text in columns.items() if name not in {*omitted, *SERIES}}
    dimensions = {
        i: measured_quantity(name).dimension for name, indices in chosen.items() if name != "sigma" for i in indices
    }
    headers = tuple(_split_off_unit(head, dimensions[i]) if i in dimensions else head for i, head in enumerate(headers))
    # The other columns have the quantities that their headers may stand for.
    places: dict[str, tuple[int, ...]] = {}
    for i, head in enumerate(headers):
        is_taken = omitted & {*head.quantities} or any(i in indices for indices in chosen.values())
        places |= {name: (*places.get(name, ()), i) for name in (() if is_taken else head.quantities)}
    # Columns of a series in the order of their numbers: h0, h1, …
    for series in SERIES:
        members = sorted(
            (int(name.split()[1]), indices) for name, indices in places.items() if name.startswith(f"{series} ")
        )
        places |= {series: tuple(i for _, indices in members for i in indices)} if members else {}
    places = {name: indices for name, indices in places.items() if name not in columns} | {
        k: indices for k, indices in chosen.items() if indices
    }
    for form in FORMS:
        # The first form whose columns are all there, and that has all those which options name. A series of values
        # needs two in a row, or one beside the drop; beside a drop it begins at h1, because h0 is the drop itself.
        form_places = {"epsilon": places[form.epsilon], **places} if form.epsilon in places else places
        if all(name in form_places for name in form.needed) and {*columns} - omitted <= form.names():
            (*others, last) = form.needed
            starts_at_0 = last in SERIES and headers[form_places[last][0]].quantities[0].endswith(" 0")
            if last not in SERIES or (len(form_places[last]) > 1 - len(others) and not (others and starts_at_0)):
                places_of_form = {name: indices for name, indices in form_places.items() if name in form.names()}
                places_of_form |= {name: () for name in omitted & form.names() if name.startswith("sigma")}
                return SheetLayout(form, tuple(cell.strip() for cell in cells), headers, places_of_form)
    return None
