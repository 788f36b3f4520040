"""CITATION.cff and the paper about the software: valid, of this version, each number that of the command beside it."""

import json
import re
import shutil
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest
from mpmath import mp

from tests.patience import HANGS
from viscopade.arithmetic.decimals import at_most
from viscopade.generated import __version__
from viscopade.kernels.quotient import best_fit
from viscopade.simulators import SIMULATORS
from viscopade.theory.pade import pade
from viscopade.theory.series import series
from viscopade_lab import convergence, singularity
from viscopade_lab.bench import picture
from viscopade_lab.bench.result import from_csv

ROOT = Path(__file__).parents[1]
CITATION = (ROOT / "CITATION.cff").read_text("utf-8")
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["project"]
_, FRONT, BODY = (ROOT / "paper" / "paper.md").read_text("utf-8").split("---\n", 2)
PARAGRAPHS = [" ".join(text.split()) for text in BODY.split("\n\n")]
BIBLIOGRAPHY = (ROOT / "paper" / "paper.bib").read_text("utf-8")


# --- CITATION.cff -----------------------------------------------------------------------------------------------------


def test_the_citation_is_of_this_version():
    fields = dict(re.findall(r"^([\w-]+): (.+)$", CITATION, re.MULTILINE))
    assert fields["version"] == __version__
    assert fields["license"] == PROJECT["license"]
    assert fields["type"] == "software"
    page = (ROOT / "docs" / "usage" / "citing.md").read_text("utf-8")
    assert f"version = {{{__version__}}}" in page
    assert f"year    = {{{fields['date-released'][1:5]}}}" in page
    for line in page.splitlines():
        if "doi" in line:
            assert line.strip() in BIBLIOGRAPHY
    assert re.findall(r"^  - name: (.*)$", CITATION, re.MULTILINE) == [a["name"] for a in PROJECT["authors"]]


def test_the_citation_is_valid():
    program = shutil.which("cffconvert")
    if program is None:
        pytest.skip("cffconvert is not installed: pip install cffconvert")
    run = subprocess.run([program, "--validate"], cwd=ROOT, capture_output=True, text=True, timeout=HANGS)
    assert run.returncode == 0, run.stderr


# --- the numbers of the paper -----------------------------------------------------------------------------------------


def from_mujoco():
    words = [sys.executable, "-m", "viscopade", "audit", "mujoco", "--epsilon", "0.5", "--format", "json"]
    rows = json.loads(subprocess.run(words, capture_output=True, text=True, check=True, timeout=HANGS).stdout)["rows"]
    (delivered,) = {row["delivered"] for row in rows}
    return "0.5", f"{float(delivered):.3f}"


def audited_programs():
    return (str(len({*SIMULATORS} - {"textbook"})),)


def radius():
    return (mp.nstr(singularity.from_flow().radius, 4),)


def errors_of_3_6():
    return header("pade", r"epsilon_pade_3_6\(v_star\) +v\* <= 5 +(\S+) m"), at_most(
        best_fit(3, 6, "5").bounds[0].formula
    )


def verdicts():
    """As docs/results/paper.md has them, which `tests/lab/test_claims.py` compares with the command."""
    page = " ".join((ROOT / "docs" / "results" / "paper.md").read_text("utf-8").split())
    counts = r"(\d+) statements, of which (\d+) hold, (\d+) hold with a limit, and (\d+) do not"
    return re.search(counts, page).groups()


def speed_kernel():
    """The first kernel's bound, and the times of it and of [3/6], for independent and for dependent calls."""
    content = (ROOT / "docs" / "bench" / "epyc.csv").read_bytes()
    throughput, latency = (
        {row.id: row.median_ns for row in picture.points(from_csv(content, ""), measure)}
        for measure in ("throughput", "latency")
    )
    return (
        header("speed_1em5", r"restitution_1em5[^\n]*? (\S+) m"),
        f"{throughput['speed-1e-5']:.1f}",
        f"{latency['speed-1e-5']:.1f}",
        f"{throughput['pow+[3/6]']:.0f}",
        f"{latency['pow+[3/6]']:.0f}",
    )


def header(name, pattern):
    return re.search(pattern, (ROOT / "exports" / f"viscopade_{name}.h").read_text("utf-8"))[1]


def last_places():
    return (header("full", r"epsilon_full[^\n]*? (\S+) ulp"),)


def zero_of_2_5():
    (zero,) = [root.value.real for root in pade(2, 5).zeros if root.value.real > 0]
    return (f"{float(zero):.2f}",)


def first_coefficient():
    return (series(2, 15).decimals()[2],)


def proven_radius():
    return (str(float(convergence.RADIUS)),)


STATED = [
    (r"formula for (\S+), MuJoCo \S+ gives (\S+)\. <", from_mujoco),
    (r"`viscopade audit` knows (\d+) programs", audited_programs),
    (r"converge beyond \$v_\\ast = (\S+)\$", radius),
    (r"error of \$\[3/6\]\$ reaches (\S+), measured .*? has an error of (\S+)\. <", errors_of_3_6),
    (r"Of (\d+) statements of \S+ (\d+) hold, (\d+) hold with a limit and (\d+) do not", verdicts),
    (r"proven error of (\S+), in (\S+) ns .*? and in (\S+) ns if .*? takes (\d+) ns and (\d+) ns", speed_kernel),
    (r"at most (\S+) units in the last place\. <", last_places),
    (r"h_2 = (\S+)\$", first_coefficient),
    (r"is zero at \$v_\\ast = (\S+)\$", zero_of_2_5),
    (r"proven for \$v_\\ast \\le (\S+)\$", proven_radius),
]


@pytest.mark.parametrize(("pattern", "compute"), STATED, ids=[compute.__name__ for _, compute in STATED])
def test_a_number_is_that_of_its_command(pattern, compute):
    ((paragraph, found),) = [(text, found) for text in PARAGRAPHS if (found := re.search(pattern, text))]
    assert found.groups() == compute()
    assert "<!-- " in paragraph[found.end() - 1 :]  # the command stands behind the numbers


def test_no_other_number_is_stated():
    for text in PARAGRAPHS:
        for pattern, _ in STATED:
            text = re.sub(pattern, lambda found: re.sub(r"\d+", "", found[0]), text)
        text = re.sub(r"<!--.*?-->|\$[^$]*\$|@\w+", "", text)
        assert re.findall(r"\d+", text) == []


def test_every_paper_cited_is_listed_and_every_one_listed_is_cited():
    assert set(re.findall(r"@([A-Z]\w+)", BODY)) == set(re.findall(r"^@\w+\{(\w+),$", BIBLIOGRAPHY, re.MULTILINE))
    assert "bibliography: paper.bib" in FRONT


# --- make paper -------------------------------------------------------------------------------------------------------


def make(target):
    words = ["make", "paper", f"PAPER={target}"]
    return subprocess.run(words, cwd=ROOT, capture_output=True, text=True, timeout=HANGS)


def test_the_paper_is_a_pdf(tmp_path):
    fonts = ["kpsewhich", "lmodern.sty"]
    if (
        not all(map(shutil.which, ("pandoc", "pdflatex", "rsvg-convert", fonts[0])))
        or subprocess.run(fonts, stdout=subprocess.DEVNULL).returncode
    ):
        pytest.skip("a program is missing: apt install pandoc texlive-latex-recommended lmodern librsvg2-bin")
    run = make(tmp_path / "paper.pdf")
    assert run.returncode == 0, run.stderr
    assert (tmp_path / "paper.pdf").read_bytes().startswith(b"%PDF")
    assert "WARNING" not in run.stderr  # of citations that are not found
