"""Arguments of every public callable: units, masks, and the containers of pandas and xarray."""

import math
import re
from decimal import Decimal
from fractions import Fraction
from pathlib import Path

import numpy as np
import pytest

import viscopade as vp
from viscopade.arguments import UNITS
from viscopade.collision import spheres
from viscopade.fitting import bounces
from viscopade.fitting.flight import Flight
from viscopade.fitting.tracks import of_track
from viscopade.kernels import native

BALL = {"radius": 0.01, "density": 1000.0, "young_modulus": 1e7, "poisson_ratio": 0.45, "dissipative_constant": 1e-4}
PAIR = vp.Pair(vp.Sphere(**BALL), vp.Sphere(**BALL))
LAW = vp.Law("3/2", "1/2")
CURVE = vp.curve("linear")
HEAVY = {**BALL, "mass": 0.1}
del HEAVY["density"]
MEASURED = {"speed": [0.1, 0.3, 1.0], "epsilon": [0.9, 0.8, 0.7], "sigma_epsilon": [0.01] * 3}
MEASURED |= {"sigma_speed": [0.01] * 3, "contact_time": [1e-3] * 3}
FIT = vp.fit(vp.Points.measured(MEASURED["speed"], MEASURED["epsilon"]))


def sphere(others, name):
    def of(value):
        ball = vp.Sphere(**{**others, name: value})
        return [ball.radius, ball.mass, ball.density, ball.young_modulus, ball.poisson_ratio, ball.dissipative_constant]

    return of


def numbers(collision):
    return [*collision.floats().values()]


def points(name):
    def of(value):
        given = {**MEASURED, name: value}
        found = vp.Points.measured(given.pop("speed"), given.pop("epsilon"), **given)
        errors = [found.speed_errors.toarray(), found.epsilon_errors.toarray()]
        return np.concatenate([np.ravel(part) for part in (found.speed, found.epsilon, found.contact_time, *errors)])

    return of


def linear(c):
    return lambda x, v: 1e5 * x + c * v


def damped(c):
    return vp.Contact(linear(c))


