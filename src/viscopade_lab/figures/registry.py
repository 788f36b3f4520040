"""All figures by name, and their files as SVG, PDF or PNG.

The same versions of Matplotlib and of this package make the same bytes. Matplotlib is loaded only by drawing, its
settings are left as they were, and no display is needed.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager
from typing import TYPE_CHECKING

from viscopade.plots.sheet import file_content, style_context
from viscopade.progress import quietly, track
from viscopade_lab.figures import audit, cooling, laws, paper
from viscopade_lab.figures.paper import Figure

if TYPE_CHECKING:
    from matplotlib.figure import Figure as Sheet

FIGURES: Mapping[str, Figure] = {**paper.FIGURES, **cooling.FIGURES, **laws.FIGURES, **audit.FIGURES}


def render(names: Iterable[str] = tuple(FIGURES), formats: Iterable[str] = ("svg",)) -> dict[str, bytes]:
    """Return the contents of files by their names, for figures (keys of `FIGURES`) and formats ("svg", "pdf", "png").

    Raises
    ------
    ModuleNotFoundError
        Without Matplotlib.
    """
    names, formats = list(names), list(formats)
    files = {}
    # A progress bar over all figures, without the bars of computations inside.
    for i in track(range(len(names)), "figures"):
        with quietly(), drawn(names[i]) as sheet:
            for kind in formats:
                command = f"viscopade figures --only {names[i]} --format {kind}"  # for the file's metadata
                files[f"{names[i]}.{kind}"] = file_content(sheet, FIGURES[names[i]].description, command, kind)
    return files


@contextmanager
def drawn(name: str) -> Iterator[Sheet]:
    """Give a drawn figure, a key of `FIGURES`, and keep Matplotlib's settings for saving it within a `with` block."""
    with style_context():
        sheet = FIGURES[name].draw()
        engine = sheet.get_layout_engine()
        assert engine is not None
        engine.execute(sheet)  # draws nothing, unlike `draw_without_rendering`
        sheet.set_layout_engine("none")  # the layout stays the same for every format
        yield sheet
