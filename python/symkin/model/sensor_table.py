# SPDX-License-Identifier: MIT
"""Sensors that a calibration table makes straight."""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Sequence
from dataclasses import field
from functools import cached_property
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike, NDArray

from symkin.errors import MechanismError
from symkin.values import Array, record

_LEAST_ROWS = 2
SAME_TURN = 1e-9  # of a table's length: rounding, such as that of degrees
_BISECTIONS = 60
# Slopes at the ends, over those of the first and the last secant: within these the curve between
# is monotone, and nowhere flat.
_FLATTEST, _STEEPEST = 0.1, 3.0


@record
class SensorTable:
    """What sensors show, and what straight ones would show there: of an encoder's certificate, say.

    Readings go through the table where files are read, and back where they are written, so that
    everywhere else sensors are straight, with a gain and an offset that are identified. Between the
    rows stands the monotone cubic of Fritsch and Butland (SIAM J. Sci. Stat. Comput. 5, 1984),
    beyond them nothing. A table whose last row is one or more whole turns beyond its first, in both
    columns, goes on periodically.

    Parameters
    ----------
    legs : sequence of sequences of (float, float)
        For each leg, or once for all legs alike, rows of what the sensor shows and what a straight
        one would show, rad or m, in any order. Both grow, or one grows and the other falls.
    source : Path, optional
        The file that it was read from.

    Raises
    ------
    SymkinError
        Naming the leg and the row at fault.
    """

    legs: tuple[tuple[tuple[float, float], ...], ...]
    source: Path | None = field(default=None, compare=False)

    def __post_init__(self) -> None:
        """Sort and check the rows."""
        if not self.legs:
            raise MechanismError("the sensor table has no legs; expected rows for one or for each")
        for leg, rows in enumerate(self.legs, 1):
            wrong = wrong_row(rows)
            if wrong is not None:
                raise MechanismError(
                    f"the sensor table of leg {leg}: row {wrong[0] + 1} {wrong[1]}"
                )
        ordered = (sorted((float(a), float(b)) for a, b in rows) for rows in self.legs)
        object.__setattr__(self, "legs", tuple(map(tuple, ordered)))

    def __repr__(self) -> str:
        """Return how long it is."""
        rows = " and ".join(str(len(each)) for each in self.legs)
        return f"<SensorTable of {rows} rows>"

    @cached_property
    def _curves(self) -> tuple[_Curve, ...]:
        return tuple(_Curve(np.array(rows)) for rows in self.legs)

    def _of(self, leg: int) -> _Curve:
        return self._curves[leg if len(self.legs) > 1 else 0]

    def require_legs(self, count: int) -> None:
        """Refuse to be of another number of legs.

        Raises
        ------
        SymkinError
            With both numbers.
        """
        if len(self.legs) not in (1, count):
            raise MechanismError(
                f"the sensor table has {len(self.legs)} legs; expected {count}, or one for all"
            )

    def straight(self, shown: ArrayLike) -> Array:
        """Return what straight sensors would show.

        Parameters
        ----------
        shown : array_like, shape (N, legs)
            What the sensors show, rad or m.

        Returns
        -------
        ndarray, shape (N, legs)
            NaN where the table does not reach.
        """
        return self._each(shown, _Curve.at)

    def shown(self, straight: ArrayLike) -> Array:
        """Return what the sensors show where straight ones would show this: the reverse.

        Returns
        -------
        ndarray, shape (N, legs)
            NaN where the table does not reach.
        """
        return self._each(straight, _Curve.inverse)

    def slope(self, shown: ArrayLike) -> Array:
        """Return the change of what straight sensors show by what these do, shape (N, legs).

        Standard deviations of what the sensors show go through it.

        Returns
        -------
        ndarray, shape (N, legs)
        """
        return self._each(shown, _Curve.slope)

    def span(self, leg: int) -> tuple[float, float] | None:
        """Return least and largest of what a straight sensor of a leg (from 0) shows in the table.

        None if it goes on periodically.
        """
        curve = self._of(leg)
        return None if curve.whole else (float(curve.y.min()), float(curve.y.max()))

    def reach(self, leg: int) -> tuple[float, float]:
        """Return the first and the last of what the sensor of a leg (from 0) shows in the table."""
        return self._of(leg).x[0], self._of(leg).x[-1]

    def _each(self, values: ArrayLike, function: Callable[[_Curve, Array], Array]) -> Array:
        rows = np.array(np.atleast_2d(np.asarray(values, dtype=np.float64)))
        if rows.ndim != 2:
            raise MechanismError(f"readings have shape {rows.shape}; expected (N, legs)")
        self.require_legs(rows.shape[1])
        for leg in range(rows.shape[1]):
            rows[:, leg] = function(self._of(leg), rows[:, leg])
        return rows


def wrong_row(rows: Sequence[tuple[float, float]]) -> tuple[int, str] | None:
    """Return which of a table's rows is wrong, from 0, and what is; None if none is."""
    if len(rows) < _LEAST_ROWS:
        return 0, f"is {'alone' if rows else 'missing'}; expected at least {_LEAST_ROWS} rows"
    for index, row in enumerate(rows):
        if len(row) != _LEAST_ROWS or not all(map(math.isfinite, row)):
            return index, f"is {tuple(row)}; expected two finite numbers"
    order = sorted(range(len(rows)), key=lambda index: rows[index][0])
    first, last = rows[order[0]][1], rows[order[-1]][1]
    rises = last > first
    wanted = "grow or fall" if last == first else "grow" if rises else "fall"
    for before, index in itertools.pairwise(order):
        (shown, straight), (previous, lower) = rows[index], rows[before]
        if shown == previous:
            return max(index, before), f"repeats the reading {shown:g}; expected it once"
        if straight == lower or (straight > lower) != rises:
            return index, (
                f"has {straight:.10g} at the reading {shown:.10g}, after {lower:.10g} at "
                f"{previous:.10g}; expected values that {wanted} throughout"
            )
    return None


