# SPDX-License-Identifier: MIT
"""Corrections of what people mistake most often, of readings, drawing and question."""

from __future__ import annotations

import dataclasses
import itertools
import math
import operator
from collections.abc import Callable, Collection, Iterator, Sequence
from functools import cache, partial

import numpy as np

from symkin import _core
from symkin.analysis.workspace import best_homes
from symkin.errors import SymkinError, named_legs
from symkin.estimate.evidence.far_rows import without_far_rows
from symkin.estimate.evidence.findings import Doubt
from symkin.estimate.evidence.frames import frame_doubt, only, with_frames
from symkin.estimate.evidence.measured import with_modes
from symkin.estimate.evidence.numbers import sensors_off
from symkin.estimate.evidence.row_edits import edits_of_rows
from symkin.estimate.evidence.table_edits import edits_of_poses, rarer_edits, with_readings
from symkin.estimate.evidence.trial import Cause, Correction, with_priors
from symkin.estimate.options import EstimateOptions
from symkin.model.mechanism import Mechanism
from symkin.model.turns import turn_of
from symkin.values import Array

_FEW_LEGS = 4  # of which any combination is tried
_WIDE_GAIN = 1.0  # of the sensor's gain, where it is in question
_FAR = 1.5  # times as far as other legs
_BEYOND = 3.0  # standard deviations from the middle of readings, among which home is none
_OF_READINGS = ("opposite-sign", "unit-of-readings", "zero-half-a-turn-off")
_FACTORS = {
    180 / math.pi: "degrees that were stated as radians",
    math.pi / 180: "radians that were stated as degrees",
    2 * math.pi: "radians that were stated as turns",
    1 / (2 * math.pi): "turns that were stated as radians",
    1e-3: "metres that were stated as millimetres",
    1e3: "millimetres that were stated as metres",
}


def corrections_of(stated: Correction) -> Iterator[Correction]:
    """Give one correction at a time, of every kind in turn, should not all be tried."""
    rarer = (
        without_far_rows,
        rarer_edits,
        edits_of_rows,
        _one_frame,
        _sensors,
        _all_free,
    )
    kinds = [kind(stated) for kind in (*_KINDS, *rarer)]
    for each in itertools.zip_longest(*kinds):
        yield from (correction for correction in each if correction is not None)


def _all_free(stated: Correction) -> Iterator[Correction]:
    options = stated.options
    if options.free is not None or options.fixed or options.shared or options.tie:
        wide = dataclasses.replace(options, free=None, fixed=(), shared=(), tie=())
        cause = Doubt("held-is-wrong", figures={"evidence": "", "help": ""})
        yield stated.of(cause, stated.mechanism, wide)


def pairs_of(
    stated: Correction,
    parts: Collection[object] = (),
    first: Sequence[Correction] | None = None,
) -> Iterator[Correction]:
    """Two corrections of different kinds at once, without what has more unknowns.

    If corrections are known to be `parts` of what is wrong, pairs with one of them. If the best
    are known, pairs of these, the `first`, and those of any with unknown frames.
    """
    best = None if first is None else {each.key for each in first}
    for number, kind in enumerate(_KINDS):
        for one in kind(stated):
            kinds = _KINDS[number + 1 :]
            if best is not None:
                others = tuple(each for each in _KINDS if each is not kind)
                kinds = others if one.key in best else (_frames,) if kind is not _frames else ()
            for other in itertools.chain.from_iterable(each(one) for each in kinds):
                words = {each.key for each in (one, other) if isinstance(each.cause, Doubt)}
                # Words that depend on the fit may be those of a part.
                if not parts or len(words) < 2 or not words.isdisjoint(parts):
                    yield other._replace(cause=_both(one, other), again=None)


def _both(one: Correction, other: Correction) -> Cause:
    def of(fit: _core.JointFit | None) -> Doubt | None:
        first, second = one.told(fit), other.told(fit)
        if first is None or second is None:
            return None
        first, second = _columns_first(first, second)
        return dataclasses.replace(first, then=(*first.then, second))

    return of(None) or of


