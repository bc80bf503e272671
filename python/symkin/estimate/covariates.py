# SPDX-License-Identifier: MIT
"""What changes while a robot is measured, as slopes along covariates that are known of every row.

A drift, a step, a growth with the temperature and a backlash are one thing: an unknown that
multiplies a column. The columns are here; what an unknown may move is a leg's reading, its lengths,
or the base in the frame of the measuring device.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Literal, get_args

import numpy as np
from numpy.typing import NDArray

from symkin import _core
from symkin.data.measurements import Measurements
from symkin.errors import SymkinError
from symkin.model.core_setup import Slopes
from symkin.model.mechanism import Mechanism
from symkin.model.settings import NoiseSettings
from symkin.options import Moving
from symkin.values import Array, Value, record


@record
class Covariate(Value):
    """A column that is known of every row, and what goes along with it.

    Attributes
    ----------
    name : str
        Of its slopes: ``leg1.drift`` of a leg, ``drift.x`` of the base.
    of : {"reading", "lengths", "base"}
        What is larger by slope times column: what a leg's sensor shows; all lengths of a leg, over
        themselves; where the base is.
    values : ndarray, shape (N, legs); of the base (N,)
        The column.
    per : str
        Unit of the column; empty for a number. Of a clock's offset that of the slope, s.
    is_reference : bool
        Whether others are compared with it: its slopes are held at zero unless `free` names them or
        a prior says how large they are.
    """

    name: str
    of: Literal["reading", "lengths", "base"]
    values: Array
    per: str = ""
    is_reference: bool = False


def covariates_of(
    mechanism: Mechanism,
    measurements: Measurements,
    *,
    drift: Sequence[str] = (),
    step: Sequence[str] = (),
    growth: bool = False,
    backlash: bool = False,
    sessions: Sequence[str] = (),
    clock_offset: bool = False,
) -> tuple[Covariate, ...]:
    """Lay out what may change; the arguments are those of `identify`.

    Time goes from -1/2 to 1/2, so that the robot is as in the middle, and a drift is the change
    from end to end. Before a step it is -1, then 0: the robot is as after it. A temperature counts
    from its mean. A backlash is half of it to either side. Of a session it is 1 in its own rows,
    and the robot is as in the last one.

    Raises
    ------
    SymkinError
        For a step at no row, or before all; a growth of a robot without lengths; fewer than two
        sessions; a clock's offset where nobody says how fast the robot moves.
    """
    legs = len(mechanism.legs)

    def moving(name: str, what: str, column: Array) -> Covariate:
        if what == "frame":
            return Covariate(name, "base", column)
        return Covariate(name, "reading", np.repeat(column[:, None], legs, axis=1))

    found = [moving("drift", each, clock(measurements)) for each in drift]
    for text in step:
        row, what = step_at(text)
        found.append(moving(f"step{row}", what, _before(measurements, row)))
    if growth:
        if not mechanism.space.moves:
            raise SymkinError("growth is of lengths; a platform that only turns has none")
        given = measurements.temperatures
        column = clock(measurements) if given is None else given - np.mean(given)
        if not np.ptp(column):
            raise SymkinError("growth goes with a temperature that changes; it is always the same")
        per = "" if given is None else "K"
        found.append(Covariate("growth", "lengths", np.repeat(column[:, None], legs, axis=1), per))
    if backlash:
        found.append(Covariate("backlash", "reading", last_moves(mechanism, measurements) / 2))
    if clock_offset:
        found += _late(mechanism, measurements)
    for what in ("leg", "frame"):
        if {"leg": "offsets", "frame": "frames"}[what] in sessions:
            own = sessions_of(measurements)
            for number, rows in own.items():  # which others are compared with the last
                each = moving(f"session{number}", what, rows.astype(float))
                found.append(replace(each, is_reference=number == max(own)))
    return tuple(found)


def late_clock(mechanism: Mechanism, measurements: Measurements) -> tuple[Covariate, ...]:
    """What a clock's offset would change; nothing where nobody says how fast the robot moved."""
    if measurements.speeds is None and measurements.velocities is None:
        return ()
    try:
        return tuple(_late(mechanism, measurements))
    except SymkinError:  # of velocities that do not say it of all that was measured
        return ()


def _late(mechanism: Mechanism, measurements: Measurements) -> list[Covariate]:
    """What a device shows that sees the robot where it was some time before the readings.

    The readings are larger by their speeds times that, or what is seen of positions is where it was
    by the velocity.
    """
    if measurements.speeds is not None:
        return [Covariate("clock", "reading", measurements.speeds, "s")]
    velocities, space = measurements.velocities, mechanism.space
    if velocities is None:
        unit = mechanism.reading_unit
        raise SymkinError(
            "a clock's offset shows where the robot moves, and nobody says how fast; expected "
            f"columns velocity_{space.position[0] if space.moves else 'x'}_m_s, ... of the target, "
            f"or speed_1_{unit}_s, ... of the readings"
        )
    taken = measurements
    turning = {
        "orientations": taken.poses[:, space.size :] if space.turns else None,
        "points": taken.points if space.turns else None,
        "attitudes": taken.attitudes,
        "turns": taken.turns,
    }
    for what, values in turning.items():
        if values is not None and np.isfinite(values).any():
            raise SymkinError(
                f"the velocity of the target does not say what a clock's offset does to {what}; "
                f"expected the speeds of the readings, speed_1_{mechanism.reading_unit}_s, ..."
            )
    return [
        Covariate(f"clock_{axis}", "base", -column, "s")
        for axis, column in zip(space.position, velocities.T, strict=True)
    ]


