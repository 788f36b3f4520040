"""Files of the repository as pages: notebooks and derivations as Markdown, the contents, the reference of Python."""

import inspect
import json
import os
import re
import subprocess
import sys
from collections.abc import Iterator
from contextlib import redirect_stdout
from io import StringIO
from pathlib import Path
from pkgutil import resolve_name
from typing import Any

from sphinx.application import Sphinx
from sphinx.util.typing import ExtensionMetadata

FENCE = "`" * 8
# Pages whose neighbours stand below them in the contents.
FOLDERS = {
    "docs/usage/simulators": "simulators/*",
    "notebooks/README": "[0-9]*",
    "derivations/README": "[0-9]*",
}
INDEX = "docs/index"
REFERENCE = "docs/reference/python-api"
CALCULATOR = "calculator.html"  # beside the first page's folder
EMBEDDED = f"""## Calculator

{FENCE}{{raw}} html
<iframe class="calculator" src="../{CALCULATOR}" title="Calculator"></iframe>
<p><a href="../{CALCULATOR}">The calculator on a page of its own</a></p>
{FENCE}

"""
ALONE = {"README"}  # a page that the contents leave out


def code(text: str, language: str, kind: str = "") -> str:
    """Return a block of code; `kind` is its class on the page."""
    options = [f":class: {kind}"] if kind else []
    return "\n".join((f"{FENCE}{{code-block}} {language}", *options, "", text.rstrip(), FENCE, ""))


def output(data: dict[str, Any]) -> str:
    """Return the best form of a result: a picture, Markdown, a formula, or text."""
    joined = {kind: "".join(value) for kind, value in data.items()}
    if "image/png" in joined:
        image = joined["image/png"].replace("\n", "")
        return f"![Picture that the cell above draws](data:image/png;base64,{image})\n"
    if "text/markdown" in joined:
        return joined["text/markdown"]
    if "text/latex" in joined:
        return f"$${joined['text/latex'].strip('$').removeprefix(chr(92) + 'displaystyle')}$$\n"
    return code(joined["text/plain"], "text", "output")


def notebook(source: str) -> str:
    """Return an executed notebook as Markdown: nothing is run again."""
    blocks = []
    for cell in json.loads(source)["cells"]:
        text = "".join(cell["source"])
        blocks.append(text if cell["cell_type"] == "markdown" else code(text, "python"))
        for result in cell.get("outputs", ()):
            streamed = result["output_type"] == "stream"
            blocks.append(code("".join(result["text"]), "text", "output") if streamed else output(result["data"]))
    return "\n\n".join(blocks)


def cells(source: str) -> Iterator[tuple[bool, str]]:
    """Yield the cells, `# %%`, of a program: whether a cell is Markdown, and its text."""
    for cell in re.split(r"^# %%", source, flags=re.MULTILINE)[1:]:
        kind, _, text = cell.partition("\n")
        is_markdown = kind.strip() == "[markdown]"
        yield is_markdown, re.sub(r"^# ?", "", text, flags=re.MULTILINE) if is_markdown else text.strip()


def derivation(source: str) -> str:
    """Run a program in cells and return it as Markdown, with what each cell prints below the cell."""
    blocks, names = list[str](), {"__name__": "__main__"}
    for is_markdown, text in cells(source):
        if is_markdown:
            blocks.append(text)
            continue
        with redirect_stdout(StringIO()) as printed:
            exec(text, names)
        blocks.append(code(text, "python"))
        if printed.getvalue():
            blocks.append(code(printed.getvalue(), "text", "output"))
    return "\n\n".join(blocks)


def contents(entries: list[str], caption: str = "", glob: bool = False) -> str:
    """Return a part of the contents in the sidebar."""
    options = [":hidden:", *([f":caption: {caption}"] if caption else []), *([":glob:"] if glob else [])]
    return "\n".join(("", FENCE + "{toctree}", *options, "", *entries, FENCE, ""))


def sections(text: str) -> str:
    """Return the contents: the sections of the index, with the first link to a page in each item of their lists."""
    navigation = []
    for section in text.split("\n## ")[1:]:
        caption, _, body = section.partition("\n")
        links = re.findall(r"^- \[[^\]]+\]\(([^)#]+)\.md\)", body, re.MULTILINE)
        if links:
            navigation.append(contents(links, caption))
    return "".join(navigation)


def folded(text: str, name: str) -> list[str]:
    """Return the pages that the index lists below a page: items of a list within an item."""
    pages, parent = list[str](), ""
    for below, link in re.findall(r"^( *)- \[[^\]]+\]\(([^)#]+)\.md\)", text, re.MULTILINE):
        page = os.path.normpath(f"docs/{link}")
        parent = parent if below else page
        pages += [f"/{page}"] if below and parent == name else []
    return pages


def reference(table: re.Match[str]) -> str:
    """Return a table of names with the docstring of each below it."""
    names = re.findall(r"^\| `([\w.]+)` ", table[0], re.MULTILINE)
    directives = [directive(re.sub(r"^vp\.", "viscopade.", name)) for name in names]
    return f"{table[0]}\n{FENCE}{{eval-rst}}\n{''.join(directives)}{FENCE}\n"


def directive(name: str) -> str:
    """Return the directive that shows the docstring of a public name."""
    thing: Any = resolve_name(name)
    return f".. autoclass:: {name}\n   :members:\n\n" if inspect.isclass(thing) else f".. autofunction:: {name}\n\n"


def make_calculator(app: Sphinx) -> None:
    """Write the calculator into the site."""
    file = Path(app.outdir, CALCULATOR)
    file.parent.mkdir(parents=True, exist_ok=True)
    words = [sys.executable, "-m", "viscopade", "calculator", "--output", str(file)]
    here = {**os.environ, "PYTHONPATH": str(app.srcdir / "src")}
    subprocess.run(words, cwd=app.srcdir, env=here, stdout=subprocess.DEVNULL, check=True)


def place(heading: re.Match[str]) -> str:
    """Return a heading with a formula under its name on a repository page; MyST leaves the formula out of the name."""
    name = re.sub(r"[^\w\- ]", "", heading[1].lower()).replace(" ", "-")
    return f"({name})=\n{heading[0]}"


def read(app: Sphinx, name: str, content: list[str]) -> None:
    """Turn the source of a page into Markdown for the site."""
    text = content[0]
    suffix = Path(app.env.doc2path(name)).suffix
    text = notebook(text) if suffix == ".ipynb" else derivation(text) if suffix == ".py" else text
    text = re.sub(r"^##+ (.*\$.*)$", place, text, flags=re.MULTILINE)
    text = re.sub(r'^<a id="([\w-]+)"></a>$', r"(\1)=", text, flags=re.MULTILINE)
    if name == INDEX:
        text = text.replace("## Symbols\n", EMBEDDED + "## Symbols\n", 1) + sections(text)
    if name == REFERENCE:
        text = re.sub(r"^\| name \|.*?\n(?=\n|\Z)", reference, text, flags=re.MULTILINE | re.DOTALL)
    below = folded((app.srcdir / f"{INDEX}.md").read_text(encoding="utf-8"), name)
    if below:
        text += contents(below)
    if name in FOLDERS:
        text += contents([FOLDERS[name]], glob=True)
    if name in ALONE:
        text = f"---\norphan: true\n---\n\n{text}"
    content[0] = text


def setup(app: Sphinx) -> ExtensionMetadata:
    """Register the two steps."""
    app.connect("builder-inited", make_calculator)
    app.connect("source-read", read)
    return {}
