# SPDX-License-Identifier: MIT
"""Two logs of one motion on clocks of their own: which times are the same, and where it rested.

Speeds of both are correlated over the whole logs for the offset, in windows for the rate, then the
difference of the speeds is fitted by least squares. At rest no clock matters: means over rests are
what should be identified from.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from symkin.errors import SymkinError
from symkin.values import Array, Value, field, record

_SMOOTHED = 0.05  # s, over which speeds are averaged
_WINDOWS = 6
_STEPS = 8
_LIKE = 0.5  # correlation below which two logs are not of one motion
_SLOWEST = 0.4  # share of a log whose median speed is noise
_STILL = 2e-3  # m/s, and so many times that median
_TIMES = 3.0
_LASTS, _CUT = 0.3, 0.1  # s: of a rest at least, and what is cut at its ends
_MOST_SAMPLES = 5_000_000


@record
class Track:
    """Positions in the order of time; rows that are not finite were not seen."""

    times: Array  # s, shape (N,)
    positions: Array  # m, shape (N, d)

    def __post_init__(self) -> None:
        """Refuse what is no motion in time."""
        if len(self.times) < 10:
            raise SymkinError(f"{len(self.times)} samples are too few for a log; expected 10")
        if not np.isfinite(self.times).all() or (np.diff(self.times) <= 0).any():
            raise SymkinError("the times of a log do not rise from sample to sample")

    @property
    def period(self) -> float:
        """Typical time between samples, s."""
        return float(np.median(np.diff(self.times)))

    def speeds(self, grid: Array) -> Array:
        """Smoothed speed at these times; NaN where it was not seen just before and after."""
        seen = np.isfinite(self.positions).all(axis=1)
        times, places = self.times[seen], self.positions[seen]
        if len(times) < 3:
            raise SymkinError("a log shows no motion: fewer than 3 of its samples were seen")
        step = grid[1] - grid[0]
        places = np.column_stack([np.interp(grid, times, each) for each in places.T])
        speed = np.linalg.norm(np.gradient(places, step, axis=0), axis=1)
        width = 2 * round(_SMOOTHED / step / 2) + 1  # an even one would shift by half a sample
        speed = np.convolve(speed, np.ones(width) / width, mode="same")
        near = np.searchsorted(times, grid).clip(1, len(times) - 1)
        unseen = (times[near] - times[near - 1] > max(_SMOOTHED, 3 * self.period)) | (
            (grid < times[0]) | (grid > times[-1])
        )
        return np.where(unseen, np.nan, speed)

    @property
    def grid(self) -> Array:
        """Times at even steps over the log."""
        count = round((self.times[-1] - self.times[0]) / self.period)
        if not 10 <= count <= _MOST_SAMPLES:
            raise SymkinError(f"a log of {count} steps; expected 10 to {_MOST_SAMPLES}")
        return np.asarray(self.times[0] + self.period * np.arange(count))


@record
class Clocks(Value):
    """How the clock of a second log goes: time on the first is offset + rate times its own."""

    offset: float = field(unit="s")  # s
    rate: float  # seconds of the first for one of the second
    # Standard deviation of the offset in the middle of the log, s, for white noise of the speeds.
    deviation: float = field(unit="s")
    correlation: float  # of the speeds

    def of_first(self, times: Array) -> Array:
        """Times of the second log on the clock of the first."""
        return np.asarray(self.offset + self.rate * times)


def align_clocks(first: Track, second: Track) -> Clocks:
    """Find which times of two logs of one motion are the same.

    Raises
    ------
    SymkinError
        If the speeds of the logs are not alike at any offset, or nothing moves.
    """
    step = min(first.period, second.period)
    one, two = (_even(each, step) for each in (first, second))
    lag, likeness = _lag(one.speeds, two.speeds)
    if likeness < _LIKE:
        raise SymkinError(
            f"the speeds of the two logs are not alike (correlation {likeness:.2f} at best); "
            "expected both of one motion, in metres and seconds"
        )
    offset = one.start + lag * step - two.start
    middles, offsets = _in_windows(one, two, offset, step)
    rate = 1.0
    if len(middles) >= 3:
        slope, at = np.polyfit(middles - middles.mean(), offsets, 1)
        if abs(slope) < 1e-3:
            rate, offset = 1 + slope, float(at - slope * middles.mean())
    return _fitted(one, two, offset, rate, likeness)


@record
class _Even:
    start: float
    times: Array
    speeds: Array


def _even(track: Track, step: float) -> _Even:
    count = int((track.times[-1] - track.times[0]) / step)
    if not 10 <= count <= _MOST_SAMPLES:
        raise SymkinError(f"a log of {count} steps; expected 10 to {_MOST_SAMPLES}")
    grid = track.times[0] + step * np.arange(count)
    speeds = track.speeds(grid)
    if not np.isfinite(speeds).any() or np.nanmax(speeds) - np.nanmin(speeds) <= 0:
        raise SymkinError("nothing moves in a log, so that its clock cannot be found")
    return _Even(float(grid[0]), grid, speeds)


def _lag(first: Array, second: Array) -> tuple[float, float]:
    """Steps by which the second is later on the first, to parts of a step; and how alike.

    Of what both have at a lag, so that neither has to begin or end with the other; at least half of
    the shorter.
    """
    a, b = (np.nan_to_num(each - np.nanmean(each)) for each in (first, second))
    size = 1 << (len(a) + len(b) - 1).bit_length()
    product = np.fft.irfft(np.fft.rfft(a, size) * np.conj(np.fft.rfft(b, size)), size)
    product = np.concatenate([product[-len(b) + 1 :], product[: len(a)]])
    lags = np.arange(1 - len(b), len(a))
    low, high = np.maximum(0, lags), np.minimum(len(a), len(b) + lags)
    of_a, of_b = (np.concatenate([[0.0], np.cumsum(each**2)]) for each in (a, b))
    squares = (of_a[high] - of_a[low]) * (of_b[high - lags] - of_b[low - lags])
    shared = (high - low >= min(len(a), len(b)) / 2) & (squares > 0)
    alike = np.where(shared, product / np.sqrt(np.where(shared, squares, 1.0)), -1.0)
    best = int(alike.argmax())
    shift = 0.0
    if 0 < best < len(alike) - 1 and shared[best - 1 : best + 2].all():
        left, peak, right = alike[best - 1 : best + 2]
        bend = left - 2 * peak + right
        shift = float((left - right) / (2 * bend)) if bend < 0 else 0.0
    return float(lags[best]) + shift, max(float(alike[best]), 0.0)


def _in_windows(one: _Even, two: _Even, offset: float, step: float) -> tuple[Array, Array]:
    """Middles of parts of the second log, by its clock, and the offset of each."""
    middles, offsets = [], []
    for part in np.array_split(np.arange(len(two.times)), _WINDOWS):
        begin, end = two.times[part[0]] + offset, two.times[part[-1]] + offset
        wide = (one.times > begin - 0.5) & (one.times < end + 0.5)
        if wide.sum() < len(part) / 2 or not np.isfinite(two.speeds[part]).any():
            continue
        own = one.speeds[wide]
        if not np.isfinite(own).any():
            continue
        lag, likeness = _lag(own, two.speeds[part])
        found = one.times[wide][0] + lag * step - two.times[part[0]]
        if likeness > _LIKE and abs(found - offset) < 0.5:
            middles.append(float(two.times[part].mean()))
            offsets.append(float(found))
    return np.array(middles), np.array(offsets)


def _fitted(one: _Even, two: _Even, offset: float, rate: float, likeness: float) -> Clocks:
    """Least squares of the difference of the speeds over offset, rate and a constant."""
    slopes = np.gradient(one.speeds, one.times)
    middle = float(two.times.mean())
    covariance = np.full((3, 3), np.nan)
    for _ in range(_STEPS):
        at = offset + rate * two.times
        inside = (at >= one.times[0]) & (at <= one.times[-1])
        speed, slope = (np.interp(at, one.times, each) for each in (one.speeds, slopes))
        rest = two.speeds - speed
        good = inside & np.isfinite(rest) & np.isfinite(slope)
        if good.sum() < 10:
            break
        # By the offset in the middle of the log, which hardly depends on the rate.
        rows = np.column_stack([slope, slope * (two.times - middle), np.ones_like(slope)])[good]
        information = rows.T @ rows
        if np.linalg.cond(information) > 1e18:
            break
        change = np.linalg.solve(information, rows.T @ rest[good])
        spare = max(int(good.sum()) - 3, 1)
        left = rest[good] - rows @ change
        covariance = np.linalg.inv(information) * float(left @ left) / spare
        offset, rate = offset + change[0] - change[1] * middle, rate + change[1]
        if abs(change[0]) < 1e-9:
            break
    # Smoothed speeds are alike from sample to sample.
    alike = max(_SMOOTHED / float(two.times[1] - two.times[0]), 1.0)
    deviation = math.sqrt(covariance[0, 0] * alike) if covariance[0, 0] > 0 else math.nan
    return Clocks(float(offset), float(rate), deviation, likeness)


def runs_of(true: NDArray[np.bool_]) -> NDArray[np.intp]:
    """Begin of each run of what is true, and end, the first that is not, shape (k, 2)."""
    return np.flatnonzero(np.diff(true.astype(int), prepend=0, append=0)).reshape(-1, 2)


def rests_of(first: Track, second: Track, clocks: Clocks) -> list[tuple[float, float]]:
    """Begin and end, on the clock of the first, of what both logs show to be at rest."""
    grid = first.grid
    there = (grid - clocks.offset) / clocks.rate
    own = first.speeds(grid)
    even = second.grid
    other = np.interp(there, even, second.speeds(even), left=np.nan, right=np.nan)
    still = np.isfinite(own) & np.isfinite(other)
    for speed in (own, other):
        slow = np.sort(speed[np.isfinite(speed)])
        if not len(slow):
            return []
        noise = float(np.median(slow[: max(1, int(_SLOWEST * len(slow)))]))
        still &= ~(np.nan_to_num(speed, nan=np.inf) > _STILL + _TIMES * noise)
    step = float(grid[1] - grid[0])
    spans = [
        (float(grid[begin]), float(grid[begin] + (end - 1 - begin) * step))
        for begin, end in runs_of(still)
    ]
    return [(begin + _CUT, end - _CUT) for begin, end in spans if end - begin >= _LASTS]
