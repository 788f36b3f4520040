"""Tables of docs/results/audit.md and of the programs' pages: the eps that programs give, beside measured values.

`python -m viscopade_lab.studies.audit` writes each table between its marks in these pages. The measured values are the
lab's (`python -m viscopade_lab.runs.simulators`; Drake, Kratos and Simbody were run once); all others are computed.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from pathlib import Path

import click
from mpmath import mp

from viscopade.collision.contact import SampledCollision
from viscopade.collision.schemes import IMPLICIT, RUNGE_KUTTA, SEMI_IMPLICIT, Scheme
from viscopade.collision.weight import loaded, loss_slope
from viscopade.simulators import simulator_of, simulators
from viscopade.simulators.audit import ASKED, Audit, audit_formula, step_advice
from viscopade.simulators.formula import DampingFormula, kappa_for_epsilon, stepped_collision
from viscopade.simulators.simulator import Simulator
from viscopade.theory.law import Law, law_of
from viscopade_lab.runs.simulators import REQUESTED, WANTED, Measurement, finest, measurements
from viscopade_lab.studies.laws import markdown

STEP = 0.02  # time step of the table of time steps, in contact times: 50 steps in a contact, a common choice
ERROR = 0.01  # of eps, relative: how many steps keep it is a column of that table
LAWS = ("viscoelastic", "tsuji", "linear", "hunt-crossley:1")
OTHER_SCHEMES = (
    ("linear", "linear, Runge-Kutta (MuJoCo's RK4)", RUNGE_KUTTA),
    ("linear", "linear, implicit (Drake's sap)", IMPLICIT),
    ("hunt-crossley:1", "hunt-crossley:1, implicit (Drake's lagged)", IMPLICIT),
)
COARSE = 10  # steps in a contact: few, where implicit steps damp much by themselves
ENDS = {"force": "force = 0", "return": "$x = 0$"}

SHARES = (0.02, 0.1, 0.3)  # g t_c/v: a weight that hardly shows, one that shows, one that keeps some bodies down


def delivered_table(program: Simulator) -> str:
    """Return the table of the eps that a program gives: one row a formula, one column an eps asked for.

    The last column is the value to set for `WANTED`.
    """

    def delivered(formula: DampingFormula) -> Iterator[str]:
        """Yield the eps for each one of `ASKED`; a formula may refuse some."""
        for asked in ASKED:
            try:
                yield number(audit_formula(program, formula, asked))
            except ValueError:
                yield "not accepted"

    rows = (
        [formula.name, ENDS[formula.law.end], *delivered(formula), _advice(program, formula)[2]]
        for formula in program.formulas
    )
    head = ["formula", "contact ends at", *(f"asked {asked}" for asked in ASKED), f"for {WANTED} set instead"]
    return markdown(head, rows)


def number(audit: Audit) -> str:
    """Return the eps that a program gives as text of four decimals; None means that the bodies stay together."""
    return "never parts" if audit.delivered is None else f"{float(audit.delivered):.4f}"


def _advice(program: Simulator, formula: DampingFormula) -> list[str]:
    """Return the eps that the program gives for `WANTED`, the reason, and the value to set instead."""
    audit = audit_formula(program, formula, WANTED)
    instead = "" if audit.instead is None else f"`{formula.parameter}` = {audit.instead:.6g}"
    return [number(audit), *(["", ""] if formula.reason == "exact" else [formula.reason, instead])]


def _difference(run: Measurement) -> str:
    """Return the largest |measured - predicted| of all runs of the same program and formula as `run`, as text."""
    same = (m for m in measurements() if (m.program, m.formula) == (run.program, run.formula))
    return f"{max(abs(m.epsilon - m.predicted) for m in same):.0e}"


SUMMARY = ["program", "formula", "contact ends at", "you get", "reason", "set instead", "largest difference"]


def summary(program: Simulator) -> Iterator[list[str]]:
    """Yield the rows of a program in the common table for `WANTED`, in the columns `SUMMARY`: one row a formula."""
    page = f"../usage/simulators/{program.page}.md"
    for formula in program.formulas:
        run = finest(program.name, formula.name, WANTED)
        difference = "" if run is None else _difference(run)
        yield [
            f"[{program.title}]({page})",
            formula.name,
            ENDS[formula.law.end],
            *_advice(program, formula),
            difference,
        ]


def instead_table() -> str:
    """Return the table of the eps measured when programs were asked for the value that gives `WANTED`."""
    # (program, time step) -> (formula, asked eps) -> eps of each phase. An asked eps that is not among the requested
    # ones is a value that was set instead.
    groups: dict[tuple[str, float], dict[tuple[str, str], list[float]]] = {}
    for run in measurements():
        if run.asked not in REQUESTED:
            formulas = groups.setdefault((run.program, run.time_step), {})
            formulas.setdefault((run.formula, run.asked), []).append(run.epsilon)

    rows = []
    for (name, step), formulas in groups.items():
        epsilons = [epsilon for phases in formulas.values() for epsilon in phases]
        means = [sum(phases) / len(phases) for phases in formulas.values()]
        counts = str(len(formulas)), str(len(epsilons))
        rows.append([simulator_of(name).title, f"{step:g}", *counts, _range(means), _range(epsilons)])
    head = ["program", "$t$", "formulas", "collisions", "mean", "single collisions"]
    return markdown(head, rows)


def _range(values: list[float]) -> str:
    """Return "least to largest" of values, with four decimals; one number if both are the same."""
    least, largest = f"{min(values):.4f}", f"{max(values):.4f}"
    return least if least == largest else f"{least} to {largest}"


def steps_table() -> str:
    """Return the table of laws: slope, range at `STEP`, and the number of steps for `ERROR`."""
    head = ["law", "contact ends at", "$s$", f"mean at $t = {STEP}$", "least", "largest", "steps for 1 %"]
    rows = [_steps(law, name, name) for name in LAWS for law in _with_ends(name)]
    others = (_steps(law_of(name), name, words, scheme) for name, words, scheme in OTHER_SCHEMES)
    return markdown(head, [*rows, *others])


def highest_epsilon() -> float:
    """Return the mean eps that implicit steps, `COARSE` in a contact, leave of an undamped contact, kappa = 0."""
    return stepped_collision(law_of("hunt-crossley:1"), 0.0, 1 / COARSE, IMPLICIT).epsilon


def _with_ends(name: str) -> list[Law]:
    """Return a law with the end "force", and with the end x = 0 if that differs (delayed recovery, nu > 1)."""
    law = law_of(name)
    return [law, law_of(name, "return")] if law.delayed else [law]


def _steps(law: Law, name: str, words: str, scheme: Scheme = SEMI_IMPLICIT) -> list[str]:
    """Return the row of a law in the table of time steps; `words` describe it there.

    Its damping gives `WANTED` in continuous time.
    """
    kappa, epsilon = float(kappa_for_epsilon(law, WANTED)), float(WANTED)
    stepped = stepped_collision(law, kappa, STEP, scheme)
    # A formula whose parameter is kappa itself, from 0 to more than anybody uses: for it `advised` returns the slope of
    # eps over the step, s, and the largest step that keeps `ERROR`.
    formula = DampingFormula(name, law, "kappa", mp.mpf, ("0", "1e6"), "exact", "", scheme=scheme)
    advice = step_advice(formula, kappa, epsilon, ERROR)
    assert advice is not None
    contact_ends = ENDS[law.end] if law.nu > 1 else "both"
    values = (f"{value:.4f}" for value in (stepped.epsilon, stepped.least, stepped.largest))
    return [words, contact_ends, f"{advice.slope:.3f}", *values, f"{1 / advice.largest_step:.0f}"]


def weight_table() -> str:
    """Return the table of weight: s of the factor, eps at `SHARES`, and g t_c/v from which on bodies stay down."""
    head = ["law", "contact ends at", "$s$", *(f"$g t_c/v = {share:g}$" for share in SHARES), "stays down from"]
    return markdown(head, (_weight(law, name) for name in LAWS for law in _with_ends(name)))


def _weight(law: Law, words: str) -> list[str]:
    """Return the row of a law in the table of weight, under the name `words`; without weight eps is `WANTED`."""
    kappa = float(kappa_for_epsilon(law, WANTED))

    def fall(share: float) -> SampledCollision:
        """Return the collision with g t_c/v = share; scaled, v = 1 and g = share/t_c."""
        return loaded(law, kappa, share / law.contact_time).collide()

    # The weight from which on bodies stay down, by bisection: none of these laws parts with g t_c/v = 10. 1e-4 is below
    # the three decimals shown.
    low, high = 0.0, 10.0
    while high - low > 1e-4:
        middle = (low + high) / 2
        low, high = (middle, high) if fall(middle).parts else (low, middle)
    contact_ends = ENDS[law.end] if law.nu > 1 else "both"
    values = (f"{fall(share).epsilon:.4f}" for share in SHARES)
    return [words, contact_ends, f"{loss_slope(law):.3f}", *values, f"{high:.3f}"]


def sources_table() -> str:
    """Return the table of the programs' versions that were read, and of the files that formulas come from."""
    rows = (
        [program.title, program.version, ", ".join(dict.fromkeys(f"`{f.source}`" for f in program.formulas))]
        for program in simulators()
        if program.name != "textbook"  # formulas of the literature: no program
    )
    return markdown(["program", "version read", "files"], rows)


