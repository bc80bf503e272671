# SPDX-License-Identifier: MIT
"""What was estimated, from how well it fits to what to do next."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np

from symkin.analysis.evaluation import AlignedErrors, Evaluation
from symkin.analysis.promises import NORMAL_95
from symkin.analysis.workspace import workspace_coordinates
from symkin.errors import few
from symkin.estimate.covariates import sessions_of
from symkin.estimate.estimate import CORRECTED, REDRAWN, Estimate
from symkin.estimate.fitted_prior import FittedPrior
from symkin.estimate.parameters import Unknown, shared_by_role
from symkin.estimate.problem import KINDS
from symkin.estimate.sharing import written_tie
from symkin.estimate.strain import Strain
from symkin.estimate.ties import MEASURED, ONE_DRAW, equation_of, meaning_of
from symkin.files.mechanism_file import typed_name
from symkin.model.mechanism import Mechanism
from symkin.present import (
    ErrorLine,
    Group,
    Headline,
    Image,
    Page,
    Section,
    Table,
    Verdict,
    for_details,
    page_of,
    summary_of,
)
from symkin.show.check import symmetry_section
from symkin.show.devices import device_notes
from symkin.show.evaluation import (
    ALIGNED,
    error_figures,
    error_table,
    heights_headlines,
    heights_section,
    left_out,
)
from symkin.show.images import plotted
from symkin.show.mechanism import mechanism_section
from symkin.show.observability import observability_section
from symkin.show.observations import in_deviations, observation_section, rms
from symkin.show.symmetry import robot_symmetry_section
from symkin.show.units import on_paper
from symkin.show.wording import (
    NONE,
    TURN_LEFT_OUT,
    became,
    chain_subtitle,
    decimals_of,
    fixed,
    left_by_priors,
    milli,
    percent,
    place,
    plural,
    pose_coordinates,
    promise,
    quoted,
    ratio,
    significant,
    sources,
)
from symkin.values import Array

_INFLUENTIAL = 8
_WEAKEST = 3  # unknowns in one line
_NAMED_SHARE = 1e-3  # of a direction's square
_CLOCK = "clock_"
_BLOCKS = {
    "base": "Base, in the frame of the measuring device",
    "target": "Target, in the platform's frame",
    "plane": "Plane, in the frame of the base",
    "drift": "Drift of the base in the frame of the measuring device, from end to end",
}


@page_of.register(Estimate)
def estimate_page(found: Estimate) -> Page:
    """Tell an estimate."""
    top, poses = estimate_summary(found), found.latent_poses
    known = np.asarray(np.isfinite(poses).all(axis=1))
    read = np.isfinite(found.measurements.readings) & known[:, None]
    sets = [found.measurements.poses[fit.rows] for fit in found.legs]
    sections = [
        *top.sections,
        for_details(_pose_section(found)),
        for_details(
            observability_section(
                found.nominal, sets or [poses[own] for own in read.T], symmetric=False
            )
        ),
        symmetry_section(found.nominal),
        robot_symmetry_section(found),
        mechanism_section(found.nominal, poses[known]),
    ]
    return dataclasses.replace(top, sections=sections)


@summary_of.register(Estimate)
def estimate_summary(found: Estimate) -> Page:
    """Tell the answer, whether to trust it, and what of that has a table on the command line."""
    verdict, words = judgement(found)
    if found.trustworthy and found.heights is None:
        words += _known_before(found)
    command = _next_command(found)
    return Page(
        title=f"{found.nominal.name}: identification from measurements",
        subtitle=chain_subtitle(found.nominal),
        errors=_errors(found),
        headlines=list(_headlines(found)),
        verdict=verdict,
        judgement=words,
        doubts=tuple(map(str, found.doubts)),
        notes=(*map(str, found.notes), *device_notes(found.nominal)),
        paragraphs=[_done(found), _degrees(found), *_promise(found), *_left_out(found)],
        next_step=_next_step(found, command),
        next_command=command,
        sections=[
            parameter_section(found),
            observation_section(found),
            _accuracy_section(found),
            *heights_section(found.heights),
            _knowledge_section(found),
        ],
        inputs=sources(found.nominal.source, found.measurements.source),
    )


def judgement(found: Estimate) -> tuple[Verdict, str]:
    """Whether an estimate can be trusted, for the eye and in words."""
    if not found.converged:
        return "bad", f"Not converged: {found.failure}."
    if found.doubts:
        return "doubtful", "Converged, with doubts."
    return "good", "Converged; nothing speaks against the estimate."


def _promise(found: Estimate) -> list[str]:
    """What may be relied on, if the estimate may."""
    expected = found.expected
    if not found.converged or expected is None:
        return []
    told = promise(found.nominal.space, expected)
    if found.doubts:
        return [f"If noise and model were as they are taken to be: {told}"]
    return [f"By what is uncertain of the unknowns, to first order: {told}"]


def _known_before(found: Estimate) -> str:
    """What to add where much of the errors to expect is what the priors leave."""
    expected = found.expected
    if expected is None or expected.held is None:
        return ""
    parts = left_by_priors(found.nominal, expected.held, expected)
    if not parts:
        return ""
    return (
        f" But {' and '.join(parts)} is what the priors leave: the observations say next to "
        "nothing of it."
    )


def _next_step(found: Estimate, command: str) -> str:
    """What to do now: what keeps it from converging, what speaks against it, or where to go."""
    if found.corrected is not None:
        return f"if that is what happened, identify from {CORRECTED}, the table so corrected"
    if found.redrawn is not None:
        return f"if that is so, identify from {REDRAWN}, the drawing so corrected"
    if command and _asked(found):
        return "if that is so, identify so"
    if not found.converged:
        return (
            "look for what keeps the estimate from converging: units, frames, signs, the order of "
            "the legs, the working mode; `symkin check` shows what the mechanism expects; fix what "
            "is known, or give priors."
        )
    if found.doubts:
        return "settle the doubts, beginning with the first, and identify again."
    if found.heights is not None:
        return "let the controller use the calibrated mechanism, print, and measure the print."
    if found.cross_validation is None:
        return "see how well poses are predicted that the fit did not see, with --cross-validate 5"
    return "let the controller use the calibrated mechanism, and evaluate it on poses measured anew"


def _asked(found: Estimate) -> dict[str, Any]:
    """Options that settle the first doubt."""
    asked: dict[str, Any] = {}
    for each in (doubt for first in found.doubts[:1] for doubt in (first, *first.then)):
        asked |= each.options
    return asked


def _next_command(found: Estimate) -> str:
    """What does the next step; empty where a person must act first."""
    asked = _asked(found)
    if found.corrected is not None or found.redrawn is not None or asked:
        corrected = dataclasses.replace(found.options, **asked).on_command_line()
        typed = found.measurements.typed
        if corrected is None or (found.corrected is None and not typed):
            return ""
        drawing, table = found.nominal, typed
        if found.corrected is not None:  # whose columns have symkin's names
            drawing = drawing.replace(measurement_columns=None)
            table = f"{{folder}}/{CORRECTED}"
        robot = f"{{folder}}/{REDRAWN}" if found.redrawn is not None else typed_name(drawing)
        return f"symkin identify {robot} {table}{corrected} --out corrected"
    if not found.trustworthy or found.heights is not None:
        return ""
    if found.cross_validation is not None:
        return "symkin evaluate {folder}/calibrated.toml --measurements measured-anew.csv"
    typed, options = found.measurements.typed, found.options.on_command_line()
    if not typed or options is None:
        return ""
    return (
        f"symkin identify {typed_name(found.nominal)} {typed}{options} "
        "--cross-validate 5 --out checked"
    )


def _headlines(found: Estimate) -> Iterator[Headline]:
    if found.heights is not None:
        yield from heights_headlines(found.heights)
    if math.isfinite(found.residual_rms) and not found.trustworthy:
        unit = found.nominal.space.closure_unit
        remark = ratio(found.nominal_residual_rms, found.residual_rms)
        if found.cross_validation is not None:
            unseen = milli(found.cross_validation.residual_rms, unit)
            remark += f"; {unseen} in cross-validation"
        value = became(found.nominal_residual_rms, found.residual_rms, unit)
        yield "Closure of the legs, rms", value, remark
    if (told := _aligned(found)) is not None:
        yield told
    if found.degrees_of_freedom > 0:
        low, high = (each / found.degrees_of_freedom for each in (found.least, found.limit))
        remark = f"{significant(low)} to {significant(high)} for sound robots"
        if found.noise_is_estimated:
            remark = "by construction, since the noise was estimated"
            if found.session_noise:
                times = ", ".join(map(significant, found.session_noise))
                remark += f": {times} times the declared one in the sessions"
        left_out = {row for row, _ in found.rejected}.union(found.aside)
        if left_out:
            remark += f"; without what was rejected at {plural(len(left_out), 'pose')}"
        yield "Chi-square per degree", significant(found.chi_square_ratio), remark
    if found.fitted_prior is not None:
        yield _prior_headline(found.fitted_prior)
    if found.converged and found.directions and not found.unseen:
        yield _known_worst(found)


def _aligned(found: Estimate) -> Headline | None:
    """What no frame explains, where errors are told as they are and that was most of them."""
    before, after = found.before, found.after
    if before is None or after is None or before.aligned is None or after.aligned is None:
        return None
    kind, unit = before.kinds[0]
    old, new = (getattr(each.aligned, f"{kind}_rms") for each in (before, after))
    (first,) = as_told(found, before)
    if first is before.aligned or 2 * old > getattr(before, f"{kind}_rms"):
        return None
    remark = "most of it was, before, one motion of base or tool frame"
    return "With frames aligned, rms", became(old, new, unit), remark


def _known_worst(found: Estimate) -> Headline:
    """What the measurements show least of, how little, and what would show more of it."""
    worst, *_ = found.directions
    names = [each.partition(".")[2] if each[:3] == "leg" else each for each in worst.unknowns]
    told = few(list(dict.fromkeys(names)), _WEAKEST)
    if worst.deviation >= 1:
        told += "; symkin plan --measured adds poses that show it"
    return "Known worst", f"{significant(worst.deviation, 2)} tolerances", told


def _errors(found: Estimate) -> list[ErrorLine]:
    """The robot as drawn and as calibrated, and beside it what was measured of it.

    What was measured alone, where something speaks against the estimate; what to expect alone where
    no end-effector error was measured, as of positions without orientation.
    """
    before, after = found.before, found.after
    kinds = found.nominal.space.errors
    lines = {kind: _expected_line(found, kind, unit) for kind, unit in kinds}
    alone = []
    if found.options.of is not None:  # whereas what is measured is told of the whole position
        whole = lines["position"]
        alone = [dataclasses.replace(whole, kind=place(found.options.of))]
        lines["position"] = ErrorLine("position", whole.unit)
    if found.heights is not None:
        return [each for each in alone if each.expected is not None]
    if before is not None and after is not None:
        old, new = as_told(found, before, after)
        for kind, _ in after.kinds:
            measured = getattr(old, f"{kind}_rms"), getattr(new, f"{kind}_rms")
            lines[kind] = dataclasses.replace(lines[kind], measured=measured)
            if lines[kind].expected is not None:
                instrument = instrument_of(found, kind)
                lines[kind] = dataclasses.replace(
                    lines[kind],
                    before=math.sqrt(max(measured[0] ** 2 - instrument**2, 0.0)),
                    instrument=instrument,
                )
    told = [*alone, *lines.values()]
    return [each for each in told if each.measured or each.expected is not None]


def _expected_line(found: Estimate, kind: str, unit: str) -> ErrorLine:
    """What to expect of an estimate that nothing speaks against."""
    line, expected = ErrorLine(kind, unit), found.expected
    if expected is None or not found.trustworthy:
        return line
    return dataclasses.replace(
        line,
        expected=getattr(expected, kind),
        bound=getattr(expected, f"{kind}_bound"),
        confidence=expected.confidence,
    )


def as_told(found: Estimate, *errors: Evaluation) -> Sequence[Evaluation | AlignedErrors]:
    """What a screen says first: what no frame explains, where nobody knows the frames."""
    aligned = [each.aligned for each in errors if each.aligned is not None]
    return aligned if found.floats and len(aligned) == len(errors) else errors


def instrument_of(found: Estimate, kind: str) -> float:
    """What the instrument contributes to an error that it measured after identification, m or rad.

    The fit takes to itself of the noise what it then errs by elsewhere.
    """
    after, at_poses = found.after, found.accuracy_at_poses
    left = math.nan if after is None else getattr(as_told(found, after)[0], f"{kind}_rms")
    return math.hypot(left, getattr(at_poses, kind))


def _done(found: Estimate) -> str:
    measurements, nominal = found.measurements, found.nominal
    source = f" ({measurements.named})" if measurements.named else ""
    poses = len(measurements.poses)
    shared = sum(each.status == "shared" for each in found.unknowns)
    held = sum(each.status.partition(",")[0] == "held" for each in found.unknowns)
    told = (
        f"{plural(poses, 'measured pose')}{source} {'was' if poses == 1 else 'were'} used to "
        f"identify {plural(len(found.names), 'unknown')} of the robot as it was measured, with the "
        f"estimator {quoted(found.estimator)}"
    )
    if found.legs:
        told += f", from the closures of {plural(len(nominal.legs), 'leg')}"
    else:
        told += ", all together by maximum likelihood, with the true poses unknown as well"
    if shared:
        told += f"; {plural(shared, 'parameter')} of the legs move as one with others"
    if held:
        told += f"; {plural(held, 'parameter')} {'is' if held == 1 else 'are'} held"
    return f"{told}. What was observed: {_observed(found)}."


def _observed(found: Estimate) -> str:
    counts = np.bincount(found.rows.kind, minlength=len(KINDS))
    coordinates = {"pose": "of poses", "points": "of points"}
    coordinates["reported pose"] = "that a controller reported"
    told = []
    for kind, number in zip(KINDS, counts.tolist(), strict=True):
        what = plural(number, "coordinate" if kind in coordinates else kind.removesuffix("s"))
        told += [f"{what} {coordinates.get(kind, '')}".rstrip()] * bool(number)
    return ", ".join(told) + f", at {plural(len(found.measurements.poses), 'pose')}"


def _degrees(found: Estimate) -> str:
    equations = int(found.conditions.sum())
    priors = sum(1 for each in found.first_unknowns if math.isfinite(each.prior))
    told = f"The poses leave {plural(equations, 'equation')}"
    if priors:
        told += f", priors add {priors}"
    return (
        f"{told}; {found.rank} independent combinations of the unknowns are estimated from them, "
        f"which leaves {plural(round(found.degrees_of_freedom), 'degree')} of freedom. The "
        f"observations alone show {found.data_rank} of {len(found.names)} combinations."
    )


def _left_out(found: Estimate) -> Iterator[str]:
    """What the errors, of which headlines and tables tell, do not hold."""
    if found.before is not None and found.after is not None:
        yield from left_out({"before": found.before, "after": found.after})
    if found.cross_validation is not None and not found.cross_validation.converged:
        yield "Not every identification of the cross-validation converged."


def parameter_section(found: Estimate, actual: Mechanism | None = None) -> Section:
    """Give the parameters with their uncertainty, compared with the truth where it is known."""
    paragraphs = [f"Standard deviations follow {_origin_of_deviations(found)}."]
    if found.gauge:
        paragraphs.append(
            f"They depend on how what the observations do not show was settled: {found.gauge}."
        )
    signed = shared_by_role(found.unknowns)
    if signed:
        paragraphs.append(f"Shared by role, changes go so: {', '.join(signed)}.")
    if found.options.tie:
        paragraphs.append(f"Tied: {'; '.join(_tied(found))}.")
    parts: list[Table | Image] = [_parameter_table(found, actual), *_noise_table(found)]
    parts += _prior_table(found)
    if actual is not None:
        paragraphs.append(_coverage(in_deviations(found, actual)))
        parts.append(
            Image(
                "parameter_errors",
                "Errors of all identified parameters in standard deviations, with the 95% "
                "interval.",
                "Errors of the identified parameters, each in its own standard deviations.",
                plotted("parameter_errors", found, actual),
            )
        )
    return Section("identification", "Identified parameters", paragraphs, parts)


def _tied(found: Estimate) -> Iterator[str]:
    """Ties as they were written, with what they mean to priors."""
    units = {each.name: each.unit for each in found.unknowns if each.name.startswith("leg")}
    strains = {each.tie: each for each in found.strains}
    for text in found.options.tie:
        for each in written_tie(found.nominal, text):
            tie = equation_of(each, units)
            if tie.within:
                yield f"{each} ({_strained(strains[each])})"
                continue
            said = meaning_of(each)[1] or not len(found.prior_rows)
            yield each if said else each + (MEASURED if tie.measured else ONE_DRAW)


def _strained(strain: Strain) -> str:
    """How far a tie is pulled."""
    factor, unit = on_paper(strain.unit)
    off = f"{significant(factor * abs(strain.size), 2)} {unit}".rstrip()
    times = significant(abs(strain.size) / strain.deviation, 2)
    told = f"the estimate is {off} off it, {times} of its deviations"
    if not math.isfinite(strain.others):
        return told
    others, known = (
        significant(factor * each, 2) for each in (strain.others, strain.others_deviation)
    )
    return f"{told}; all else has {others} +- {known} {unit}".rstrip()


def _origin_of_deviations(found: Estimate) -> str:
    if found.noise_is_estimated:
        return "from the estimated noise"
    if found.options.loss != "none":
        return "from the residuals that the loss keeps; their errors follow Student's t"
    if not found.unexplained:
        return "from the declared noise, which explains the residuals"
    if found.estimator == "joint":
        return (
            "from the declared noise, scaled up by the root of chi-square per degree of freedom, "
            "since the residuals are larger than it explains"
        )
    return "from the residuals, since these are larger than the declared noise explains"


def _coverage(errors: Array) -> str:
    known = errors[np.isfinite(errors)]
    inside = np.sum(np.abs(known) <= NORMAL_95)
    return (
        f"The 95% interval of {inside} of {known.size} parameters holds the true value; "
        f"{significant(0.95 * known.size)} can be expected."
    )


def _parameter_table(found: Estimate, actual: Mechanism | None) -> Table:
    columns = ["Parameter", "Unit", "Nominal", "Identified", "Standard deviation"]
    columns += ["Over tolerance", "Change", "Status"]
    columns += [] if actual is None else ["True", "Error / standard deviation"]
    groups = []
    blocks = list(dict.fromkeys(each.name.partition(".")[0] for each in found.unknowns))
    clocks = [each for each in blocks if each.startswith(_CLOCK)]
    for block in (each for each in blocks if each not in clocks[1:]):  # one, along each axis
        own = [each for each in found.unknowns if each.name.partition(".")[0] == block]
        rows = [_parameter_row(each) for each in own]
        if actual is not None and block.startswith("leg"):
            leg = int(block[3:]) - 1
            errors = dict(
                zip(actual.parameter_names, in_deviations(found, actual)[leg], strict=True)
            )
            for each, row in zip(own, rows, strict=True):
                name = each.name.partition(".")[2]
                if name not in errors:  # what changes from row to row is nothing of the robot's
                    row += [NONE, NONE]
                    continue
                value = actual.legs[leg].parameters[name]
                factor, _ = on_paper(each.unit)
                true = fixed(factor * value, decimals_of(factor * each.deviation))
                row += [true, fixed(errors[name], 2)]
        groups.append(Group(rows, _title(block)))
    return Table("Identified parameters", columns, groups)


def _parameter_row(each: Unknown) -> list[str]:
    factor, unit = on_paper(each.unit)
    decimals = decimals_of(factor * each.deviation)
    return [
        "offset" if each.name.startswith(_CLOCK) else each.name.partition(".")[2],
        unit,
        fixed(factor * each.nominal, decimals),
        fixed(factor * each.value, decimals),
        significant(factor * each.deviation, 2),
        significant(each.deviation / each.tolerance, 2),
        _change(each),
        each.status,
    ]


def _change(each: Unknown) -> str:
    """A change from the drawing as a person says it: in mm, degrees, or percent of a gain."""
    if not math.isfinite(each.change):
        return NONE
    factor, name = on_paper(each.unit)
    if name == "s":  # of a clock, which nobody sets by its own size
        factor, name = 1e3, "ms"
    if name == each.unit:
        factor = 100 / abs(each.nominal or 1.0)
        name = "%" + each.unit.removeprefix("1")[: 0 if each.nominal else None]
    text = fixed(factor * each.change, decimals_of(factor * each.deviation, 3))
    sign, space = "+" * (each.change > 0), "" if name == "\N{DEGREE SIGN}" else " "
    return f"{sign}{text}{space}{name}"


def _title(block: str) -> str:
    for start in ("leg", "point", "anchor", "distance"):
        if block.startswith(start):
            return f"{start.capitalize()} {block.removeprefix(start)}"
    if block.startswith("step"):
        return f"Step of the base in the frame of the measuring device, at row {block[4:]}"
    if block.startswith(_CLOCK):
        return "Clock of the measuring device, behind that of the readings"
    if block.startswith("session"):
        return f"Base in the frame of the measuring device, session {block[7:]} less the last"
    return _BLOCKS[block]


def _noise_table(found: Estimate) -> list[Table]:
    if found.session_noise:
        own = zip(sessions_of(found.measurements).items(), found.session_noise, strict=True)
        rows = [(str(number), str(int(of.sum())), significant(each)) for (number, of), each in own]
        columns = ("Session", "Rows", "Times the declared noise")
        return [Table("Noise of the sessions", columns, [Group(rows)], brief=True)]
    if found.options.noise != "estimate":
        return []
    declared, noise = found.nominal.noise, found.noise
    unit = found.nominal.reading_unit
    kinds = [*found.nominal.space.errors, ("reading", unit)]
    if declared.along is not None:
        kinds.insert(1, ("along", kinds[0][1]))

    def hidden(name: str) -> str:
        gone = getattr(declared, name) and not getattr(noise, name)
        return " (the other noise hides it)" if gone else ""

    rows = [
        (name, milli(getattr(declared, name), of), milli(getattr(noise, name), of) + hidden(name))
        for name, of in kinds
    ]
    columns = ("Noise of", "Declared", "Estimated")
    return [Table("Standard deviations of the noise", columns, [Group(rows)], brief=True)]


def _prior_headline(prior: FittedPrior) -> Headline:
    """What tolerances became by the measurements."""
    parts = [f"{_share(each.share)} of {each.kind}s" for each in prior.common]
    told = f"in common: {', '.join(parts)}" if parts else "no leg is another's image"
    return "Tolerances, fitted", f"{significant(prior.scale, 2)} times", told


def _prior_table(found: Estimate) -> list[Table]:
    """What the measurements say of the tolerances, if that was asked for."""
    prior = found.fitted_prior
    if prior is None:
        return []
    best = int(np.argmax(prior.weights))
    mean, likeliest = (significant(each, 2) for each in (prior.scale, float(prior.scales[best])))
    rows = [("times the stated tolerances", mean, likeliest, _share(prior.weights[best]))]
    for each in prior.common:
        best = int(np.argmax(each.weights))
        likeliest, weight = _share(each.shares[best]), _share(each.weights[best])
        rows.append((f"common share of {each.kind}s", _share(each.share), likeliest, weight))
    columns = ("Of the prior", "Mean", "Likeliest", "Its weight")
    return [Table("The prior, as fitted", columns, [Group(rows)])]


def _share(share: float) -> str:
    return f"{100 * share:.0f} %"


def _accuracy_section(found: Estimate) -> Section:
    """Compare measured poses with those that the models calculate from the readings."""
    before, after = found.before, found.after
    tables = [*_closure_table(found), *_expected_table(found), *_budget_table(found)]
    if before is None or after is None:
        text = (
            "No end-effector error: at no pose that was measured in full are there readings of all "
            "legs that both the nominal and the calibrated mechanism can take."
        )
        return Section("accuracy", "Errors", [text], tables)
    paragraph = (
        "The error is the distance between the measured pose and the one that the nominal (before) "
        "or the calibrated (after) forward kinematics gives for the measured readings, both in the "
        "frames that were found. It contains the noise of the measurements. "
        f"{quoted('Expected')} is what the uncertainty of the identified parameters adds at these "
        "poses by itself, to first order. " + ALIGNED
    )
    errors = {"Before": before, "After": after}
    table = error_table(errors, found.expected_at_poses, found.cross_validation)
    sizes, where = error_figures(before, after)
    where = dataclasses.replace(where, details=True)
    parts: list[Table | Image] = [table, *tables, sizes, where]
    return Section("accuracy", "End-effector error", [paragraph], parts)


def _closure_table(found: Estimate) -> list[Table]:
    validation, unit = found.cross_validation, found.nominal.space.closure_unit
    if not math.isfinite(found.residual_rms):
        return []
    rows = [
        ("nominal", milli(found.nominal_residual_rms, unit), NONE),
        ("calibrated", milli(found.residual_rms, unit), milli(found.residual_max, unit)),
    ]
    if validation is not None:
        label = f"{validation.name} (poses that the fit did not see)"
        largest = milli(validation.residual_max, unit)
        rows.append((label, milli(validation.residual_rms, unit), largest))
    columns = ("Parameters", "Root mean square", "Maximum")
    return [Table("Closure residual of all legs", columns, [Group(rows)])]


def _expected_table(found: Estimate) -> list[Table]:
    """What covariance promises over the workspace."""
    expected = found.expected
    if expected is None:
        return []
    space = found.nominal.space
    share = percent(expected.confidence)
    own = {"position": place(expected.of), "orientation": "orientation"}
    rows = [
        (f"{own[kind]}{words}", milli(getattr(expected, f"{kind}{name}"), unit))
        for words, name in (
            (", root mean square, mean of such robots", ""),
            (f", root mean square, {share} of them within", "_bound"),
            (f" at every pose, {share} of them within", "_anywhere"),
        )
        for kind, unit in space.errors
    ]
    if space.moves:
        at = workspace_coordinates(found.nominal, expected.where)[0].tolist()
        named = zip(pose_coordinates(space), at, strict=True)
        where = ", ".join(f"{name} = {milli(value, unit)}" for (name, unit), value in named)
        rows.append(
            (f"{own['position']} where it is worst", f"{milli(expected.worst, 'm')} at ({where})")
        )
    caption = f"Errors to expect over the workspace ({plural(expected.poses, 'pose')}), first order"
    if expected.up_to_frames:
        caption += ", of base and platform frames that are aligned"
    if expected.up_to_turn and found.nominal.space.turns:
        caption += f"; {TURN_LEFT_OUT}"
    return [Table(caption, ("", "Error"), [Group(rows)])]


def _budget_table(found: Estimate) -> list[Table]:
    """Where the errors to expect come from, if more than observations was declared."""
    expected = found.expected
    if expected is None or not expected.budget:
        return []
    rows = []
    for line in expected.budget:
        factor, unit = on_paper(line.unit)
        declared = f"{significant(factor * line.deviation, 2)} {unit}".rstrip()
        errors = [milli(getattr(line, kind), of) for kind, of in found.nominal.space.errors]
        share = f"{100 * line.share:.1f}%"
        of_noise = line.source == "observations"
        name = "observations: noise and priors" if of_noise else line.source
        rows.append((name, NONE if of_noise else declared, *errors, share))
    named = {"position": place(expected.of)}
    kinds = [named.get(kind, kind).capitalize() for kind, _ in found.nominal.space.errors]
    columns = ("Source", "Declared", *kinds, "Share")
    caption = "What the errors to expect rest on: by itself, root mean square over the workspace"
    return [Table(caption, columns, [Group(rows)], brief=True)]


def _knowledge_section(found: Estimate) -> Section:
    """What the observations show, in words, and what they do not."""
    parts: list[Table | Image] = []
    paragraphs = ["The observations by themselves show every combination of the unknowns."]
    if found.unseen:
        paragraphs = [
            f"The observations by themselves do not show "
            f"{plural(len(found.unseen), 'combination')} of the unknowns. The fit, the residuals "
            "and the poses as measured do not depend on them; single parameters do."
        ]
        together = [_moving(found.names, each) for each in found.unseen_directions.T]
        for caption, column, said in (
            (
                "What no observation shows",
                "Unknowns that can move together, the strongest first",
                together,
            ),
            (
                "The same in numbers",
                "Combination, in tolerances (of frames, in mm and mrad)",
                found.unseen,
            ),
        ):
            rows = [(str(i), each) for i, each in enumerate(said, 1)]
            brief = said is together
            parts.append(Table(caption, ("", column), [Group(rows)], wordy=True, brief=brief))
    known = [
        (which, significant(each.deviation, 2), each.combination)
        for which, each in zip(("worst", "best"), found.directions, strict=False)
    ]
    columns = ("Known", "Deviation, in tolerances", "Combination, in tolerances")
    parts.append(Table("Combinations known worst and best", columns, [Group(known)], wordy=True))
    rows = [(", ".join(each.unknowns), fixed(each.correlation, 3)) for each in found.correlations]
    caption = "Unknowns that are told apart worst"
    parts.append(Table(caption, ("Unknowns", "Correlation"), [Group(rows)], wordy=True))
    return Section("knowledge", "What the observations show", paragraphs, parts)


def _moving(names: Sequence[str], direction: Array) -> str:
    """Name the unknowns of a direction, those of several legs as one: ``base.z, base_radius``."""
    weights: dict[str, float] = {}
    legs: dict[str, list[str]] = {}
    for name, value in zip(names, direction.tolist(), strict=True):
        block, _, own = name.rpartition(".")
        if value**2 < _NAMED_SHARE:
            continue
        key = own if block.startswith("leg") or not block else name
        weights[key] = weights.get(key, 0.0) + value**2
        if block.startswith("leg"):
            legs.setdefault(key, []).append(block.replace("leg", ""))
    told = [
        f"{key} of leg{'s' * (len(legs[key]) > 1)} {', '.join(legs[key])}" if key in legs else key
        for key in sorted(weights, key=lambda key: -weights[key])
    ]
    return "; ".join(told)


def _pose_section(found: Estimate) -> Section:
    poses, errors, unit = found.latent_poses, found.reading_errors, found.nominal.reading_unit
    known = np.asarray(np.isfinite(poses).all(axis=1))
    rows = [
        (f"leg {leg}", milli(rms(own[np.isfinite(own)]), unit))
        for leg, own in enumerate(errors.T, 1)
    ]
    parts: list[Table | Image] = [
        Table("Estimated errors of the readings", ("", "Root mean square"), [Group(rows)])
    ]
    if known.any():
        sets, of = [], found.measurements.leg_sets
        if (of >= 0).any():
            sets = [poses[(of == leg) & known] for leg in range(len(found.nominal.legs))]
        parts.append(
            Image(
                "latent_poses",
                "Scatter plots of the estimated poses.",
                "Where the platform was, by all observations together, in the robot's own frame.",
                plotted("poses", poses[known], sets, pose_space=found.nominal.pose_space),
            )
        )
    paragraph = (
        f"The true pose was estimated at {int(known.sum())} of {plural(len(known), 'row')} of the "
        "measurements."
    )
    return Section("poses", "Poses", [paragraph], [*parts, *_influence_table(found)])


def _influence_table(found: Estimate) -> list[Table]:
    """The poses that matter most."""
    influence = found.influence
    if influence is None or not np.isfinite(influence.moves).any():
        return []
    rows = []
    for pose in np.argsort(-np.nan_to_num(influence.moves), kind="stable")[:_INFLUENTIAL].tolist():
        if math.isfinite(influence.moves[pose]):
            name, by = influence.unknown[pose], significant(influence.by[pose], 2)
            figures = map(significant, (influence.residual[pose], influence.moves[pose]))
            number = str(found.measurements.row_numbers[pose])
            rows.append((number, *figures, f"{name} by {by}" if name else NONE))
    columns = ("Row", "Off the others' prediction", "Estimate moves by", "Single unknown")
    caption = "If a pose were left out, in standard deviations: the most influential"
    return [Table(caption, columns, [Group(rows)])]
