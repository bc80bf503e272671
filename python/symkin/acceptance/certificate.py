# SPDX-License-Identifier: MIT
"""What an acceptance test found: the figures and the verdict of a certificate."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any, ClassVar, Literal

import numpy as np

from symkin.acceptance.limits import Decision, RmsLimits, Verdict
from symkin.acceptance.repeatability import PoseAccuracy
from symkin.model.poses import POSE_SPACES, PoseSpace
from symkin.results import FolderResult
from symkin.values import Array, Value, field, record

Kind = Literal["position", "orientation"]

# What a certificate states besides, and what its line is called; empty lines are filled in by hand.
ABOUT: Mapping[str, str] = {
    "serial": "Robot, serial number",
    "device": "Measuring device",
    "device_serial": "Its serial number",
    "calibration_due": "Its calibration is due",
    "uncertainty_source": "Source of its uncertainty",
    "place": "Place",
    "date": "Date",
    "temperature": "Temperature",
    "load": "Load",
    "speed": "Speed",
    "approach": "Direction of approach",
    "warm_up": "Warm-up",
    "chosen": "How the poses were chosen",
    "person": "Tested by",
}


@record
class TestedPose(Value):
    """One commanded pose, visited once or more.

    Attributes
    ----------
    rows : tuple of int
        Where its visits stand in the table.
    accuracy : PoseAccuracy
        Pose accuracy and repeatability; NaN of what was not measured.
    position, orientation : RmsLimits or None
        Limits of what the robot is off there on average, and what they decide; None without a
        tolerance.
    """

    rows: tuple[int, ...]
    accuracy: PoseAccuracy
    position: RmsLimits | None = None
    orientation: RmsLimits | None = None


@record
class Judged(Value):
    """What was found of the position, or of the orientation.

    Attributes
    ----------
    kind : {"position", "orientation"}
        Which.
    limits : RmsLimits
        Of the root mean square over all rows.
    before : float
        The root mean square of the drawing; NaN if nobody said which.
    largest : Decision
        The largest pose accuracy, m or rad, and what a guard band decides of it.
    verdict : {"pass", "fail", "undecided"}
        Of what was to be judged.
    reason : str
        Why it is undecided.
    """

    kind: Kind
    limits: RmsLimits
    before: float
    largest: Decision
    verdict: Verdict
    reason: str = ""

    @property
    def unit(self) -> str:
        """Of all of it: "m" or "rad"."""
        return "m" if self.kind == "position" else "rad"


@record
class Acceptance(FolderResult):
    """Whether a robot keeps a tolerance, by measurements that its calibration has not seen.

    Attributes
    ----------
    name : str
        Of the model that commands the robot.
    judge : {"rms", "largest"}
        What the tolerance is of: the root mean square over the poses, or every pose's accuracy.
    judged : tuple of Judged
        Position, orientation, or both.
    verdict : {"pass", "fail", "undecided"}
        Of all together.
    poses : tuple of TestedPose
        The commanded poses; of points that were measured, a place of each at each pose.
    commanded : int
        How many poses those are of, whose number says how far they stand for others.
    held_out : bool or None
        Whether no row is one of the calibration; None if nobody said which those were.
    failed : tuple of int
        Rows that the model cannot take; with one, there is no pass.
    unread, unmeasured : int
        Rows left out, since not all legs were read, or nothing of the pose was measured.
    fitted : tuple of str
        Frames that were fitted to this table.
    of : str or None
        The coordinates that errors of the position are of, such as "z" or "height"; None: of all.
    tested, workspace : ndarray, shape (dof, 2)
        Least and largest coordinate of the tested poses, and of the workspace; m and rad.
    about : mapping of str to str
        What else the certificate states, see `ABOUT`.
    digests : tuple of (name, SHA-256)
        Of the files it was made from.
    notes : tuple of str
        What else is to be known of the table, and of poses that were not tested.
    doubts : tuple of str
        What speaks against the rows: readings that are missing, columns that stand still, and of
        a failure the mistake that explains it.
    """

    FILES: ClassVar[tuple[str, ...]] = ("acceptance.json", "certificate.html")

    name: str
    judge: Literal["rms", "largest"]
    judged: tuple[Judged, ...]
    verdict: Verdict
    poses: tuple[TestedPose, ...]
    commanded: int
    held_out: bool | None
    pose_space: str
    failed: tuple[int, ...] = ()
    unread: int = 0
    unmeasured: int = 0
    fitted: tuple[str, ...] = ()
    of: str | None = None
    tested: Array = field(default_factory=lambda: np.zeros((0, 2)))
    workspace: Array = field(default_factory=lambda: np.zeros((0, 2)))
    about: Mapping[str, str] = field(default_factory=dict)
    digests: tuple[tuple[str, str], ...] = ()
    notes: tuple[str, ...] = ()
    doubts: tuple[str, ...] = ()

    @property
    def space(self) -> PoseSpace:
        """What the poses are made of."""
        return POSE_SPACES[self.pose_space]

    def columns(self) -> Mapping[str, Any]:
        """Return the commanded poses, a row each."""
        found: dict[str, Any] = {
            "row": [each.rows[0] for each in self.poses],
            "visits": [each.accuracy.visits for each in self.poses],
            "AP_position_m": [each.accuracy.position_accuracy for each in self.poses],
            "RP_position_m": [each.accuracy.position_repeatability for each in self.poses],
        }
        for index, (name, unit) in enumerate(self.space.units.items()):
            if self.of is not None and unit == "m" and name not in self.of:
                continue  # nor is a height a coordinate
            found[f"AP_{name}_{unit}"] = [each.accuracy.components[index] for each in self.poses]
        for index, name in enumerate(self.space.rotation):
            found[f"RP_{name}_rad"] = [
                each.accuracy.angle_repeatability[index] for each in self.poses
            ]
        for judged in self.judged:
            limits = [getattr(each, judged.kind) for each in self.poses]
            found[f"{judged.kind}_upper_{judged.unit}"] = [
                math.nan if each is None else each.upper for each in limits
            ]
        return found

    def write_files(self, folder: Any, *, report: bool = True) -> None:
        """Write them into a folder that is there."""
        self.save(folder / self.FILES[0])
        if report:
            self.report(folder / self.FILES[1])
