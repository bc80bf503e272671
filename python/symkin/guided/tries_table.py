# SPDX-License-Identifier: MIT
"""The table of a session: a line a try, appended and never changed, in a file or in memory."""

from __future__ import annotations

import csv
import io
import os
from collections.abc import Mapping, Sequence
from pathlib import Path

from symkin.data.measurements import Measurements
from symkin.data.observables import COMMANDED
from symkin.data.reading import read_measurements
from symkin.data.tries import BACK, COUNTING, LINK, NOTES, ROW, STATUS, TIME, counting_rows
from symkin.errors import MeasurementError, SymkinError
from symkin.model.mechanism import Mechanism

__all__ = ["KEPT", "SLIPPED", "TriesTable"]

# Lines that say something of another line, whose number they have.
SLIPPED, KEPT = "slipped", "kept"
_REMARKS = (*BACK, SLIPPED, KEPT)
Line = dict[str, str]  # cells by column; all of them


class TriesTable:
    """Lines of a session's table.

    A line is written at once and synced, so that a session that is killed has lost nothing that it
    had acknowledged. A last line that was torn is cut off to ``measured.csv.partial``.

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
    """

    def __init__(self, path: Path | None, columns: Sequence[str]) -> None:
        self.path, self.columns = path, tuple(columns)
        self.lines: list[Line] = []
        self.torn = ""
        self._read = 0
        if path is None:
            return
        if not path.exists() or not path.stat().st_size:
            self._write(",".join(self.columns) + "\n")
        self._cut()
        self.refresh()

    def refresh(self) -> bool:
        """Read what others have appended since, whole lines alone; says whether there was any."""
        if self.path is None:
            return False
        with self.path.open("rb") as file:
            file.seek(self._read)
            data = file.read()
        whole = data[: data.rfind(b"\n") + 1]
        records = list(csv.reader(io.StringIO(whole.decode("utf-8", "replace"))))
        if self._read == 0 and records:
            self._check_header([each.strip() for each in records.pop(0)])
        records = [each for each in records if any(cell.strip() for cell in each)]
        for record in records:
            if len(record) != len(self.columns):
                number = len(self.lines) + 2
                raise MeasurementError(
                    f"{self.path}: row {number} has {len(record)} cells; expected "
                    f"{len(self.columns)}"
                )
            cells = (cell.strip() for cell in record)
            self.lines.append(dict(zip(self.columns, cells, strict=True)))
        self._read += len(whole)
        return bool(records)

    def append(self, cells: Mapping[str, str]) -> None:
        """Add a line and make sure that it is on the disk."""
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
        text = io.StringIO()
        csv.writer(text, lineterminator="\n").writerow(line.values())
        self._write(text.getvalue())
        self.refresh()

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
        kept = [place for place in self.counting if place < count and place not in without]
        if not kept:
            return None
        text = io.StringIO()
        writer = csv.DictWriter(text, self.columns, lineterminator="\n")
        writer.writeheader()
        for place, line in enumerate(self.lines[:count]):
            values = (edited or {}).get(place, {})
            status = line[STATUS] if place in kept else BACK[0]
            cells = {name: repr(value) for name, value in values.items()}
            # A line that does not count takes back none but itself.
            number = str(self.number(place)) if place in kept else str(-place - 1)
            writer.writerow(line | cells | {STATUS: status, ROW: number})
        stream = io.StringIO(text.getvalue())
        stream.name = str(self.path or "the session")
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

    def _check_header(self, found: Sequence[str]) -> None:
        if tuple(found) != self.columns:
            strange = sorted(set(found) ^ set(self.columns)) or list(found)
            raise SymkinError(
                f"{self.path}: its columns are not those of this session ({', '.join(strange)}); "
                "expected the same robot and the same --observe, or another folder"
            )

    def _cut(self) -> None:
        """Take off a last line that was not written to its end."""
        assert self.path is not None
        data = self.path.read_bytes()
        end = data.rfind(b"\n") + 1
        if end < len(data):
            self.torn = data[end:].decode("utf-8", "replace")
            partial = self.path.with_name(f"{self.path.name}.partial")
            with partial.open("ab") as file:
                file.write(data[end:] + b"\n")
                os.fsync(file.fileno())
            with self.path.open("rb+") as file:
                file.truncate(end)
                os.fsync(file.fileno())

    def _write(self, text: str) -> None:
        assert self.path is not None
        with self.path.open("ab") as file:
            file.write(text.encode())
            file.flush()
            os.fsync(file.fileno())
