# SPDX-License-Identifier: MIT
"""What a person enters beside the robot: keys and rows, in a line or in the fields of a page."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping, Sequence
from typing import NamedTuple

from symkin.data.sensor_tables import shown_readings
from symkin.errors import SymkinError
from symkin.guided import Session, Verdict
from symkin.show.guided import verdict_text
from symkin.show.units import on_paper
from symkin.show.wording import plural

KEYS = {"s": "skip", "o": "occluded", "a": "avoid region", "r": "repeat", "u": "undo"}
QUIT = "q"
_QUITTING = (QUIT, "quit", "exit")
_DECIDING = ("t", "d", "k")
_NOT_SEEN = ("-", "?")
_READING, _HEIGHT, _TOUCHED = "psi_", "height_m", "touched_m"
TOUCHING = (
    "A height is the tool's above the bed, with the readings there. Of a probe that touches it is "
    "0: enter the readings and 0, or as z 0.12 what the controller says of z there, by the drawing."
)


def quits(line: str) -> bool:
    """Whether a line says that no more is entered now."""
    return line.strip().lower() in _QUITTING


class Entry(NamedTuple):
    """What is typed of a row: its name and unit, how many SI units one is, and its column."""

    name: str
    unit: str
    factor: float
    column: str

    @property
    def is_reading(self) -> bool:
        """Whether the commanded one stands in for it."""
        return self.column.startswith(_READING)

    @property
    def told(self) -> str:
        """As a prompt shows it."""
        return f"{self.name}[{self.unit}]" if self.unit else self.name


def entries_of(columns: Sequence[str]) -> list[Entry]:
    """What is typed of a row of a session's columns."""
    found = []
    for column in columns:
        stem, _, unit = column.rpartition("_")
        factor, sign = on_paper(unit) if unit in ("m", "rad") else (1.0, "")
        found.append(Entry(stem if sign else column, sign, 1 / factor, column))
    return found


def obeyed(session: Session, line: str) -> str:
    """Do what a line says, a key or a row, and return what is to be told of it."""
    key = line.strip().lower()
    if key == "s":
        session.skip()
    elif key == "o":
        session.fail("occluded")
        if session.suggests_avoiding:
            return "The second failure there: a leaves the region out."
    elif key == "a":
        session.avoid()
        return "No pose like that one is asked for any more."
    elif key in ("r", *_DECIDING):
        _decide(session, key)
    elif key == "u":
        return f"Row {session.undo()} is taken back."
    else:
        touched = re.fullmatch(r"z\b\s*=?\s*(\S+)", key) if touches(session) else None
        if touched is not None:
            session.add(_touch(session, touched[1]))
        else:
            session.add(_row(line.strip(), entries_of(session.asked_columns)))
        verdict = session.verdict
        return "" if verdict is None else verdict_text(verdict)
    return ""


def touches(session: Session) -> bool:
    """Whether heights above a bed are entered, as of a probe that touches it."""
    return {_HEIGHT} == {each for each in session.columns if not each.startswith(_READING)}


def touching(session: Session) -> list[Entry]:
    """What a page asks for besides, of a probe that touches."""
    heights = [each for each in entries_of(session.columns) if each.column == _HEIGHT]
    named = [each._replace(name="or z where it touched", column=_TOUCHED) for each in heights]
    return named if touches(session) else []


def _touch(session: Session, text: str) -> dict[str, float]:
    """A row of a probe that touched where the controller, by the drawing, says that z is this."""
    pose, (entry,) = session.asked().pose.copy(), touching(session)
    pose[len(session.robot.space.position) - 1] = _number(text, entry._replace(name="z"))
    readings = shown_readings(session.robot, session.robot.inverse_kinematics(pose[None]))[0]
    names = [each for each in session.columns if each.startswith(_READING)]
    return {_HEIGHT: 0.0, **dict(zip(names, readings.tolist(), strict=True))}


def entered(session: Session, fields: Mapping[str, str]) -> None:
    """Take a row from fields, by column.

    What was measured must be there, with "-" for what was not seen; readings that are left empty
    are those that were commanded.

    Raises
    ------
    SymkinError
        For an empty field and for what is no number, naming it; nothing is written then.
    """
    touched, row = fields.get(_TOUCHED, "").strip(), {}
    if touched and touches(session):
        if fields.get(_HEIGHT, "").strip():
            raise SymkinError("a height and where it touched were entered; expected one of them")
        session.add(_touch(session, touched))
        return
    for entry in entries_of(session.asked_columns):
        text = fields.get(entry.column, "").strip()
        if text:
            row[entry.column] = _number(text, entry)
        elif not entry.is_reading:
            raise SymkinError(f"{entry.told} is empty; expected a number, or - if it was not seen")
    session.add(row)


def decisions(verdict: Verdict | None) -> dict[str, str]:
    """The keys that decide what a verdict says is doubtful, and what they do."""
    if verdict is None or verdict.fine:
        return {}
    number = verdict.doubtful
    if verdict.decided == "row":
        return {"d": f"drop row {number}", "k": "keep it"}
    if verdict.decided == "robot":
        return {"k": "keep both", "d": f"drop row {number}"}
    if number is not None:
        likely = {"t": "take it so"} if verdict.likely else {}
        return {**likely, "r": "repeat its pose", "d": f"drop row {number}", "k": "keep it"}
    return {"t": "take it as a step", "k": "keep on without"}


def _decide(session: Session, key: str) -> None:
    """Do what is wanted about a doubtful row or a slip; without one, repeat or drop the last."""
    verdict = session.verdict
    if verdict is None:
        raise SymkinError("there is no row yet")
    number, slipped = verdict.doubtful, verdict.slipped
    if key == "r":
        session.repeat(number)
    elif key == "t" and slipped is not None:
        session.slip(slipped)
    elif key == "t" and number is not None and verdict.likely:
        session.correct(number, verdict.edited, verdict.likely)
    elif key == "d" and number is not None:
        session.drop(number)
    elif key == "k" and number is not None:
        session.keep(number)
        if verdict.decided == "robot":
            session.keep(verdict.row)
    elif key == "k" and slipped is not None:
        session.keep(slipped)
    else:
        raise SymkinError(f"nothing is doubtful that {key} could decide")


def _row(line: str, entries: Sequence[Entry]) -> dict[str, float]:
    """A row that was typed or pasted: all columns, or those before the readings."""
    parts = re.split(r"[\s;]+", line) if re.search(r"[\s;]", line) else line.split(",")
    parts = [part.rstrip(",") for part in parts if part.strip(",")]
    measured = [entry for entry in entries if not entry.is_reading]
    given = entries if len(parts) == len(entries) else measured
    if len(parts) == 1 and parts[0] not in _NOT_SEEN and not re.search(r"\d", parts[0]):
        keys = ", ".join((*KEYS, *_DECIDING, QUIT))
        raise SymkinError(f'"{parts[0]}" is no key and no row; expected {keys}, or numbers')
    if len(parts) != len(given):
        names = ", ".join(f"{entry.name} {entry.unit}".strip() for entry in entries)
        counts = f"{len(measured)} or " if measured else ""
        raise SymkinError(
            f"{plural(len(parts), 'value')} entered; expected {counts}{len(entries)}: {names}"
        )
    return {entry.column: _number(part, entry) for part, entry in zip(parts, given, strict=True)}


def _number(text: str, entry: Entry) -> float:
    try:
        return math.nan if text in _NOT_SEEN else entry.factor * float(text.replace(",", "."))
    except ValueError:
        name = f"{entry.name} {entry.unit}".strip()
        raise SymkinError(f'"{text}" is no number ({name}); expected one, or - for none') from None
