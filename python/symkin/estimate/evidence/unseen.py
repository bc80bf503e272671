# SPDX-License-Identifier: MIT
"""What may be wrong without any test seeing it, and what that would do to the end effector."""

from __future__ import annotations

import itertools
from collections.abc import Iterator
from statistics import NormalDist
from typing import Any

import numpy as np

from symkin.errors import SymkinError
from symkin.estimate.evidence.changes import asked_for, terms_of_changes
from symkin.estimate.evidence.distortion import columns_of_distortion, seen_from, words_of
from symkin.estimate.evidence.findings import Note
from symkin.estimate.evidence.linear_rows import LinearRows, linear_rows
from symkin.estimate.evidence.residuals import ALARMS
from symkin.estimate.evidence.sag import SAG_ALARMS, columns_of_sag
from symkin.estimate.evidence.scatter import hardly_missed
from symkin.estimate.found import Found
from symkin.estimate.precision import promising
from symkin.estimate.unknowns import SAG
from symkin.model.devices import UNCALIBRATED
from symkin.values import Array, record

POWER = 0.9  # of robots in which a test sees it
_SEEN = 1e-3  # of a column: what unknowns leave less of, no size of it shows
_OF_AXES = {"stretch": 0.5, "shear": 0.5, "lens": 1.0}  # what two axes differ or lean, for a term
_WITH = {"stretch": "", "shear": "with ", "lens": "that has positions "}


@record
class _Defect:
    """What a test sees in most robots from some size on, and how it moves the unknowns.

    `moves` are mean products of by how much a unit of it moves each two.
    """

    what: str
    of: str
    moves: Array
    size: float
    unit: str
    options: dict[str, Any]

    @property
    def words(self) -> str:
        """What it is, with its size."""
        amount = f"{self.size:.2g} {self.unit}"
        shown = "orientations" if self.of else "positions"
        return {
            "sag": f"a sag of {amount} at the outermost pose",
            "backlash": f"backlash of {amount} of {self.of}",
            "growth": f"growth of all lengths by {1e6 * self.size:.2g} ppm",
            "lag": f"{shown} that lag by {100 * self.size:.2g} % of the last move",
            "drift": f"a drift of {amount} of {self.of}",
            "play": f"play of {amount} to either side of {self.of}",
            "device": f"a measuring device {self.of}",
        }[self.what]


def notes_of_the_unseen(found: Found) -> Iterator[Note]:
    """Say what is hardly missed, if it moves the end effector more than is expected.

    At the poses that were measured, root mean squares of both, of positions if the platform moves;
    of each kind the worst.
    """
    try:
        rows = linear_rows(found, ())
        if rows is None or rows.spare < 1:
            return
        survey, covariance = promising(found, found.mechanism)
        places = found.latent_poses[np.isfinite(found.latent_poses).all(axis=1)]
        judged = slice(3) if found.nominal.space.moves else slice(3, 6)
        effects = survey.effects(places)[0][:, judged]
    except SymkinError:
        return
    if not len(effects):
        return

    def rms(some: Array, moves: Array) -> float:
        return float(np.sqrt(((some @ moves) * some).sum(axis=(1, 2)).mean()))

    expected = rms(effects, covariance)
    if not expected > 0:
        return
    worst: dict[str, tuple[float, _Defect]] = {}
    kinds = (_of_changes, _of_sag, _of_device, _of_scatter)
    for each in itertools.chain.from_iterable(kind(found, rows) for kind in kinds):
        times = each.size * rms(effects[..., : len(found.names)], each.moves) / expected
        if times > max(1.0, worst.get(each.what, (0.0,))[0]):
            worst[each.what] = times, each
    if not worst:
        return
    told = sorted(worst.values(), key=lambda each: -each[0])
    words = [f"{each.words} ({times:.2g} times)" for times, each in told]
    options: dict[str, Any] = {}
    for _, each in told:
        options |= each.options
    figures = {"names": ", ".join(words), "times": told[0][0]}
    yield Note("unseen", size=told[0][1].size, figures=figures, options=options)


def _seen_from(alarms: float) -> float:
    """Standard deviations of what a test for so many of the sound robots sees in most others."""
    normal = NormalDist()
    return normal.inv_cdf(POWER) - normal.inv_cdf(alarms / 2)


def _moves(rows: LinearRows, column: Array) -> Array:
    moved = rows.moved(column)
    return np.outer(moved, moved)


def _of_scatter(found: Found, rows: LinearRows) -> Iterator[_Defect]:
    """Errors of one leg's readings, another in each row."""
    unit = found.nominal.reading_unit
    for leg, size in hardly_missed(rows, POWER).items():
        moved = np.einsum("nrk,nr->nk", rows.basis, rows.by_leg[..., leg]) @ rows.by_basis
        yield _Defect("play", f"leg {leg + 1}", moved.T @ moved, size, unit, {})


def _of_changes(found: Found, rows: LinearRows) -> Iterator[_Defect]:
    """Slopes of one leg, of the base, or of all legs alike."""
    terms = [each for each in terms_of_changes(found, rows) if each.what != "step"]
    kept = [each for each in terms if each.length > _SEEN * np.linalg.norm(each.column)]
    enough = _seen_from(ALARMS / max(len(terms), 1))
    reading = found.nominal.reading_unit
    for each in kept:
        of, unit = each.of, "rad" if each.of in ("phi", "rx", "ry", "rz") else "m"
        if each.leg >= 0:
            of, unit = f"leg {each.leg + 1}", reading
        elif each.what == "drift":
            of = f"{of} of where the robot stands to the measuring device"
        if each.what != "clock":
            size = enough / each.length
            yield _Defect(each.what, of, _moves(rows, each.column), size, unit, asked_for(each))
    of_legs = [each for each in kept if each.what == "backlash"]
    if len(of_legs) > 1:
        column = np.sum([each.column for each in of_legs], axis=0)
        left = rows.left(column)
        shown = max(abs(float(np.sum(each.column * left))) / each.length for each in of_legs)
        size, options = enough / shown, asked_for(of_legs[0])
        yield _Defect("backlash", "all legs", _moves(rows, column), size, reading, options)


def _of_sag(found: Found, rows: LinearRows) -> Iterator[_Defect]:
    """A sag of the last coordinate, unless it is declared."""
    columns, down = columns_of_sag(found, rows), found.nominal.space.position[-1:]
    if SAG in {each.name for each in found.assumed} or not down or down[0] not in columns:
        return
    column = columns[down[0]]
    size = _seen_from(SAG_ALARMS / len(columns)) / rows.length(column)
    assume = {**(found.options.assume or {}), SAG: float(f"{size:.2g}")}
    yield _Defect("sag", "", _moves(rows, column), size, "m", {"assume": assume})


def _of_device(found: Found, rows: LinearRows) -> Iterator[_Defect]:
    """Distortions of a device, none larger than its kind has: a shear looks like other lengths."""
    columns, reach = columns_of_distortion(found, rows)
    known = found.nominal.device
    most = (UNCALIBRATED if known is None else known.distortion) * reach
    for name, size in seen_from(rows, columns, POWER).items():
        kind = name.partition(" ")[0]
        if kind in _OF_AXES:  # a scale is held as exact, which is a note of its own
            size = min(size, _OF_AXES[kind] * most)
            told = f"{_WITH[kind]}{words_of(name, size, reach)}"
            yield _Defect("device", told, _moves(rows, columns[name]), size, "m", {})
