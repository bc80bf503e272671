# SPDX-License-Identifier: MIT
"""From measurements to an estimate: which estimator, of what, from what."""

from __future__ import annotations

import dataclasses
import os
from collections.abc import Mapping
from typing import Any, Unpack, cast

from typing_extensions import TypeVar

from symkin.analysis.probing import refuse_commanded
from symkin.analysis.seen import Seen, with_defaults
from symkin.data.measurements import Measurements
from symkin.data.reading import MeasuredSessions, as_measurements
from symkin.errors import SymkinError
from symkin.estimate.cross_validation import CrossValidation, cross_validation_of
from symkin.estimate.estimate import Estimate
from symkin.estimate.options import EstimateOptions, FleetOptions, IdentifyOptions
from symkin.estimate.survey import check_coordinates
from symkin.model.given import MechanismGiven, as_mechanism
from symkin.model.mechanism import Mechanism
from symkin.model.settings import IdentificationSettings, NoiseSettings, asked_or_set, unusual
from symkin.options import Estimator, checks

Nominal = TypeVar("Nominal", bound=Mechanism, default=Mechanism)


@checks()
def identify(
    mechanism: Nominal | str | os.PathLike[str],
    measurements: MeasuredSessions,
    estimator: Estimator | None = None,
    **options: Unpack[IdentifyOptions],
) -> Estimate[Nominal]:
    """Identify what is unknown of a robot from what was observed of it.

    By default that is every parameter of every leg, leg by leg from full poses. As soon as anything
    else is unknown or was observed, all is estimated together by maximum likelihood, with the true
    poses unknown too. Patterns are those of `fnmatch`: ``leg2.distal_length``, ``leg[12].*``,
    ``base.x``; without a dot they match a parameter in any leg (``sensor_offset``, ``*_length``),
    or a whole block (``leg2``).

    Parameters
    ----------
    mechanism : Mechanism
        The nominal one, from which the estimators start. Its `identification` has the defaults of
        `free` to `assume`.
    measurements : Measurements, Simulation, or what `read_measurements` reads
        Leg by leg, at least as many poses for a leg as it has parameters. A path, a DataFrame or a
        dict of columns is read first. Several of them in a list are one session each.
    estimator : {"implicit", "paper", "inverse", "joint"}, optional
        Whitened closures per leg; the paper's Gauss-Newton on g - psi per leg (Eqs. 15, 24-26); the
        same cost by Levenberg-Marquardt; all legs together, maximum likelihood. By default
        "implicit", and "joint" where the options or the measurements need it.
    poses : {"all", "own"}
        Which poses a leg uses: all at which it was read, or those of its own set (the paper).
    loss : {"none", "robust", "huber", "cauchy", "tukey"}
        Robust loss; refused where a single pose decides too much for one.
    loss_scale : float, optional
        Where the loss bends, in standard deviations and times the root of the number of conditions
        of a pose; by default where it keeps 95% efficiency on normal residuals (1.345, 2.385 and
        4.685 for one condition).
    noise : NoiseSettings or "estimate", optional
        Of the measurements, by default the mechanism's; or estimated with the unknowns.
    max_iterations : int
        Of each solve.
    free : sequence of str, optional
        Patterns of what is unknown; by default all parameters of all legs.
    fixed : sequence of str, optional
        Patterns of what is not, whatever else says so.
    shared : sequence of str, optional
        Patterns of parameters that differ from the drawing together, in all legs that the pattern
        matches: by the same amount, mirror images by the opposite where a mirror does so.
    tie : sequence of str, optional
        Equations of the legs' parameters: ``leg1.distal_length = leg2.distal_length``, with factors
        and sums (``leg1.a + leg1.b = 0.4 m``), or ``distal_length by role`` for what a symmetry
        carries onto each other. Parameters that are equal, or multiples, are one
        draw of the workshop, with one prior; of a sum that was measured all keep theirs. Behind it
        ``, one draw`` or ``, measured`` says which, and ``within 10 um`` that it holds nearly.
    prior : "tolerances", "fitted", or mapping of str to float or str, optional
        Standard deviations about the drawing: the tolerances of everything unknown that has one;
        the same times a scale, and with a share that legs have in common, both as the measurements
        say, see `FittedPrior`; or one for each pattern, in SI units or as an expression
        (``"0.1 mm"``).
    frames : sequence of {"base", "target", "points", "anchors", "plane"}, optional
        What is unknown of the frames, see `Frames`: the base in the frame of the measuring device,
        the target on the platform, further targets, fixed points, the plane that a probe touches.
        Where heights are all that was measured of poses, and neither `free` nor `frames` is given,
        the plane; the tolerances are priors then, and count for what is held. Of a platform that
        never turns some rows may have x and y instead, of marks on a piece, in a frame of the
        ruler's own.
    sensor : {"linear", "quadratic", "eccentric"}, optional
        What else is unknown of the sensors: their curvature, or an error of one period a turn.
    gauge : {"prior", "nominal", "datum"}, optional
        How combinations that no observation shows are settled: by the tolerances as priors; by the
        solution nearest to the drawing, in tolerances; by holding as few parameters as will do.
    loss_per : {"pose", "reading"}, optional
        Whether a blunder spoils a pose, or single observations are found and left out.
    assume : mapping of str to float or str, optional
        How far what is not estimated may be from what is assumed: a standard deviation for each
        pattern of what is held (``{"target": "0.5 mm", "sensor_gain": 1e-4}``), for ``"scale"``,
        that of the measuring device, for ``"bed"``, how far the rim of a probed bed may be above
        its middle, and for ``"sag"``, how much lower the outermost pose may be measured than the
        middle. ``"tolerances"`` says that of whatever is held of the legs, as so many times its
        tolerance; where heights are all that was measured of poses it is 1, unless it is given, and
        0 counts what is held as exact. Of what legs share, how far each may be from the others'.
        Deviations and expected errors contain it, see `Expected.budget`.
    drift : sequence of {"leg", "frame"}, optional
        What may drift with time, from end to end: what the sensor of each leg shows, where the
        base is to the measuring device. Time is the measurements' `times`, or their order; the
        robot is as in the middle.
    step : sequence of int or str, optional
        Rows, by their numbers, from which on what each sensor shows may be different; or
        ``"frame:63"``, where the base is. The robot is as after them.
    growth : bool, optional
        Whether all lengths may grow alike: with the measurements' `temperatures`, about their
        mean, or else with time.
    backlash : bool, optional
        Whether each leg may come to rest elsewhere from above than from below: by the measurements'
        `approaches`, or the readings before.
    sessions : sequence of {"offsets", "frames", "noise"}, optional
        What every session of the measurements has of its own: the offsets of the sensors and where
        the base is to the measuring device, as so much more than in the last session, as in which
        the robot is; and its noise, as so many times the declared one, `Estimate.session_noise`.
    clock_offset : bool, optional
        Whether the device may see the robot where it was some time before the readings, the same in
        all rows: by the measurements' `speeds` of the readings, or `velocities` of the target. For
        samples that were taken while it moved.
    bow : float or str, optional
        How far the rim of a probed bed may be above its middle, as a standard deviation, m or a
        text with a unit: it is then unknown, ``plane.bow``. The rim is where the farthest height
        was taken, unless `frames` of the mechanism say its radius.
    of : str, optional
        Coordinates that errors of the position in `Estimate.expected` are of, in the device's
        frame: "x", "y", "z", two of them ("xy"), or "height", that above the bed that a probe
        touches, over that bed. By default all.
    confidence : float
        Share of such robots that are within the bounds of `Estimate.expected`.

    Returns
    -------
    Estimate
        The same for all of these; `Estimate.legs` is empty where all was estimated together, with
        the true poses.

    Raises
    ------
    NotIdentifiableError
        For fewer poses than parameters, or for poses and readings that leave a combination of
        parameters without effect; names the combination.
    FailedFitError
        For an estimate that no mechanism can be, such as a negative length.
    SymkinError
        For measurements that do not fit the mechanism's shape, an unknown option or pattern, with
        the nearest valid one, or an estimator that cannot do what is asked for, with the reason.
    """
    mechanism = as_mechanism(mechanism)
    free = options.get("free")
    others = (options.get("shared"), options.get("frames"), options.get("sensor"))
    if free is not None and not len(free) and not any(others):
        raise SymkinError("free is empty, so that nothing is unknown; expected patterns")
    measurements = as_measurements(measurements, mechanism)
    measurements.require_table(mechanism.sensor_table)
    how, legs = _asked(mechanism, measurements, estimator, options)
    found = Estimate.of(mechanism, measurements, how, legs=legs)
    return cast("Estimate[Nominal]", found)  # what is made of a mechanism is of its class


