# SPDX-License-Identifier: MIT
"""The answer, in plain words."""

from __future__ import annotations

from symkin.evaluation import AlignedErrors, Evaluation
from symkin.identification.cross_validation import CrossValidation
from symkin.identification.estimate import Identification
from symkin.measurements import Measurements
from symkin.mechanism import Mechanism
from symkin.observability import ExpectedAccuracy
from symkin.pipeline import ProtocolResult
from symkin.report.content import Page, Verdict
from symkin.report.wording import count, milli, plural, ratio, setting

Headline = tuple[str, str, str]  # label, value, remark

__all__ = ["identification_summary", "protocol_summary"]


def protocol_summary(result: ProtocolResult, expected: ExpectedAccuracy) -> Page:
    """Sum up a run of the protocol on a simulated robot."""
    nominal, identification = result.nominal, result.identification
    paragraphs = [_done(result), _achieved(result, expected)]
    return Page(
        title=f"{nominal.name}: identification of a simulated robot",
        subtitle=_subtitle(nominal),
        headlines=_figures(nominal, result.before, result.after, expected),
        verdict=_verdict(identification),
        judgement=_judgement(identification),
        doubts=identification.doubts,
        paragraphs=paragraphs,
    )


def identification_summary(
    nominal: Mechanism,
    measurements: Measurements,
    identification: Identification,
    before: Evaluation | None,
    after: Evaluation | None,
    residual_before: float,
    validation: CrossValidation | None,
) -> Page:
    """Sum up an identification from measurements."""
    source = f" ({measurements.source_name})" if measurements.source else ""
    done = (
        f"{plural(len(measurements.poses), 'measured pose')}{source} "
        f"{'was' if len(measurements.poses) == 1 else 'were'} used to identify the "
        f"{nominal.parameters.size} parameters of {plural(len(nominal.legs), 'leg')} with the "
        f"estimator {_quoted(identification.estimator)}."
    )
    closures = (residual_before, identification.residual_rms)
    remark = ratio(*closures)
    achieved = (
        f"The legs miss closing by {milli(closures[0], 'm')} (root mean square) with the nominal "
        f"parameters, and by {milli(closures[1], 'm')} with the identified ones."
    )
    if validation is not None:
        unseen = milli(validation.residual_rms, "m")
        remark += f"; {unseen} in cross-validation"
        achieved += (
            f" At poses that the identification did not see they miss by {unseen} "
            f"({validation.name})."
        )
    closure = _figure("Closure of the legs", "m", closures, remark)
    figures, texts = [closure], [done, achieved]
    if before is not None and after is not None:
        figures = [*_measured_figures(nominal, before, after), closure]
        missed = _missed(nominal, before, after, validation)
        texts = [done, missed, *_failures(before, after), achieved]
    return Page(
        title=f"{nominal.name}: identification from measurements",
        subtitle=_subtitle(nominal),
        headlines=figures,
        verdict=_verdict(identification),
        judgement=_judgement(identification),
        doubts=identification.doubts,
        paragraphs=texts,
    )


def _missed(
    nominal: Mechanism, before: Evaluation, after: Evaluation, validation: CrossValidation | None
) -> str:
    def missed(old: Evaluation | AlignedErrors, new: Evaluation | AlignedErrors) -> str:
        return (
            f"by {_errors(nominal, old)} (root mean square) with the nominal parameters, and by "
            f"{_errors(nominal, new)} with the identified ones"
        )

    text = f"The forward kinematics misses the measured poses {missed(before, after)}."
    if before.aligned is not None and after.aligned is not None:
        text = (
            "After the best constant motions of base frame and tool frame, which need no "
            "calibration of the legs, the forward kinematics misses the measured poses "
            f"{missed(before.aligned, after.aligned)}. As it is, it misses them "
            f"{missed(before, after)}."
        )
    if validation is not None and validation.evaluation is not None:
        text += (
            " Poses that the identification did not see are missed by "
            f"{_errors(nominal, validation.evaluation)}."
        )
    return text


def _done(result: ProtocolResult) -> str:
    nominal, tolerances = result.nominal, result.nominal.tolerances
    turns = nominal.pose_space != "point"
    noise = setting(1e3 * nominal.noise.position, "mm")
    noise += f" and {setting(1e3 * nominal.noise.orientation, 'mrad')}" if turns else ""
    return (
        f"A robot was simulated that differs from the drawing of {nominal.name} as its tolerances "
        f"allow (standard deviations {setting(1e3 * tolerances.length, 'mm')}, "
        f"{setting(1e3 * tolerances.angle, 'mrad')}, gains {setting(100 * tolerances.gain, '%')}). "
        f"From {plural(len(result.candidates.poses), 'candidate pose')}, "
        f"{count(int((~result.plan.spare).sum()))} were chosen and measured with a noise of "
        f"{noise}; from these the {nominal.parameters.size} parameters of its "
        f"{plural(len(nominal.legs), 'leg')} were identified with the estimator "
        f"{_quoted(result.identification.estimator)}."
    )


