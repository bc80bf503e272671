# SPDX-License-Identifier: MIT
"""What sections 4 to 6 of the paper claim, and how each claim is judged by figures.

Every verdict is computed: a function takes the figures that were measured and returns what they
say. `judge` asks all of them about the `Evidence` of one study.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import Literal

from symkin.show.wording import count, milli, plural, significant
from symkin.study.summaries import Ratio
from symkin.values import Value, record
from symkin_paper.evidence import Evidence

__all__ = ["Claim", "Judgement", "Verdict", "judge"]

Verdict = Literal["holds", "holds partly", "does not hold", "not decided"]

_ROUNDING = 1e-9  # relative, or rad: far above what rounding does to readings and |R_ii|
_EFFICIENT = 0.9  # of the information that a pose brings where there are many
_NEAR = 0.01  # below the best set of poses
_ALIKE, _NEARLY_ALIKE = 0.05, 0.25  # relative differences of errors that selections may leave
_RARE = 0.01  # share of poses that robots cannot take, or whose images are not inside
_MINOR = 0.1  # of the error that other causes make
_SAVING = 1.2  # times cheaper
_MACHINES = 1.1  # times: ratios of times that other machines may have
_OPEN = "not told apart"
_FIGURE_6 = "section 6.2, Fig. 6a"
_REPORTED = "section 2, advantage 3, Fig. 9"


@record
class Judgement(Value):
    """A verdict, and the sentence that gives its figures."""

    verdict: Verdict
    sentence: str


@record
class Claim(Value):
    """A claim of the paper, judged.

    Attributes
    ----------
    name : str
        What it is about.
    place : str
        Section, and equation or figure.
    figure : int
        The paper's figure, 6 to 10, beside which it is told.
    quotation : str
        The paper's words.
    verdict : {"holds", "holds partly", "does not hold", "not decided"}
        What the figures say; the last where so few robots do not tell, or where a ratio of times is
        so near to what it is compared with that another machine could say otherwise.
    sentence : str
        The figures.
    """

    name: str
    place: str
    figure: int
    quotation: str
    verdict: Verdict
    sentence: str


# In the order of the paper: name, place, figure and quotation as `Claim` has them, and who judges.
CLAIMS: list[tuple[str, str, int, str, Callable[[Evidence], Judgement]]] = []


def judge(evidence: Evidence) -> tuple[Claim, ...]:
    """Judge every claim, in the order of the paper."""
    claims = []
    for name, place, figure, quotation, judged in CLAIMS:
        found = judged(evidence)
        claims.append(Claim(name, place, figure, quotation, found.verdict, found.sentence))
    return tuple(claims)


def _claim(
    name: str, place: str, figure: int, quotation: str
) -> Callable[[Callable[[Evidence], Judgement]], Callable[[Evidence], Judgement]]:
    """Say what a function judges."""

    def known(judged: Callable[[Evidence], Judgement]) -> Callable[[Evidence], Judgement]:
        CLAIMS.append((name, place, figure, quotation, judged))
        return judged

    return known


def _graded(whole: bool, part: bool, sentence: str) -> Judgement:
    verdict: Verdict = "holds" if whole else "holds partly" if part else "does not hold"
    return Judgement(verdict, sentence)


def _steps(values: Sequence[float]) -> str:
    arrow = " \N{RIGHTWARDS ARROW} "
    return arrow.join(significant(1e3 * value) for value in values if math.isfinite(value))


def _compared(ratios: tuple[Ratio, Ratio], effort: str) -> Judgement:
    """Whether divide and conquer is better, as far as the intervals tell."""
    words = [_side(each) for each in ratios]
    sentence = (
        f"{effort}, divide and conquer is {words[0]} in position, {_times(ratios[0])} the error of "
        f"the traditional method, and {words[1]} in orientation, {_times(ratios[1])}."
    )
    if _OPEN in words:
        return Judgement("not decided", sentence)
    return _graded(set(words) == {"better"}, "better" in words, sentence)


def _side(ratio: Ratio) -> str:
    """Whether errors are smaller or larger, as far as the interval tells."""
    return "better" if ratio.high < 1 else "worse" if ratio.low > 1 else _OPEN


def _likeness(ratio: Ratio) -> Literal["alike", "nearly", "apart", "not told"]:
    """How near to 1 a ratio is, as far as its interval tells."""

    def within(limit: float) -> bool:
        return 1 - limit < ratio.low and ratio.high < 1 + limit

    def beyond(limit: float) -> bool:
        return ratio.high < 1 - limit or 1 + limit < ratio.low

    if within(_ALIKE):
        return "alike"
    if beyond(_NEARLY_ALIKE):
        return "apart"
    return "nearly" if within(_NEARLY_ALIKE) and beyond(_ALIKE) else "not told"


def _timed(found: Ratio, least: float) -> tuple[bool, bool]:
    """Whether a ratio of times is so large: as it may at least be, and at most.

    They differ where repetitions, or another machine, may say otherwise.
    """
    return found.low >= least * _MACHINES, found.high >= least / _MACHINES


def _decided(least: Verdict, most: Verdict, sentence: str) -> Judgement:
    """A verdict, if it is the same whatever a ratio of times may be."""
    if least == most:
        return Judgement(least, sentence)
    return Judgement(
        "not decided",
        f"{sentence} Another machine could say that this {least}, or that it {most}.",
    )


def _times(ratio: Ratio) -> str:
    """Such as ``0.54 times (0.52 to 0.56)``."""
    low, high = significant(ratio.low), significant(ratio.high)
    return f"{significant(ratio.value)} times ({low} to {high})"


@_claim(
    "Symmetry of the workspace",
    "sections 4.1 and 6.1, Eq. 2, Figs. 6b to 6d",
    6,
    "The actuation of the symmetrical group G_M on the end-effector workspace will make the "
    "workspace superimpose with itself.",
)
def workspace_theorem(found: Evidence) -> Judgement:
    """Eq. 2: every element of G_M should carry the workspace onto itself."""
    order, kept = found.rotations + found.reflections, len(found.workspace_elements)
    wrong = found.mismatches + sum(found.slice_mismatches)
    areas = ", ".join(f"{area:.3g}" for area in found.slice_areas)
    return _graded(
        kept == order and wrong == 0,
        kept > 1 and wrong == 0,
        f"{kept} of the {order} elements ({', '.join(found.workspace_elements)}) carry the "
        f"workspace of these dyads onto itself; the others flip the dyads and carry it onto that "
        f"of the flipped ones. {plural(found.mismatches, 'mismatch', 'mismatches')} in "
        f"{count(found.poses)} poses an element; of the constant orientations of Figs. 6b to 6d "
        f"({areas} m\N{SUPERSCRIPT TWO}) they carry "
        f"{plural(sum(found.slice_mismatches), 'cell')} out of the workspace.",
    )


@_claim(
    "Conjecture of the active joints",
    "sections 4.2 and 6.2, Eq. 5, Fig. 6a",
    6,
    "A numerical calculation of the active-joints workspace is performed to validate the "
    "symmetrical conjecture.",
)
def joint_conjecture(found: Evidence) -> Judgement:
    """Eq. 5: the readings at the image of a pose are the image of the readings."""
    return _graded(
        found.reading_deviation_all < _ROUNDING,
        found.reading_deviation < _ROUNDING,
        f"The readings at the image of a pose differ from the image of its readings by at most "
        f"{found.reading_deviation_all:.1g} rad, {found.reading_deviation:.1g} rad for the "
        f"elements that keep the dyads ({count(found.poses)} poses an element). No forward "
        "kinematics is needed to see it: a leg's inverse kinematics is that of its image.",
    )


@_claim(
    "A symmetrical workspace is not sufficient",
    "section 4.2",
    6,
    "However, a symmetrical workspace is not a sufficient condition to obtain a correspondent "
    "symmetrical active-joints workspace.",
)
def not_sufficient(found: Evidence) -> Judgement:
    """Section 4.2: the workspace may be symmetrical and the readings not."""
    apart = found.moved_zero_deviation > _ROUNDING
    return _graded(
        apart and found.moved_zero_mismatches == 0,
        apart and found.moved_zero_mismatches < _RARE * found.poses,
        f"With one sensor's zero moved by 0.1 rad, "
        f"{plural(found.moved_zero_mismatches, 'pose')} of the workspace "
        f"{'has' if found.moved_zero_mismatches == 1 else 'have'} an image outside it, and the "
        "readings at the image differ from the image of the readings by up to "
        f"{significant(found.moved_zero_deviation, 2)} rad.",
    )


@_claim(
    "Defects of revolute joints",
    "section 5, hypothesis (3), here (3d) and (3e)",
    6,
    "The hypothesis (3a) to (3e) are consequent with realistic operation conditions in which the "
    "influences of defects in the joints have a minor effect on pose accuracy compared with errors "
    "in the location of the joints.",
)
def revolute_defects(found: Evidence) -> Judgement:
    """Section 5, (3d) and (3e): axes square to the plane, links in it."""
    share = found.tilted_error / found.drawn_error
    return _graded(
        share < _MINOR,
        share < 1,
        f"Axes {milli(found.tilt, 'rad')} from square, as much as other angles may be off, move "
        f"the platform by {milli(found.tilted_error, 'm')} in the plane, since they shorten a "
        f"link's projection to second order only; parameters within the tolerances by "
        f"{milli(found.drawn_error, 'm')}. A link's end leaves the plane by up to "
        f"{milli(found.tilted_out_of_plane, 'm')}, which no planar pose shows. Universal, "
        "spherical and prismatic joints, (3a) to (3c), this mechanism has not.",
    )


@_claim(
    "Symmetrical observability",
    "section 5, Eq. 10, and section 6.4, Fig. 8",
    8,
    "In Fig. 8 the symmetrical observability of the legs is verified by the calculation of the "
    "observability index, Eq. 10.",
)
def observability(found: Evidence) -> Judgement:
    """Eq. 10 and Fig. 8: the same abs(R_ii) for every leg."""
    return _graded(
        max(found.mapped_deviation, found.printed_deviation) < _ROUNDING,
        found.mapped_deviation < _ROUNDING,
        f"|R_ii| of the legs at poses mapped by Eqs. 14 and 22 are equal to "
        f"{found.mapped_deviation:.1g} (relative). Eq. 10 as printed contradicts Eq. 14: it has "
        f"the inverse of its map, by which they are up to {100 * found.printed_deviation:.0f}% "
        "off.",
    )


@_claim(
    "Observability of a parameter",
    "section 5, Eqs. 9 and 10",
    8,
    "The observability of the ith parameter is estimated by its correspondent element on the "
    "diagonal of the R matrix.",
)
def diagonal_of_parameter(found: Evidence) -> Judgement:
    """Section 5: abs(R_ii) should belong to the parameter, whatever the order of the others."""
    first, last = found.order_diagonals
    return _graded(
        first < last * (1 + _ROUNDING),
        first < 2 * last,
        f"It depends on the order in which the parameters are written: at the same poses |R_ii| "
        f"of {found.order_parameter} is {significant(first)} if it is the first of all and "
        f"{significant(last)} if it is the last. The last alone is the inverse of its standard "
        "deviation; the others leave out what the parameters after it explain as well.",
    )


@_claim(
    "Cost of the selection",
    "section 5.1",
    7,
    "By the symmetrical planning [...] it is possible to reduce the optimal posture selection "
    "to 1/n of the original searching.",
)
def selection_cost(found: Evidence) -> Judgement:
    """Section 5.1: 1 / n_legs of the searching."""
    sentence = (
        f"Choosing for each of {found.legs} legs takes {_times(found.selection_saving)} as long as "
        "choosing for one; the whole plan, images and spares included, "
        f"{_times(found.plan_saving)}."
    )
    whole, part = (_timed(found.selection_saving, at) for at in (0.8 * found.legs, _SAVING))
    least, most = (_graded(*each, sentence).verdict for each in zip(whole, part, strict=True))
    return _decided(least, most, sentence)


@_claim(
    "Number of poses",
    "section 5.1, PS2",
    7,
    "As a rule of thumb the number of identification poses should be two or three times larger "
    "than the number of parameters to be estimated.",
)
def rule_of_thumb(found: Evidence) -> Judgement:
    """Section 5.1: two or three times as many poses as parameters."""
    _, twice, thrice = found.efficiencies
    shares = [f"{100 * share:.0f}%" for share in found.efficiencies]
    return _graded(
        min(twice, thrice) >= _EFFICIENT,
        max(twice, thrice) >= _EFFICIENT,
        f"With 2p and 3p poses a pose is worth {shares[1]} and {shares[2]} of what it is among "
        f"10p, so that such a number wastes little. p poses, of which each is worth {shares[0]}, "
        "are no rival: they leave nothing to check the answer with.",
    )


@_claim(
    "Mapped poses",
    "section 5.1, Eq. 14, and section 6.4, Eq. 22",
    7,
    "R_\N{GREEK SMALL LETTER KAPPA} = \N{GREEK SMALL LETTER LAMDA}\N{GREEK SMALL LETTER KAPPA}"
    "(R_1), P_\N{GREEK SMALL LETTER KAPPA} = P_1",
)
def same_orientations(found: Evidence) -> Judgement:
    """Eqs. 14 and 22: P_kappa = P_1."""
    planar, spatial = (value < _ROUNDING for value in (found.turned_planar, found.turned_spatial))
    return _graded(
        planar and spatial,
        planar,
        f"Mapped poses of the 3-RRR keep their angle (to {found.turned_planar:.1g} rad); those of "
        f"a hexapod must turn about other axes (up to {significant(found.turned_spatial, 2)} rad "
        "apart), so Eq. 14 holds for rotations of planar mechanisms.",
    )


@_claim(
    "Group of the structure",
    "section 6.1, Eq. 18",
    6,
    "The first three elements of G_M represent rotations about the Z-axis [...] and the last "
    "three elements of G_M denote reflections.",
)
def structure_group(found: Evidence) -> Judgement:
    """Eq. 18: three rotations and three reflections."""
    return _graded(
        (found.rotations, found.reflections) == (3, 3),
        found.rotations == 3,
        f"Found from the legs' parameters: {plural(found.rotations, 'rotation')} and "
        f"{plural(found.reflections, 'reflection')}, the working modes aside.",
    )


@_claim(
    "Conditions of sections 4 and 5",
    "sections 6.1 and 6.3",
    6,
    "The 3RRR symmetrical parallel mechanism satisfies the workspace symmetry conditions (1) "
    "to (4) [...] Consequently with the conditions (1)-(7) [...] we configure this set of "
    "parameters to be symmetrically observable.",
)
def conditions(found: Evidence) -> Judgement:
    """Sections 4 and 5: conditions (1) to (5) and (1) to (7)."""
    return _graded(
        found.conditions_met == found.conditions,
        found.conditions_met > 0,
        f"{found.conditions_met} of the {found.conditions} conditions of sections 4 and 5 are met, "
        "each tested with the mechanism's numbers.",
    )


@_claim(
    "Sensor offsets",
    "section 6.2, Eq. 19",
    6,
    "The mechanism is configured symmetrically positioning the active-joints measuring system.",
)
def sensor_offsets(found: Evidence) -> Judgement:
    """Eq. 19: the offsets that make the readings symmetric."""
    return _graded(
        found.offsets_off < _ROUNDING,
        found.offsets_off < 1e-3,
        f"The offsets that symmetry asks of legs 2 and 3, given leg 1's, differ from Eq. 19 "
        f"by {found.offsets_off:.1g} rad, whole turns aside.",
    )


@_claim(
    "Group of the active joints",
    _FIGURE_6,
    6,
    "The symmetry group of the active-joint workspace corresponds to rotations of 0 rad, "
    "2\N{GREEK SMALL LETTER PI}/3 rad, and 4\N{GREEK SMALL LETTER PI}/3 rad around the axis "
    "\N{GREEK SMALL LETTER PSI}1 = \N{GREEK SMALL LETTER PSI}2 = "
    "\N{GREEK SMALL LETTER PSI}3.",
)
def joint_group(found: Evidence) -> Judgement:
    """Fig. 6a: rotations about the line of equal readings, and nothing else."""
    elements = set(found.reading_elements)
    return _graded(
        elements == {"r0", "r1", "r2"},
        len(elements) > 1,
        f"The active-joint workspace of these dyads is carried onto itself by "
        f"{', '.join(found.reading_elements)}: the cyclic exchanges of the readings.",
    )


@_claim(
    "Optimal poses",
    "section 6.4, PS2, Fig. 7",
    7,
    "A set of 24 optimal identification poses [...] is selected using the robot calibration "
    "algorithm of Sun and Hollerbach.",
)
def optimal_poses(found: Evidence) -> Judgement:
    """Section 6.4, PS2: Sun and Hollerbach's algorithm selects optimal poses."""
    return _graded(
        found.selection_gap < _ROUNDING,
        found.selection_gap < _NEAR,
        f"O_1 of the 24 poses is {100 * found.selection_gap:.2f}% below that of a better set, "
        f"found by exchange, and at most {100 * found.selection_bound:.2f}% below that of any.",
    )


