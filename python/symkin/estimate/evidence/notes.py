# SPDX-License-Identifier: MIT
"""What to know of an estimate that may well be sound."""

from __future__ import annotations

import operator
from collections.abc import Collection, Iterator, Sequence

import numpy as np

from symkin.analysis.promises import left_to_gravity
from symkin.errors import SymkinError, few, unknowns_by_name
from symkin.estimate.evidence.drawing import unneeded_parameters, weak_parameters, wide_tolerances
from symkin.estimate.evidence.findings import Doubt, Note
from symkin.estimate.evidence.table_edits import with_readings
from symkin.estimate.evidence.unseen import notes_of_the_unseen
from symkin.estimate.fit import changed_settings
from symkin.estimate.found import Found
from symkin.estimate.noise import keeps_proportion
from symkin.estimate.precision import Heights
from symkin.estimate.problem import Problem
from symkin.estimate.unknowns import BED, SAG, SCALE
from symkin.model.symmetry.groups import detect_symmetry

_AS_GOOD = 9.0  # more of chi-square: an order of the legs that cannot be told from another
_TURNS = ("base.phi", "base.rz")
_LISTED = 6
_REJECTED = 5
_TARGET = "target"
_KEPT = " Its kinds were not told apart: they keep the proportion that is declared."


def notes_of(
    found: Found, heights: Heights | None, doubts: Sequence[Doubt], *, complete: bool
) -> Iterator[Note]:
    """Say what to know of an estimate, and of the settings of its mechanism.

    What may make all of it another robot's comes first: a screen has room for few.
    """
    if not complete:
        yield Note("search-cut-short")
    for words in found.measurements.notes:
        yield Note("columns-unread", figures={"words": words})
    if found.mechanism.open_coordinates:
        words = left_to_gravity(found.mechanism)
        yield Note("left-to-gravity", figures={"words": words[0].upper() + words[1:]})
    orders = [
        ", ".join(str(leg + 1) for leg in order)
        for order in _exchanges(found, heights is not None, doubts)
    ]
    if orders:
        words = " or ".join(dict.fromkeys(orders))
        yield Note("legs-interchangeable", figures={"orders": words})
    yield from _held_as_exact(found)
    if found.converged and not doubts:
        yield from notes_of_the_unseen(found)
        yield from wide_tolerances(found)
    yield from unneeded_parameters(found)
    yield from weak_parameters(found)
    if found.gauge:
        yield Note("gauge", figures={"words": found.gauge[0].upper() + found.gauge[1:]})
    silent = [each.name for each in found.unknowns if each.status.startswith("held by its prior")]
    if heights is not None:
        yield from (Note("heights", figures={"words": words}) for words in heights.notes)
    elif silent:
        yield Note("priors-stand", figures={"names": few(unknowns_by_name(silent), _LISTED)})
    if found.unguarded:
        rows = tuple(found.measurements.row_numbers[list(found.unguarded)].tolist())
        numbers = ", ".join(map(str, rows))
        which = f"row {numbers}" if len(rows) == 1 else f"any of the rows {numbers}"
        yield Note("rows-unguarded", rows=rows, figures={"which": which})
    if found.noise_is_estimated:
        kept = keeps_proportion(found.nominal.noise, found.noise)
        yield Note("noise-estimated", figures={"kept": _KEPT * kept})
    if found.mechanism.curvature is not None:
        yield Note("sensors-curved")
    if found.rejected and not found.legs:
        rows = tuple(int(found.measurements.row_numbers[row]) for row, _ in found.rejected)
        left = [f"{what} in row {row}" for row, (_, what) in zip(rows, found.rejected, strict=True)]
        yield Note("left-out", rows=rows, figures={"names": few(left, _REJECTED)})
    frames, measured = found.nominal.frames, found.measurements
    if frames and frames.points and measured.points is None and measured.distances is not None:
        yield Note("points-unseen")
    for words in changed_settings(found.nominal, found.mechanism):
        yield Note("settings-changed", figures={"words": words})


def _held_as_exact(found: Found) -> Iterator[Note]:
    """Name what is held without a word of how well it is known, the device's scale among it."""
    known = {each.name for each in found.assumed}
    # Of sessions nothing is drawn, and what nobody measured does not matter.
    of_none = ("session", *(("point",) if found.measurements.points is None else ()))
    names = unknowns_by_name(
        each.name
        for each in found.unknowns
        if each.status == "held" and each.name not in known and not each.name.startswith(of_none)
    )
    names += _of_the_device(found, known)
    if names:
        single = len(names) == 1 and " of legs " not in names[0]
        be, it = ("is", "it") if single else ("are", "they")
        yield Note("held-as-exact", figures={"names": few(names, _LISTED), "be": be, "it": it})


def _of_the_device(found: Found, known: Collection[str]) -> Iterator[str]:
    """What positions rest on that no residual shows: a sound robot of other lengths explains it."""
    measurements = found.measurements
    positions = bool(np.isfinite(measurements.poses[:, : measurements.space.size]).any())
    points = measurements.points is not None and bool(np.isfinite(measurements.points).any())
    if (positions or points) and SCALE not in known:
        yield f"{SCALE} (of the measuring device)"
    if found.measurements.heights is not None and BED not in known and found.options.bow is None:
        yield f"{BED} (that it is flat)"
    blocks = {each.partition(".")[0] for each in (*known, *(own.name for own in found.unknowns))}
    if positions and _TARGET not in blocks:
        yield f"{_TARGET} (its place on the platform)"
    if (positions or points) and SAG not in known:
        yield SAG


def _exchanges(found: Found, probed: bool, doubts: Sequence[Doubt]) -> Iterator[tuple[int, ...]]:
    """Give other orders of the readings' columns that explain the observations as well.

    Such are symmetries of the drawing where nothing shows how the robot is turned: a place of its
    base that is unknown, or heights alone. One rotation and one mirror are tried for all.
    """
    turns = probed or any(name in _TURNS for name in found.names)
    if not turns or not found.converged or doubts:
        return
    orders = detect_symmetry(found.nominal).permutations
    for label in ("r1", "s0"):
        order = orders.get(label, ())
        if order == tuple(sorted(order)):
            continue
        exchanged = with_readings(found.measurements, operator.itemgetter((slice(None), order)))
        try:
            _, fit, _ = Problem.of(found.nominal, exchanged, found.options).resolved()
        except SymkinError:
            continue
        if fit.converged and fit.goodness.chi_square < found.chi_square + _AS_GOOD:
            yield order