def runs_table() -> str:
    """Return the table of versions that were run."""
    versions = dict.fromkeys((run.program, run.version) for run in measurements())
    counts = [sum(run.program == name for run in measurements()) for name, _ in versions]
    rows = ([simulator_of(name).title, version, str(n)] for (name, version), n in zip(versions, counts, strict=True))
    return markdown(["program", "version run", "collisions"], rows)


def range_of_runs() -> str:
    """Return the sentence on the collisions that were run."""
    runs = measurements()
    least, largest = (f"{bound(run.time_step for run in runs):g}" for bound in (min, max))
    asked = f"$\\varepsilon$ = {', '.join(REQUESTED)} asked for, or the value to set instead"
    return f"{len(runs)} collisions were run, with {asked}, and time steps from {least} to {largest} contact times."


def blocks() -> dict[str, str]:
    """Return the tables of the common page by the names of their marks."""
    programs = [program for program in simulators() if program.name != "textbook"]
    return {
        "range of runs": range_of_runs(),
        "summary": markdown(SUMMARY, (row for program in programs for row in summary(program))),
        "corrected": instead_table(),
        "time steps": steps_table(),
        "coarse steps": f"Drake's lagged contacts give $\\varepsilon$ = {highest_epsilon():.2f} on average.",
        "weight": weight_table(),
        "sources": sources_table(),
        "runs": runs_table(),
    }


