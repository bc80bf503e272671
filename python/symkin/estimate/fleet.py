# SPDX-License-Identifier: MIT
"""Many robots of one drawing, identified one by one into one table."""

from __future__ import annotations

import os
import time
from collections.abc import Iterator, Mapping, Sequence
from functools import cached_property
from pathlib import Path
from statistics import NormalDist
from typing import Any, ClassVar, Self

import numpy as np
from numpy.typing import NDArray

from symkin import _core, present
from symkin.cluster import dask_client, require_version, spread
from symkin.data.measurements import Measurements
from symkin.data.reading import ROBOT, read_fleet, read_measurements
from symkin.errors import FailedFitError, MeasurementError, SymkinError, named_legs
from symkin.estimate.fit import (
    FALSE_ALARMS,
    UNKNOWN,
    as_mechanism,
)
from symkin.estimate.options import EstimateOptions, Estimator, Loss, PoseUse
from symkin.model.canonical import canonical
from symkin.model.framing import unframed
from symkin.model.mechanism import Mechanism
from symkin.model.settings import MeasurementColumns, NoiseSettings
from symkin.model.tolerances import noise_of, parameter_tolerances
from symkin.results import Result
from symkin.storage.output_files import OutputFiles
from symkin.storage.tables import TableSource, read_table, write_table
from symkin.values import field, record
from symkin.version import version

__all__ = ["Fleet", "identify_many"]

Array = NDArray[np.float64]
Robots = Mapping[str, Measurements | str]

_OPTIONS = ("estimator", "poses", "loss", "loss_scale", "noise", "max_iterations")
_CHUNK = 250  # robots that travel to a worker together
_LARGEST_ANGLE = 1e9  # beyond it the canonical form of an angle is noise