@_claim(
    "Efficiency of the selection",
    "section 7, advantage 2",
    7,
    "The improvement of the numerical efficiency of the procedure for the selection of optimal "
    "identification poses by the adoption of the active robot calibration algorithm.",
)
def selection_efficiency(found: Evidence) -> Judgement:
    """Section 7, advantage 2: Sun and Hollerbach's algorithm costs less than others."""
    sentence = (
        f"To find one of the 24 poses by the singular values of Eq. 13 takes "
        f"{_times(found.replacement_saving)} as long as Sun and Hollerbach's whole search; a "
        f"search by exchange takes {_times(found.exchange_saving)} as long. The paper does not "
        "say what it adopted the algorithm instead of."
    )
    plain = _timed(found.replacement_saving, _SAVING)
    others = _timed(found.exchange_saving, 1)
    least, most = (
        _graded(better and best, better, sentence).verdict
        for better, best in zip(plain, others, strict=True)
    )
    return _decided(least, most, sentence)


@_claim(
    "Iteration of the estimate",
    "section 6.5, Eqs. 24 to 26",
    9,
    "The estimation is achieved using a iterative linear least-squares solution of Eq. 24.",
)
def printed_iteration(found: Evidence) -> Judgement:
    """Eqs. 24 to 26: the linear steps should make the closures small."""
    printed, corrected = (
        steps[-1] < 0.1 * steps[0] if math.isfinite(steps[-1]) else False
        for steps in (found.printed_steps, found.corrected_steps)
    )
    return _graded(
        printed,
        corrected,
        f"With the signs as printed the closures grow in every step "
        f"({_steps(found.printed_steps)} mrad); with the estimate subtracted in Eq. 26 the "
        f"iteration converges ({_steps(found.corrected_steps)} mrad)."
        if not printed
        else f"The closures become {_steps(found.printed_steps)} mrad.",
    )


