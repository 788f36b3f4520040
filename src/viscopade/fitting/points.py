"""Measured coefficients of restitution: speeds, eps, and the measurement errors of both.

Speeds and eps, instants of bounces, and heights all become pairs (v_i, eps_i). One independent measurement error, such
as that of an instant, changes several pairs: two successive bounces have errors of eps of opposite sign, because the
flight between them is the rebound of one and the fall to the other. Jacobian matrices describe this.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from viscopade.arguments import without_unit
from viscopade.arrays.checked import Accepted, FloatArray, array, unmasked
from viscopade.extras import require
from viscopade.fitting import weight_table

if TYPE_CHECKING:
    from scipy import sparse

_POSITIVE = Accepted("a finite number > 0", lambda x: (x > 0) & (x < math.inf))
_NON_NEGATIVE = Accepted("a finite number >= 0", lambda x: (x >= 0) & (x < math.inf))
# Limits of standard errors of eps, which has no unit. Below 1e-10, the fit itself, which is good to about 1e-12, is not
# much more accurate. Above 1000 an error tells nothing: eps is 0 to 1. Both powers of ten were chosen by hand.
_SIGMA = Accepted("a number from 1e-10 to 1000", lambda x: (x >= 1e-10) & (x <= 1000))
_SIGMA_OR_0 = Accepted("0, or a number from 1e-10 to 1000", lambda x: (x == 0) | ((x >= 1e-10) & (x <= 1000)))
_FINITE = Accepted("a finite number", np.isfinite)
# Width in ln v of a group of points that are averaged, at most: one per cent of speed. In it all laws are straight
# lines up to terms of second order, about (0.01)^2 of 1 - eps.
_SPAN = 0.01
_ABOVE = 5.0  # standard errors by which a measured eps may be above 1: by chance one of three million is farther
_LARGEST = 2.0  # measured eps if it scatters; a larger one is a percentage without its unit


@dataclass(frozen=True, eq=False)
class Points:
    """Measured pairs of impact speed and coefficient of restitution.

    Attributes
    ----------
    speed, epsilon : array
        v_i > 0, and eps_i >= 0; because of its errors eps_i may be above 1.
    speed_errors, epsilon_errors : sparse array
        Change of v_i and eps_i of each point (row) by one standard deviation of each independent error (column).
    labels : tuple of str
        Origin of each point, such as "line 7".
    contact_time : array or None
        Measured durations of contact.
    errors_complete : bool
        Whether these are all errors. If not, eps also scatters, by an amount that the fit determines.
    counts : array or None
        Number of measured points in each mean, for points made by `grouped`.
    masked : int
        Number of measured points that a mask hides; they are not among these points.
    weight_speed : float
        Speed at which the load of the body's weight during the contact is 1 (`contacts`); 0 if the body has no weight
        or the load is not known.
    """

    speed: FloatArray
    epsilon: FloatArray
    speed_errors: sparse.csr_array
    epsilon_errors: sparse.csr_array
    labels: tuple[str, ...]
    contact_time: FloatArray | None = None
    errors_complete: bool = False
    counts: FloatArray | None = None
    masked: int = 0
    weight_speed: float = 0.0

    def __post_init__(self) -> None:
        """Refuse an eps below 0, or farther above 1 than its errors explain."""
        # With complete errors, 1 plus five of them; with an unknown scatter, 2.
        largest = 1 + _ABOVE * self.standard_errors if self.errors_complete else np.full(len(self.epsilon), _LARGEST)
        if (bad := ~((self.epsilon >= 0) & (self.epsilon <= largest))).any():
            i = int(np.argmax(bad))
            why = f" (1 and {_ABOVE:g} standard errors)" if self.errors_complete else ""
            raise ValueError(f"{self.labels[i]}: eps is {self.epsilon[i]:.6g}: expected 0 to {largest[i]:.6g}{why}")

    def __len__(self) -> int:
        """Return the number of points."""
        return len(self.speed)

    def load(self, speed: FloatArray) -> FloatArray:
        """Return the loads G of the body's weight at impact speeds."""
        return weight_table.load_at(speed, self.weight_speed)

    @property
    def standard_errors(self) -> FloatArray:
        """Standard errors of eps from the measurement errors."""
        return np.asarray(np.sqrt(self.epsilon_errors.multiply(self.epsilon_errors).sum(axis=1)))

    @property
    def resolution(self) -> float:
        """Smallest difference between two unequal eps: one unit in the last digit of rounded data."""
        # Steps below 1e-12 are round-off (1e-16 of eps), and no instrument has twelve digits. Equal eps have 0.
        steps = np.diff(np.sort(self.epsilon))
        return float(steps[steps > 1e-12].min()) if (steps > 1e-12).any() else 0.0

    @property
    def of_independent_errors(self) -> bool:
        """Whether no two points share a measurement error, as successive bounces do."""
        errors = abs(self.speed_errors) + abs(self.epsilon_errors)
        return bool((np.asarray((errors > 0).sum(axis=0)) <= 1).all())

    def with_independent_errors(self) -> Points:
        """Return these points with the same errors, and covariance of speed and eps, but none that two points share."""
        from scipy import sparse

        speed, epsilon = self.speed_errors, self.epsilon_errors
        speed_variance = np.asarray(speed.multiply(speed).sum(axis=1))
        covariance = np.asarray(speed.multiply(epsilon).sum(axis=1))
        epsilon_variance = np.asarray(epsilon.multiply(epsilon).sum(axis=1))
        # Two errors of each point: the first one changes v by sigma_v and eps by cov/sigma_v, the other eps alone.
        sigma_speed = np.sqrt(speed_variance)
        shared = np.divide(covariance, sigma_speed, out=np.zeros(len(self)), where=sigma_speed > 0)
        alone = np.sqrt(np.maximum(epsilon_variance - shared**2, 0.0))
        diagonal, zero = sparse.diags_array, sparse.csr_array((len(self), len(self)))
        return replace(
            self,
            speed_errors=sparse.hstack([diagonal(sigma_speed), zero], format="csr"),
            epsilon_errors=sparse.hstack([diagonal(shared), diagonal(alone)], format="csr"),
        )

    @classmethod
    def measured(
        cls,
        speed: Sequence[float] | FloatArray,
        epsilon: Sequence[float] | FloatArray,
        *,
        sigma_epsilon: float | Sequence[float] | FloatArray | None = None,
        sigma_speed: float | Sequence[float] | FloatArray = 0.0,
        contact_time: Sequence[float] | FloatArray | None = None,
        scatter: bool | None = None,
        labels: Sequence[str] = (),
    ) -> Points:
        """Return measured speeds and eps, without points that have a masked number.

        Parameters
        ----------
        speed, epsilon : array
            Impact speeds v > 0, length/time, in any one unit, such as m/s; and eps >= 0, which may be above 1 by 5
            standard errors, or up to 2 if it scatters.
        sigma_epsilon : float or array, optional
            Standard errors of eps.
        sigma_speed : float or array
            Standard errors of the speeds, in their unit.
        contact_time : array, optional
            Durations of contact > 0.
        scatter : bool, optional
            Whether eps scatters more than its standard errors. By default only if there are none.
        labels : sequence of str
            Names of the points for messages. By default "point 1", …

        Raises
        ------
        TypeError, ValueError
            If a number is out of range, the lengths differ, or a standard error is 0 although eps does not scatter.
        MissingPackage
            If SciPy is not installed; the message has the command that installs it.
        """
        require("Points.measured", "scipy")
        from scipy import sparse  # imported here, so that `import viscopade` needs no SciPy

        # Columns that are not there have values that pass all checks: no error, and any positive time.
        columns = {"speed": speed, "epsilon": epsilon, "sigma_epsilon": 0.0 if sigma_epsilon is None else sigma_epsilon}
        columns |= {"sigma_speed": sigma_speed, "contact_time": 1.0 if contact_time is None else contact_time}
        _require_one_index(columns)
        plain = [without_unit(name, values) for name, values in columns.items()]
        shapes = [np.shape(values) for values in plain]
        if len(shapes[0]) != 1 or shapes[0] != shapes[1]:
            raise ValueError(f"speed and epsilon have the shapes {shapes[0]} and {shapes[1]}: expected one length")
        for name, shape in zip(columns, shapes, strict=True):
            if shape not in ((), shapes[0]):
                raise ValueError(f"{name} has the shape {shape}: expected one number, or {shapes[0][0]}")
        # A point with a masked number in any column is left out.
        data, hidden = unmasked(plain)
        shown = np.ones(shapes[0], dtype=bool) if hidden is None else ~hidden
        complete = sigma_epsilon is not None and not scatter
        # What is accepted of each column, in the order of `columns`; `__post_init__` tests the range of eps. Standard
        # errors of eps may be 0 only if it scatters besides.
        accepted = (_POSITIVE, _FINITE, _SIGMA if complete else _SIGMA_OR_0, _NON_NEGATIVE, _POSITIVE)
        v, e, sigma_e, sigma_v, times = (
            array(name, np.broadcast_to(values, shapes[0])[shown], test)
            for name, values, test in zip(columns, data, accepted, strict=True)
        )
        names = tuple(labels) or tuple(f"point {i}" for i in range(1, len(shown) + 1))
        if len(names) != len(shown):
            raise ValueError(f"there are {len(names)} labels: expected {len(shown)}, one for each point")
        # Columns of the Jacobian matrices: the errors of all speeds, then those of all eps.
        zero = sparse.csr_array((len(v), len(v)))
        return cls(
            v,
            e,
            sparse.hstack([zero, sparse.diags_array(sigma_v)], format="csr"),
            sparse.hstack([sparse.diags_array(sigma_e), zero], format="csr"),
            tuple(name for name, kept in zip(names, shown, strict=True) if kept),
            None if contact_time is None else times,
            complete,
            masked=int(np.count_nonzero(~shown)),
        )

    def grouped(self, number: int) -> Points:
        """Return means of points with nearly equal speeds, in about `number` groups or more.

        Errors must be independent. A group spans at most one per cent of speed, so that every law is a straight line
        in it. The means are weighted with inverse variances.
        """
        from scipy import sparse

        # A new group begins after every n/number points, and where ln v enters another interval of the width _SPAN.
        order = np.argsort(self.speed, kind="stable")
        group_by_count = np.arange(len(order)) * number // len(order)
        bins = np.floor(np.log(self.speed[order]) / _SPAN)
        starts = np.flatnonzero(np.concatenate([[True], (np.diff(group_by_count) != 0) | (np.diff(bins) != 0)]))
        # weights 1/sigma_i^2, or 1 if eps scatters
        weights = (1 / self.standard_errors**2 if self.errors_complete else np.ones(len(order)))[order]
        sum_of_weights = np.add.reduceat(weights, starts)

        def mean(values: FloatArray) -> FloatArray:
            # sum w x/sum w
            return np.asarray(np.add.reduceat(values[order] * weights, starts) / sum_of_weights)

        def error(matrix: sparse.csr_array) -> sparse.csr_array:
            # sigma^2 of a mean = sum w^2 sigma_i^2/(sum w)^2, with the sigma_i^2 of a point as the sum over its row
            squares = np.asarray(matrix.multiply(matrix).sum(axis=1))[order]
            mean_errors = np.sqrt(np.add.reduceat(squares * weights**2, starts)) / sum_of_weights
            return sparse.csr_array(sparse.diags_array(mean_errors))

        zero = sparse.csr_array((len(starts), len(starts)))
        return replace(
            self,
            speed=np.exp(mean(np.log(self.speed))),
            epsilon=mean(self.epsilon),
            speed_errors=sparse.csr_array(sparse.hstack([error(self.speed_errors), zero])),
            epsilon_errors=sparse.csr_array(sparse.hstack([zero, error(self.epsilon_errors)])),
            labels=tuple(f"group {i}" for i in range(1, len(starts) + 1)),
            contact_time=None if self.contact_time is None else np.exp(mean(np.log(self.contact_time))),
            counts=np.diff(np.append(starts, len(order))).astype(np.float64),
        )

    def without_scatter(self) -> Points:
        """Return these points with the measurement errors as the only ones.

        Raises
        ------
        ValueError
            If a point has no error.
        """
        if not (np.asarray(abs(self.epsilon_errors).sum(axis=1)) > 0).all():
            raise ValueError("eps has no standard errors: expected one for each point if there is no scatter")
        return replace(self, errors_complete=True)

    def without(self, labels: Sequence[str]) -> Points:
        """Return these points without those of some labels, such as "line 7".

        Raises
        ------
        ValueError
            If no point has one of these labels.
        """
        for label in labels:
            if label not in self.labels:
                raise ValueError(f"there is no point {label!r}: expected {self.labels[0]} to {self.labels[-1]}")
        # The columns of the Jacobian matrices stay: errors that no remaining point has are columns of 0.
        keep = np.array([label not in labels for label in self.labels])
        return replace(
            self,
            speed=self.speed[keep],
            epsilon=self.epsilon[keep],
            speed_errors=self.speed_errors[keep],
            epsilon_errors=self.epsilon_errors[keep],
            labels=tuple(label for label, kept in zip(self.labels, keep, strict=True) if kept),
            contact_time=None if self.contact_time is None else self.contact_time[keep],
            counts=None if self.counts is None else self.counts[keep],
        )


def _require_one_index(columns: dict[str, Any]) -> None:
    """Raise ValueError if pandas columns have different indices, because points are made from rows by position.

    `columns`: name of a quantity -> its numbers, a pandas Series or anything else.
    """
    # Only pandas objects have `iloc`; pandas need not be installed.
    indices = {name: values.index for name, values in columns.items() if hasattr(values, "iloc")}
    for name, index in indices.items():
        first = next(iter(indices))
        if not index.equals(indices[first]):
            raise ValueError(f"{first} and {name} have different indices: expected one index, in one order")
