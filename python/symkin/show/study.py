# SPDX-License-Identifier: MIT
"""What studies found."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Sequence
from statistics import NormalDist

from symkin.present import Group, Headline, Image, Page, Section, Table, page_of
from symkin.show.images import plotted
from symkin.show.wording import (
    NONE,
    count,
    fixed,
    given,
    milli,
    percent,
    plural,
    significant,
)
from symkin.study.asymmetry import LOSSES, OFF, Curve
from symkin.study.cost import TASKS, CostResult
from symkin.study.definition import Cell
from symkin.study.result import Recommendation, StudyResult
from symkin.study.summaries import CellSummary, ErrorFigure

_PERCENT = "\N{NO-BREAK SPACE}%"
_PLUS_MINUS = "\N{NO-BREAK SPACE}\N{PLUS-MINUS SIGN}\N{NO-BREAK SPACE}"
_FEW = 40  # cells that a figure can name


@page_of.register(StudyResult)
def study_page(result: StudyResult) -> Page:
    """Describe what a study of simulated robots found."""
    off = _off_cells(result)
    doubts = _doubts(result, off)
    if result.extension is not None:
        told: Page = result.extension[1].page(result, result.findings)
        return dataclasses.replace(told, notes=[_judgement(result, off), *doubts])
    sections = [
        *map(_recommendation, result.recommendations),
        *_curves(result),
        *_protocols(result),
        _cells(result),
    ]
    return Page(
        title=result.definition.title or result.definition.name or "Study",
        subtitle=", ".join(result.definition.loaded),
        headlines=_headlines(result),
        verdict="doubtful" if doubts else "good",
        judgement=_judgement(result, off),
        doubts=doubts,
        paragraphs=[_done(result)],
        next_step="measure at the poses of the cheapest protocol that is accurate enough"
        if (command := _next(result))
        else "",
        next_command=command,
        sections=sections,
    )


@page_of.register(CostResult)
def cost_page(result: CostResult) -> Page:
    """Describe what a study of cost measured."""
    sections = [_cost(result, name) for name in result.mechanisms]
    slopes = {
        (each.mechanism, each.task): each for each in result.exponents if not math.isnan(each.value)
    }
    headlines: list[Headline] = [
        (TASKS[task].capitalize(), f"n^{fixed(slopes[name, task].value, 2)}", name)
        for name in result.mechanisms
        for task in ("select_reference_s", "select_each_s")
        if (name, task) in slopes
    ]
    return Page(
        title=result.definition.title or "Cost",
        subtitle=", ".join(result.mechanisms),
        headlines=headlines,
        paragraphs=[
            "The first leg of each mechanism is repeated to n legs. Times are medians of "
            f"{plural(result.definition.repetitions, 'repetition')} on one thread, the tasks "
            "taking turns. Identified leg by leg, each leg has poses of its own; together, as many "
            "poses, of whole orbits, serve all legs. The exponent is that of a power of n, "
            "with its 95% interval from the scatter about the line."
        ],
        sections=sections,
    )


def _cost(result: CostResult, mechanism: str) -> Section:
    legs = result.legs(mechanism)
    rows = [
        [
            TASKS[each.task],
            fixed(each.value, 2),
            f"{fixed(each.low, 2)} to {fixed(each.high, 2)}" if each.low == each.low else NONE,
            *(milli(result.times(mechanism, each.task)[at], "s") for at in (0, -1)),
        ]
        for each in result.exponents
        if each.mechanism == mechanism
    ]
    columns = ["Task", "Exponent", "95% interval", f"{legs[0]} legs", f"{legs[-1]} legs"]
    table = Table(
        f"{mechanism}: growth with the number of legs", columns, [Group(rows)], brief=True
    )
    figure = Image(
        f"cost_{mechanism}",
        "Times of selection, planning and identification against the number of legs.",
        f"{mechanism}: times against the number of legs.",
        plotted("study_cost", result, mechanism),
    )
    times = [
        [str(number), *(milli(result.times(mechanism, task)[at], "s") for task in TASKS)]
        for at, number in enumerate(legs.tolist())
    ]
    all_times = Table(f"{mechanism}: times", ["Legs", *TASKS.values()], [Group(times)])
    return Section(f"cost-{mechanism}", mechanism, [], [figure, table, all_times])


def _headlines(result: StudyResult) -> list[Headline]:
    robots = "each measured and identified in every cell"
    lines: list[Headline] = [
        ("Robots", count(result.robots), robots),
        ("Cells", count(len(result.cells)), f"{count(result.robots * len(result.cells))} fits"),
    ]
    for found in result.recommendations:
        best = found.protocols[0] if found.protocols else None
        if best is not None and best.enough:
            lines.append(("Measured poses", count(best.measured_poses), _protocol(best.cell)))
    return lines


def _judgement(result: StudyResult, off: Sequence[CellSummary]) -> str:
    lost = result.curves.get("asymmetry", ())
    if lost:
        level = lost[0].reaches(LOSSES[0])
        if math.isnan(level):
            return f"Mapped poses lose less than {100 * LOSSES[0]:g}{_PERCENT} at every level"
        return (
            f"Mapped poses lose {100 * LOSSES[0]:g}{_PERCENT} of their efficiency where robots are "
            f"{significant(level, 2)} times as far from the drawing as the tolerances say"
        )
    told = [each for each in result.cells.values() if each.first.ratio == each.first.ratio]
    if not told:
        return "No cell has a prediction to compare with"
    right = len(told) - len(off)
    return (
        f"{count(right)} of {plural(len(told), 'cell')} agree with the prediction of first order "
        f"within 5{_PERCENT} and chance"
    )


def _doubts(result: StudyResult, off: Sequence[CellSummary]) -> list[str]:
    doubts = []
    failed = [each for each in result.cells.values() if each.failed]
    if failed:
        worst = max(failed, key=lambda each: each.failed)
        reason = max(worst.failures, key=lambda each: worst.failures[each])
        doubts.append(
            f"robots failed in {plural(len(failed), 'cell')}, at the most {count(worst.failed)} of "
            f"{count(worst.robots)} ({worst.cell.id}: {reason}); no figure has them"
        )
    if off and result.definition.kind == "accuracy":
        worst = max(off, key=lambda each: abs(math.log(each.first.ratio)))
        doubts.append(
            f"{plural(len(off), 'cell')} not as predicted, the most {worst.cell.id}: "
            f"{fixed(worst.first.ratio, 2)} times the predicted {worst.first_kind} error"
        )
    return doubts


def _off_cells(result: StudyResult) -> list[CellSummary]:
    """Cells that are off their predictions by more than 5%, and by more than chance.

    Of sound studies of any size, one in a hundred has one.
    """
    normal = NormalDist().inv_cdf(1 - 0.005 / len(result.cells))
    return [
        each
        for each in result.cells.values()
        if abs(each.first.ratio - 1) > OFF + normal * each.first.ratio_error
    ]


def _done(result: StudyResult) -> str:
    poses = ", ".join(str(len(each)) for each in result.job.poses.values())
    return (
        f"{plural(result.robots, 'robot')} were drawn within the tolerances, measured as each "
        "cell plans it, and identified; errors are root mean squares, over robots and over "
        f"{poses} poses of the workspace, of the poses that a robot takes when the identified "
        "model commands them. All cells have the same robots, and cells with one plan the same "
        "measurements, so that their differences are known better than their figures. Intervals "
        "are of 95% and come from the scatter of the robots."
    )


def _next(result: StudyResult) -> str:
    best = next((each.protocols[0] for each in result.recommendations if each.protocols), None)
    if best is None or not best.enough:
        return ""
    cell = best.cell
    return (
        f"symkin plan {cell.mechanism} --design {cell.design} --rows {cell.rows} --criterion "
        f"{cell.criterion} --pose-count {best.pose_count} --out planned"
    )


def _recommendation(found: Recommendation) -> Section:
    wanted = " and ".join(
        given(value, unit)
        for value, unit in ((found.wanted_position, "m"), (found.wanted_orientation, "rad"))
        if value is not None
    )
    rows = [
        [
            _protocol(each.cell),
            count(each.measured_poses) if each.enough else f"more than {each.measured_poses}",
            count(each.pose_count),
            milli(each.position_bound, "m"),
            milli(each.orientation_bound, "rad") if each.orientation else NONE,
            milli(each.position, "m"),
            f"{fixed(100 * (each.trust - 1), 1)}{_PERCENT}" if math.isfinite(each.trust) else NONE,
        ]
        for each in found.protocols
    ]
    best = found.protocols[0] if found.protocols else None
    text = (
        f"The cheapest is {_protocol(best.cell)} with {plural(best.measured_poses, 'pose')} to "
        "measure."
        if best is not None and best.enough
        else "No protocol of the study reaches it."
    )
    share = percent(found.confidence)
    bounds = [f"{kind}, {share}" for kind in ("Position", "Orientation")]
    table = Table(
        f"{found.mechanism}: poses that {wanted} need, the cheapest protocol first",
        ["Protocol", "Measured poses", "Poses a leg", *bounds, "Position, mean", "Prediction off"],
        [Group(rows)],
        brief=True,
    )
    paragraphs = [
        f"Wanted are {wanted} (root mean square) of {share} of all such robots. {text} The numbers "
        "of poses are predicted to first order; the last column says how far the simulated robots "
        "of the study were from the predictions of the protocol at the most."
    ]
    anchor = f"recommendation-{found.mechanism}"
    return Section(anchor, f"{found.mechanism}: the cheapest protocol", paragraphs, [table])


def _protocols(result: StudyResult) -> list[Section]:
    """For each mechanism with several numbers of poses: the figure, and what no other beats."""
    sections = []
    for name in result.definition.loaded:
        cells = [each for each in result.cells.values() if each.cell.mechanism == name]
        if len({each.cell.pose_count for each in cells}) < 2:
            continue
        figure = Image(
            f"protocols_{name}",
            "Errors of the protocols against the number of measured poses.",
            "End-effector error after identification against the measured poses. Lines are "
            "predicted to first order, points are simulated, with 95% intervals.",
            plotted("study_protocols", result, name),
        )
        best = Table(
            f"{name}: protocols that none with as few poses beats in {cells[0].first_kind}",
            _COLUMNS,
            [Group([_row(each) for each in _unbeaten(cells)])],
            brief=True,
        )
        anchor = f"protocols-{name}"
        sections.append(Section(anchor, f"{name}: accuracy against poses", [], [figure, best]))
    return sections


def _unbeaten(cells: Sequence[CellSummary]) -> list[CellSummary]:
    found: list[CellSummary] = []
    usable = [each for each in cells if each.robots > each.failed]
    for each in sorted(usable, key=lambda each: (each.measured_poses, each.first.rms)):
        if not found or each.first.rms < found[-1].first.rms:
            found.append(each)
    return found


_COLUMNS = (
    "Cell", "Measured", "Position", "Over predicted", "Orientation", "Over predicted",
    "In 95%", "Failed",
)  # fmt: skip


def _row(summary: CellSummary) -> list[str]:
    return [
        summary.cell.id,
        count(summary.measured_poses),
        milli(summary.position.rms, "m") if summary.first_kind == "position" else NONE,
        _ratio(summary.position),
        milli(summary.orientation.rms, "rad") if summary.orientation.rms else NONE,
        _ratio(summary.orientation),
        f"{fixed(100 * summary.coverage, 1)}{_PERCENT}"
        if summary.robots > summary.failed
        else NONE,
        count(summary.failed),
    ]


def _cells(result: StudyResult) -> Section:
    cells = list(result.cells.values())
    names = list(dict.fromkeys(each.cell.mechanism for each in cells))
    rows = {name: [_row(each) for each in cells if each.cell.mechanism == name] for name in names}
    groups = [Group(own, name if names[1:] else "") for name, own in rows.items()]
    few = len(cells) <= _FEW
    parts: list[Table | Image] = []
    if few and not result.curves:
        parts.append(
            Image(
                "cells",
                "Errors of all cells, simulated and predicted.",
                "End-effector error after identification: points are simulated, with 95% "
                "intervals, and the marks are predicted to first order.",
                plotted("study_cells", result),
            )
        )
    parts.append(Table("All cells", _COLUMNS, groups, brief=few and not result.curves))
    return Section("cells", "All cells", [], parts, details=not few)


def _curves(result: StudyResult) -> list[Section]:
    """What a study of symmetry asks."""
    if not result.curves:
        return []
    unit = next(iter(result.definition.loaded.values())).reading_unit
    times = "errors of the robots, in tolerances"
    loss = [-each for each in LOSSES]
    about = {
        "asymmetry": (
            "How much asymmetry",
            times,
            "Each robot's mapped poses are compared with poses chosen for its own legs, out of "
            "the same candidates: by (det M)^(1/p), in which nine poses of ten are 90%.",
            loss,
        ),
        "readings": (
            "How much joint noise",
            f"noise of the readings, {unit}",
            "Poses chosen as if the readings had no noise are compared with poses chosen with it, "
            "in the same measure. Symmetry itself loses nothing: all legs have the same noise.",
            loss,
        ),
        "noise": (
            "Noise and linearisation",
            "noise, in multiples of the mechanism's",
            "Simulated over predicted position error, relative to that at the lowest level, with "
            "the same robots and the same noise but for its size.",
            (OFF, -OFF),
        ),
        "errors": (
            "Errors and linearisation",
            times,
            "Simulated over predicted position error, where the prediction is made at the drawing, "
            "relative to that at the lowest level, with the same robots but for the size of their "
            "errors.",
            (OFF, -OFF),
        ),
    }
    sections = []
    for name, (title, level, text, lines) in about.items():
        curves = result.curves[name]
        if not curves:
            continue
        losses = LOSSES if lines is loss else (OFF,)
        value = "efficiency" if lines is loss else "simulated over predicted"
        figure = Image(
            name,
            f"{title}: {value} against {level}.",
            f"{value.capitalize()} against {level}. Dashed lines are where the answers are read.",
            plotted("study_curves", curves, level, value, percent=lines),
        )
        answers = Table(
            f"{title}: where {value} is off by so much ({level})",
            ["Protocol", *(f"{100 * each:g}{_PERCENT}" for each in losses), "Tried"],
            [Group([_answers(curve, losses) for curve in curves])],
            brief=True,
        )
        points = [
            Table(f"{each.mechanism}: {each.of}", ["Level", value.capitalize()], [_points(each)])
            for each in curves
        ]
        sections.append(Section(name, title, [text], [figure, answers, *points]))
    return sections


def _answers(curve: Curve, losses: Sequence[float]) -> list[str]:
    name = f"{curve.mechanism}: {curve.of}"
    found = [curve.reaches(each) for each in losses]
    most = float(curve.levels[-1])
    shown = [significant(each, 2) if each == each else f"beyond {most:g}" for each in found]
    return [name, *shown, f"{curve.levels[0]:g} to {most:g}"]


def _points(curve: Curve) -> Group:
    rows = []
    for level, value, error, failed in zip(
        curve.levels, curve.values, curve.errors, curve.failed, strict=True
    ):
        within = f"{_PLUS_MINUS}{fixed(error, 4)}" if error else ""
        rows.append([f"{level:g}", fixed(value, 4) + within + f" ({failed} failed)" * bool(failed)])
    return Group(rows)


def _ratio(error: ErrorFigure) -> str:
    if not math.isfinite(error.ratio):
        return NONE
    known = math.isfinite(error.ratio_error)
    return fixed(error.ratio, 3) + (f"{_PLUS_MINUS}{fixed(error.ratio_error, 3)}" if known else "")


def _protocol(cell: Cell) -> str:
    return f"{cell.design}, {cell.rows}, {cell.criterion}, {cell.estimator}, {cell.use}"
