# SPDX-License-Identifier: MIT
"""Many robots of one drawing, identified one by one into one table."""

from __future__ import annotations

import dataclasses
import operator
import os
import time
from collections.abc import Iterator, Mapping, Sequence
from functools import cached_property
from pathlib import Path
from typing import Any, ClassVar, Literal, Self

import numpy as np
from numpy.typing import NDArray

from symkin import present
from symkin.data.measurements import Measurements
from symkin.data.reading import (
    ROBOT,
    measurements_by_robot,
    measurements_of_table,
    read_fleet,
)
from symkin.errors import MeasurementError, SymkinError, did_you_mean, one_of, shown
from symkin.estimate.covariates import steps_of
from symkin.estimate.evidence.findings import Doubt, Note
from symkin.estimate.fleet_doubts import doubted, examined, impossible, suspects
from symkin.estimate.fleet_jobs import Job, Robots, identified
from symkin.estimate.fleet_together import FoundTogether, surroundings_of
from symkin.estimate.identification import SEVERAL_READINGS, identify
from symkin.estimate.options import EstimateOptions
from symkin.estimate.unknowns import Priors, noise_of_file, with_file_settings
from symkin.estimate.workshop import MadeWithin, workshop_tolerances
from symkin.model.canonical import canonical
from symkin.model.given import MechanismGiven, as_mechanism
from symkin.model.mechanism import Mechanism
from symkin.model.settings import (
    IdentificationSettings,
    MeasurementColumns,
    NoiseSettings,
    unusual,
)
from symkin.options import Estimator, Gauge, Loss, LossPer, PoseUse, Sensor, checks
from symkin.results import Result
from symkin.storage.output_files import OutputFiles
from symkin.storage.tables import TableSource, read_table, write_table
from symkin.values import field, record

__all__ = ["Fleet", "identify_many"]

Array = NDArray[np.float64]


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

    derived = ("verdicts",)
    FILES: ClassVar[tuple[str, ...]] = ("fleet.csv", "report.html")
    SOMETIMES: ClassVar[tuple[str, ...]] = ("fleet.csv", "fleet.parquet")

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
            if report:
                present.write_page(self.page(), target / "report.html")
        return Path(folder) / name

    @classmethod
    def of(
        cls,
        nominal: Mechanism,
        robots: Robots,
        options: EstimateOptions,
        *,
        tolerances: Literal["estimate"] | None = None,
        threads: int = 0,
        workers: int = 1,
        scheduler: str | None = None,
    ) -> Self:
        """Identify robots; those without measurements have a reason in their place."""
        asked = _asked(nominal, options)
        if asked or nominal.curvature is not None:
            options = dataclasses.replace(options, estimator="joint")
        start = time.perf_counter()
        size = len(nominal.legs), len(nominal.parameter_names)
        failures, found, together = identified(
            Job(nominal, options, asked, threads), robots, workers=workers, scheduler=scheduler
        )
        surroundings, surrounding = surroundings_of(len(robots), together)
        parameters = found["parameters"].reshape(-1, *size)
        shown = np.flatnonzero(np.isfinite(parameters).all(axis=(1, 2)))
        values, _ = canonical(nominal, parameters[shown].reshape(-1, size[1]))
        parameters[shown] = values.reshape(-1, *size)
        deviations = found["deviations"].reshape(-1, *size)
        for robot in suspects(nominal, parameters, deviations):
            if not failures[robot]:
                failures[robot] = impossible(nominal, parameters[robot], deviations[robot])
        doubts = {number: each.doubts for number, each in together.items()}
        screened = () if together else (Note("screened"),)
        if screened:
            strange = doubted(nominal, options, parameters, deviations, found)
            looked_at = {
                robot: measured
                for robot, (measured, failure) in enumerate(
                    zip(robots.values(), failures, strict=True)
                )
                if isinstance(measured, Measurements) and (failure or strange[robot])
            }
            doubts, refused = examined(nominal, options, looked_at)
            for robot, failure in refused.items():
                failures[robot] = failures[robot] or failure
        for robot in np.flatnonzero([bool(failure) for failure in failures]):
            for values in (parameters, *found.values(), surrounding):
                values[robot] = np.nan
        estimated = deviations > 0 if asked else nominal.is_estimated
        return cls(
            robots=tuple(robots),
            failures=tuple(failures),
            doubts=tuple(doubts.get(number, ()) for number in range(len(robots))),
            parameters=parameters,
            deviations=np.where(estimated, deviations, np.nan),
            surroundings=surroundings,
            surrounding=surrounding[..., 0],
            surrounding_deviations=surrounding[..., 1],
            chi_square=found["chi_square"],
            degrees_of_freedom=found["degrees_of_freedom"],
            residual_rms=found["residual_rms"],
            rejected=found["rejected"],
            nominal=nominal,
            options=options,
            seconds=time.perf_counter() - start,
            notes=(*screened, *_notes(robots), *_of_all(together)),
            made_within=_made_within(nominal, robots, options, failures) if tolerances else (),
        )


