"""Kernels built from the fitted and proven formulas: quotients, compact kernels, inverse kernels."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import replace
from fractions import Fraction

from viscopade.arithmetic.formats import DOUBLE, FORMATS, Format
from viscopade.kernels.arithmetic import DEVICE, HOST, HOST_FLOAT, SHADER, Arithmetic
from viscopade.kernels.bound import ErrorBound, RelativeTo
from viscopade.kernels.certificate import Certificate
from viscopade.kernels.expressions import Call, CodeBranch, Expression, Name, Select, Statement, both
from viscopade.kernels.forms import formulas, table_free
from viscopade.kernels.forms.formulas import ONE, W_ACCEPTED, ZERO, within
from viscopade.kernels.forms.lacunary_kernels import HALF_LINE, HalfLineKernel, InverseKernel, LacunaryVariant
from viscopade.kernels.forms.minimax import MinimaxKernel
from viscopade.kernels.forms.quotient import PadeKernel, Quotient
from viscopade.kernels.kernel import Function, Kernel
from viscopade.kernels.v_star import USUAL, of_v_star
from viscopade.theory.law import VISCOELASTIC

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
    at = "" if kernel.law == VISCOELASTIC else f" at v* = kappa^(1/{kernel.law.d})"
    functions: tuple[Function, ...] = (Function("epsilon", ("v_star",), f"eps{at}", None, (), branches, "epsilon"),)
    if kernel.of_speed:
        functions = (*functions, of_speed(branches))
    return Kernel(
        kernel.name, kernel.label, "v_star", quotient_text(coefficients), kernel.source, kernel.domain, functions,
        constants, tuple(_quotient_bounds(kernel, constants)), missing=missing, record=kernel.record(),
        proofs=tuple(kernel.certificates()), law=kernel.law,
    )  # fmt: skip


def quotient_text(coefficients: Mapping[str, object]) -> str:
    """Return eps = N/D as text."""
    top, bottom = (
        " + ".join(name if name[1:] == "0" else f"{name} v*" + f"^{name[1:]}" * (name[1:] != "1") for name in names)
        for names in ([name for name in coefficients if name[0] == letter] for letter in "ab")
    )
    return f"eps = ({top})/({bottom})"


NEAR_END = Fraction(1, 2**16)
"""A computed v* may be beyond an end of an interval by less than this factor."""
HOSTS = {arithmetic.form.name: arithmetic for arithmetic in (HOST, HOST_FLOAT)}


def _relative_to(measure: str) -> RelativeTo:
    return "smaller" if measure == "both" else "value"


def _quotient_bounds(kernel: Quotient, forms: Iterable[str]) -> Iterator[ErrorBound]:
    """Yield the bounds of eps, and of eps from the speed, by the rounding of v* = sqrt(beta) pow(speed, 0.1)."""
    for name in forms:
        machine = HOSTS[name]
        if isinstance(kernel, MinimaxKernel):
            variant = kernel.variant(machine.form)
            yield from quotient_bounds(variant.certificate, Fraction(variant.rounding), machine)
        elif isinstance(kernel, PadeKernel) and name in dict(kernel.rounding):
            for proof in kernel.bounds:
                yield from quotient_bounds(proof, Fraction(dict(kernel.rounding)[name]), machine)
    if isinstance(kernel, PadeKernel):
        for high, error in kernel.sampled:
            yield ErrorBound("epsilon", Fraction(0), Fraction(high), "smaller", Fraction(error), proven=False)


def quotient_bounds(proof: Certificate, rounding: Fraction, machine: Arithmetic) -> Iterator[ErrorBound]:
    """Yield the bounds that follow from a proof and a rounding error relative to eps."""
    formula, relative_to = Fraction(proof.bound), _relative_to(proof.measure)
    yield ErrorBound(
        "epsilon", proof.low, proof.high, relative_to, formula, last=rounding, arithmetic=machine
    )  # fmt: skip
    yield from of_computed_v_star(
        ErrorBound("restitution", proof.low, proof.high, relative_to, formula, last=rounding, arithmetic=machine)
    )


def of_computed_v_star(bound: ErrorBound) -> Iterator[ErrorBound]:
    """Yield the bounds of a function of the speed, given that of its function of v*."""
    for speeds in ((1 / USUAL, USUAL), None):
        change = of_v_star(bound.arithmetic.form, USUAL if speeds else None)
        yield replace(
            bound, low=bound.low * (1 + NEAR_END), high=bound.high * (1 - NEAR_END), speeds=speeds,
            rounding=bound.rounding + change * (1 + bound.relative), last=bound.last * (1 + change),
        )  # fmt: skip


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
        "compact" + kernel.name.removeprefix(HALF_LINE),
        "speed",
        f"eps = D/(D + y^6 N), y = w^(1/30), w = beta^5 speed = v*^10, {kernel.powers_text}",
        kernel.source,
        COMPACT_DOMAIN,
        tuple(
            Function(name, ("speed", "beta"), meaning, W_ACCEPTED, start, (branch,), name)
            for name, meaning in meanings.items()
        ),
        constants,
        tuple(bound for v in kernel.variants for bound in _compact_bounds(kernel, v)),
        missing=dict(kernel.missing),
        record=kernel.record(),
        proofs=tuple(kernel.certificates()),
    )


COMPACT_DOMAIN = (
    "all speeds and betas >= 0 but for 0 and infinity together. The bounds hold where beta^2, beta^4, beta^5 and w as "
    "computed are normal numbers; for smaller w eps is 1 but for less than the type can tell, and w is cut off "
    "beyond 2^900 (2^120 in type float), so that eps stays positive"
)
MACHINES = {
    HOST.name: table_free.LIBRARY["double"],
    HOST_FLOAT.name: table_free.LIBRARY["float"],
    DEVICE.name: table_free.DEVICE,
    SHADER.name: table_free.SHADER,
}


def compact_range(form: Format) -> tuple[Fraction, Fraction]:
    """Return the least and the largest v* of compact kernels in a type, rounded inwards."""
    low, high = 2.0 ** ((1 - form.largest) / 10), 2.0 ** (table_free.LARGEST[form.name] / 10)
    return Fraction(f"{1.01 * low:.3g}"), Fraction(f"{0.99 * high:.3g}")


def _compact_bounds(kernel: HalfLineKernel, variant: LacunaryVariant) -> Iterator[ErrorBound]:
    """Yield the bounds in each arithmetic: for all v*, and in type float the smaller ones in `table_free.COMMON`.

    There are two for eps. In one, what rounding adds is relative to eps. In the other it is relative to the smaller one
    of eps and 1 - eps, but for the last sum and quotient: those before change lost/elastic by a factor 1 + eta, and so
    eps by eps (1 - eps) eta. The bound r_0 of eps's relative error holds this below r_0 eps. From the bound r_2 of that
    of 1 - eps^2 it is below r_2 (1 - eps^2)/(2 eps), which is at most 3/2 r_2 (1 - eps) for eps >= 1/2.
    """
    formula, relative_to = variant.error, _relative_to(variant.certificate.measure)
    of_loss = formula * (1 + formula / 2)  # |d eps| (2 eps + |d eps|)/((1 - eps) (1 + eps)), |d eps| <= formula smaller
    for machine in (a for a in (HOST, HOST_FLOAT, DEVICE, SHADER) if a.form == variant.form):
        found = table_free.rounding_bounds(kernel.powers, variant.a, variant.b, MACHINES[machine.name])
        unit = Fraction(2) ** -machine.model.precision
        last = (unit + machine.quotient * machine.ulp) * (1 + Fraction(1, 1 << 10))  # elastic/(elastic + lost)
        ends = [compact_range(variant.form), *([table_free.COMMON] if variant.form != DOUBLE else [])]
        for i, (low, high) in enumerate(ends):
            r = {name: Fraction(found[name][i]) for name in table_free.FUNCTIONS}

            bound = ErrorBound("restitution", low, high, relative_to, formula, arithmetic=machine)
            yield replace(bound, last=r["restitution"] * (1 + formula))
            # eps speed may be subnormal
            tiny = machine.model.smallest / 2 / machine.form.smallest
            yield replace(bound, result="rebound", last=r["rebound"] * (1 + formula), absolute=tiny)
            if relative_to == "smaller":
                most = max(r["restitution"], Fraction(3, 2) * r["dissipation"])
                yield replace(bound, rounding=most * (1 + formula), last=last)
                rounding = r["dissipation"] * (1 + of_loss)
                yield ErrorBound("dissipation", low, high, "value", of_loss, rounding, arithmetic=machine)


def half_line(kernel: HalfLineKernel) -> Kernel:
    """Return the kernel of v*, by cbrt: eps and 1 - eps for all v* >= 0, and eps of the speed and beta."""
    near, far = formulas.half_line_branches(kernel.powers)
    branches = (near._replace(guard=within("v_star", ZERO, ONE)), far._replace(guard=ONE < V_STAR))
    functions = (
        Function("epsilon", ("v_star",), "eps", None, (), branches, "epsilon"),
        Function("one_minus_epsilon", ("v_star",), "1 - eps", None, (), branches, "one_minus_epsilon"),
        of_speed(branches),
    )
    return Kernel(
        kernel.name, kernel.label, "v_star", kernel.formula, kernel.source, kernel.domain, functions,
        {v.form.name: formulas.constants(kernel.powers, v.a, v.b) for v in kernel.variants},
        tuple(bound for v in kernel.variants for bound in _half_line_bounds(kernel, v)), missing=dict(kernel.missing),
        record=kernel.record(), proofs=tuple(kernel.certificates()),
    )  # fmt: skip


def _half_line_bounds(kernel: HalfLineKernel, variant: LacunaryVariant) -> Iterator[ErrorBound]:
    machine, formula, sizes = HOSTS[variant.form.name], variant.error, dict(variant.sizes)
    for result in kernel.checked:
        last, absolute = Fraction(sizes[result].relative) * (1 + formula), Fraction(sizes[result].underflow)
        bound = ErrorBound(
            result, Fraction(0), math.inf, _relative_to(variant.certificate.measure), formula, last=last,
            absolute=absolute, arithmetic=machine,
        )  # fmt: skip
        yield bound
        if result == "epsilon":
            yield from of_computed_v_star(replace(bound, result="restitution"))


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
        tuple(bound for v in kernel.variants for bound in _inverse_bounds(v)), missing=dict(kernel.missing),
        record=kernel.record(), proofs=tuple(kernel.certificates()),
    )  # fmt: skip


def _inverse_bounds(variant: LacunaryVariant) -> Iterator[ErrorBound]:
    proof, sizes = variant.certificate, dict(variant.sizes)
    of_beta = (1 + variant.error) ** 2 - 1  # beta is v*^2 but for a factor
    parts = {"v_star": variant.error, "v_star_from_loss": variant.error, "beta": of_beta}
    for result, formula in parts.items():
        rounding = Fraction(sizes[result.removesuffix("_from_loss")].relative) * (1 + formula)
        yield ErrorBound(
            result, proof.low, proof.high, "value", formula, rounding, arithmetic=HOSTS[variant.form.name]
        )  # fmt: skip
