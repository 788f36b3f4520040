"""Empirical functions eps(v) of measured points, for data that follow no law of contact.

They summarise a measurement and have no theory behind them. Outside the measured range of speeds they are constant.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from fractions import Fraction
from itertools import pairwise
from textwrap import wrap
from typing import Literal

import numpy as np

from viscopade.arithmetic.formats import FORMATS
from viscopade.arrays.checked import Accepted, FloatArray, Values, elementwise
from viscopade.fitting.points import Points
from viscopade.generated import WIDTH, marker_lines
from viscopade.kernels.expressions import Call, CodeBranch, Name, Select, Statement
from viscopade.kernels.formulas import ONE, ZERO
from viscopade.kernels.kernel import Function, Kernel
from viscopade.kernels.write import file
from viscopade.kernels.write.languages import language as language_of

Form = Literal["power", "table"]

MOST_NODES = 32  # of a table, chosen by hand: one with more nodes would follow the scatter, and is a longer file
_SPEEDS = Accepted("a number >= 0", lambda x: x >= 0)


@dataclass(frozen=True)
class Empirical:
    """Function eps(v) fitted to points.

    Attributes
    ----------
    slowest, fastest : float
        The ends of the measured range of speeds; outside it, eps has its value at the nearer end.
    residual, largest : float
        Root mean square and largest absolute residual of eps.
    factor, power : float
        C and q of eps = min(1, C v^-q); 0 for a table.
    nodes : tuple
        Speeds and eps of a table, which is linear in ln v between them; empty for a power.
    """

    slowest: float
    fastest: float
    residual: float = 0.0
    largest: float = 0.0
    factor: float = 0.0
    power: float = 0.0
    nodes: tuple[tuple[float, float], ...] = ()

    def epsilon(self, speed: Values) -> Values:
        """Return eps at speeds >= 0, in m/s."""

        def epsilon_of_array(speeds: FloatArray) -> FloatArray:
            """Return eps of an array of speeds; `elementwise` makes it of numbers and other containers."""
            # Outside the measured range, eps is that of the nearer end.
            v = np.clip(speeds, self.slowest, self.fastest)
            if self.nodes:
                # linear in ln v between the nodes
                node_speeds, node_epsilons = np.array(self.nodes).T
                return np.asarray(np.interp(np.log(v), np.log(node_speeds), node_epsilons))
            # eps = min(1, C v^-q)
            return np.minimum(1.0, self.factor * v**-self.power)

        return elementwise(epsilon_of_array, "speed", speed, _SPEEDS)

    def head_sentences(self) -> list[str]:
        """Return sentences about this function for the head of a file: its formula, range and residuals."""
        formula = (
            f"a monotone table of {len(self.nodes)} nodes, linear in ln v between them"
            if self.nodes
            else f"eps = min(1, {self.factor:.6g} v^{-self.power:.6g}), v in m/s"
        )
        # Six digits of constants and speeds, as in other files; two of residuals, whose own error is larger. eps is at
        # most 1, because a passive body gains no energy.
        return [
            f"EMPIRICAL fit of measured data, no law of contact: {formula}.",
            f"Speeds from {self.slowest:.6g} to {self.fastest:.6g} m/s; outside, eps has its value at the nearer end.",
            f"Residuals of eps: {self.residual:.2g} (root mean square), up to {self.largest:.2g}.",
        ]

    def kernel(self, name: str) -> Kernel:
        """Return the function as a kernel without a proof, which can be written in every language.

        `name` ends the names of the kernel and of its functions. A Kernel has expressions of named constants and
        arguments; v{i}, e{i} are the speed and eps of node i.
        """
        speed, v, eps = map(Name, ("speed", "v", "eps"))
        # Outside the measured range, eps is that of the nearer end.
        cut = Select(speed < Name("slowest"), Name("slowest"), Select(speed > Name("fastest"), Name("fastest"), speed))
        constants = {"slowest": self.slowest, "fastest": self.fastest}
        if self.nodes:
            # Between two nodes, eps is linear in ln v: its share is ln(v/v_i)/ln(v_(i+1)/v_i), of any base. A branch
            # takes the speeds up to its upper node.
            branches = []
            for i, ((low_v, low_eps), (high_v, high_eps)) in enumerate(pairwise(self.nodes)):
                constants |= {f"v{i}": low_v, f"e{i}": low_eps, f"v{i + 1}": high_v, f"e{i + 1}": high_eps}
                start_speed, end_speed, start, end = map(Name, (f"v{i}", f"v{i + 1}", f"e{i}", f"e{i + 1}"))
                share = Call("log2", (v / start_speed,)) / Call("log2", (end_speed / start_speed,))
                branches.append(CodeBranch(v <= end_speed, (), {"eps": start + (end - start) * share}))
            # The last branch takes all remaining speeds.
            branches[-1] = branches[-1]._replace(guard=None)
        else:
            # eps = C v^-q, and 1 where this is larger
            constants |= {"factor": self.factor, "exponent": -self.power}
            value = (Statement("eps", Name("factor") * Call("pow", (v, Name("exponent")))),)
            branches = [CodeBranch(None, value, {"eps": Select(eps > ONE, ONE, eps)})]
        # eps for speeds >= 0, else NaN: from the speed cut to the range, by the first branch whose condition holds
        function = Function(
            "epsilon", ("speed",), "eps at a speed in m/s, EMPIRICAL", speed >= ZERO, (Statement("v", cut),),
            tuple(branches), "eps",
        )  # fmt: skip
        # Each constant is rounded to the nearest number of each format, float and double.
        constants_by_format = {
            number_format.name: {
                constant: number_format.nearest(Fraction(value)) for constant, value in constants.items()
            }
            for number_format in FORMATS.values()
        }
        return Kernel(f"empirical_{name}", name, "speed", "", "", "", (function,), constants_by_format)

    def text(self, language: str, name: str, command: str) -> str:
        """Return a file with the function, which says that it is empirical.

        Parameters
        ----------
        language : str
            A language of `viscopade export`.
        name : str
            The end of the function's name, epsilon_empirical_NAME.
        command : str
            The command line that makes the file.
        """
        # The head: the command, and the facts in lines of a file's width; then the code.
        lines = [
            *marker_lines(command),
            "",
            *(line for sentence in self.head_sentences() for line in wrap(sentence, WIDTH)),
            "A negative speed gives NaN. Nothing is proven of this function.",
        ]
        return file.file_text([self.kernel(name)], language_of(language), command, f"empirical_{name}", lines)


def of_points(points: Points, form: Form = "power") -> Empirical:
    """Return a function fitted to points by least squares, weighted with their standard errors where these are known.

    Parameters
    ----------
    points : Points
    form : str
        "power": eps = min(1, C v^-q). "table": the monotone function, falling or rising, that is nearest to the points
        (isotonic regression), or to means of them if there are more than `MOST_NODES`.

    Raises
    ------
    ValueError
        If all speeds are equal, no eps is positive, or there is no such form.
    """
    if form not in ("power", "table"):
        raise ValueError(f"form is {form!r}: expected 'power' or 'table'")
    slowest, fastest = float(points.speed.min()), float(points.speed.max())
    if not fastest > slowest or not points.epsilon.any():
        raise ValueError("all speeds are equal, or all eps are 0: expected two speeds and an eps > 0")
    # Weights are 1/sigma^2, or the numbers of points in means, or equal.
    weights = 1 / points.standard_errors**2 if points.errors_complete else np.ones(len(points))
    if points.counts is not None and not points.errors_complete:
        weights = points.counts
    # Fit the constants, then measure the residuals with the same weights.
    if form == "power":
        factor, power = _power(points, weights)
        curve = Empirical(slowest, fastest, factor=factor, power=power)
    else:
        curve = Empirical(slowest, fastest, nodes=_nodes(points, weights))
    residuals = points.epsilon - np.asarray(curve.epsilon(points.speed))
    rms = math.sqrt(float(np.average(residuals**2, weights=weights)))
    return Empirical(slowest, fastest, rms, float(np.abs(residuals).max()), curve.factor, curve.power, curve.nodes)


def _power(points: Points, weights: FloatArray) -> tuple[float, float]:
    """Return C and q of the function min(1, C v^-q) that is nearest to the points: sum `weights` (d eps)^2 is least."""
    from scipy import optimize

    log_v = np.log(points.speed)
    middle, roots = float(np.average(log_v, weights=weights)), np.sqrt(weights)

    def residuals(level_and_power: FloatArray) -> FloatArray:
        # sqrt(w) (min(1, exp(level - q (ln v - middle))) - eps): around the middle, level and q are hardly correlated
        level, q = level_and_power
        return np.asarray(roots * (np.exp(np.minimum(level - q * (log_v - middle), 0)) - points.epsilon))

    # The search starts with the straight line ln C - q ln v through ln eps, where eps is not 0; with one such point, at
    # eps = 1, which is level 0 and q = 0.
    rebounds = points.epsilon > 0
    slope, first_level = (
        np.polyfit(log_v[rebounds] - middle, np.log(points.epsilon[rebounds]), 1) if rebounds.sum() > 1 else (0, 0)
    )
    level, q = optimize.least_squares(residuals, [first_level, -slope], x_scale="jac").x
    # C = exp(level + q middle)
    return math.exp(level + q * middle), float(q)


def _nodes(points: Points, weights: FloatArray) -> tuple[tuple[float, float], ...]:
    """Return the nodes (speed, eps) of the monotone function that is nearest to the points, in weighted squares of eps.

    `weights` has one for each point. Where eps is constant, only the first and the last node are left.
    """
    from scipy import optimize

    order = np.argsort(points.speed, kind="stable")
    # One node for all points of a speed, or for successive groups if there are too many speeds.
    # A group begins at an index in `starts`; its speed is the geometric mean, weighted like eps.
    _, starts = np.unique(points.speed[order], return_index=True)
    if len(starts) > MOST_NODES:
        starts = starts[np.arange(MOST_NODES) * len(starts) // MOST_NODES]
    total_weights = np.add.reduceat(weights[order], starts)
    log_v, epsilon = (
        np.add.reduceat((values * weights)[order], starts) / total_weights
        for values in (np.log(points.speed), points.epsilon)
    )
    # Isotonic regression, once falling and once rising: the nearer one is taken.
    fits = [
        optimize.isotonic_regression(epsilon, weights=total_weights, increasing=rising).x for rising in (False, True)
    ]
    nearest = min(fits, key=lambda fit: float(total_weights @ (fit - epsilon) ** 2))
    node_epsilons = np.clip(nearest, 0, 1)
    # A node between two nodes of the same eps says nothing more.
    redundant = (node_epsilons[1:-1] == node_epsilons[:-2]) & (node_epsilons[1:-1] == node_epsilons[2:])
    keep = np.delete(np.arange(len(node_epsilons)), np.flatnonzero(redundant) + 1)
    return tuple(zip(np.exp(log_v[keep]).tolist(), node_epsilons[keep].tolist(), strict=True))
