"""All figures by name, and their files as SVG, PDF or PNG.

The same versions of Matplotlib and of this package make the same bytes. Matplotlib is loaded only by drawing, its
settings are left as they were, and no display is needed.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager
from typing import TYPE_CHECKING

from viscopade.plots.sheet import Page, file_content, style_context
from viscopade.progress import quietly, track
from viscopade_lab.figures import audit, cooling, laws, paper
from viscopade_lab.figures.paper import Figure

if TYPE_CHECKING:
    from matplotlib.figure import Figure as Sheet

FIGURES: Mapping[str, Figure] = {**paper.FIGURES, **cooling.FIGURES, **laws.FIGURES, **audit.FIGURES}


def render(
    names: Iterable[str] = tuple(FIGURES), formats: Iterable[str] = ("svg",), page: Page | None = None
) -> dict[str, bytes]:
    """Return the contents of files by their names, for figures (keys of `FIGURES`) and formats ("svg", "pdf", "png").

    `page` has a size and a font size other than those of the figures.

    Raises
    ------
    ModuleNotFoundError
        Without Matplotlib.
    """
    names, formats, page = list(names), list(formats), page or Page()
    # The file's metadata have the command that draws it; lengths are in m, of which an inch is 0.0254.
    options = "" if page.size is None else " --size {:.4g} {:.4g}".format(*(0.0254 * length for length in page.size))
    options += "" if page.font_size == Page.font_size else f" --font-size {page.font_size:g}"
    files = {}
    # A progress bar over all figures, without the bars of computations inside.
    for i in track(range(len(names)), "figures"):
        with quietly(), drawn(names[i], page) as sheet:
            for kind in formats:
                command = f"viscopade figures --only {names[i]} --format {kind}{options}"
                files[f"{names[i]}.{kind}"] = file_content(sheet, FIGURES[names[i]].description, command, kind)
    return files


@contextmanager
def drawn(name: str, page: Page | None = None) -> Iterator[Sheet]:
    """Give a drawn figure, a key of `FIGURES`, and keep Matplotlib's settings for saving it within a `with` block.

    `page` has a size and a font size other than those of the figure.
    """
    with style_context(page):
        sheet = FIGURES[name].draw()
        engine = sheet.get_layout_engine()
        assert engine is not None
        engine.execute(sheet)  # draws nothing, unlike `draw_without_rendering`
        sheet.set_layout_engine("none")  # the layout stays the same for every format
        yield sheet
