"""README and the pages of docs/: every file is reached, and GitHub renders all formulas."""

import re
from pathlib import Path

import pytest

from viscopade.generated import MARKER
from viscopade_lab.figures.registry import FIGURES

ROOT = Path(__file__).parents[1]
DOCS = ROOT / "docs"
PAGES = [ROOT / "README.md", ROOT / "CONTRIBUTING.md", ROOT / "examples" / "README.md", *sorted(DOCS.rglob("*.md"))]
WRITTEN = [page for page in PAGES if not page.read_text("utf-8").startswith("<!-- Generated")]

# All that the pages' formulas need: a misspelt command would be printed in red.
COMMANDS = set(
    re.findall(
        r"\w+",
        """alpha approx arccos arccosh ast beta cdot chi circ cos cosh ddot deg delta Delta dot dots eta exp frac
        gamma Gamma ge hat Im in infty int kappa lambda Lambda langle le left ln log lvert lVert mathrm max min mu ne nu
        omega overline phi pi pm propto psi qquad quad rangle Re rho right rVert rvert sigma sim sin sinh sqrt sum tag
        tau text tfrac theta tilde times to varepsilon varphi varrho widehat xi zeta""",
    )
)


def ids(page):
    return page.relative_to(ROOT).as_posix()


def prose(page):
    """Return the text without code, which is replaced by a letter."""
    text = re.sub(r"^```.*?^```$", "x", page.read_text("utf-8"), flags=re.MULTILINE | re.DOTALL)
    return re.sub(r"`[^`\n]+`", "x", re.sub(r"(?<=\n\n)(?: {4}[^\n]*\n)+", "x\n", text))


def links(page):
    """Return the files that links and pictures of a page name; tests/test_site.py finds those that are dead."""
    names = (target.partition("#")[0] for target in re.findall(r"\]\(([^)\s]+)\)", prose(page)))
    return {(page.parent / name).resolve() for name in names if name and ":" not in name}


def test_every_file_is_reached_from_the_index():
    reached, ahead = set(), [DOCS / "index.md"]
    while ahead:
        file = ahead.pop()
        if file not in reached:
            reached.add(file)
            ahead += [target for target in links(file) if target.is_file()] if file.suffix == ".md" else []
    assert [ids(file) for file in sorted(DOCS.rglob("*")) if file.is_file() and file not in reached] == []
    assert ROOT / "README.md" in reached


@pytest.mark.parametrize("page", PAGES, ids=ids)
def test_every_row_stands_in_a_table(page):
    """A row after an empty line has a line of dashes below it, or it is shown as text with bars."""
    lines = ["", *prose(page).splitlines(), ""]
    alone = [
        line
        for before, line, after in zip(lines, lines[1:], lines[2:], strict=False)
        if line.startswith("|") and not before.startswith("|") and not re.fullmatch(r"[|: -]+", after)
    ]
    assert alone == []


def test_the_readme_fits_on_a_page_and_leads_to_the_index():
    assert len((ROOT / "README.md").read_text("utf-8").splitlines()) <= 110
    assert DOCS / "index.md" in links(ROOT / "README.md")


def test_the_sidebar_has_at_most_30_entries():
    """An entry is the first link of an item of a list on the first page; items within an item are folded below it."""
    items = re.findall(r"^- \[[^\]]+\]\(([^)#]+)\.md\)", (DOCS / "index.md").read_text("utf-8"), re.MULTILINE)
    assert 20 < len(items) <= 30
    assert [item for item in items if item.startswith("development/")] == []


DISPLAYED = re.compile(r"^ *\$\$(.+?)\$\$$", re.MULTILINE | re.DOTALL)
INLINE = re.compile(r"(?<![^\s(\[|])\$(?=\S)([^$]+?)(?<=\S)\$(?![\w$])")  # after a space or a bracket
EATEN = re.compile(r"\\[^A-Za-z]|\|")  # by Markdown: a backslash before punctuation, and the ends of a table's cells
HTML = re.compile(r"<(?! )|(?<! )>")
ASCII = re.compile(r"[\w)*]\^[\w(-]|\b[A-Za-z]_[\w{]|\bsqrt\(|\bint_")


def faults(text):
    """Return what GitHub would not show as a formula, and powers and indices outside of formulas."""
    outside = INLINE.sub("x", DISPLAYED.sub("x", text))
    outside = re.sub(r"\]\([^)]*\)", "]", outside)
    found = [line for line in outside.splitlines() if "$" in line or ASCII.search(line)]
    for formula in DISPLAYED.findall(text) + INLINE.findall(DISPLAYED.sub("x", text)):
        unknown = set(re.findall(r"\\([A-Za-z]+)", formula)) - COMMANDS
        if formula.count("{") != formula.count("}") or EATEN.search(formula) or HTML.search(formula) or unknown:
            found.append(formula)
    return found


@pytest.mark.parametrize("page", WRITTEN, ids=ids)
def test_formulas_are_such_that_github_renders_them(page):
    assert faults(prose(page)) == []


@pytest.mark.parametrize("bad", [r"$\betta$", "$a_{1$", "$a|b$", r"$a\,b$", "a$b$", "$ a$", "$a<b$", "h_2", "v*^2"])
def test_formulas_that_github_does_not_render_are_found(bad):
    assert faults(r"where $\beta > 0$ and ($v_\ast$)") == []
    assert faults(f"where {bad} holds") != []


def test_all_figures_have_a_caption_and_the_papers_number():
    text = (DOCS / "figures" / "README.md").read_text("utf-8")
    rows = re.findall(r"^\| \[([\w-]+)\.svg\]\(#[\w-]+\) \| (Fig\. \d)? *\|$", text, re.MULTILINE)
    assert {name: label or None for name, label in rows} == {n: figure.paper_label for n, figure in FIGURES.items()}
    assert {name for name, _ in rows} == {path.stem for path in (DOCS / "figures").glob("*.svg")}
    in_paper = ["truncated-series-diverge", "pade-at-large-v-star", "pade-on-linear-axes", "ice-pade-and-measured-fit"]
    assert [name for name, label in sorted(rows, key=lambda row: row[1]) if label] == in_paper
    for name, label in rows:
        (caption,) = re.findall(rf"^## {name}\n\n(.+?)\n\n!\[.+?\]\({name}\.svg\)$", text, re.MULTILINE | re.DOTALL)
        assert len(caption) > 100
        assert caption.startswith(label.replace("Fig.", "The paper's figure"))


GENERATED = [
    path
    for folder in ("docs", "examples", "exports")
    for path in sorted((ROOT / folder).rglob("*.*"))
    if path.is_file() and MARKER.encode() in path.read_bytes()[:1000]
]


@pytest.mark.parametrize("path", GENERATED, ids=ids)
def test_generated_files_state_their_licence_and_what_to_cite(path):
    head = " ".join(path.read_text("utf-8")[:4000].split())
    assert re.search(r'SPDX-License-Identifier"?: "?MIT', head)
    (holder,) = re.findall(r"^Copyright \(c\) (.+)$", (ROOT / "LICENSE").read_text("utf-8"), re.MULTILINE)
    assert re.search(rf'SPDX-FileCopyrightText"?: "?{holder}', head)
    assert "doi:10.1103/PhysRevE.84.021302" in head
