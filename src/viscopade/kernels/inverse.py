"""Inverse kernels: v* = y^k N/D of eps, y = ((1 - eps)/eps)^root, by lacunary polynomials, and beta, with proofs."""

from __future__ import annotations

from collections.abc import Iterator
from fractions import Fraction
from functools import partial
from operator import itemgetter

from flint import arb

from viscopade import arguments
from viscopade.approximation import inverse as approximants
from viscopade.approximation.inverse import INTERVAL_FORM, WHOLE_FORM, InverseForm
from viscopade.approximation.lacunary import LacunaryQuotient, Powers, full_powers
from viscopade.arithmetic.balls import ball_of, working
from viscopade.arithmetic.decimals import above, at_most, identifier, rounded_up
from viscopade.collision.exact import Exact
from viscopade.kernels import certificate, formulas
from viscopade.kernels.arithmetic import Arithmetic
from viscopade.kernels.bound import ErrorBound
from viscopade.kernels.coefficients import (
    Coefficients,
    Fitted,
    accuracy_name,
    accuracy_of,
    first,
    levelled,
    on_machines,
    powers_text,
    with_proofs,
)
from viscopade.kernels.enclosure import Formula
from viscopade.kernels.expressions import CodeBranch, Expression, Name, Statement, both
from viscopade.kernels.formulas import ONE, ZERO
from viscopade.kernels.kernel import Function, Kernel
from viscopade.kernels.rounding_bounds import (
    BITS,
    DIGITS,
    Found,
    Values,
    above_root,
    below_root,
    largest,
    log_error,
    of_powers,
    on_parts,
    parts_from,
)
from viscopade.store import recorded

ACCURACY = "inverse"  # in refusals: the option of `viscopade export`
EPSILON_MIN = Fraction(1, 5000), Fraction(99, 100)
LEAST_BITS = 24  # an interval of eps begins at a multiple of 2^-24, which both types hold, as they do 1 - eps there
FARTHEST = 2  # |m - n| of the degrees on [epsilon_min, 1] that are tried
HOPELESS = 20  # of the degrees with one sum, the best is not better than the most equal ones by this factor (sampled)


def inverse(accuracy: Exact, epsilon_min: Exact = 0) -> Kernel:
    """Return the kernel for v*(eps) with the fewest coefficients and a proven error within the accuracy.

    Parameters
    ----------
    accuracy : str, int, float, Fraction, Decimal, mpmath.mpf or NumPy scalar
        Relative error of v*, from 1e-15 to 0.99, for type double and with rounding.
    epsilon_min : like accuracy
        0 for all 0 < eps <= 1, or from 2e-4 to 0.99 for a kernel on [epsilon_min, 1]. On an interval the degrees m and
        n of numerator and denominator are tried that differ by at most `FARTHEST`.

    Raises
    ------
    TypeError, ValueError
        If an argument is not of this kind, or no kernel is accurate enough.
    """
    wanted = accuracy_of(accuracy, ACCURACY)
    least, most = EPSILON_MIN
    low = arguments.exact_number(
        "epsilon_min", epsilon_min, "0, or a number from 2e-4 to 0.99", lambda e: e == 0 or least <= e <= most
    )
    powers = inverse_powers(wanted, low)
    return _kernel(accuracy_name(wanted), powers, low, inverse_fit(powers, low))


def _kernel(asked: str, powers: Powers, epsilon_min: Fraction, fitted: Fitted) -> Kernel:
    low, form = interval_start(epsilon_min), _form(epsilon_min)
    name = f"inverse_{f'e{identifier(above(epsilon_min))}_' if epsilon_min else ''}{asked}"
    domain = "0 < eps <= 1"
    if low:
        rounded = f" ({above(epsilon_min)} rounded down to a multiple of 2^-{LEAST_BITS})" * (low < epsilon_min)
        domain = f"{float(low)!r} <= eps <= 1{rounded}"
    text = f"v* = {'y' if form.shift == 1 else f'y^{form.shift}'} N/D, y = ((1 - eps)/eps)^({form.root}), "
    text, source = text + powers_text(powers), "best N/D in the relative error of v*"
    head = {"name": name, "kind": "inverse", "root": str(form.root), "top": powers.top, "bottom": powers.bottom}
    head |= {"epsilon_min": str(epsilon_min), "epsilon_low": str(low)}
    ends = {"least_epsilon": float(low), "largest_loss": float(1 - low)} if low else {}
    return Kernel(
        name, name, "epsilon", text, source, domain, _functions(powers, form, bool(low)),
        {v.form.name: {**formulas.constants(powers, v.a, v.b), **ends} for v in fitted.variants},
        tuple(bound for v in fitted.variants for bound in v.bounds), missing=fitted.missing,
        record={
            **head, "formula": text, "domain": domain, "measure": "speed",
            "variants": [v.record() | {"rounding": _sizes(v)} for v in fitted.variants], "missing": fitted.missing,
            "source": source,
        },
        proofs=tuple(head | v.proof() | {"rounding": _sizes(v)} for v in fitted.variants),
    )  # fmt: skip


