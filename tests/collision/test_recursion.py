"""The recursion for Taylor coefficients: C and Python return the same integers."""

import random

import pytest

from viscopade.collision import recursion
from viscopade.collision.recursion import Recursion

needs_extension = pytest.mark.skipif(recursion.extension is None, reason="the extension was not built")

# r^common, r^e, r^v: the paper's law, and laws that need odd powers, many of them, or none.
POWERS = [(2, 2, 0), (0, 0, 0), (0, 1, 0), (1, 0, 1), (4, 0, 3), (3, 11, 0), (6, 0, 13), (0, 255, 0)]


def signed(generator: random.Random, bits: int) -> int:
    """Return a number of either sign and any length, often at an end of a digit's range."""
    length = generator.randint(0, bits)
    return generator.choice((-1, 1)) * generator.choice((generator.getrandbits(length), 1 << length, (1 << length) - 1))


def random_case(generator: random.Random, most_bits: int, most_terms: int) -> tuple[Recursion, int]:
    """Return a recursion of numbers of any length, of size 1 or less, and how many terms to compute."""
    bits = generator.choice((generator.randint(1, 120), generator.randint(1, most_bits)))
    constants = []
    for _ in range(2):
        mantissa = signed(generator, most_bits)
        constants.append((mantissa, -mantissa.bit_length() - generator.choice((0, 1, 2, 50, 1000, 10**6))))
    start, slope = signed(generator, bits), signed(generator, bits)
    return Recursion(start, slope, *constants, generator.choice(POWERS), bits), generator.randint(2, most_terms)


def check_random_cases(seed: int, number: int, most_bits: int, most_terms: int) -> None:
    """Compare; most numbers fit, and few coefficients are computed in Python."""
    generator = random.Random(seed)
    compared = 0
    for _ in range(number):
        case, terms = random_case(generator, most_bits, most_terms)
        found = case.compiled(terms)
        assert found in (None, case.in_python(terms)), (case, terms)
        compared += found is not None
    assert compared > number // 2, compared


@needs_extension
@pytest.mark.parametrize("most_bits", [60, 400, 3000])
def test_c_and_python_return_the_same_integers(most_bits):
    check_random_cases(most_bits, 300, most_bits, 40)


def test_numbers_that_grow_too_long_for_c_are_pythons():
    case = Recursion(0, 0, (1, 40), (-3, -1), (2, 2, 0), 100)
    growing = case._replace(elastic=(1 << 40, 0))
    assert case.compiled(9) is growing.compiled(9) is None
    assert growing.coefficients(9) == growing.in_python(9)
    assert case.coefficients(3) == [0, 0, 1 << 139]
