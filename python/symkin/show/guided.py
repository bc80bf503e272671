# SPDX-License-Identifier: MIT
"""A guided session on a screen: the next pose, what the last row is worth, how far it is."""

from __future__ import annotations

import math
import textwrap
from collections.abc import Sequence

from symkin.analysis.workspace import workspace_coordinates
from symkin.data.sensor_tables import shown_readings
from symkin.errors import few, unknowns_by_name
from symkin.estimate.evidence.unseen import POWER
from symkin.guided import Ask, Progress, Session, Verdict
from symkin.guided.knowledge import LEAST_DEGREES
from symkin.guided.session import ROBOT, TABLE
from symkin.model.file_frames import as_drawn
from symkin.model.poses import POSE_ERRORS
from symkin.options import OPTIONS
from symkin.shell import typed_word
from symkin.show.units import on_paper
from symkin.show.wording import milli, percent, place, plural, significant
from symkin.values import Array

_BAR = 26
GOES_ON = "Every row is saved; the same command goes on."
WIDTH = 79  # of a terminal; pages break lines themselves
_NAMED = 3
_FAR = 5.0  # sigma, of rows that are not called fitting
_DEGREE = "\N{DEGREE SIGN}"
_UNKNOWN_MORE = "not known yet"


def begun_text(session: Session) -> list[str]:
    """What was found in the folder of a session that goes on, and mended, in lines."""
    lines = []
    if session.torn:
        lines.append(
            f"The last line of the table was not complete, and is set aside: {session.torn}"
        )
    if session.edited is not None:
        lines += _filled(
            f"Another program has saved {TABLE} in its own form; it is put right, and was kept as "
            f"{session.edited.name}."
        )
    return lines


def progress_text(session: Session, progress: Progress) -> str:
    """How far a session is, in one or two lines."""
    parts = []
    for kind, unit in POSE_ERRORS:
        wanted = session.target.wanted.get(kind)
        if wanted is None:
            continue
        bound = getattr(progress, f"{kind}_bound")
        now = milli(bound, unit) if math.isfinite(bound) else _UNKNOWN_MORE
        parts.append(f"{_named(session, kind)} {now} of {milli(wanted, unit)}")
    more = "" if progress.reached or progress.never else f", {_more(progress)}"
    if progress.closing:
        more = f", enough with {progress.closing} of the first poses again (a slip would show)"
    if progress.suspected is not None:
        more = f", enough but that something may have slipped at row {progress.suspected}"
    if progress.undecided:
        more = ", enough once it is decided what does not fit"
    failed = f", {progress.failed} failed" if progress.failed else ""
    done = progress.rows + (0 if progress.reached else progress.more)
    full = round(_BAR * progress.rows / max(done, 1))
    bar = "#" * full + "." * (_BAR - full)
    share = percent(progress.confidence)
    repaired = " (after a repair)" if progress.repaired else ""
    why = progress.failure.partition(" (not shown")[0]
    stop = "." if why or session.slips else ""
    return "\n".join(
        [
            *_filled(f"{plural(progress.rows, 'row')}{more}{failed};  {'; '.join(parts)}{stop}"),
            *_filled(f"No estimate yet: {why}." if why else ""),
            *_slips(session),
            f"[{bar}]  what {share} of such robots keep{repaired}",
        ]
    )


def _slips(session: Session) -> list[str]:
    """What has slipped, and by how much, in a line each."""
    lines = []
    for row, steps in session.slips.items():
        told = [
            f"{each.name.partition('.')[0 if of_leg else 2]} {_with_sign(each.value, each.unit)}"
            for each in steps
            for of_leg in (each.name.startswith("leg"),)
        ]
        legs = [each for each in steps if each.name.startswith("leg")]
        if not steps:
            continue
        if len(legs) == 1:
            leg, by = told[0].split(" ", 1)
            lines += _filled(f"The sensor of leg {leg[3:]} slipped at row {row}: by {by}.")
        elif legs:
            lines += _filled(
                f"Something slipped at row {row}; which sensor is not plain: {', '.join(told)}."
            )
        else:
            lines += _filled(
                f"The measuring device was moved at row {row}: since then it sees the robot by "
                f"{', '.join(told)} from where it was. The accuracy is that of the robot as the "
                "device sees it now."
            )
    return lines


def _with_sign(value: float, unit: str) -> str:
    factor, sign = on_paper(unit)
    return f"{factor * value:+.3f} {sign}"


