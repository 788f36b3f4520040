"""The page docs/results/audit.md: the eps that programs give, beside values measured in them.

Run as `python -m viscopade_lab.studies.audit > docs/results/audit.md`; with `--pages docs/usage/simulators` it writes
the tables of each program into its own page instead. The measured values are the package's
(`python -m viscopade_lab.runs.simulators`; Drake, Kratos and Simbody were run once); all others are computed.
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import click
from mpmath import mp

from viscopade.collision.contact import SampledCollision
from viscopade.collision.schemes import IMPLICIT, RUNGE_KUTTA, SEMI_IMPLICIT, Scheme
from viscopade.collision.weight import COUNTS, loaded, loss_slope
from viscopade.simulators import simulator_of, simulators
from viscopade.simulators.audit import ASKED, Audit, advised, audited
from viscopade.simulators.formula import DampingFormula, stepped_collision, wanted_kappa
from viscopade.simulators.measured import Measurement, finest, measurements
from viscopade.simulators.simulator import Simulator
from viscopade.theory.law import Law, law_of
from viscopade_lab.runs import cases
from viscopade_lab.studies.laws import markdown

CHOSEN = "0.5"
STEP = 0.02
ERROR = 0.01
LAWS = ("viscoelastic", "tsuji", "linear", "hunt-crossley:1")
OTHER_SCHEMES = (
    ("linear", "linear, Runge-Kutta (MuJoCo's RK4)", RUNGE_KUTTA),
    ("linear", "linear, implicit (Drake's sap)", IMPLICIT),
    ("hunt-crossley:1", "hunt-crossley:1, implicit (Drake's lagged)", IMPLICIT),
)
COARSE = 10  # steps in a contact
ENDS = {"force": "force = 0", "return": "$x = 0$"}

HEAD = r"""# The $\varepsilon$ that programs give

You ask a program for $\varepsilon = 0.5$, and its bodies rebound with 0.55 or 0.62. The command
`viscopade audit lammps --epsilon 0.5` prints the $\varepsilon$ that LAMMPS gives, the reason, and the value to set
instead. Give `--time-step` to include the program's integrator. With `--step-error 0.01` the command prints the
largest time step whose error is 1 %.

