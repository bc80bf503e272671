# SPDX-License-Identifier: MIT
"""How a guided session begins, or goes on."""

from __future__ import annotations

import dataclasses
import hashlib
import json
import os
from collections.abc import Sequence
from pathlib import Path
from typing import Any, Literal, Unpack

import numpy as np
from numpy.typing import ArrayLike

from symkin.analysis.observed import Observable, Observed
from symkin.analysis.promises import CONFIDENCE, thinned
from symkin.analysis.workspace import WorkspaceSample, sample_workspace
from symkin.errors import SymkinError
from symkin.estimate.options import Unknowns
from symkin.estimate.survey import Survey, check_coordinates, coordinates_of
from symkin.files.mechanism_writer import save_mechanism
from symkin.guided.choosing import Chooser, Target
from symkin.guided.held import Held, held
from symkin.guided.session import ROBOT, TABLE, Session
from symkin.model.given import MechanismGiven, as_mechanism
from symkin.model.mechanism import Mechanism
from symkin.model.poses import pose_rows
from symkin.model.settings import IdentificationSettings, asked_or_set
from symkin.options import Coordinates, checks
from symkin.planning.observing import dealt, where_observed
from symkin.planning.prediction import check_wanted
from symkin.planning.selection import (
    Region,
    allowed_candidates,
    check_regions,
    clearance,
    design_tasks,
)
from symkin.storage.output_files import cannot_be_written
from symkin.values import Array

SETTINGS = "session.json"
_DIGESTS = ("drawing or unknowns", "candidates")  # which say nothing to a person
_CANDIDATES = 5000
_ENOUGH = 500  # candidates that show what any shows


@checks("candidates")
def measure(
    mechanism: MechanismGiven,
    accuracy: float | None = None,
    out: str | os.PathLike[str] | None = None,
    *,
    orientation: float | None = None,
    of: Coordinates | None = None,
    confidence: float = CONFIDENCE,
    noise: Literal["estimate"] | None = None,
    candidates: int | ArrayLike | WorkspaceSample | None = None,
    seed: int | None = None,
    avoid: Sequence[Region] = (),
    margin_sigmas: float = 3.0,
    observe: Observable | Sequence[Observable] | None = None,
    **unknowns: Unpack[Unknowns],
) -> Session:
    """Begin a guided session, or go on with one.

    Parameters
    ----------
    mechanism : Mechanism
        The nominal one.
    accuracy : float, optional
        End-effector error, root mean square over the workspace, that is wanted, m.
    out : str or path, optional
        The session's folder: one that is there goes on. By default it is kept in memory.
    orientation : float, optional
        The same of the orientation, rad; at least one of both is wanted.
    of : str, optional
        Coordinates that `accuracy` is of, in the device's frame: "x", "y", "z", two of them ("xy"),
        or "height", that above the bed that a probe touches, over that bed. By default all.
    confidence : float
        Share of such robots that shall keep the accuracy.
    noise : "estimate", optional
        Estimate the noise with the unknowns, once there are 20 degrees of freedom: then it is
        enough by Student's quantiles, and not before. By default it is the mechanism's, unless its
        file asks to estimate it.
    candidates : int, or poses, optional
        Poses to choose from, as `plan` has them; by default the protocol's, at most 5000.
    seed : int, optional
        Of the candidates; by default the protocol's.
    avoid, margin_sigmas
        See `make_plan`.
    observe : str or sequence of str, optional
        What is measured besides the readings, by default what the mechanism's device does, or
        full poses; frames, points and anchors are the mechanism's.
    **unknowns
        What is unknown, see `identify`; by default what the mechanism's file says. The tolerances
        are priors unless others are given.

    Returns
    -------
    Session

    Raises
    ------
    SymkinError
        For a folder that holds another session, naming the difference, and for options that do not
        go together.
    """
    mechanism = as_mechanism(mechanism)
    check_wanted(mechanism, accuracy, orientation)
    of = of or (coordinates_of(mechanism) if accuracy is not None else None)
    check_coordinates(mechanism, of)
    if of is not None and accuracy is None:
        raise SymkinError(f'no accuracy of the position is wanted; expected one of "{of}"')
    target = Target(accuracy, orientation, confidence, of)
    seed = mechanism.protocol.seed if seed is None else seed
    number = candidates if isinstance(candidates, int | np.integer) else None
    if candidates is None or number is not None:
        number = number or min(mechanism.protocol.candidates, _CANDIDATES)
        candidates = sample_workspace(mechanism, int(number), seed)
    observed = Observed.of(mechanism, observe)
    if of == "height" and (observed is None or "height" not in observed.kinds):
        raise SymkinError('no height is observed that could be wanted; expected observe "height"')
    poses = where_observed(mechanism, observed, pose_rows(candidates))
    given = {name: unknowns.get(name) for name in Unknowns.__annotations__}
    wanted = asked_or_set(given | {"noise": noise}, mechanism.identification)
    wanted["prior"] = wanted.get("prior") or "tolerances"
    noise = wanted.get("noise")  # as the session has it from here on
    settings = dict(vars(mechanism.identification or IdentificationSettings())) | wanted
    settings["noise"], settings["of"] = None, of
    robot = mechanism.replace(identification=IdentificationSettings(**settings))
    check_regions(mechanism, avoid)
    task = design_tasks(mechanism, "mechanism", use_symmetry=False)[0]
    kept = clearance(mechanism, poses, margin_sigmas)
    poses = poses[allowed_candidates(task, poses, None, avoid, kept)]
    poses = poses[np.isfinite(mechanism.inverse_kinematics(poses)).all(axis=1)]
    if not len(poses):
        raise SymkinError(
            "no candidate may be measured; expected a wider workspace, or fewer to avoid"
        )
    survey = Survey.of(robot, poses, observed, {})
    assert survey is not None  # since there is always a prior
    some = survey.rows(thinned(poses, _ENOUGH))
    survey.covariance([some[np.isfinite(some).all(axis=(1, 2))]])  # which names what is not shown
    groups = dealt(poses, survey.together, seed)
    chooser = Chooser(robot, groups, observed, {}, target, seed)
    folder = None if out is None else Path(out)
    lock = None
    if folder is not None:
        lock = _entered(folder)
        _settle(folder, robot, poses, observed, target, noise, seed)
    return Session(robot, chooser, survey, folder, noise, lock)


