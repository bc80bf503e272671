# SPDX-License-Identifier: MIT
"""Frames of the measurements that nobody mentioned."""

from __future__ import annotations

import dataclasses

import numpy as np

from symkin import _core
from symkin.analysis.seen import Seen
from symkin.data.measurements import Measurements
from symkin.estimate.evidence.findings import Doubt
from symkin.estimate.options import EstimateOptions
from symkin.model.mechanism import Mechanism
from symkin.model.poses import PoseSpace


def with_frames(
    mechanism: Mechanism, measurements: Measurements, options: EstimateOptions
) -> EstimateOptions | None:
    """The same with unknown frames of device and target; None where these cannot be found."""
    space = mechanism.space
    if options.frames:
        return None
    if not np.isfinite(measurements.poses[:, : space.size or None]).any():
        tracked = Seen.of(measurements).tracked
        return dataclasses.replace(options, frames=("base",)) if tracked else None
    # A target on a platform that never turns does what the base's frame does.
    if not space.turns:
        return dataclasses.replace(options, frames=("base",))
    fixed = options.fixed
    if not np.isfinite(measurements.poses[:, space.size :]).any():
        fixed += ("target.phi",) if space.size == 2 else ("target.r?",)
    return dataclasses.replace(options, frames=("base", "target"), fixed=fixed)


def only(frame: str, framed: EstimateOptions, stated: EstimateOptions) -> EstimateOptions:
    """Of options with both frames those with one of them."""
    added = (name for name in framed.fixed if name not in stated.fixed)
    fixed = (*stated.fixed, *(name for name in added if name.startswith(f"{frame}.")))
    return dataclasses.replace(framed, frames=(frame,), fixed=fixed)


def frame_doubt(
    space: PoseSpace,
    found: _core.Setup,
    stated: EstimateOptions,
    framed: EstimateOptions,
    evidence: str = "",
    p: float = float("nan"),
) -> Doubt:
    """That the measurements have a frame of their own, how far it is off, and what to ask for."""
    off = found.target if framed.frames == ("target",) else found.base
    shift = ", ".join(f"{1e3 * value:.3g}" for value in off.position)
    cosine = np.clip((np.trace(off.rotation) - 1) / 2, -1, 1)
    figures = {
        "whose": (
            "the target that was measured is not where the drawing has it on the platform"
            if framed.frames == ("target",)
            else "the frame of the measurements is not the drawing's"
        ),
        "evidence": evidence,
        "moved": f"shifted by about ({shift}) mm and " if space.moves else "",
        "angle": float(np.degrees(np.arccos(cosine))),
    }
    fixed = tuple(name for name in framed.fixed if name not in stated.fixed)
    options = {"frames": framed.frames, **({"fixed": fixed} if fixed else {})}
    size = float(np.linalg.norm(off.position))
    return Doubt("frame-not-as-drawn", size=size, p=p, figures=figures, options=options)
