"""Prove the kernels that stand ready for every scene, and write the package's record of them:  COMMAND ."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from fractions import Fraction

from viscopade.arithmetic.decimals import at_most
from viscopade.arithmetic.formats import DOUBLE, FLOAT, Format
from viscopade.generated import MARKER
from viscopade.kernels import formulas, full, prove_lacunary
from viscopade.kernels.expressions import simple_operations
from viscopade.kernels.forms import table_free
from viscopade.kernels.forms.lacunary_kernels import HalfLineKernel, LacunaryVariant
from viscopade.kernels.forms.table_free import COMMON, DEVICE, LIBRARY, SHADER, MachineArithmetic
from viscopade.kernels.kernel import Kernel
from viscopade.kernels.names import COMPACT, FAST, FULL
from viscopade.kernels.registry import HOST, Entry, Kind
from viscopade.kernels.speed_table import LAST_ULPS, TABLES, in_table, speed_table
from viscopade.kernels.targets.table_free import name_of
from viscopade.kernels.v_star import of_v_star

COMMAND = "python -m tools.registry > src/viscopade/data/registry.csv"
PLACES = 3
# In half units in the last place, what the last operations do; products of roundings are less than `_SECOND_ORDER`.
_SUM_AND_QUOTIENT = 2  # elastic/(elastic + lost)
_FROM_TABLE = 2 * LAST_ULPS
_FROM_EPSILON = 4  # loss (2 - loss), or (1 - eps) (1 + eps) with the roundings of its quotients, which `inside` has
_SECOND_ORDER = 1 + Fraction(1, 1 << 10)
MACHINES = {
    (HOST, DOUBLE): LIBRARY[DOUBLE.name],
    (HOST, FLOAT): LIBRARY[FLOAT.name],
    ("device", FLOAT): DEVICE,
    ("shader", FLOAT): SHADER,
}
"""By place and type, the arithmetic of compact kernels; in type double the device is like the host."""
ALSO = {"device": (HOST, FLOAT)}
"""Where functions of a place may be called, too: those in CUDA are for the host as well."""


def computed() -> Iterator[Entry]:
    """Prove everything anew."""
    for tier, size in TABLES:
        yield from _of_speed(tier, size)
    for accuracy in COMPACT:
        yield from _of_compact_kernel(accuracy, prove_lacunary.half_line_kernel(accuracy))
    error = max(map(full.largest_ulp, full.FUNCTIONS)) * _ulp(DOUBLE)
    yield _everywhere("full", FULL, DOUBLE, error, _operations_of_full(), full.full().bytes)
    for form in (DOUBLE, FLOAT):
        yield _everywhere("v*", "", form, of_v_star(form))


def _operations_of_full() -> int:
    """Return the number of operations of eps to the last place."""
    epsilon = full.full().function("epsilon")
    (branch,) = epsilon.branches
    return simple_operations((*epsilon.start, *branch.program), branch.results["epsilon"])


def _everywhere(kind: Kind, tier: str, form: Format, error: Fraction, operations: int = 0, size: int = 0) -> Entry:
    bound = at_most(error, PLACES)
    rest = ("0", "inf", bound, bound, *_last(kind, form), "")
    return Entry(kind, tier, FAST, kind, HOST, form.name, size, operations, *rest)


def _last(kind: str, form: Format) -> tuple[str, str]:
    """Return what the last roundings add to eps and to 1 - eps^2: for compact kernels see `_of_compact`."""
    # Tables end with one sum; in type double what is used beyond them ends with two operations.
    last = 1 if kind == "full" or (kind == "speed" and form == FLOAT) else _SUM_AND_QUOTIENT
    of_loss = _FROM_TABLE if kind == "speed" else _FROM_EPSILON
    if kind == "v*":
        last = of_loss = 0
    return at_most(last * _half_ulp(form), PLACES), at_most(of_loss * _half_ulp(form), PLACES)


def _half_ulp(form: Format) -> Fraction:
    return _ulp(form) / 2 * _SECOND_ORDER


def _ulp(form: Format) -> Fraction:
    """Return the largest size of a unit in the last place, relative to the number."""
    return Fraction(2) ** (1 - form.precision)


def _of_speed(tier: str, size: str) -> Iterator[Entry]:
    kernel = speed_table(tier, size)
    # In v*, rounded inwards: w itself is rounded.
    low, high = (2.0 ** (e / 10) for e in (TABLES[tier, size].first, TABLES[tier, size].first + 128))
    formula = max(bound.formula for bound in kernel.bounds if bound.result == "restitution")
    for form in (DOUBLE, FLOAT):
        function = kernel.function("restitution")
        (branch,) = function.branches
        assert branch.guard is not None
        program = (*function.start, *branch.program)
        bound = in_table(kernel, "rebound" if tier == FULL else "restitution", form)
        yield Entry(
            "speed",
            tier,
            size,
            kernel.name,
            HOST,
            form.name,
            kernel.bytes,
            simple_operations(program, branch.guard, branch.results["restitution"]),
            f"{low * 1.01:.3g}",
            f"{high * 0.99:.3g}",
            at_most(bound.relative, PLACES),
            at_most(max(bound.relative, _beyond(kernel)), PLACES),
            *_last("speed", form),
            "" if tier == FULL else at_most(formula),
        )


def _beyond(kernel: Kernel) -> Fraction:
    """Return the bound of the kernel that is used outside the table, always in type double."""
    assert kernel.elsewhere is not None
    sizes = (b.relative + b.last + b.ulps * _ulp(DOUBLE) for b in kernel.elsewhere.bounds)
    return _both(max(sizes), of_v_star())


def _both(first: Fraction, second: Fraction) -> Fraction:
    """Return the bound of two relative errors, one after the other."""
    return (1 + first) * (1 + second) - 1


def _of_compact_kernel(accuracy: str, given: HalfLineKernel) -> Iterator[Entry]:
    program = table_free.table_free_program(given.powers)
    operations = simple_operations((*formulas.w_program(), *program.common), program.results["restitution"])
    for (place, form), machine in MACHINES.items():
        machines = [machine, MACHINES[ALSO[place]]] if place in ALSO else [machine]
        for variant in given.variants:
            if variant.form == form:
                yield _of_compact(accuracy, given, variant, place, machines, operations)


def _of_compact(
    accuracy: str,
    given: HalfLineKernel,
    variant: LacunaryVariant,
    place: str,
    machines: Sequence[MachineArithmetic],
    operations: int,
) -> Entry:
    """Return the entry of a kernel that may run on any of some machines."""
    formula = variant.error
    everywhere = common = of_epsilon = of_loss = Fraction(0)
    for machine in machines:
        found = table_free.rounding_bounds(given.powers, variant.a, variant.b, machine)
        first, second = (
            max(Fraction(found["restitution"][i]), Fraction(3, 2) * Fraction(found["dissipation"][i])) for i in (0, 1)
        )
        everywhere, common = max(everywhere, _both(formula, first)), max(common, _both(formula, second))
        # elastic/(elastic + lost); lost inverse (1 + elastic inverse), inverse = 1/(elastic + lost): the term with the
        # second inverse is at most half of the sum.
        unit = Fraction(2) ** -machine.model.precision
        quotient = unit + machine.quotient * machine.ulp
        of_epsilon = max(of_epsilon, quotient * _SECOND_ORDER)
        of_loss = max(of_loss, (Fraction(3, 2) * quotient + Fraction(7, 2) * unit) * _SECOND_ORDER)
    low, high = map(str, map(float, COMMON)) if variant.form == FLOAT else ("0", "inf")
    inside = common if variant.form == FLOAT else everywhere
    errors = [at_most(error, PLACES) for error in (inside, everywhere, of_epsilon, of_loss)]
    texts = [low, high, *errors, at_most(given.bound.bound)]
    return Entry("compact", accuracy, FAST, name_of(given), place, variant.form.name, 0, operations, *texts)


def main() -> None:
    """Print the table."""
    print(f"# {MARKER}: {COMMAND}")
    print("# Kernels that stand ready, with proven bounds of their errors.")
    print(",".join(Entry.__dataclass_fields__))
    for entry in computed():
        print(",".join(str(value) for value in vars(entry).values()))


if __name__ == "__main__":
    main()
