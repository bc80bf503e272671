# SPDX-License-Identifier: MIT
"""What a run of the protocol came to, and the identification of many robots."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from symkin.analysis.evaluation import Evaluation
from symkin.analysis.promises import ExpectedAccuracy
from symkin.errors import few
from symkin.estimate.estimate import Estimate
from symkin.estimate.fleet import Fleet
from symkin.files.mechanism_file import typed_name
from symkin.pipeline import ProtocolResult
from symkin.planning.simulation import Simulation
from symkin.present import ErrorLine, Group, Headline, Image, Page, Section, Table, Verdict, page_of
from symkin.show.check import symmetry_section
from symkin.show.devices import device_notes
from symkin.show.estimate import as_told, instrument_of, judgement, parameter_section
from symkin.show.evaluation import (
    ALIGNED,
    error_figures,
    error_table,
    errors_in_words,
    left_out,
)
from symkin.show.mechanism import mechanism_section
from symkin.show.observability import observability_section
from symkin.show.observations import observation_section
from symkin.show.plan import plan_section
from symkin.show.wording import (
    NONE,
    chain_subtitle,
    count,
    given,
    has_lengths,
    milli,
    plural,
    quantity,
    quoted,
    setting,
    significant,
    sources,
)
from symkin.show.workspace import workspace_section

_OF_THE_DEVICE = ("held-as-exact", "unseen")  # notes of what a simulated one has not
_SHARED = "cause-shared"
_REDRAWN = "if that is so, identify all again from corrected.toml, the drawing so corrected"
_TOLD = 5  # of a fleet's doubts, and robots of each


@page_of.register(ProtocolResult)
def run_page(result: ProtocolResult) -> Page:
    """Tell what a run of the protocol on a simulated robot achieved."""
    nominal, plan, poses = result.nominal, result.plan, result.plan.leg_poses()
    symmetric = plan.basis is not None and plan.basis.symmetrical
    sections = [
        _accuracy_section(result),
        parameter_section(result.identification, result.simulation.actual),
        observation_section(result.identification, brief=False),
        plan_section(plan, result.simulation),
        workspace_section(nominal, result.candidates, plan),
        observability_section(nominal, poses, symmetric=symmetric, rows=plan.row_kind),
        symmetry_section(nominal),
        mechanism_section(nominal, result.candidates.poses[:1]),
    ]
    found = result.identification
    verdict, words = judgement(found)
    return Page(
        title=f"{nominal.name}: identification of a simulated robot",
        subtitle=chain_subtitle(nominal),
        errors=_errors(result),
        verdict=verdict,
        judgement=words,
        doubts=tuple(map(str, found.doubts)),
        notes=(*_notes(found), *device_notes(nominal), *_replaced(result.simulation)),
        paragraphs=[_done(result), _achieved(result)],
        next_step=(
            "measure your robot at the poses of plan.csv, write what you measure into a table "
            "like measurements.csv, and identify"
        ),
        next_command=f"symkin identify {typed_name(nominal)} measured.csv --out identified",
        sections=sections,
        inputs=sources(nominal.source),
    )


def _errors(result: ProtocolResult) -> list[ErrorLine]:
    """The robot's true errors, and those to expect; what a measurement of it would contribute."""
    before, after, expected = result.before, result.after, result.expected
    told = as_told(result.identification, before, after)
    return [
        ErrorLine(
            kind,
            unit,
            before=getattr(told[0], f"{kind}_rms"),
            after=getattr(told[1], f"{kind}_rms"),
            expected=getattr(expected, kind),
            bound=getattr(expected, f"{kind}_bound"),
            confidence=expected.confidence,
            instrument=instrument_of(result.identification, kind),
        )
        for kind, unit in after.space.errors
    ]


def _replaced(simulation: Simulation) -> list[str]:
    number = sum(simulation.replaced)
    said = f"replaced by spares, since the robot cannot take them: {plural(number, 'pose')}"
    return [said] if number else []


