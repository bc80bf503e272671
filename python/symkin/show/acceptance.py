# SPDX-License-Identifier: MIT
"""The certificate of an acceptance, and what moved between two calibrations."""

from __future__ import annotations

import math

from symkin.acceptance import ABOUT, Acceptance, Comparison, Judged
from symkin.model.poses import POSE_ERRORS
from symkin.present import Group, Headline, Page, Section, Table, Verdict, page_of
from symkin.show.units import on_paper
from symkin.show.wording import NONE, milli, percent, place, plural, quantity, significant

_VERDICTS: dict[str, Verdict] = {"pass": "good", "fail": "bad", "undecided": "doubtful"}
_STANDARD_VISITS = 30
_LINE = "_" * 24
_SHOWN_POSES = 5
_DIGITS = 16  # of a digest
_LEAST_P = 1e-6


@page_of.register(Acceptance)
def acceptance_page(found: Acceptance) -> Page:
    """Tell whether a robot keeps its tolerance: a certificate of one printed page."""
    verdict = {"pass": "PASS", "fail": "FAIL", "undecided": "UNDECIDED"}[found.verdict]
    poses = plural(found.commanded, "pose")
    if len(found.poses) > found.commanded:
        poses = f"{len(found.poses)} places of points at {poses}"
    return Page(
        title=f"{found.name}: {verdict}",
        subtitle=f"Acceptance over {poses}, {plural(_rows(found), 'row')}",
        headlines=[line for judged in found.judged for line in _headlines(found, judged)],
        verdict=_VERDICTS[found.verdict],
        judgement=" ".join(_sentence(found, judged) for judged in found.judged),
        doubts=[
            *dict.fromkeys(each.reason for each in found.judged if each.reason),
            *found.doubts,
        ],
        notes=[*_left_out(found), *found.notes],
        one_page=True,
        sections=[
            Section("poses", "Pose accuracy and repeatability", [_terms(found)], [_poses(found)]),
            Section("test", "What was tested", [_tested(found)], [_range(found), _about(found)]),
        ],
    )


def _headlines(found: Acceptance, judged: Judged) -> list[Headline]:
    unit, limits = judged.unit, judged.limits
    kind = _kind(found, judged)
    name = kind[0].upper() + kind[1:]
    before = f"; {milli(judged.before, unit)} by the drawing" if judged.before > 0 else ""
    band = f"{milli(limits.lower, unit)} to {milli(limits.upper, unit)}"
    lines = [
        (f"Tolerance of the {kind}", milli(limits.tolerance, unit), _of(found)),
        (f"{name} error, rms", milli(limits.corrected, unit), f"{band}, 95 % each{before}"),
        (f"Largest {kind} AP", milli(judged.largest.value, unit), _largest(found, judged)),
    ]
    repeated = [each for each in found.poses if each.accuracy.visits > 1]
    if repeated and judged.kind == "position":
        largest = max(each.accuracy.position_repeatability for each in repeated)
        remark = f"largest of {plural(len(repeated), 'pose')}"
        lines.append(("Pose repeatability RP", milli(largest, unit), remark))
    return lines


def _kind(found: Acceptance, judged: Judged) -> str:
    """What the error is of, the coordinates alone if they are."""
    if judged.kind != "position" or found.of is None:
        return judged.kind
    return place(found.of) if found.of == "height" else f"{found.of} position"


def _largest(found: Acceptance, judged: Judged) -> str:
    """What the largest error of a pose says, which is the largest of many noises too."""
    noise = milli(judged.largest.uncertainty, judged.unit)
    if found.judge == "rms":
        return f"uncertainty {noise}; not judged (see --judge largest)"
    probability = percent(round(judged.largest.conformance_probability, 4))
    return f"guard band {milli(judged.largest.guard, judged.unit)}, conforming with {probability}"


def _of(found: Acceptance) -> str:
    return "root mean square over the poses" if found.judge == "rms" else "at every pose"