class _Curve:
    """The monotone cubic through a leg's rows, sorted."""

    def __init__(self, rows: Array) -> None:
        self.x, self.y = rows.T.copy()
        self.whole = _turns(self.x, self.y)
        h, d = np.diff(self.x), np.diff(self.y) / np.diff(self.x)
        if self.whole:  # the intervals that follow each other over the ends
            m = _harmonic(np.append(h[-1], h), np.append(d[-1], d))
            self.slopes = np.append(m, m[0])
        else:
            inner = _harmonic(h, d)
            self.slopes = np.concatenate([[_end(h, d)], inner, [_end(h[::-1], d[::-1])]])

    def at(self, x: Array) -> Array:
        turns = self._turns_before(x, self.x)
        place = self._place(x - turns * self._length(self.x))
        return self._hermite(*place) + turns * self._length(self.y)

    def slope(self, x: Array) -> Array:
        turns = self._turns_before(x, self.x)
        return self._hermite_slope(*self._place(x - turns * self._length(self.x)))

    def inverse(self, y: Array) -> Array:
        """By Newton's method, and by bisection where that leaves the interval."""
        turns = self._turns_before(y, self.y)
        wanted = y - turns * self._length(self.y)
        sign = 1.0 if self.y[-1] > self.y[0] else -1.0
        slack = SAME_TURN * abs(self._length(self.y))
        inside = (wanted >= self.y.min() - slack) & (wanted <= self.y.max() + slack)
        held = np.where(inside, np.clip(wanted, self.y.min(), self.y.max()), self.y[0])
        k = np.clip(np.searchsorted(sign * self.y, sign * held, "right") - 1, 0, len(self.y) - 2)
        low, high = np.zeros(len(y)), np.ones(len(y))
        t = (held - self.y[k]) / (self.y[k + 1] - self.y[k])
        for _ in range(_BISECTIONS):
            over = self._hermite(k, t) - held
            high, low = np.where(sign * over > 0, t, high), np.where(sign * over > 0, low, t)
            step = over / (self._hermite_slope(k, t) * (self.x[k + 1] - self.x[k]))
            closer = t - step
            t = np.where((closer >= low) & (closer <= high), closer, (low + high) / 2)
        found = self.x[k] + t * (self.x[k + 1] - self.x[k]) + turns * self._length(self.x)
        return np.where(inside, found, np.nan)

    def _length(self, values: Array) -> float:
        return float(values[-1] - values[0])

    def _turns_before(self, values: Array, own: Array) -> Array:
        """How many times the table is gone through before its part that values are in."""
        if not self.whole:
            return np.zeros(len(values))
        return np.asarray(np.floor((values - own[0]) / self._length(own)))

    def _place(self, x: Array) -> tuple[NDArray[np.intp], Array]:
        """The interval, and how far in it, from 0 to 1; NaN beyond the ends."""
        slack = SAME_TURN * self._length(self.x)
        inside = (x >= self.x[0] - slack) & (x <= self.x[-1] + slack)
        held = np.clip(np.where(inside, x, self.x[0]), self.x[0], self.x[-1])
        k = np.clip(np.searchsorted(self.x, held, "right") - 1, 0, len(self.x) - 2)
        t = (held - self.x[k]) / (self.x[k + 1] - self.x[k])
        return k, np.where(inside, t, np.nan)

    def _hermite(self, k: NDArray[np.intp], t: Array) -> Array:
        h = self.x[k + 1] - self.x[k]
        rest = 1 - t
        ends = self.y[k] * rest**2 * (1 + 2 * t) + self.y[k + 1] * t**2 * (3 - 2 * t)
        return np.asarray(ends + h * t * rest * (self.slopes[k] * rest - self.slopes[k + 1] * t))

    def _hermite_slope(self, k: NDArray[np.intp], t: Array) -> Array:
        h = self.x[k + 1] - self.x[k]
        of_ends = 6 * t * (1 - t) * (self.y[k + 1] - self.y[k]) / h
        return np.asarray(
            of_ends + self.slopes[k] * (1 - t) * (1 - 3 * t) + self.slopes[k + 1] * t * (3 * t - 2)
        )


def _turns(x: Array, y: Array) -> bool:
    """Whether both columns end the same number of whole turns, one or more, after they begin."""
    lengths = np.array([x[-1] - x[0], abs(y[-1] - y[0])])
    turns = np.round(lengths / math.tau)
    return bool(
        turns[0] >= 1 and (np.abs(lengths - turns[0] * math.tau) <= SAME_TURN * lengths).all()
    )


def _harmonic(h: Array, d: Array) -> Array:
    """Slopes between neighbouring intervals of lengths h and secants d."""
    first, second = 2 * h[1:] + h[:-1], h[1:] + 2 * h[:-1]
    return np.asarray((first + second) / (first / d[:-1] + second / d[1:]))


def _end(h: Array, d: Array) -> float:
    """The slope at the beginning, of the parabola through three rows."""
    if len(h) == 1:
        return float(d[0])
    slope = ((2 * h[0] + h[1]) * d[0] - h[0] * d[1]) / (h[0] + h[1])
    return float(d[0] * np.clip(slope / d[0], _FLATTEST, _STEEPEST))