def _more(progress: Progress) -> str:
    return f"some {progress.more} more" if progress.more > 1 else "at least one more"


def ask_text(session: Session, ask: Ask) -> str:
    """The pose to measure, and what commands it."""
    again = "" if ask.repeat_of is None else f" (row {ask.repeat_of} again)"
    again += "" if ask.partner is None else f" (measured with row {ask.partner})"
    ahead = f", then {plural(len(ask.ahead), 'pose')}" if len(ask.ahead) else ""
    lines = [
        f"next {ask.row}{again}{ahead}",
        *_filled("pose      " + _told(pose_cells(session, ask.pose)), 2),
        *_filled("readings  " + _told(reading_cells(session, ask.readings)), 2),
    ]
    return "\n".join(lines)


def verdict_text(verdict: Verdict, width: int = WIDTH) -> str:
    """What the last row and those before it say, and what can be done about it."""
    lines = []
    if verdict.tolerances > 1:
        factor = significant(verdict.tolerances, 2)
        lines += _filled(
            f"The robot is {factor} times as far from the drawing as the tolerances say; from now "
            "on they count so much.",
            width=width,
        )
    number = verdict.doubtful
    if verdict.decided == "row":
        lines += _filled(
            f"!  The repeat fits: row {number} is wrong.  d drop it, k keep it", 0, width
        )
    elif verdict.decided == "robot":
        lines += _filled(
            f"!  The repeat says the same as row {number}: not the row, but the robot, the device "
            "or the model.  k keep both, and look for a slip; d drop it",
            width=width,
        )
    elif number is not None:
        off = f" ({significant(verdict.off, 2)} sigma)" if math.isfinite(verdict.off) else ""
        lines += _filled(f"!  Row {number} does not fit what is known without it{off}.", 0, width)
        if verdict.likely:
            lines += _filled(f"   It would with {verdict.likely}.  t take it so", 0, width)
        lines += ["   r repeat its pose (tells the row from the robot), d drop it, k keep it"]
    elif verdict.slipped is not None:
        lines += _filled(
            f"!  From row {verdict.slipped} on something else is shown, as if a sensor had slipped "
            "or the device been moved.  t take it as a step, k keep on without",
            width=width,
        )
    elif math.isfinite(verdict.deviations):
        sigma = f"{significant(verdict.deviations, 2)} sigma"
        told = f"fits ({sigma})"
        if verdict.deviations > _FAR:
            told = f"is {sigma} off; nothing is doubted since a row that was kept"
        lines.append(f"row {verdict.row} {told}")
    return "\n".join(lines)


def resolved_text(verdict: Verdict) -> str:
    """What was done about it where nobody was asked."""
    if verdict.slipped is not None:
        return (
            f"The rows before {verdict.slipped} have a step from now on: of one sensor or of the "
            "device where that is plain, else of each sensor."
        )
    if verdict.decided == "row":
        return f"Row {verdict.doubtful} is dropped."
    if verdict.decided == "robot":
        return "Both are kept; what has slipped is looked for."
    return f"Row {verdict.doubtful} is measured again."


def pose_cells(session: Session, pose: Array) -> list[tuple[str, str, str]]:
    """A pose in the frames of the robot's file: names, values and units of its coordinates."""
    robot = session.robot
    values = workspace_coordinates(robot, as_drawn(robot, pose[None]))[0]
    return [
        _cell(name, value, unit)
        for (name, unit), value in zip(robot.space.units.items(), values.tolist(), strict=True)
    ]


def reading_cells(session: Session, readings: Array) -> list[tuple[str, str, str]]:
    """Readings as the sensors show them: number of the leg, value and unit."""
    robot = session.robot
    shown = shown_readings(robot, readings[None])[0]
    return [_cell(str(leg), value, robot.reading_unit) for leg, value in enumerate(shown, 1)]


def _cell(name: str, value: float, unit: str) -> tuple[str, str, str]:
    factor, sign = on_paper(unit)
    return name, f"{factor * float(value):+.3f}", sign


def _told(cells: Sequence[tuple[str, str, str]]) -> str:
    return "  ".join(
        f"{name} {value}{'' if unit == _DEGREE else ' '}{unit}" for name, value, unit in cells
    )


_BEHIND = (
    f"{ROBOT} could not be written and is of an earlier row: give the command of this session "
    "again once there is room, and identify then."
)