def _entered(folder: Path) -> Held:
    """Make the folder, and keep other processes out of it."""
    if folder.exists() and not folder.is_dir():
        raise SymkinError(f"{folder}: is not a folder; choose another place")
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise SymkinError(f"{folder}: cannot be made: {error.strerror}") from error
    return held(folder)


def _settle(
    folder: Path,
    robot: Mechanism,
    poses: Array,
    observed: Observed | None,
    target: Target,
    noise: str | None,
    seed: int,
) -> None:
    """Write down what the session is of, or refuse a folder that has another."""
    drawing = folder / f".{ROBOT}"
    settings = dataclasses.replace(robot.identification or IdentificationSettings(), of=None)
    plain = robot.replace(identification=settings)  # what the accuracy is of is told by itself
    save_mechanism(plain, drawing, overwrite=True)
    told: dict[str, Any] = {
        "robot": robot.name,
        "drawing or unknowns": hashlib.sha256(drawing.read_bytes()).hexdigest(),
        "accuracy": {
            target.of or name if name == "position" else name: value
            for name, value in target.wanted.items()
        },
        "confidence": target.confidence,
        "observe": ["pose"] if observed is None else list(observed.kinds),
        "noise": noise or "declared",
        "seed": seed,
        "candidates": hashlib.sha256(np.ascontiguousarray(poses).tobytes()).hexdigest(),
    }
    path = folder / SETTINGS
    if path.exists():
        drawing.unlink()
        before = _settings(path)
        other = [name for name, value in told.items() if before.get(name) != value]
        if other:
            was = [f"{name} {_said(before.get(name))}" for name in other if name not in _DIGESTS]
            told_as = f" ({', '.join(was)})" if was else ""
            raise SymkinError(
                f"{folder}: is a session of another {' and '.join(other)}{told_as}; expected the "
                "same, or another folder"
            )
        return
    if (folder / TABLE).exists():
        drawing.unlink()
        raise SymkinError(
            f"{folder / TABLE}: is there without {SETTINGS}, which says what it is of; expected a "
            "folder of a session, or a new one"
        )
    drawing.replace(folder / ROBOT)
    new = folder / f".{SETTINGS}"
    with cannot_be_written(folder):
        with new.open("w", encoding="utf-8", newline="\n") as file:
            file.write(json.dumps(told, indent=2) + "\n")
            file.flush()
            os.fsync(file.fileno())
        new.replace(path)


def _settings(path: Path) -> dict[str, Any]:
    try:
        found = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError, RecursionError):
        found = None
    if not isinstance(found, dict):
        raise SymkinError(
            f"{path}: cannot be read, and says what {TABLE} is of; expected it as it was, or "
            "another folder"
        )
    return found


def _said(value: Any) -> str:
    if isinstance(value, dict):
        return " and ".join(
            f"{each:g} {'rad' if name == 'orientation' else 'm'}"
            f"{'' if name in ('position', 'orientation') else f' of {name}'}"
            for name, each in value.items()
        )
    return " and ".join(map(str, value)) if isinstance(value, list) else str(value)
