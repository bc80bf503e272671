# SPDX-License-Identifier: MIT
"""Mistakes that measurements and an estimate show by themselves, whatever was asked.

Readings of the other working mode, lost turns, copies, poses out of reach, coarse readings. Others
need a correction that is tried: `corrections`.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterator
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from symkin import _core
from symkin.data.measurements import Measurements
from symkin.data.observables import OBSERVABLES
from symkin.estimate.evidence.findings import Doubt
from symkin.estimate.found import Found
from symkin.model.chains import shortest
from symkin.model.framing import unframed
from symkin.model.mechanism import Mechanism
from symkin.model.settings import NoiseSettings
from symkin.model.turns import shortest_ways, turn_of, turned_home
from symkin.values import Array

# Two measurements of one pose differ by the noise; nearer than this share of it they are copies.
_COPIED = 1e-3
_EXACT = 1e-9  # rad or m: of readings without noise
_FEW_VALUES = 0.7  # of the readings
_SOME = 8  # values that are not on the same steps by chance
_ON_STEPS = 1e-3
_UNLIKE = 0.05  # of the range of a leg's readings
_NOTHING = -(2.0**60)  # in a cell where nothing was observed


class Taken(NamedTuple):
    """Readings at poses in the robot's own frame; NaN where an estimate does not use them."""

    nominal: Mechanism
    calibrated: Mechanism
    poses: Array
    readings: Array
    row_numbers: NDArray[np.intp]

    def rows(self, leg: int) -> NDArray[np.intp]:
        """Rows, from 0, whose reading of a leg is used."""
        poses = np.isfinite(self.poses).all(axis=1)
        return np.flatnonzero(poses & np.isfinite(self.readings[:, leg]))


def signs_of_mistakes(found: Found, taken: Taken) -> Iterator[Doubt]:
    """Name what speaks against the measurements, whatever the residuals are."""
    # Where residuals are not explained, neither are latent poses, which tell modes apart.
    if found.legs or not found.unexplained:
        yield from other_modes(taken)
    yield from _out_of_reach(found, taken)
    yield from lost_turns(taken)


def taken_from(found: Found) -> Taken:
    """Where the platform was in the robot's own frame, and the readings that were used there."""
    measurements, numbers = found.measurements, found.measurements.row_numbers
    if found.legs:
        used = np.zeros(measurements.readings.shape, dtype=bool)
        for leg, fit in enumerate(found.legs):
            used[fit.rows, leg] = True
            used[fit.rejected, leg] = False
        poses = measurements.poses
    else:
        used, poses = np.isfinite(found.reading_errors), found.latent_poses
    readings = np.where(used, measurements.readings, np.nan)
    return Taken(found.nominal, found.mechanism, poses, readings, numbers)


def taken_as_drawn(robot: Mechanism, measured: Measurements) -> Taken:
    """All that was read, at the poses that are known in full, of a robot as it is drawn."""
    poses, whole = np.full_like(measured.poses, np.nan), np.isfinite(measured.poses).all(axis=1)
    poses[whole] = unframed(robot, measured.poses[whole])
    return Taken(robot, robot, poses, measured.readings, measured.row_numbers)


def other_modes(taken: Taken) -> Iterator[Doubt]:
    """Readings that belong to the other root of the closure at the estimate."""
    calibrated = taken.calibrated
    all_wrong: dict[int, list[int]] = {}
    of_other_root = nearer_other_root(taken)
    for leg, mode in enumerate(calibrated.working_modes):
        rows = taken.rows(leg)
        wrong = of_other_root[rows, leg]
        if wrong.sum() > len(rows) // 2:
            all_wrong.setdefault(mode, []).append(leg)
        elif wrong.any():
            numbers = _numbered(taken, rows[wrong])
            figures = {"total": len(rows), "first": numbers[0], "mode": -mode}
            yield Doubt("some-in-other-mode", (leg,), numbers, figures=figures)
    for mode, legs in all_wrong.items():
        figures = {"mode": -mode, "drawn": mode}
        yield Doubt("other-working-mode", tuple(legs), figures=figures)


def nearer_other_root(taken: Taken) -> NDArray[np.bool_]:
    """Which readings, shape (N, legs), are nearer to the root of the other working mode."""
    calibrated = taken.calibrated
    flipped = with_modes(calibrated, [-mode for mode in calibrated.working_modes])
    own, other = (
        np.abs(shortest_ways(calibrated, away))
        for away in (
            taken.readings - robot.inverse_kinematics(taken.poses)
            for robot in (calibrated, flipped)
        )
    )
    return np.asarray(other < own)


