"""Kernels built from the fitted and proven formulas: quotients, compact kernels, inverse kernels."""

from __future__ import annotations

import math
from collections.abc import Mapping
from fractions import Fraction

from viscopade.arithmetic.formats import DOUBLE, FORMATS, Format
from viscopade.kernels.expressions import Call, CodeBranch, Expression, Name, Select, Statement, both
from viscopade.kernels.forms import formulas, table_free
from viscopade.kernels.forms.formulas import ONE, W_ACCEPTED, ZERO, within
from viscopade.kernels.forms.lacunary_kernels import HALF_LINE, HalfLineKernel, InverseKernel
from viscopade.kernels.forms.quotient import Quotient
from viscopade.kernels.kernel import Function, Kernel

EPSILON, LOSS, V_STAR = Name("epsilon"), Name("loss"), Name("v_star")


def of_speed(branches: tuple[CodeBranch, ...], result: str = "epsilon") -> Function:
    """Return eps as a function of the speed and beta, from that of v*; NaN for 0 times infinity comes of itself."""
    start = formulas.v_star_branch()
    return Function(
        "restitution",
        ("speed", "beta"),
        "eps",
        W_ACCEPTED,
        (Statement("v_star", start.results["v_star"]),),
        branches,
        result,
    )


def quotient(kernel: Quotient) -> Kernel:
    """Return a quotient of polynomials in v*: NaN outside its interval, and beyond its first pole or zero."""
    constants, far, missing = dict[str, Mapping[str, float]](), False, dict[str, str]()
    for form in FORMATS.values():
        try:
            a, b = kernel.rounded(form)
            given = formulas.dense(a=a, b=b)
            ends = _ends(kernel, form)
            threshold = 2.0 ** kernel.threshold(form)
        except ValueError as error:
            if form == DOUBLE:
                raise
            missing[form.name] = str(error)
            continue
        if ends is None and not len(a) == len(b) == 1:
            given, far = given | {"threshold": threshold}, True
        elif ends is not None:
            given = given | ({"low": ends[0]} if ends[0] else {}) | {"high": ends[1]}
        constants[form.name] = given
    coefficients = {name: c for name, c in constants["double"].items() if name[0] in "ab"}
    near, beyond = formulas.epsilon_branches(coefficients)
    low = Name("low") if "low" in constants["double"] else ZERO
    inside = within("v_star", low, Name("high")) if "high" in constants["double"] else formulas.NOT_NEGATIVE
    branches: tuple[CodeBranch, ...] = (near._replace(guard=inside),)
    if far:
        branches = (beyond._replace(guard=Name("threshold") < V_STAR), *branches)
    functions: tuple[Function, ...] = (Function("epsilon", ("v_star",), "eps", None, (), branches, "epsilon"),)
    if kernel.of_speed:
        functions = (*functions, of_speed(branches))
    return Kernel(
        kernel.name, kernel.label, "v_star", "", kernel.source, kernel.domain, functions, constants, missing=missing
    )


def _ends(kernel: Quotient, form: Format) -> tuple[float, float] | None:
    """Return the ends of the domain in a format, rounded inwards; None for all v* >= 0."""
    if kernel.interval is not None:
        low, high = kernel.interval
        return form.nearest(low, math.ceil), form.nearest(high, math.floor)
    if kernel.end is not None:
        return 0.0, form.nearest(Fraction(kernel.end[1]), math.floor)
    return None


def compact(kernel: HalfLineKernel) -> Kernel:
    """Return a compact kernel: eps, eps speed and 1 - eps^2 from speed and beta, without a table or a branch."""
    w, cut = Name("w"), Name("x")
    positive = cut > Name("least")
    program = table_free.table_free_program(kernel.powers, table_free.called)
    root = program.common[0].expression
    assert isinstance(root, Call)
    rooted = Call("exp2", (Call("log2", (Select(positive, cut, ONE),)) * Name(table_free.THIRTIETH),))
    start = (
        *formulas.w_program(),
        Statement("x", Select(w > Name("largest"), Name("largest"), w)),
        Statement("y", Select(positive, rooted, cut)),
    )
    results = dict(program.results)
    branch = CodeBranch(None, (*program.common[1:], program.inverse), results)
    meanings = {"restitution": "eps", "rebound": "eps speed, the speed after the collision", "dissipation": "1 - eps^2"}
    constants = {
        v.form.name: {
            **table_free.numbers(kernel.powers, v.a, v.b, v.form),
            "largest": 2.0 ** table_free.LARGEST[v.form.name],
        }
        for v in kernel.variants
    }
    return Kernel(
        "compact" + kernel.name.removeprefix(HALF_LINE),
        kernel.label,
        "speed",
        "",
        kernel.source,
        "",
        tuple(
            Function(name, ("speed", "beta"), meaning, W_ACCEPTED, start, (branch,), name)
            for name, meaning in meanings.items()
        ),
        constants,
        missing=dict(kernel.missing),
    )


def inverse(kernel: InverseKernel) -> Kernel:
    """Return an inverse kernel: v* of eps or of 1 - eps, and beta of eps and a speed."""
    whole, given = kernel.ends is None, Name("one_minus_epsilon")
    of_epsilon: Expression = both(EPSILON > ZERO if whole else Name("least_epsilon") <= EPSILON, EPSILON <= ONE)
    of_loss: Expression = both(given >= ZERO, given < ONE if whole else given <= Name("largest_loss"))
    speed = Name("speed")
    branches = tuple(
        CodeBranch(
            branch.guard,
            (*branch.program, Statement("v_star", branch.results["v_star"])),
            {"v_star": V_STAR, "beta": formulas.beta_branch().results["beta"]},
        )
        for branch in kernel.branches
    )
    loss, from_loss = (Statement("loss", ONE - EPSILON),), (Statement("epsilon", ONE - given), Statement("loss", given))
    functions = (
        Function("v_star", ("epsilon",), "v* at which eps is epsilon", of_epsilon, loss, branches, "v_star"),
        Function(
            "v_star_from_loss",
            ("one_minus_epsilon",),
            "v* at which 1 - eps is one_minus_epsilon",
            of_loss,
            from_loss,
            branches,
            "v_star",
        ),
        Function(
            "beta",
            ("epsilon", "speed"),
            "beta at which eps is epsilon at a speed",
            both(of_epsilon, speed > ZERO),
            loss,
            branches,
            "beta",
        ),
    )
    ends = {} if kernel.ends is None else {"least_epsilon": kernel.ends[0], "largest_loss": kernel.ends[1]}
    constants = {v.form.name: {**formulas.constants(kernel.powers, v.a, v.b), **ends} for v in kernel.variants}
    return Kernel(
        kernel.name, kernel.label, "epsilon", kernel.formula, kernel.source, kernel.domain, functions, constants,
        missing=dict(kernel.missing),
    )  # fmt: skip
