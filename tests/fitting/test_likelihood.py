"""Fits against other routes: SciPy's curve_fit, generalised least squares written out, and synthetic sets."""

import math

import numpy as np
import pytest
from scipy import integrate, optimize, stats

from viscopade.arrays import double
from viscopade.fitting import bounces, likelihood, verdict
from viscopade.fitting.flight import Flight
from viscopade.fitting.points import Points

VISCOELASTIC, CONSTANT, HUNT_CROSSLEY, FREE = verdict.MODELS
SPEED = np.geomspace(0.05, 3, 12)
BETA = 0.09


def law(speed, beta=BETA):
    return double.epsilon(np.sqrt(beta) * speed**0.1)


def noisy(seed, sigma=0.01, speed=SPEED):
    return law(speed) + sigma * np.random.default_rng(seed).standard_normal(len(speed))


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("known", [True, False])
def test_independent_errors_give_what_curve_fit_gives(seed, known):
    epsilon = noisy(seed)
    sigma = {"sigma_epsilon": 0.01} if known else {}
    fit = likelihood.fit_law(Points.measured(SPEED, epsilon, **sigma), VISCOELASTIC)
    best, covariance = optimize.curve_fit(
        law, SPEED, epsilon, p0=[0.1], sigma=np.full(12, 0.01), absolute_sigma=known, bounds=(0, 1)
    )
    unit = fit.middle**-0.2
    assert fit.parameters[0] * unit == pytest.approx(best[0], rel=1e-6)
    assert math.sqrt(fit.covariance[0, 0]) * unit == pytest.approx(math.sqrt(covariance[0, 0]), rel=1e-4)
    if not known:
        assert fit.scatter == pytest.approx(math.sqrt(np.sum((epsilon - law(SPEED, best[0])) ** 2) / 11), rel=1e-6)


def test_the_profile_is_nearly_that_of_the_covariance_if_errors_are_small():
    fit = likelihood.fit_law(Points.measured(SPEED, noisy(1, 1e-4)), VISCOELASTIC)
    for level in (0.68, 0.95):
        low, high = fit.interval(level)
        reach = fit.quantile(level) * math.sqrt(fit.covariance[0, 0])
        assert (high - low) / 2 == pytest.approx(reach, rel=1e-3)
        assert (high + low) / 2 == pytest.approx(fit.parameters[0], rel=1e-5)


def test_quantiles_are_those_of_student_unless_errors_are_known():
    free = likelihood.fit_law(Points.measured(SPEED, noisy(1)), VISCOELASTIC)
    known = likelihood.fit_law(Points.measured(SPEED, noisy(1), sigma_epsilon=0.01), VISCOELASTIC)
    assert free.quantile(0.95) == pytest.approx(stats.t.ppf(0.975, 11))
    assert known.quantile(0.95) == pytest.approx(1.95996, rel=1e-5)


def bounced(instants, sigma):
    return bounces.of_times([(instants, [str(i) for i in range(len(instants))])], Flight(9.81), sigma=sigma)


def times(speed, number):
    """Return the instants of bounces of a body without errors; `speed` is the first impact's."""
    found = [0.0]
    for _ in range(number):
        speed *= float(law(np.array([speed]))[0])
        found.append(found[-1] + 2 * speed / 9.81)
    return np.array(found)


def test_errors_of_successive_bounces_are_what_many_sets_show():
    clean, sigma = times(3.0, 6), 1e-4
    points = bounced(clean, sigma)
    assert points.epsilon == pytest.approx(law(points.speed), rel=1e-12)
    random = np.random.default_rng(3)
    spans = np.diff(clean + sigma * random.standard_normal((4000, 7)))
    shown = np.cov(np.hstack([9.81 / 2 * spans[:, :-1], spans[:, 1:] / spans[:, :-1]]).T)
    whole = np.vstack([points.speed_errors.toarray(), points.epsilon_errors.toarray()])
    expected = whole @ whole.T
    scale = np.sqrt(np.outer(np.diag(expected), np.diag(expected)))
    assert np.abs(shown - expected).max() < 0.06 * scale.max()
    assert (np.abs(shown - expected) < 0.08 * scale).all()
    assert expected[6, 7] < -0.5 * expected[6, 6]  # a rebound too fast is a fall too fast


