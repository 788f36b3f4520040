"""Random balls of functions with members on their boundary, in exact rational arithmetic."""

from fractions import Fraction

from flint import fmpq_poly
from hypothesis import strategies as st

from viscopade.arithmetic.function_balls import FunctionBall, Wiener

BITS, TERMS = 40, 8
ALGEBRA = Wiener(BITS, TERMS)

coefficients = st.lists(st.integers(-(2**45), 2**45), min_size=1, max_size=TERMS)
elements = st.builds(ALGEBRA.element, coefficients, st.integers(0, 2**20))


def exact_norm(polynomial):
    return sum(abs(Fraction(int(c.p), int(c.q))) for c in polynomial.coeffs())


def as_polynomial(element):
    return fmpq_poly(element.polynomial.coeffs()) / (1 << BITS)


@st.composite
def members(draw, balls=elements):
    """A ball of functions, and a function on its boundary: all of the error in one coefficient."""
    element = draw(balls)
    index = draw(st.integers(0, 2 * TERMS))
    error = fmpq_poly([0] * index + [draw(st.sampled_from([-1, 1])) * element.error]) / (1 << BITS)
    return element, as_polynomial(element) + error


def assert_encloses(element: FunctionBall, function):
    distance = exact_norm(as_polynomial(element) - function)
    assert distance * (1 << BITS) <= element.error