def _sizes(variant: Coefficients) -> dict[str, dict[str, str]]:
    """Return what rounding adds, relative to the formula's value."""
    bounds = {result: variant.bound(result) for result in ("v_star", "beta")}
    return {
        result: {"relative": at_most(b.rounding / (1 + b.formula), DIGITS), "underflow": "0"}
        for result, b in bounds.items()
    }


def _functions(powers: Powers, form: InverseForm, has_ends: bool) -> tuple[Function, ...]:
    """Return v* of eps or of 1 - eps, and beta of eps and a speed."""
    epsilon, given, speed = Name("epsilon"), Name("one_minus_epsilon"), Name("speed")
    of_epsilon: Expression = both(Name("least_epsilon") <= epsilon if has_ends else epsilon > ZERO, epsilon <= ONE)
    of_loss: Expression = both(given >= ZERO, given <= Name("largest_loss") if has_ends else given < ONE)
    branches = tuple(
        CodeBranch(
            branch.guard,
            (*branch.program, Statement("v_star", branch.results["v_star"])),
            {"v_star": Name("v_star"), "beta": formulas.beta_branch().results["beta"]},
        )
        for branch in formulas.inverse_branches(powers, form)
    )
    loss, from_loss = (Statement("loss", ONE - epsilon),), (Statement("epsilon", ONE - given), Statement("loss", given))
    return (
        Function("v_star", ("epsilon",), "v* at which eps is epsilon", of_epsilon, loss, branches, "v_star"),
        Function(
            "v_star_from_loss", ("one_minus_epsilon",), "v* at which 1 - eps is one_minus_epsilon", of_loss, from_loss,
            branches, "v_star",
        ),
        Function(
            "beta", ("epsilon", "speed"), "beta at which eps is epsilon at a speed", both(of_epsilon, speed > ZERO),
            loss, branches, "beta",
        ),
    )  # fmt: skip