@checks()
def identify_many(
    mechanism: MechanismGiven,
    measurements: Mapping[str, Measurements] | Sequence[Measurements] | TableSource,
    estimator: Estimator | None = None,
    *,
    poses: PoseUse = "all",
    loss: Loss = "none",
    loss_scale: float | None = None,
    noise: NoiseSettings | Literal["estimate"] | None = None,
    max_iterations: int = 100,
    free: Sequence[str] | None = None,
    fixed: Sequence[str] | None = None,
    shared: Sequence[str] | None = None,
    tie: Sequence[str] | None = None,
    prior: Priors | None = None,
    frames: Sequence[str] | None = None,
    sensor: Sensor | None = None,
    gauge: Gauge | None = None,
    loss_per: LossPer | None = None,
    assume: Mapping[str, float | str] | None = None,
    drift: Sequence[str] | None = None,
    step: Sequence[str | int] | str | int | None = None,
    growth: bool | None = None,
    backlash: bool | None = None,
    sessions: Sequence[str] | None = None,
    clock_offset: bool | None = None,
    bow: float | str | None = None,
    tolerances: Literal["estimate"] | None = None,
    columns: MeasurementColumns | None = None,
    ignore: Sequence[str] = (),
    threads: int = 0,
    workers: int = 1,
    scheduler: str | None = None,
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
frames, sensor, gauge, loss_per, assume, drift, step, growth, backlash, sessions, clock_offset, bow
        As for `identify`; by default what the mechanism's `identification` says. Where that is not
        all parameters of all legs, robots are identified as `identify` does, in seconds rather than
        milliseconds each.
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
    return identify_robots(
        mechanism,
        _by_name(mechanism, measurements, columns, ignore),
        estimator,
        poses=poses,
        loss=loss,
        loss_scale=loss_scale,
        noise=noise,
        max_iterations=max_iterations,
        free=free,
        fixed=fixed,
        shared=shared,
        tie=tie,
        prior=prior,
        frames=frames,
        sensor=sensor,
        gauge=gauge,
        loss_per=loss_per,
        assume=assume,
        drift=drift,
        step=steps_of(step),
        growth=growth,
        backlash=backlash,
        sessions=sessions,
        clock_offset=clock_offset,
        bow=bow,
        tolerances=tolerances,
        threads=threads,
        workers=workers,
        scheduler=scheduler,
    )


def identify_robots(
    mechanism: Mechanism,
    robots: Robots,
    estimator: Estimator | None = None,
    *,
    poses: PoseUse = "all",
    loss: Loss = "none",
    loss_scale: float | None = None,
    noise: NoiseSettings | Literal["estimate"] | None = None,
    max_iterations: int = 100,
    tolerances: Literal["estimate"] | None = None,
    threads: int = 0,
    workers: int = 1,
    scheduler: str | None = None,
    **given: Any,
) -> Fleet:
    """Identify robots by their names, see `identify_many`; a text says why there is none."""
    if not robots:
        raise MeasurementError("there are no measurements of any robot; expected some")
    asked = with_file_settings(given, mechanism.identification)
    if noise is None:
        noise = noise_of_file(mechanism.identification)
    further = unusual(asked | {"noise": noise if isinstance(noise, str) else None})
    reason = "" if mechanism.curvature is None else "the sensors are curved"
    if mechanism.ties:
        reason = SEVERAL_READINGS
    if further:
        reason = f"{' and '.join(further)} {'was' if len(further) == 1 else 'were'} given"
    if reason and estimator not in (None, "joint"):
        one_of("estimator", estimator, Estimator)
        raise SymkinError(
            f'the estimator "{estimator}" looks at each leg by itself, from full poses; expected '
            f'"joint" here, since {reason}'
        )
    how = "joint" if reason else estimator or "implicit"
    options = EstimateOptions(how, poses, loss, loss_scale, noise, max_iterations, **asked)
    return Fleet.of(
        mechanism,
        robots,
        options,
        tolerances=tolerances,
        threads=threads,
        workers=workers,
        scheduler=scheduler,
    )


def fleet_of_files(
    mechanism: Mechanism,
    files: Sequence[Path],
    columns: MeasurementColumns | None = None,
    *,
    ignore: Sequence[str] = (),
) -> dict[str, Measurements | str]:
    """Measurements of robots: a file each, or tables of many with a column ``robot``.

    A file that cannot be used is a robot with the reason in place of measurements.
    """
    stems = [file.name.split(".")[0] for file in files]
    robots: dict[str, Measurements | str] = {}
    for file, stem in zip(files, stems, strict=True):
        name = stem if stems.count(stem) == 1 else str(file)
        found: Mapping[str, Measurements | str]
        try:
            table = read_table(file, mechanism.step)
            if ROBOT not in table.names:
                found = {name: measurements_of_table(table, mechanism, columns, ignore)}
        except SymkinError as error:
            found = {name: str(error)}
        else:
            if ROBOT in table.names:
                found = measurements_by_robot(table, mechanism, columns, ignore)
        for robot, measured in found.items():
            if robot in robots:
                raise SymkinError(
                    f"{file}: is named twice"
                    if robot == str(file)
                    else f'{file}: robot "{robot}" is in a file before it, too'
                )
            robots[robot] = measured
    return robots


def _asked(nominal: Mechanism, options: EstimateOptions) -> dict[str, Any]:
    """What is unknown, as `identify` takes it; empty if that is all parameters of all legs."""
    names = [name for name in vars(IdentificationSettings()) if name != "noise"]
    wanted = {name: getattr(options, name) for name in names}
    said = {name for name in wanted if getattr(nominal.identification, name, None) is not None}
    further = {*unusual(wanted)}
    noise = {"noise": options.noise} if isinstance(options.noise, str) else {}
    if not (further or noise):
        return {}
    return {name: wanted[name] for name in wanted if name in further | said} | noise


def _made_within(
    nominal: Mechanism, robots: Robots, options: EstimateOptions, failures: Sequence[str]
) -> tuple[MadeWithin, ...]:
    """From the robots that were identified, each once more with its covariance."""
    by_leg = options.estimator != "joint"
    own = {"estimator", "poses", "loss", "loss_scale", "noise", "max_iterations"}
    how = vars(options) if not by_leg else {name: getattr(options, name) for name in own}
    told = [
        identify(nominal, measured, **how)
        for measured, failure in zip(robots.values(), failures, strict=True)
        if not failure and not isinstance(measured, str)
    ]
    return workshop_tolerances(told)


def _of_all(together: Mapping[int, FoundTogether]) -> Iterator[Note]:
    """Notes that are the same of all estimates, such as of what was held."""
    notes = [each.notes for each in together.values() if not each.failure]
    for note in notes[0] if notes else ():
        if all(note in others for others in notes):
            yield note


def _notes(robots: Robots) -> tuple[Note, ...]:
    """Of all tables, each once: many robots have one table, or tables of the same columns."""
    unread: dict[tuple[str, ...], list[str]] = {}
    for name, each in robots.items():
        if isinstance(each, Measurements) and each.unread:
            unread.setdefault(each.unread, []).append(each.source_name or name)
    words = (
        f"nothing was read from column{'s' * (len(columns) > 1)} {', '.join(columns)} of "
        + " and ".join(dict.fromkeys(names) if len(set(names)) < 3 else [names[0], "others"])
        for columns, names in unread.items()
    )
    return tuple(Note("columns-unread", figures={"words": each}) for each in words)


def _by_name(
    mechanism: Mechanism,
    measurements: Mapping[str, Measurements] | Sequence[Measurements] | TableSource,
    columns: MeasurementColumns | None,
    ignore: Sequence[str],
) -> Robots:
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