def _columns_first(first: Doubt, second: Doubt) -> tuple[Doubt, Doubt]:
    """What is wrong with a column's readings is told of the leg that they are of."""
    if first.code not in _OF_READINGS or second.code != "columns-exchanged":
        return first, second
    columns = [int(each) - 1 for each in str(second.figures["columns"]).split(", ")]
    leg_of = dict(zip(columns, second.legs, strict=True))
    legs = tuple(sorted(leg_of.get(column, column) for column in first.legs))
    return second, dataclasses.replace(first, legs=legs)


def _sets(count: int, *, alone: bool = False) -> list[tuple[int, ...]]:
    """Legs that a mistake may be of: any of few legs, one or all of many or if it comes `alone`."""
    if alone or count > _FEW_LEGS:
        return [(leg,) for leg in range(count)] + [tuple(range(count))] * (count > 1)
    every = range(1, count + 1)
    return [legs for size in every for legs in itertools.combinations(range(count), size)]


def _with_readings(
    stated: Correction, cause: Doubt, change: Callable[[Array], Array]
) -> Correction:
    return stated._replace(cause=cause, measurements=with_readings(stated.measurements, change))


def _orders(stated: Correction) -> Iterator[Correction]:
    """The columns of the readings in another order: any of few, of many two exchanged."""
    count = stated.columns
    own = tuple(range(count))
    unread = tuple(range(count, stated.measurements.readings.shape[1]))
    orders = set(itertools.permutations(own)) if count <= _FEW_LEGS else {own[::-1]}
    for i, j in itertools.combinations(own, 2):
        orders.add(tuple(j if leg == i else i if leg == j else leg for leg in own))
    orders |= {own[shift:] + own[:shift] for shift in own}
    for order in sorted(orders - {own}):
        moved = [leg for leg in own if order[leg] != leg]
        columns = ", ".join(str(order[leg] + 1) for leg in moved)
        cause = Doubt("columns-exchanged", tuple(moved), figures={"columns": columns})
        yield _with_readings(stated, cause, operator.itemgetter((slice(None), order + unread)))


def _modes(stated: Correction) -> Iterator[Correction]:
    nominal = stated.mechanism
    modes = nominal.working_modes
    home = nominal.inverse_kinematics(nominal.home[None])
    reached = np.isfinite(home[:, : nominal.reading_count]).all()
    if not reached or _have_one_root(nominal, home):
        return
    for legs in _sets(len(modes)):
        flipped = [-mode if leg in legs else mode for leg, mode in enumerate(modes)]
        parts = []
        for mode in (-1, 1):
            own = [leg for leg in legs if flipped[leg] == mode]
            if own:
                verb = "stands" if len(own) == 1 else "stand"
                parts.append(
                    f"{named_legs(own)} {verb} in working mode {mode:+d}: set working_mode = {mode}"
                )
        cause = Doubt("working-mode", legs, figures={"which": "; ".join(parts)})
        for robot in in_modes(nominal, flipped):
            # A chain with one root does not care.
            if not np.array_equal(robot.inverse_kinematics(nominal.home[None]), home):
                yield stated.of(cause, robot, stated.options)


def _have_one_root(mechanism: Mechanism, home: Array) -> bool:
    """Whether no leg cares for its mode, by their readings at home."""
    flipped = with_modes(mechanism, [-mode for mode in mechanism.working_modes])
    return np.array_equal(flipped.inverse_kinematics(mechanism.home[None]), home)


def in_modes(mechanism: Mechanism, modes: Sequence[int]) -> list[Mechanism]:
    """The mechanism in other working modes, with a home on either side of the singularities.

    Its own home, as long as the new modes leave it a good one.
    """
    robot = with_modes(mechanism, list(modes))
    settings = robot.workspace
    if settings is None:
        return [robot]
    condition = robot.singularity_measures(robot.home[None])[2][0]
    if condition <= settings.conditioning_limit:
        return [robot]
    return [
        robot.replace(workspace=dataclasses.replace(settings, home=tuple(home)))
        for home, _ in best_homes(robot)
    ]