def interval_start(epsilon_min: Fraction) -> Fraction:
    """Return the largest multiple of 2^-24 up to a number; it and its difference from 1 are exact in both types."""
    return Fraction(epsilon_min.numerator * 2**LEAST_BITS // epsilon_min.denominator, 2**LEAST_BITS)


def _form(epsilon_min: Fraction) -> InverseForm:
    return INTERVAL_FORM if epsilon_min else WHOLE_FORM


# --- fits -------------------------------------------------------------------------------------------------------------


@recorded("inverse powers")
def inverse_powers(wanted: Fraction, epsilon_min: Fraction = Fraction(0)) -> Powers:
    """Return the powers of the kernel with the fewest coefficients that is proven to be accurate enough."""
    whole = levelled(approximants.WHOLE, approximants.fit_whole)
    candidates = _on_interval(wanted, epsilon_min) if epsilon_min else whole
    return first(wanted, candidates, lambda p: inverse_fit(p, epsilon_min).variants[0].error("v_star"), ACCURACY)


def _on_interval(wanted: Fraction, epsilon_min: Fraction) -> Iterator[tuple[float, Powers]]:
    """Yield the sampled errors and powers on [epsilon_min, 1], those with fewest coefficients and least error first.

    Degrees are left out where the most equal ones with the same sum are not accurate enough by far.
    """
    low = interval_start(epsilon_min)
    for total in range(2 * approximants.MAX_DEGREE + 1):
        degrees = [(m, total - m) for m in range(total + 1) if abs(total - 2 * m) <= FARTHEST]
        degrees.sort(key=lambda pair: (abs(pair[1] - pair[0]), pair))
        allowed = (full_powers(m, n) for m, n in degrees if max(m, n) <= approximants.MAX_DEGREE)
        found: list[tuple[float, Powers]] = []
        for candidate in levelled(allowed, lambda powers: approximants.fit_interval(powers.m, powers.n, low)):
            found.append(candidate)
            if min(found, key=itemgetter(0))[0] > HOPELESS * wanted:
                break
        yield from sorted(found, key=itemgetter(0))


@recorded("inverse")
def inverse_fit(powers: Powers, epsilon_min: Fraction = Fraction(0)) -> Fitted:
    """Return the best kernel for epsilon_min <= eps <= 1 with given powers, all up to their degrees if epsilon_min > 0.

    Errors as for `inverse.fit_whole` and `inverse.fit_interval`.
    """
    low, form = interval_start(epsilon_min), _form(epsilon_min)
    fit = approximants.fit_interval(powers.m, powers.n, low) if low else approximants.fit_whole(powers)
    return with_proofs(
        fit.quotient,
        lambda found: certificate.prove_inverse(inverse_formula(found, form), low),
        lambda of: on_machines(of.form, lambda machine: _bounds(powers, form, low, of, machine)),
    )


def inverse_formula(found: LacunaryQuotient, form: InverseForm) -> Formula:
    """Return v* = y^k N/D, with N and D lacunary in y = ((1 - eps)/eps)^root, as proofs read it; `power` is k."""
    near, *far = formulas.inverse_branches(found.powers, form)
    given = formulas.constants(found.powers, found.a, found.b)
    return Formula(form.shift, near, far[0] if far else None, given)


# --- rounding ---------------------------------------------------------------------------------------------------------


def _bounds(
    powers: Powers, form: InverseForm, epsilon_min: Fraction, of: Coefficients, machine: Arithmetic
) -> Iterator[ErrorBound]:
    """Yield the bounds of v* and beta, which is v*^2 times a factor."""
    proof = of.certificate
    of_beta = (1 + proof.bound) ** 2 - 1
    sizes = inverse_rounding(powers, form, epsilon_min, of.a, of.b, machine)
    for result, error in (("v_star", proof.bound), ("v_star_from_loss", proof.bound), ("beta", of_beta)):
        size = sizes[result.removesuffix("_from_loss")] * (1 + error)
        yield ErrorBound(result, proof.low, proof.high, "value", error, size, arithmetic=machine)


def inverse_rounding(
    powers: Powers, form: InverseForm, epsilon_min: Fraction, a: Values, b: Values, machine: Arithmetic
) -> dict[str, Fraction]:
    """Bound the rounding errors of v_star and beta, relative to the formula's value; nothing underflows there.

    The quotient of 1 - eps and eps has two roundings. (Where it is subnormal, the larger of eps and 1 - eps is
    rounded to 1, and the quotient's error is smaller than that.)

    Raises
    ------
    ArithmeticError
        If a sum may vanish.
    """
    with working(BITS):
        unit, root = arb(2) ** -machine.form.precision, form.root
        branches = dict(zip("yu", formulas.inverse_branches(powers, form), strict=False))

        def of_root(variable: str, y: arb) -> arb:
            log = abs(y.log()) / ball_of(root)
            return log_error(of_powers(branches[variable], variable, machine, {"epsilon": 0, "loss": unit}, log, root))

        def of_v_star(found: Found) -> arb:
            v_star = found["v_star"]
            return (v_star.relative + v_star.underflow / v_star.value.abs_lower()).abs_upper()

        start = below_root(machine.form.smallest, root)
        end = above_root(1 / epsilon_min - 1, root) if epsilon_min else Fraction(1)
        numbers = formulas.constants(powers, a, b)
        on_branches = (
            on_parts(branch, ("v_star",), variable, numbers, machine, lambda _: {}, partial(of_root, variable))
            for variable, branch in branches.items()
        )
        relative = max(largest(on, parts_from(start, end), of_v_star) for on in on_branches)
        beta = of_powers(formulas.beta_branch(), "beta", machine, {"speed": 0, "v_star": relative})
        return {"v_star": rounded_up(relative, DIGITS), "beta": rounded_up(beta, DIGITS)}