def _sentence(found: Acceptance, judged: Judged) -> str:
    """The verdict in words."""
    limits, unit = judged.limits, judged.unit
    kind = _kind(found, judged)
    error = f"{kind} error" if kind == judged.kind else f"error of the {kind}"
    what = f"the {error} ({'rms' if found.judge == 'rms' else 'at every pose'})"
    wanted = milli(limits.tolerance, unit)
    words = {
        "pass": f"Pass: {what} is within {wanted}",
        "fail": f"Fail: {what} exceeds {wanted}",
        "undecided": f"Undecided: whether {what} is within {wanted} is not shown",
    }[judged.verdict]
    return f"{words}{'' if judged.verdict == 'undecided' else ', with 95 % confidence'}."


def _terms(found: Acceptance) -> str:
    visits = {each.accuracy.visits for each in found.poses}
    counted = f"{min(visits)} to {max(visits)}" if len(visits) > 1 else str(min(visits))
    standard = "" if visits == {_STANDARD_VISITS} else f" (the standard has {_STANDARD_VISITS})"
    uncertainties = " and ".join(
        f"{milli(each.limits.uncertainty, each.unit)} ({_kind(found, each)})"
        for each in found.judged
    )
    return (
        f"In the terms of ISO 9283, with {counted} {'visit' if visits == {1} else 'visits'} of a "
        f"pose{standard}: AP is how far the mean of the attained poses is from the commanded one, "
        "RP the mean distance from that mean and three standard deviations. Decision rule: guard "
        "band of ISO 14253-1, one-sided, 95 %; exact limits of noncentral chi-square for root mean "
        f"squares and near zero. Standard uncertainty of a coordinate: {uncertainties}."
    )


def _poses(found: Acceptance) -> Table:
    kinds = [each.kind for each in found.judged]
    turns = "orientation" in kinds

    def size(each: object, kind: str) -> float:
        limits = getattr(each, kind)
        return -1.0 if limits is None else float(limits.observed)

    order = sorted(found.poses, key=lambda each: -size(each, kinds[0]))
    rows = []
    for each in order[:_SHOWN_POSES]:
        accuracy = each.accuracy
        cells = [
            str(each.rows[0]),
            str(accuracy.visits),
            milli(accuracy.position_accuracy, "m"),
            milli(accuracy.position_repeatability, "m"),
        ]
        if turns:
            cells.append(
                NONE if each.orientation is None else milli(each.orientation.observed, "rad")
            )
        cells += [
            NONE if limits is None else milli(limits.upper, unit)
            for kind, unit in POSE_ERRORS
            if kind in kinds
            for limits in (getattr(each, kind),)
        ]
        rows.append(cells)
    columns = ["Row", "Visits", "AP", "RP"] + ["AP, angle"] * turns
    columns += [f"Upper limit, {kind}" for kind in kinds]
    more = f", the largest of {len(order)}" if len(order) > _SHOWN_POSES else ""
    what = "Places of points" if len(order) > found.commanded else "Poses"
    return Table(f"{what}{more}", columns, [Group(rows)])


def _tested(found: Acceptance) -> str:
    held = {
        True: "No row is one of the calibration, whose rows were compared with these.",
        None: "Which rows the calibration was made from is not known, so that nobody checked that "
        "these are others: give the folder that identify wrote.",
    }[found.held_out]
    frames = (
        " The device's frame was fitted to this table, since it was set up anew."
        if found.fitted
        else ""
    )
    return (
        "The commanded pose is the model's at the readings; an error is the measured pose less "
        f"that one. {held}{frames} Not tested: poses beyond the ranges below, and other loads, "
        "speeds, temperatures and directions of approach than those stated."
    )


def _range(found: Acceptance) -> Table:
    units = found.space.units.values()
    rows = [
        [
            name,
            *(
                f"{milli(low, unit)} to {milli(high, unit)}"
                for unit, (low, high) in zip(units, limits, strict=False)
            ),
        ]
        for name, limits in (("Tested", found.tested), ("Workspace", found.workspace))
    ]
    return Table("Range of the poses", ["", *found.space.units], [Group(rows)])