def end_text(session: Session, progress: Progress, width: int = WIDTH) -> str:
    """What a session came to, and what to do now."""
    rows, share = plural(progress.rows, "row"), percent(progress.confidence)
    lines = _wanted(session, progress, "bound")
    if progress.reached:
        over = "bed" if session.target.of == "height" else "workspace"
        head = f"Enough: {rows}. {share} of such robots keep, over the {over} (rms):"
    elif progress.never:
        head = (
            "Never: even all candidates together would leave this. Observe more of each pose "
            "(--observe), or measure with less noise."
        )
        lines = _wanted(session, progress, "floor")
        told = [
            f"{place(of)}, {milli(floor, 'm')} (--of {of})" for of, floor in progress.shown.items()
        ]
        if told:
            lines += _filled(f"Asked for alone these would do: {'; '.join(told)}.", 2, width)
        if progress.unseen:
            named = few(unknowns_by_name(progress.unseen), _NAMED)
            lines += _filled(f"Known by their tolerances alone: {named}.", 2, width)
    else:
        head = f"Not yet: {rows}, {_more(progress)}. So far:"
        if progress.closing:
            head = (
                f"Not yet: {rows}. Enough with {progress.closing} of the first poses again, which "
                "would show a slip in the last rows. So far:"
            )
        if progress.suspected is not None:
            head = (
                f"Not yet: {rows}. Enough, but that something may have slipped at row "
                f"{progress.suspected}: poses of before are measured again until that is plain (s "
                "skip does without). So far:"
            )
        if progress.undecided:
            head = f"Not yet: {rows}. Enough once it is decided what does not fit. So far:"
        if progress.degrees < LEAST_DEGREES:
            lines.append(
                f"  the noise rests on {progress.degrees:.0f} degrees of freedom; expected "
                f"{LEAST_DEGREES} at least"
            )
    lines += _hidden(session, progress)
    if progress.repaired:
        lines += _filled(
            "After a repair: rows were dropped or put right, or something slipped, so that half as "
            "many robots as was wanted may exceed it.",
            2,
            width,
        )
    text = [*_filled(head, 0, width), *lines]
    folder = session.folder
    if folder is not None and progress.rows:
        files = " ".join(typed_word(folder / name) for name in (ROBOT, TABLE))
        more = "" if session.noise is None else f" --noise {session.noise}"
        if progress.confidence != OPTIONS["confidence"].default:
            more += f" --confidence {progress.confidence:g}"
        text += [GOES_ON] * (not (progress.reached or progress.never))
        if session.is_behind:
            text += _filled(_BEHIND, 0, width)
        text += ["", f"symkin identify {files}{more} --out calibrated"]
    return "\n".join(text)


def _hidden(session: Session, progress: Progress) -> list[str]:
    """What may have slipped unseen, where that would spoil what was wanted."""
    slip = progress.hidden
    if slip is None:
        return []
    left = [
        f"{milli(getattr(slip, kind), unit)} of {_named(session, kind)}"
        for kind, unit in POSE_ERRORS
        if getattr(slip, kind) > session.target.wanted.get(kind, math.inf)
    ]
    if not left:
        return []
    size = milli(slip.size, session.robot.reading_unit)
    other = "other " if session.slips else ""
    return _filled(
        f"That holds if no {other}sensor slipped. One that does halfway, by {size}, is noticed in "
        f"{percent(POWER)} of such sessions; if not, it costs {' and '.join(left)}. More rows "
        "notice smaller slips.",
        2,
    )


def _named(session: Session, kind: str) -> str:
    """What the accuracy is of: the position, or its coordinates that are wanted."""
    return place(session.target.of) if kind == "position" else kind


def _wanted(session: Session, progress: Progress, of: str) -> list[str]:
    return [
        f"  {_named(session, kind)}: {milli(getattr(progress, f'{kind}_{of}'), unit)} of "
        f"{milli(session.target.wanted[kind], unit)} wanted"
        for kind, unit in POSE_ERRORS
        if kind in session.target.wanted
    ]


def _filled(text: str, indent: int = 0, width: int = WIDTH) -> list[str]:
    return textwrap.wrap(
        text,
        width,
        initial_indent=" " * indent,
        subsequent_indent=" " * (indent + 10 if indent else 0),
        break_long_words=False,
        break_on_hyphens=False,
    )
