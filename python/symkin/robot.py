# SPDX-License-Identifier: MIT
"""A robot: a mechanism with the stages of the protocol as methods."""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING, Any, Literal, Self, Unpack

from numpy.typing import ArrayLike

from symkin.analysis.checks import CheckResult, check_mechanism
from symkin.analysis.evaluation import Evaluation, evaluate
from symkin.analysis.observability import RowKind
from symkin.analysis.observed import Observable, Observed, Observing
from symkin.analysis.promises import CONFIDENCE
from symkin.analysis.workspace import WorkspaceSample, sample_workspace
from symkin.data.reading import Measured, MeasuredSessions
from symkin.estimate.estimate import Estimate
from symkin.estimate.identification import identify
from symkin.estimate.options import Estimator, Loss, PoseUse
from symkin.estimate.survey import Unknowns
from symkin.estimate.unknowns import Gauge, LossPer, Priors, Sensor
from symkin.files.mechanism_file import read_mechanism
from symkin.files.mechanism_writer import save_mechanism
from symkin.guided import Session, measure
from symkin.model.given import MechanismGiven
from symkin.model.mechanism import Mechanism
from symkin.model.settings import NoiseSettings
from symkin.options import Visit, checks
from symkin.pipeline import ProtocolResult, run_protocol, saved_estimate
from symkin.planning.making import plan
from symkin.planning.plan import Plan
from symkin.planning.selection import Criterion, Design, Region, SelectionMethod
from symkin.planning.simulation import Simulation, simulate
from symkin.present import Page, kinds_told
from symkin.results import Result, loaded
from symkin.show.images import plotted
from symkin.storage.tables import TableSource

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import FigureBase

__all__ = ["Robot", "load", "load_mechanism", "read_estimate", "read_result"]


class Robot(Mechanism):
    """A `Mechanism` that has the stages as methods; each is the function of that name.

    What `replace` and an estimate make of a robot is a robot again.
    """

    @classmethod
    def of(cls, mechanism: Mechanism) -> Self:
        """Return a mechanism, as one that was read from a printer's configuration, as a robot."""
        return cls(**mechanism.arguments)

    def plot(self) -> FigureBase | Axes:
        """Draw it at home; see `symkin.plot.mechanism` for more."""
        return plotted("mechanism", self)()

    def summary(self) -> Page:
        """Return the top of the page of `check`."""
        return self.check().summary()

    def check(self, seed: int | None = None) -> CheckResult:
        """Return `symkin.check_mechanism` of it."""
        return check_mechanism(self, seed)

    def sample_workspace(
        self, candidates: int | None = None, seed: int | None = None
    ) -> WorkspaceSample:
        """Return `symkin.sample_workspace` of it."""
        return sample_workspace(self, candidates, seed)

    def plan(
        self,
        pose_count: int | None = None,
        *,
        candidates: int | ArrayLike | WorkspaceSample | None = None,
        seed: int | None = None,
        design: Design | None = None,
        rows: RowKind = "noise_aware",
        criterion: Criterion = "O1",
        method: SelectionMethod = "exchange",
        required: ArrayLike | WorkspaceSample | TableSource | None = None,
        measured: Measured | None = None,
        avoid: Sequence[Region] = (),
        minimum_distance: float = 0.0,
        margin_sigmas: float = 3.0,
        symmetry: bool = True,
        visit: Visit | None = None,
        spares: int | None = None,
        time_limit: float | None = None,
        threads: int = 0,
        confidence: float = CONFIDENCE,
        observe: Observing | None = None,
        **unknowns: Unpack[Unknowns],
    ) -> Plan:
        """Return `symkin.plan` of `pose_count` poses out of its workspace."""
        return plan(
            self,
            pose_count,
            candidates=candidates,
            seed=seed,
            design=design,
            rows=rows,
            criterion=criterion,
            method=method,
            required=required,
            measured=measured,
            avoid=avoid,
            minimum_distance=minimum_distance,
            margin_sigmas=margin_sigmas,
            symmetry=symmetry,
            visit=visit,
            spares=spares,
            time_limit=time_limit,
            threads=threads,
            confidence=confidence,
            observe=observe,
            **unknowns,
        )

    def simulate(
        self,
        plan: Plan | TableSource,
        seed: int | None = None,
        actual: MechanismGiven | None = None,
        *,
        observe: Observed | Observable | None = None,
        changes: Mapping[str, float | str] | None = None,
    ) -> Simulation:
        """Return `symkin.simulate` of a robot of this drawing that takes a plan's poses."""
        return simulate(self, plan, seed, actual, observe=observe, changes=changes)

    def identify(
        self,
        measurements: MeasuredSessions,
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
        confidence: float = CONFIDENCE,
    ) -> Estimate[Self]:
        """Return `symkin.identify` from measurements, with it as the nominal mechanism."""
        return identify(
            self,
            measurements,
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
            step=step,
            growth=growth,
            backlash=backlash,
            sessions=sessions,
            clock_offset=clock_offset,
            bow=bow,
            confidence=confidence,
        )

    def measure(
        self,
        accuracy: float | None = None,
        out: str | os.PathLike[str] | None = None,
        *,
        orientation: float | None = None,
        confidence: float = CONFIDENCE,
        noise: Literal["estimate"] | None = None,
        candidates: int | ArrayLike | WorkspaceSample | None = None,
        seed: int | None = None,
        avoid: Sequence[Region] = (),
        margin_sigmas: float = 3.0,
        observe: Observable | Sequence[Observable] | None = None,
        **unknowns: Unpack[Unknowns],
    ) -> Session:
        """Return `symkin.measure` of it: a guided session."""
        return measure(
            self,
            accuracy,
            out,
            orientation=orientation,
            confidence=confidence,
            noise=noise,
            candidates=candidates,
            seed=seed,
            avoid=avoid,
            margin_sigmas=margin_sigmas,
            observe=observe,
            **unknowns,
        )

    def evaluate(
        self,
        *,
        actual: MechanismGiven | None = None,
        poses: ArrayLike | WorkspaceSample | None = None,
        measurements: Measured | None = None,
        confidence: float = CONFIDENCE,
    ) -> Evaluation:
        """Return `symkin.evaluate` of it as the model of a controller."""
        return evaluate(
            self, actual=actual, poses=poses, measurements=measurements, confidence=confidence
        )

    def run(
        self,
        *,
        estimator: Estimator | None = None,
        poses: PoseUse = "all",
        design: Design | None = None,
        rows: RowKind = "noise_aware",
        criterion: Criterion = "O1",
        method: SelectionMethod = "exchange",
        margin_sigmas: float = 3.0,
        seed: int | None = None,
        progress: Callable[[str], None] | None = None,
    ) -> ProtocolResult[Self]:
        """Return `symkin.run_protocol` of it."""
        return run_protocol(
            self,
            estimator=estimator,
            poses=poses,
            design=design,
            rows=rows,
            criterion=criterion,
            method=method,
            margin_sigmas=margin_sigmas,
            seed=seed,
            progress=progress,
        )

    def save(
        self, path: str | os.PathLike[str], *, header: str = "", overwrite: bool = False
    ) -> None:
        """Write it to a file, see `symkin.save_mechanism`."""
        save_mechanism(self, path, header=header, overwrite=overwrite)