def _changed(legs: Sequence[int], change: Callable[[Array], Array]) -> Callable[[Array], Array]:
    def of_all(values: Array) -> Array:
        values[:, legs] = change(values[:, legs])
        return values

    return of_all


def _signs(stated: Correction) -> Iterator[Correction]:
    for legs in _sets(stated.columns):
        yield _with_readings(stated, Doubt("opposite-sign", legs), _changed(legs, np.negative))


def _units(stated: Correction) -> Iterator[Correction]:
    for legs in _sets(stated.columns, alone=True):
        for factor, unit in _FACTORS.items():
            if ("metres" in unit) == (stated.mechanism.reading_unit == "m"):
                cause = Doubt("unit-of-readings", legs, size=factor, figures={"unit": unit})
                yield _with_readings(stated, cause, _changed(legs, partial(_over, factor)))


def _half_turns(stated: Correction) -> Iterator[Correction]:
    nominal = stated.mechanism
    for legs in _sets(stated.columns, alone=True):
        turns = [turn_of(nominal, leg) for leg in legs]
        if None not in turns:
            half = np.array(turns, dtype=float) / 2
            cause = Doubt("zero-half-a-turn-off", legs)
            yield _with_readings(stated, cause, _changed(legs, partial(np.add, -half)))


def _over(factor: float, values: Array) -> Array:
    return values / factor


def _sensors(stated: Correction) -> Iterator[Correction]:
    """Gains and zeros that the tolerances do not explain, of one leg or of all."""
    nominal, count = stated.mechanism, stated.columns
    gains = nominal.sensor_gains[:count]
    named = list(nominal.parameter_names)
    angular = np.array([nominal.leg_info(leg).reading_unit == "rad" for leg in range(count)])
    # Gains of angles are compared with each other, and so are those of lengths.
    largest = [np.abs(gains[angular == each]).max() for each in angular]
    widths = {
        "sensor_gain": _WIDE_GAIN * np.array(largest),
        "sensor_offset": np.where(angular, math.pi, nominal.characteristic_length),
    }

    @cache  # the same from another start
    def cause(legs: tuple[int, ...], name: str) -> Callable[[_core.JointFit], Doubt]:
        def of(fit: _core.JointFit) -> Doubt:
            found = fit.setup.parameters[list(legs), named.index(name)]
            return sensors_off(nominal, legs, name, found)

        return of

    def of(legs: tuple[int, ...], name: str, robot: Mechanism) -> Correction:
        wide = {f"leg{leg + 1}.{name}": float(widths[name][leg]) for leg in legs}
        options = stated.options
        if name == "sensor_gain":  # all zeros that are held wrong are as a turned frame is
            options = _freed(options, name, legs, count)
        options = with_priors(options, wide)
        return stated.of(cause(legs, name), robot, options)._replace(wide=len(legs))

    for legs in _sets(count, alone=True):
        for name in widths:
            if name in named:
                yield of(legs, name, nominal)
    times, off = _times_as_far(stated), _off_home(stated)
    starts: list[tuple[str, tuple[int, ...], Array]] = [
        ("sensor_gain", (leg,), gains[leg] / times[leg])
        for leg in np.flatnonzero(np.abs(np.log(times)) > math.log(_FAR)).tolist()
    ]
    if legs := tuple(np.flatnonzero(off).tolist()):
        zeros = nominal.parameters[list(legs), named.index("sensor_offset")]
        starts.append(("sensor_offset", legs, zeros - off[list(legs)]))
    for name, legs, values in starts:
        parameters = nominal.parameters.copy()
        parameters[list(legs), named.index(name)] = values
        try:
            yield of(legs, name, nominal.with_parameters(parameters, symmetry=None))
        except SymkinError:
            continue


