"""Inverse kernels: v* = y^5 N/D of eps, y = ((1 - eps)/eps)^(1/10), by lacunary polynomials, and beta, with proofs."""

from __future__ import annotations

from collections.abc import Iterator
from fractions import Fraction
from functools import partial

from flint import arb

from viscopade.approximation import inverse as approximants
from viscopade.approximation.inverse import ROOT, SHIFT
from viscopade.approximation.lacunary import LacunaryQuotient, Powers
from viscopade.arithmetic.balls import ball_of, working
from viscopade.arithmetic.decimals import at_most, rounded_up
from viscopade.arithmetic.formats import Format
from viscopade.collision.exact import Exact
from viscopade.kernels import certificate, formulas
from viscopade.kernels.arithmetic import Arithmetic
from viscopade.kernels.bound import ErrorBound
from viscopade.kernels.certificate import Certificate
from viscopade.kernels.coefficients import (
    ProvenQuotient,
    accuracy_name,
    bounds_on_machines,
    checked_accuracy,
    first_accurate,
    powers_text,
    proven_quotient,
    sampled_candidates,
)
from viscopade.kernels.enclosure import Formula
from viscopade.kernels.expressions import CodeBranch, Name, Statement, both
from viscopade.kernels.formulas import ONE, ZERO
from viscopade.kernels.kernel import Function, Kernel
from viscopade.kernels.rounding_bounds import (
    BITS,
    DIGITS,
    Values,
    largest_bound,
    log_error,
    parts_from,
    power_of_two_below_root,
    powers_error,
    relative_error,
    results_on_parts,
)
from viscopade.store import recorded

LEAST = Fraction("3.5e-8")
"""Accuracy that the best kernel reaches."""


def inverse(accuracy: Exact) -> Kernel:
    """Return the kernel for v*(eps) with the fewest coefficients and a proven error within the accuracy.

    Parameters
    ----------
    accuracy : str, int, float, Fraction, Decimal, mpmath.mpf or NumPy scalar
        Relative error of v*, from 3.5e-8 to 0.99, for type double and with rounding.

    Raises
    ------
    TypeError, ValueError
        If the argument is not of this kind.
    """
    wanted = checked_accuracy(accuracy, LEAST, "inverse")
    powers = inverse_powers(wanted)
    found, name, domain = inverse_fit(powers), f"inverse_{accuracy_name(wanted)}", "0 < eps <= 1"
    text = f"v* = y^{SHIFT} N/D, y = ((1 - eps)/eps)^({ROOT}), {powers_text(powers)}"
    source = "best N/D in the relative error of v*"
    head = {"name": name, "kind": "inverse", "root": str(ROOT), "top": powers.top, "bottom": powers.bottom}
    rounding = {form.name: _sizes(found, form) for form in found.formats}
    return Kernel(
        name, name, "epsilon", text, source, domain, _functions(powers),
        {form.name: formulas.constants(powers, *found.rounded(form)) for form in found.formats},
        found.bounds, missing=found.missing,
        record={
            **head, "formula": text, "domain": domain, "measure": "speed", "variants": found.variants(rounding),
            "missing": found.missing, "source": source,
        },
        proofs=(found.proof(head, rounding),),
    )  # fmt: skip


def _sizes(found: ProvenQuotient, form: Format) -> dict[str, dict[str, str]]:
    """Return what rounding adds, relative to the formula's value."""
    bounds = {result: found.bound(result, form) for result in ("v_star", "beta")}
    return {
        result: {"relative": at_most(b.rounding / (1 + b.formula), DIGITS), "underflow": "0"}
        for result, b in bounds.items()
    }


