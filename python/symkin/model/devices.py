# SPDX-License-Identifier: MIT
"""The table of measuring devices: what each observes, how well, and what is unknown then.

A device sets what nobody has said otherwise. Its noise is a typical figure, to plan with until the
own device's is known.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Mapping
from typing import Any

from symkin.errors import SymkinError, did_you_mean, shown
from symkin.model.poses import PoseSpace
from symkin.model.settings import Frames, IdentificationSettings, NoiseSettings
from symkin.options import Observable, Visit
from symkin.values import record

UNCALIBRATED = 0.01  # an eye does not see 2% in an image


@record
class Device:
    """A kind of measuring device.

    Attributes
    ----------
    kind : str
        Its name.
    observe : tuple of str
        What it observes of a platform that moves and turns, as `Observed.kinds`.
    position, orientation : float or None
        Standard deviation of a coordinate, a distance or a height, m; of an angle, rad. None where
        it measures no such thing.
    per_metre : float
        What each metre of distance adds to `position`.
    source : str
        Where these figures are from.
    frames : tuple of str
        What stands nobody knows where, as the argument of `identify`.
    points : int
        How many targets it sees on a platform that turns, whose places nobody knows.
    distance : float
        How far it stands from the robot, m.
    visit : str
        In which order poses are taken.
    prints : bool
        Whether it measures what the robot made on its bed.
    distortion : float
        How unequal the scales of its axes may be, and how far these from square, rad; and, relative
        to the distance from the middle, what a lens may do to its outermost pose. Where errors are
        limited, the limit over a metre; else that of a camera that nobody calibrated.
    """

    kind: str
    observe: tuple[Observable, ...]
    position: float | None
    orientation: float | None
    source: str
    frames: tuple[str, ...] = ()
    points: int = 0
    distance: float = 0.0
    per_metre: float = 0.0
    visit: Visit = "there_and_back"
    prints: bool = False
    distortion: float = UNCALIBRATED

    def kinds(self, space: PoseSpace) -> tuple[Observable, ...]:
        """What it observes of such a platform: one that never turns is seen as a single point."""
        if space.moves and not space.turns and self.observe in (("points",), ("pose",)):
            return ("position",)
        return self.observe

    def unknown_frames(self, space: PoseSpace, placed: Frames | None) -> tuple[str, ...]:
        """Those of `frames` that such a platform can show and that nobody has placed."""
        possible = ("base", "target") if space.turns else ("base",)
        frames = ("base",) if self.points and not space.turns else self.frames
        return tuple(each for each in frames if each in possible and not getattr(placed, each, ()))

    def base(self, space: PoseSpace) -> tuple[float, ...]:
        """The robot's base in the frame of a device that stands so far off along x."""
        count = len(space.frame_components)
        return (self.distance, *(0.0,) * (count - 1)) if self.distance and space.moves else ()

    def places(self, size: int, radius: float) -> tuple[tuple[float, ...], ...]:
        """Where targets may be on a platform of such a size, m: round its middle."""
        angles = [math.pi / 2 + 2 * math.pi * each / self.points for each in range(self.points)]
        return tuple(
            (radius * math.cos(angle), radius * math.sin(angle), 0.0)[:size] for angle in angles
        )

    def noise(self) -> dict[str, float]:
        """Its standard deviations by the names of `NoiseSettings`."""
        both = {"position": self.position, "orientation": self.orientation}
        given = {name: value for name, value in both.items() if value is not None}
        return given | ({"per_metre": self.per_metre} if self.per_metre else {})

    def require(self, space: PoseSpace) -> None:
        """Refuse a platform of which it sees nothing.

        Raises
        ------
        SymkinError
            Saying what is missing, or which devices would do.
        """
        if self.observe == ("height",) and space.size < 3:
            raise SymkinError(
                f'the device "{self.kind}" measures heights above a plane; expected a robot that '
                "moves in space"
            )
        if self.points and not space.moves:
            raise SymkinError(
                f'the device "{self.kind}" sees points, which are fixed to no place of a platform '
                'that only turns; expected one that sees orientations, such as "motion capture"'
            )