@record
class Fleet(Result):
    """What the measurements say of many robots, a row a robot.

    Attributes
    ----------
    robots : tuple of str
        Their names.
    failures : tuple of str
        Why a robot was not identified; empty where it was. Its numbers are NaN.
    doubts : tuple of str
        What speaks against an estimate; empty where nothing does. See `verdicts`.
    parameters, deviations : ndarray, shape (robots, legs, p)
        The estimates and their standard deviations; NaN of those that are held.
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
    """

    robots: tuple[str, ...]
    failures: tuple[str, ...]
    doubts: tuple[str, ...]
    parameters: Array = field(private=True)
    deviations: Array = field(private=True)
    chi_square: Array = field(private=True)
    degrees_of_freedom: Array = field(private=True)
    residual_rms: Array = field(private=True)
    rejected: Array = field(private=True)
    nominal: Mechanism = field(private=True)
    options: EstimateOptions
    seconds: float = field(private=True)

    derived = ("verdicts",)
    FILES: ClassVar[tuple[str, ...]] = ("fleet.csv", "report.html")

    @cached_property
    def verdicts(self) -> tuple[str, ...]:
        """Of each robot: "failed", "doubtful", or "fits" where the declared noise explains all.

        A robot that fits has passed the tests of size, noise and tolerance alone; `identify` makes
        many more of a single one.
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
            "doubt": list(self.doubts),
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
        return columns

    def write(
        self, folder: str | os.PathLike[str], *, table: str = "csv", overwrite: bool = False
    ) -> Path:
        """Write the table and its page.

        Parameters
        ----------
        folder : str or path
            Made if it does not exist.
        table : {"csv", "parquet"}
            What the table is written as: ``fleet.csv`` or ``fleet.parquet``.
        overwrite : bool
            Whether files that exist may be replaced.

        Returns
        -------
        Path
            The table.
        """
        name = f"fleet.{table}"
        with OutputFiles(overwrite=overwrite) as outputs:
            target = outputs.folder(Path(folder), name, "report.html")
            write_table(target / name, self.columns())
            present.write_page(self.page(), target / "report.html")
        return Path(folder) / name

    @classmethod
    def of(
        cls,
        nominal: Mechanism,
        robots: Robots,
        options: EstimateOptions,
        *,
        threads: int = 0,
        workers: int = 1,
        scheduler: str | None = None,
    ) -> Self:
        """Identify robots; those without measurements have a reason in their place."""
        _refuse_further(options)
        start = time.perf_counter()
        size = len(nominal.legs), len(nominal.parameter_names)
        failures, found = _identified(
            _Job(nominal, options, threads), robots, workers=workers, scheduler=scheduler
        )
        parameters = found["parameters"].reshape(-1, *size)
        shown = np.flatnonzero(np.isfinite(parameters).all(axis=(1, 2)))
        values, _ = canonical(nominal, parameters[shown].reshape(-1, size[1]))
        parameters[shown] = values.reshape(-1, *size)
        deviations = found["deviations"].reshape(-1, *size)
        for robot in _suspects(nominal, parameters, deviations):
            if not failures[robot]:
                failures[robot] = _impossible(nominal, parameters[robot], deviations[robot])
        for robot in np.flatnonzero([bool(failure) for failure in failures]):
            for values in (parameters, *found.values()):
                values[robot] = np.nan
        doubts = _doubts(nominal, options, parameters, deviations, found)
        return cls(
            robots=tuple(robots),
            failures=tuple(failures),
            doubts=tuple(doubts),
            parameters=parameters,
            deviations=np.where(nominal.is_estimated, deviations, np.nan),
            chi_square=found["chi_square"],
            degrees_of_freedom=found["degrees_of_freedom"],
            residual_rms=found["residual_rms"],
            rejected=found["rejected"],
            nominal=nominal,
            options=options,
            seconds=time.perf_counter() - start,
        )


def identify_many(
    mechanism: Mechanism,
    measurements: Mapping[str, Measurements] | Sequence[Measurements] | TableSource,
    estimator: Estimator = "implicit",
    *,
    poses: PoseUse = "all",
    loss: Loss = "none",
    loss_scale: float | None = None,
    noise: NoiseSettings | None = None,
    max_iterations: int = 100,
    columns: MeasurementColumns | None = None,
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
    estimator, poses, loss, loss_scale, noise, max_iterations
        As for `identify`.
    columns : MeasurementColumns, optional
        Which columns of the table hold what.
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
    options = EstimateOptions(estimator, poses, loss, loss_scale, noise, max_iterations)
    return Fleet.of(
        mechanism,
        _by_name(mechanism, measurements, columns),
        options,
        threads=threads,
        workers=workers,
        scheduler=scheduler,
    )


def _refuse_further(options: EstimateOptions) -> None:
    """Refuse what is asked of estimates from other than full poses, leg by leg."""
    usual = {name: getattr(options, name) for name in _OPTIONS}
    asked = EstimateOptions(**usual)
    further = [name for name, value in vars(options).items() if value != getattr(asked, name)]
    further += ["noise"] if options.noise == "estimate" else []
    if further:
        raise SymkinError(
            f"{' and '.join(further)} cannot be asked of many robots at once; identify each"
        )


def fleet_of_files(
    mechanism: Mechanism,
    files: Sequence[Path],
    columns: MeasurementColumns | None = None,
    *,
    ignore: Sequence[str] = (),
) -> dict[str, Measurements | str]:
    """Measurements of robots: a file each, or one table with a column ``robot``.

    A file that cannot be used is a robot with the reason in place of measurements.
    """
    if len(files) == 1 and ROBOT in read_table(files[0]).names:
        return dict(read_fleet(files[0], mechanism, columns, ignore=ignore))
    stems = [file.name.split(".")[0] for file in files]
    robots: dict[str, Measurements | str] = {}
    for file, stem in zip(files, stems, strict=True):
        name = stem if stems.count(stem) == 1 else str(file)
        if name in robots:
            raise SymkinError(f"{file}: is named twice")
        try:
            robots[name] = read_measurements(file, mechanism, columns, ignore=ignore)
        except SymkinError as error:
            robots[name] = str(error)
    return robots


class _Job:
    """How robots are identified, wherever that is."""

    def __init__(self, nominal: Mechanism, options: EstimateOptions, threads: int) -> None:
        self.nominal = nominal
        self.options = options
        self.threads = threads

    def identify(self, robots: Sequence[Measurements]) -> tuple[list[str], dict[str, Array]]:
        """Failures, and the columns of the core's fleet."""
        options = self.options
        poses = [each.poses for each in robots]
        if self.nominal.frames is not None:
            ends = np.cumsum([len(each) for each in poses])
            poses = np.split(unframed(self.nominal, np.concatenate(poses)), ends[:-1])
        found = _core.identify_many(
            self.nominal.core,
            poses,
            [each.readings for each in robots],
            [each.leg_sets.astype(np.int64, copy=False) for each in robots],
            _core.Estimator.__members__[options.estimator],
            _core.PoseUse.__members__[options.poses],
            noise_of(options.declared(self.nominal.noise)),
            options.loss,
            options.loss_scale or 0.0,
            options.max_iterations,
            self.threads,
        )
        return list(found.failures), {name: getattr(found, name) for name in _COLUMNS}


_COLUMNS = (
    "parameters",
    "deviations",
    "chi_square",
    "degrees_of_freedom",
    "limit",
    "least",
    "residual_rms",
    "rejected",
)


