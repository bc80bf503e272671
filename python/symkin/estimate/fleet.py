# SPDX-License-Identifier: MIT
"""Many robots of one drawing, identified one by one into one table."""

from __future__ import annotations

import dataclasses
import itertools
import operator
import os
import re
import time
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from functools import cached_property
from pathlib import Path
from typing import Any, ClassVar, Literal, Self, Unpack

import numpy as np

from symkin import present
from symkin.data.measurements import Measurements
from symkin.errors import MeasurementError, SymkinError, did_you_mean, few, shown
from symkin.estimate.estimate import REDRAWN, save_corrections
from symkin.estimate.evidence.findings import Doubt, Note
from symkin.estimate.evidence.watching import is_watched, unwatched_search
from symkin.estimate.fleet_doubts import shared_cause
from symkin.estimate.fleet_jobs import Job, Robots, identifying
from symkin.estimate.fleet_parts import (
    COLUMNS,
    FleetPart,
    asked_of,
    numbered,
    part_of,
    shares_of,
)
from symkin.estimate.fleet_sources import RowsApartError, robots_given, robots_of_table
from symkin.estimate.fleet_together import FoundTogether, surroundings_of
from symkin.estimate.identification import estimating, wanted_of, why_together
from symkin.estimate.options import EstimateOptions, FleetOptions
from symkin.estimate.survey import check_coordinates
from symkin.estimate.workshop import MadeWithin, tolerances_of
from symkin.model.given import MechanismGiven, as_mechanism
from symkin.model.mechanism import Mechanism
from symkin.model.settings import MeasurementColumns
from symkin.options import Estimator, checks
from symkin.results import Result
from symkin.storage.output_files import OutputFiles
from symkin.storage.tables import TableSource, write_table
from symkin.values import Array, field, record

_ZEROS = re.compile(r"(?<![\d.])0+(?=\d)")  # in front of a number
_TOLD = 3  # pairs of names