_MPE = "half of the maximum permissible error"
# fmt: off
_ALL = (
    Device("laser tracker, 3 reflectors", ("points",), 7.5e-6, None,
           f"{_MPE} across the beam, 15 um + 6 um/m (Leica AT500, user manual, section 2.8, which "
           "calls half of it typical); along the beam it is better",
           points=3, distance=2.5, per_metre=3e-6, distortion=2.1e-5),
    Device("CMM", ("points",), 2e-6, None,
           f"{_MPE} of a bridge machine at 0.5 m, 2.2 um + L/300 (ISO 10360-2, such as Hexagon "
           "Global)",
           points=3, distortion=5.5e-6),
    Device("camera, ArUco board", ("pose",), 3e-4, 2e-3,
           "0.2 pixels of a corner at 1000 pixels of focal length and 0.5 m are 0.1 mm across the "
           "axis, three times that along it; turned, 0.3 mm over a board of 0.15 m",
           frames=("base", "target"), visit="travel"),
    Device("motion capture", ("pose",), 2e-4, 1e-3,
           "0.2 mm of a marker, as data sheets of a room's systems state; turned, that over 0.2 m "
           "of markers",
           frames=("base", "target"), visit="travel"),
    Device("dial gauge", ("height",), 5e-6, None,
           "repeatability 3 um and half a graduation of 10 um (JIS B 7503, ISO 463)",
           visit="travel"),
    Device("bed probe", ("height",), 1e-5, None,
           "PROBE_ACCURACY of Klipper, which calls a range of 25 um in ten touches the limit",
           visit="travel"),
    Device("nothing (redundant encoders)", ("readings",), None, None,
           "nothing but the encoders, whose noise is the robot's own"),
    Device("caliper on prints", ("separation",), 5e-5, None,
           "limit of error of a digital caliper, 30 um at 150 mm (DIN 862), and as much of the "
           "edges of a print",
           visit="travel", prints=True),
)
# fmt: on
DEVICES: Mapping[str, Device] = {each.kind: each for each in _ALL}


def device_of(kind: str | Device) -> Device:
    """Return a device by its name, of which an unambiguous beginning will do.

    Raises
    ------
    SymkinError
        For another name, with the nearest.
    """
    if isinstance(kind, Device):
        return kind
    if not isinstance(kind, str):
        raise SymkinError(f"the device is {shown(kind)}; expected the name of its kind")
    known = [each for name, each in DEVICES.items() if name.lower() == kind.strip().lower()]
    start = kind.strip().lower()
    known = known or [each for name, each in DEVICES.items() if name.lower().startswith(start)]
    if len(known) != 1 or not start:
        kinds = ", ".join(f'"{each}"' for each in DEVICES)
        raise SymkinError(
            f"the device is {shown(kind)}{did_you_mean(kind, DEVICES)}; expected one of {kinds}"
        )
    return known[0]


def equipped(
    device: Device,
    space: PoseSpace,
    noise: Mapping[str, float],
    identification: IdentificationSettings | None,
    frames: Frames | None,
) -> dict[str, Any]:
    """Arguments of a mechanism that a device measures; what is given goes before what it sets.

    Raises
    ------
    SymkinError
        As `Device.require`.
    """
    device.require(space)
    usual = device.noise()
    if "position" in noise:
        usual.pop("per_metre", None)
    unknown = identification or IdentificationSettings()
    own = device.unknown_frames(space, frames)
    if unknown.frames is None and own:
        identification = dataclasses.replace(unknown, frames=own)
    return {
        "device": device,
        "noise": NoiseSettings(**{**usual, **noise}),  # type: ignore[arg-type]
        "identification": identification,
    }
