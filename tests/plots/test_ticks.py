"""Labels of ticks: they never overlap, and there are enough of them, over any range of speeds."""

from itertools import pairwise, product

import numpy as np
import pytest

import viscopade as vp
from viscopade.plots import fit_picture, sheet, speeds


def empty(speed):
    figure, (axes,) = sheet.new_sheet(2)
    sheet.label_axes(axes, "speed", "eps", (speed[0], speed[-1]), (0, 1), "x")
    sheet.plain_ticks(axes)
    return figure


def fit(speed):
    return fit_picture.draw_fit(vp.fit(vp.Points.measured(speed, vp.restitution(speed, 0.1), sigma_epsilon=0.01)))


def curves(speed):
    return speeds.draw_speeds([speeds.viscoelastic("spheres", 0.1)], speed)


RANGES = list(product([1, 0.0023, 7e-6, 83, 4400], [1.0003, 1.05, 1.4, 2, 3.2, 5, 8, 10, 30, 99, 101, 1000, 1e6]))


@pytest.mark.parametrize(
    ("drawn", "slowest", "ratio"),
    [*((empty, *each) for each in RANGES), (fit, 1, 1.4), (fit, 0.3, 3), (fit, 0.1, 10), (curves, 0.023, 8)],
)
def test_labels_of_ticks_never_overlap(drawn, slowest, ratio):
    with sheet.style_context():
        figure = drawn(np.geomspace(slowest, slowest * ratio, 6))
        figure.draw_without_rendering()
        bottom = figure.axes[-1]
        low, high = bottom.get_xlim()
        labels = [
            label.get_window_extent()
            for minor in (False, True)
            for label, place in zip(
                bottom.get_xticklabels(minor=minor), bottom.get_xticks(minor=minor).tolist(), strict=True
            )
            if low <= place <= high and label.get_text()
        ]
    assert len(labels) >= (2 if 90 < high / low < 1000 else 3)  # powers of ten
    labels.sort(key=lambda box: box.x0)
    assert all(left.x1 < right.x0 for left, right in pairwise(labels))


def test_a_page_has_its_title_size_and_letters():
    drawn = []

    def draw():
        drawn.append(speeds.draw_speeds([speeds.viscoelastic("spheres", 0.1)], np.geomspace(1, 10, 6)))
        return drawn[0]

    page = sheet.Page("Spheres", (5, 4), 15)
    text = sheet.picture(draw, "", "viscopade plot", "svg", page).decode()
    (figure,) = drawn
    assert figure.get_suptitle() == "Spheres"
    assert "<dc:title>Spheres</dc:title>" in text
    assert figure.get_size_inches().tolist() == [5, 4]
    assert figure.axes[0].xaxis.label.get_size() == 15


def drawn_with(*others):
    with sheet.style_context():
        figure = speeds.draw_speeds([speeds.viscoelastic("spheres", 0.1), *others], np.geomspace(1, 10, 6), linear=True)
    return figure.axes[0].lines


def test_the_main_curve_is_pale_beside_its_approximants_only():
    assert drawn_with(speeds.approximant(1, 4, 0.1))[0].get_color() == sheet.GREY
    assert drawn_with(speeds.approximant(1, 4, 0.1), speeds.of_law("tsuji", 0.8, 1))[0].get_color() == sheet.BLACK


def test_laws_have_their_names_and_the_axis_of_speeds_may_be_linear():
    assert [speeds.of_law(law, 0.8, 1).name for law in ("tsuji", "kelvin-voigt:1", "1,1")] == [
        "tsuji",
        "kelvin-voigt:1",
        "law 1,1",
    ]
    assert drawn_with()[0].axes.get_xscale() == "linear"


def test_curves_and_points_are_in_the_unit_of_the_axis():
    points = vp.Points.measured([0.5, 1, 2], [0.9, 0.8, 0.7], sigma_epsilon=0.01)
    with sheet.style_context():
        figure = speeds.draw_speeds([speeds.viscoelastic("", 0.1)], np.geomspace(1, 10, 6), points, unit=0.01)
    axes = figure.axes[0]
    curve, measured = axes.lines
    assert axes.get_xlim() == (100, 1000)
    assert curve.get_xdata().tolist() == pytest.approx(np.geomspace(100, 1000, 6).tolist())
    assert measured.get_xdata().tolist() == [50, 100, 200]


@pytest.mark.parametrize("font_size", [7.5, 9, 12])
def test_a_legend_is_no_wider_than_its_page(font_size):
    drawn = []

    def draw():
        drawn.append(fit(np.geomspace(0.1, 1, 6)))
        return drawn[0]

    sheet.picture(draw, "", "viscopade fit", "svg", sheet.Page(size=(3.4, 5), font_size=font_size))
    (figure,) = drawn
    assert all(
        0 <= legend.get_window_extent().x0 < legend.get_window_extent().x1 <= figure.bbox.x1
        for legend in figure.legends
    )


@pytest.mark.parametrize(("height", "panels"), [(2.36, 1), (3.5, 2)])  # inches: 6 cm, and enough for residuals
def test_a_low_picture_of_a_fit_leaves_most_of_it_to_eps(height, panels):
    drawn = []

    def draw():
        drawn.append(fit(np.geomspace(0.1, 1, 6)))
        return drawn[0]

    sheet.picture(draw, "", "viscopade fit", "svg", sheet.Page(size=(3.386, height), font_size=8))
    (figure,) = drawn
    assert len(figure.axes) == panels
    (legend,) = figure.legends
    assert legend.get_window_extent().height < 0.2 * figure.bbox.height
    assert sum(axes.get_window_extent().height for axes in figure.axes) > 0.45 * figure.bbox.height
    for axes in figure.axes:
        boxes = [label.get_window_extent() for label in axes.get_yticklabels() if label.get_text()]
        inside = [box for box in boxes if axes.bbox.y0 <= box.y0 + box.height / 2 <= axes.bbox.y1]
        assert all(lower.y1 < upper.y0 for lower, upper in pairwise(sorted(inside, key=lambda box: box.y0)))


def test_a_residual_beyond_the_axis_is_marked():
    speed = np.geomspace(0.1, 1, 40)
    epsilon = vp.restitution(speed, 0.1)
    epsilon[20] -= 0.055
    found = vp.fit(vp.Points.measured(speed, epsilon, sigma_epsilon=0.01))
    with sheet.style_context():
        _, bottom = fit_picture.draw_fit(found).axes
        upper, lower = (line for line in bottom.lines if line.get_gid() == "beyond")
        assert fit_picture.draw_fit(found, with_result=False).axes[0].get_title(loc="left") == "(a)"
    assert upper.get_xdata().tolist() == []
    assert lower.get_xdata().tolist() == [speed[20]]
    assert [text.get_text() for text in bottom.texts] == ["-5"]


def test_the_picture_of_a_fit_has_beta_with_its_error():
    speed = np.geomspace(0.1, 1, 6)
    found = vp.fit(vp.Points.measured(speed, vp.restitution(speed, 0.1), sigma_epsilon=0.01))
    with sheet.style_context():
        title = fit_picture.draw_fit(found).axes[0].get_title(loc="left")
    assert title.startswith("(a)")
    assert "0.1000 ± 0.0049" in title