@record
class Fleet(Result):
    """What the measurements say of many robots, a row a robot.

    Attributes
    ----------
    robots : tuple of str
        Their names.
    failures : tuple of str
        Why a robot was not identified; empty where it was. Its numbers are NaN.
    doubts : tuple of tuple of Doubt
        What speaks against each estimate, or why it may have failed; see `verdicts`.
    parameters, deviations : ndarray, shape (robots, legs, p)
        The estimates and their standard deviations; NaN of those that are held.
    surroundings : tuple of (str, str)
        Names and units of what was estimated besides, such as ``base.x``.
    surrounding, surrounding_deviations : ndarray, shape (robots, surroundings)
        Their estimates and standard deviations.
    chi_square, degrees_of_freedom : ndarray, shape (robots, fits)
        Of each leg, or of all legs together with the estimator `joint`.
    residual_rms : ndarray, shape (robots,)
        Closures of all legs, m.
    rejected : ndarray, shape (robots,)
        Readings that the robust loss puts below half their weight.
    nominal : Mechanism
        From which the estimators started.
    options : EstimateOptions
        How.
    seconds : float
        That it took.
    notes : tuple of Note
        What to know of the tables, such as columns that nothing was read from, and of all
        estimates.
    made_within : tuple of MadeWithin
        The tolerances that the workshop keeps, if that was asked for.
    redrawn : Mechanism or None
        The drawing without the mistake that most doubtful robots have in common, if that is its.
    sources : Mapping of str to str
        By the names of robots that failed or are doubtful, what a command line takes for their
        measurements, such as ``all.csv --robot A17``, if these are of files.
    """

    robots: tuple[str, ...]
    failures: tuple[str, ...]
    doubts: tuple[tuple[Doubt, ...], ...]
    parameters: Array = field(private=True)
    deviations: Array = field(private=True)
    surroundings: tuple[tuple[str, str], ...]
    surrounding: Array = field(private=True)
    surrounding_deviations: Array = field(private=True)
    chi_square: Array = field(private=True)
    degrees_of_freedom: Array = field(private=True)
    residual_rms: Array = field(private=True)
    rejected: Array = field(private=True)
    nominal: Mechanism = field(private=True)
    options: EstimateOptions
    seconds: float = field(private=True)
    notes: tuple[Note, ...] = field(compare=False, default=())
    made_within: tuple[MadeWithin, ...] = ()
    redrawn: Mechanism | None = field(private=True, default=None)
    sources: Mapping[str, str] = field(compare=False, default_factory=dict)

    derived = ("verdicts",)
    FILES: ClassVar[tuple[str, ...]] = ("fleet.csv", "report.html")
    SOMETIMES: ClassVar[tuple[str, ...]] = ("fleet.csv", "fleet.parquet", REDRAWN)

    def __len__(self) -> int:
        """How many robots there are."""
        return len(self.robots)

    def __getitem__(self, robot: str | int) -> dict[str, Any]:
        """Return the row of a robot, by its name or its place: what its columns say of it."""
        if isinstance(robot, str) and robot not in self.robots:
            raise SymkinError(f'no robot is called "{robot}"{did_you_mean(robot, self.robots)}')
        try:
            row = (
                self.robots.index(robot)
                if isinstance(robot, str)
                else range(len(self))[operator.index(robot)]
            )
        except (IndexError, TypeError):
            places = f"a place from 0 to {len(self) - 1}"
            raise SymkinError(f"no robot is {shown(robot)}; expected a name, or {places}") from None
        return {name: values[row] for name, values in self.columns().items()}

    def __iter__(self) -> Iterator[dict[str, Any]]:
        """Return one row after the other."""
        columns = self.columns()
        return (
            dict(zip(columns, values, strict=True))
            for values in zip(*columns.values(), strict=True)
        )

    @cached_property
    def verdicts(self) -> tuple[str, ...]:
        """Of each robot: "failed", "doubtful", or "fits" where the declared noise explains all.

        A robot that fits has passed the tests of size, noise and tolerance alone, if it was
        identified leg by leg; `identify` makes many more of a single one, and here of those that
        failed these.
        """
        return tuple(
            "failed" if failure else "doubtful" if doubt else "fits"
            for failure, doubt in zip(self.failures, self.doubts, strict=True)
        )

    @property
    def robots_per_second(self) -> float:
        """How fast it was."""
        return len(self.robots) / max(self.seconds, 1e-9)

    def columns(self) -> Mapping[str, Any]:
        """Return the table, a row a robot; legs are counted from 1."""
        columns: dict[str, Any] = {
            "robot": list(self.robots),
            "verdict": list(self.verdicts),
            "converged": [int(not failure) for failure in self.failures],
            "failure": list(self.failures),
            "doubt": ["; ".join(map(str, each)) for each in self.doubts],
            "doubt_codes": [" ".join(doubt.code for doubt in each) for each in self.doubts],
        }
        legs = range(1, len(self.nominal.legs) + 1)
        fits = [""] if self.options.estimator == "joint" else [f"_{leg}" for leg in legs]
        for number, which in enumerate(fits):
            columns[f"chi_square{which}"] = self.chi_square[:, number]
            columns[f"degrees_of_freedom{which}"] = self.degrees_of_freedom[:, number]
        columns[f"residual_rms_{self.nominal.space.closure_unit}"] = self.residual_rms
        columns["rejected"] = self.rejected
        has = self.nominal.has_parameter
        for what, values in (("", self.parameters), ("_deviation", self.deviations)):
            for leg in legs:
                units = self.nominal.parameter_units(leg - 1)
                for index in np.flatnonzero(has[leg - 1]):
                    name = self.nominal.parameter_names[index]
                    unit = f"_{units[index]}" if units[index] in ("m", "rad") else ""
                    columns[f"{name}_{leg}{what}{unit}"] = values[:, leg - 1, index]
        for at, (name, unit) in enumerate(self.surroundings):
            stem, end = name.replace(".", "_"), f"_{unit}" if unit else ""
            columns[f"{stem}{end}"] = self.surrounding[:, at]
            columns[f"{stem}_deviation{end}"] = self.surrounding_deviations[:, at]
        return columns

    def write(
        self,
        folder: str | os.PathLike[str],
        *,
        table: str = "csv",
        overwrite: bool = False,
        report: bool = True,
    ) -> Path:
        """Write the table and its page.

        Parameters
        ----------
        folder : str or path
            Made if it does not exist.
        table : {"csv", "parquet"}
            What the table is written as: ``fleet.csv`` or ``fleet.parquet``.
        overwrite : bool
            Whether files that exist may be replaced, and those of earlier robots removed.
        report : bool
            Whether to write the page.

        Returns
        -------
        Path
            The table.
        """
        name = f"fleet.{table}"
        with OutputFiles(overwrite=overwrite) as outputs:
            target = outputs.folder(Path(folder), *self.SOMETIMES, "report.html")
            write_table(target / name, self.columns())
            if self.redrawn is not None:
                cause = next(note for note in self.notes if note.code == "cause-shared")
                save_corrections(target, self.nominal, cause.figures["words"], None, self.redrawn)
            if report:
                self.write_report(target)
        return Path(folder) / name

    def write_report(self, folder: Path) -> None:
        """Write the page into a folder that has the table."""
        present.write_page(self.page(), folder / "report.html")

    @classmethod
    def of(
        cls,
        nominal: Mechanism,
        parts: Iterable[Robots],
        options: EstimateOptions,
        *,
        tolerances: Literal["estimate"] | None = None,
        threads: int = 0,
        workers: int = 1,
        scheduler: str | None = None,
    ) -> Self:
        """Identify robots, some at a time; those without measurements have a reason in their place.

        Of a part nothing is kept but what is found, so that memory grows with robots, not rows.
        """
        asked = asked_of(nominal, options)
        if asked or nominal.curvature is not None:
            options = dataclasses.replace(options, estimator="joint")
        found: list[FleetPart] = []
        seconds, looked_at = 0.0, 0
        ended: tuple[Note, ...] = ()
        watched = is_watched()
        job = Job(nominal, options, asked, threads)
        with (
            unwatched_search(),  # of one robot, which Ctrl-C would end for it alone
            identifying(job, workers=workers, scheduler=scheduler) as identified,
        ):
            try:
                for robots in parts:
                    start = time.perf_counter()
                    part = part_of(job, robots, identified(robots), looked_at)
                    looked_at += len(part.doubts)
                    if tolerances:
                        part.shares = shares_of(nominal, robots, options, part.failures)
                    found.append(part)
                    seconds += time.perf_counter() - start
            except KeyboardInterrupt:
                if not found or not watched:
                    raise
                ended = (Note("robots-left"),)
        names = [name for part in found for name in part.names]
        if not names:
            raise MeasurementError("there are no measurements of any robot; expected some")
        doubts, together = numbered(found, "doubts"), numbered(found, "together")
        drawings = numbered(found, "drawings")
        shared, typical = shared_cause(doubts, drawings) or (None, -1)
        surroundings, surrounding = surroundings_of(len(names), together)
        failures = [failure for part in found for failure in part.failures]
        failed = np.array([bool(failure) for failure in failures])
        surrounding[failed] = np.nan
        shares = [share for part in found for share in part.shares]

        def column(name: str) -> Array:
            return np.concatenate([part.columns[name] for part in found])

        return cls(
            robots=tuple(names),
            failures=tuple(failures),
            doubts=tuple(doubts.get(number, ()) for number in range(len(names))),
            surroundings=surroundings,
            surrounding=surrounding[..., 0],
            surrounding_deviations=surrounding[..., 1],
            **{name: column(name) for name in COLUMNS},
            nominal=nominal,
            options=options,
            seconds=seconds,
            notes=(
                *ended,
                *(() if shared is None else (shared,)),
                *_alike(names),
                *(() if len(together) == len(names) else (Note("screened"),)),
                *_notes(found),
                *_of_all(together),
            ),
            made_within=tolerances_of(shares) if tolerances else (),
            redrawn=drawings.get(typical),
            sources={names[at]: each for at, each in numbered(found, "typed").items() if each},
        )