def _out_of_reach(found: Found, taken: Taken) -> Iterator[Doubt]:
    """Poses that the calibrated model cannot take."""
    calibrated, noise = found.mechanism, found.noise
    known = np.isfinite(taken.poses).all(axis=1)
    margins = np.full(taken.readings.shape, np.nan)
    there = np.ascontiguousarray(taken.poses[known])
    margins[known] = _core.reach_margin(calibrated.straight, there)
    moves = calibrated.space.moves
    length = calibrated.characteristic_length if moves else 1.0
    allowed = 6 * max(noise.position if moves else 0.0, noise.orientation * length)
    if found.legs:
        closures = np.concatenate([leg.residuals for leg in found.legs])
        allowed = max(allowed, 6 * float(np.sqrt(np.mean(closures**2))))
    for leg in range(len(calibrated.legs)):
        rows = taken.rows(leg)
        beyond = rows[margins[rows, leg] < -allowed]
        if len(beyond):
            worst = beyond[np.argmin(margins[beyond, leg])]
            size = float(-margins[worst, leg])
            figures = {
                "total": len(rows),
                "first": int(taken.row_numbers[worst]),
                "milli": 1e3 * size,
                "unit": calibrated.space.closure_unit,
            }
            yield Doubt("out-of-reach", (leg,), _numbered(taken, beyond), size, figures=figures)


def lost_turns(taken: Taken) -> Iterator[Doubt]:
    """Readings that are turns away from each other, or from where the model has them."""
    roots = _roots_from_home(taken)
    for leg in range(taken.readings.shape[1]):
        turn, rows = turn_of(taken.nominal, leg), taken.rows(leg)
        if turn is None or len(rows) < 2:
            continue
        away = np.round((taken.readings[rows, leg] - roots[rows, leg]) / turn)
        if away[0] and (away == away[0]).all():
            figures = {"turns": turns_in_words(away[0])}
            yield Doubt("turns-away", (leg,), size=float(away[0]), figures=figures)
        turns = _turns_lost(taken, roots, leg, turn)
        if turns.any():
            numbers = _numbered(taken, rows[turns != 0])
            yield Doubt("turns-lost", (leg,), numbers, figures={"total": len(rows)})


def with_lost_turns(taken: Taken, measured: Measurements) -> Measurements:
    """The measurements with the turns added that `lost_turns` says are lost."""
    readings, roots = measured.readings.copy(), _roots_from_home(taken)
    for leg in range(readings.shape[1]):
        turn, rows = turn_of(taken.nominal, leg), taken.rows(leg)
        if turn is not None and len(rows) >= 2:
            readings[rows, leg] -= turn * _turns_lost(taken, roots, leg, turn)
    return replace(measured, readings=readings)


def _roots_from_home(taken: Taken) -> Array:
    """Counted from the nominal robot's home, lest both be half a turn from the sensor's zero."""
    return turned_home(taken.nominal, taken.calibrated.inverse_kinematics(taken.poses))


def _turns_lost(taken: Taken, roots: Array, leg: int, turn: float) -> Array:
    """How many turns the readings of a leg that are used are away from most of them."""
    rows = taken.rows(leg)
    readings = taken.readings[rows, leg]
    by_model = roots[rows, leg] + shortest(readings - roots[rows, leg], turn)
    for unbroken in (_continuous(readings, turn), by_model):
        if not np.isfinite(unbroken).all():
            continue
        turns = np.round((readings - unbroken) / turn)
        values, counts = np.unique(turns, return_counts=True)
        most = values[counts == counts.max()]  # of two halves, that where the model has it
        off = [abs(np.median(readings - (turns - each) * turn - roots[rows, leg])) for each in most]
        turns -= most[int(np.argmin(off))]
        if turns.any() and _largest_gap(readings) > 1.5 * _largest_gap(unbroken):
            return np.asarray(turns)
    return np.zeros(len(rows))


def _largest_gap(values: Array) -> float:
    return float(np.diff(np.sort(values)).max())


def copied_rows(found: Found) -> NDArray[np.intp]:
    """Rows, from 0, whose observations agree with another's better than noise allows.

    Where less was observed than a pose has coordinates, in their readings too.
    """
    measured, noise, space = found.measurements, found.noise, found.nominal.space
    columns: list[Array] = []
    known = np.zeros(len(measured.poses), dtype=np.intp)
    for name, each in OBSERVABLES.items():
        values = getattr(measured, name)
        # A controller reports where it was told to be, as often as it was told.
        if values is None or name in ("readings", "reported") or each.between_rows:
            continue
        values = values.reshape(len(values), -1)
        scale = np.full(values.shape[1], noise.orientation if each.is_angle else noise.position)
        if each.is_pose:
            scale[space.size :] = noise.orientation
        columns.append(values[:, scale > 0] / scale[scale > 0])
        known += np.isfinite(columns[-1]).sum(axis=1)
    few = known < space.dof
    if few.any():
        size = noise.reading or _EXACT
        columns.append(np.where(few[:, None], measured.readings / size, 0.0))
        known += np.isfinite(columns[-1]).sum(axis=1) * few
    if not len(known) or not known.any() or len(known) < 2:
        return np.zeros(0, dtype=np.intp)
    cells = np.hstack(columns) / _COPIED
    pairs: set[int] = set()
    for shift in (0.0, 0.5):  # a pair may lie on both sides of a cell's border once
        of_cells = np.where(np.isfinite(cells), np.floor(cells + shift), _NOTHING)
        _, first, inverse = np.unique(of_cells, axis=0, return_index=True, return_inverse=True)
        copies = (first[inverse.ravel()] != np.arange(len(cells))) & (known > 0)
        pairs |= set(np.flatnonzero(copies).tolist())
    return np.array(sorted(pairs), dtype=np.intp)