def tried(
    mechanism: Mechanism, measurements: Measurements, **options: Unpack[IdentifyOptions]
) -> Estimate[Mechanism]:
    """Identify as the mechanism's file says; where that fails, it is not looked for why.

    For one of many trials, of which that would take most of the time.
    """
    how, legs = _asked(mechanism, measurements, None, options)
    return Estimate.of(mechanism, measurements, how, legs=legs, explain=False)


def _asked(
    mechanism: Mechanism,
    measurements: Measurements,
    estimator: Estimator | None,
    options: IdentifyOptions,
) -> tuple[EstimateOptions, bool]:
    """What is asked for by the arguments, the file and what was measured; whether leg by leg."""
    wanted, how = wanted_of(mechanism, options)
    check_coordinates(mechanism, wanted.get("of"))
    seen = Seen.of(measurements)
    if seen.marked:
        refuse_commanded(mechanism, measurements)
    wanted = with_defaults(wanted, mechanism, seen)
    reason = why_together(mechanism, wanted, how["noise"])
    if not reason and mechanism.frames is not None:
        reason = "the mechanism has frames, in which the poses are measured"
    reason = reason or measurements.incomplete_because
    return estimating(estimator, reason, wanted, how), not reason


def wanted_of(mechanism: Mechanism, options: FleetOptions) -> tuple[dict[str, Any], dict[str, Any]]:
    """What is unknown, by the arguments or the file, and how it is estimated."""
    names = [each.name for each in dataclasses.fields(IdentificationSettings)]
    asked = {name: options.get(name) for name in names}
    wanted = asked_or_set(asked, mechanism.identification)
    how = {name: value for name, value in options.items() if name not in asked}
    return wanted, how | {"noise": wanted.pop("noise", None)}


