"""The examples of the README and of the pages run and print what they show; numbers are those of code and exports."""

import io
import re
import shlex
import shutil
import subprocess
from contextlib import redirect_stdout
from fractions import Fraction
from itertools import pairwise
from pathlib import Path

import pytest
from mpmath import mpf

from tests.cli import called
from tests.closed_forms import nu_2
from tests.patience import HANGS
from tests.test_citation import verdicts
from tools import readme
from viscopade.arithmetic.decimals import at_most
from viscopade.collision import exact
from viscopade.collision.spheres import beta_si_from_cgs
from viscopade.kernels import catalogue, compact
from viscopade.simulators.formula import ratio_at_force_end, ratio_for_return
from viscopade.theory.law import law_of
from viscopade.theory.pade import pade
from viscopade_lab.bench import picture
from viscopade_lab.bench.result import from_csv

ROOT = Path(__file__).parents[1]
USAGE = ROOT / "docs" / "usage"
README = (ROOT / "README.md").read_text("utf-8")
PAGES = [README, *(page.read_text("utf-8") for page in sorted(USAGE.glob("*.md")))]
READING = (ROOT / "docs" / "development" / "reading.md").read_text("utf-8")
OF_SIMULATORS = [page.read_text("utf-8") for page in sorted((USAGE / "simulators").glob("*.md"))]
RESULT = from_csv((ROOT / "docs" / "bench" / "epyc.csv").read_bytes(), "epyc.csv")


def blocks(text):
    """Return the kind and the text of each block of code; one that is only indented has no kind."""
    found = re.findall(r"^```(\w+)\n(.*?)^```$|(?<=\n\n)((?: {4}[^\n]*\n)+)", text, re.MULTILINE | re.DOTALL)
    return [(kind, code or re.sub(r"^ {4}", "", indented, flags=re.MULTILINE)) for kind, code, indented in found]


def commands(text):
    """Return the commands of a page that are to be typed, without comments."""
    lines = [line.partition("  # ")[0].strip() for kind, code in blocks(text) if not kind for line in code.splitlines()]
    return [line for line in lines if line]


def output_of(words, directory):
    run = subprocess.run(words, cwd=directory, capture_output=True, text=True, timeout=HANGS)
    assert run.returncode == 0, run.stderr
    return run.stdout


def of_viscopade(line):
    run = called(*shlex.split(line.removeprefix("viscopade ")))
    assert run.returncode == 0, run.stderr
    return run.stdout


