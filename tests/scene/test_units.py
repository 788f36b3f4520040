"""Numbers in other units: quantities as text, pressures at the ends of double precision, v* of a pair."""

from decimal import Decimal
from fractions import Fraction

import pytest
from hypothesis import given
from hypothesis import strategies as st

from viscopade import Pair, Sphere
from viscopade.quantity import DIMENSIONS, quantity
from viscopade.records import Node
from viscopade.scene.units import Scale
from viscopade.simulators.setup import NamedContact

BALL = Sphere(radius=0.01, mass=1e-3, young_modulus=1e9, poisson_ratio=0.25, dissipative_constant=1e-5)
UNITS = [(dimension, unit) for dimension, units in DIMENSIONS.items() for unit in units]


@given(st.floats(1e-30, 1e30), st.sampled_from(UNITS))
def test_a_quantity_of_17_digits_is_read_back_to_the_bit(value, unit):
    dimension, name = unit
    size = Decimal(repr(quantity(Node("trip", "", f"1 {name}"), dimension)))
    assert quantity(Node("trip", "", f"{Decimal(value) / size:.16e} {name}"), dimension) == value


@pytest.mark.parametrize(
    "units", [(1e-60, 1e-200, 1e-125), (3e9, 7e-8, 8e-159), (1e100, 1e250, 1e160), (1e-2, 1e-3, 1.0)]
)
def test_a_pressure_in_any_units_is_right_where_it_is_a_double(units):
    """Y L T^2 may underflow on the way, or T^2 overflow."""
    length, mass, time = map(Fraction, units)
    assert Scale(*units)._pressure(1e9) == pytest.approx(float(10**9 * length * time**2 / mass), rel=1e-15, abs=0)


def test_a_pressure_beyond_double_precision_is_refused():
    with pytest.raises(ValueError, match="young_modulus is inf"):
        Scale(1.0, 1.0, 1e200).sphere(BALL)


@given(*[st.floats(-30, 30)] * 3, st.floats(1e-6, 1e3))
def test_a_contact_in_other_units_is_the_same_collision(length, mass, time, speed):
    """0.1 and 0.4 are no binary numbers: their errors count times the logarithms of the numbers."""
    scale = Scale(10**length, 10**mass, 10**time)
    contact = NamedContact("a", "b", Pair(BALL, BALL), speed, speed, speed, ())
    found = scale.contact(contact)
    assert found.fastest == pytest.approx(speed / 10 ** (length - time), rel=1e-12)
    assert found.pair.v_star(found.typical) == pytest.approx(contact.pair.v_star(speed), rel=2e-14, abs=0)
    lasting = contact.pair.contact_time(speed) / 10**time
    assert found.pair.contact_time(found.typical) == pytest.approx(lasting, rel=2e-13, abs=0)


@pytest.mark.parametrize(
    ("text", "seconds"), [("1/60 s", 1 / 60), ("1/60s", 1 / 60), ("3/4 ms", 0.75e-3), ("0/5 s", 0)]
)
def test_a_fraction_of_a_unit_is_a_quantity(text, seconds):
    assert quantity(Node("trip", "", text), "time", zero=True) == seconds


@pytest.mark.parametrize("text", ["1/60", "1/0 s", "1/2/3 s", "1/1e3 s", "1/2.5 s", "/60 s", "-1/60 s"])
def test_other_fractions_are_refused(text):
    with pytest.raises(ValueError, match="expected a time"):
        quantity(Node("trip", "", text), "time")
