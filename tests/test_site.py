"""The documentation site, built and driven in a headless Chromium: links, search, formulas, small screens."""

import inspect
import os
import re
import subprocess
import sys
import time
from contextlib import suppress
from html import unescape
from html.parser import HTMLParser
from importlib.util import find_spec
from pathlib import Path
from urllib.parse import unquote

import pytest

import viscopade
from tests.devtools import Navigated, opened
from tests.patience import HANGS
from tests.test_docs import faults

ROOT = Path(__file__).parents[1]
NEEDED = ("sphinx", "furo", "myst_parser", "sphinx_copybutton", "math_core")
SAMPLE = (
    "docs/index.html",
    "docs/reference/python-api.html",
    "docs/theory/exact-function.html",
    "docs/results/audit.html",
    "docs/figures/README.html",
    "notebooks/02_derivation.html",
    "derivations/06_time_reversal.html",
    "exports/README.html",
    "genindex.html",
)
DERIVATIONS = sorted((ROOT / "derivations").glob("[0-9]*.py"))
CITED = "Eur. Phys. J. E"
# In a formula's place: a letter, a Greek one's name, a derivative, a relation; or Markdown's emphasis.
PLAIN = re.compile(
    r"(?<!['\w/])[b-zB-Z](?!\w)|\b(?:eps0?|alpha|beta|chi|delta|zeta|theta|kappa|[lL]ambdas?|mu|nu|xi|pi|rho|sigma|tau"
    r"|phi|psi|omega|x_max|sin|cos|ln|exp|sqrt)\b|\b\w{1,2}'(?!s)|[=<>*_~]|\+-"
)


def prose(page):
    """Return a derivation as Markdown without its code."""
    from tools.site.pages import cells  # which imports Sphinx

    text = "\n\n".join(text for is_markdown, text in cells(page.read_text("utf-8")) if is_markdown)
    return re.sub(r"`[^`\n]+`", "code", text).replace(CITED, "cited")


@pytest.fixture(scope="module")
def site(tmp_path_factory):
    """The site, built with warnings as errors."""
    missing = [name for name in NEEDED if not find_spec(name)]
    if missing:
        pytest.skip(f"not installed: {', '.join(missing)}; pip install -c constraints.txt -e '.[docs]'")
    folder = tmp_path_factory.mktemp("site")
    words = ["-q", "-W", "--keep-going", "-E", "-b", "html", "-c", "tools/site", "-d", folder / "trees"]
    build = subprocess.run(
        [sys.executable, "-m", "sphinx", *words, ".", folder / "site"],
        cwd=ROOT,
        env={**os.environ, "NO_COLOR": "1"},
        capture_output=True,
        text=True,
        timeout=HANGS,
    )
    assert (build.returncode, build.stderr) == (0, "")
    return folder / "site"


class Marks(HTMLParser):
    """What a page of the site names: its places, its links, and what it loads."""

    def __init__(self, path):
        super().__init__()
        self.ids, self.links, self.loaded = set(), set(), set()
        self.feed(path.read_text("utf-8"))

    def handle_starttag(self, tag, attributes):
        found = dict(attributes)
        self.ids |= {found[name] for name in ("id", "name") if name in found and (name == "id" or tag == "a")}
        if tag == "a" and "href" in found:
            self.links.add(found["href"])
        elif tag == "link" and found["rel"] in ("stylesheet", "icon", "preload"):
            self.loaded.add(found["href"])
        elif "src" in found:
            self.loaded.add(found["src"])


@pytest.fixture(scope="module")
def marks(site):
    return {path: Marks(path) for path in site.rglob("*.html")}


def test_the_docs_notebooks_derivations_and_files_are_pages(site, marks):
    pages = {path.relative_to(site).as_posix() for path in marks}
    assert {*SAMPLE, "index.html", "search.html", "README.html"} <= pages
    for folder, pattern in (("docs", "**/*.md"), ("notebooks", "*.ipynb"), ("derivations", "*.py")):
        for source in (ROOT / folder).glob(pattern):
            assert source.relative_to(ROOT).with_suffix(".html").as_posix() in pages


def test_every_link_leads_somewhere(site, marks):
    dead = []
    for path, found in marks.items():
        for link in found.links:
            if not link.startswith(("https://", "http://", "mailto:")):
                name, _, place = unquote(link).partition("#")
                target = (path.parent / name.partition("?")[0]).resolve() if name else path
                if not target.is_file() or (place and target.suffix == ".html" and place not in marks[target].ids):
                    dead.append((path.relative_to(site).as_posix(), link))
    assert dead == []


def test_files_that_pages_load_are_files_of_the_site(site, marks):
    for path, found in marks.items():
        for name in found.loaded:
            if not name.startswith("data:"):
                assert (path.parent / name.partition("?")[0]).resolve().is_file(), name
    for sheet in site.rglob("*.css"):
        assert re.findall(r"url\(\W*https?:|@import", sheet.read_text("utf-8")) == [], sheet


def test_docstrings_are_shown_as_they_are_written(site):
    text = (site / "docs" / "reference" / "python-api.html").read_text("utf-8")
    assert "\\" not in re.sub(r"<[^>]*>", "", text.partition("<article")[2])
    assert "v* = beta^(1/2) v^(1/10), &gt;= 0; may be infinite" in text
    assert "|pole - zero| / |pole|" in text


