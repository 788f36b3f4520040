"""Inverse kernels: v* = y^5 N/D of eps, y = ((1 - eps)/eps)^(1/10), by lacunary polynomials, and beta, with proofs.

ROOT = 1/10 and SHIFT = 5 are the exponents in this formula: 1 - eps goes like v*^2 at 0, so that y^5 goes like v*.
Balls have BITS = 128 bits, far more than a double, and bounds of rounding are rounded up to DIGITS = 2 digits, which
widens them by at most 10 %.

N and D are polynomials with few powers of y; `exponents` are these powers, a and b the coefficients of N and D. For
eps < 1/2 programs use u = 1/y, so that nothing overflows. `form` is the number format, float or double; `machine` adds
what is assumed of the functions of its library, in ulp.
"""

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

BEST_ACCURACY = Fraction("3.5e-8")
"""The smallest relative error of v* that may be asked for: the kernel with most coefficients is proven to reach it.

The largest one, 0.99, is a matter of taste: with an error of 1 a kernel would say nothing.
"""


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
    limit = checked_accuracy(accuracy, BEST_ACCURACY, "inverse")
    exponents = inverse_powers(limit)
    quotient, name, domain = inverse_fit(exponents), f"inverse_{accuracy_name(limit)}", "0 < eps <= 1"
    text = f"v* = y^{SHIFT} N/D, y = ((1 - eps)/eps)^({ROOT}), {powers_text(exponents)}"
    source = "best N/D in the relative error of v*"
    head = {"name": name, "kind": "inverse", "root": str(ROOT), "top": exponents.top, "bottom": exponents.bottom}
    # What rounding adds in each format, as a checker reads it: relative to the formula's value, which is at most
    # 1 + formula times the exact one. Nothing underflows (`inverse_rounding`).
    rounding = dict[str, dict[str, dict[str, str]]]()
    for form in quotient.formats:
        bounds = {result: quotient.bound(result, form) for result in ("v_star", "beta")}
        rounding[form.name] = {
            result: {"relative": at_most(bound.rounding / (1 + bound.formula), DIGITS), "underflow": "0"}
            for result, bound in bounds.items()
        }
    return Kernel(
        name, name, "epsilon", text, source, domain, _functions(exponents),
        {form.name: formulas.constants(exponents, *quotient.rounded(form)) for form in quotient.formats},
        quotient.bounds, missing=quotient.missing,
        record={
            **head, "formula": text, "domain": domain, "measure": "speed", "variants": quotient.variants(rounding),
            "missing": quotient.missing, "source": source,
        },
        proofs=(quotient.proof(head, rounding),),
    )  # fmt: skip


def _functions(exponents: Powers) -> tuple[Function, ...]:
    """Return v* of eps or of 1 - eps, and beta of eps and a speed, from N/D with these exponents of y."""
    epsilon, one_minus_epsilon, speed = Name("epsilon"), Name("one_minus_epsilon"), Name("speed")
    epsilon_accepted = both(epsilon > ZERO, epsilon <= ONE)
    loss_accepted = both(one_minus_epsilon >= ZERO, one_minus_epsilon < ONE)
    # All three have the same two branches, eps >= 1/2 and eps < 1/2, in `epsilon` and `loss`; beta = v*^2/speed^(1/5).
    branches = tuple(
        CodeBranch(
            branch.guard,
            (*branch.program, Statement("v_star", branch.results["v_star"])),
            {"v_star": Name("v_star"), "beta": formulas.beta_branch().results["beta"]},
        )
        for branch in formulas.inverse_branches(exponents)
    )
    # From the argument, `epsilon` and `loss`: a loss that is an argument keeps all digits near eps = 1.
    from_epsilon = (Statement("loss", ONE - epsilon),)
    from_loss = (Statement("epsilon", ONE - one_minus_epsilon), Statement("loss", one_minus_epsilon))
    return (
        Function(
            "v_star", ("epsilon",), "v* at which eps is epsilon", epsilon_accepted, from_epsilon, branches, "v_star"
        ),
        Function(
            "v_star_from_loss", ("one_minus_epsilon",), "v* at which 1 - eps is one_minus_epsilon", loss_accepted,
            from_loss, branches, "v_star",
        ),
        Function(
            "beta", ("epsilon", "speed"), "beta at which eps is epsilon at a speed",
            both(epsilon_accepted, speed > ZERO), from_epsilon, branches, "beta",
        ),
    )  # fmt: skip


# --- fits -------------------------------------------------------------------------------------------------------------


@recorded("inverse powers")
def inverse_powers(accuracy: Fraction) -> Powers:
    """Return the powers of y in the kernel with the fewest coefficients that is proven to be accurate enough.

    The accuracy is the largest relative error of v* in type double, with rounding.
    """
    candidates = sampled_candidates(approximants.BEST, approximants.fit_inverse)
    return first_accurate(accuracy, candidates, lambda exponents: inverse_fit(exponents).error("v_star"))


