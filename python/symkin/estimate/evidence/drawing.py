# SPDX-License-Identifier: MIT
"""An estimate against the drawing and its tolerances."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Iterator
from statistics import NormalDist
from typing import NamedTuple, TypeGuard

import numpy as np

from symkin import _core
from symkin.errors import SymkinError, few, unknowns_by_name
from symkin.estimate.conflict import LIMIT, DrawingConflict
from symkin.estimate.evidence.findings import Doubt, Note
from symkin.estimate.evidence.residuals import BETTER
from symkin.estimate.fit import FALSE_ALARMS
from symkin.estimate.found import Found
from symkin.estimate.parameters import Unknown
from symkin.estimate.precision import expected_over, promising
from symkin.estimate.solution import computed_from_drawing
from symkin.estimate.strain import strains_of
from symkin.model.chains import CURVATURE_TERMS
from symkin.model.poses import POSE_SPACES, cross_matrices, transforms
from symkin.model.tolerances import UNKNOWN, parameter_tolerances
from symkin.values import Array

_NAMED = 3
_LISTED = 6
_NONSENSE = 30.0  # times the noise: what residuals so large say of a robot is none of it
_MANY_TIMES = 10.0  # what is declared
_AS_WELL = 0.9  # of what is left unknown of the end effector
# Share of the squared distance from the drawing that a common movement must explain to be named.
_EXPLAINED = 0.5
_MOVEMENTS = {
    "base": "the frame of the measured poses is {} against the drawing's base",
    "platform": "the measured target is {} against the drawing's platform frame",
    "scale": "the measured positions are {} against the drawing's lengths",
}


def implausible_parameters(found: Found) -> Iterator[Doubt]:
    """Name parameters, and movements of all of them, that the tolerances make implausible.

    Single parameters are those without a prior: with one, chi-square says it.
    """
    moved = [each for each in found.unknowns if _has_tolerance(each) and math.isnan(each.prior)]
    known = bool(moved) and all(math.isfinite(each.deviation) for each in moved)
    movements = list(_common_movements(found)) if found.legs and known else []
    yield from movements or _against_tolerances(found)
    if not known:
        return
    share = {
        each.name: abs(each.change) / math.hypot(each.tolerance, each.deviation)
        for each in moved
        if found.legs or each.shown
    }
    limit = NormalDist().inv_cdf(1 - FALSE_ALARMS / 4 / max(len(share), 1))
    far = sorted(
        (each for each in moved if share.get(each.name, 0) > limit),
        key=lambda each: -share[each.name],
    )
    if far:
        named = [
            f"{each.name} by {each.change:+.3g} {each.unit}".rstrip()
            + f" ({share[each.name]:.3g} times what tolerance and noise allow)"
            for each in far
        ]
        figures = {"names": few(named, _NAMED)}
        yield Doubt("parameters-far", _legs(far), size=share[far[0].name], figures=figures)


def _against_tolerances(found: Found) -> Iterator[Doubt]:
    """All parameters together, further than robots are made, or as if made from the drawing.

    Each is doubted in one of 2000 sound robots.
    """
    conflict = found.conflict
    if computed_from_drawing(found):
        yield Doubt("computed-from-drawing")
    elif conflict is not None and conflict.p_large < LIMIT:
        yield Doubt(
            "far-from-drawing", size=conflict.q, p=conflict.p_large, figures=_sizes(conflict)
        )
    elif _is_near(conflict, found) and not conflict.as_drawn > BETTER:
        yield Doubt("near-drawing", size=conflict.q, p=conflict.p_small, figures=_sizes(conflict))


def wide_tolerances(found: Found) -> Iterator[Note]:
    """Say that the robot is made better than its tolerances say: no reason to distrust it.

    Who takes a drawing's limits for standard deviations has such robots.
    """
    conflict = found.conflict
    if _is_near(conflict, found) and conflict.as_drawn > BETTER:
        figures = _sizes(conflict)
        yield Note("tolerances-wide", size=conflict.q, p=conflict.p_small, figures=figures)


def _is_near(conflict: DrawingConflict | None, found: Found) -> TypeGuard[DrawingConflict]:
    """Whether it is by the noise that is declared, unless that is too large."""
    small = any(fit.chi_square < fit.least for fit in found.goodness)
    return conflict is not None and conflict.p_small < LIMIT and not small


def _sizes(conflict: DrawingConflict) -> dict[str, float]:
    return {"count": conflict.directions, "factor": conflict.factor}


def strained_ties(found: Found) -> Iterator[Doubt]:
    """Name the tie within a deviation that all else contradicts most; of 2000 sound robots one."""
    strains = [each for each in strains_of(found) if math.isfinite(each.p_value)]
    worst = min(strains, key=lambda each: each.p_value, default=None)
    if worst is None:
        return
    # As large as the residuals say that the noise is, where these are larger than declared.
    times = abs(worst.statistic) / math.sqrt(found.noise_factor)
    p_value = float(_core.chi_square_tail(times**2, 1))
    if p_value >= LIMIT / len(strains):
        return
    factor, unit = (1e3, f" m{worst.unit}") if worst.unit else (1.0, "")
    figures = {
        "tie": worst.tie,
        "amount": f"{factor * worst.others:+.3g} +- {factor * worst.others_deviation:.2g}{unit}",
        "times": times,
    }
    yield Doubt("tie-strained", size=worst.others, p=p_value, figures=figures)


def unknown_parameters(found: Found) -> Iterator[Doubt]:
    """Name parameters that the measurements in effect do not show, and that matter."""
    unknown = _unknown(found)
    if unknown and not _platform_is_known(found):
        figures = {"names": _named(unknown)}
        yield Doubt("parameters-unknown", _legs(unknown), size=UNKNOWN, figures=figures)


def unneeded_parameters(found: Found) -> Iterator[Note]:
    """Name parameters that the measurements do not show, and that the end effector hardly needs."""
    unknown = _unknown(found)
    if unknown and _platform_is_known(found):
        figures = {"names": _named(unknown)}
        yield Note("parameters-unneeded", _legs(unknown), size=UNKNOWN, figures=figures)


def _unknown(found: Found) -> list[Unknown]:
    return [
        each
        for each in found.unknowns
        if each.column >= 0
        and (found.legs or each.shown)
        and each.deviation > UNKNOWN * each.tolerance
    ]


def _platform_is_known(found: Found) -> bool:
    """Whether the end effector is known better over the workspace than by the drawing alone."""
    if found.spread > _NONSENSE:
        return False
    known = _with_and_without(found)
    if known is None:
        return False
    after, before = known
    return after.position <= before.position and after.orientation <= before.orientation


class _Known(NamedTuple):
    """How well the end effector is known over the workspace, root mean square."""

    position: float
    orientation: float


def _with_and_without(found: Found) -> tuple[_Known, _Known] | None:
    """How well the end effector is known from the measurements, and by the drawing alone."""
    variances = np.square([each.tolerance for each in found.first_unknowns])
    # What changed while it was measured is no part of the drawing, and moves no end effector.
    changes = found.options.covariates(found.mechanism, found.measurements)
    slopes = {each.name.partition("_")[0] for each in changes}
    own = [bool(slopes & {*name.split(".")}) for name in found.names]
    variances = np.where(own, np.diag(found.covariance), variances)
    if not np.isfinite(variances).all():
        return None
    drawn = dataclasses.replace(found, covariance=np.diag(variances))
    # Effects are those where sensors are straight, of their bends too.
    robot = found.mechanism.replace(curvature=None)
    try:
        survey, with_rows = promising(found, robot)
        without = promising(drawn, robot)[1]
        effects = survey.effects(expected_over(robot))[0]
    except SymkinError:
        return None
    if not len(effects):
        return None

    def known(covariance: Array) -> _Known:
        squares = ((effects @ covariance) * effects).sum(axis=2).mean(axis=0)
        return _Known(float(np.sqrt(squares[:3].sum())), float(np.sqrt(squares[3:].sum())))

    return known(with_rows), known(without)


def hiding_noise(found: Found) -> Iterator[Doubt]:
    """Say that the noise was estimated so large that the measurements tell nothing of the robot.

    Chi-square, by which such residuals show else, is what that noise was made for.
    """
    if not found.noise_is_estimated:
        return
    declared = found.nominal.noise
    pairs = [
        (getattr(found.noise, what), getattr(declared, what))
        for what in ("position", "orientation", "reading")
    ]
    times = max((own / said for own, said in pairs if said > 0), default=0.0)
    if times > _MANY_TIMES and (known := _with_and_without(found)):
        after, before = known
        if (
            after.position > _AS_WELL * before.position
            or after.orientation > _AS_WELL * before.orientation > 0
        ):
            yield Doubt("noise-hides-robot", size=times)


def weak_parameters(found: Found) -> Iterator[Note]:
    """Name parameters that the drawing knows better than the measurements."""
    weak = [
        each
        for each in found.unknowns
        if each.column >= 0 and each.tolerance < each.deviation <= UNKNOWN * each.tolerance
    ]
    if found.legs and weak:
        yield Note("parameters-weak", _legs(weak), figures={"names": _named(weak)})


def _has_tolerance(each: Unknown) -> bool:
    own = each.name.rpartition(".")[2]
    return each.column >= 0 and math.isfinite(each.tolerance) and own not in CURVATURE_TERMS


def _legs(unknowns: list[Unknown]) -> tuple[int, ...]:
    blocks = (each.name.partition(".")[0] for each in unknowns)
    return tuple(sorted({int(block[3:]) - 1 for block in blocks if block.startswith("leg")}))


def _named(unknowns: list[Unknown]) -> str:
    return few(unknowns_by_name(each.name for each in unknowns), _LISTED)


def _common_movements(found: Found) -> Iterator[Doubt]:
    """Movements of all parameters as one, which show far below the tolerance of any of them."""
    own = np.flatnonzero(found.nominal.is_estimated)
    tolerances = parameter_tolerances(found.nominal).ravel()[own]
    inverse = np.linalg.inv(found.covariance + np.diag(tolerances**2))
    z = found.changes.ravel()[own]
    distance = float(z @ inverse @ z)
    if distance == 0:
        return
    best: tuple[float, Doubt] | None = None
    for kind in _MOVEMENTS:
        if kind == "scale" and not found.nominal.space.moves:
            continue
        directions = _directions(found, kind)
        if directions.shape[1] == 0:
            continue
        information = directions.T @ inverse @ directions
        gradient = directions.T @ inverse @ z
        amounts = np.linalg.pinv(information, rcond=1e-10) @ gradient
        explained = float(gradient @ amounts)
        p_value = _core.chi_square_tail(explained, directions.shape[1])
        limit = FALSE_ALARMS / 8 if best is None else best[0]
        if explained < _EXPLAINED * distance or p_value >= limit:
            continue
        if kind == "scale":
            movement = scale_in_words(float(amounts[0]))
        else:
            movement = _MOVEMENTS[kind].format(_in_words(amounts, found.nominal.space.size))
        figures = {"movement": movement, "share": explained / distance}
        every, size = tuple(range(len(found.legs))), float(np.linalg.norm(amounts))
        best = p_value, Doubt("moved-together", every, size=size, p=p_value, figures=figures)
    if best is not None:
        yield best[1]


def _directions(found: Found, kind: str) -> Array:
    """Changes of what is identified, one a column, that stand for moving a frame or for a scale.

    They are those with which the closures at the measured poses stay as they are, leg by leg.
    """
    calibrated, measurements = found.mechanism, found.measurements
    columns = []
    for leg, fit in enumerate(found.legs):
        poses, readings = measurements.poses[fit.rows], measurements.readings[fit.rows, leg]
        rows = calibrated.linearised(leg, poses, readings)
        movement = _movements(kind, found.nominal.pose_space, measurements.poses[fit.rows])
        movement = np.repeat(movement, calibrated.closures, axis=0)
        wanted = -np.einsum("nd,ndk->nk", rows.by_pose, movement)
        by_parameters = rows.by_parameters[:, found.nominal.estimated[leg]]
        scale = np.linalg.norm(by_parameters, axis=0)
        scale[scale == 0] = 1
        solved = np.linalg.lstsq(by_parameters / scale, wanted, rcond=1e-12)[0]
        columns.append(solved / scale[:, None])
    return np.vstack(columns)


def _movements(kind: str, pose_space: str, poses: Array) -> Array:
    """Changes of the poses on their tangent, shape (N, dof, movements)."""
    rotation, translation = transforms(pose_space, poses)
    none, same = np.zeros_like(rotation), np.broadcast_to(np.eye(3), rotation.shape)
    movements = {
        "base": np.block([[same, -cross_matrices(translation)], [none, same]]),
        "platform": np.block([[rotation, none], [none, rotation]]),
        "scale": np.concatenate([translation, np.zeros_like(translation)], axis=1)[:, :, None],
    }[kind]
    space = POSE_SPACES[pose_space]
    shown = space.components
    if kind == "scale":
        return movements[:, shown]
    free = space.frame_components
    if kind == "platform" and not space.turns:
        free = []  # its target's offset cannot be told from the base frame's
    return movements[:, shown][:, :, free]


def scale_in_words(share: float) -> str:
    """Say that measured positions are too large, or too small, by a share of them."""
    amount = f"{100 * abs(share):.3g} % too {'large' if share > 0 else 'small'}"
    return _MOVEMENTS["scale"].format(amount)


def _in_words(amounts: Array, positions: int) -> str:
    angle = np.degrees(np.linalg.norm(amounts[positions:]))
    turned = f"turned by about {angle:.3g} degrees"
    if not positions:
        return turned
    shift = ", ".join(f"{1e3 * value:.3g}" for value in amounts[:positions])
    return f"shifted by about ({shift}) mm and {turned}"