@checks()
def identify_many(
    mechanism: MechanismGiven,
    measurements: Mapping[str, Measurements] | Sequence[Measurements] | TableSource,
    estimator: Estimator | None = None,
    *,
    tolerances: Literal["estimate"] | None = None,
    columns: MeasurementColumns | None = None,
    ignore: Sequence[str] = (),
    threads: int = 0,
    workers: int = 1,
    scheduler: str | None = None,
    **options: Unpack[FleetOptions],
) -> Fleet:
    """Identify many robots of one drawing, each by itself.

    Parameters
    ----------
    mechanism : Mechanism
        The nominal one of all of them. Its `frames` are known; with a target away from the
        platform's centre, deviations leave out what the noise of orientations does there.
    measurements : mapping of str to Measurements, sequence of Measurements, or table
        By the robots' names; one by one, named by their files or numbered from 1; or one table with
        a column ``robot``, as for `read_fleet`.
    estimator, poses, loss, loss_scale, noise, max_iterations, free, fixed, shared, tie, prior, \
frames, sensor, gauge, loss_per, assume, drift, step, growth, backlash, sessions, clock_offset, \
bow, of
        As for `identify`; by default what the mechanism's `identification` says. Where that is not
        all parameters of all legs, robots are identified as `identify` does, in seconds rather than
        milliseconds each. Of which errors is promised, `of`, changes nothing of that: it is for
        `identify`, where a single robot is looked into.
    tolerances : {"estimate"}, optional
        Whether to estimate the tolerances that the workshop keeps, `Fleet.made_within`: all robots
        are identified once more, in this process.
    columns : MeasurementColumns, optional
        Which columns of the table hold what.
    ignore : sequence of str
        Columns of the table that are left out on purpose.
    threads : int
        Of this process, 0 for all; the result is the same.
    workers : int
        Processes on this machine, each of one thread; 1 computes in this one.
    scheduler : str, optional
        Address of a running Dask scheduler, such as ``tcp://10.0.0.1:8786``, whose workers compute
        instead.

    Returns
    -------
    Fleet
        A row a robot; one that cannot be identified is a row that says why.

    Raises
    ------
    SymkinError
        For what is wrong with all robots: options that contradict each other, a table that cannot
        be read, no Dask where it is needed.
    """
    mechanism = as_mechanism(mechanism)
    if columns is not None:  # what is redrawn or proposed reads such tables, too
        mechanism = mechanism.replace(measurement_columns=columns)

    def robots(whole: bool) -> Iterable[Robots]:
        if isinstance(measurements, str | os.PathLike):
            return robots_of_table(mechanism, Path(measurements), columns, ignore, whole=whole)
        return [robots_given(mechanism, measurements, columns, ignore)]

    return identify_robots(
        mechanism,
        robots,
        estimator,
        tolerances=tolerances,
        threads=threads,
        workers=workers,
        scheduler=scheduler,
        **options,
    )


