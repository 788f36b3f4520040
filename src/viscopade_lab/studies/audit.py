"""The page docs/results/audit.md: the eps that programs deliver, beside what was measured in them.

Run as `python -m viscopade_lab.studies.audit > docs/results/audit.md`; with `--pages docs/usage/simulators` it writes
the rows of each program into its own page instead. The measured values are the package's
(`python -m viscopade_lab.runs.simulators`, and version 1.0.0 for Drake, Kratos and Simbody); all others are computed.
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

HEAD = r"""# The $\varepsilon$ you asked for: what programs deliver

You ask a program for $\varepsilon = 0.5$, and its bodies rebound with 0.55 or 0.62. There are six reasons:

- **other end.** The formula is made for contact that ends at $x = 0$, but the program ends it where the force
  vanishes, or the reverse;
- **other law.** The formula is made for another law of contact;
- **normalisation.** The formula is made for another mass, radius or stiffness than the contact has;
- **time step.** The program computes forces at single moments, most programs with a velocity that is half a step old;
- **approximate formula.** The formula is an approximation;
- **weight.** A body that falls is pressed down while it is in contact, and loses more. A MuJoCo contact tuned to 0.5,
  which lasts 31 ms, delivers 0.45 to a ball that falls with 1 m/s ([below](#weight)). All other numbers of this page
  are without weight.

`viscopade audit lammps --epsilon 0.5` prints the rows of
this page for one program, with the reason and the number to write instead. With `--time-step` it computes the
program's own sequence of steps, and with `--step-error 0.01` the largest time step whose error is one per cent.

This page is the output of `python -m viscopade_lab.studies.audit`. The $\varepsilon$ without a time step are proven
([any power-law contact](laws.md)); those with one are computed by the program's own map
([`viscopade.collision.schemes`](../../src/viscopade/collision/schemes.py)). Measured values are from the programs
themselves; `python -m viscopade_lab.runs.simulators --write` stores them in
[`audit.csv`](../../src/viscopade/data/audit.csv). Version 1.0.0 measured those of Drake, Kratos and Simbody.

![delivered eps over asked eps, and eps over the time step, with measured values](../figures/audit.svg)

## Delivered, for fine time steps
"""

WITH_STEPS = r"""
## Measured

Each program is asked for $\varepsilon = {chosen}$. The number to write instead delivers {chosen} with a fine time
step. *Measured* is with a time step of $t$, in units of the contact time without damping; *predicted* is for the
same step and the same place in it where contact begins. The last column is the largest difference between the two
over all collisions that were run: {runs} collisions, with $\varepsilon$ = {asked} asked for and $t$ from {least} to
{largest}.
"""

INSTEAD_TEXT = rf"""
## Asked for the number instead

To get $\varepsilon = {cases.WANTED}$, these programs were asked for another number, which makes up for the time
step $t$ as well. The mean over where in a step contact begins is {cases.WANTED}. A single collision is off by
what the last two columns show.
"""

STEPS_TEXT = r"""
## Time steps

LAMMPS, LIGGGHTS, MercuryDPM and YADE compute the damping with the velocity between two steps. Their velocity Verlet
and leapfrog are then the same map as semi-implicit Euler's method,

$$x_{{n+1}} = x_n + h u_n, \qquad u_{{n+1}} = u_n - h F(x_{{n+1}}, u_n),$$

and the error of $\varepsilon$ is of first order in the step: $\varepsilon(t) \approx \varepsilon + s t$ on average,
$t$ being the step in units of the contact time without damping. Where in a step contact begins is chance, so the
$\varepsilon$ of a program scatters around this mean. The table is for {chosen}; the last column is the number of
steps in an undamped contact that keeps every $\varepsilon$ within {error}.

MuJoCo (Euler, implicit and implicitfast), Chrono, Kratos and JaxDEM step in the same way. The last rows are for two
others. Drake's discrete contacts take the force at the end of the step: implicit Euler's method, which damps by itself.
MuJoCo's RK4 has no error of first order, but it scatters.
"""

AFTER_STEPS = r"""
- **The lag leaves Hunt-Crossley contacts without an error of first order.** It multiplies the whole force by a function
  of $x$. For $a = b$ the $\varepsilon$ does not depend on the shape of the spring, so the function changes nothing.
- **A linear dashpot scatters most.** Its damping jumps at the first contact, and so a fraction of a step changes
  $\varepsilon$ by as much as the error of first order.
- **Implicit steps damp by themselves.** With ten steps in a contact and no dissipation at all Drake delivers
  $\varepsilon$ = {highest} on average.
- Another number than the one asked for makes up for the step, and this prints it:
  `viscopade audit lammps --epsilon 0.5 --time-step 0.02`.
"""
SOURCES = "## What was read\n"

WEIGHT = r"""## Weight

A body that falls on a plane is pressed against it by its weight while it is in contact:
$m \ddot{{\xi}} + k \xi^a + c \xi^b \dot{{\xi}} = m g$. Without damping this changes nothing: the body is back at
$\xi = 0$ with the speed that it came with. But the weight makes the contact deeper and longer, so that any damping
takes more. For small losses $1 - \varepsilon$ grows by the factor $1 + s g t_c/v$
([derivation](../../derivations/16_load.py)), with the duration $t_c$ of the contact without damping and the impact
speed $v$. So weight counts where contacts are long, as soft ones are, and where bodies are slow. Below the sticking
speed a body does not leave the plane again: $\varepsilon = 0$.

![eps of a body that falls, over its weight, for four laws and both ends of contact](../figures/weight.svg)

*Solid: contact ends where the force vanishes; dashed: at $x = 0$; dash-dotted: the factor above, for viscoelastic
spheres.*

The table is for contacts that are made for {chosen} without weight. The numbers are sampled
([`viscopade.collision.contact`](../../src/viscopade/collision/contact.py)).
"""

AFTER_WEIGHT = r"""
- `viscopade epsilon` and `invert` take `--gravity` or `--load`. `viscopade table` and `plot` take `--gravity`, and
  `viscopade simulators --gravity` writes the damping that makes up for the weight.
- Without it `viscopade simulators` and `viscopade scene` state $g t_c/v$ in their files. From {counts:g} on they
  warn, with the $\varepsilon$ that a body gets which falls, and with its sticking speed.
- MuJoCo's contacts carry a part of the weight, 0.9 of it with the `solimp` that we write, without a penetration: a
  ball keeps 0.448 of 1 m/s in the contact of 31 ms, not 0.399 as a spring and a dashpot would leave it.
- Two bodies that both fall have no weight on each other. The direction of impact is normal to the plane.
"""
SHARES = (0.02, 0.1, 0.3)  # g t_c/v

BEGIN, END = "<!-- audit -->", "<!-- end of the audit -->"
SECTION = r"""
![eps against speed of contacts that are made for 0.5 at 1 m/s](../../figures/epsOverSpeed.svg)

The $\varepsilon$ of fine time steps, if the program's own formulas are asked for 0.9, 0.75, …
([what programs deliver](../../results/audit.md)):
"""
SECTION_MEASURED = f"""Asked for {CHOSEN}: why, and what to write instead. *Measured* is with a time step of $t$
contact times, *predicted* for the same step. The last column is the largest difference over all collisions that were
run (`python -m viscopade_lab.studies.audit --pages docs/usage/simulators` writes these tables).
"""


def title_row(program: Simulator) -> str:
    """Return the heading of a program."""
    return f"### {program.title}"


def delivered_table(program: Simulator) -> str:
    """Return the table of delivered eps: one row a formula, one column an eps asked for."""
    rows = ([formula.name, ENDS[formula.law.end], *_delivered(program, formula)] for formula in program.formulas)
    return markdown(["formula", "contact ends at", *(f"{asked} asked" for asked in ASKED)], rows)


def _delivered(program: Simulator, formula: DampingFormula) -> Iterator[str]:
    for asked in ASKED:
        try:
            yield number(audited(program, formula, asked))
        except ValueError:
            yield "not accepted"


def number(found: Audit) -> str:
    """Return the delivered eps as text."""
    return "never parts" if found.delivered is None else f"{float(found.delivered):.4f}"


def measured_table(program: Simulator) -> str:
    """Return the table for `CHOSEN`: delivered, why, the number to write instead, measured and predicted."""
    head = ["formula", "delivered", "why", "write instead", "measured", "at $t$", "predicted", "largest difference"]
    return markdown(head, (_measured(program, formula) for formula in program.formulas))


def _measured(program: Simulator, formula: DampingFormula) -> list[str]:
    found, run = audited(program, formula, CHOSEN), finest(program.name, formula.name, CHOSEN)
    instead = "" if found.instead is None else f"`{formula.parameter}` = {found.instead:.6g}"
    why = "" if formula.reason == "exact" else formula.reason
    written = [formula.name, number(found), why, instead if why else ""]
    if run is None:
        return [*written, "from the source", "", "", ""]
    worst = max(abs(each.epsilon - each.predicted) for each in measurements() if _is_of(each, run))
    return [*written, f"{run.epsilon:.6f}", f"{run.time_step:g}", f"{run.predicted:.6f}", f"{worst:.0e}"]


def _is_of(one: Measurement, other: Measurement) -> bool:
    return (one.program, one.formula) == (other.program, other.formula)


def instead_table() -> str:
    """Return the table of what programs delivered when they were asked for the number instead of `WANTED`."""
    groups: dict[tuple[str, str, str, float], list[float]] = {}
    for each in measurements():
        if each.asked not in cases.ASKED:
            groups.setdefault((each.program, each.formula, each.asked, each.time_step), []).append(each.epsilon)
    head = ["program", "formula", "asked of it", "$t$", "collisions", "mean", "least", "largest"]
    rows = (
        [simulator_of(name).title, formula, asked, f"{step:g}", str(len(found)), *_spread(found)]
        for (name, formula, asked, step), found in groups.items()
    )
    return markdown(head, rows)


def _spread(found: list[float]) -> list[str]:
    return [f"{value:.4f}" for value in (sum(found) / len(found), min(found), max(found))]


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
    return markdown(head, (_weight(law, name.partition(":")[0]) for name in LAWS for law in _with_ends(name)))


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
    yield HEAD
    for program in simulators():
        yield f"{title_row(program)}\n\n{delivered_table(program)}\n"
    found = measurements()
    asked = ", ".join(cases.ASKED)
    least, largest = (f"{bound(each.time_step for each in found):g}" for bound in (min, max))
    yield WITH_STEPS.format(chosen=CHOSEN, runs=len(found), asked=asked, least=least, largest=largest)
    for program in simulators():
        if program.name != "textbook":
            lines = "\n".join(notes(program))
            yield f"{title_row(program)}\n\n{measured_table(program)}\n" + (f"\n{lines}\n" if lines else "")
    yield f"{INSTEAD_TEXT}\n{instead_table()}\n"
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