def _done(result: ProtocolResult) -> str:
    nominal, tolerances = result.nominal, result.nominal.tolerances
    noise = " and ".join(
        given(getattr(nominal.noise, kind), unit) for kind, unit in nominal.space.errors
    )
    lengths = f"{given(tolerances.length, 'm')}, "
    return (
        f"A robot was simulated that differs from the drawing of {nominal.name} as its tolerances "
        f"allow (standard deviations {lengths if has_lengths(nominal) else ''}"
        f"{given(tolerances.angle, 'rad')}, gains {setting(100 * tolerances.gain, '%')}). "
        f"From {plural(len(result.candidates.poses), 'candidate pose')}, "
        f"{count(int((~result.plan.spare).sum()))} were chosen and measured with a noise of "
        f"{noise}; from these the {count(len(result.identification.names))} parameters of its "
        f"{plural(len(nominal.leg_readings), 'leg')} were identified with the estimator "
        f"{quoted(result.identification.estimator)}."
    )


def _achieved(result: ProtocolResult) -> str:
    before, after, expected = result.before, result.after, result.expected
    foreseen = " and ".join(
        milli(getattr(expected, kind), unit) for kind, unit in result.nominal.space.errors
    )
    text = (
        "A controller that believes the drawing misses the commanded poses by "
        f"{errors_in_words(after, before)} (root mean square); one that uses the identified "
        f"parameters misses them by {errors_in_words(after, after)}. Expected, from the "
        f"uncertainty of the parameters, were {foreseen}."
    )
    figures: dict[str, Evaluation | ExpectedAccuracy] = {"before": before, "after": after}
    figures["of those expected"] = expected
    return " ".join([text, *left_out(figures)])


def _accuracy_section(result: ProtocolResult) -> Section:
    """Compare the poses that the robot takes with those that it is told to take."""
    before, after, expected = result.before, result.after, result.expected
    paragraph = (
        "Every candidate pose is commanded through the nominal (before) and the calibrated (after) "
        f"inverse kinematics; the error is how far the robot ends up from it. {quoted('Expected')} "
        "is predicted to first order from the covariance of the identified parameters, without "
        "looking at the true ones; for one robot the error achieved scatters about it. " + ALIGNED
    )
    parts: list[Table | Image] = [
        error_table({"Before": before, "After": after}, expected),
        _comparison_table(result),
        *error_figures(before, after, expected),
    ]
    return Section("accuracy", "End-effector error", [paragraph], parts)


def _notes(found: Estimate) -> list[str]:
    """Notes of an estimate; a simulated device measures as exactly as an estimate takes it to."""
    return [str(note) for note in found.notes if note.code not in _OF_THE_DEVICE]


def _comparison_table(result: ProtocolResult) -> Table:
    """What every estimator makes of the same measurements."""
    kinds = result.nominal.space.errors
    columns = ["Estimator", "Poses"]
    for kind, _ in kinds:
        columns += [f"{kind.capitalize()}, rms", "Expected"]
    rows = []
    for figures in result.comparison:
        reached, expected = figures.evaluation, figures.expected
        failed = "" if figures.converged else " (not converged)"
        row = [f"{figures.estimator}{failed}", str(figures.poses)]
        for kind, unit in kinds:
            row.append(milli(getattr(reached, f"{kind}_rms"), unit) if reached else NONE)
            row.append(milli(getattr(expected, kind), unit) if expected else NONE)
        rows.append(row)
    caption = "Every estimator on the same measurements"
    return Table(caption, columns, [Group(rows)])


@page_of.register(Fleet)
def fleet_page(fleet: Fleet) -> Page:
    """Count the robots that fit, and say what is wrong with the others."""
    counts = {word: fleet.verdicts.count(word) for word in ("fits", "doubtful", "failed")}
    total = len(fleet.robots)
    verdict: Verdict = "bad" if counts["failed"] else "doubtful" if counts["doubtful"] else "good"
    rows = [
        (robot, verdict, "; ".join(filter(None, (failure, *map(str, doubts)))))
        for wanted in ("failed", "doubtful")
        for robot, verdict, failure, doubts in zip(
            fleet.robots, fleet.verdicts, fleet.failures, fleet.doubts, strict=True
        )
        if verdict == wanted
    ]
    caption = "Robots that failed, and those that something speaks against"
    table = Table(
        caption,
        ("Robot", "Verdict", "Why"),
        [Group(rows)],
        wordy=True,
    )
    seconds = quantity(fleet.seconds, "s")
    judgement = (
        f"{count(counts['fits'])} of {plural(total, 'robot')} fit the declared noise and the "
        "tolerances"
    )
    if counts["doubtful"]:
        judgement += f", {count(counts['doubtful'])} are doubtful"
    if counts["failed"]:
        judgement += f", {count(counts['failed'])} failed"
    next_step, command = _next(fleet)
    return Page(
        title=f"{fleet.nominal.name}: {plural(total, 'robot')}",
        subtitle=f"estimator {fleet.options.estimator}",
        headlines=[
            ("Fit", count(counts["fits"]), f"of {count(total)}"),
            ("Doubtful", count(counts["doubtful"]), ""),
            ("Failed", count(counts["failed"]), ""),
            *_residuals_of(fleet),
        ],
        verdict=verdict,
        judgement=judgement,
        doubts=tuple(_doubts_of(fleet)),
        next_step=next_step,
        next_command=command,
        paragraphs=[f"It took {seconds}: {significant(fleet.robots_per_second)} robots a second."],
        notes=tuple(str(each) for each in fleet.notes if each.code != _SHARED),
        sections=[
            *([Section("robots", "Robots to look at", [], [table])] if rows else []),
            *_workshop(fleet),
        ],
    )