def _freed(options: EstimateOptions, name: str, legs: Sequence[int], count: int) -> EstimateOptions:
    """With a parameter of some legs unknown that may have been held, or shared with others."""
    own = [f"leg{leg + 1}.{name}" for leg in legs]
    others = [f"leg{leg + 1}.{name}" for leg in range(count) if leg not in legs]
    fixed = [each for each in options.fixed if each not in (name, *own)]
    if name in options.fixed:
        fixed += others
    free = None if options.free is None else (*options.free, *own)
    shared = tuple(each for each in options.shared if each != name)
    return dataclasses.replace(options, fixed=tuple(fixed), free=free, shared=shared)


def _times_as_far(stated: Correction) -> Array:
    """How far each leg's joint moves by its readings, over how far it moves in the drawing.

    Where poses are not known in the drawing's frame, over what legs do of which half move less.
    From there a gain is found that is too far off for the poses of the drawing at the readings.
    """
    nominal, poses, legs = stated.mechanism, stated.measurements.poses, stated.columns
    readings, times = stated.measurements.readings[:, :legs], np.ones(legs)
    if "sensor_gain" not in nominal.parameter_names:
        return times
    moved, usual = _spread(readings), np.zeros(legs)
    if "base" not in stated.options.frames and np.isfinite(poses).all():
        drawn = nominal.inverse_kinematics(poses)[:, :legs]
        usual = _spread(np.where(np.isfinite(readings), drawn, math.nan))
    elif legs > 2 and len({nominal.leg_info(leg).reading_unit for leg in range(legs)}) == 1:
        gains = np.abs(nominal.sensor_gains[:legs])
        usual = np.median(moved * gains) / gains
    np.divide(moved, usual, out=times, where=(moved > 0) & (usual > 0))
    return times


def _off_home(stated: Correction) -> Array:
    """How far each leg's joint is by its readings from where the drawing has it at home.

    Zero where home is among the readings, or poses are known in the drawing's frame, which tell.
    From there zeros are found with which the drawing reaches no reading.
    """
    nominal, measured, legs = stated.mechanism, stated.measurements, stated.columns
    whole = np.isfinite(measured.poses).all()
    if "sensor_offset" not in nominal.parameter_names or (whole and not stated.options.frames):
        return np.zeros(legs)
    readings, off = measured.readings[:, :legs], np.zeros(legs)
    read = np.isfinite(readings).any(axis=0)
    off[read] = np.nanmedian(readings[:, read], axis=0)
    off[read] -= nominal.inverse_kinematics(nominal.home[None])[0, :legs][read]
    far = np.abs(off) > _BEYOND * _spread(readings)
    return np.where(far, nominal.sensor_gains[:legs] * off, 0.0)


def _spread(readings: Array) -> Array:
    """Standard deviation of each column's finite values; zero where there are none."""
    known = np.isfinite(readings)
    values = np.where(known, readings, 0.0)
    return np.asarray(np.std(values, axis=0, where=known | ~known.any(axis=0)))


def _frames(stated: Correction) -> Iterator[Correction]:
    options = with_frames(stated.mechanism, stated.measurements, stated.options)
    if options is not None:
        yield _with_frames(stated, options)


def _one_frame(stated: Correction) -> Iterator[Correction]:
    """The device's frame or the target, where both may be elsewhere."""
    options = with_frames(stated.mechanism, stated.measurements, stated.options)
    if options is not None and len(options.frames) > 1:
        for each in options.frames:
            yield _with_frames(stated, only(each, options, stated.options))


def _with_frames(stated: Correction, options: EstimateOptions) -> Correction:
    space = stated.mechanism.space

    def cause(fit: _core.JointFit) -> Doubt:
        return frame_doubt(space, fit.setup, stated.options, options)

    return stated.of(cause, stated.mechanism, options)


# Those of a pair are made in this order.
_KINDS = (_orders, _modes, _signs, _units, _half_turns, edits_of_poses, _frames)