def test_correlated_errors_give_what_generalised_least_squares_gives():
    """With the dense covariance, written out, linearised at the answer."""
    random, sigma = np.random.default_rng(5), 3e-4
    points = bounced(times(3.0, 9) + sigma * random.standard_normal(10), sigma)
    fit = likelihood.fit_law(points, VISCOELASTIC)
    b, h = fit.parameters[0], 1e-6

    def eps(speed, value):
        return double.epsilon(np.sqrt(value * fit.middle**-0.2) * speed**0.1)

    slope_v = (eps(points.speed * (1 + h), b) - eps(points.speed * (1 - h), b)) / (2 * h * points.speed)
    errors = points.epsilon_errors.toarray() - slope_v[:, None] * points.speed_errors.toarray()
    inverse = np.linalg.inv(errors @ errors.T + fit.scatter**2 * np.eye(len(points)))
    slope_b = (eps(points.speed, b + h) - eps(points.speed, b - h)) / (2 * h)
    information = slope_b @ inverse @ slope_b
    shift = slope_b @ inverse @ (points.epsilon - eps(points.speed, b)) / information
    assert abs(shift) < 1e-5 / math.sqrt(information)
    assert fit.covariance[0, 0] == pytest.approx(1 / information, rel=1e-5)


def test_hunt_crossley_is_the_closed_form():
    kappa = np.array([0.01, 0.5, 3.0])
    for k, epsilon in zip(kappa, HUNT_CROSSLEY.epsilon(kappa), strict=True):
        # kappa (1 + eps) = ln((1 + kappa)/(1 - kappa eps)), from the energy
        assert k * (1 + epsilon) == pytest.approx(math.log((1 + k) / (1 - k * epsilon)), rel=1e-9)


@pytest.mark.parametrize("model", verdict.MODELS, ids=lambda model: model.name)
def test_data_without_scatter_give_their_parameters_back(model):
    kappa = 0.1 * SPEED ** (0.4 if model.exponent is None else model.exponent)
    fit = likelihood.fit_law(Points.measured(SPEED, model.epsilon(kappa), sigma_epsilon=0.01), model)
    assert fit.parameters[0] * (SPEED / fit.middle) ** fit.exponent == pytest.approx(kappa, rel=1e-5)
    assert fit.chi2 < 1e-6


def test_robust_fits_leave_an_outlier_alone():
    epsilon = noisy(2, 0.002)
    spoiled = epsilon.copy()
    spoiled[4] -= 0.2
    clean, plain, robust = (
        likelihood.fit_law(Points.measured(SPEED, values), VISCOELASTIC, robust=of).parameters[0]
        for values, of in ((epsilon, False), (spoiled, False), (spoiled, True))
    )
    assert abs(robust / clean - 1) < 0.03 < abs(plain / clean - 1)
    assert [label for label, _ in verdict.outliers(Points.measured(SPEED, spoiled))] == ["point 5"]


def test_an_elastic_body_has_an_interval_that_begins_at_zero():
    random = np.random.default_rng(7)
    epsilon = np.minimum(1 - 1e-4 + 1e-3 * random.standard_normal(12), 1.0)
    fit = likelihood.fit_law(Points.measured(SPEED, epsilon, sigma_epsilon=1e-3), VISCOELASTIC)
    assert fit.interval(0.95)[0] == 0
    assert fit.interval(0.95)[1] > 0


def test_groups_of_many_points_lose_nothing():
    random = np.random.default_rng(8)
    speed = np.exp(random.uniform(-3, 1, 4000))
    points = Points.measured(speed, law(speed) + 0.01 * random.standard_normal(4000))
    whole, grouped = (likelihood.fit_law(each, FREE) for each in (points, points.grouped(200)))
    assert grouped.parameters[1] == pytest.approx(whole.parameters[1], abs=0.2 * math.sqrt(whole.covariance[1, 1]))
    assert grouped.scatter == pytest.approx(whole.scatter, rel=0.1)
    assert np.diag(grouped.covariance) == pytest.approx(np.diag(whole.covariance), rel=0.25)
    assert points.grouped(200).counts.sum() == 4000


