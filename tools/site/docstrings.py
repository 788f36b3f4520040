"""Docstrings are plain text with formulas such as v*^2 and |x|; reStructuredText gives them the same words."""

import re
from itertools import pairwise
from pkgutil import resolve_name
from typing import Any

from docutils import nodes
from sphinx.addnodes import pending_xref
from sphinx.application import Sphinx
from sphinx.environment import BuildEnvironment
from sphinx.util.nodes import make_refnode
from sphinx.util.typing import ExtensionMetadata

CODE = re.compile(r"(``.*?``|`[^`]*`)")
PROPERTIES: dict[str, list[str]] = {}
HEADING = re.compile(r"-{3,}")


def escaped(line: str) -> str:
    """Return a line whose stars, bars and final underscores are text; code in backticks stays."""
    parts = CODE.split(line)
    parts[::2] = [re.sub(r"([\\*|]|_(?!\w))", r"\\\1", part) for part in parts[::2]]
    return "".join(parts)


def indent(line: str) -> int:
    """Return the number of spaces before the text."""
    return len(line) - len(line.lstrip())


def prepare(app: Sphinx, what: str, name: str, item: Any, options: Any, lines: list[str]) -> None:
    """Escape what Sphinx would read as markup, and show displayed formulas as they stand."""
    lines_out: list[str] = []
    margin, formula, example = 0, False, False
    for before, line in pairwise(["", *lines]):
        text = line.strip()
        example = bool(text) and (example or text.startswith(">>>"))
        if text and formula:
            formula = indent(line) > margin
        elif text and not before.strip() and indent(line) >= margin + 4:
            formula = True
            lines_out += [" " * margin + "::", ""]
        if text and not formula:
            margin = indent(line)
        lines_out.append(line if formula or example or HEADING.fullmatch(text) else escaped(line))
    lines[:] = lines_out
    if what == "property":
        PROPERTIES[name] = lines_out


def restore(app: Sphinx, what: str, name: str, item: Any, options: Any, lines: list[str]) -> None:
    """Restore a property's docstring: Sphinx takes its words before a colon for a type."""
    lines[:] = PROPERTIES.get(name, lines)


def link(app: Sphinx, env: BuildEnvironment, node: pending_xref, text: nodes.Element) -> nodes.Element | None:
    """Return a link to a public name that a docstring calls by a part of it, or by the module that defines it."""
    objects = env.domains.python_domain.objects
    whole = node["reftarget"].removeprefix("viscopade.")
    for tail in (whole, whole.rpartition(".")[2]):
        names = [name for name in objects if name.endswith(f".{tail}")]
        if node.get("refdomain") == "py" and len(names) == 1:
            entry = objects[names[0]]
            return make_refnode(app.builder, node["refdoc"], entry.docname, entry.node_id, text, names[0])
    return None


def itself(name: str) -> Any:
    """Return what a dotted name stands for; a class method is made anew for each call, but its function is not."""
    thing: Any = resolve_name(name)
    return getattr(thing, "__func__", thing)


def back(app: Sphinx, page: str, template: str, context: dict[str, Any], doctree: nodes.document | None) -> None:
    """Lead from a source back to the reference: Sphinx takes all names of a module to begin like the first one."""
    if not page.startswith("_modules/viscopade"):
        return
    objects = app.env.domains.python_domain.objects.items()
    places = {itself(name): entry.node_id for name, entry in objects if entry.objtype != "attribute"}

    def place(backlink: re.Match[str]) -> str:
        thing = itself(f"{page.removeprefix('_modules/').replace('/', '.')}:{backlink['name']}")
        return f'id="{backlink["name"]}">\n<a class="viewcode-back" href="{backlink["page"]}#{places[thing]}"'

    pattern = r'id="(?P<name>[\w.]+)">\s*<a class="viewcode-back" href="(?P<page>[^"#]*)#[^"]*"'
    context["body"] = re.sub(pattern, place, context["body"])


def setup(app: Sphinx) -> ExtensionMetadata:
    """Register the steps: `prepare` before the sections of docstrings are read, `restore` after that."""
    app.connect("autodoc-process-docstring", prepare, priority=100)
    app.connect("autodoc-process-docstring", restore, priority=900)
    app.connect("missing-reference", link)
    app.connect("html-page-context", back)
    return {}