def blocks_of(program: Simulator) -> dict[str, str]:
    """Return the table of a program's own page, with a line for each note of a formula."""
    notes = [f"- *{formula.name}*: {formula.note}" for formula in program.formulas if formula.note]
    return {"delivered": "\n".join([delivered_table(program), *([""] if notes else []), *notes])}


def filled(page: str, texts: Mapping[str, str]) -> str:
    """Return a page with a text between each pair of marks, `<!-- NAME -->` and `<!-- end of NAME -->`.

    Raises
    ------
    ValueError
        If the page lacks a mark.
    """
    for name, text in texts.items():
        # All between the marks is replaced; the marks stay.
        begin, end = f"<!-- {name} -->\n", f"<!-- end of {name} -->"
        if begin not in page or end not in page:
            raise ValueError(f"the page lacks a mark: expected {begin.strip()} and {end}")
        before, _, rest = page.partition(begin)
        page = f"{before}{begin}{text}\n{end}{rest.partition(end)[2]}"
    return page


@click.command()
@click.option("--docs", type=click.Path(path_type=Path, file_okay=False, exists=True), default=Path("docs"))
def main(docs: Path) -> None:
    """Write the tables into docs/results/audit.md and the pages of the programs."""
    pages = {docs / "results" / "audit.md": blocks()}
    programs = (program for program in simulators() if program.page == program.name)
    pages |= {docs / "usage" / "simulators" / f"{program.name}.md": blocks_of(program) for program in programs}
    for path, texts in pages.items():
        path.write_text(filled(path.read_text("utf-8"), texts), "utf-8")


if __name__ == "__main__":
    main()
