# SPDX-License-Identifier: MIT
"""What was identified where anything may be unknown and anything was observed."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Iterator, Sequence

import numpy as np
from numpy.typing import NDArray

from symkin.estimate.doubts import blunders_of
from symkin.estimate.joint import JointIdentification
from symkin.estimate.problem import KINDS
from symkin.estimate.unknowns import Unknown
from symkin.present import Group, Headline, Image, Page, Section, Table
from symkin.show.evaluation import before_and_after, error_table, heights_headlines, heights_section
from symkin.show.identification import EXPLAINED, SCALED_UP, closure_headline, judgement, next_step
from symkin.show.images import plotted
from symkin.show.mechanism import mechanism_section
from symkin.show.wording import (
    NONE,
    chain_subtitle,
    decimals_of,
    fixed,
    left_by_priors,
    milli,
    plural,
    quoted,
    significant,
    sources,
)

_WORST_ROWS = 8
_WIDER = {
    "quadratic": "sensors that bend",
    "eccentric": "sensors that err once a turn",
    "held": "nothing held or shared",
    "frames": "frames of device and target, the drawing within its tolerances",
}
_CORRELATED = 10
_NAMED_SHARE = 1e-3  # of a direction's square


def joint_page(found: JointIdentification) -> Page:
    """Tell an identification of whatever was unknown."""
    sections = [
        _parameter_section(found),
        _observation_section(found),
        *_accuracy_section(found),
        *heights_section(found.heights),
        _knowledge_section(found),
        _pose_section(found),
        mechanism_section(found.nominal, found.latent_poses[_known(found)]),
    ]
    return dataclasses.replace(joint_summary(found), sections=sections)


def joint_summary(found: JointIdentification) -> Page:
    """Tell the answer, and whether to trust it."""
    nominal = found.nominal
    verdict, words = judgement(found)
    if found.trustworthy and found.heights is None:
        words += _known_before(found)
    step = next_step(
        found, "fix what is known, or give priors.", "observations are", "on poses measured anew."
    )
    if found.trustworthy and found.heights is not None:
        step = "let the controller use the calibrated mechanism, print, and measure the print."
    return Page(
        title=f"{nominal.name}: identification from what was observed",
        subtitle=chain_subtitle(nominal),
        headlines=list(_headlines(found)),
        verdict=verdict,
        judgement=words,
        doubts=found.doubts if found.converged else (),
        notes=found.notes,
        paragraphs=_done(found),
        next_step=step,
        inputs=sources(nominal.source, found.measurements.source),
    )


def _known_before(found: JointIdentification) -> str:
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


def _known(found: JointIdentification) -> NDArray[np.bool_]:
    return np.asarray(np.isfinite(found.latent_poses).all(axis=1))


def _done(found: JointIdentification) -> list[str]:
    shared = sum(each.status == "shared" for each in found.unknowns)
    held = sum(each.status.partition(",")[0] == "held" for each in found.unknowns)
    parts = [
        f"{plural(len(found.names), 'unknown')} of the robot as it was measured "
        f"{'was' if len(found.names) == 1 else 'were'} estimated together by maximum likelihood, "
        "with the true poses unknown as well"
    ]
    if shared:
        parts.append(f"{plural(shared, 'parameter')} of the legs move as one with others")
    if held:
        parts.append(f"{plural(held, 'parameter')} {'is' if held == 1 else 'are'} held")
    words = "; ".join(parts) + f". What was observed: {_observed(found)}."
    return [words, _degrees(found)]


def _observed(found: JointIdentification) -> str:
    counts = np.bincount(found.rows.kind, minlength=len(KINDS))
    coordinates = {"pose": "of poses", "points": "of points"}
    coordinates["reported pose"] = "that a controller reported"
    told = []
    for kind, number in zip(KINDS, counts.tolist(), strict=True):
        what = plural(number, "coordinate" if kind in coordinates else kind.removesuffix("s"))
        told += [f"{what} {coordinates.get(kind, '')}".rstrip()] * bool(number)
    return ", ".join(told) + f", at {plural(len(found.measurements.poses), 'pose')}"


def _degrees(found: JointIdentification) -> str:
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


def _headlines(found: JointIdentification) -> Iterator[Headline]:
    if found.degrees_of_freedom > 0:
        share = found.chi_square / found.degrees_of_freedom
        low, high = (each / found.degrees_of_freedom for each in (found.least, found.limit))
        remark = f"{significant(low)} to {significant(high)} if noise and model are as declared"
        if found.options.noise == "estimate":
            remark = "by construction, since the noise was estimated"
        yield "Chi-square per degree of freedom", significant(share), remark
    if found.heights is not None:
        yield from heights_headlines(found.heights)
        return
    before, after = found.before, found.after
    if math.isfinite(found.residual_rms):
        yield closure_headline(found)
    if before is None or after is None:
        return
    if before.aligned is not None and after.aligned is not None:
        for label, value, remark in before_and_after(before.aligned, after.aligned, after):
            yield f"{label}, frames aligned", value, remark
    else:
        yield from before_and_after(before, after, after)


def _parameter_section(found: JointIdentification) -> Section:
    origin = SCALED_UP if found.unexplained else EXPLAINED
    if found.options.noise == "estimate":
        origin = "from the estimated noise"
    paragraphs = [f"Standard deviations follow {origin}."]
    if found.gauge:
        paragraphs.append(
            f"They depend on how what the observations do not show was settled: {found.gauge}."
        )
    groups = []
    for block in dict.fromkeys(each.name.partition(".")[0] for each in found.unknowns):
        rows = [_row(each) for each in found.unknowns if each.name.partition(".")[0] == block]
        groups.append(Group(rows, _title(block)))
    columns = ["Name", "Unit", "Nominal", "Value", "Standard deviation", "Over tolerance"]
    columns += ["Change, in tolerances", "Status"]
    table = Table("What is unknown, and what was held", columns, groups, brief=True)
    return Section("identification", "Unknowns", paragraphs, [table, *_noise_table(found)])


def _title(block: str) -> str:
    titles = {
        "base": "Base, in the frame of the measuring device",
        "target": "Target, in the platform's frame",
        "plane": "Plane, in the frame of the base",
    }
    for start in ("leg", "point", "anchor"):
        if block.startswith(start):
            return f"{start.capitalize()} {block.removeprefix(start)}"
    return titles[block]


def _row(each: Unknown) -> list[str]:
    decimals = decimals_of(each.deviation)
    over = each.deviation / each.tolerance if each.tolerance else float("nan")
    return [
        each.name.partition(".")[2],
        each.unit,
        fixed(each.nominal, decimals),
        fixed(each.value, decimals),
        significant(each.deviation, 2),
        significant(over, 2),
        fixed(each.change_in_tolerances, 2),
        each.status,
    ]


def _noise_table(found: JointIdentification) -> list[Table]:
    if found.options.noise != "estimate":
        return []
    declared, noise = found.nominal.noise, found.noise
    unit = found.nominal.reading_unit
    rows = [
        (name, milli(getattr(declared, name), of), milli(getattr(noise, name), of))
        for name, of in (*found.nominal.space.errors, ("reading", unit))
    ]
    columns = ("Noise of", "Declared", "Estimated")
    return [Table("Standard deviations of the noise", columns, [Group(rows)], brief=True)]


def _observation_section(found: JointIdentification) -> Section:
    paragraph = (
        f"{quoted('t')} is an estimated error over what it would vary by if the observation was "
        "sound: standard normal. The error if alone wrong is what the other observations say that "
        "this one is off by."
    )
    figure = Image(
        "t_values",
        "Estimated errors of all observations in their standard deviations, row by row.",
        "All observations against what the others say, in standard deviations. The lines are "
        "where one of 1000 sound robots has any.",
        plotted("t_values", found),
    )
    parts = [_kind_table(found), _worst_rows(found), *_corrections(found), *_wider_models(found)]
    return Section("observations", "Observations", [paragraph], [*parts, *_models(found), figure])


def _models(found: JointIdentification) -> list[Table]:
    """Which of noise, sensors, frames and geometry explains how much."""
    words = {
        "identified": "as identified",
        "noise": f"noise {significant(found.spread)} times as large as declared",
        **_WIDER,
        "frames alone": "frames alone, the geometry as drawn",
    }
    rows = [
        (
            words[each.what],
            str(each.unknowns),
            f"{significant(each.chi_square, 4)} / {each.degrees_of_freedom}",
            milli(each.unseen_rms, "m"),
        )
        for each in found.models
    ]
    columns = ("Model", "Unknowns", "Chi-square / degrees of freedom", "Closures, unseen poses")
    return [Table("What explains the residuals", columns, [Group(rows)], brief=True)] * bool(rows)


def _wider_models(found: JointIdentification) -> list[Table]:
    """What else was tried, whether it explains more or not."""
    rows = [
        (
            _WIDER[each.what],
            f"F({each.terms}, {each.spare}) = {significant(each.statistic)}",
            f"{each.p_value:.2g}",
            f"{each.limit:.2g}",
            "explains more" if each.alarms else "as chance has it",
        )
        for each in found.alternatives
    ]
    columns = ("Also unknown", "Statistic", "Probability", "Alarm below", "")
    caption = "Wider models of the same observations"
    return [Table(caption, columns, [Group(rows)])] if rows else []


def _corrections(found: JointIdentification) -> list[Table]:
    """Mistakes that were tried since something speaks against the estimate."""
    told = [each for each in found.hypotheses if each.degrees_of_freedom > 0][:_WORST_ROWS]
    rows = [
        (
            each.what or "none: as it is stated",
            significant(each.chi_square, 4),
            str(each.degrees_of_freedom),
            "proposed" if each.proposed else "",
        )
        for each in told
    ]
    columns = ("Mistake", "Chi-square", "Degrees of freedom", "")
    caption = "Mistakes that were corrected and refitted, with the tolerances as priors"
    return [Table(caption, columns, [Group(rows)], wordy=True)] if rows else []


def _kind_table(found: JointIdentification) -> Table:
    rows, space, unit = found.rows, found.nominal.pose_space, found.nominal.reading_unit
    told, validation = [], found.cross_validation
    units = np.array([rows.unit(row, space, unit) for row in range(len(rows.pose))], dtype=object)
    for kind, name in enumerate(KINDS):
        for of in dict.fromkeys(units[rows.kind == kind]):
            own = (rows.kind == kind) & (units == of)
            t = rows.t[own & np.isfinite(rows.t)]
            row = [f"{name}, {of}", str(int(own.sum())), milli(_rms(rows.residual[own]), of)]
            row += [significant(_rms(t)), significant(np.abs(t).max() if len(t) else math.nan)]
            if validation is not None:
                key = f"{name.replace(' ', '_')}_{of}"
                row.append(milli(validation.observed_rms.get(key, math.nan), of))
            told.append(row)
    columns = ["Observations", "Number", "Estimated error, rms", "t, rms", "t, largest"]
    columns += [] if validation is None else ["Predicted unseen within"]
    return Table("What was observed, and how it fits", columns, [Group(told)], brief=True)


def _worst_rows(found: JointIdentification) -> Table:
    rows, space, unit = found.rows, found.nominal.pose_space, found.nominal.reading_unit
    blunders = {each.row for each in blunders_of(found)}
    size = np.abs(np.nan_to_num(rows.t))
    told = []
    for row in np.argsort(-size, kind="stable")[:_WORST_ROWS].tolist():
        if size[row] == 0:
            continue
        number = str(found.measurements.row_numbers[rows.pose[row]])
        error = milli(rows.blunder[row], rows.unit(row, space, unit))
        said = "does not fit" if row in blunders else "as noise has it"
        told.append([number, rows.what(row, space), fixed(rows.t[row], 1), error, said])
    columns = ("Row", "Observation", "t", "Error if alone wrong", "")
    return Table("Observations that fit worst", columns, [Group(told)])


def _accuracy_section(found: JointIdentification) -> list[Section]:
    before, after = found.before, found.after
    expected = _expected_table(found)
    if before is None or after is None:
        paragraph = "What the uncertain unknowns alone lead to expect at given readings."
        return [Section("accuracy", "End-effector error", [paragraph], expected)] * bool(expected)
    table = error_table({"Before": before, "After": after}, None, found.cross_validation)
    paragraph = (
        "At poses that were measured in full, the distance between the measured pose and the one "
        "that the forward kinematics gives for the readings, with the nominal and with the "
        "calibrated mechanism, both in the frames that were found."
    )
    return [Section("accuracy", "End-effector error", [paragraph], [table, *expected])]


def _expected_table(found: JointIdentification) -> list[Table]:
    """What covariance promises over the workspace."""
    expected = found.expected
    if expected is None:
        return []
    where = ", ".join(significant(value) for value in expected.where)
    rows = [
        ("position, root mean square", milli(expected.position, "m")),
        ("orientation, root mean square", milli(expected.orientation, "rad")),
        ("position where it is worst", f"{milli(expected.worst, 'm')} at ({where})"),
    ]
    caption = f"Errors to expect over the workspace ({plural(expected.poses, 'pose')}), first order"
    return [Table(caption, ("", "Error"), [Group(rows)], brief=True)]


def _knowledge_section(found: JointIdentification) -> Section:
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
        rows = [(str(i), each) for i, each in enumerate(together, 1)]
        columns: tuple[str, ...] = ("", "Unknowns that can move together, the strongest first")
        parts.append(
            Table("What no observation shows", columns, [Group(rows)], wordy=True, brief=True)
        )
        rows = [(str(i), each) for i, each in enumerate(found.unseen, 1)]
        columns = ("", "Combination, in tolerances (of frames, in mm and mrad)")
        parts.append(Table("The same in numbers", columns, [Group(rows)], wordy=True))
    parts += [_direction_table(found), _correlation_table(found)]
    return Section("knowledge", "What the observations show", paragraphs, parts)


def _moving(names: Sequence[str], direction: NDArray[np.float64]) -> str:
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


def _direction_table(found: JointIdentification) -> Table:
    """The combinations that are known best and worst, over what was known before."""
    rows = [
        (which, significant(each.deviation, 2), each.combination)
        for which, each in zip(("worst", "best"), found.directions, strict=False)
    ]
    columns = ("Known", "Deviation, in tolerances", "Combination, in tolerances")
    return Table("Combinations known worst and best", columns, [Group(rows)], wordy=True)


def _correlation_table(found: JointIdentification) -> Table:
    rows = [(", ".join(each.unknowns), fixed(each.correlation, 3)) for each in found.correlations]
    columns = ("Unknowns", "Correlation")
    return Table("Unknowns that are told apart worst", columns, [Group(rows)], wordy=True)


def _rms(values: NDArray[np.float64]) -> float:
    return float(np.sqrt(np.mean(values**2))) if len(values) else math.nan


def _influence_table(found: JointIdentification) -> list[Table]:
    """The poses that matter most."""
    influence = found.influence
    if influence is None or not np.isfinite(influence.moves).any():
        return []
    rows = []
    for pose in np.argsort(-np.nan_to_num(influence.moves), kind="stable")[:_WORST_ROWS].tolist():
        if math.isfinite(influence.moves[pose]):
            name, by = influence.unknown[pose], significant(influence.by[pose], 2)
            figures = map(significant, (influence.residual[pose], influence.moves[pose]))
            number = str(found.measurements.row_numbers[pose])
            rows.append((number, *figures, f"{name} by {by}" if name else NONE))
    columns = ("Row", "Off the others' prediction", "Estimate moves by", "Single unknown")
    caption = "If a pose were left out, in standard deviations: the most influential"
    return [Table(caption, columns, [Group(rows)])]


def _pose_section(found: JointIdentification) -> Section:
    known = _known(found)
    errors = found.reading_errors
    unit = found.nominal.reading_unit
    rows = [
        (f"leg {leg}", milli(_rms(own[np.isfinite(own)]), unit))
        for leg, own in enumerate(errors.T, 1)
    ]
    parts: list[Table | Image] = [
        Table("Estimated errors of the readings", ("", "Root mean square"), [Group(rows)])
    ]
    if known.any():
        parts.append(
            Image(
                "latent_poses",
                "Scatter plots of the estimated poses.",
                "Where the platform was, by all observations together, in the robot's own frame.",
                plotted("poses", found.latent_poses[known], pose_space=found.nominal.pose_space),
            )
        )
    parts += _influence_table(found)
    paragraph = (
        f"The true pose was estimated at {int(known.sum())} of {plural(len(known), 'row')} of the "
        "measurements."
    )
    return Section("poses", "Latent poses", [paragraph], parts)