def test_a_header(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    ((_, line), (_, expected)) = next(pair for pair in pairwise(blocks(README)) if pair[0][1].startswith("viscopade "))
    of_viscopade(line.strip())
    assert expected in (tmp_path / line.split()[-1]).read_text("utf-8")


def test_a_program_in_c(tmp_path):
    if shutil.which("cc") is None:
        pytest.skip("no C compiler")
    shutil.copytree(ROOT / "examples", tmp_path / "examples")
    shutil.copytree(ROOT / "exports", tmp_path / "exports")
    line, printed = re.search(r"`(cc [^`]+)` prints `([^`]+)`", README).groups()
    assert output_of(["sh", "-c", line], tmp_path) == f"{printed}\n"


@pytest.mark.parametrize(
    "block", [code for page in PAGES + OF_SIMULATORS for kind, code in blocks(page) if kind == "console"]
)
def test_console_examples(block, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    first, _, expected = block.partition("\n")
    if "examples/" in first:
        shutil.copytree(ROOT / "examples", tmp_path / "examples")
    assert of_viscopade(first.removeprefix("$ ")) == expected


def test_python_examples(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    pairs = [pair for text in [*PAGES, READING] for pair in pairwise(blocks(text))]
    examples = [(code, out) for (kind, code), (_, out) in pairs if kind == "python"]
    assert len(examples) == 7
    for code, expected in examples:
        with redirect_stdout(io.StringIO()) as printed:
            exec(code, {"__name__": "__main__"})
        assert printed.getvalue() == expected


# --- the README, and the first page made from it ----------------------------------------------------------------------


def test_the_table_of_kernels_and_the_first_page_are_what_the_tool_makes():
    assert readme.readme() == README
    assert readme.index() == readme.INDEX.read_text("utf-8")
    assert readme.captions() == readme.FIGURES.read_text("utf-8")


@pytest.mark.parametrize("file", readme.ADDRESSES, ids=lambda file: file.name)
def test_the_address_is_that_of_the_project(file):
    assert readme.addressed(file) == file.read_text("utf-8")
    assert readme.PROJECT["urls"]["Repository"] in file.read_text("utf-8")


def test_the_table_has_an_error_in_double_and_in_float_on_its_device():
    rows = [line.split(" | ") for line in readme.table().splitlines()[2:]]
    ends = ["on a processor |", "on a GPU |", "none |", "none |", "none |", "on a processor |"]
    assert all(row[-1].endswith(end) for row, end in zip(rows, ends, strict=True))
    for _, file, _, _, *cells in rows:
        text = (ROOT / re.search(r"\((exports/.+?)\)", file)[1]).read_text("utf-8")
        for cell, epsilon in zip(cells, (2**-52, 2**-23), strict=True):
            if "ulp" in cell:
                assert f"{cell} " in text
            elif not cell.startswith("none"):
                parts = re.findall(r"(\d[\d.e-]*) min(?: \+ ([\d.e-]+) r)?(?: \+ ([\d.]+) ulp)?", text)
                sums = [float(m) + float(r or 0) + float(ulp or 0) * epsilon for m, r, ulp in parts]
                assert min(sums, key=lambda found: abs(found - float(cell.split()[0]))) == pytest.approx(
                    float(cell.split()[0]), rel=0.01
                )


def test_the_readme_s_verdicts_are_those_of_the_claims():
    numbers = re.search(
        r"paper's (\d+) statements, checked \| `viscopade claims`: (\d+) hold, (\d+) hold with a limit, (\d+) do not",
        README,
    )
    assert numbers.groups() == verdicts()


def test_no_word_of_ours_stands_on_the_first_pages():
    """Words that only we use, and idioms of another language."""
    text = README + readme.INDEX.read_text("utf-8") + (ROOT / "CONTRIBUTING.md").read_text("utf-8")
    assert re.findall(r"\b(?:doors?|wings?|faces?|delivers?|of the deck|but for|accepted is)\b", text) == []


def test_the_time_of_the_first_kernel_is_measured():
    (row,) = [row for row in picture.points(RESULT, "throughput") if row.id == "speed-1e-5"]
    assert f"takes {row.median_ns:.2g} ns per collision" in README


def comment(file):
    return re.sub(r"[\s*/]+", " ", (ROOT / "exports" / file).read_text("utf-8").partition("*/")[0])


# --- numbers on the pages ---------------------------------------------------------------------------------------------


def page(name):
    return (ROOT / "docs" / f"{name}.md").read_text("utf-8")


def test_the_restitutions_of_the_tsuji_damping():
    """Wanted eps, e to write, eps if e = eps is written, betan."""
    rows = re.findall(
        r"^\| (0\.\d+) \| (0\.\d+) \| (0\.\d+) \| (0\.\d+) \|$", page("usage/simulators/liggghts"), re.MULTILINE
    )
    assert len(rows) == 7
    for wanted, write, naive, betan in rows:
        ratio = ratio_at_force_end(mpf(wanted))
        assert write == f"{float(nu_2(ratio, 'return')):.6f}"
        assert naive == f"{float(nu_2(ratio_for_return(mpf(wanted)), 'force')):.6f}"
        assert betan == f"{float(ratio) * (5 / 6) ** 0.5:.6f}"


def test_ice_in_si_units():
    assert rf"${beta_si_from_cgs(1.307):.3f} (\mathrm{{s/m}})^{{1/5}}$" in page("usage/python")


def test_proven_errors_and_size_of_full_accuracy():
    found = page("reference/full-kernels")
    rows = re.findall(r"^\| `(\w+)` \| ([\d.]+) ulp", found, re.MULTILINE)
    stated = re.findall(r"viscopade_(\w+)_full\(v_star\) all v (0.5[\d.]+)", comment("viscopade_full.h"))  # rounded up
    assert [row[:1] for row in rows] == [row[:1] for row in stated]
    for (*_, bound), (*_, rounded) in zip(rows, stated, strict=True):
        assert float(bound) <= float(rounded) < float(bound) + 0.001
    (numbers,) = re.findall(r"(\d+) rows of (\d+) numbers", found)
    rows, width = map(int, numbers)
    assert catalogue.kernel("full").bytes == 8 * rows * width


def test_the_end_condition_changes_eps_by_more_than_the_error_of_an_approximant():
    """For the v* and the approximants that the sentence names; not for [0/3]."""
    (low, high, named) = re.search(
        r"for \$(\S+) \\le v_\\ast \\le (\S+)\$, by more than the error of (.*?)\.", README
    ).groups()
    assert named == "[1/4], [2/5] or [3/6]"
    without_delay = law_of("viscoelastic", "return")
    share = {degrees: [] for degrees in ((0, 3), (1, 4), (2, 5), (3, 6))}
    steps = 12
    for i in range(steps + 1):
        v_star = Fraction(low) + (Fraction(high) - Fraction(low)) * i / steps
        eps = exact.epsilon(v_star, 20)
        eps0 = exact.collision(kappa=v_star**2, digits=20, law=without_delay).mpf()["epsilon"]
        for (m, n), shares in share.items():
            shares.append(abs(pade(m, n)(float(v_star)) - eps) / abs(eps0 - eps))
    assert max(share[0, 3]) > 1 > max(share[1, 4] + share[2, 5] + share[3, 6])


def stated():
    """Return the proven errors of all kernels that stand ready, of the formula, and those in heads of headers."""
    bounds = [bound for entry in catalogue.CATALOGUE.values() for bound in entry.kernel.bounds]
    bounds += compact.half_line("1e-3").bounds + compact.half_line("1e-5").bounds + compact.half_line("1e-7").bounds
    of_tables = " ".join(comment(path.name) for path in ROOT.glob("exports/*.h"))
    return {at_most(bound.formula) for bound in bounds} | set(re.findall(r"\d\.\d\de-\d+", of_tables))


@pytest.mark.parametrize("name", ["reference/languages", "usage/which-kernel"])
def test_proven_errors_on_pages_are_those_of_the_files(name):
    numbers = set(re.findall(r"\d\.\d\de-\d+", page(name).partition("## On a GPU")[0]))  # there they are measured
    assert numbers
    assert numbers <= stated()


def test_proven_errors_of_the_half_line_are_those_of_the_header():
    rows = re.findall(r"^\| 1e-\d \| [^|]+ \| \d+ \| (\S+) \|$", page("reference/kernels"), re.MULTILINE)
    assert len(rows) == 3
    assert set(rows) <= stated()