@_claim(
    "Poses without singularities",
    "section 6.5",
    9,
    "The set of measured poses corresponds to the set of 30 000 poses used to design the "
    "identification experiments.",
)
def poses_can_be_taken(found: Evidence) -> Judgement:
    """Section 6.5: a robot can be measured at all of the poses over which errors are taken."""
    evaluated = found.unreachable / found.evaluated
    return _graded(
        found.unreachable == 0,
        evaluated < _RARE,
        f"Calibrated robots take all but {100 * evaluated:.2g}% of these poses "
        f"({count(found.evaluation_poses)} of the 30 000, every robot). Of the 72 that are to be "
        f"measured for the identification, with the drawing as the model, "
        f"{100 * found.replaced / found.commanded:.2g}% are beyond a robot's reach and were "
        "replaced by spares: the pool keeps no distance for the errors of the robot.",
    )


@_claim(
    "Before and after",
    "section 6.5, Fig. 9",
    9,
    "RMSE of the end-effector pose estimated for the workspace without singularities before "
    "and after calibration.",
)
def calibration_helps(found: Evidence) -> Judgement:
    """Fig. 9: errors before and after."""
    position, orientation = found.improvement
    return _graded(
        min(found.improvement) > 10,
        min(found.improvement) > 1,
        f"The position error becomes {significant(position, 2)} times smaller, the orientation "
        f"error {significant(orientation, 2)} times ({plural(found.robots, 'robot')}). It is a "
        "matter of the kinematic errors, which the paper does not state.",
    )