def _by_name(
    mechanism: Mechanism,
    measurements: Mapping[str, Measurements] | Sequence[Measurements] | TableSource,
    columns: MeasurementColumns | None,
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
    return dict(read_fleet(measurements, mechanism, columns))  # type: ignore[arg-type]


def _identified(
    job: _Job, robots: Robots, *, workers: int, scheduler: str | None
) -> tuple[list[str], dict[str, Array]]:
    """Failures and columns of all robots, in their order."""
    legs, parameters = len(job.nominal.legs), len(job.nominal.parameter_names)
    coordinates = job.nominal.home.size
    failures: list[str] = []
    usable: list[tuple[int, Measurements]] = []
    for number, measured in enumerate(robots.values()):
        failure = ""
        if isinstance(measured, str):
            failure = measured
        elif (measured.poses.shape[1], measured.readings.shape[1]) != (coordinates, legs):
            failure = (
                f"poses of {measured.poses.shape[1]} coordinates and readings of "
                f"{measured.readings.shape[1]} legs; expected {coordinates} and {legs}"
            )
        else:
            usable.append((number, measured))
        failures.append(failure)
    fits = 1 if job.options.estimator == "joint" else legs
    widths = (legs * parameters, legs * parameters, fits, fits, fits, fits)
    shapes = [(len(robots), width) for width in widths] + [(len(robots),)] * 2
    found = {name: np.full(shape, np.nan) for name, shape in zip(_COLUMNS, shapes, strict=True)}
    for rows, (why, columns) in _computed(job, usable, workers, scheduler):
        for row, failure in zip(rows, why, strict=True):
            failures[row] = failure
        places = np.array(rows)
        for name, values in columns.items():
            found[name][places] = values
    return failures, found


def _computed(
    job: _Job, robots: list[tuple[int, Measurements]], workers: int, scheduler: str | None
) -> Iterator[tuple[list[int], tuple[list[str], dict[str, Array]]]]:
    """What is found of chunks of robots, in whatever order they are ready."""
    local = workers == 1 and scheduler is None
    size = max(len(robots), 1) if local else _CHUNK
    chunks = [robots[first : first + size] for first in range(0, len(robots), size)]
    if local:
        for chunk in chunks:
            yield [number for number, _ in chunk], job.identify([each for _, each in chunk])
        return
    job.threads = 1
    with dask_client(min(workers, max(len(chunks), 1)), scheduler) as client:
        yield from spread(client, _chunk, ((version(), job, chunk) for chunk in chunks))


def _chunk(
    wanted: str, job: _Job, robots: list[tuple[int, Measurements]]
) -> tuple[list[int], tuple[list[str], dict[str, Array]]]:
    """What a worker does."""
    require_version(wanted)
    return [number for number, _ in robots], job.identify([each for _, each in robots])


def _suspects(nominal: Mechanism, parameters: Array, deviations: Array) -> NDArray[np.intp]:
    """Robots whose parameters may be no mechanism's, or whose deviations are unknown."""
    legs = range(len(nominal.legs))
    kinds = np.array([[role.kind for role in nominal.parameter_roles(leg)] for leg in legs])
    sized = np.isfinite(parameters).all(axis=(1, 2))
    strange = (parameters[:, kinds == "length"] <= 0).any(axis=1)
    strange |= (np.abs(parameters) > _LARGEST_ANGLE).any(axis=(1, 2))
    strange |= (parameters[:, kinds == "gain"] == 0).any(axis=1)
    return np.flatnonzero(sized & (strange | ~np.isfinite(deviations).all(axis=(1, 2))))


def _impossible(nominal: Mechanism, parameters: Array, deviations: Array) -> str:
    """Why an estimate is none, or empty."""
    try:
        as_mechanism(nominal, parameters, deviations)
    except FailedFitError as error:
        return str(error)
    if not np.isfinite(deviations).all():
        legs = sorted({int(leg) for leg in np.argwhere(~np.isfinite(deviations))[:, 0]})
        return f"the measurements do not determine all parameters of {named_legs(legs)}"
    return ""


def _doubts(
    nominal: Mechanism,
    options: EstimateOptions,
    parameters: Array,
    deviations: Array,
    found: Mapping[str, Array],
) -> list[str]:
    """What speaks against each robot's estimate: a sentence, or nothing."""
    chi_square, freedom = found["chi_square"], found["degrees_of_freedom"]
    identified = nominal.is_estimated
    tolerances, deviations = parameter_tolerances(nominal)[identified], deviations[:, identified]
    changes = (parameters - nominal.parameters)[:, identified]
    distances = np.abs(changes) / np.hypot(tolerances, deviations)
    farthest = NormalDist().inv_cdf(1 - FALSE_ALARMS / 4 / tolerances.size)
    with np.errstate(invalid="ignore"):
        times = np.sqrt(chi_square / freedom)
    causes = {
        "no pose to spare, so the noise cannot be checked": freedom < 1,
        "residuals are {:.2g} times what the declared noise explains": (
            chi_square > found["limit"]
        ),
        "residuals are {:.2g} times what the declared noise makes: it is too large, or the "
        "measurements were smoothed or computed": (
            (chi_square < found["least"]) & (options.loss == "none")
        ),
        "the measurements say nothing of some parameters: their standard deviations are more than "
        f"{UNKNOWN} times the tolerance": deviations > UNKNOWN * tolerances,
        "parameters are further from the drawing than is plausible, by up to {:.3g} times what "
        "tolerance and noise allow": distances > farthest,
    }
    sizes = (freedom, times, times, deviations, distances)
    doubts: list[list[str]] = [[] for _ in parameters]
    for (cause, alarms), size in zip(causes.items(), sizes, strict=True):
        for robot in np.flatnonzero(alarms.reshape(len(doubts), -1).any(axis=1)):
            doubts[robot].append(cause.format(float(np.max(size[robot][alarms[robot]]))))
    return ["; ".join(each) for each in doubts]