def estimating(
    estimator: Estimator | None, reason: str, wanted: Mapping[str, Any], how: Mapping[str, Any]
) -> EstimateOptions:
    """Options leg by leg or, for a reason that an estimator may be told, for all together."""
    if not reason:
        return EstimateOptions(estimator or "implicit", **how)
    if estimator not in (None, "joint"):
        raise SymkinError(
            f'the estimator "{estimator}" looks at each leg by itself, from full poses in the '
            f'robot\'s own frame; expected "joint" here, since {reason}'
        )
    return EstimateOptions("joint", **how, **wanted)


def identify_legs(
    mechanism: Nominal, measurements: Measurements, estimator: Estimator, **options: Any
) -> Estimate[Nominal]:
    """Identify every parameter of every leg from full poses in the robot's own frame.

    Whatever the mechanism says of frames and unknowns, which simulated protocols do not have.
    """
    how = EstimateOptions(estimator, **options)
    return cast("Estimate[Nominal]", Estimate.of(mechanism, measurements, how, legs=True))


def why_together(
    mechanism: Mechanism, wanted: Mapping[str, Any], noise: NoiseSettings | str | None
) -> str:
    """Why the legs cannot be identified one by one, whatever was measured; empty if they can."""
    if mechanism.not_leg_by_leg:
        return mechanism.not_leg_by_leg
    further = unusual(wanted)
    if further:
        return f"{' and '.join(further)} {'was' if len(further) == 1 else 'were'} given"
    if isinstance(noise, str):
        return "the noise is to be estimated"
    if (noise or mechanism.noise).along is not None:
        return "the noise differs along the device's direction"
    if (noise or mechanism.noise).per_metre:
        return "the noise grows with the distance from the device"
    return ""


@checks()
def cross_validate(
    mechanism: MechanismGiven,
    measurements: MeasuredSessions,
    folds: int = 5,
    seed: int = 1,
    estimator: Estimator | None = None,
    *,
    blocks: bool = False,
    **options: Unpack[IdentifyOptions],
) -> CrossValidation:
    """Predict each part of the measurements from an identification on the others.

    Parameters
    ----------
    mechanism, measurements, estimator
        As for `identify`, and so are the other `options`. With poses "own", each leg's set is dealt
        by itself, and a leg is predicted at those poses alone.
    folds : int
        Number of parts, from 2 to the number of poses.
    seed : int
        Of the random assignment of poses to parts.
    blocks : bool
        Parts are blocks of consecutive poses. Neighbours are often measured at similar places and
        at similar times, so that random parts hide what drifts and what depends on the place.

    Raises
    ------
    SymkinError
        For an impossible number of folds, or too few poses left in one.
    """
    mechanism = as_mechanism(mechanism)
    measurements = as_measurements(measurements, mechanism)
    how, legs = _asked(mechanism, measurements, estimator, options)
    return cross_validation_of(mechanism, measurements, folds, seed, how, blocks=blocks, legs=legs)
