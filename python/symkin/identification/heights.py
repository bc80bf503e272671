# SPDX-License-Identifier: MIT
"""What heights at which a probe touched a bed show of a robot, and of the size of what it makes."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from symkin.errors import SymkinError
from symkin.identification.knowledge import survey_of
from symkin.probing import CALIPER, is_probed
from symkin.result import Value, field, record

if TYPE_CHECKING:
    from symkin.identification.joint import JointIdentification

__all__ = ["Heights", "Shown", "heights_of", "in_words"]

Array = NDArray[np.float64]

_DIRECTIONS = 12  # in the plane, over which printed sizes are averaged
_FOLDS = 5
_SHOWN, _SILENT = 0.5, 0.9  # of the deviation before
_PLAIN = {
    "distal_length": "length of the rods",
    "proximal_length": "length of the cranks",
    "base_radius": "distance of towers or shafts from the centre",
    "base_azimuth": "where they stand around it",
    "base_height": "how high they are",
    "guide_elevation": "towers leaning in or out",
    "guide_swing": "towers leaning sideways",
    "axis_elevation": "shafts that are not level",
    "axis_swing": "shafts turned sideways",
    "sensor_gain": "travel a step",
    "sensor_offset": "end stops",
}


@record
class Shown(Value):
    """How far a kind of parameter is known, over what the tolerances say of it: 1 is no better.

    Attributes
    ----------
    parameter : str
        Such as ``base_radius``.
    common : float
        Of the mean of all legs.
    between : float
        Of what differs from leg to leg; NaN if it is shared, or of one leg alone.
    """

    parameter: str
    common: float
    between: float

    @property
    def plainly(self) -> str:
        """What the parameter is on a printer; its name where nobody said."""
        return _PLAIN.get(self.parameter, self.parameter)

    @property
    def is_shown(self) -> bool:
        """Whether the heights show what all legs have alike, or what differs between them."""
        return "shown" in (in_words(self.common), in_words(self.between))


@record
class Heights(Value):
    """What heights above a plane show.

    Attributes
    ----------
    before : float
        Heights as the nominal robot would have them less those measured, about the plane that fits
        best, root mean square, m.
    after : float
        Heights less what the calibrated robot predicts from the readings, at points that the
        identification did not see, root mean square, m.
    folds : int
        Of that cross-validation.
    size_before, size_after, size_with_length : float
        Standard deviation of the size of what it makes, of a length in the plane over that length:
        by the tolerances alone, as identified, and if one more length was measured along x to
        `CALIPER`.
    span : float
        That length, m: twice the root mean square distance of the points from their centre.
    shown : tuple of Shown
        The parameters that were unknown.
    """

    before: float = field(unit="rms_m")
    after: float = field(unit="rms_m")
    folds: int
    size_before: float
    size_after: float
    size_with_length: float
    span: float = field(unit="m")
    shown: tuple[Shown, ...]

    @property
    def notes(self) -> tuple[str, ...]:
        """What to know of the parameters and of the size of prints, in sentences."""
        sizes = (self.size_before, self.size_after, self.size_with_length)
        before, after, with_length = (f"{100 * each:.2g} mm" for each in sizes)
        size = (
            "Longer rods on a wider robot touch a bed at much the same heights and print "
            f"everything larger: 100 mm are known to {after} (standard deviation; {before} by the "
            f"tolerances alone); one more length of {1e3 * self.span:.0f} mm along x, printed and "
            f"measured to {1e3 * CALIPER:.2g} mm, would make it {with_length}."
        )
        hidden = [f"{each.plainly} ({each.parameter})" for each in self.shown if not each.is_shown]
        if not hidden:
            return (size,)
        return (
            f"The heights do not show {', '.join(hidden)}: their numbers are the drawing's within "
            "its tolerances, or go with others.",
            size,
        )


def heights_of(found: JointIdentification) -> Heights | None:
    """What the heights show; None if a robot that never turns was not probed, or not identified."""
    nominal, measurements, heights = found.nominal, found.measurements, found.measurements.heights
    if (
        heights is None
        or not found.converged
        or nominal.pose_space != "translating"
        or not is_probed(measurements)
        or not np.isfinite(measurements.readings).all()
    ):
        return None
    validation = found.cross_validation
    try:
        validation = validation or found.cross_validated(_FOLDS).cross_validation
        assert validation is not None
        places = nominal.forward_kinematics(measurements.readings)[0]
    except SymkinError:
        return None
    touched = np.isfinite(places).all(axis=1) & np.isfinite(heights)
    if touched.sum() <= 3:  # as many as a plane has coefficients
        return None
    effects, span = _size_effects(found, places[touched])
    before, after = _prior_covariance(found), np.asarray(found.covariance)
    along_x = effects[0]
    gain = after @ along_x / (along_x @ after @ along_x + (CALIPER / span) ** 2)
    with_length = after - np.outer(gain, along_x @ after)
    return Heights(
        before=_off_the_plane(places[touched], heights[touched]),
        after=validation.observed_rms.get("heights_m", float("nan")),
        folds=validation.folds,
        size_before=_rms(effects, before),
        size_after=_rms(effects, after),
        size_with_length=_rms(effects, with_length),
        span=span,
        shown=tuple(_shown(found, before, after)),
    )


def _rms(effects: Array, covariance: Array) -> float:
    return float(np.sqrt(np.mean(np.einsum("ni,ij,nj->n", effects, covariance, effects))))


def _off_the_plane(places: Array, heights: Array) -> float:
    """Root mean square of what a plane leaves of the heights."""
    columns = np.column_stack([np.ones(len(places)), places[:, :2]])
    wanted = places[:, 2] - heights
    left = wanted - columns @ np.linalg.lstsq(columns, wanted, rcond=None)[0]
    return float(np.sqrt(np.mean(left**2)))


def _prior_covariance(found: JointIdentification) -> Array:
    """What the tolerances and priors say of the unknowns; nothing of the frames."""
    known = [
        each.prior if np.isfinite(each.prior) else each.tolerance for each in found.first_unknowns
    ]
    return np.diag(np.nan_to_num(np.array(known)) ** 2)


def _size_effects(found: JointIdentification, places: Array) -> tuple[Array, float]:
    """How lengths in the plane grow with the unknowns, relative to them, a row a direction.

    They are centred among the points, as long as these are wide.
    """
    centre = places.mean(axis=0)
    half = float(np.sqrt(np.mean(np.sum((places - centre)[:, :2] ** 2, axis=1))))
    angles = np.pi * np.arange(_DIRECTIONS) / _DIRECTIONS
    along = np.column_stack([np.cos(angles), np.sin(angles), np.zeros(_DIRECTIONS)])
    robot = found.mechanism.replace(frames=None, curvature=None)
    survey = survey_of(found, robot, "height")
    ends = [survey.effects(centre + sign * half * along)[0][:, :3] for sign in (-1, 1)]
    return np.einsum("nd,ndi->ni", along, ends[1] - ends[0]) / (2 * half), 2 * half


def _shown(found: JointIdentification, before: Array, after: Array) -> list[Shown]:
    groups: dict[str, list[int]] = {}
    for column, unknown in enumerate(found.first_unknowns):
        block, _, parameter = unknown.name.partition(".")
        if block.startswith("leg") and before[column, column] > 0:
            groups.setdefault(parameter, []).append(column)
    told = []
    for parameter, columns in groups.items():
        own = [each[np.ix_(columns, columns)] for each in (after, before)]
        count = len(columns)
        common, total = (float(each.sum()) for each in own)
        apart = np.eye(count) - 1 / count
        spread, much = (float(np.trace(apart @ each)) for each in own)
        between = float(np.sqrt(spread / much)) if count > 1 else float("nan")
        told.append(Shown(parameter, float(np.sqrt(common / total)), between))
    return told


def in_words(known: float) -> str:
    """Whether something is shown, by its deviation over that of the tolerances."""
    if np.isnan(known):
        return "-"
    if known <= _SHOWN:
        return "shown"
    return "partly" if known <= _SILENT else "not shown"