def _achieved(result: ProtocolResult, expected: ExpectedAccuracy) -> str:
    nominal, before, after = result.nominal, result.before, result.after
    foreseen = milli(expected.position, "m")
    if nominal.pose_space != "point":
        foreseen += f" and {milli(expected.orientation, 'rad')}"
    text = (
        f"A controller that believes the drawing misses the commanded poses by "
        f"{_errors(nominal, before)} (root mean square); one that uses the identified parameters "
        f"misses them by {_errors(nominal, after)}. Expected, from the uncertainty of the "
        f"parameters, were {foreseen}."
    )
    return " ".join([text, *_failures(before, after, expected)])


def _measured_figures(
    mechanism: Mechanism, before: Evaluation, after: Evaluation
) -> list[Headline]:
    """Errors of aligned frames, and beside them those as they are."""
    raw = _figures(mechanism, before, after)
    if before.aligned is None or after.aligned is None:
        return raw
    return [
        (f"{label}, frames aligned", value, f"{remark}; {as_it_is} without alignment")
        for (label, value, remark), (_, as_it_is, _) in zip(
            _figures(mechanism, before.aligned, after.aligned), raw, strict=True
        )
    ]


def _failures(
    before: Evaluation, after: Evaluation, expected: ExpectedAccuracy | None = None
) -> list[str]:
    """Say how many poses the errors leave out, if any."""
    figures: dict[str, Evaluation | ExpectedAccuracy] = {"before": before, "after": after}
    if expected is not None:
        figures["of those expected"] = expected
    if not any(each.failed for each in figures.values()):
        return []
    counts = [
        f"{count(each.failed)} of {count(each.evaluated + each.failed)} {name}"
        for name, each in figures.items()
    ]
    return [
        "Left out are poses that could not be calculated: "
        f"{', '.join(counts[:-1])} and {counts[-1]}."
    ]


def _figures(
    mechanism: Mechanism,
    before: Evaluation | AlignedErrors,
    after: Evaluation | AlignedErrors,
    expected: ExpectedAccuracy | None = None,
) -> list[Headline]:
    """Errors before and after, with what was to be expected where that can be compared."""
    kinds = [("position", "m"), ("orientation", "rad")]
    figures = []
    for kind, unit in kinds if mechanism.pose_space != "point" else kinds[:1]:
        old, new = (getattr(evaluation, f"{kind}_rms") for evaluation in (before, after))
        remark = ratio(old, new)
        if expected is not None:
            remark += f"; {milli(getattr(expected, kind), unit)} expected"
        figures.append(_figure(f"{kind.capitalize()} error", unit, (old, new), remark))
    return figures


def _figure(label: str, unit: str, values: tuple[float, float], remark: str) -> Headline:
    old, new = values
    arrow = "\N{RIGHTWARDS ARROW}"
    return (
        f"{label}, root mean square",
        f"{milli(old, unit)} {arrow} {milli(new, unit)}",
        remark,
    )


def _errors(mechanism: Mechanism, evaluation: Evaluation | AlignedErrors) -> str:
    position = milli(evaluation.position_rms, "m")
    if mechanism.pose_space == "point":
        return position
    return f"{position} and {milli(evaluation.orientation_rms, 'rad')}"


def _verdict(identification: Identification) -> Verdict:
    if not identification.converged:
        return "bad"
    return "doubtful" if identification.doubts else "good"


def _judgement(identification: Identification) -> str:
    if not identification.converged:
        failed = [
            f"leg {leg}" + (f" ({fit.failure})" if fit.failure else "")
            for leg, fit in enumerate(identification.legs, 1)
            if not fit.converged
        ]
        return f"Not converged: {', '.join(failed) or 'the joint estimate of all legs'}."
    if identification.doubts:
        return "Converged, with doubts."
    return "Converged; nothing speaks against the estimate."


def _subtitle(mechanism: Mechanism) -> str:
    return f"{plural(len(mechanism.legs), 'leg')}, chain {mechanism.chain}"


def _quoted(text: str) -> str:
    return f"\N{LEFT DOUBLE QUOTATION MARK}{text}\N{RIGHT DOUBLE QUOTATION MARK}"