| reason | meaning |
| --- | --- |
| other end | The formula assumes that contact ends at $x = 0$, but the program ends it at force 0, or the reverse. |
| other law | The formula assumes a different contact law. |
| normalisation | The formula assumes a different mass, radius or stiffness. |
| approximate formula | The formula is an approximation. |
| time step | Forces are computed at discrete times, often with a velocity half a step old ([below](#time-steps)). |
| weight | Weight presses a falling body down during contact, so the body loses more energy ([below](#weight)). |

`python -m viscopade_lab.studies.audit` writes this page. Values without a time step are proven (see
[any power-law contact](laws.md)). Values with a time step come from the program's own update rule
([`viscopade.collision.schemes`](../../src/viscopade/collision/schemes.py)).

![eps that programs give over the eps asked for, and eps over the time step, with measured values](../figures/audit.svg)
"""

SUMMARY_TEXT = r"""
## Asked for {chosen}

The table is for fine time steps and without weight. The last column compares predictions with runs of the program: it
is the largest difference over {runs} collisions, with $\varepsilon$ = {asked} asked for and time steps from {least} to
{largest} contact times. An empty cell means that we read the program's source, but did not run it. Each program's page
has the results for $\varepsilon$ from 0.1 to 0.9. The
[damping formulas of the literature](laws.md#damping-formulas-in-wide-use) have a table of their own.
"""

INSTEAD_TEXT = rf"""
## Measured with the corrected value

These programs were asked for the corrected value, which also compensates for the time step $t$ (in contact times). The
mean over the phase (the place in a step where contact begins) should then be {cases.WANTED}. The last column shows the
scatter of single collisions.
"""

STEPS_TEXT = r"""
## Time steps

The error of $\varepsilon$ is of first order in the step: $\varepsilon(t) \approx \varepsilon + s t$ on average, with
the step $t$ in units of the contact time without damping. The phase is random, so $\varepsilon$ scatters around this
mean. The table is for {chosen}; with the number of steps in the last column every $\varepsilon$ is within {error}.

LAMMPS, LIGGGHTS, MercuryDPM and YADE compute the damping with the velocity between two steps. Their velocity Verlet
and leapfrog then equal the semi-implicit Euler method,

$$x_{{n+1}} = x_n + h u_n, \qquad u_{{n+1}} = u_n - h F(x_{{n+1}}, u_n).$$

MuJoCo (Euler, implicit and implicitfast), Chrono, Kratos and JaxDEM use the same method. The last rows of the table
are for two other methods. Drake's discrete contacts use the force at the end of the step: implicit Euler, which adds
numerical damping. MuJoCo's RK4 has no first-order error, but $\varepsilon$ scatters.
"""

AFTER_STEPS = r"""
- **Hunt-Crossley contacts have no first-order error.** The lag multiplies the whole force by a function of $x$. If
  $a = b$, $\varepsilon$ does not depend on the shape of the spring, so this function changes nothing.
- **A linear dashpot scatters most.** Its damping force jumps at first contact, so the phase changes $\varepsilon$ as
  much as the first-order error does.
- **Implicit steps add damping.** With ten steps in a contact and no dissipation Drake gives $\varepsilon$ = {highest}
  on average.
- `viscopade audit lammps --epsilon 0.5 --time-step 0.02` prints the value that compensates for the step.
"""
SOURCES = "## Versions and files\n"

WEIGHT = r"""## Weight

Weight presses a body that falls on a plane down during contact:
$m \ddot{{\xi}} + k \xi^a + c \xi^b \dot{{\xi}} = m g$. Without damping this changes nothing. With damping, the
contact is deeper and longer, so the body loses more energy. For small losses $1 - \varepsilon$ grows by the factor
$1 + s g t_c/v$ ([derivation](../../derivations/16_load.py)), with the duration $t_c$ of the undamped contact and the
impact speed $v$. So weight matters for long (soft) contacts and slow bodies. Below the sticking speed a body does not
leave the plane again: $\varepsilon = 0$.

![eps of a falling body over its weight, for four laws and both ends of contact](../figures/weight.svg)

*Solid: contact ends where the force vanishes; dashed: at $x = 0$; dash-dotted: the factor above, for viscoelastic
spheres.*

The table is for contacts that have {chosen} without weight. The numbers are sampled
([`viscopade.collision.contact`](../../src/viscopade/collision/contact.py)).
"""

AFTER_WEIGHT = r"""
- `viscopade epsilon` and `invert` take `--gravity` or `--load`. `viscopade table` and `plot` take `--gravity`.
  `viscopade simulators --gravity` writes the damping that compensates for the weight.
- Without it `viscopade simulators` and `viscopade scene` state $g t_c/v$ in their files. From {counts:g} on they warn,
  and print the $\varepsilon$ and the sticking speed of a falling body.
- MuJoCo's contacts carry a part of the weight without a penetration (0.9 of it with the `solimp` that we write). A
  ball rebounds with 0.448 of 1 m/s from a contact of 31 ms. With a spring and a dashpot it would be 0.399.
- Weight does not matter for two bodies that both fall. The direction of impact is normal to the plane.
"""
SHARES = (0.02, 0.1, 0.3)  # g t_c/v

BEGIN, END = "<!-- audit -->", "<!-- end of the audit -->"
SECTION = r"""
![eps against speed of contacts that are made for 0.5 at 1 m/s](../../figures/eps-over-speed.svg)

The $\varepsilon$ that the program gives, by its own formulas and with fine time steps
([reasons and other programs](../../results/audit.md)):
"""
SECTION_MEASURED = f"""Asked for {CHOSEN}: the eps you get, the reason, and the value to set instead. *Measured* is
with a time step of $t$ contact times, *predicted* for the same step. The last column is the largest difference over
all collisions that were run. (`python -m viscopade_lab.studies.audit --pages docs/usage/simulators` writes the tables.)
"""


def delivered_table(program: Simulator) -> str:
    """Return the table of the eps that a program gives: one row a formula, one column an eps asked for."""
    rows = ([formula.name, ENDS[formula.law.end], *_delivered(program, formula)] for formula in program.formulas)
    return markdown(["formula", "contact ends at", *(f"asked {asked}" for asked in ASKED)], rows)


def _delivered(program: Simulator, formula: DampingFormula) -> Iterator[str]:
    for asked in ASKED:
        try:
            yield number(audited(program, formula, asked))
        except ValueError:
            yield "not accepted"


def number(found: Audit) -> str:
    """Return the eps that the program gives as text."""
    return "never parts" if found.delivered is None else f"{float(found.delivered):.4f}"


def measured_table(program: Simulator) -> str:
    """Return the table for `CHOSEN`: the eps you get, the reason, the value to set, measured and predicted."""
    head = ["formula", "you get", "reason", "set instead", "measured", "at $t$", "predicted", "largest difference"]
    return markdown(head, (_measured(program, formula) for formula in program.formulas))


def _measured(program: Simulator, formula: DampingFormula) -> list[str]:
    advice, run = _advice(program, formula), finest(program.name, formula.name, CHOSEN)
    if run is None:
        return [formula.name, *advice, "from the source", "", "", ""]
    step = f"{run.time_step:g}"
    return [formula.name, *advice, f"{run.epsilon:.6f}", step, f"{run.predicted:.6f}", _difference(run)]


def _advice(program: Simulator, formula: DampingFormula) -> list[str]:
    """Return the eps that the program gives for `CHOSEN`, the reason, and the value to set instead."""
    found = audited(program, formula, CHOSEN)
    instead = "" if found.instead is None else f"`{formula.parameter}` = {found.instead:.6g}"
    return [number(found), *(["", ""] if formula.reason == "exact" else [formula.reason, instead])]


def _difference(run: Measurement) -> str:
    """Return the largest difference of measured and predicted values of a formula."""
    return f"{max(abs(each.epsilon - each.predicted) for each in measurements() if _is_of(each, run)):.0e}"


def _is_of(one: Measurement, other: Measurement) -> bool:
    return (one.program, one.formula) == (other.program, other.formula)


SUMMARY = ["program", "formula", "contact ends at", "you get", "reason", "set instead", "largest difference"]


def summary(program: Simulator) -> Iterator[list[str]]:
    """Yield the rows of a program in the common table for `CHOSEN`."""
    page = f"../usage/simulators/{program.name}.md"
    for formula in program.formulas:
        run = finest(program.name, formula.name, CHOSEN)
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
    groups: dict[tuple[str, float], dict[tuple[str, str], list[float]]] = {}
    for each in measurements():
        if each.asked not in cases.ASKED:
            formulas = groups.setdefault((each.program, each.time_step), {})
            formulas.setdefault((each.formula, each.asked), []).append(each.epsilon)
    head = ["program", "$t$", "formulas", "collisions", "mean", "single collisions"]
    return markdown(head, (_instead(*key, list(found.values())) for key, found in groups.items()))


def _instead(name: str, step: float, found: list[list[float]]) -> list[str]:
    every = [value for each in found for value in each]
    means = [sum(each) / len(each) for each in found]
    return [simulator_of(name).title, f"{step:g}", str(len(found)), str(len(every)), _range(means), _range(every)]


def _range(values: list[float]) -> str:
    least, largest = f"{min(values):.4f}", f"{max(values):.4f}"
    return least if least == largest else f"{least} to {largest}"


def steps_table() -> str:
    """Return the table of laws: slope, range at `STEP`, and the number of steps for `ERROR`."""
    head = ["law", "contact ends at", "$s$", f"mean at $t = {STEP}$", "least", "largest", "steps for 1 %"]
    rows = [_steps(law, name, name) for name in LAWS for law in _with_ends(name)]
    others = (_steps(law_of(name), name, words, scheme) for name, words, scheme in OTHER_SCHEMES)
    return markdown(head, [*rows, *others])


def highest_epsilon() -> float:
    """Return the mean eps that implicit steps, `COARSE` in a contact, leave of an undamped contact."""
    return stepped_collision(law_of("hunt-crossley:1"), 0.0, 1 / COARSE, IMPLICIT).epsilon


def _with_ends(name: str) -> list[Law]:
    """Return a law with the ends that differ for it."""
    law = law_of(name)
    return [law, law_of(name, "return")] if law.delayed else [law]


def _steps(law: Law, name: str, words: str, scheme: Scheme = SEMI_IMPLICIT) -> list[str]:
    kappa, wanted = float(wanted_kappa(law, CHOSEN)), float(CHOSEN)
    found = stepped_collision(law, kappa, STEP, scheme)
    formula = DampingFormula(name, law, "kappa", mp.mpf, ("0", "1e6"), "exact", "", scheme=scheme)
    advice = advised(formula, kappa, wanted, ERROR)
    assert advice is not None
    contact_ends = ENDS[law.end] if law.nu > 1 else "both"
    values = (f"{value:.4f}" for value in (found.epsilon, found.least, found.largest))
    return [words, contact_ends, f"{advice.slope:.3f}", *values, f"{1 / advice.largest_step:.0f}"]


def weight_table() -> str:
    """Return the table of weight: s of the factor, eps at `SHARES`, and g t_c/v from which on bodies stay down."""
    head = ["law", "contact ends at", "$s$", *(f"$g t_c/v = {share:g}$" for share in SHARES), "stays down from"]
    return markdown(head, (_weight(law, name) for name in LAWS for law in _with_ends(name)))


def _weight(law: Law, words: str) -> list[str]:
    kappa = float(wanted_kappa(law, CHOSEN))

    def fall(share: float) -> SampledCollision:
        return loaded(law, kappa, share / law.contact_time).collide()

    parts, stays = 0.0, 10.0
    while stays - parts > 1e-4:
        between = (parts + stays) / 2
        parts, stays = (between, stays) if fall(between).parts else (parts, between)
    contact_ends = ENDS[law.end] if law.nu > 1 else "both"
    values = (f"{fall(share).epsilon:.4f}" for share in SHARES)
    return [words, contact_ends, f"{loss_slope(law):.3f}", *values, f"{stays:.3f}"]


def sources_table() -> str:
    """Return the table of files and versions."""
    rows = (
        [program.title, program.version, ", ".join(dict.fromkeys(f"`{f.source}`" for f in program.formulas))]
        for program in simulators()
        if program.name != "textbook"
    )
    return markdown(["program", "version read", "files"], rows)


def notes(program: Simulator) -> Iterator[str]:
    """Yield a line for each note of a formula."""
    yield from (f"- *{formula.name}*: {formula.note}" for formula in program.formulas if formula.note)


def runs_table() -> str:
    """Return the table of versions that were run."""
    versions = dict.fromkeys((each.program, each.version) for each in measurements())
    counts = [sum(each.program == name for each in measurements()) for name, _ in versions]
    rows = ([simulator_of(name).title, version, str(n)] for (name, version), n in zip(versions, counts, strict=True))
    return markdown(["program", "version run", "collisions"], rows)


def parts() -> Iterator[str]:
    """Yield the page, part by part."""
    yield HEAD.rstrip()
    found = measurements()
    asked = ", ".join(cases.ASKED)
    least, largest = (f"{bound(each.time_step for each in found):g}" for bound in (min, max))
    yield SUMMARY_TEXT.format(
        chosen=rf"$\varepsilon = {CHOSEN}$", runs=len(found), asked=asked, least=least, largest=largest
    )
    yield markdown(SUMMARY, (row for program in simulators() if program.name != "textbook" for row in summary(program)))
    yield f"{INSTEAD_TEXT}\n{instead_table()}"
    yield STEPS_TEXT.format(chosen=rf"$\varepsilon = {CHOSEN}$", error="1 %")
    yield steps_table()
    yield AFTER_STEPS.format(highest=f"{highest_epsilon():.2f}")
    yield WEIGHT.format(chosen=rf"$\varepsilon = {CHOSEN}$")
    yield weight_table()
    yield AFTER_WEIGHT.format(counts=COUNTS)
    yield SOURCES
    yield f"{sources_table()}\n\n{runs_table()}"


def section(program: Simulator) -> str:
    """Return the rows of a program for its own page, between its two marks."""
    lines = "\n".join(notes(program))
    return (
        f"{BEGIN}\n{SECTION}\n{delivered_table(program)}\n\n{SECTION_MEASURED}\n{measured_table(program)}\n"
        + (f"\n{lines}\n" if lines else "")
        + END
    )


def with_section(page: str, program: Simulator) -> str:
    """Return a page with the program's rows between its marks."""
    before, _, rest = page.partition(BEGIN)
    return before + section(program) + rest.partition(END)[2]


@click.command()
@click.option("--pages", type=click.Path(path_type=Path, file_okay=False, exists=True), help="Folder of the pages.")
def main(pages: Path | None) -> None:
    """Print the page in Markdown, or write the programs' rows into their own pages."""
    if pages is None:
        click.echo("\n".join(parts()))
        return
    for program in (program for program in simulators() if program.name != "textbook"):
        page = pages / f"{program.name}.md"
        page.write_text(with_section(page.read_text("utf-8"), program), "utf-8")


if __name__ == "__main__":
    main()