@_claim(
    "Better than the traditional method",
    _REPORTED,
    9,
    "Calibrating the kinematic model with the identified set of parameters results in a better "
    "end-effector accuracy with respect to calibrations by means of other traditional "
    "kinematic identification methods.",
)
def better_than_traditional(found: Evidence) -> Judgement:
    """Fig. 9: better end-effector accuracy than a traditional calibration with 24 poses."""
    return _compared(
        found.against_traditional,
        f"With {found.measured_divided} measured poses against {found.measured_traditional}",
    )


@_claim(
    "The same at equal measuring effort",
    f"{_REPORTED}, as many poses being measured",
    9,
    "[...] results in a better end-effector accuracy [...]",
)
def better_at_equal_effort(found: Evidence) -> Judgement:
    """The same claim, as many poses being measured."""
    return _compared(
        found.against_equal_effort, f"With {found.measured_divided} measured poses in both"
    )


@_claim(
    "Mapped instead of independent poses",
    "section 5.2, Fig. 9",
    9,
    "The identification poses are optimized for a reference leg and the remaining n - 1 "
    "sets are calculated by symmetry operations.",
)
def symmetrical_selection(found: Evidence) -> Judgement:
    """Sections 5.2 and 7: mapped poses instead of independent ones."""
    ratios = found.against_independent
    sentence = (
        f"With mapped poses the error is {_times(ratios[0])} in position and {_times(ratios[1])} "
        "in orientation that with poses chosen for every leg."
    )
    states = {_likeness(each) for each in ratios}
    if "apart" not in states and "not told" in states:
        return Judgement("not decided", sentence)
    return _graded(states == {"alike"}, "apart" not in states, sentence)


