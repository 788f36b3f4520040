"""Write the tables of `fallback`:  python -m tools.restitution_table > src/viscopade/data/restitution.txt .

They are those of the exported kernels: of exports/viscopade_speed_full.h (`lookup_full`), and of viscopade_full.h
(`last_place`), which serves where w = beta^5 v is outside the first. The same on every machine, to the byte.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator

from viscopade.arrays.fallback import DATA
from viscopade.generated import MARKER
from viscopade.kernels.forms import last_place
from viscopade.kernels.forms.speed_table_last_place import LastPlaceTable


def text() -> str:
    """Return the file's content."""
    lines = [
        f"# {MARKER}: python -m tools.restitution_table > src/viscopade/{DATA}",
        "# End of contact: where the force vanishes (eq:tEndAdvanced).",
        "# speed FIRST SPLIT SWITCH, and the rows of the table over w = beta^5 speed: 2^SPLIT to each octave from",
        "# w = 2^FIRST on; base is 1 below row SWITCH. Then full SWITCH, and the rows of the table over v*; base is 1",
        "# up to that row. The numbers of a row are those of the C headers, in hexadecimal.",
        *_speed(LastPlaceTable()),
        f"full {last_place.switch()}",
        *map(_line, (row.numbers for row in last_place.double_rows())),
    ]
    return "\n".join(lines) + "\n"


def _speed(table: LastPlaceTable) -> Iterator[str]:
    yield f"speed {table.first} {table.split} {table.switch}"
    yield from map(_line, table.rows)


def _line(row: Iterable[float]) -> str:
    return " ".join(number.hex() for number in row)


if __name__ == "__main__":
    print(text(), end="")