ACCELERATION, STIFFNESS, DAMPING = "m/s^2", "N/m^(3/2)", "N s/m^(3/2)"
# Of functions of arrays: the function of one argument, the argument's name, and a number that is accepted.
ARRAYS = {
    **{
        f"{owner}.{function}": (getattr(of, function), name, 0.7)
        for owner, of, name, functions in (
            ("double", vp.double, "v_star", "epsilon one_minus_epsilon x_max tau_c slope"),
            ("curve", CURVE, "kappa", "epsilon one_minus_epsilon x_max tau_c"),
            ("Pair", PAIR, "speed", "v_star epsilon one_minus_epsilon contact_time max_compression"),
            ("Pair", PAIR, "speed", "length_scale time_scale"),
        )
        for function in functions.split()
    },
    "epsilon": (vp.epsilon, "v_star", 0.7),
    "one_minus_epsilon": (vp.one_minus_epsilon, "v_star", 0.7),
    "double.v_star_from": (vp.double.v_star_from, "epsilon", 0.7),
    "double.v_star_from, loss": (lambda x: vp.double.v_star_from(one_minus_epsilon=x), "one_minus_epsilon", 0.7),
    "curve.kappa_from": (CURVE.kappa_from, "epsilon", 0.7),
    "restitution, speed": (lambda x: vp.restitution(x, 1.3), "speed", 0.7),
    "restitution, beta": (lambda x: vp.restitution(0.7, x), "beta", 0.7),
    "beta_from_restitution, speed": (lambda x: vp.beta_from_restitution(x, 0.5), "speed", 0.7),
    "beta_from_restitution, epsilon": (lambda x: vp.beta_from_restitution(0.5, x), "epsilon", 0.7),
    "Pair.speed": (PAIR.speed, "v_star", 0.7),
    "Pair.dissipative_constant": (PAIR.dissipative_constant, "beta", 0.7),
    "v_star, speed": (lambda x: spheres.v_star(x, 1.3), "speed", 0.7),
    "v_star, beta": (lambda x: spheres.v_star(0.7, x), "beta", 0.7),
    "speed_from_v_star": (lambda x: spheres.speed_from_v_star(0.7, x), "beta", 0.7),
    "speed_from_v_star, v_star": (lambda x: spheres.speed_from_v_star(x, 0.7), "v_star", 0.7),
    "beta_si_from_cgs": (spheres.beta_si_from_cgs, "beta", 0.7),
    "beta_cgs_from_si": (spheres.beta_cgs_from_si, "beta", 0.7),
    "pade": (vp.pade(3, 6), "v_star", 0.7),
}
NUMBERS = {
    **{f"Sphere, {name}": (sphere(BALL, name), name, value) for name, value in BALL.items()},
    "Sphere, mass": (sphere(HEAVY, "mass"), "mass", 0.1),
    "Pair.calibrated, speed": (lambda x: PAIR.calibrated(x, 0.5).A, "speed", 0.7),
    "Pair.calibrated, epsilon": (lambda x: PAIR.calibrated(0.5, x).A, "epsilon", 0.7),
    "Pair.damped": (lambda x: PAIR.damped(x).A, "dissipative_constant", 1e-4),
    "exact.collision": (lambda x: numbers(vp.exact.collision(x, 12)), "v_star", 0.5),
    "exact.collision, kappa": (lambda x: numbers(vp.exact.collision(kappa=x, digits=12)), "kappa", 0.5),
    "exact.collision, speed": (lambda x: numbers(vp.exact.collision(speed=x, beta=1, digits=12)), "speed", 0.5),
    "exact.collision, beta": (lambda x: numbers(vp.exact.collision(beta=x, speed=1, digits=12)), "beta", 0.5),
    "exact.epsilon": (lambda x: float(vp.exact.epsilon(x, 12)), "v_star", 0.5),
    "exact.one_minus_epsilon": (lambda x: float(vp.exact.one_minus_epsilon(x, 12)), "v_star", 0.5),
    "exact.invert": (lambda x: numbers(vp.exact.invert(x, 12)), "epsilon", 0.5),
    "exact.invert, loss": (lambda x: numbers(vp.exact.invert(one_minus_epsilon=x)), "one_minus_epsilon", 0.5),
    "exact.invert, speed": (lambda x: numbers(vp.exact.invert(0.5, 12, speed=x)), "speed", 0.5),
    "Law": (lambda x: float(vp.Law(x, 0).nu), "a", 1.5),
    "Law.kappa, speed": (lambda x: LAW.kappa(x, k=2.0, c=1.0, mass=1.0), "speed", 0.5),
    "Law.kappa, k": (lambda x: LAW.kappa(0.5, k=x, c=1.0, mass=1.0), STIFFNESS, 2.0),
    "Law.kappa, c": (lambda x: LAW.kappa(0.5, k=2.0, c=x, mass=1.0), DAMPING, 2.0),
    "Law.length_scale": (lambda x: LAW.length_scale(0.5, k=2.0, mass=x), "mass", 2.0),
    "Law.time_scale": (lambda x: LAW.time_scale(x, k=2.0, mass=1.0), "speed", 2.0),
    "DampingFit.epsilon": (FIT.epsilon, "speed", 0.5),
    "series": (lambda x: vp.series(x).order, "order", 4),
    "pade, m": (lambda x: vp.pade(x, 6).m, "m", 3),
    "Contact, mass": (lambda x: vp.Contact(linear(100.0), mass=x).collide(0.5).epsilon, "mass", 2.0),
    "Contact, load": (lambda x: vp.Contact(linear(100.0), load=x).collide(0.5).epsilon, "load", 9.8),
    "Contact.collide": (lambda x: vp.Contact(linear(100.0), load=9.8).collide(x).epsilon, "speed", 0.5),
    "Contact.collide, step": (lambda x: vp.Contact(linear(100.0)).collide(0.5, step=x).epsilon, "step", 1e-3),
    "Contact.collide, phase": (
        lambda x: vp.Contact(linear(100.0)).collide(0.5, step=1e-3, phases=x).epsilon,
        "phases",
        0.5,
    ),
    "Contact.of_law, kappa": (lambda x: vp.Contact.of_law("linear", x).collide().epsilon, "kappa", 0.5),
    "Contact.of_law, load": (lambda x: vp.Contact.of_law("linear", 0.5, x).collide().epsilon, "load", 0.1),
    "contact.damping_factor": (lambda x: vp.contact.damping_factor(damped, x, near=100.0), "epsilon", 0.5),
    "contact.damping_factor, near": (lambda x: vp.contact.damping_factor(damped, 0.5, near=x), "near", 100.0),
}
DROP, NAMES = np.array([0.0, 0.6, 1.1, 1.5]), ["1", "2", "3", "4"]
HIGH = np.array([1.0, 0.8, 0.6])


