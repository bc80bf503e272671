# SPDX-License-Identifier: MIT
"""Why a robot may have failed that keeps its tolerance: rows that are not what they are taken for.

Rows of another robot, of another mechanism, or with a mistake in them fail as surely as a robot
that is worn. A calibration of the drawing by these rows alone tells them apart.
"""

from __future__ import annotations

import math

import numpy as np

from symkin.acceptance.certificate import Judged
from symkin.acceptance.limits import limits_of_rms
from symkin.acceptance.tested import Tested
from symkin.data.measurements import Measurements
from symkin.errors import FailedFitError, SymkinError, few
from symkin.estimate.estimate import Estimate
from symkin.estimate.evidence.findings import Doubt
from symkin.estimate.identification import identify
from symkin.model.mechanism import Mechanism
from symkin.present import asker

_WORSE = 1.1  # times the error of the drawing: no longer that of a calibration which helps little
_NAMED = 5
_UNLIKE = ("residuals-large", "far-from-drawing", "out-of-reach")


def why_it_failed(
    found: Estimate | None,
    model: Mechanism,
    table: Measurements,
    tested: Tested,
    judged: Judged,
    fitted: tuple[str, ...],
    of: str | None,
) -> list[str]:
    """What speaks against the rows rather than against the robot, in sentences.

    Of rows to which these frames were `fitted` already.
    """
    anew = "" if fitted else _set_up_anew(tested, judged)
    if anew:
        return [anew]
    unlike, cause = _identified(found, model, table, fitted)
    if cause:
        return [cause]
    if unlike:
        return [
            f"no robot like the drawing of {model.name} has such rows: are they of another "
            "mechanism, or with a mistake in them?"
        ]
    error, promise = judged.limits, _promise(found, judged.kind, of)
    if not (error.lower > promise or error.corrected > _WORSE * judged.before > 0):
        return []
    unit = "rad" if judged.kind == "orientation" else "m"
    told = [f"the calibration promised {_milli(promise, unit)}"] * math.isfinite(promise)
    told += [f"the drawing alone comes to {_milli(judged.before, unit)}"] * (judged.before > 0)
    return [
        f"{', and '.join(told)} at these rows: they may be of another robot of this drawing, whose "
        "serial number tells, or it has changed since"
    ]


def likely_cause(found: Estimate | None, model: Mechanism, table: Measurements) -> list[str]:
    """The mistake in rows of which the model can take none, if one is plain."""
    cause = _identified(found, model, table, ())[1]
    return [cause] * bool(cause)


def rows_left_out(table: Measurements) -> list[str]:
    """Rows of which readings of some legs are missing: nothing is known of the robot there."""
    missing = np.isnan(table.readings)
    rows = table.row_numbers[missing.any(axis=1)]
    legs = [str(leg + 1) for leg in np.flatnonzero(missing.any(axis=0))]
    named = few(rows.tolist(), _NAMED)
    words = (
        f"{len(rows)} of {len(missing)} rows ({named}) lack readings of leg {', '.join(legs)}: "
        "nothing is known of the robot there, and the others may be those where it does well"
    )
    return [words] * bool(len(rows))


def _identified(
    found: Estimate | None, model: Mechanism, table: Measurements, fitted: tuple[str, ...]
) -> tuple[bool, str]:
    """Whether no robot like the drawing has these rows, and the mistake that they speak of."""
    drawing = model if found is None else found.nominal
    known = () if found is None else found.options.frames or ()
    frames = (*known, *(each for each in fitted if each not in known)) or None
    causes: list[Doubt] = []
    try:
        again = identify(drawing, table, prior="tolerances", frames=frames)
        unlike = any(each.code in _UNLIKE for each in again.doubts)
        causes = [each for each in again.doubts if each.is_cause]
    except SymkinError as error:  # as of few rows, and where no tolerance is declared
        unlike = isinstance(error, FailedFitError)
        causes = [error.likely_cause] if error.likely_cause else []
    if not causes:
        return unlike, ""
    return unlike, f"by these rows alone, the likely cause is: {causes[0].words}"


def _set_up_anew(tested: Tested, judged: Judged) -> str:
    """That the error is of the device's frame, if it is kept in another one."""
    if judged.kind != "position":
        return ""
    try:
        moved, fitted = tested.with_own_base()
        errors, own = moved.errors_of("position"), moved.uncertainty("position")
        known = own[np.isfinite(own).all(axis=1)]
        limits = limits_of_rms(errors, known, judged.limits.tolerance, fitted=fitted)
    except SymkinError:  # as of few rows
        return ""
    if limits.verdict == "fail":
        return ""
    option = 'frames=["base"]' if asker() == "python" else "--frames base"
    return (
        f"with the device's frame fitted to these rows the error is {_milli(limits.corrected, 'm')}"
        f": was it set up anew since the calibration? Then {option}"
    )


def _promise(found: Estimate | None, kind: str, of: str | None) -> float:
    """What the calibration had 95% of such robots keep; infinite if that is not known."""
    expected = None if found is None or not found.converged else found.expected
    if expected is not None and kind == "position" and expected.of != of:
        return math.inf
    bound = math.inf if expected is None else float(getattr(expected, f"{kind}_bound"))
    return bound if math.isfinite(bound) else math.inf


def _milli(value: float, unit: str) -> str:
    return f"{1e3 * value:.3g} m{unit}"