def sessions_of(measurements: Measurements) -> dict[int, NDArray[np.bool_]]:
    """Which rows were measured in each session, by its number.

    Raises
    ------
    SymkinError
        Where there are not several.
    """
    given = measurements.sessions
    numbers = [] if given is None else np.unique(given).tolist()
    if len(numbers) < 2:
        one = f"; all rows are of session {numbers[0]}" if numbers else ""
        raise SymkinError(
            "sessions need rows of two at least, by a column session (1, 2, ...) or a file for "
            f"each{one}"
        )
    return {number: np.asarray(given == number) for number in numbers}


def steps_of(given: Sequence[str | int] | str | int | None) -> tuple[str, ...] | None:
    """Steps as texts: ``63``, or ``frame:63``; one alone is one, too."""
    if given is None:
        return None
    several = (given,) if isinstance(given, str | int) else tuple(given)
    for each in several:
        step_at(each)
    return tuple(map(str, several))


def step_at(text: str | int) -> tuple[int, str]:
    """The row at which a step is, and what it moves."""
    what, _, number = str(text).rpartition(":")
    known = what in ("", *get_args(Moving))
    if not known or not number.strip().isascii() or not number.strip().isdigit():
        raise SymkinError(
            f'step is "{text}"; expected the number of the row from which on all is different, '
            'such as "63", or "frame:63" for the frame of the measuring device'
        )
    return int(number), "frame" if what == "frame" else "leg"


def clock(measurements: Measurements) -> Array:
    """Time of every row, from -1/2 to 1/2: by its column, or one row after the other."""
    times = measurements.times
    found = np.arange(len(measurements), dtype=float) if times is None else times - times.min()
    span = np.ptp(found) if len(found) else 0.0
    if not span:
        raise SymkinError("what changes with time needs rows of different times; all have the same")
    return np.asarray(found / span - 0.5)


def _before(measurements: Measurements, row: int) -> Array:
    """-1 of the rows before a step, by the clock."""
    numbers = measurements.row_numbers
    here = np.flatnonzero(numbers >= row)  # the next one, where it is left out
    if not len(here) or row < numbers.min():
        span = f"{numbers.min()} to {numbers.max()}" if len(numbers) else "none"
        raise SymkinError(f"step {row}: there is no row {row}; the rows are {span}")
    times = clock(measurements)
    before = times < times[here[numbers[here].argmin()]]
    if not before.any():
        raise SymkinError(f"step {row}: no row was measured before it, so that it is no step")
    return np.where(before, -1.0, 0.0)


def last_moves(mechanism: Mechanism, measurements: Measurements) -> Array:
    """Which way each leg came to rest, shape (N, legs): 1 up, -1 down, 0 where nobody knows.

    By the column, or by the reading before: a reading that was not taken is passed over, and the
    first comes from home.
    """
    given = measurements.approaches
    if given is not None:
        return given
    order = np.argsort(clock(measurements), kind="stable")
    moves = np.zeros(measurements.readings.shape)
    homes = mechanism.inverse_kinematics(np.array([mechanism.home]))[0]
    for leg, column in enumerate(measurements.readings.T):
        rows = order[np.isfinite(column[order])]
        moves[rows, leg] = np.sign(np.diff(column[rows], prepend=homes[leg]))
    return np.nan_to_num(moves)


def slopes_of(covariates: Sequence[Covariate], legs: int) -> Slopes:
    """The slopes along covariates, all zero, as a setup has them."""
    of_legs = tuple((each.name, each.of == "lengths") for each in covariates if each.of != "base")
    bases = tuple(each.name for each in covariates if each.of == "base")
    return Slopes(of_legs, np.zeros((legs, len(of_legs))), bases, np.zeros((len(bases), 6)))


def observations_of(
    measurements: Measurements, noise: NoiseSettings, covariates: Sequence[Covariate]
) -> _core.Observations:
    """All that was observed, with the covariates, as the core takes it."""
    of_legs = [each.values for each in covariates if each.of != "base"]
    bases = [each.values for each in covariates if each.of == "base"]
    return measurements.observations(
        noise,
        np.ascontiguousarray(np.hstack(of_legs)) if of_legs else None,
        np.ascontiguousarray(np.column_stack(bases)) if bases else None,
    )