def rebounds(found):
    return np.concatenate([found.speed, found.epsilon, np.ravel(found.epsilon_errors.toarray())])


OF_TIMES, OF_HEIGHTS = bounces.of_times, bounces.of_heights
FRAMES_AT = np.arange(-40, 41) / 200  # a ball falls, rebounds at 0 with eps of 1/2, and rises
TRACK = np.abs(FRAMES_AT) * np.where(FRAMES_AT < 0, 2.0, 1.0) - Flight().gravity * FRAMES_AT**2 / 2
FRAMES = [f"line {k}" for k in range(len(TRACK))]
COLUMNS = {
    "of_times, instants": (lambda x: rebounds(OF_TIMES([(x, NAMES)], Flight())), "instants", DROP),
    "of_times, durations": (
        lambda x: rebounds(OF_TIMES([(DROP, NAMES)], Flight(), durations=[x])),
        "contact_time",
        [1e-3] * len(DROP),
    ),
    "audible_bounces": (lambda x: bounces.audible_bounces(x)[0], "instants", DROP),
    "of_heights, heights": (lambda x: rebounds(OF_HEIGHTS([(x, NAMES)], Flight())), "heights", HIGH),
    "of_track, time": (lambda x: of_track(x, TRACK, FRAMES, Flight()).points.epsilon, "instants", FRAMES_AT),
    "of_track, position": (lambda x: of_track(FRAMES_AT, x, FRAMES, Flight()).points.speed, "heights", TRACK),
}
NUMBERS |= {
    "of_times, sigma": (lambda x: rebounds(OF_TIMES([(DROP, NAMES)], Flight(), sigma=x)), "instants", 1e-3),
    "of_times, contact": (
        lambda x: rebounds(OF_TIMES([(DROP, NAMES)], Flight(), contact_time=x)),
        "contact_time",
        1e-3,
    ),
    "of_heights, sigma": (lambda x: rebounds(OF_HEIGHTS([(HIGH, NAMES)], Flight(), sigma=x)), "heights", 1e-3),
    "Flight, gravity": (lambda x: Flight(x).gravity, "gravity", 9.8),
    "Flight, terminal_speed": (lambda x: Flight(terminal_speed=x).terminal_speed, "terminal_speed", 9.8),
}
COLUMNS |= {f"Points.measured, {name}": (points(name), name, values) for name, values in MEASURED.items()}
CALLS = ARRAYS | NUMBERS | COLUMNS
WITHOUT_NUMBERS = {"backend", "get_include", "fit", "curve", "Pair", "Points"}


def test_every_public_callable_is_among_them():
    called = {re.split(r"[.,]", label)[0] for label in CALLS}
    public = {name for name in vp.__all__ if callable(getattr(vp, name))}
    assert public - WITHOUT_NUMBERS <= called
    for name in ("contact", "double", "exact"):
        page = Path(__file__).parents[1] / "docs" / "reference" / "python-api.md"
        listed = re.findall(rf"`vp\.({name}\.[a-z_]+)`", page.read_text())
        assert listed
        assert {*listed} <= {label.split(",")[0] for label in CALLS}


@pytest.fixture(scope="module", params=["astropy.units", "pint"])
def quantity(request):
    """Return a function of values, their unit and another one: the quantity in that one."""
    package = pytest.importorskip(request.param, reason=f"there is no Python package {request.param.split('.')[0]}")
    if request.param == "pint":
        registry = package.UnitRegistry()
        return lambda values, unit, shown: registry.Quantity(values, registry.Unit(unit)).to(shown)
    return lambda values, unit, shown: package.Quantity(values, unit).to(shown)


LIKE = {"m/s": "cm/s", "m": "mm", "kg": "g", "kg/m^3": "g/cm^3", "Pa": "GPa", "s": "us", ACCELERATION: "cm/s^2"}
LIKE |= {UNITS["beta"]: "s^(1/5)/cm^(1/5)", STIFFNESS: "N/cm^(3/2)", DAMPING: "N s/cm^(3/2)"}


def unit_of(name):
    return name if name in (STIFFNESS, DAMPING) else UNITS.get(name, "")