@recorded("inverse")
def inverse_fit(exponents: Powers) -> ProvenQuotient:
    """Return the best kernel with these exponents of y, and its bounds; errors as for `inverse.fit_inverse`."""
    # The best coefficients, which the fit has rounded to doubles: so the certificate, of the formula with exact
    # operations, is that of the program's coefficients.
    best = approximants.fit_inverse(exponents).quotient
    a, b = (tuple(map(float, values)) for values in (best.a, best.b))
    proof = certificate.prove_inverse(inverse_formula(best))
    return proven_quotient(
        a, b, proof, lambda form: bounds_on_machines(form, lambda machine: _bounds(exponents, a, b, proof, machine))
    )


def inverse_formula(quotient: LacunaryQuotient) -> Formula:
    """Return v* = y^5 N/D, with N and D lacunary in y = ((1 - eps)/eps)^(1/10), as proofs read it; `power` is 5."""
    near, far = formulas.inverse_branches(quotient.powers)
    coefficients = formulas.constants(quotient.powers, quotient.a, quotient.b)
    # 1 - eps goes like v*^2 at 0, so that y = ((1 - eps)/eps)^(1/10) goes like the fifth root of v*, in which the
    # formula is smooth.
    return Formula(SHIFT, near, far, coefficients)


# --- rounding ---------------------------------------------------------------------------------------------------------


def _bounds(exponents: Powers, a: Values, b: Values, proof: Certificate, machine: Arithmetic) -> Iterator[ErrorBound]:
    """Yield the relative bounds of v* and beta on a machine, where `proof` bounds the formula's error of v*.

    The formula has these exponents of y and coefficients a and b.
    """
    # beta = v*^2/speed^(1/5): an error of v* counts twice, 1 + error of beta = (1 + error of v*)^2.
    beta_error = (1 + proof.bound) ** 2 - 1
    sizes = inverse_rounding(exponents, a, b, machine)
    for result, error in (("v_star", proof.bound), ("v_star_from_loss", proof.bound), ("beta", beta_error)):
        # Rounding is relative to the formula's value, at most 1 + error times the exact one. v_star_from_loss has the
        # same operations as v_star.
        size = sizes[result.removesuffix("_from_loss")] * (1 + error)
        yield ErrorBound(result, proof.low, proof.high, "value", error, size, arithmetic=machine)


def inverse_rounding(exponents: Powers, a: Values, b: Values, machine: Arithmetic) -> dict[str, Fraction]:
    """Bound the rounding errors of v_star and beta, relative to the formula's value; nothing underflows there.

    The formula has these exponents of y and coefficients a and b; `machine` says what is assumed of pow and sqrt.

    The quotient of 1 - eps and eps has two roundings. (Where it is subnormal, the larger of eps and 1 - eps is
    rounded to 1, and the quotient's error is smaller than that.)

    Raises
    ------
    ArithmeticError
        If a sum may vanish.
    """
    with working(BITS):
        # The first of the two roundings is that of 1 - eps (or of eps = 1 - loss), relative to it.
        unit = arb(2) ** -machine.form.precision
        branches = dict(zip("yu", formulas.inverse_branches(exponents), strict=True))

        def error_of_root(variable: str, root: arb) -> arb:
            """Bound the error of ln y, or of ln u = -ln y, on an interval of it."""
            # y = q^(1/10), |ln q| = 10 |ln y|. The exponent 0.1 is no binary number: ln y errs by |its error| |ln q|.
            log_q = abs(root.log()) / ball_of(ROOT)
            errors: dict[str, arb | int] = {"epsilon": 0, "loss": unit}
            return log_error(powers_error(branches[variable], variable, machine, errors, log_q, ROOT))

        # In its branch q = (1 - eps)/eps or 1/q is at most 1, and at least the smallest positive number (1 - eps = 0
        # gives 0 exactly): y or u goes from the tenth root of that to 1.
        start = power_of_two_below_root(machine.form.smallest, ROOT)
        coefficients = formulas.constants(exponents, a, b)
        branch_walks = (
            results_on_parts(
                branch, ("v_star",), variable, coefficients, machine, log_error=partial(error_of_root, variable)
            )
            for variable, branch in branches.items()
        )  # fmt: skip
        parts = [*parts_from(start, Fraction(1))]
        relative = max(largest_bound(results_on, parts, relative_error("v_star")) for results_on in branch_walks)
        # beta = v*^2/pow(speed, 0.2), from a v* with that error and an exact speed.
        beta = powers_error(formulas.beta_branch(), "beta", machine, {"speed": 0, "v_star": relative})
        return {"v_star": rounded_up(relative, DIGITS), "beta": rounded_up(beta, DIGITS)}
