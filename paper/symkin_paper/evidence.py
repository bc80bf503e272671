# SPDX-License-Identifier: MIT
"""The figures by which the paper's claims are judged."""

from __future__ import annotations

from symkin.study.summaries import Ratio
from symkin.values import Value, field, record

__all__ = ["Evidence", "SliceErrors"]


@record
class SliceErrors(Value):
    """Root mean square position errors over a constant-orientation workspace, m.

    `ratio` is of the first over the second, robot by robot.
    """

    orientation: float = field(unit="rad")
    divided: float = field(unit="m")
    traditional: float = field(unit="m")
    ratio: Ratio


@record
class Evidence(Value):
    """The figures by which the claims are judged.

    Attributes
    ----------
    poses : int
        On which each element of the symmetry was tested.
    rotations, reflections : int
        Elements of the structure's group.
    mismatches : int
        Poses that are in the workspace while their images are not, or the reverse.
    workspace_elements : tuple of str
        That carry the workspace of these working modes onto itself.
    reading_elements : tuple of str
        That carry the active-joint workspace onto itself.
    reading_deviation : float
        Of the readings at the image of a pose from the image of its readings, rad: the largest of
        the elements that keep the working modes, and
    reading_deviation_all : float
        of all.
    slice_areas, slice_mismatches : tuple
        Of the constant orientations 0, 0.4 and 0.6 rad: m^2, and cells whose images are not inside.
    conditions_met, conditions : int
        Of those of sections 4 and 5.
    offsets_off : float
        Of the sensor offsets from Eq. 19, rad.
    mapped_deviation, printed_deviation : float
        Of abs(R_ii) of a leg at its images from those of leg 1, relative, by Eq. 14 and by Eq. 10
        as it is printed.
    order_parameter : str
        Of leg 1, whose abs(R_ii) depends most on the order of the parameters, and
    order_diagonals : tuple of float
        what it is at the same poses if that parameter is the first of all, and the last.
    moved_zero_mismatches, moved_zero_deviation : int, float
        Of a robot of which one sensor's zero is elsewhere: poses that are in the workspace while
        their images are not, or the reverse; readings at the image from the image of the readings,
        rad.
    tilt : float
        Of axes that are not square to the plane, rad: the tolerance of angles;
    tilted_error : float
        the position error over the workspace that it makes, m;
    tilted_out_of_plane : float
        how far a link's end leaves the plane, m; and
    drawn_error : float
        the position error that parameters within the tolerances make, m.
    turned_planar, turned_spatial : float
        How far mapped poses are turned from the originals, of the 3-RRR and of the hexapod, rad.
    legs : int
        Of the mechanism.
    selection_saving, plan_saving : Ratio
        Processor time of choosing for every leg over that for one: the search, the whole plan. The
        interval is that of the middle half of repeated timings.
    replacement_saving : Ratio
        Processor time of finding the best pose for one of the 24 places by the singular values of
        Eq. 13, over that of Sun and Hollerbach's whole search.
    exchange_saving : Ratio
        That of a search by exchange over it.
    selection_gap : float
        How far the determinant of Sun and Hollerbach's poses is below the best that was found.
    selection_bound : float
        The same against a bound on any choice.
    efficiencies : tuple of float
        Of a pose among p, 2p and 3p of them, against one among 10p: of squared position errors.
    printed_steps, corrected_steps : tuple of float
        Closures g - psi before and after iterations of Eqs. 24 to 26 as printed, and with the other
        sign, rad (root mean squares).
    step_saving : Ratio
        Processor time of a least-squares step of all parameters at once over that of all legs.
    condition_whole, condition_leg : float
        Condition numbers of the two identification matrices.
    measured_divided, measured_traditional : int
        Poses measured by the paper's protocols.
    improvement : tuple of float
        Errors before over errors after the protocol: position, orientation.
    against_traditional, against_equal_effort, against_independent : tuple of Ratio
        Errors of the protocol over those of the traditional method with 24 poses, with as many
        measured poses, and of selections for each leg by itself: position, orientation.
    robots : int
        Simulated.
    slices : tuple of SliceErrors
        Of the local errors.
    replaced, commanded : int
        Poses that robots could not take, of those that the paper's protocol told them to.
    unreachable, evaluated : int
        The same of the poses over which errors are taken, of which there are
    evaluation_poses : int
        a robot.
    """

    poses: int
    rotations: int
    reflections: int
    mismatches: int
    workspace_elements: tuple[str, ...]
    reading_elements: tuple[str, ...]
    reading_deviation: float = field(unit="rad")
    reading_deviation_all: float = field(unit="rad")
    slice_areas: tuple[float, ...] = field(unit="m2")
    slice_mismatches: tuple[int, ...]
    conditions_met: int
    conditions: int
    offsets_off: float = field(unit="rad")
    mapped_deviation: float
    printed_deviation: float
    order_parameter: str
    order_diagonals: tuple[float, float]
    moved_zero_mismatches: int
    moved_zero_deviation: float = field(unit="rad")
    tilt: float = field(unit="rad")
    tilted_error: float = field(unit="m")
    tilted_out_of_plane: float = field(unit="m")
    drawn_error: float = field(unit="m")
    turned_planar: float = field(unit="rad")
    turned_spatial: float = field(unit="rad")
    legs: int
    selection_saving: Ratio
    plan_saving: Ratio
    replacement_saving: Ratio
    exchange_saving: Ratio
    selection_gap: float
    selection_bound: float
    efficiencies: tuple[float, float, float]
    printed_steps: tuple[float, ...] = field(unit="rad")
    corrected_steps: tuple[float, ...] = field(unit="rad")
    step_saving: Ratio
    condition_whole: float
    condition_leg: float
    measured_divided: int
    measured_traditional: int
    improvement: tuple[float, float]
    against_traditional: tuple[Ratio, Ratio]
    against_equal_effort: tuple[Ratio, Ratio]
    against_independent: tuple[Ratio, Ratio]
    robots: int
    slices: tuple[SliceErrors, ...]
    replaced: int
    commanded: int
    unreachable: int
    evaluated: int
    evaluation_poses: int