def values_of(call):
    """Return the values to call with: a number and an array, or what this call takes."""
    value = CALLS[call][2]
    return [value, np.array([value, value / 2])] if call in ARRAYS else [np.array(value) if call in COLUMNS else value]


@pytest.mark.parametrize("call", [label for label, (_, name, _) in CALLS.items() if unit_of(name)])
def test_a_quantity_is_converted(quantity, call):
    function, name, _ = CALLS[call]
    unit = unit_of(name)
    for values in values_of(call):
        given = quantity(values, unit, LIKE[unit])
        np.testing.assert_allclose(function(given), function(values), rtol=1e-12)
        if np.ndim(values):
            np.testing.assert_allclose(function(list(given)), function(values), rtol=1e-12)


@pytest.mark.parametrize("call", CALLS)
def test_another_dimension_is_refused(quantity, call):
    for values in values_of(call):
        given = quantity(values, "A", "mA")
        for bad in [given, list(given)] if np.ndim(values) else [given]:
            with pytest.raises(TypeError, match=r"^\w+ is .*: expected a (number without|quantity in .* number)"):
                CALLS[call][0](bad)


@pytest.mark.parametrize("call", [label for label in CALLS if label not in ("series", "pade, m")])
def test_a_number_without_a_dimension_passes(quantity, call):
    for values in values_of(call):
        np.testing.assert_allclose(CALLS[call][0](quantity(values, "", "")), CALLS[call][0](values), rtol=1e-14)


def test_a_force_with_a_unit_is_refused(quantity):
    contact = vp.Contact(lambda x, v: quantity(1e5 * x, "N", "kN"))
    for step in (None, 1e-3):
        with pytest.raises(TypeError, match=r"^force is .*: expected a number without a dimension$"):
            contact.collide(1.0, step=step)


def test_percent_is_a_number(quantity):
    assert pytest.approx(PAIR.calibrated(1.0, 0.5).A, rel=1e-14) == PAIR.calibrated(1.0, quantity(0.5, "", "percent")).A


# --- arrays, other types of numbers, and what is none -----------------------------------------------------------------


@pytest.mark.parametrize("call", ARRAYS)
def test_arrays_element_by_element(call):
    function = ARRAYS[call][0]
    for shape in ((0,), (7,), (3, 1, 2)):
        values = np.random.default_rng(1).uniform(0.1, 0.9, shape)
        given = values.copy()
        result = function(given)
        np.testing.assert_array_equal(given, values)  # untouched
        assert (result.shape, result.dtype) == (shape, np.float64)
        single = np.reshape([function(float(value)) for value in values.flat], shape)
        np.testing.assert_allclose(result, single, rtol=0 if call.startswith("double.") else 1e-15)
        np.testing.assert_array_equal(function(values.T), result.T)
        if result.size:
            np.testing.assert_array_equal(function(values.tolist()), result)


# All but `restitution`, a function of NumPy: it gives NaN, and refuses in NumPy's own words.
CHECKED = [label for label in ARRAYS if not label.startswith("restitution")]


@pytest.mark.parametrize("call", CHECKED)
def test_other_types_become_double(call):
    function = ARRAYS[call][0]
    for number in (1, Fraction(1, 2), Decimal("0.5"), np.float32(0.5), np.array(0.5)):
        assert type(function(number)) is float
        assert function(number) == function(float(number))
    for kind in (np.float32, np.longdouble, np.uint8, object):
        given = np.array([1, 1], kind) if kind is np.uint8 else np.array([0.25, 0.5], kind)
        assert function(given).dtype == np.float64
        np.testing.assert_array_equal(function(given), function(given.astype(float)))


@pytest.mark.parametrize("call", CHECKED)
def test_what_is_out_of_range_or_no_number_is_refused(call):
    function, name, value = ARRAYS[call]
    portion = name in ("epsilon", "one_minus_epsilon")  # None: the other one is given
    finite = call.startswith(("Pair.speed", "v_star", "speed_", "beta_si", "beta_cgs")) or name == "speed"
    for bad in (-1e-300, math.nan, -math.inf, *[math.inf] * finite, *[1 + 2**-52] * portion):
        for given in (bad, np.array([value, bad]), [Decimal(value), Decimal(bad)]):
            with pytest.raises(ValueError, match=rf"^{name} is .*: expected a (finite )?number >=? 0"):
                function(given)
    for bad in (True, "1", 1j, np.array(["1"]), [1.0, None], [[1.0], [1.0, 2.0]], *[None] * (not portion)):
        with pytest.raises(TypeError, match=rf"^{name} is .*: expected a (finite )?number >=? 0"):
            function(bad)


