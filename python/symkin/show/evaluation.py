# SPDX-License-Identifier: MIT
"""Errors of end-effectors: of a model, of unseen poses, before and after; and of a printer."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence

import numpy as np

from symkin.analysis.evaluation import AlignedErrors, Evaluation
from symkin.analysis.promises import ExpectedAccuracy
from symkin.errors import few
from symkin.estimate.cross_validation import CrossValidation
from symkin.estimate.precision import Heights, in_words
from symkin.present import ErrorLine, Group, Headline, Image, Page, Section, Table, Verdict, page_of
from symkin.show.images import plotted
from symkin.show.wording import NONE, became, count, milli, percent, plural, ratio, significant

ALIGNED = (
    "A constant error of the base frame or of the tool frame can be taken out by measuring the "
    "frames, without any calibration of the legs. So the table says first what remains after the "
    "best alignment of both, fitted to these poses."
)
_WORST = 5
_NOISY = 1.2  # times the noise, which parameters that are known well add next to nothing to


@page_of.register(Evaluation)
def evaluation_page(evaluation: Evaluation) -> Page:
    """Tell the errors of a model."""
    name = f"{evaluation.name}: end-effector error" if evaluation.name else "End-effector error"
    parts: list[Table | Image] = [
        error_table({"Error": evaluation}),
        _map(evaluation),
        *_closure_table(evaluation),
        _worst(evaluation),
    ]
    return Page(
        title=f"{name} over {plural(evaluation.evaluated, 'pose')}",
        verdict=_verdict(evaluation),
        judgement=_judgement(evaluation),
        errors=_errors(evaluation),
        headlines=_bounds(evaluation),
        notes=[
            f"left out, since {why}: {plural(number, 'pose')}{which}"
            for number, why, which in (
                (evaluation.unread, "not all legs were read there", ""),
                (evaluation.partial, "they were measured in part", ""),
                (evaluation.failed, "the model cannot take them", _failed(evaluation)),
            )
            if number
        ]
        + list(evaluation.notes),
        paragraphs=_promised(evaluation),
        next_step=_next_step(evaluation),
        sections=[Section("accuracy", "End-effector error", [ALIGNED], parts)],
    )


def _failed(evaluation: Evaluation) -> str:
    """The rows of poses that failed, which may be mistyped."""
    rows = evaluation.row_numbers[np.isnan(evaluation.differences).all(axis=1)].tolist()
    return f" (row{'s' * (len(rows) > 1)} {few(rows, _WORST)})"


def _errors(evaluation: Evaluation) -> list[ErrorLine]:
    """The errors, and beside those that were measured what the instrument contributes."""
    aligned, noise = evaluation.aligned, evaluation.instrument or {}
    return [
        ErrorLine(
            kind,
            unit,
            after=getattr(evaluation, f"{kind}_rms"),
            aligned=None if aligned is None else getattr(aligned, f"{kind}_rms"),
            largest=getattr(evaluation, f"{kind}_max"),
            instrument=noise.get(kind),
        )
        for kind, unit in evaluation.kinds
    ]


def _bounds(evaluation: Evaluation) -> list[Headline]:
    """What the root mean square over all poses like these is within."""
    promise = evaluation.promise
    if not math.isfinite(promise.position_bound):
        return []
    return [
        (
            f"{kind.capitalize()} error, all poses like these",
            milli(getattr(promise, f"{kind}_bound"), unit),
            f"rms bound, {percent(promise.confidence)} sure",
        )
        for kind, unit in evaluation.kinds
    ]


def _judgement(evaluation: Evaluation) -> str:
    """What the errors are made of, as far as that can be told."""
    if _is_of_frames(evaluation):
        return "Most of the error is a constant motion of base or tool frame"
    if not evaluation.instrument:
        return ""
    own = _beyond_the_noise(evaluation)
    if not own:
        return "The errors are no larger than the declared noise of the instrument explains"
    told = " and ".join(
        f"{milli(own[kind], unit)} of the {kind} error"
        for kind, unit in evaluation.kinds
        if kind in own
    )
    return f"The declared noise does not explain about {told}"


def _verdict(evaluation: Evaluation) -> Verdict:
    instrument = evaluation.instrument
    if not instrument:
        return ""
    own = _beyond_the_noise(evaluation)
    if any(size > instrument[kind] for kind, size in own.items()):
        return "doubtful"
    # A calibrated robot errs a little, too: by how much, these poses cannot judge.
    return "" if own or _is_of_frames(evaluation) else "good"


def _beyond_the_noise(evaluation: Evaluation) -> dict[str, float]:
    """What the declared noise leaves of each kind of error, where that is more than chance."""
    instrument = evaluation.instrument or {}
    errors = {kind: getattr(evaluation, f"{kind}_rms") for kind in instrument}
    return {
        kind: math.sqrt(errors[kind] ** 2 - noise**2)
        for kind, noise in instrument.items()
        if errors[kind] > _NOISY * noise
    }


def _is_of_frames(evaluation: Evaluation) -> bool:
    """Whether most of the error is gone once the frames are aligned."""
    name = f"{evaluation.kinds[0][0]}_rms"
    aligned = evaluation.aligned
    return aligned is not None and getattr(aligned, name) < getattr(evaluation, name) / 2


def _promised(evaluation: Evaluation) -> list[str]:
    """What these poses say of others like them."""
    promise, kinds = evaluation.promise, evaluation.kinds
    if not math.isfinite(promise.position_bound):
        return []
    bounds = [milli(getattr(promise, f"{kind}_bound"), unit) for kind, unit in kinds]
    return [
        f"By {plural(evaluation.evaluated, 'pose')}, with {percent(promise.confidence)} "
        f"confidence: over all poses like these, which the model has not seen either, the error is "
        f"within {' and '.join(bounds)} (root mean square), and at {100 * promise.inside:.1f}% of "
        "them at least within the largest here."
    ]


@page_of.register(CrossValidation)
def cross_validation_page(validation: CrossValidation) -> Page:
    """Tell the errors at poses that the identification did not see."""
    evaluation = validation.evaluation
    headlines: list[Headline] = []
    if math.isfinite(validation.residual_rms):
        unit = validation.closure_unit
        most = f"at most {milli(validation.residual_max, unit)}"
        rms = milli(validation.residual_rms, unit)
        headlines.append(("Closure of the legs, rms", rms, most))
    for kind, value in validation.observed_rms.items():
        name, _, unit = kind.rpartition("_")
        label = f"{name.replace('_', ' ').capitalize()} from the others of the pose"
        headlines.append((label, milli(value, unit), "rms"))
    sections = []
    if evaluation is not None:
        headlines += [
            (f"{kind.capitalize()} error, rms", milli(value, unit), "")
            for kind, unit in evaluation.kinds
            for value in (getattr(evaluation, f"{kind}_rms"),)
        ]
        parts: list[Table | Image] = [
            error_table({"Error": evaluation}),
            _map(evaluation),
            _worst(evaluation),
        ]
        sections = [Section("accuracy", "Errors at unseen poses", [ALIGNED], parts)]
    return Page(
        title=f"{validation.name} over {plural(len(validation.residuals), 'pose')}",
        headlines=headlines,
        verdict="good" if validation.converged else "doubtful",
        judgement="" if validation.converged else "Not every identification of it converged.",
        sections=sections,
    )


def error_table(
    evaluations: Mapping[str, Evaluation],
    expected: ExpectedAccuracy | None = None,
    validation: CrossValidation | None = None,
) -> Table:
    """Errors with a column an evaluation: with frames aligned, as they are, and their means.

    Of two, the change gets a column; `expected` is that of the last one, and so is `validation`.
    """
    found = list(evaluations.values())
    first = found[0]
    aligned = [each.aligned for each in found if each.aligned is not None]
    spare = [""] * ((len(found) > 1) + (expected is not None))
    groups = []
    if len(aligned) == len(found):
        rows = _error_rows(first, aligned, "aligned ", spare)
        groups.append(Group(rows, "After the best alignment of the frames"))
    groups.append(Group(_error_rows(first, found, "", spare, expected), "As it is"))
    if validation is not None and validation.evaluation is not None:
        rows = _error_rows(first, [*found[:-1], validation.evaluation], "unseen ", spare)
        groups.append(Group(rows, f"As it is, {validation.name}"))
    means = []
    for index, difference in enumerate(first.difference_names):
        if not math.isfinite(first.means[index]):
            continue
        name, _, unit = difference.rpartition("_")
        means.append([f"mean {name}", *(milli(each.means[index], unit) for each in found), *spare])
    groups.append(Group(means, "Mean difference, as it is"))
    counted = [*found, *([expected] if expected else [])]
    change = [""] if len(found) > 1 else []
    poses = []
    for name in ("evaluated", "failed"):
        numbers = [count(getattr(each, name)) for each in counted]
        poses.append([name, *numbers[: len(found)], *change, *numbers[len(found) :]])
    groups.append(Group(poses, "Poses"))
    columns = ["", *evaluations, *(["Change"] if change else [])]
    columns += ["Expected after"] if expected else []
    return Table("End-effector error", columns, groups)


def _error_rows(
    kind_of: Evaluation,
    errors: Sequence[Evaluation | AlignedErrors],
    prefix: str,
    spare: Sequence[str],
    expected: ExpectedAccuracy | None = None,
) -> list[list[str]]:
    rows = []
    for kind, unit in kind_of.kinds:
        for figure, name in (("rms", "root mean square"), ("max", "maximum")):
            values = [getattr(each, f"{kind}_{figure}") for each in errors]
            cells = list(spare)
            if len(values) > 1:
                cells[0] = ratio(values[0], values[-1])
            if expected is not None:
                cells[-1] = milli(getattr(expected, kind), unit) if figure == "rms" else NONE
            rows.append(
                [f"{prefix}{kind}, {name}", *(milli(value, unit) for value in values), *cells]
            )
    return rows


def errors_in_words(kind_of: Evaluation, errors: Evaluation | AlignedErrors) -> str:
    """Root mean squares of position and orientation, of those that the platform has."""
    return " and ".join(milli(getattr(errors, f"{kind}_rms"), unit) for kind, unit in kind_of.kinds)


def left_out(figures: Mapping[str, Evaluation | ExpectedAccuracy]) -> list[str]:
    """Say how many poses the errors leave out, if any."""
    if not any(each.failed for each in figures.values()):
        return []
    *counts, last = (
        f"{count(each.failed)} of {count(each.evaluated + each.failed)} {name}"
        for name, each in figures.items()
    )
    return [f"Left out are poses that could not be calculated: {', '.join(counts)} and {last}."]


def error_figures(
    before: Evaluation, after: Evaluation, expected: ExpectedAccuracy | None = None
) -> list[Image]:
    """How large the errors are, and where."""
    (kind, _), *_ = after.kinds
    columns = " Columns are projections." if after.space.in_space else ""
    if after.pose_space == "planar":
        columns = " Columns are bands of the platform angle."
    return [
        Image(
            "error_histogram",
            "Histograms of the end-effector errors before and after, logarithmic scale.",
            "How large the errors are, before and after.",
            plotted("error_histogram", before, after, expected),
        ),
        Image(
            "error_map",
            f"Maps of the {kind} error over the workspace, before and after.",
            f"Where the {kind} errors are, before and after.{columns} Mind that each state has "
            "its own scale.",
            plotted("error_map", after.poses, before, after),
        ),
    ]


def _map(evaluation: Evaluation) -> Image:
    """Where the errors are."""
    (kind, _), *_ = evaluation.kinds
    return Image(
        "errors",
        f"Map of the {kind} error over the poses.",
        f"Where the {kind} errors are.",
        plotted("error_map", evaluation.poses, evaluation),
    )


def _closure_table(evaluation: Evaluation) -> list[Table]:
    if evaluation.closure_rms is None:
        return []
    rms, legs = evaluation.closure_rms
    values = {"all legs": rms, **{f"leg {leg}": each for leg, each in enumerate(legs.tolist(), 1)}}
    unit = evaluation.space.closure_unit
    rows = [[name, milli(value, unit)] for name, value in values.items() if not math.isnan(value)]
    columns = ("Closure of", "Root mean square")
    return [Table("How far the legs miss closing", columns, [Group(rows)])]


def _worst(evaluation: Evaluation) -> Table:
    """The poses with the largest errors."""
    errors = dict(zip(("m", "rad"), evaluation.errors, strict=True))
    kinds = evaluation.kinds
    (_, first), *_ = kinds
    order = np.argsort(-np.nan_to_num(errors[first], nan=-1), kind="stable")[:_WORST]
    rows = [
        [str(evaluation.row_numbers[row]), *(milli(errors[unit][row], unit) for _, unit in kinds)]
        for row in order
        if np.isfinite(errors[first][row])
    ]
    columns = ["Row", *(f"{kind.capitalize()} error" for kind, _ in kinds)]
    return Table("Largest errors", columns, [Group(rows)])


def _next_step(evaluation: Evaluation) -> str:
    return (
        "measure base and tool frame before you blame the legs" if _is_of_frames(evaluation) else ""
    )


def heights_headlines(heights: Heights) -> Iterator[Headline]:
    """Heights before and after, and the size of what is printed."""
    unseen = milli(heights.after, "m") if math.isfinite(heights.after) else "too few to say"
    remark = f"of a point from the others: {unseen}"
    yield "Height, rms", became(heights.before, heights.fitted, "m"), remark
    sizes = became(0.1 * heights.size_before, 0.1 * heights.size_after, "m")
    yield "100 mm printed, off by", sizes, "standard deviation"


def heights_section(heights: Heights | None) -> list[Section]:
    """What the heights show and what they do not, in words; none without heights."""
    if heights is None:
        return []
    paragraphs = [
        f"The heights that the nominal robot would have differ from those measured by "
        f"{milli(heights.before, 'm')} (root mean square, about the plane that fits best). The "
        f"identified one fits them to {milli(heights.fitted, 'm')}. {_predicted(heights)}",
        *heights.notes,
    ]
    rows = [
        (each.plainly, _with_share(each.common), _with_share(each.between), each.parameter)
        for each in heights.shown
    ]
    columns = ("", "All legs alike", "Between the legs", "Parameter")
    caption = "What the heights show (in brackets: left of the tolerance)"
    table = Table(caption, columns, [Group(rows)], wordy=True, brief=True)
    return [Section("heights", "Heights and the size of prints", paragraphs, [table])]


def _predicted(heights: Heights) -> str:
    if not math.isfinite(heights.after):
        return "There are too few points to say how well one that was not used is predicted."
    return (
        f"Each height is predicted by the other points to {milli(heights.after, 'm')}, with the "
        "noise of the probe."
    )


def _with_share(known: float) -> str:
    words = in_words(known)
    return words if words == "-" else f"{words} ({significant(100 * known, 2)} %)"
