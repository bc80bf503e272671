# SPDX-License-Identifier: MIT
"""The table of a session: a line a try, appended and never changed, in a file or in memory."""

from __future__ import annotations

import csv
import io
import math
import os
import time
from collections.abc import Collection, Iterable, Mapping, Sequence
from contextlib import suppress
from pathlib import Path
from typing import Literal, get_args

from symkin.data.measurements import Measurements
from symkin.data.observables import COMMANDED
from symkin.data.reading import read_measurements
from symkin.data.tries import BACK, COUNTING, LINK, NOTES, ROW, STATUS, TIME, counting_rows
from symkin.errors import MeasurementError, SymkinError
from symkin.model.mechanism import Mechanism
from symkin.storage.tables import is_utf16

# Lines that say something of another line, whose number they have.
SLIPPED, KEPT = "slipped", "kept"
_REMARKS = (*BACK, SLIPPED, KEPT)
Failure = Literal["unreachable", "occluded", "lost", "skipped"]
AVOID = "avoid"
_STATUSES = ("", *COUNTING, *get_args(Failure), AVOID, *_REMARKS)
_WAIT, _WAITS = 0.05, 10  # s, and how often, for the end of a line that somebody else writes
Line = dict[str, str]  # cells by column; all of them


class TriesTable:
    """Lines of a session's table.

    A line is written at once and synced, so that a session that is killed has lost nothing that it
    had acknowledged. A last line that was torn is cut off to ``measured.csv.partial``. A table that
    another program has saved in another form (columns in another order, semicolons, decimal commas,
    rows sorted anew) is put back into its own; as it was it stays as ``measured.csv.edited``.

    Attributes
    ----------
    path : Path or None
        The file; None in memory.
    columns : tuple of str
        Its header.
    lines : list of dict
        All of them, as text.
    torn : str
        What was cut off; empty if nothing was.
    edited : Path or None
        Where the file is kept as another program had saved it, if that was put right.
    edition : int
        How often lines that were known have changed.
    """

    def __init__(self, path: Path | None, columns: Sequence[str]) -> None:
        self.path, self.columns = path, tuple(columns)
        self.lines: list[Line] = []
        self.torn, self.edition = "", 0
        self.edited: Path | None = None
        self._read = b""
        if path is None:
            return
        if path.exists():
            self._cut()
        if not path.exists() or not path.stat().st_size:
            self._write(",".join(self.columns) + "\n")
        self.refresh()

    def refresh(self) -> bool:
        """Read what others have changed since, whole lines alone; says whether there was any."""
        if self.path is None:
            return False
        data = self._data()
        if self._read and data.startswith(self._read):
            added = _whole(data[len(self._read) :])
            if not added:
                return False
            lines = [*self.lines, *self._lines_of(added, len(self.lines))]
            self._check(lines)
        else:
            lines = self._from_the_start(_whole(data))
            data = self._data()
            self.edition += bool(self._read)
        self.lines, self._read = lines, _whole(data)
        return True

    def append(self, cells: Mapping[str, str]) -> None:
        """Add a line and make sure that it is on the disk.

        Raises
        ------
        SymkinError
            If it cannot be written; the table is as before.
        """
        unknown = sorted(cells.keys() - set(self.columns))
        if unknown:
            raise SymkinError(
                f'the session\'s table has no column "{unknown[0]}"; expected of '
                f"{', '.join(self.columns)}"
            )
        line = {name: cells.get(name, "") for name in self.columns}
        if self.path is None:
            self.lines.append(line)
            return
        for _ in range(_WAITS):  # whoever appends a line beside has it written soon
            if _whole(data := self._data()) == data:
                break
            time.sleep(_WAIT)
        else:
            self._cut()
        self._write(_text([line.values()]))
        self.refresh()

    @property
    def next_number(self) -> int:
        """The number of the next try."""
        return max(len(self.lines), *self._numbers(self.lines), 0) + 1

    def number(self, place: int) -> int:
        """The number of a line's try: what it says itself, or else its place from 1."""
        own = self.lines[place][ROW]
        return int(own) if own.isdigit() else place + 1

    @property
    def counting(self) -> list[int]:
        """Places, from 0, of the lines whose measurements count."""
        statuses = [line[STATUS] for line in self.lines]
        numbers = [line[ROW] for line in self.lines]
        return [int(place) for place in counting_rows(statuses, numbers)]

    def counting_of(self, count: int, without: Collection[int] = ()) -> list[int]:
        """Those of so many first lines, but for `without`."""
        return [each for each in self.counting if each < count and each not in without]

    @property
    def standing(self) -> list[int]:
        """Places of all lines that were not taken back, failures too."""
        back = {line[ROW] for line in self.lines if line[STATUS] in BACK}
        return [
            place
            for place, line in enumerate(self.lines)
            if line[STATUS] not in _REMARKS and str(self.number(place)) not in back
        ]

    def measurements(
        self,
        robot: Mechanism,
        upto: int | None = None,
        without: Sequence[int] = (),
        edited: Mapping[int, Mapping[str, float]] | None = None,
    ) -> Measurements | None:
        """What counts of the first lines, by default of all; None of nothing.

        What a later line takes back does not count, nor do lines `without` which, by their places;
        of others the values may be `edited`.
        """
        count = len(self.lines) if upto is None else upto
        kept = self.counting_of(count, without)
        if not kept:
            return None
        lines = []
        for place, line in enumerate(self.lines[:count]):
            values = (edited or {}).get(place, {})
            status = line[STATUS] if place in kept else BACK[0]
            cells = {name: repr(value) for name, value in values.items()}
            # A line that does not count takes back none but itself.
            number = str(self.number(place)) if place in kept else str(-place - 1)
            lines.append(line | cells | {STATUS: status, ROW: number})
        return self._measured(robot, lines)

    def alone(
        self, robot: Mechanism, place: int, edits: Sequence[Mapping[str, float]]
    ) -> list[Measurements]:
        """One line as it would be with each of these values; none if one of them cannot be read."""
        lines = []
        for number, values in enumerate(edits, 1):
            cells = {name: repr(value) for name, value in values.items()}
            lines.append(self.lines[place] | cells | {ROW: str(number), "repeat_of": ""})
        try:
            read = self._measured(robot, lines)
        except SymkinError:
            return []
        return [read[each : each + 1] for each in range(len(read))]

    def _measured(self, robot: Mechanism, lines: Sequence[Mapping[str, str]]) -> Measurements:
        """Lines as a table of this file is read."""
        stream = io.StringIO()
        stream.name = str(self.path or "the session")
        writer = csv.DictWriter(stream, self.columns, lineterminator="\n")
        writer.writeheader()
        writer.writerows(lines)
        stream.seek(0)
        return read_measurements(stream, robot)

    def said(self, *statuses: str, upto: int | None = None) -> list[int]:
        """The numbers of the lines of which the first lines say this, in their order."""
        return [int(line[ROW]) for line in self.lines[:upto] if line[STATUS] in statuses]

    def values(self, place: int) -> dict[str, float]:
        """The measured numbers of a line, by column."""
        line = self.lines[place]
        names = [name for name in self.columns if name not in (*NOTES, TIME, LINK)]
        return {
            name: float(line[name])
            for name in names
            if line[name] and not name.startswith(COMMANDED)
        }

    def together(self, place: int) -> tuple[int, ...]:
        """Places of the line and of those that it was measured with, in their order."""
        if LINK not in self.columns:
            return (place,)
        own, link = str(self.number(place)), self.lines[place].get(LINK, "")
        return tuple(
            each
            for each in range(len(self.lines))
            if each == place
            or (
                self.is_measured(each)
                and (str(self.number(each)) == link or self.lines[each].get(LINK) == own)
            )
        )

    def is_measured(self, place: int) -> bool:
        """Whether a line is of a measurement, whatever became of it."""
        return self.lines[place][STATUS] in ("", *COUNTING)

    def is_failed(self, place: int) -> bool:
        """Whether a line is of a try that failed."""
        return self.lines[place][STATUS] not in ("", *COUNTING, *_REMARKS)

    def place(self, number: int) -> int:
        """Where the line of a try stands, from 0.

        Raises
        ------
        SymkinError
            If there is none.
        """
        for place, line in enumerate(self.lines):
            if line[STATUS] not in _REMARKS and self.number(place) == number:
                return place
        raise SymkinError(f"there is no row {number}; expected 1 to {len(self.lines)}")

    def _from_the_start(self, data: bytes) -> list[Line]:
        """All lines of the file, which is put into its own form if it has another."""
        if is_utf16(data):
            raise MeasurementError(
                f"{self.path}: is saved as UTF-16; expected it saved as CSV in UTF-8"
            )
        text = _decoded(data)
        first = text.partition("\n")[0].rstrip("\r")
        mark = max(",;\t", key=first.count)
        header = [each.strip() for each in next(csv.reader([first], delimiter=mark), [])]
        self._check_header(header)
        changed = mark != "," or header != list(self.columns)
        if changed:
            lines = self._put_right(text, mark)
        else:
            lines = self._lines_of(data.partition(b"\n")[2], 0)
        if self._numbers(lines) != sorted(self._numbers(lines)):
            lines, changed = self._in_their_order(lines), True
        self._check(lines)
        if changed:
            own = _text([self.columns, *(line.values() for line in lines)])
            self._replace(data, own.encode())
        return lines

    def _lines_of(self, data: bytes, before: int) -> list[Line]:
        """Lines as this table writes them, behind so many others."""
        lines: list[Line] = []
        for record in _records(_decoded(data), ","):
            if len(record) != len(self.columns):
                raise self._wrong(
                    before + len(lines),
                    f"has {len(record)} cells; expected {len(self.columns)}",
                )
            lines.append(dict(zip(self.columns, record, strict=True)))
        return lines

    def _put_right(self, text: str, mark: str) -> list[Line]:
        """Lines of a file that another program has saved in a form of its own."""
        header, *records = _records(text, mark)
        lines: list[Line] = []
        for record in records:
            cells = record + [""] * (len(header) - len(record))
            if len(cells) > len(header):
                raise self._wrong(len(lines), f"has {len(cells)} cells; expected {len(header)}")
            line = dict(zip(header, cells, strict=True))
            if mark != ",":
                line |= {name: line[name].replace(",", ".") for name in self._numeric}
            lines.append({name: line[name] for name in self.columns})
        return lines

    def _in_their_order(self, lines: list[Line]) -> list[Line]:
        """Lines that were sorted by something else, by when they were written."""
        times = [_number(line[TIME]) for line in lines]
        order = sorted(range(len(lines)), key=lambda place: times[place])
        found = [lines[place] for place in order]
        if any(map(math.isnan, times)) or self._numbers(found) != sorted(self._numbers(found)):
            raise MeasurementError(
                f"{self.path}: its rows are not in the order in which they were measured, and "
                f"nothing tells which that was; sort them by {ROW}"
            )
        return found

    def _replace(self, before: bytes, after: bytes) -> None:
        """Put the file into its own form, and keep it as it was."""
        assert self.path is not None
        count, kept = 1, self.path.with_name(f"{self.path.name}.edited")
        while kept.exists():
            count += 1
            kept = self.path.with_name(f"{self.path.name}.edited{count}")
        new = self.path.with_name(f".{self.path.name}")
        try:
            for path, data in ((kept, before), (new, after)):
                with path.open("wb") as file:
                    file.write(data)
                    file.flush()
                    os.fsync(file.fileno())
            new.replace(self.path)
        except OSError as error:
            raise SymkinError(
                f"{self.path}: cannot be put back into the session's form: {error.strerror}"
            ) from error
        self.edited = kept

    @property
    def _numeric(self) -> list[str]:
        return [name for name in self.columns if name not in NOTES]

    def _numbers(self, lines: Sequence[Line]) -> list[int]:
        """Of tries, in the order of their lines."""
        return [
            int(line[ROW]) if line[ROW].isdigit() else place
            for place, line in enumerate(lines, 1)
            if line[STATUS] not in _REMARKS
        ]

    def _check(self, lines: Sequence[Line]) -> None:
        """Refuse what nobody can have meant."""
        numbers, seen = set(self._numbers(lines)), set[int]()
        for place, line in enumerate(lines):
            status, row, again = line[STATUS], line[ROW], line["repeat_of"]
            if status not in _STATUSES:
                known = ", ".join(each for each in _STATUSES if each)
                raise self._wrong(place, f'has the {STATUS} "{status}"; expected none, or {known}')
            for name in self._numeric:
                if line[name] and math.isnan(_number(line[name])):
                    raise self._wrong(place, f'has "{line[name]}" for {name}; expected a number')
            if (row and not row.isdigit()) or (status in _REMARKS and not row):
                raise self._wrong(place, f'has the number "{row}"; expected one as 12')
            told = [row] if status in _REMARKS else [again] if again else []
            for each in told:
                if not (each.isdigit() and int(each) in numbers):
                    raise self._wrong(
                        place, f"tells of row {each}, which is not there; expected it back, or "
                        "this line taken out too"
                    )  # fmt: skip
            if status not in _REMARKS:
                own = int(row) if row else place + 1
                if own in seen:
                    raise self._wrong(place, f"has the number {own} of another one")
                seen.add(own)

    def _wrong(self, place: int, what: str) -> MeasurementError:
        return MeasurementError(f"{self.path}: row {place + 2} {what}")

    def _check_header(self, found: Sequence[str]) -> None:
        if sorted(found) != sorted(self.columns):
            strange = [name for name in found if name not in self.columns]
            missing = [name for name in self.columns if name not in found]
            told = [f'"{name}" is none of its columns' for name in strange[:1]]
            told += [f'"{name}" is missing' for name in missing[:1]]
            raise SymkinError(
                f"{self.path}: is not the table of this session: "
                f"{' and '.join(told) or 'a column is there twice'}; expected the columns as they "
                "were, or for another robot or --observe another folder"
            )

    def _cut(self) -> None:
        """Take off a last line that was not written to its end."""
        assert self.path is not None
        data = self._data()
        end = len(_whole(data))
        if end < len(data) and not is_utf16(data):
            self.torn = data[end:].decode("utf-8", "replace")
            partial = self.path.with_name(f"{self.path.name}.partial")
            with partial.open("ab") as file:
                file.write(data[end:] + b"\n")
                os.fsync(file.fileno())
            with self.path.open("rb+") as file:
                file.truncate(end)
                os.fsync(file.fileno())

    def _data(self) -> bytes:
        assert self.path is not None
        try:
            return self.path.read_bytes()
        except OSError as error:
            raise SymkinError(
                f"{self.path}: cannot be read: {error.strerror}; the session goes on once it can"
            ) from error

    def _write(self, text: str) -> None:
        assert self.path is not None
        size = self.path.stat().st_size if self.path.exists() else 0
        try:
            with self.path.open("ab") as file:
                file.write(text.encode())
                file.flush()
                os.fsync(file.fileno())
        except OSError as error:
            with suppress(OSError):
                os.truncate(self.path, size)
            raise SymkinError(
                f"{self.path}: cannot be written to: {error.strerror}; nothing was entered, and "
                "can be again once there is room"
            ) from error


def _whole(data: bytes) -> bytes:
    """Without a last line that has no end."""
    return data[: data.rfind(b"\n") + 1]


def _decoded(data: bytes) -> str:
    return data.decode("utf-8-sig", "replace")


def _records(text: str, mark: str) -> list[list[str]]:
    """Cells of the lines that are not empty."""
    rows = csv.reader(io.StringIO(text, newline=""), delimiter=mark)
    found = [[cell.strip() for cell in row] for row in rows]
    return [row for row in found if any(row)]


def _text(rows: Iterable[Iterable[str]]) -> str:
    text = io.StringIO()
    csv.writer(text, lineterminator="\n").writerows(rows)
    return text.getvalue()


def _number(text: str) -> float:
    """NaN for what is none."""
    try:
        return float(text)
    except ValueError:
        return math.nan