def _next(fleet: Fleet) -> tuple[str, str]:
    """What to do now, and the command: of robots that are doubted, first those not looked into."""
    if fleet.redrawn is not None:
        return _REDRAWN, ""
    options = fleet.options.on_command_line()
    if not fleet.sources or options is None:
        return "", ""
    robot = next(
        (
            robot
            for robot, doubts in zip(fleet.robots, fleet.doubts, strict=True)
            if robot in fleet.sources and any(each.code == "not-examined" for each in doubts)
        ),
        next(iter(fleet.sources)),
    )
    command = f"symkin identify {typed_name(fleet.nominal)} {fleet.sources[robot]}{options}"
    return f"identify {robot} by itself, and so others", command


def _residuals_of(fleet: Fleet) -> Iterator[Headline]:
    """How well the robots are described, and which of them least."""
    known = np.flatnonzero(np.isfinite(fleet.residual_rms))
    if len(known):
        unit, rms = fleet.nominal.space.closure_unit, fleet.residual_rms
        worst = known[np.argmax(rms[known])]
        most = f"rms, median; at most {milli(rms[worst], unit)}, of {fleet.robots[worst]}"
        yield "Closure of the legs", milli(float(np.median(rms[known])), unit), most


def _doubts_of(fleet: Fleet) -> Iterator[str]:
    """What speaks against robots, those together against which the same does."""
    yield from (str(each) for each in fleet.notes if each.code == _SHARED)
    kinds: dict[tuple[object, ...], list[tuple[str, str]]] = {}
    for robot, failure, doubts in zip(fleet.robots, fleet.failures, fleet.doubts, strict=True):
        if failure:
            kinds.setdefault((failure,), []).append((robot, f" failed: {failure}"))
        for doubt in doubts:
            causes = ", or as well: ".join(each.words for each in (doubt, *doubt.others))
            said = f"likely cause: {causes}" if doubt.is_cause else causes
            remedy = "" if doubt.others else doubt.remedy
            said = f": {'; '.join(filter(None, (said, remedy)))}"
            alike = (doubt.code, doubt.legs, doubt.is_cause, len(doubt.others), len(doubt.then))
            kinds.setdefault(alike, []).append((robot, said))
    told = sorted(kinds, key=lambda kind: (kind[0] == "not-examined", -len(kinds[kind])))
    for kind in told[:_TOLD]:
        who, words = zip(*kinds[kind], strict=True)
        of_whom = "" if len({*words}) == 1 else f" (of {who[0]}; the others alike)"
        yield f"{few(who, _TOLD)}{words[0]}{of_whom}"
    if len(told) > _TOLD:
        yield f"{len(told) - _TOLD} more; the table says them"


def _workshop(fleet: Fleet) -> list[Section]:
    """What the workshop really makes, if that was asked for."""
    if not fleet.made_within:
        return []
    rows = [
        (
            each.what,
            significant(each.factor, 2) if each.is_seen else "not seen",
            f"{significant(each.low, 2)} to {significant(each.high, 2)}" if each.is_seen else NONE,
        )
        for each in fleet.made_within
    ]
    caption = "What the workshop makes, over the tolerances of the drawing"
    table = Table(caption, ("Of", "Factor", "95% interval"), [Group(rows)], brief=True)
    told = (
        "Standard deviations of the robots about the drawing, over the tolerances of the "
        "mechanism's file, most likely for all robots together."
    )
    return [Section("workshop", "What the workshop makes", [told], [table])]