def _about(found: Acceptance) -> Table:
    rows = [[name, found.about.get(key) or _LINE] for key, name in ABOUT.items()]
    rows += [[f"SHA-256 of {name}", f"{digest[:_DIGITS]}..."] for name, digest in found.digests]
    rows += [["Signature", _LINE]]
    half = (len(rows) + 1) // 2
    pairs = [
        [*rows[i], *(rows[half + i] if half + i < len(rows) else ["", ""])] for i in range(half)
    ]
    return Table("Certificate", ["", "", "", ""], [Group(pairs)], wordy=True)


def _left_out(found: Acceptance) -> list[str]:
    notes = []
    if found.unread:
        notes.append(f"left out, since not all legs were read there: {plural(found.unread, 'row')}")
    if found.unmeasured:
        notes.append(
            "left out, since neither position nor orientation was measured: "
            f"{plural(found.unmeasured, 'row')}"
        )
    if found.failed:
        rows = ", ".join(map(str, found.failed[:5]))
        notes.append(f"the model cannot take the readings of row {rows}")
    return notes


def _rows(found: Acceptance) -> int:
    return len({number for each in found.poses for number in each.rows})


@page_of.register(Comparison)
def comparison_of_calibrations_page(found: Comparison) -> Page:
    """Tell what moved between two calibrations."""
    if found.shape_moved:
        judgement = "The robot has changed by more than noise between the two calibrations."
    elif found.moved:
        judgement = (
            "The parameters differ by more than noise, but only as by a device that was set up "
            "anew: the robot's own shape has not changed by more than noise."
        )
    elif found.doubts:
        judgement = "Nothing is seen to have moved by more than noise, but that is in doubt."
    else:
        judgement = "The two calibrations agree: nothing has moved by more than noise."
    headlines: list[Headline] = []
    for kind, unit in POSE_ERRORS:
        value, noise = getattr(found, kind), getattr(found, f"{kind}_by_noise")
        if value > 0 and noise > 0:
            remark = (
                f"rms; noise alone stays below {milli(noise, unit)} in {percent(found.confidence)}"
            )
            headlines.append((f"{kind.capitalize()} moved", milli(value, unit), remark))
    headlines += [
        ("All parameters", _p_value(found.p_value), _chi(found.statistic, found.degrees)),
        (
            "Frames aside",
            _p_value(found.shape_p_value),
            _chi(found.shape_statistic, found.shape_degrees),
        ),
    ]
    ordered = sorted(
        found.parameters, key=lambda each: -abs(each.sigmas) if math.isfinite(each.sigmas) else 0.0
    )
    rows = [
        [
            each.name,
            milli(each.change, each.unit) if each.unit else significant(each.change),
            significant(each.sigmas, 2) + (" moved" if each.moved else ""),
            *(
                quantity(on_paper(each.unit)[0] * value, on_paper(each.unit)[1], 6)
                for value in (each.first, each.second)
            ),
        ]
        for each in ordered
    ]
    columns = ["", "Change", "Sigmas", "First", "Second"]  # where a small screen ends
    table = Table(
        "What changed most",
        columns,
        [Group(rows)],
        brief=found.moved or found.shape_moved,
        brief_rows=6,
        others="less",
    )
    notes = [f"only one of the two identified {', '.join(found.left_out)}"] * bool(found.left_out)
    return Page(
        title=f"{found.name}: two calibrations compared",
        headlines=headlines,
        verdict="doubtful" if found.doubts else "bad" if found.shape_moved else "good",
        judgement=judgement,
        doubts=found.doubts,
        notes=notes,
        sections=[Section("parameters", "Parameters", [], [table])],
    )


def _p_value(value: float) -> str:
    # No tail is known so far out that a smaller one would mean something.
    return f"p < {_LEAST_P:f}" if value < _LEAST_P else f"p = {significant(value, 2)}"


def _chi(statistic: float, degrees: int) -> str:
    return f"chi-square {significant(statistic)} of {degrees} degrees of freedom"