@_claim(
    "Local errors",
    "section 2, advantage 3, and section 6.5, Fig. 10",
    10,
    "[...] results in a better end-effector accuracy [...]",
)
def local_errors(found: Evidence) -> Judgement:
    """Fig. 10: the local position errors are smaller."""
    words = {_side(each.ratio) for each in found.slices}
    parts = "; ".join(
        f"{each.orientation:g} rad: {milli(each.divided, 'm')} against "
        f"{milli(each.traditional, 'm')}, robot by robot {_times(each.ratio)}"
        for each in found.slices
    )
    sentence = (
        f"Root mean squares over the slices, divide and conquer (72 measured poses) against "
        f"traditional (24): {parts}."
    )
    if _OPEN in words:
        return Judgement("not decided", sentence)
    return _graded(words == {"better"}, "better" in words, sentence)


@_claim(
    "Cost of the identification",
    "section 5.2, DC2, and section 7",
    9,
    "The reduction of kinematic identification computational costs by the identification of "
    "reduced sets of parameters.",
)
def numerical_efficiency(found: Evidence) -> Judgement:
    """Sections 2 and 7: identifying reduced sets of parameters costs less."""
    better = found.condition_leg < found.condition_whole / 2
    sentence = (
        f"A least-squares step of all {8 * found.legs} parameters at once takes "
        f"{_times(found.step_saving)} as long as one a leg, but only if its zero "
        f"blocks are multiplied: the legs' rows share no parameter. Condition numbers are "
        f"{significant(found.condition_whole)} and {significant(found.condition_leg)}."
    )
    least, most = (
        _graded(cheaper and better, cheaper or better, sentence).verdict
        for cheaper in _timed(found.step_saving, _SAVING)
    )
    return _decided(least, most, sentence)