def identify_robots(
    mechanism: Mechanism,
    robots: Callable[[bool], Iterable[Robots]],
    estimator: Estimator | None = None,
    *,
    tolerances: Literal["estimate"] | None = None,
    threads: int = 0,
    workers: int = 1,
    scheduler: str | None = None,
    **options: Unpack[FleetOptions],
) -> Fleet:
    """Identify robots by their names, see `identify_many`; a text says why there is none.

    `robots` gives them a part at a time, or tables as a whole, once a robot's rows do not stand
    together.
    """
    wanted, how = wanted_of(mechanism, options)
    of = wanted.pop("of", None)
    check_coordinates(mechanism, of)

    def identified(parts: Iterable[Robots]) -> Fleet:
        some, parts = _looked_at(parts)
        reason = why_together(mechanism, wanted, how["noise"]) or _incomplete_because(some)
        return Fleet.of(
            mechanism,
            parts,
            dataclasses.replace(estimating(estimator, reason, wanted, how), of=of),
            tolerances=tolerances,
            threads=threads,
            workers=workers,
            scheduler=scheduler,
        )

    try:
        return identified(robots(False))
    except RowsApartError as apart:
        found = identified(robots(True))
        note = Note("rows-apart", figures={"words": str(apart)})
        return dataclasses.replace(found, notes=(*found.notes, note))


def _looked_at(parts: Iterable[Robots]) -> tuple[Robots, Iterable[Robots]]:
    """The first part, and all of them."""
    following = iter(parts)
    first = next(following, {})
    return first, itertools.chain([first], following)


def _incomplete_because(robots: Robots) -> str:
    """Why no robot can be identified leg by leg; empty if one can, or if there is none."""
    tables = [each for each in robots.values() if not isinstance(each, str)]
    if any(each.complete for each in tables):
        return ""
    return next((each.incomplete_because for each in tables), "")


def _alike(names: Sequence[str]) -> Iterator[Note]:
    """A note of names that are written differently, and may be of one robot."""
    words = "\n".join(["".join(name.split()) for name in names])
    plain = _ZEROS.sub("", words.casefold()).split("\n")
    if len(set(plain)) == len(names):
        return
    written: dict[str, list[str]] = {}
    for word, name in zip(plain, names, strict=True):
        written.setdefault(word, []).append(name)
    alike = [" and ".join(f'"{each}"' for each in some) for some in written.values() if some[1:]]
    if alike:
        yield Note("names-alike", figures={"words": few(alike, _TOLD)})


def _of_all(together: Mapping[int, FoundTogether]) -> Iterator[Note]:
    """Notes that are the same of all estimates, such as of what was held."""
    notes = [each.notes for each in together.values() if not each.failure]
    for note in notes[0] if notes else ():
        if all(note in others for others in notes):
            yield note


def _notes(parts: Sequence[FleetPart]) -> tuple[Note, ...]:
    """Of all tables, each once: many robots have one table, or tables of the same columns."""
    unread: dict[tuple[str, ...], list[str]] = {}
    for part in parts:
        for columns, names in part.unread.items():
            unread.setdefault(columns, []).extend(names)
    words = (
        f"nothing was read from column{'s' * (len(columns) > 1)} {', '.join(columns)} of "
        + " and ".join(dict.fromkeys(names) if len(set(names)) < 3 else [names[0], "others"])
        for columns, names in unread.items()
    )
    return tuple(Note("columns-unread", figures={"words": each}) for each in words)
