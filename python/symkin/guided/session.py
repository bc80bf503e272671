# SPDX-License-Identifier: MIT
"""A guided session: what to measure next, what is known after every row, and when it is enough."""

from __future__ import annotations

import contextlib
import dataclasses
import datetime as dt
import math
from collections.abc import Mapping
from pathlib import Path
from typing import Any, Literal

import numpy as np

from symkin.data.measurements import Measurements
from symkin.data.tries import BACK, DROPPED, LINK, ROW, STATUS, TIME, UNDONE
from symkin.errors import SymkinError, one_of
from symkin.estimate.estimate import Estimate
from symkin.estimate.parameters import Unknown
from symkin.estimate.survey import Survey
from symkin.files.mechanism_writer import save_mechanism
from symkin.guided.checks import HiddenSlip, Verdict
from symkin.guided.choosing import Chooser
from symkin.guided.held import Held
from symkin.guided.knowledge import LEAST_DEGREES, TAKEN_AS, Knowledge, Known
from symkin.guided.rows import RowFormat
from symkin.guided.tries_table import AVOID, KEPT, SLIPPED, Failure, TriesTable
from symkin.model.mechanism import Mechanism
from symkin.values import Array, Value, record

__all__ = ["Ask", "Failure", "Progress", "Session"]


_CLOSING, _MOST_CLOSING = 2, 4  # of the first poses, measured again in the end; see below
_FRESH = 2  # rows that may follow these, before they are measured once more
TABLE, ROBOT = "measured.csv", "robot.toml"
_UNCOUNTED: Failure = "skipped"  # of failures: nothing speaks against poses nearby
_LEFT_OUT = (_UNCOUNTED, AVOID)  # which nobody tried


@record
class Ask(Value):
    """A pose to measure.

    Attributes
    ----------
    row : int
        The number that its row will have.
    pose : ndarray, shape (coordinates,)
        Where to send the robot, in the mechanism's own frame, m and rad.
    readings : ndarray, shape (legs,)
        What commands it, by the drawing.
    repeat_of : int or None
        The row that is measured again.
    ahead : ndarray, shape (k, coordinates)
        The poses after it, as far as they are chosen: of the first of a pair, the second is first.
    partner : int or None
        The row before it, if something is measured between both.
    """

    row: int
    pose: Array
    readings: Array
    repeat_of: int | None
    ahead: Array
    partner: int | None = None


@record
class Progress(Value):
    """How far a session is.

    Attributes
    ----------
    rows, failed : int
        Rows that count, and tries that failed.
    position_bound, orientation_bound : float
        What the wanted share of such robots is within over the workspace (rms), m and rad;
        infinite as long as that is not known. Of the position's coordinates that are wanted.
    confidence : float
        That share: of what is wanted; after a repair, half as many robots may miss.
    repaired : bool
        Whether rows were dropped or put right, or something slipped.
    reached : bool
        Whether that is what was wanted, the first poses were measured again since, and nothing is
        doubtful.
    undecided : bool
        Whether nothing else is missing than a decision about what is doubtful.
    more : int
        Rows that are needed besides, as far as can be told.
    closing : int
        Of these the first poses that are measured again, once that is enough: what slipped shortly
        before shows in nothing else.
    degrees : float
        Degrees of freedom of an estimated noise; infinite if it is declared.
    never : bool
        Whether rows of all candidates together would not do.
    position_floor, orientation_floor : float
        What would be left then, m and rad.
    unseen : tuple of str
        The unknowns that priors alone would hold then.
    shown : mapping of str to float
        Coordinates of the position, as `of` has them, that alone would be known as well as was
        wanted of all, where those never will be; and what would be left of each, m.
    failure : str
        Why there is no estimate; empty if there is one.
    suspected : int or None
        The row from which on something may have slipped, if nothing else is missing: as many sound
        sessions as may miss the accuracy look so. Poses are measured again until that is decided.
    hidden : HiddenSlip or None
        What may have slipped meanwhile although the session is enough: the accuracy is of a robot
        whose sensors show what they did.
    """

    rows: int
    failed: int
    position_bound: float
    orientation_bound: float
    confidence: float
    repaired: bool
    reached: bool
    undecided: bool
    more: int
    closing: int
    degrees: float
    never: bool
    position_floor: float
    orientation_floor: float
    unseen: tuple[str, ...]
    failure: str
    shown: Mapping[str, float] = dataclasses.field(default_factory=dict)
    suspected: int | None = None
    hidden: HiddenSlip | None = None