def copies(found: Found) -> Iterator[Doubt]:
    """Rows that add no information."""
    rows = copied_rows(found)
    if len(rows):
        numbers = tuple(found.measurements.row_numbers[rows].tolist())
        figures = {"total": len(found.measurements.poses), "first": numbers[0]}
        yield Doubt("rows-copied", (), numbers, len(rows) / figures["total"], figures=figures)


def coarse_readings(taken: Taken, noise: NoiseSettings) -> Iterator[Doubt]:
    """Name sensors whose readings take few values, or steps that are larger than the noise."""
    coarse = {}
    for leg in range(taken.readings.shape[1]):
        rows = taken.rows(leg)
        values, counts = np.unique(taken.readings[rows, leg], return_counts=True)
        if len(values) < 2:
            continue
        step = float(np.diff(values).min())
        steps = (values - values[0]) / step
        stepped = np.abs(steps - np.round(steps)).max() < _ON_STEPS
        if len(values) < _FEW_VALUES * counts.sum() or (
            len(values) > _SOME and stepped and step > _width(taken, leg, noise)
        ):
            coarse[leg] = len(values), step
    if coarse:
        fewest = min(count for count, _ in coarse.values())
        step = min(step for _, step in coarse.values())
        figures = {"count": fewest, "unit": taken.nominal.reading_unit}
        yield Doubt("readings-coarse", tuple(coarse), size=step, figures=figures)


def copied_columns(taken: Taken) -> Iterator[Doubt]:
    """Name legs whose readings are the same in all rows, where the drawing's are not."""
    legs = range(taken.readings.shape[1])
    drawn = taken.nominal.inverse_kinematics(taken.poses)
    for one, other in itertools.combinations(legs, 2):
        rows = np.intersect1d(taken.rows(one), taken.rows(other))
        first, second = taken.readings[rows, one], taken.readings[rows, other]
        if len(rows) <= _SOME or (first != second).any():
            continue
        apart = np.abs(drawn[rows, one] - drawn[rows, other])
        apart = apart[np.isfinite(apart)]  # where the drawing reaches
        if len(apart) and np.median(apart) > _UNLIKE * np.ptp(first):
            yield Doubt("columns-copied", (one, other), figures={"count": len(rows)})


def _width(taken: Taken, leg: int, noise: NoiseSettings) -> float:
    """Standard deviation of a leg's reading less that at a measured pose."""
    size, dof = taken.nominal.space.size, taken.nominal.space.dof
    sigma = np.where(np.arange(dof) < size, noise.position, noise.orientation)
    straight = taken.calibrated.replace(curvature=None)
    jacobian = straight.pose_jacobian(taken.poses[taken.rows(leg)])[:, leg]
    return float(np.sqrt(noise.reading**2 + np.median((jacobian * sigma) ** 2 @ np.ones(dof))))


def _numbered(taken: Taken, rows: NDArray[np.intp]) -> tuple[int, ...]:
    return tuple(taken.row_numbers[rows].tolist())


def with_modes(mechanism: Mechanism, modes: list[int]) -> Mechanism:
    """The mechanism in other working modes."""
    legs = [
        replace(leg, working_mode=mode) for leg, mode in zip(mechanism.legs, modes, strict=True)
    ]
    return mechanism.replace(legs=legs, symmetry=None)


def _continuous(values: Array, turn: float | None) -> Array:
    """Angles about their mean direction, so that none jumps."""
    if turn is None:
        return values
    centre = float(np.angle(np.mean(np.exp(2j * np.pi * values / turn)))) / (2 * np.pi) * turn
    return centre + shortest(values - centre, turn)


def turns_in_words(turns: float) -> str:
    """So many turns, such as ``"half a turn"``."""
    if abs(turns) == 0.5:
        return "half a turn"
    return "a whole turn" if abs(turns) == 1 else f"{abs(turns):g} turns"
