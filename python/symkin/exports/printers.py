# SPDX-License-Identifier: MIT
"""Linear deltas of which a file has the geometry: what is assumed of the rest."""

from __future__ import annotations

from collections.abc import Sequence

from symkin.errors import SymkinError
from symkin.exports.firmware import LinearDelta
from symkin.model.chains import Leg
from symkin.model.mechanism import Mechanism
from symkin.model.settings import (
    Frames,
    IdentificationSettings,
    JointLimits,
    NoiseSettings,
    Tolerances,
    WorkspaceSettings,
)

CONDITION = 10.0
_NOISE = NoiseSettings(position=2.5e-5, orientation=0.0, reading=5e-6)
ASSUMED = (
    f"Noise is assumed: {_NOISE.position * 1e3:g} mm of a height, {_NOISE.reading * 1e3:g} mm of a "
    "carriage. So are workspace and tolerances; the file has them"
)
_NOISE_OF_CRANKS = NoiseSettings(position=2.5e-5, orientation=0.0, reading=1e-4)
ASSUMED_OF_CRANKS = (
    f"Noise is assumed: {_NOISE_OF_CRANKS.position * 1e3:g} mm of a height, "
    f"{_NOISE_OF_CRANKS.reading * 1e3:g} mrad of a crank. So are workspace and tolerances; the "
    "file has them"
)
# What Klipper's own calibration estimates, of cranks the first two.
_UNKNOWN = ("sensor_offset", "base_radius", "leg1.base_azimuth", "leg2.base_azimuth")
_RODS = ("distal_length",)  # that heights do not show, and distances do
_TELLING_HEIGHTS = 11  # of which these six leave five, from which a noise can be estimated


def few_heights(count: int) -> bool:
    """Whether so many heights do not tell how well a probe repeats."""
    return count < _TELLING_HEIGHTS


def printer_of(
    name: str,
    legs: Sequence[Leg],
    workspace: WorkspaceSettings,
    *,
    few: bool,
    probe: float | None = None,
    rods: bool = False,
) -> Mechanism:
    """A delta whose sensors read how far carriages, or cranks, have come down from their endstops.

    Nobody knows how well a probe repeats, unless `probe` says it, m: the heights that are left over
    tell, if they are not `few`. Distances tell how long the `rods` are, and leave what the probe's
    noise is and what the carriages' open.
    """
    cranks = legs[0].chain == "[R]US"
    noise = _NOISE_OF_CRANKS if cranks else _NOISE
    return Mechanism(
        name,
        legs,
        platform="translating",
        reading_unit="rad" if cranks else "m",
        workspace=workspace,
        joint_limits=JointLimits(lower=0.0) if cranks else JointLimits(upper=0.0),
        noise=noise if probe is None else NoiseSettings(probe, 0.0, noise.reading),
        tolerances=Tolerances(length=5e-4, angle=5e-3, gain=2e-3),
        frames=Frames(plane=(0.0, 0.0, 0.0)),
        identification=IdentificationSettings(
            free=(_UNKNOWN[:2] if cranks else _UNKNOWN) + _RODS * rods,
            shared=("base_radius",) + _RODS * rods,
            noise=None if few or rods or probe is not None else "estimate",
        ),
    )


def workspace_of(delta: LinearDelta, radius: float) -> WorkspaceSettings:
    """The largest box below the endstops whose corners are on the circle that is printed on, m."""
    reach = min(radius, float(delta.arms.min()) - delta.radius)
    side = 0.7 * reach
    # The carriages are highest where the effector is at a corner next to their tower.
    top = float((delta.endstops - delta.arms).min())
    if side <= 0 or top <= 0:
        raise SymkinError(
            f"rods of {delta.arms.min() * 1e3:g} mm, a radius of {delta.radius * 1e3:g} mm and "
            f"endstops {delta.endstops.min() * 1e3:g} mm above the bed leave no room to print"
        )
    return WorkspaceSettings(
        (-side, -side, 0.0),
        (side, side, top),
        home=(0.0, 0.0, top / 2),
        conditioning_limit=CONDITION,
    )