# --- masks ------------------------------------------------------------------------------------------------------------

HIDDEN = [-1.0, math.nan, math.inf, 1e300]


@pytest.mark.parametrize("call", ARRAYS)
@pytest.mark.parametrize("hidden", HIDDEN)
def test_a_masked_array_stays_masked_and_what_it_hides_is_not_looked_at(call, hidden):
    function, _, value = ARRAYS[call]
    result = function(np.ma.array([value, hidden, value / 2], mask=[0, 1, 0]))
    assert result.mask.tolist() == [False, True, False]
    np.testing.assert_array_equal(result.compressed(), function([value, value / 2]))
    assert function(np.ma.masked) is np.ma.masked
    whole = function(np.ma.array([value, value / 2]))
    assert isinstance(whole, np.ma.MaskedArray)
    assert not whole.mask.any()


def test_masks_of_two_arguments_are_joined():
    speed = np.ma.array([[0.5], [-1.0]], mask=[[0], [1]])
    beta = np.ma.array([1.0, math.nan], mask=[0, 1])
    result = spheres.v_star(speed, beta)
    assert result.mask.tolist() == [[False, True], [True, True]]
    assert result[0, 0] == spheres.v_star(0.5, 1.0)


def test_masked_points_are_left_out_and_counted():
    speed, epsilon = np.array([0.1, 0.3, 1.0, 3.0, 10.0]), np.array([0.938, 0.918, 0.901, 0.874, 0.3])
    outlier = [0, 0, 0, 0, 1]
    clean = vp.fit(vp.Points.measured(speed[:4], epsilon[:4]))
    for v, e in (
        (speed, np.ma.array(epsilon, mask=outlier)),
        (np.ma.array(speed, mask=outlier), epsilon),
        (speed, np.ma.array([*epsilon[:4], -5.0], mask=outlier)),
    ):
        found = vp.Points.measured(v, e)
        assert (len(found), found.masked) == (4, 1)
        assert found.labels == ("point 1", "point 2", "point 3", "point 4")
        fitted = vp.fit(found)
        assert fitted.beta == clean.beta == pytest.approx(0.0937, abs=1e-4)
        assert re.fullmatch(r"beta: 0\.09\d+ \+- \S+ \(time/length\).* holds.*\. 4 points, 1 masked\.", str(fitted))
    with pytest.raises(ValueError, match=r"^speed and epsilon have the shapes \(5,\) and \(4,\): expected one length$"):
        vp.Points.measured(np.ma.array(speed, mask=outlier), epsilon[:4])
    with pytest.raises(ValueError, match=r"^there are 2 labels: expected 5, one for each point$"):
        vp.Points.measured(speed, epsilon, labels=["a", "b"])
    first = vp.Points.measured(np.ma.array(speed, mask=[1, 0, 0, 0, 0]), epsilon, sigma_epsilon=0.01)
    assert first.labels[0] == "point 2"
    errors = np.ma.array([0.01] * 4 + [math.nan], mask=outlier)
    assert len(vp.Points.measured(speed, epsilon, sigma_epsilon=errors, sigma_speed=errors)) == 4
    assert vp.Points.measured(speed, epsilon, contact_time=errors).contact_time.tolist() == [0.01] * 4


@pytest.mark.parametrize("call", [*NUMBERS])
def test_a_masked_number_is_refused(call):
    with pytest.raises((TypeError, ValueError), match=r"^\w+ is masked: expected "):
        NUMBERS[call][0](np.ma.masked)


# --- pandas and xarray ------------------------------------------------------------------------------------------------


@pytest.fixture(params=["compiled", "numpy"])
def _backends(request, monkeypatch):
    if request.param == "numpy":
        monkeypatch.setattr(native, "_kernel", native.numpy_restitution)


@pytest.mark.usefixtures("_backends")
@pytest.mark.parametrize("call", ARRAYS)
def test_pandas_keeps_its_index(call):
    pandas = pytest.importorskip("pandas", reason="there is no Python package pandas")
    function, _, value = ARRAYS[call]
    series = pandas.Series([value, value / 2], index=["b", "a"], name="given")
    expected = function([value, value / 2])
    pandas.testing.assert_series_equal(function(series), pandas.Series(expected, index=series.index, name="given"))
    pandas.testing.assert_frame_equal(function(series.to_frame()), pandas.DataFrame({"given": expected}, series.index))


