# SPDX-License-Identifier: MIT
"""What a measuring device sets, in words."""

from __future__ import annotations

from symkin.model.devices import DEVICES, Device
from symkin.model.mechanism import Mechanism
from symkin.model.poses import POSE_ERRORS
from symkin.model.settings import Frames
from symkin.show.wording import given

_WAYS = {"there_and_back": "there and back", "travel": "by the shortest way", "sets": "set by set"}
_UNITS = {**dict(POSE_ERRORS), "per_metre": "m"}


def device_in_words(device: Device) -> str:
    """All that it sets, for a list."""
    observed = " and ".join(device.observe)
    if device.points:
        observed = f"{device.points} points at unknown places of the platform"
    noise = [given(value, _UNITS[name]) for name, value in device.noise().items()]
    unknown = ("base", "points") if device.points else device.frames
    if device.observe == ("height",):
        unknown = ("plane",)
    parts = [
        f"{observed}",
        f"noise {' and '.join(noise)}" + " more a metre of distance" * bool(device.per_metre)
        if noise
        else "",
        f"{given(device.distance, 'm')} away" if device.distance else "",
        f"unknown {' and '.join(unknown)}" if unknown else "",
        f"poses for all legs at once, {_WAYS[device.visit]}",
    ]
    return "; ".join(filter(None, parts)) + "."


def device_notes(mechanism: Mechanism) -> list[str]:
    """What of a mechanism's settings its device has set, and what was said otherwise."""
    device = mechanism.device
    if device is None:
        return []
    preset: list[str] = []
    own: list[str] = []
    for name, value in device.noise().items():
        if name == "per_metre":
            continue
        if name not in [kind for kind, _ in mechanism.space.errors]:
            continue
        stated = getattr(mechanism.noise, name)
        told = f"{name} noise {given(stated, _UNITS[name])}"
        (preset if stated == value else own).append(told)
    if device.distance and mechanism.space.moves and not (mechanism.frames or Frames()).base:
        told = f"it stands {given(device.distance, 'm')} away"
        (preset if device.distance == DEVICES[device.kind].distance else own).append(told)
    unknown = mechanism.identification.frames if mechanism.identification else None
    frames = device.unknown_frames(mechanism.space, mechanism.frames)
    if frames:
        told = f"unknown {' and '.join(unknown or ('no frame',))}"
        (preset if unknown == frames else own).append(told)
    observed = " and ".join(device.kinds(mechanism.space))
    text = f'measured by "{device.kind}", which sets {"; ".join([f"observed {observed}", *preset])}'
    return [f"{text} (yours: {'; '.join(own)})" if own else text]
