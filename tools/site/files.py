"""Links to files that are no pages: each file is copied to the same place, and a page lists each folder."""

import html
import os
import shutil
from collections.abc import Iterator
from pathlib import Path, PurePosixPath
from typing import Any

from docutils import nodes
from sphinx.addnodes import download_reference, pending_xref
from sphinx.application import Sphinx
from sphinx.util.typing import ExtensionMetadata

Page = tuple[str, dict[str, Any], str]


def replace_links(app: Sphinx, doctree: nodes.document) -> None:
    """Make links to files and folders that are no pages plain ones, and remember their targets."""
    folder = Path(app.srcdir, app.env.docname).parent
    for node in [*doctree.findall(download_reference), *doctree.findall(pending_xref)]:
        target = node["reftarget"]
        if node["reftype"] != "myst" or target in app.env.found_docs:
            continue
        # Sphinx has cut the suffix of a file that it takes for a page.
        files = Path(app.srcdir).glob(f"{target}.*") if node.get("refdomain") == "doc" else (folder / target,)
        path = next(iter(files)).resolve()
        if path.exists():
            uri = os.path.relpath(path, folder)
            if (path / "README.md").exists():
                uri += "/README.html"
            else:
                linked(app).add(path.relative_to(app.srcdir).as_posix())
                uri += "/index.html" if path.is_dir() else ""
            node.replace_self(nodes.reference("", "", *node.children, refuri=uri, internal=True))


def linked(app: Sphinx) -> set[str]:
    """Return the places of the files and folders that pages link to."""
    linked: set[str] = app.env.__dict__.setdefault("viscopade_linked", set())
    return linked


def pages(app: Sphinx) -> Iterator[Page]:
    """Yield a page for every linked folder."""
    for place in sorted(linked(app)):
        path = Path(app.srcdir, place)
        if path.is_dir():
            name = PurePosixPath(place).name
            yield f"{place}/index", {"title": name, "body": listing(path, name)}, "page.html"


def with_files_of_folders(app: Sphinx) -> set[str]:
    """Return the places of all folders to list and files to copy."""
    folders = [Path(app.srcdir, place) for place in linked(app) if Path(app.srcdir, place).is_dir()]
    inside = {file.relative_to(app.srcdir).as_posix() for folder in folders for file in folder.iterdir()}
    return linked(app) | {place for place in inside if Path(app.srcdir, place).is_file()}


def listing(folder: Path, name: str) -> str:
    """Return the body of a folder's page."""
    files = [file for file in sorted(folder.iterdir()) if file.is_file()]
    rows = "".join(
        f'<li><a href="{html.escape(file.name)}">{html.escape(file.name)}</a>, '
        f"{max(file.stat().st_size // 1000, 1)} kB</li>"
        for file in files
    )
    return f"<h1>{html.escape(name)}</h1><ul>{rows}</ul>"


def copy(app: Sphinx, exception: Exception | None) -> None:
    """Copy the linked files to the same places in the site."""
    if exception is None:
        for place in with_files_of_folders(app):
            if Path(app.srcdir, place).is_file():
                target = Path(app.outdir, place)
                target.parent.mkdir(parents=True, exist_ok=True)
                shutil.copyfile(Path(app.srcdir, place), target)
        Path(app.outdir, "index.html").write_text(
            '<!doctype html>\n<meta charset="utf-8">\n<title>viscopade</title>\n'
            f'<meta http-equiv="refresh" content="0; url={app.config.root_doc}.html">\n'
            f'<a href="{app.config.root_doc}.html">viscopade</a>\n',
            encoding="utf-8",
        )


def setup(app: Sphinx) -> ExtensionMetadata:
    """Register the three steps."""
    app.connect("doctree-read", replace_links, priority=100)  # before Sphinx copies what can be downloaded
    app.connect("html-collect-pages", pages)
    app.connect("build-finished", copy)
    return {}