class Session:
    """Measuring, step by step: ask with `next`, tell with `add`, until `progress` is `reached`.

    Made by `measure`, of a `Robot` by its method of that name. Its state is its table alone: the
    same table, drawing and seed ask for the same pose.

    Attributes
    ----------
    target : Target
        What is wanted.
    folder : Path or None
        Where ``measured.csv``, ``robot.toml`` and ``session.json`` are; None in memory.
    noise : "estimate" or None
        Whether the noise is estimated with the unknowns; None: it is the robot's.
    """

    def __init__(
        self,
        robot: Mechanism,
        chooser: Chooser,
        observed: Survey,
        folder: Path | None,
        noise: Literal["estimate"] | None,
        lock: Held | None = None,
    ) -> None:
        self._lock = lock  # others are kept out for as long as this lives
        self.folder, self.target = folder, chooser.target
        self._chooser, self.noise = chooser, noise
        self._written: Mechanism | None = None
        self._format = RowFormat(robot, observed.observed)
        # Frames that nobody knows take as many conditions before anything can be fitted.
        conditions = int(observed.rows(chooser.candidates[0]).any(axis=2).sum())
        self._conditions = conditions / chooser.candidates.shape[1]  # of a row
        least = -(-int(np.isinf(observed.priors).sum()) // max(conditions, 1))
        least *= chooser.candidates.shape[1]
        # A slip in one leg shows the less in a repeat the fewer conditions a row of all legs has.
        shown = conditions / (len(robot.legs) * chooser.candidates.shape[1])
        self._closing = min(math.ceil(_CLOSING / min(shown, 1.0)), _MOST_CLOSING)
        self.columns = self._format.columns
        named = (*self._format.commanded, *self._format.links, *self.columns)
        names = (ROW, "time", TIME, STATUS, "repeat_of", *named)
        path = None if folder is None else folder / TABLE
        self._table = TriesTable(path, (*names, "device", "remark"))
        self._repeating: tuple[int, ...] = ()
        confidence, of = chooser.target.confidence, chooser.target.of
        self._knowledge = Knowledge(robot, self._table, confidence, noise, least, of)
        self._told: dict[int, Progress] = {}
        self._floor: tuple[dict[str, float], tuple[str, ...]] | None = None
        self._seen = self._edition = 0
        self._followed: list[dict[str, Any]] = []  # what the choice was when each line came
        self._follow()
        self._write_robot()

    def next(self) -> Ask | None:
        """Return the pose to measure now; None when the accuracy is reached, or never will be."""
        self.refresh()
        progress = self.progress
        if not self._repeating and (progress.reached or progress.never):
            return None
        return self.asked()

    def asked(self) -> Ask:
        """Return the pose to measure now, even if what is known is enough."""
        repeating, closing = self._repeating, None
        if not repeating and self.progress.closing:
            repeating, *left = self._unchecked()[0]
            closing = self._poses_of(left)
        if not (repeating or self._chooser.planned):
            self._plan(len(self._table.lines))
        row = self._table.next_number
        ahead, again = self._chooser.ahead if closing is None else closing, None
        if repeating:
            again, *more = repeating
            poses = [self._pose_of(self._table.place(each)) for each in (again, *more)]
            pose, ahead = poses[0], np.array([*poses[1:], *ahead]).reshape(-1, ahead.shape[1])
            assert pose is not None
        elif len(ahead):
            pose, ahead = ahead[0], ahead[1:]
        else:
            raise SymkinError("no pose is left to measure: all were measured, failed or avoided")
        readings = self.robot.inverse_kinematics(pose[None])[0]
        return Ask(row, pose, readings, again, ahead, self._begun_by())

    @property
    def asked_columns(self) -> tuple[str, ...]:
        """Those of `columns` that are of the row that is asked for."""
        return self._format.columns_of(self._begun_by())

    def __iter__(self) -> Session:
        """Ask until nothing is left to ask."""
        return self

    def __next__(self) -> Ask:
        """The same as `next`."""
        asked = self.next()
        if asked is None:
            raise StopIteration
        return asked

    def add(
        self,
        row: Mapping[str, float] | Measurements,
        *,
        device: str = "",
        remark: str = "",
    ) -> Progress:
        """Tell what was measured at the pose that was asked for.

        Parameters
        ----------
        row : mapping of str to float, or Measurements
            Values by column, of `columns` and their twins in other units (``x_mm``,
            ``psi_1_deg``). Readings that are not given are those that were commanded. Or
            measurements of one row.
        device : str
            What measured it.
        remark : str
            For people.

        Raises
        ------
        SymkinError
            For columns that it does not have and values that cannot be; nothing is written then.
        """
        asked = self.asked()
        cells = self._format.cells(row, asked.pose, asked.partner)
        status = "ok" if asked.repeat_of is None else "repeat"
        again = "" if asked.repeat_of is None else str(asked.repeat_of)
        self._append(status, asked.pose, cells, device, remark, repeat_of=again)
        return self.progress

    def fail(self, why: Failure = "unreachable", *, remark: str = "") -> None:
        """Tell that the pose could not be measured; another takes its place."""
        one_of("why", why, Failure)
        asked = self.asked()
        again = "" if asked.repeat_of is None else str(asked.repeat_of)
        self._append(why, asked.pose, {}, "", remark, repeat_of=again)

    def skip(self) -> None:
        """Leave the pose out; poses near it are as likely as before."""
        self.fail(_UNCOUNTED)

    def avoid(self) -> None:
        """Leave out the pose and its neighbourhood, or that of the failure before it."""
        asked = self.asked().pose
        failed = [place for place in self._table.standing if self._table.is_failed(place)]
        pose = self._pose_of(failed[-1]) if failed else None
        self._append(AVOID, asked if pose is None else pose, {}, "", "")

    def repeat(self, row: int | None = None) -> None:
        """Measure a row's pose again next, by default that of the last one."""
        counting = self._table.counting
        if not counting:
            raise SymkinError("there is no row yet that could be repeated")
        place = counting[-1] if row is None else self._table.place(row)
        self._repeating = tuple(map(self._table.number, self._table.together(place)))
        self._chooser.start(None)

    def undo(self, row: int | None = None, *, remark: str = "") -> int:
        """Take back a row, by default the last line; its pose is asked for again.

        Nothing is deleted: a line says that the row does not count. Returns its number.
        """
        return self._take_back(UNDONE, row, remark)

    def drop(self, row: int) -> None:
        """Leave out a row that is wrong; more is asked of the others after such a repair."""
        self._take_back(DROPPED, row, "does not fit")

    def keep(self, row: int) -> None:
        """Do not doubt a row any more."""
        self._append(KEPT, None, {}, "", "", number=self._table.number(self._table.place(row)))

    def correct(self, row: int, values: Mapping[str, float], what: str) -> None:
        """Put a row right: it is dropped, and written again with other values."""
        place = self._table.place(row)
        line, pose = self._table.lines[place], self._pose_of(place)
        cells = {name: line[name] for name in self.columns}
        cells |= {name: repr(float(value)) for name, value in values.items()}
        link = {name: line[name] for name in self._format.links}
        self._take_back(DROPPED, row, "does not fit", alone=True)
        status, device, remark = line[STATUS] or "ok", line["device"], f"{TAKEN_AS}{what}"
        self._append(status, pose, cells | link, device, remark, repeat_of=line["repeat_of"])

    def slip(self, row: int) -> None:
        """From this row on the sensors may show something else: the robot is as after it."""
        self._append(SLIPPED, None, {}, "", "", number=self._table.number(self._table.place(row)))

    def resolve(self) -> Verdict | None:
        """Do what is to be done of the last verdict without asking anybody, and return that.

        A doubtful row is measured again. If the repeat fits, the row was wrong and is dropped; if
        not, both are kept, and what has slipped is looked for, from that row on if these would have
        been the last. A slip becomes a step.
        """
        verdict = self.verdict
        if verdict is None or verdict.fine:
            return verdict
        if verdict.slipped is not None:
            self.slip(verdict.slipped)
        elif verdict.decided == "row":
            assert verdict.doubtful is not None
            self.drop(verdict.doubtful)
        elif verdict.decided == "robot":
            assert verdict.doubtful is not None
            self.keep(verdict.doubtful)
            self.keep(verdict.row)
            if self.progress.reached:  # no row would come that could show what has slipped
                self.slip(verdict.doubtful)
        else:
            self.repeat(verdict.doubtful)
        return verdict

    def refresh(self) -> bool:
        """Take in what others have appended to the file; says whether there was any."""
        found = self._table.refresh()
        if found:
            self._follow()
        return found

    @property
    def robot(self) -> Mechanism:
        """What `identify` takes with the session's table: the drawing and what is unknown of it."""
        return self._now.robot

    @property
    def tries(self) -> int:
        """Lines of its table, of whatever kind."""
        return len(self._table.lines)

    @property
    def measurements(self) -> Measurements | None:
        """What was measured and counts; None before the first row."""
        return self._table.measurements(self.robot)

    @property
    def estimate(self) -> Estimate[Any] | None:
        """What is known now, as `identify` has it of `robot` and the table; None before it can."""
        return self._now.estimate

    @property
    def verdict(self) -> Verdict | None:
        """What the last row and those before it say; None before the first."""
        return self._knowledge.verdict(self._chooser.more)

    @property
    def progress(self) -> Progress:
        """How far it is."""
        count = len(self._table.lines)
        if count not in self._told:
            self._told = {count: self._progress()}
        return self._told[count]

    @property
    def confidence(self) -> float:
        """Share of such robots that the bounds are for: after a repair, half as many may miss."""
        return self._asked_of(self._now)

    @property
    def slips(self) -> dict[int, list[Unknown]]:
        """Of each row from which on something shows something else: by how much, as unknowns."""
        settings, estimate = self.robot.identification, self.estimate
        found: dict[int, list[Unknown]] = {}
        for step in (settings.step or ()) if settings is not None else ():
            line = step.rpartition(":")[2]
            found[self._table.number(int(line) - 2)] = [
                each
                for each in (() if estimate is None else estimate.unknowns)
                if f"step{line}" in each.name.split(".") and each.column >= 0
            ]
        return found

    @property
    def torn(self) -> str:
        """What was cut off the table, since it had not been written to its end."""
        return self._table.torn

    @property
    def edited(self) -> Path | None:
        """Where the table is kept as another program had saved it, if that was put right."""
        return self._table.edited

    @property
    def is_behind(self) -> bool:
        """Whether ``robot.toml`` could not be written since the last line."""
        return self.folder is not None and self.robot is not self._written

    @property
    def suggests_avoiding(self) -> bool:
        """Whether the last failure was the second nearby."""
        return self._chooser.region_fails

    @property
    def _now(self) -> Known:
        return self._knowledge.of(len(self._table.lines))

    def _asked_of(self, known: Known) -> float:
        wanted = self.target.confidence
        return 1 - (1 - wanted) / 2 if known.repaired else wanted

    def _plan(self, upto: int) -> None:
        """Choose poses by what so many lines say."""
        known = self._knowledge.of(upto)
        again = self._poses_of(self._unchecked(upto)[0])
        self._chooser.plan(known.estimate, self._asked_of(known), again)

    def _poses_of(self, groups: list[tuple[int, ...]]) -> Array:
        """Where whole groups of rows were measured, one below the other, if that is known."""
        _, together, coordinates = self._chooser.candidates.shape
        found: list[Array] = []
        for group in groups:
            poses = [self._pose_of(self._table.place(number)) for number in group]
            known = [pose for pose in poses if pose is not None]
            found += known if len(known) == together else []
        return np.array(found).reshape(-1, coordinates)

    def _progress(self) -> Progress:
        known = self._now
        bounds, failure = self._knowledge.bounds(known, self.confidence)
        degrees, short = math.inf, 0
        if self.noise == "estimate":
            found = known.estimate
            own = 0.0 if found is None else found.degrees_of_freedom
            degrees = max(own, 0.0)
            short = math.ceil((LEAST_DEGREES - own) / self._conditions)
        wanted = self.target.wanted
        reached = all(bounds[name] <= value for name, value in wanted.items())
        if self._floor is None:
            self._floor = self._chooser.floor()
        floor, unseen = self._floor
        never = not reached and any(floor[name] > value for name, value in wanted.items())
        reached = reached and degrees >= LEAST_DEGREES
        left, suspected = self._unchecked()
        unchecked, again = sum(map(len, left)), self._poses_of(left)
        closing = reached
        if not reached and known.estimate is not None and len(again) and not self._chooser.begun:
            closing = degrees >= LEAST_DEGREES and self._chooser.reaches(
                known.estimate, self.confidence, again
            )
        verdict = self.verdict
        doubtful = verdict is not None and not verdict.fine
        # What is decided of a doubtful row changes what is known, and so the poses that help most.
        if not (self._chooser.planned or closing or never or doubtful):
            self._plan(len(self._table.lines))
        enough = reached and not unchecked
        undecided = enough and doubtful
        failed = [each for each in self._table.standing if self._table.is_failed(each)]
        return Progress(
            rows=len(self._table.counting),
            failed=sum(self._table.lines[each][STATUS] not in _LEFT_OUT for each in failed),
            position_bound=bounds["position"],
            orientation_bound=bounds["orientation"],
            confidence=self.confidence,
            repaired=known.repaired,
            reached=enough and not undecided,
            undecided=undecided,
            more=max(
                unchecked + (0 if closing or never else max(self._chooser.more, 1)),
                0 if never else short,
            ),
            closing=unchecked if closing else 0,
            degrees=degrees,
            never=never,
            position_floor=floor["position"],
            orientation_floor=floor["orientation"],
            unseen=unseen,
            failure=failure,
            shown=self._chooser.shown if never else {},
            suspected=suspected if closing else None,
            hidden=self._knowledge.hidden(known) if enough and not undecided else None,
        )

    def _follow(self) -> None:
        """Let the choice of poses follow the lines that it has not seen.

        Poses are planned when the line before has left none, by what was known then: so a session
        that begins again asks for the same ones. What came after a row that was taken back is
        followed anew, without plans: those poses are known.
        """
        table, lines, chooser = self._table, self._table.lines, self._chooser
        backs = {
            place: table.place(int(line[ROW]))
            for place, line in enumerate(lines)
            if line[STATUS] in BACK
        }
        first = min([self._seen, *(row for place, row in backs.items() if place >= self._seen)])
        if table.edition != self._edition:
            first, self._edition = 0, table.edition
        if first < self._seen:
            self._told.clear()
            self._knowledge.forget(first)
            chooser.back(self._followed[first])
        standing = set(table.standing)
        after = {
            place: standing.intersection(range(row + 1, place)) for place, row in backs.items()
        }
        known = set[int]().union(*after.values())
        for place in range(first, len(lines)):
            if place in standing and not (chooser.planned or place in known):
                self._plan(place)
            self._followed[place:] = [chooser.kept()]
            if lines[place][STATUS] == SLIPPED or after.get(place):
                chooser.again()
            if place in standing:
                self._tell(place)
        self._seen = len(lines)
        self._repeating = self._left_to_repeat()

    def _left_to_repeat(self) -> tuple[int, ...]:
        """Rows that are measured again with the last line, which is the first of them."""
        if not self._table.lines or not self._chooser.begun:
            return ()
        again = self._table.lines[-1]["repeat_of"]
        if not again.isdigit():
            return ()
        group = self._table.together(self._table.place(int(again)))
        return tuple(number for number in map(self._table.number, group) if number > int(again))

    def _unchecked(self, upto: int | None = None) -> tuple[list[tuple[int, ...]], int | None]:
        """Rows to measure again in the end: the first ones since something slipped, if anything.

        Each shortly before the end; if that fails, another one, unless somebody leaves it out. Then
        one that decides whether something has slipped, as long as it may have: from that row on. Of
        so many lines, by default all.
        """
        table, count = self._table, len(self._table.lines) if upto is None else upto
        slipped = table.said(SLIPPED, upto=upto)
        begin = table.place(slipped[-1]) if slipped else 0
        ordinary = [
            place
            for place in table.counting
            if begin <= place < count
            and not table.lines[place]["repeat_of"]
            and table.together(place)[0] == place
        ]
        stale = ordinary[-_FRESH - 1] if len(ordinary) > _FRESH else -1
        tried = {
            table.lines[place]["repeat_of"]: place
            for place in table.standing
            if stale < place < count
        }
        left, wanted = [], self._closing
        for place in ordinary[:-1]:
            again = tried.get(str(table.number(place)))
            if again is None:
                left.append(tuple(map(table.number, table.together(place))))
            elif table.is_failed(again) and table.lines[again][STATUS] != _UNCOUNTED:
                continue
            wanted -= 1
            if not wanted:
                break
        begun, places = (None, []) if left or not tried else self._suspected(count)
        for place in places:
            if place in ordinary[:-1] and str(table.number(place)) not in tried:
                return [tuple(map(table.number, table.together(place)))], begun
        return left, None

    def _suspected(self, count: int) -> tuple[int | None, list[int]]:
        """The row from which on something may have slipped, and places of those that decide that.

        By so many lines; none once somebody has left out to measure one of them.
        """
        last = self._table.lines[[each for each in self._table.standing if each < count][-1]]
        left_out = last["repeat_of"] and last[STATUS] == _UNCOUNTED
        found = self._knowledge.suspected(count, 1 - self.target.confidence)
        return (None, []) if left_out or found is None else found

    def _begun_by(self) -> int | None:
        """The row that the next one is measured with."""
        if not self._chooser.begun:
            return None
        measured = [each for each in self._table.standing if self._table.is_measured(each)]
        return self._table.number(measured[-1])

    def _tell(self, place: int) -> None:
        pose, status = self._pose_of(place), self._table.lines[place][STATUS]
        if self._table.is_measured(place):
            group = [self._pose_of(each) for each in self._table.together(place) if each <= place]
            if self._format.links and not self._table.lines[place][LINK]:
                self._chooser.start(pose)
            else:
                known = all(each is not None for each in group)
                self._chooser.take(np.array(group) if known else None)
        elif pose is not None:
            counts = status not in _LEFT_OUT
            self._chooser.fail(pose, counts=counts, avoid=status == AVOID)

    def _pose_of(self, place: int) -> Array | None:
        return self._format.pose(self._table.lines[place])

    def _take_back(self, status: str, row: int | None, remark: str, *, alone: bool = False) -> int:
        """Say that a row does not count, nor what was measured with it unless it is `alone`."""
        standing = self._table.standing
        if not standing:
            raise SymkinError("there is no row yet that could be taken back")
        place = standing[-1] if row is None else self._table.place(row)
        number = self._table.number(place)
        if place not in standing:
            raise SymkinError(f"row {number} is taken back already")
        group = (place,) if alone else self._table.together(place)
        for each in group:
            if each in standing:
                own = self._table.number(each)
                self._append(status, None, {}, "", remark, number=own)
        return number

    def _append(
        self,
        status: str,
        pose: Array | None,
        cells: Mapping[str, str],
        device: str,
        remark: str,
        *,
        repeat_of: str = "",
        number: int | None = None,
    ) -> None:
        self._table.refresh()  # others may have appended rows since
        now = dt.datetime.now(dt.UTC)
        self._table.append(
            {
                ROW: str(number or self._table.next_number),
                "time": now.isoformat(timespec="milliseconds"),
                TIME: f"{self._since_the_first(now):.3f}",
                STATUS: status,
                "repeat_of": repeat_of,
                **({} if pose is None else self._format.commanded_cells(pose)),
                **cells,
                "device": " ".join(device.split()),
                "remark": " ".join(remark.split()),
            }
        )
        self._follow()
        self._write_robot()

    def _since_the_first(self, now: dt.datetime) -> float:
        """Seconds since the first row, which never run backwards, whatever the clock does."""
        for line in reversed(self._table.lines):
            with contextlib.suppress(ValueError, TypeError):  # of rows that others wrote
                passed = now - dt.datetime.fromisoformat(line["time"])
                return float(line[TIME]) + max(passed.total_seconds(), 0.0)
        return 0.0

    def _write_robot(self) -> None:
        """Keep the robot's file as `identify` needs it for the same result.

        Where that fails, as on a full disk, it is tried again with the next line: the rows are in
        the table.
        """
        robot = self.robot
        if self.folder is None or robot is self._written:
            return
        new = self.folder / f".{ROBOT}"
        with contextlib.suppress(SymkinError, OSError):
            save_mechanism(robot, new, overwrite=True)
            new.replace(self.folder / ROBOT)
            self._written = robot
