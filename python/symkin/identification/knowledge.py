# SPDX-License-Identifier: MIT
"""What a joint estimate knows: best and worst combinations, correlations, accuracy to expect."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from symkin.errors import SymkinError
from symkin.observability import name_combination
from symkin.result import Value, field, record

if TYPE_CHECKING:
    from symkin.identification.joint import JointIdentification
    from symkin.mechanism import Mechanism
    from symkin.observed import Observable
    from symkin.planning.observing import Survey

__all__ = [
    "Correlation",
    "Direction",
    "Expected",
    "correlations_of",
    "directions_of",
    "survey_of",
]

Array = NDArray[np.float64]

_SAMPLES = 1000  # poses of the workspace over which accuracy is expected
_CORRELATED = 10


@record
class Direction(Value):
    """A combination of unknowns, and how well it is known.

    Attributes
    ----------
    deviation : float
        Its standard deviation, in tolerances.
    combination : str
        In tolerances.
    """

    deviation: float = field(unit="in_tolerances")
    combination: str


@record
class Correlation(Value):
    """Two unknowns that the observations hardly tell apart.

    Attributes
    ----------
    unknowns : tuple of str
        Their names.
    correlation : float
        From -1 to 1.
    """

    unknowns: tuple[str, str]
    correlation: float


@record
class Expected(Value):
    """Errors of the target that the uncertain unknowns lead to expect at given readings.

    To first order, in the device's frame if there are frames: what frames and geometry explain
    alike does not matter. Without what the model lacks.

    Attributes
    ----------
    position, orientation : float
        Root mean square over the workspace, m and rad.
    worst : float
        Position at the pose of the workspace where it is largest, root mean square, m.
    where : ndarray
        That pose: coordinates as in the measurements.
    poses : int
        Poses of the workspace in the figures.
    """

    position: float = field(unit="rms_m")
    orientation: float = field(unit="rms_rad")
    worst: float = field(unit="rms_m")
    where: Array
    poses: int

    @classmethod
    def of(cls, found: JointIdentification) -> Expected | None:
        """Over the calibrated mechanism's workspace; None without one, or for curved sensors."""
        from symkin.workspace import sample_workspace

        robot = found.mechanism
        if robot.curvature is not None:
            return None
        try:
            poses = sample_workspace(robot, _SAMPLES, robot.protocol.seed).poses
            effects, good = survey_of(found, robot).effects(poses)
        except SymkinError:
            return None
        if not len(effects):
            return None
        variances = np.einsum("nik,kl,nil->ni", effects, found.covariance, effects)
        position, orientation = variances[:, :3].sum(axis=1), variances[:, 3:].sum(axis=1)
        worst = int(np.argmax(position))
        return cls(
            position=float(np.sqrt(position.mean())),
            orientation=float(np.sqrt(orientation.mean())),
            worst=float(np.sqrt(position[worst])),
            where=poses[good][worst],
            poses=len(effects),
        )


def survey_of(
    found: JointIdentification, robot: Mechanism, observed: Observable = "pose"
) -> Survey:
    """What may be observed of a robot whose unknowns are the columns of an estimate."""
    from symkin.identification.problem import Problem
    from symkin.observed import Observed
    from symkin.planning.observing import Survey

    layout = Problem.of(found.nominal, found.measurements, found.options).layout
    # Some may have been held to settle the gauge.
    held = [i for i, name in enumerate(layout.names) if name not in found.names]
    layout = layout.without(held) if held else layout
    return Survey(Observed((observed,)), layout.names, layout.prior, robot, layout, found.options)


def directions_of(found: JointIdentification, tolerances: Array) -> tuple[Direction, ...]:
    """The combinations that are known worst and best, over what was known before.

    `tolerances` are those of the columns, NaN without; columns without one are left out.
    """
    kept = np.isfinite(tolerances)
    if not kept.any():
        return ()
    scale = tolerances[kept]
    inner = np.asarray(found.covariance)[np.ix_(kept, kept)] / np.outer(scale, scale)
    values, vectors = np.linalg.eigh(inner)
    names = tuple(np.array(found.names)[kept])
    return tuple(
        Direction(float(np.sqrt(max(values[i], 0.0))), name_combination(vectors[:, i], names))
        for i in (-1, 0)
    )


def correlations_of(covariance: Array, names: Sequence[str]) -> tuple[Correlation, ...]:
    """Those that are told apart worst, the worst first."""
    deviations = np.sqrt(np.diag(covariance))
    with np.errstate(divide="ignore", invalid="ignore"):
        correlation = np.nan_to_num(covariance / np.outer(deviations, deviations))
    lower = np.tril(correlation, -1)
    order = np.argsort(-np.abs(lower), axis=None)[:_CORRELATED]
    return tuple(
        Correlation((names[j], names[i]), float(lower[i, j]))
        for i, j in zip(*np.unravel_index(order, lower.shape), strict=True)
        if lower[i, j]
    )
