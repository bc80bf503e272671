# SPDX-License-Identifier: MIT
"""A robot: a mechanism with the stages of the protocol as methods."""

from __future__ import annotations

import os
from collections.abc import Callable
from typing import TYPE_CHECKING, Any, Self, Unpack

from symkin.analysis import evaluation, workspace
from symkin.analysis.checks import CheckResult, check_mechanism
from symkin.data.reading import MeasuredSessions
from symkin.estimate.estimate import Estimate
from symkin.estimate.identification import identify
from symkin.estimate.options import Estimator, IdentifyOptions, PoseUse
from symkin.files.mechanism_file import read_mechanism
from symkin.files.mechanism_writer import save_mechanism
from symkin.guided import beginning
from symkin.model.mechanism import Mechanism
from symkin.options import checks
from symkin.pipeline import ProtocolResult, run_protocol, saved_estimate
from symkin.planning import making, simulation
from symkin.planning.making import ChoosingForPlan
from symkin.present import Page, kinds_told
from symkin.results import Result, loaded
from symkin.show.images import plotted

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import FigureBase

__all__ = ["Robot", "load", "load_mechanism", "read_estimate", "read_result"]


class Robot(Mechanism):
    """A `Mechanism` that has the stages as methods; each is the function of that name.

    What `replace` and an estimate make of a robot is a robot again.
    """

    sample_workspace = workspace.sample_workspace
    plan = making.plan
    simulate = simulation.simulate
    measure = beginning.measure
    evaluate = evaluation.evaluate

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

    @checks()
    def identify(
        self,
        measurements: MeasuredSessions,
        estimator: Estimator | None = None,
        **options: Unpack[IdentifyOptions],
    ) -> Estimate[Self]:
        """Return `symkin.identify` from measurements, with it as the nominal mechanism."""
        return identify(self, measurements, estimator, **options)

    @checks()
    def run(
        self,
        *,
        estimator: Estimator | None = None,
        poses: PoseUse = "all",
        seed: int | None = None,
        progress: Callable[[str], None] | None = None,
        **choosing: Unpack[ChoosingForPlan],
    ) -> ProtocolResult[Self]:
        """Return `symkin.run_protocol` of it."""
        return run_protocol(
            self,
            estimator=estimator,
            poses=poses,
            seed=seed,
            progress=progress,
            **choosing,
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