def test_every_public_name_has_its_docstring_and_source(site, marks):
    page = marks[site / "docs" / "reference" / "python-api.html"]
    source = ROOT / "docs" / "reference" / "python-api.md"
    listed = set(re.findall(r"^\| `vp\.([\w.]+)` ", source.read_text("utf-8"), re.MULTILINE))
    names = {*viscopade.__all__} - {"__version__"}
    modules = {name for name in names if inspect.ismodule(getattr(viscopade, name))}
    assert {name for name in listed if "." not in name} == names - modules
    assert {name.partition(".")[0] for name in listed if "." in name} == modules
    assert {f"viscopade.{name}" for name in listed} <= page.ids
    sources = {link.partition("#")[2] for link in page.links if "_modules/" in link}
    assert {name.rpartition(".")[2] for name in listed} <= sources


@pytest.mark.parametrize("page", DERIVATIONS, ids=lambda page: page.stem)
def test_derivations_have_formulas_where_they_speak_of_mathematics(page):
    pytest.importorskip("sphinx")
    parser = pytest.importorskip("markdown_it").MarkdownIt("commonmark")
    parser.use(pytest.importorskip("mdit_py_plugins.dollarmath").dollarmath_plugin, allow_labels=False)
    text = prose(page)
    assert faults(text) == []
    tokens = [token for token in parser.parse(text) if token.type in ("inline", "math_block", "code_block")]
    inline = [child for token in tokens for child in token.children or ()]
    assert {token.type for token in (*tokens, *inline)} & {"code_block", "em_open", "strong_open"} == set()
    assert PLAIN.findall(" ".join(child.content for child in inline if child.type == "text")) == []


def test_a_derivation_shows_what_it_prints(site):
    page = (site / "derivations" / "07_coefficients.html").read_text("utf-8")
    assert "h_4 = 3*lambda_1**2/5" in unescape(re.sub(r"<[^>]+>", "", page))


# --- in a browser -----------------------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def tab(site, tmp_path_factory):
    with opened(tmp_path_factory.mktemp("profile")) as found:
        yield found


@pytest.fixture
def show(site, tab):
    """A function that opens a page of the site; no page may complain, or ask anything of a server."""
    tab.open("about:blank")

    def show(name, width=1200):
        judge()
        size = {"width": width, "height": 800, "deviceScaleFactor": 1, "mobile": False}
        tab.call("Emulation.setDeviceMetricsOverride", **size)
        tab.open((site / name).as_uri() if "?" not in name else f"{site.as_uri()}/{name}")
        return tab

    def judge():
        assert tab.errors == []
        assert {url.partition(":")[0] for url in tab.requests} <= {"file", "data", "about"}

    yield show
    judge()


def wait(tab, condition):
    end = time.monotonic() + HANGS
    while True:
        with suppress(Navigated):  # a page that leads to another one may go while it is asked
            if tab.evaluate(f"Boolean({condition})"):
                return
        assert time.monotonic() < end, condition
        time.sleep(0.05)


def test_no_page_scrolls_sideways_on_a_phone(site, show, marks):
    """Every page but the sources of the package, which scroll in a box."""
    pages = [path.relative_to(site).as_posix() for path in marks if path != site / "index.html"]
    read = [page for page in pages if not page.startswith("_modules/")]
    assert len(read) > 80
    width = "document.documentElement.scrollWidth"
    assert [page for page in read if show(page, width=400).evaluate(width) > 400] == []


def test_formulas_are_drawn(show):
    tab = show("docs/theory/exact-function.html")
    heights = tab.evaluate("[...document.querySelectorAll('article math')].map(m => m.getBoundingClientRect().height)")
    assert len(heights) > 100
    assert min(heights) > 5
    top, bottom = (f"f.children[{i}].getBoundingClientRect()" for i in (0, 1))
    gaps = f"[...document.querySelectorAll('article .formula mfrac')].map(f => {bottom}.top - {top}.bottom)"
    assert min(tab.evaluate(gaps)) > -1  # one number above the other
    assert "\\" not in tab.evaluate("[...document.querySelectorAll('math')].map(m => m.textContent).join()")


def test_the_calculator_is_on_the_first_page(show):
    tab = show("docs/index.html")
    frame = tab.evaluate("document.querySelector('iframe.calculator').getAttribute('src')")
    assert tab.evaluate("document.querySelector('iframe.calculator').getBoundingClientRect().height") > 400
    assert show(f"docs/{frame}").evaluate("document.querySelectorAll('input').length") > 3


def found_by_search(tab):
    wait(tab, "/found|did not match/.test(document.querySelector('.search-summary')?.textContent ?? '')")
    return tab.evaluate("[...document.querySelectorAll('ul.search a')].map(a => a.href)")


@pytest.mark.parametrize(
    ("words", "wanted"),
    [
        ("Lambert", "docs/results/laws.html"),
        ("restitution", "viscopade.restitution"),
    ],
)
def test_search(show, words, wanted):
    assert any(wanted in link for link in found_by_search(show(f"search.html?q={words}")))
