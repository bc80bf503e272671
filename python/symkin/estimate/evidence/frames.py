# SPDX-License-Identifier: MIT
"""Frames of the measurements that nobody mentioned."""

from __future__ import annotations

import dataclasses

import numpy as np

from symkin import _core
from symkin.analysis.reflectors import is_tracked
from symkin.data.measurements import Measurements
from symkin.estimate.evidence.findings import Doubt
from symkin.estimate.options import EstimateOptions
from symkin.model.mechanism import Mechanism
from symkin.model.poses import PoseSpace

__all__ = ["frame_doubt", "with_frames"]


def with_frames(
    mechanism: Mechanism, measurements: Measurements, options: EstimateOptions
) -> EstimateOptions | None:
    """The same with unknown frames of device and target; None where these cannot be found."""
    space = mechanism.space
    if options.frames:
        return None
    if not np.isfinite(measurements.poses[:, : space.size or None]).any():
        return dataclasses.replace(options, frames=("base",)) if is_tracked(measurements) else None
    # A target on a platform that never turns does what the base's frame does.
    if not space.turns:
        return dataclasses.replace(options, frames=("base",))
    fixed = options.fixed
    if not np.isfinite(measurements.poses[:, space.size :]).any():
        fixed += ("target.phi",) if len(space.rotation) == 1 else ("target.r?",)
    return dataclasses.replace(options, frames=("base", "target"), fixed=fixed)


def frame_doubt(
    space: PoseSpace,
    base: _core.Frame,
    stated: EstimateOptions,
    framed: EstimateOptions,
    evidence: str = "",
    p: float = float("nan"),
) -> Doubt:
    """That the measurements have a frame of their own, how far it is off, and what to ask for."""
    shift = ", ".join(f"{1e3 * value:.3g}" for value in base.position)
    cosine = np.clip((np.trace(base.rotation) - 1) / 2, -1, 1)
    figures = {
        "evidence": evidence,
        "moved": f"shifted by about ({shift}) mm and " if space.moves else "",
        "angle": float(np.degrees(np.arccos(cosine))),
    }
    fixed = tuple(name for name in framed.fixed if name not in stated.fixed)
    options = {"frames": framed.frames, **({"fixed": fixed} if fixed else {})}
    size = float(np.linalg.norm(base.position))
    return Doubt("frame-not-as-drawn", size=size, p=p, figures=figures, options=options)