@pytest.mark.usefixtures("_backends")
@pytest.mark.parametrize("function", [vp.restitution, spheres.v_star, vp.beta_from_restitution])
def test_pandas_aligns_two_arguments(function):
    pandas = pytest.importorskip("pandas", reason="there is no Python package pandas")
    first, second = pandas.Series([0.3, 0.5], index=["a", "b"]), pandas.Series([0.9, 0.7], index=["b", "a"])
    expected = pandas.Series([function(0.3, 0.7), function(0.5, 0.9)], index=["a", "b"])
    pandas.testing.assert_series_equal(function(first, second), expected)


def test_columns_of_different_orders_are_no_points():
    pandas = pytest.importorskip("pandas", reason="there is no Python package pandas")
    frame = pandas.DataFrame({"v": [0.3, 0.1, 1.0], "eps": [0.8, 0.9, 0.7]})
    assert len(vp.Points.measured(frame.v, frame.eps)) == 3
    with pytest.raises(ValueError, match=r"^speed and epsilon have different indices: expected one index"):
        vp.Points.measured(frame.v.sort_values(), frame.eps)


@pytest.mark.usefixtures("_backends")
@pytest.mark.parametrize("call", ARRAYS)
def test_xarray_keeps_its_coordinates(call):
    xarray = pytest.importorskip("xarray", reason="there is no Python package xarray")
    function, name, value = ARRAYS[call]
    given = xarray.DataArray([value, value / 2], {"x": [1, 2]}, "x", name="given", attrs={"units": unit_of(name)})
    expected = xarray.DataArray(function([value, value / 2]), given.coords, "x", name="given")
    xarray.testing.assert_identical(function(given), expected)
    with pytest.raises(TypeError, match=rf"^{name} is .*: expected one variable of the data set$"):
        function(given.to_dataset())
    with pytest.raises(TypeError, match=rf"^{name} is .*furlong.*: expected "):
        function(given.assign_attrs(units="furlong"))


def test_quantities_in_containers(quantity):
    xarray = pytest.importorskip("xarray", reason="there is no Python package xarray")
    speeds = quantity(np.array([0.5, 1.0]), "m/s", "cm/s")
    expected = PAIR.epsilon([0.5, 1.0])
    np.testing.assert_allclose(PAIR.epsilon(np.array([*speeds], dtype=object)), expected, rtol=1e-14)
    if not isinstance(speeds, np.ndarray):  # xarray keeps Pint's, and takes away Astropy's unit
        given = xarray.DataArray(speeds, {"x": [1, 2]}, "x")
        for function in (PAIR.epsilon, lambda x: vp.restitution(x, PAIR.beta)):
            np.testing.assert_allclose(function(given).values, expected, rtol=1e-12)
        np.testing.assert_allclose(vp.Points.measured(given, [0.9, 0.8]).speed, [0.5, 1.0], rtol=1e-14)


def test_masked_quantities():
    units = pytest.importorskip("astropy.units", reason="there is no Python package astropy")
    from astropy.table import MaskedColumn
    from astropy.utils.masked import Masked

    mask = [False, True]
    for given in (Masked([50.0, -1] * units.cm / units.s, mask), MaskedColumn([50.0, -1], unit="cm/s", mask=mask)):
        result = PAIR.epsilon(given)
        assert result.mask.tolist() == mask
        assert result[0] == PAIR.epsilon(0.5)


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: vp.fit("1.5"), "points is '1.5': expected Points, such as vp.Points.measured(speed, epsilon)"),
        (lambda: vp.fit(None), "points is None: expected Points"),
        (lambda: vp.contact.damping_factor(3, 0.5, 1.0), "family is 3: expected a function that returns the Contact"),
        (lambda: vp.contact.damping_factor(lambda c: c, 0.5, 1.0), "the result of family is 1.0: expected a Contact"),
        (lambda: vp.Contact(linear(1.0), end=np.array(["force", "return"])), "end is array(['force', 'return']"),
    ],
)
def test_what_is_of_no_right_type_is_named_in_one_line(call, message):
    with pytest.raises((TypeError, ValueError), match=re.escape(message)) as refusal:
        call()
    assert "\n" not in str(refusal.value)
