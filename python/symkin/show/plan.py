# SPDX-License-Identifier: MIT
"""What was planned: poses, how good they are, and how many there should be."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Sequence

import numpy as np

from symkin.analysis.measurable import measurable_symmetry
from symkin.analysis.promises import ExpectedAccuracy, left_to_gravity
from symkin.analysis.workspace import WorkspaceSample
from symkin.data.sensor_tables import shown_readings
from symkin.errors import few, unknowns_by_name
from symkin.estimate.survey import SILENT
from symkin.files.mechanism_file import typed_name
from symkin.model.chains import legs_in_words
from symkin.model.file_frames import as_drawn
from symkin.model.mechanism import Mechanism
from symkin.model.poses import vectors_from_quaternions
from symkin.options import OPTIONS
from symkin.planning import HeldByPriors, NeededPoses, Plan, PlanBasis, PoseCountCurve, Survey
from symkin.planning.accuracy import set_name
from symkin.planning.making import default_design
from symkin.planning.observing import is_probing
from symkin.planning.simulation import Simulation
from symkin.present import Group, Headline, Image, Page, Section, Table, page_of
from symkin.show.devices import device_notes
from symkin.show.images import plotted
from symkin.show.mechanism import mechanism_section
from symkin.show.observability import observability_section
from symkin.show.units import on_paper
from symkin.show.wording import (
    count,
    fixed,
    given,
    left_by_priors,
    milli,
    percent,
    plural,
    promise,
    quantity,
    quoted,
    significant,
)
from symkin.show.workspace import workspace_section

CRITERIA = {
    "O1": "O1 (D-optimality)",
    "O2": "O2",
    "O3": "O3 (E-optimality)",
    "O4": "O4",
    "O5": "O5",
    "expected_error": "expected end-effector error (I-optimality)",
}
_DESIGNS = {
    "legs": "a set of poses for each leg",
    "orbits": "whole orbits of poses, which every leg uses",
    "mechanism": "one set of poses for the parameters of all legs at once",
}
_LEFT_OUT = (
    "there, or at their images under the symmetry, the robot leaves its box, joint limits or a "
    "region that is allowed, or comes too near the end of its reach"
)
_STEPS = 200  # poses that the drawing steps through, which the page holds
_COMBINED = 3  # combinations of unknowns in a sentence
_NAMED = 12  # names in a sentence
_COUNTED = 12  # numbers of poses on the first screen
_PERCENT = "\N{NO-BREAK SPACE}%"


@page_of.register(Plan)
def plan_page(plan: Plan) -> Page:
    """Describe a plan: how good it is, what it shows, and where its poses lie."""
    mechanism, expected, basis = plan.mechanism, plan.expected, plan.basis
    survey = None if basis is None else basis.survey
    doubts, remark = _held(mechanism, survey, plan.held, expected)
    if plan.unseen and expected is None:
        doubts = ["what priors alone hold, these observations will not show; see the notes"]
    asked = _asked(survey)
    return Page(
        title=f"{mechanism.name}: plan",
        subtitle=legs_in_words(mechanism.legs),
        headlines=_headlines(plan),
        verdict="" if basis is None else "doubtful" if doubts else "good",
        judgement=_chosen_how(basis) + remark,
        doubts=doubts,
        notes=_notes(plan),
        paragraphs=[] if expected is None else [_errors(plan, expected)],
        next_step="take the poses in their order, spares only in place of those that the robot "
        "cannot take; then" + (", with the same unknowns" if asked is None else ""),
        next_command=f"symkin identify {typed_name(mechanism)} measurements.csv{asked or ''} "
        "--out identified",
        sections=_sections(plan),
    )


def _headlines(plan: Plan) -> list[Headline]:
    """How many poses, how good, how long the way, and what of a drift they show."""
    mechanism, basis = plan.mechanism, plan.basis
    beside = f"and {plural(int(plan.spare.sum()), 'spare')}"
    if basis is not None and basis.survey is not None and basis.survey.together > 1:
        beside += ", in pairs: the first and the second, the third and the fourth, ..."
    headlines: list[Headline] = [("Poses", count(int((~plan.spare).sum())), beside)]
    if basis is not None:
        least = min(choice.selection.certificate.efficiency for choice in basis.choices)
        remark = "proven optimal" if _proven(basis) else "of a bound that no set of poses exceeds"
        headlines.append(("Efficiency", f"{100 * least:.2f}{_PERCENT}", remark))
    if plan.expected is not None:
        headlines += _expected_headlines(mechanism, plan.expected)
    way = quantity(plan.travel, mechanism.space.closure_unit)
    headlines.append(("Way", way, "from home through the poses"))
    if plan.drift_shown is not None:
        shown = f"{100 * plan.drift_shown:.0f}{_PERCENT}"
        remark = "of a sensor's, in this order, is not taken for geometry"
        headlines.append(("Drift shown", shown, remark))
    return headlines


def _proven(basis: PlanBasis) -> bool:
    return all(choice.selection.certificate.proven_optimal for choice in basis.choices)


def _chosen_how(basis: PlanBasis | None) -> str:
    if basis is None:
        return "The poses were read from a file, which does not say how they were chosen"
    return "The poses are proven optimal" if _proven(basis) else "The poses come with a certificate"


def _notes(plan: Plan) -> list[str]:
    mechanism, basis = plan.mechanism, plan.basis
    notes = device_notes(mechanism)
    if mechanism.open_coordinates:
        notes.append(f"{left_to_gravity(mechanism)}; no accuracy at given readings can be told")
    if basis is not None and basis.excluded:
        excluded = f"{count(basis.excluded)} of {count(basis.candidates)} candidates"
        notes.append(f"{excluded} are left out: {_LEFT_OUT}")
    if basis is not None and basis.design == "legs" and _serves_all(basis, mechanism):
        wanted = int((~plan.spare).sum()) // len(mechanism.legs)
        notes.append(
            f"the legs are alike: with --design orbits {plural(wanted, 'pose')} would serve all of "
            "them, which is less to measure, and less accurate"
        )
    notes += _carried(plan)
    silent = [each.name for each in plan.unknowns if each.deviation > SILENT * each.prior]
    if silent:
        notes.append(
            f"no better known than their priors say: {few(unknowns_by_name(silent), _NAMED)}"
        )
    if basis is not None and basis.survey is not None and basis.survey.sessions:
        own = " and ".join(basis.survey.sessions)
        notes.append(f"{own} of single sessions are not planned for: all poses count as of one")
    if plan.unseen:
        shown = "; ".join(plan.unseen)
        if len(plan.unseen) > _COMBINED:
            shown = f"{count(len(plan.unseen))} combinations of the unknowns"
        notes.append(f"no observation shows, so that priors alone hold: {shown}")
    return notes


def _errors(plan: Plan, expected: ExpectedAccuracy) -> str:
    """What is promised, and what the errors are of."""
    errors = (
        f"{promise(plan.mechanism.space, expected)} Errors are those of the end effector over the "
        "workspace after identification with all poses and the estimator "
        f"{quoted(plan.estimator)}, for the declared noise."
    )
    if plan.basis is None or plan.basis.survey is None or expected.up_to_frames:
        return errors
    return f"{errors} They are of the target in the device's frame; what is held has none."


def _sections(plan: Plan) -> list[Section]:
    mechanism, basis = plan.mechanism, plan.basis
    symmetric = basis is not None and basis.symmetrical
    sections = [
        plan_section(plan),
        _unknowns_section(plan)
        if basis is not None and basis.survey is not None
        else observability_section(
            mechanism, plan.leg_poses(), symmetric=symmetric, rows=plan.row_kind
        ),
    ]
    if isinstance(plan.candidates, WorkspaceSample):
        sections.append(workspace_section(mechanism, plan.candidates, plan))
    wanted = np.flatnonzero(~plan.spare)[:_STEPS].tolist()
    steps = {f"row {row + 1}": plan.poses[row] for row in wanted}
    drawn = mechanism_section(mechanism, plan.poses[:1], steps=steps)
    return [*sections, drawn, _sheet_section(plan)]


def _asked(survey: Survey | None) -> str | None:
    """What was said of unknowns, as options of `identify`; None if the command cannot say it."""
    if survey is None:
        return ""
    return dataclasses.replace(survey.options, sessions=survey.sessions).on_command_line()


def _serves_all(basis: PlanBasis, mechanism: Mechanism) -> bool:
    """Whether the poses of one leg were carried to all others."""
    return basis.symmetrical and len(mechanism.legs) > len(basis.choices) == 1


def _carried(plan: Plan) -> list[str]:
    """What carried poses would be worth, where noise is why poses are chosen for all at once."""
    mechanism, basis = plan.mechanism, plan.basis
    if basis is None or basis.survey is None or not mechanism.noise.varies:
        return []
    if plan.candidates is None or basis.survey.observed.kinds != ("pose",):
        return []
    found = measurable_symmetry(mechanism, plan.candidates)
    return [] if found is None else [found.carried.removesuffix(".")]


def _held(
    mechanism: Mechanism,
    survey: Survey | None,
    held: HeldByPriors | None,
    expected: ExpectedAccuracy | None,
) -> tuple[list[str], str]:
    """What to doubt, and to add to a judgement, where priors hold what observations do not show."""
    if survey is None or held is None or expected is None:
        return [], ""
    priors = _priors(survey)
    combinations = plural(len(held.combinations), "combination")
    parts = left_by_priors(mechanism, held, expected)
    known = "is" if len(held.combinations) == 1 else "are"
    remark = (
        f", but {combinations} of the unknowns {known} known from {priors}, hardly from the "
        "observations"
    )
    if not parts:
        return [], f"{remark} (they hardly move the end-effector)"
    doubt = (
        f"{' and '.join(parts)} is what {priors} leave: the observations will say next to nothing "
        f"of it, more such poses hardly help, and it is larger if {priors} are wrong"
    )
    return [doubt], remark


def _priors(survey: Survey) -> str:
    tolerances = survey.layout.column_tolerances
    drawn = np.isinf(survey.priors) | np.isclose(survey.priors, tolerances, rtol=1e-9, atol=0)
    return "the drawing's tolerances" if drawn.all() else "the priors"


def _expected_headlines(mechanism: Mechanism, expected: ExpectedAccuracy) -> Sequence[Headline]:
    """Expected errors as headlines; of those that the platform has."""
    share = percent(expected.confidence)
    found = [
        (
            f"{kind.capitalize()} error",
            milli(getattr(expected, f"{kind}_bound"), unit),
            f"rms in {share} of such robots; mean {milli(getattr(expected, kind), unit)}",
        )
        for kind, unit in mechanism.space.errors
    ]
    return found + [
        (
            f"{kind.capitalize()} anywhere",
            milli(getattr(expected, f"{kind}_anywhere"), unit),
            f"largest in {share} of such robots",
        )
        for kind, unit in mechanism.space.errors
        if getattr(expected, f"{kind}_anywhere") is not None
    ]


def _unknowns_section(plan: Plan) -> Section:
    """What will be known of each unknown."""
    rows = []
    for each in plan.unknowns:
        factor, unit = on_paper(each.unit)
        figures = (each.deviation, each.tolerance, each.prior)
        rows.append((each.name, unit or "1", *(significant(factor * value) for value in figures)))
    columns = ("Unknown", "Unit", "Expected deviation", "Tolerance", "Prior")
    caption = "Standard deviations to expect of the unknowns"
    table = Table(caption, columns, [Group(rows)])
    return Section("unknowns", "What will be known", [], [table])


def _survey_text(survey: Survey) -> str:
    """What will be observed, and what is unknown."""
    kinds = [kind for kind in survey.observed.kinds if kind != "readings"]
    of = " of the target" if {"pose", "position", "orientation", "distance"} & set(kinds) else ""
    text = f"Observed will be {' and '.join(['the readings', *kinds])}{of}; unknown are "
    named = few(unknowns_by_name(survey.unknowns), _NAMED)
    text += f"{plural(len(survey.unknowns), 'scalar')}: {named}."
    if survey.together > 1:
        text += " Poses are in pairs, one behind the other: rows 1 and 2, 3 and 4, and so on."
    priors = int(np.isfinite(survey.priors).sum())
    return f"{text} Priors of {count(priors)} of them count too." if priors else text


def plan_section(plan: Plan, simulation: Simulation | None = None) -> Section:
    """Count planned and spare poses of every set, and those that a simulated robot replaced."""
    replaced = simulation.replaced if simulation else ()
    rows = []
    for at, leg in enumerate(np.unique(plan.leg_sets).tolist()):
        figures = [len(plan.rows_of_set(leg, spare=spare)) for spare in (False, True)]
        figures += [replaced[at]] if simulation else []
        rows.append((set_name(leg), *map(str, figures)))
    columns = ("Set of", "Poses", "Spares", *(("Replaced by spares",) if simulation else ()))
    parts = [Table("Planned poses", columns, [Group(rows)])]
    if plan.basis is not None:
        parts.append(_selections(plan.mechanism, plan.basis))
    return Section("plan", "Plan", _paragraphs(plan, simulation), parts)


def _sheet_section(plan: Plan) -> Section:
    """The poses in the order of measuring, to print and tick."""
    mechanism, space = plan.mechanism, plan.mechanism.space
    poses = as_drawn(mechanism, plan.poses)
    readings = shown_readings(mechanism, plan.readings)[:, mechanism.is_read]
    angles, turned = poses[:, space.size :], space.orientation
    if space.has_quaternion:
        angles, turned = vectors_from_quaternions(angles), ("rx", "ry", "rz")
    names = [*((name, "m") for name in space.position), *((name, "rad") for name in turned)]
    legs = range(1, readings.shape[1] + 1)
    names += [(f"Reading {leg}", mechanism.reading_unit) for leg in legs]
    columns, factors, digits = ["Done"], [], []
    for name, unit in names:
        factor, shown = on_paper(unit)
        columns.append(f"{name}, {shown}")
        factors.append(factor)
        digits.append(_decimals(unit, factor))
    figures = np.hstack([poses[:, : space.size], angles, readings]) * factors
    groups = []
    for title, chosen in (("", ~plan.spare), ("Spares, in place of those not reached", plan.spare)):
        told = [
            [f"\N{WHITE SQUARE} {row + 1}", *map(fixed, figures[row].tolist(), digits)]
            for row in np.flatnonzero(chosen).tolist()
        ]
        groups += [Group(told, title)] * bool(told)
    paragraph = (
        "To print: the poses in the order of measuring, as they are commanded. The number is the "
        "row of plan.csv, which has all digits."
    )
    if space.has_quaternion:
        paragraph += " Orientations are rotation vectors."
    parts: list[Table | Image] = [Table("Poses in the order of measuring", columns, groups)]
    survey = None if plan.basis is None else plan.basis.survey
    if survey is not None and is_probing(mechanism, survey.observed):
        parts.insert(0, _bed(plan))
    return Section("sheet", "Lab sheet", [paragraph], parts)


def _bed(plan: Plan) -> Image:
    """Where the bed is touched."""
    return Image(
        "bed",
        "Map of the points on the bed, numbered.",
        "Where to touch the bed, in the order of measuring.",
        plotted("bed_points", plan.poses[~plan.spare, :2]),
    )


def _decimals(unit: str, factor: float) -> int:
    """Digits after the point that a person sets: to 0.01 mm and 0.001 degrees."""
    least = {"m": 1e-5, "rad": 1e-4}.get(unit, 1e-4)
    return max(0, math.ceil(-math.log10(least * factor)))


def _selections(mechanism: Mechanism, basis: PlanBasis) -> Table:
    """What was chosen for which legs, and how far it can be from the best."""
    rows = []
    for choice in basis.choices:
        value, found = choice.selection.criterion_value, choice.selection.certificate
        as_length = basis.criterion == "expected_error"
        said = milli(value**0.5, "m") if as_length else significant(value, 4)
        shares = (found.efficiency, found.o1_efficiency, found.efficiency_repeats)
        shown = [f"{100 * share:.2f}{_PERCENT}" for share in shares]
        proven = "yes" if found.proven_optimal else "no"
        rows.append([mechanism.named_legs(choice.legs), said, *shown, proven])
    columns = ["For", f"Value of {basis.criterion}", "Efficiency", "Of the determinant"]
    columns += ["With repeats", "Proven optimal"]
    return Table("Selections and their certificates", columns, [Group(rows)])


def _paragraphs(plan: Plan, simulation: Simulation | None) -> list[str]:
    wanted = np.flatnonzero(~plan.spare)
    text = f"{plural(len(wanted), 'pose')} to measure; the way through them, from home, is "
    way = quantity(plan.travel, plan.mechanism.space.closure_unit)
    paragraphs = [f"{text}{way}."]
    if plan.basis is not None:
        paragraphs += _made(plan.basis)
    if simulation is not None:
        replaced = sum(simulation.replaced)
        paragraphs.append(
            f"The robot could not take {count(replaced)} of them, which spares replaced."
            if replaced
            else "The robot could take all of them."
        )
    return paragraphs


def _made(basis: PlanBasis) -> list[str]:
    rows = "noise-aware rows" if basis.rows == "noise_aware" else "the paper's rows"
    left = basis.candidates - basis.excluded
    text = (
        f"The design is {_DESIGNS[basis.design]}, chosen from {plural(left, 'candidate')} by "
        f"{CRITERIA[basis.criterion]} with {rows}, method {basis.method}."
    )
    if basis.excluded:
        left_out = plural(basis.excluded, "candidate was", "candidates were")
        text += f" {left_out} left out: {_LEFT_OUT}."
    if any(len(choice.elements) > 1 for choice in basis.choices):
        text += " The symmetry carries what was chosen for one leg to the others."
    certificate = (
        "The efficiency is the share of a bound that no set of so many poses exceeds: of the p-th "
        "root of the determinant for O1, of the value for O2 to O5, of the expected squared error "
        "for that criterion. The bound with repeats lets a pose be measured more than once."
    )
    return [text, *([] if basis.survey is None else [_survey_text(basis.survey)]), certificate]


@page_of.register(PoseCountCurve)
def pose_count_page(curve: PoseCountCurve) -> Page:
    """Describe what more poses bring."""
    mechanism, gain = curve.mechanism, f"{100 * curve.least_gain:g}{_PERCENT}"
    (kind, _), *_others = mechanism.space.errors
    enough = (
        f"From {plural(curve.enough, 'pose')} a leg on, another one saves less than {gain} of the "
        f"{kind} error"
        if curve.enough is not None
        else f"Every further pose saves at least {gain} of the {kind} error"
    )
    most = ExpectedAccuracy(float(curve.position[-1]), float(curve.orientation[-1]), 0, 0)
    doubts, remark = _held(mechanism, curve.survey, curve.held, most)
    paragraph = [
        "Errors are predicted to first order from the declared noise. About half of all robots "
        f"exceed the mean; {percent(curve.confidence)} are within the bound."
    ]
    paragraph += [] if curve.survey is None else [_survey_text(curve.survey)]
    return Page(
        title=f"{mechanism.name}: number of poses",
        subtitle=legs_in_words(mechanism.legs),
        headlines=[("Enough", str(curve.enough or "more"), _counted_for(curve))],
        verdict="doubtful" if doubts else "good",
        judgement=enough + remark,
        doubts=doubts,
        paragraphs=[" ".join(paragraph)],
        next_step="" if curve.survey is None else "with the same options",
        next_command=_plan(curve, curve.enough or int(curve.counts[-1])),
        sections=[_curve_section(curve)],
    )


def _place_of(curve: PoseCountCurve) -> int:
    """Where in the curve the number stands that is enough, or the largest."""
    counts = curve.counts.tolist()
    return counts.index(curve.enough) if curve.enough in counts else len(counts) - 1


def _counted_for(curve: PoseCountCurve) -> str:
    """For which design the poses were counted, and how many are measured then."""
    design = curve.settings["design"] or default_design(curve.survey)
    told = f"poses a leg, with --design {design}"
    if curve.enough is None:
        return told
    measured = np.interp(curve.enough, curve.counts, curve.measured)
    return f"{told}: {count(round(float(measured)))} in all"


@page_of.register(NeededPoses)
def needed_poses_page(needed: NeededPoses) -> Page:
    """Describe how many poses a wanted accuracy needs, and what else would help."""
    curve, expected = needed.curve, needed.expected
    mechanism, reached = curve.mechanism, needed.count is not None
    wanted = " and ".join(
        given(value, unit)
        for value, unit in ((needed.position, "m"), (needed.orientation, "rad"))
        if value is not None
    )
    poses = f"{plural(needed.tried, 'pose')} a leg, {needed.measured} in all"
    judgement = f"{poses}, are {'enough' if reached else 'too few'} for {wanted} "
    judgement += f"(rms) in {percent(curve.confidence)} of such robots"
    doubt = (
        f"the noise would have to be {significant(needed.excess, 2)} times smaller, or the "
        "accuracy that much coarser"
    )
    survey = curve.survey
    if survey is not None and (survey.options.assume or np.isfinite(survey.priors).any()):
        left = "the priors do not leave"
        if survey.options.assume:
            left = "is not due to what is assumed"
        doubt = (
            f"the errors are {significant(needed.excess, 2)} times what is wanted; less noise "
            f"makes that part of them alone smaller which {left}"
        )
    doubts, remark = _held(mechanism, curve.survey, curve.held, expected)
    headlines = [
        ("Needed" if reached else "Tried", str(needed.tried), "poses a leg"),
        *_expected_headlines(mechanism, expected),
    ]
    remedies = Section("remedies", "What else would help", [], [_remedies(needed)])
    page = pose_count_page(curve)
    return dataclasses.replace(
        page,
        headlines=headlines,
        paragraphs=[
            f"With {plural(needed.tried, 'pose')} a leg {promise(mechanism.space, expected)}",
            *page.paragraphs,
        ],
        verdict="bad" if not reached else "doubtful" if doubts else "good",
        judgement=judgement + remark,
        doubts=[*([] if reached else [doubt]), *doubts],
        next_command=_plan(curve, needed.tried) if reached else "",
        sections=[*([remedies] if needed.remedies else []), _curve_section(curve, brief=False)],
    )


def _plan(curve: PoseCountCurve, count: int) -> str:
    usual = {name: OPTIONS[name].default for name in ("design", "rows", "criterion")}
    usual["design"] = default_design(curve.survey)
    other = "".join(
        f" --{name} {each}"
        for name, each in curve.settings.items()
        if each != usual.get(name, each)
    )
    if curve.confidence != OPTIONS["confidence"].default:
        other += f" --confidence {curve.confidence:g}"
    named = typed_name(curve.mechanism)
    return f"symkin plan {named}{other} --pose-count {count} --out planned"


def _remedies(needed: NeededPoses) -> Table:
    kinds = needed.curve.mechanism.space.errors
    rows = [
        (
            remedy.change,
            *(milli(getattr(remedy.expected, f"{kind}_bound"), unit) for kind, unit in kinds),
            "yes" if remedy.enough else "no",
        )
        for remedy in needed.remedies
    ]
    share = percent(needed.curve.confidence)
    columns = ["Change", *(f"{kind.capitalize()}, {share}" for kind, _ in kinds)]
    caption = "What else would help, at the same poses"
    return Table(caption, [*columns, "Enough"], [Group(rows)], brief=True)


def _curve_section(curve: PoseCountCurve, *, brief: bool = True) -> Section:
    kinds = curve.mechanism.space.errors
    figure = Image(
        "pose_count",
        "Expected errors and efficiency against the number of poses.",
        "Expected error after identification, and efficiency of the selection, against the number "
        "of poses that each leg is identified from. The dashed line is where another pose begins "
        "to gain too little.",
        plotted("pose_count", curve),
    )
    efficiency = ("Efficiency", [f"{100 * each:.2f}{_PERCENT}" for each in curve.efficiency])
    share, tables = percent(curve.confidence), []
    for of, end, told in ((share, "_bound", []), ("mean", "", [efficiency])):
        found = [
            (f"{kind.capitalize()}, {of}", [milli(each, unit) for each in values])
            for kind, unit in kinds
            for values in (getattr(curve, f"{kind}{end}"),)
        ]
        columns = [
            ("Poses a leg", map(str, curve.counts.tolist())),
            ("In all", map(str, curve.measured.tolist())),
            *found,
            *told,
        ]
        rows = list(zip(*(values for _, values in columns), strict=True))
        tables.append(
            Table(
                f"What more poses bring, {of if end == '' else f'{of} of such robots'}",
                [name for name, _ in columns],
                [Group(rows)],
                brief=brief and bool(end),
                brief_rows=_COUNTED,
                others="between",
                about=_place_of(curve),
            )
        )
    return Section("curve", "Number of poses", [], [figure, *tables])