@pytest.mark.parametrize("kind", ["known", "unknown", "times"])
def test_intervals_hold_the_true_value_as_often_as_they_say(kind):
    """Sampled; `python -m viscopade_lab.studies.coverage` takes 2000 sets from other programs."""
    inside, sets = np.zeros(2), 100
    random = np.random.default_rng(11)
    clean = times(3.0, 8)
    for _ in range(sets):
        if kind == "times":
            points = bounced(clean + 3e-4 * random.standard_normal(9), 3e-4).without_scatter()
        else:
            epsilon = law(SPEED) + 0.01 * random.standard_normal(12)
            points = Points.measured(SPEED, epsilon, **({"sigma_epsilon": 0.01} if kind == "known" else {}))
        fit = likelihood.fit_law(points, VISCOELASTIC)
        truth = BETA * fit.middle**0.2
        inside += [low <= truth <= high for low, high in (fit.interval(0.68), fit.interval(0.95))]
    for share, level in zip(inside / sets, (0.68, 0.95), strict=True):
        assert abs(share - level) < 3.5 * math.sqrt(level * (1 - level) / sets)


@pytest.mark.parametrize("scatter", [0.002])
def test_a_drop_whose_scatter_is_not_known_has_intervals_that_are_wide_enough(scatter):
    """A scatter below the detector's errors is not seen, but it shifts beta, whose errors nearly cancel without it."""
    inside, sets = np.zeros(2), 60
    random = np.random.default_rng(12)
    for _ in range(sets):
        found, speed = [0.0], 3.0
        for _ in range(8):
            speed *= float(law(np.array([speed]))[0]) + scatter * random.standard_normal()
            found.append(found[-1] + 2 * speed / 9.81)
        fit = likelihood.fit_law(bounced(np.array(found) + 5e-4 * random.standard_normal(9), 5e-4), VISCOELASTIC)
        truth = BETA * fit.middle**0.2
        inside += [low <= truth <= high for low, high in (fit.interval(0.68), fit.interval(0.95))]
    assert inside[0] > 0.55 * sets
    assert inside[1] > 0.88 * sets


def test_a_mixture_of_scatters_is_students_t_if_scatter_prevails():
    """Tiny errors of the measurement: the mixture has one degree of freedom less than the profile."""
    epsilon = noisy(3)
    scattered = likelihood.fit_law(Points.measured(SPEED, epsilon, sigma_epsilon=1e-7, scatter=True), VISCOELASTIC)
    plain = likelihood.fit_law(Points.measured(SPEED, epsilon), VISCOELASTIC)
    low, high = scattered.interval(0.95)
    wanted = 2 * stats.t.ppf(0.975, 10) * math.sqrt(plain.covariance[0, 0] * 11 / 10)
    assert high - low == pytest.approx(wanted, rel=0.02)


def test_a_robust_standard_error_has_the_information_of_students_t():
    """Of a place, the mean square of d ln f/dx by quadrature, in units of that of a Gaussian."""
    points = Points.measured(SPEED, law(SPEED), sigma_epsilon=0.01)
    plain, robust = (likelihood.fit_law(points, VISCOELASTIC, robust=of).standard_error() for of in (False, True))
    slope = 1e-4
    information, _ = integrate.quad(
        lambda x: (stats.t.logpdf(x + slope, 4) - stats.t.logpdf(x - slope, 4)) ** 2 / 4e-8 * stats.t.pdf(x, 4), -50, 50
    )
    assert robust / plain == pytest.approx(information**-0.5, rel=1e-4)


def test_the_standard_error_of_a_mixture_is_that_of_its_quantiles():
    """The best value depends on the scatter: the four points of small errors lie above the others."""
    sigma, epsilon = np.where(np.arange(12) % 3, 0.01, 1e-3), law(SPEED)
    epsilon[::3] += 0.01
    fit = likelihood.fit_law(Points.measured(SPEED, epsilon, sigma_epsilon=sigma, scatter=True), VISCOELASTIC)
    middles = (np.arange(500) + 0.5) / 500
    quantiles = np.concatenate([fit.interval(level) for level in middles])
    assert fit.standard_error() == pytest.approx(float(quantiles.std()), rel=0.01)


