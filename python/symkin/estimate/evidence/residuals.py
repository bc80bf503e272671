# SPDX-License-Identifier: MIT
"""Tests of the residuals for what the model may lack.

At poses that were measured in full the closures of the legs are tested, whichever estimator found
the robot and whatever was held or known: what a change of any parameter could explain is taken out
first. Each kind of test alarms for one of 2000 sound robots (Bonferroni within the kind).
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from symkin import _core
from symkin.analysis.workspace import coordinate_names
from symkin.errors import SymkinError, named_legs
from symkin.estimate.changes import at_rest
from symkin.estimate.evidence.findings import Doubt
from symkin.estimate.fit import FALSE_ALARMS
from symkin.estimate.found import Found
from symkin.model.framing import unframed
from symkin.model.tolerances import noise_of
from symkin.values import Value, field, record

# Of a wider model, in words: by how much it helps at unseen poses; None if it does harm there.
Help = Callable[[str], str | None]
HARMFUL = "; allowing for it predicts poses that the fit did not see worse"

ALARMS = FALSE_ALARMS / 2  # of one kind of test of the residuals, for a sound robot
BETTER = 20.0  # of chi-square: causes that differ by less are not told apart


@record
class ResidualTest(Value):
    """A test of the residuals for something that the model does not have.

    Attributes
    ----------
    suspect : str
        "sensor_curvature", "sensor_eccentricity", "geometry", "order", "legs" or "estimators".
    legs : tuple of int
        The legs (from 0) whose closures were tested.
    term : str
        Of "geometry", the term of the pose that shows most, such as ``"y^2"``; else empty.
    statistic : float
        F, or for "order" and "legs" standard deviations from the mean of sound residuals.
    degrees_of_freedom : tuple of int
        Degrees of freedom of F.
    p_value : float
        Probability of one as large for a sound robot.
    limit : float
        Below which `p_value` alarms: 5e-4 over the number of tests of the suspect.
    size : float
        Root mean square of what the terms explain of the legs' closures, m or rad.
    closure_unit : {"m", "rad"}
        Of the closures.
    """

    suspect: str
    legs: tuple[int, ...] = field(number=True)
    term: str
    statistic: float
    degrees_of_freedom: tuple[int, int]
    p_value: float
    limit: float
    size: float = field(unit="rms_closure")
    closure_unit: str = field(private=True, default="m")

    @property
    def alarms(self) -> bool:
        """Whether it speaks against the model."""
        return self.p_value < self.limit


class Diagnosed(NamedTuple):
    """What the core says of closures, and the rows of the measurements that they are of."""

    rows: NDArray[np.intp]
    core: _core.Diagnosis


def diagnosed(found: Found) -> Diagnosed | None:
    """Test the closures of all poses that were measured in full; None where there are too few."""
    measured = at_rest(found)
    full = np.isfinite(measured.poses).all(axis=1)
    rows = np.flatnonzero(full & np.isfinite(measured.readings).any(axis=1))
    if len(rows) < 2 or (not found.converged and not found.legs):
        return None
    robot, poses = found.mechanism, measured.poses[rows]
    rejected = np.array(sorted({*(row for row, _ in found.rejected), *found.aside}), dtype=int)
    try:
        if not found.legs:
            poses = unframed(robot, poses)
        core = _core.diagnose(
            robot.straight,
            _core.MeasurementSet(
                np.ascontiguousarray(poses),
                found.mechanism.straightened(measured.readings)[rows],
                measured.leg_sets[rows].astype(np.int64),
            ),
            noise_of(found.noise),
            np.flatnonzero(np.isin(rows, rejected)).tolist(),
            found.nominal.reading_unit == "rad",
            ALARMS,
        )
    except SymkinError:
        return None
    return Diagnosed(rows, core)


def tests_of(found: Found, result: Diagnosed | None) -> tuple[ResidualTest, ...]:
    """Say what the tests found; nothing of sensors whose curvature was estimated."""
    if result is None:
        return ()
    space, legs = found.nominal.space, tuple(range(len(found.nominal.legs)))
    names = coordinate_names(found.nominal)
    terms = [*names, *(f"{name}^2" for name in names)]
    curved, taken = found.mechanism.curvature is not None, found.measurements
    own = (taken.pose_deviations, taken.reading_deviations)
    differs = found.noise.varies or any(each is not None for each in own)
    told = [
        test
        for test in result.core.tests
        if not (curved and test.suspect.name.startswith("sensor_"))
        # Of noise that is the same in all rows and directions.
        and not (differs and test.suspect.name in ("legs", "estimators"))
    ]
    counts: dict[_core.Suspect, int] = {}
    for test in told:
        counts[test.suspect] = counts.get(test.suspect, 0) + 1

    def legs_of(test: _core.ResidualTest) -> tuple[int, ...]:
        if test.leg < 0:
            return legs
        together = test.suspect == _core.Suspect.legs
        return (test.leg, test.other) if together else (test.leg,)

    return tuple(
        ResidualTest(
            suspect=test.suspect.name,
            legs=legs_of(test),
            term=terms[test.other] if test.suspect == _core.Suspect.geometry else "",
            statistic=test.statistic,
            degrees_of_freedom=(test.terms, test.spare),
            p_value=test.p_value,
            limit=ALARMS / counts[test.suspect],
            size=test.size,
            closure_unit=space.closure_unit,
        )
        for test in told
    )


_CODES = {
    "sensor_curvature": "sensor-curved",
    "sensor_eccentricity": "sensor-eccentric",
    "geometry": "depends-on-pose",
    "order": "neighbours-alike",
    "legs": "legs-together",
    "estimators": "estimators-disagree",
}
_SENSORS = {"sensor_curvature": "quadratic", "sensor_eccentricity": "eccentric"}


def doubts_of_residuals(
    found: Found, tests: Sequence[ResidualTest], help_of: Help
) -> Iterator[Doubt]:
    """Say what the residuals depend on."""
    for suspect, code in _CODES.items():
        alarms = [test for test in tests if test.suspect == suspect and test.alarms]
        if not alarms:
            continue
        worst = min(alarms, key=lambda test: (test.p_value, -abs(test.statistic)))
        single = sorted({test.legs[0] for test in alarms if len(test.legs) == 1})
        every = not single or len(single) == len(found.nominal.legs)
        legs = tuple(range(len(found.nominal.legs))) if every else tuple(single)
        options: dict[str, Any] = {}
        # A sensor that reads a length has no turns.
        if suspect in _SENSORS and (code == "sensor-curved" or found.nominal.reading_unit == "rad"):
            options = {"sensor": _SENSORS[suspect]}
        if suspect == "order" and worst.statistic < 0:
            code = "neighbours-opposite"
        if suspect == "legs":
            legs = tuple(sorted({leg for test in alarms for leg in test.legs}))
        size = max(test.size for test in alarms)
        helps = help_of(options["sensor"]) if options else ""
        if helps is None:
            options = {}
        figures = {
            "whose": "all legs" if every else named_legs(single),
            "amount": f" ({1e3 * size:.3g} m{worst.closure_unit} rms of the closures)",
            "terms": ", ".join(dict.fromkeys(test.term for test in alarms)),
            "pairs": ", ".join(f"{test.legs[0] + 1} and {test.legs[-1] + 1}" for test in alarms),
            "evidence": _evidence(worst) + (HARMFUL if helps is None else ""),
            "help": helps or "",
        }
        yield Doubt(code, legs, (), size, worst.p_value, figures, options)


def _evidence(worst: ResidualTest) -> str:
    p_value = f"p {worst.p_value:.1g}" if worst.p_value > 1e-300 else "p 0"
    if worst.suspect in ("order", "legs"):
        return f" ({worst.statistic:+.1f} standard deviations, {p_value})"
    terms, spare = worst.degrees_of_freedom
    return f" (F({terms}, {spare}) = {worst.statistic:.3g}, {p_value})"
