# SPDX-License-Identifier: MIT
"""Where the robots of a fleet come from: files that are read a part at a time, or what is there."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path

from symkin.data.columns import NumbersMet
from symkin.data.measurements import Measurements
from symkin.data.reading import (
    measurements_by_robot,
    measurements_of_table,
    read_fleet,
    robot_column,
)
from symkin.data.tries import only_counting
from symkin.errors import MeasurementError, SymkinError
from symkin.estimate.fleet_jobs import Robots
from symkin.model.mechanism import Mechanism
from symkin.model.settings import MeasurementColumns
from symkin.storage.table_blocks import table_blocks
from symkin.storage.tables import Table, TableSource, read_table

_ROWS = 60_000  # of robots that are identified together


class RowsApartError(MeasurementError):
    """A robot's rows do not stand together, so that its table has to be read as a whole."""


def robots_of_files(
    mechanism: Mechanism,
    files: Sequence[Path],
    columns: MeasurementColumns | None = None,
    *,
    ignore: Sequence[str] = (),
    whole: bool = False,
) -> Iterator[Robots]:
    """Robots a part at a time: a file each, or tables of many with a column ``robot``.

    A file that cannot be used is a robot with the reason in place of measurements.

    Raises
    ------
    RowsApartError
        Unless tables are read as a `whole`, if a robot is met again behind others.
    """
    stems = [file.name.split(".")[0] for file in files]
    met: set[str] = set()
    part: dict[str, Measurements | str] = {}
    rows = 0
    for file, stem in zip(files, stems, strict=True):
        name = stem if stems.count(stem) == 1 else str(file)
        own: set[str] = set()
        for found in robots_of_table(mechanism, file, columns, ignore, whole=whole, name=name):
            own.update(found)
            for robot in met & found.keys():
                raise SymkinError(
                    f"{file}: is named twice"
                    if robot == str(file)
                    else f'{file}: robot "{robot}" is in a file before it, too'
                )
            part |= found
            rows += sum(1 if isinstance(each, str) else len(each) for each in found.values())
            if rows >= _ROWS:
                yield part
                part, rows = {}, 0
        met |= own
    if part:
        yield part


def robots_of_table(
    mechanism: Mechanism,
    file: Path,
    columns: MeasurementColumns | None,
    ignore: Sequence[str],
    *,
    whole: bool = False,
    name: str = "",
) -> Iterator[Robots]:
    """Robots of one table a part at a time, as `read_fleet` reads it; `RowsApartError` as above.

    With a `name`, a table without a column of robots is one robot of that name, and so is one that
    cannot be read, or not to its end: with the reason.
    """
    robot = robot_column(mechanism, columns)
    tables = enumerate(_tables(file, robot, mechanism.step, whole))
    numbers, met = NumbersMet(), set[str]()
    while True:
        try:
            number, table = next(tables)
            if name and robot not in table.names:
                if "robot" in table.names:
                    raise table.error(f'names robots by "robot"; by the mapping it is "{robot}"')
                table = only_counting(table)
                yield {name: measurements_of_table(table, mechanism, columns, ignore)}
                return
        except StopIteration:
            return
        except SymkinError as error:
            if not name:
                raise
            yield {name: str(error)}
            return
        _require_together(file, met, table, robot)
        yield measurements_by_robot(
            table, mechanism, columns, ignore, is_first=not number, row_numbers=numbers
        )


def _tables(file: Path, robot: str, step: str, whole: bool) -> Iterator[Table]:
    if whole:
        yield read_table(file, step)
    else:
        yield from table_blocks(file, robot, step)


def _require_together(file: Path, met: set[str], table: Table, column: str) -> None:
    """Refuse robots that were met in parts before, and remember these."""
    if column not in table.names:
        return  # which is refused where it is read
    found = table.labels(column).distinct
    for robot in met.intersection(found):
        raise RowsApartError(f'{file}: the rows of robot "{robot}" do not stand together')
    met.update(found)


def robots_given(
    mechanism: Mechanism,
    measurements: Mapping[str, Measurements] | Sequence[Measurements] | TableSource,
    columns: MeasurementColumns | None,
    ignore: Sequence[str],
) -> Robots:
    """Robots by their names, from measurements that are there or a table that is no file."""
    if isinstance(measurements, Mapping) and all(
        isinstance(each, Measurements) for each in measurements.values()
    ):
        return {str(name): each for name, each in measurements.items()}
    if isinstance(measurements, list | tuple):
        robots: dict[str, Measurements | str] = {}
        for number, each in enumerate(measurements, 1):
            if not isinstance(each, Measurements):
                raise MeasurementError(
                    f"robot {number} is a {type(each).__name__}; expected Measurements"
                )
            name = each.source.name.split(".")[0] if each.source else ""
            robots[name if name and name not in robots else str(number)] = each
        return robots
    return dict(read_fleet(measurements, mechanism, columns, ignore=ignore))  # type: ignore[arg-type]