def _functions(powers: Powers) -> tuple[Function, ...]:
    """Return v* of eps or of 1 - eps, and beta of eps and a speed."""
    epsilon, given, speed = Name("epsilon"), Name("one_minus_epsilon"), Name("speed")
    of_epsilon, of_loss = both(epsilon > ZERO, epsilon <= ONE), both(given >= ZERO, given < ONE)
    branches = tuple(
        CodeBranch(
            branch.guard,
            (*branch.program, Statement("v_star", branch.results["v_star"])),
            {"v_star": Name("v_star"), "beta": formulas.beta_branch().results["beta"]},
        )
        for branch in formulas.inverse_branches(powers)
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


# --- fits -------------------------------------------------------------------------------------------------------------


@recorded("inverse powers")
def inverse_powers(wanted: Fraction) -> Powers:
    """Return the powers of the kernel with the fewest coefficients that is proven to be accurate enough."""
    candidates = sampled_candidates(approximants.BEST, approximants.fit_inverse)
    return first_accurate(wanted, candidates, lambda powers: inverse_fit(powers).error("v_star"))


@recorded("inverse")
def inverse_fit(powers: Powers) -> ProvenQuotient:
    """Return the best kernel with given powers; errors as for `inverse.fit_inverse`."""
    best = approximants.fit_inverse(powers).quotient
    a, b = (tuple(map(float, values)) for values in (best.a, best.b))
    proof = certificate.prove_inverse(inverse_formula(best))
    return proven_quotient(
        a, b, proof, lambda form: bounds_on_machines(form, lambda machine: _bounds(powers, a, b, proof, machine))
    )


def inverse_formula(found: LacunaryQuotient) -> Formula:
    """Return v* = y^5 N/D, with N and D lacunary in y = ((1 - eps)/eps)^(1/10), as proofs read it; `power` is 5."""
    near, far = formulas.inverse_branches(found.powers)
    return Formula(SHIFT, near, far, formulas.constants(found.powers, found.a, found.b))


# --- rounding ---------------------------------------------------------------------------------------------------------


def _bounds(powers: Powers, a: Values, b: Values, proof: Certificate, machine: Arithmetic) -> Iterator[ErrorBound]:
    """Yield the bounds of v* and beta, which is v*^2 times a factor."""
    of_beta = (1 + proof.bound) ** 2 - 1
    sizes = inverse_rounding(powers, a, b, machine)
    for result, error in (("v_star", proof.bound), ("v_star_from_loss", proof.bound), ("beta", of_beta)):
        size = sizes[result.removesuffix("_from_loss")] * (1 + error)
        yield ErrorBound(result, proof.low, proof.high, "value", error, size, arithmetic=machine)


def inverse_rounding(powers: Powers, a: Values, b: Values, machine: Arithmetic) -> dict[str, Fraction]:
    """Bound the rounding errors of v_star and beta, relative to the formula's value; nothing underflows there.

    The quotient of 1 - eps and eps has two roundings. (Where it is subnormal, the larger of eps and 1 - eps is
    rounded to 1, and the quotient's error is smaller than that.)

    Raises
    ------
    ArithmeticError
        If a sum may vanish.
    """
    with working(BITS):
        unit = arb(2) ** -machine.form.precision
        branches = dict(zip("yu", formulas.inverse_branches(powers), strict=True))

        def of_root(variable: str, y: arb) -> arb:
            log = abs(y.log()) / ball_of(ROOT)
            return log_error(
                powers_error(branches[variable], variable, machine, {"epsilon": 0, "loss": unit}, log, ROOT)
            )

        start = power_of_two_below_root(machine.form.smallest, ROOT)
        numbers = formulas.constants(powers, a, b)
        on_branches = (
            results_on_parts(branch, ("v_star",), variable, numbers, machine, log_error=partial(of_root, variable))
            for variable, branch in branches.items()
        )
        parts = [*parts_from(start, Fraction(1))]
        relative = max(largest_bound(on, parts, relative_error("v_star")) for on in on_branches)
        beta = powers_error(formulas.beta_branch(), "beta", machine, {"speed": 0, "v_star": relative})
        return {"v_star": rounded_up(relative, DIGITS), "beta": rounded_up(beta, DIGITS)}