def outlier_beside_a_scatter(seed):
    """Return 30 points with known errors of 0.005, about as much scatter besides, and one eps 0.1 too low."""
    speed = np.geomspace(0.1, 3, 30)
    epsilon = noisy(seed, math.hypot(0.005, 0.004), speed)
    epsilon[-3] -= 0.1
    return Points.measured(speed, epsilon, sigma_epsilon=0.005, scatter=True)


@pytest.mark.parametrize("seed", range(6))
def test_a_robust_interval_is_around_the_robust_fit(seed):
    """Not around the fit with Gaussian errors, whose p the outlier shifts by more than the interval's width."""
    points = outlier_beside_a_scatter(seed)
    gaussian, robust = (likelihood.fit_law(points, FREE, robust=of) for of in (False, True))
    low, high = robust.interval(0.95, 1)
    assert low < robust.exponent < high < gaussian.exponent
    assert (low + high) / 2 == pytest.approx(robust.exponent, abs=0.05 * (high - low))
    # An interval of about two standard errors to each side, whose size is that of the fit without the outlier.
    clean = likelihood.fit_law(points.without(["point 28"]), FREE)
    assert high - low == pytest.approx(np.ptp(clean.interval(0.95, 1)), rel=0.5)
    assert robust.standard_error(1) == pytest.approx((high - low) / 4, rel=0.1)


@pytest.mark.parametrize("robust", [False, True])
@pytest.mark.parametrize("seed", range(3))
def test_intervals_of_a_mixture_are_those_of_the_likelihood_on_a_grid(seed, robust):
    """The likelihood over b and the scatter s from SciPy's densities, with flat priors, integrated over s."""
    points = outlier_beside_a_scatter(seed)
    fit = likelihood.fit_law(points, VISCOELASTIC, robust=robust)
    (b, s), density = np.meshgrid(np.linspace(0.07, 0.13, 601), np.linspace(0, 0.06, 301)), stats.t(4)
    scale = np.hypot(0.005, s)[..., None]
    z = (points.epsilon - double.epsilon(np.sqrt(b[..., None] * (points.speed / fit.middle) ** 0.2))) / scale
    logarithm = ((density if robust else stats.norm).logpdf(z) - np.log(scale)).sum(axis=-1)
    cumulated = np.cumsum(np.exp(logarithm - logarithm.max()).sum(axis=0))
    for level in (0.68, 0.95):
        ends = np.interp([(1 - level) / 2, (1 + level) / 2], cumulated / cumulated[-1], b[0])
        # The mixture takes a normal distribution at each s: exact for Gaussian errors, near for Student's t.
        assert fit.interval(level) == pytest.approx(tuple(ends), abs=(0.08 if robust else 0.02) * np.ptp(ends))


@pytest.mark.parametrize(
    ("points", "text"),
    [
        (([1, 2], [0.9, 0.8]), "there are 2 points"),
        (([1, 1, 1], [0.9, 0.8, 0.85]), "all speeds are 1"),
    ],
)
def test_what_cannot_be_fitted_is_refused(points, text):
    with pytest.raises(ValueError, match=text):
        likelihood.fit_law(Points.measured(*points), VISCOELASTIC)


@pytest.mark.parametrize(
    ("arguments", "text"),
    [
        (([1, 2, 3], [0.9, 0.8, 2.1]), "point 3: eps is 2.1"),
        (([1, 2, 3], [0.9, 0.8, -0.01]), "point 3: eps is -0.01"),
        (([1, 2, -3], [0.9, 0.8, 0.7]), "speed is -3"),
        (([1, 2], [0.9, 0.8, 0.7]), "expected one length"),
        (([1, 2, 3], [0.9, 0.8, math.nan]), "epsilon is nan"),
    ],
)
def test_points_out_of_range_are_refused(arguments, text):
    with pytest.raises(ValueError, match=text):
        Points.measured(*arguments)


def test_known_errors_are_positive():
    with pytest.raises(ValueError, match="sigma_epsilon is 0"):
        Points.measured(SPEED, law(SPEED), sigma_epsilon=0.0)
    with pytest.raises(ValueError, match="expected one number, or 12"):
        Points.measured(SPEED, law(SPEED), sigma_epsilon=[0.1, 0.2])