@checks()
def load_mechanism(path_or_name: str | os.PathLike[str], *, require_symmetry: bool = True) -> Robot:
    """Read a mechanism from a TOML file, or one of the shipped mechanisms by name.

    Parameters
    ----------
    path_or_name : str or path
        A file, or a name such as ``"3RRR"``; `shipped_mechanisms` lists them.
    require_symmetry : bool
        Whether legs that do not have the symmetry declared beside them are an error. Without,
        `check_mechanism` tells what breaks it.

    Returns
    -------
    Robot
        In SI units, with the settings of the file; its `source` is the file.

    Raises
    ------
    MechanismFileError
        With the file, the line and the key at fault, the expectation, and for a misspelt key the
        nearest valid one.
    """
    return read_mechanism(path_or_name, Robot, require_symmetry=require_symmetry)


load = load_mechanism


@checks()
def read_estimate(path: str | os.PathLike[str]) -> Estimate[Robot]:
    """Read what `identify` found from the folder or the results file that it was written to.

    Parameters
    ----------
    path : str or path
        The folder of ``symkin identify`` or ``run``, of `Estimate.write` or `ProtocolResult.write`;
        or its ``results.json``, which `Estimate.save` writes too.

    Returns
    -------
    Estimate
        Equal to the one that was written, with its mechanisms and measurements, of which everything
        can be asked.

    Raises
    ------
    ResultsError
        If there is none, or one of another version.
    """
    found: Estimate[Robot] = saved_estimate(path, Robot)
    return found


@checks()
def read_result(path: str | os.PathLike[str]) -> Any:
    """Read any result from the file or the folder that it was written to.

    Parameters
    ----------
    path : str or path
        A JSON file that `Result.save`, a command's ``--out`` or its ``--json`` has written; or a
        folder with one.

    Returns
    -------
    Result
        Of the class that it was, and equal to what was written: an `Estimate`, an `Evaluation`, a
        `CheckResult`, ... It says the same, and draws the same page.

    Raises
    ------
    ResultsError
        If there is none, or one of a kind or a version that this symkin does not know.
    """
    kinds = [kind for kind in kinds_told() if issubclass(kind, Result)]
    return loaded(path, kinds, {Mechanism: Robot})
