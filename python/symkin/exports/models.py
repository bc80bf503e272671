# SPDX-License-Identifier: MIT
"""Models for simulators, MJCF, URDF and SDF: a tree of bodies, cut where legs meet the platform.

Simulators have no closures: they have bodies with a joint to their parent, and loops that are
closed again by constraints. A leg is such a branch, and so is the platform.

MuJoCo's MJCF closes loops by ``<equality><connect>``. A fixed tendon of the active joint with the
coefficient 1 / gain has the length that the sensor reads, so that what is sensed and commanded in
the model are the robot's own readings.

URDF is a tree, whose cut joints stand in comments; a body with several joints becomes a row of
links with one joint each.

SDFormat closes loops by ball joints, the robot standing at home: its joints are at zero where the
model is drawn, so that it must be drawn closed.
"""

from __future__ import annotations

import json
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any
from xml.etree import ElementTree as ET

import numpy as np
from numpy.typing import ArrayLike

from symkin.analysis.workspace import workspace_coordinates
from symkin.exports.bodies import Joint, Structure
from symkin.exports.common import MARK, ExportOptions, Written
from symkin.exports.known_bodies import structure_of
from symkin.model.mechanism import Mechanism
from symkin.model.poses import roll_pitch_yaw
from symkin.storage.templates import templates_of
from symkin.values import Array

_TEMPLATES = Path(__file__).parent / "templates"
_THICKNESS = 0.012  # of what is drawn, as a share of the mechanism's size
_MASS = 1.0  # nobody measured masses, and simulators refuse bodies without any
_URDF_KINDS = {"hinge": "continuous", "slide": "prismatic", "free": "floating"}
_SDF_KINDS = {"hinge": "revolute", "slide": "prismatic"}
_OPEN = "a URDF is a tree: the loops are open, and the joints that close them stand in comments"


def write_mjcf(mechanism: Mechanism, options: ExportOptions) -> Written:  # noqa: ARG001
    """Write a mechanism as MJCF, with the key frame "home"."""
    structure = structure_of(mechanism)
    return Written(
        _model_text(
            "mjcf.xml",
            mechanism,
            structure,
            _about(mechanism, structure),
            radius=_THICKNESS * structure.size,
            gains=mechanism.sensor_gains[mechanism.is_read].tolist(),
            home=np.hstack([structure.home[joint.name] for joint in _outwards(structure)]),
        )
    )


def _outwards(structure: Structure, body: str = "") -> Iterator[Joint]:
    """The joints behind a body in the order in which MuJoCo counts them."""
    for each in structure.bodies:
        if each.parent == body:
            yield from (*each.joints, *_outwards(structure, each.name))


def write_urdf(mechanism: Mechanism, options: ExportOptions) -> Written:  # noqa: ARG001
    """Write a mechanism as URDF; all joints at zero are all readings at zero, not home."""
    structure = structure_of(mechanism)
    comments = [*_about(mechanism, structure), *_cuts(structure)]
    far = 10 * structure.size
    text = _model_text("urdf.xml", mechanism, structure, comments, kinds=_URDF_KINDS, far=far)
    return Written(text, (_OPEN,))


def _cuts(structure: Structure) -> list[str]:
    """The joints that are not in the tree."""
    return [
        f"cut joint {each.name}, {'ball' if each.turning is None else 'fixed'}: "
        f"{_cut_end(each.point, each.turning)} of {each.body} = "
        f"{_cut_end(each.platform_point, each.other_turning)} of {each.other}"
        for each in structure.closures
    ]


def _cut_end(point: Array, turning: Array | None) -> str:
    """A point of a body, or a frame with its roll, pitch and yaw."""
    if turning is None:
        return f"point {_triple(point)}"
    return f"frame {_triple([*point, *roll_pitch_yaw(turning[None])[0]])}"


def write_sdf(mechanism: Mechanism, options: ExportOptions) -> Written:  # noqa: ARG001
    """Write a mechanism as SDF 1.8, at home."""
    structure = structure_of(mechanism)
    readings = mechanism.inverse_kinematics(mechanism.home)[0]
    note = (
        "SDF counts joints from where the model stands: joint = gain * (reading - reading at "
        f"home), readings at home: {_triple(readings).replace(' ', ', ')}."
    )
    comments, placed = [*_about(mechanism, structure), note], structure.frames(structure.home)
    text = _model_text("sdf.xml", mechanism, structure, comments, kinds=_SDF_KINDS, placed=placed)
    return Written(text, _uncoupled(structure))


def _uncoupled(structure: Structure) -> tuple[str, ...]:
    """What a format without couplings of joints loses."""
    if not structure.couplings:
        return ()
    names = ", ".join(
        f"{each.joint} = {each.ratio:g} {each.followed}" for each in structure.couplings
    )
    return (f"joints that follow others move by themselves in this format: {names}",)


def _triple(values: ArrayLike) -> str:
    """Numbers beside each other, with all their digits; no negative zero."""
    return " ".join(repr(float(value) + 0.0) for value in np.ravel(values))


def _of_declared(mechanism: Mechanism, structure: Structure) -> dict[str, Any]:
    """What besides a reader needs of declared legs."""
    names, free = list(mechanism.space.units), mechanism.leg_info(0).free
    return {
        "free": [names[each] for each in free] if mechanism.bound else [],
        "joints": {name: np.ravel(value).tolist() for name, value in structure.home.items()},
        "followers": {
            each.joint: [each.followed, each.ratio, each.offset] for each in structure.couplings
        },
    }


def _about(mechanism: Mechanism, structure: Structure) -> list[str]:
    """What a reader must know of any model, and what a tree cannot say, for comments."""
    # Two hyphens would end an XML comment.
    name = re.sub("-(?=-)", "- ", mechanism.name)
    known = {
        "chain": mechanism.chains if mechanism.mixed else mechanism.chain,
        "platform": mechanism.platform,
        "reading_unit": mechanism.reading_unit,
        "working_modes": mechanism.working_modes,
        "gains": mechanism.sensor_gains[mechanism.is_read].tolist(),
        "home": workspace_coordinates(mechanism, mechanism.home)[0].tolist(),
        "readings": mechanism.inverse_kinematics(mechanism.home)[0, mechanism.is_read].tolist(),
    }
    if mechanism.has_declared:
        known |= _of_declared(mechanism, structure)
    return [
        f'"{name}", written by symkin. Lengths are m, angles rad. Geometry is the mechanism '
        "file's; masses, radii and limits are placeholders, since nobody measured them. Each leg "
        "is cut at its end, which a constraint holds at a point of the platform; leg<N>_active is "
        "the actuated joint: joint = gain * sensor reading.",
        f"{MARK} {json.dumps(known)}",
    ]


def _model_text(
    template: str, mechanism: Mechanism, structure: Structure, comments: list[str], **others: Any
) -> str:
    """A document with comments above what it says."""
    templates = templates_of(_TEMPLATES)
    templates.filters |= {
        "numbers": _triple,
        "length": np.linalg.norm,
        "axes": lambda rotation: _triple(rotation[:, :2].T),
        "angles": lambda rotation: _triple(roll_pitch_yaw(rotation[None])[0]),
    }
    moment = 0.4 * _MASS * (0.1 * structure.size) ** 2
    root = ET.fromstring(
        templates.get_template(template).render(
            mechanism=mechanism, structure=structure, mass=_MASS, moment=moment, **others
        )
    )
    for each in root.iter():
        each.text = (each.text or "").strip() or None
    ET.indent(root)
    above = "".join(f"<!-- {comment} -->\n" for comment in comments)
    return f'<?xml version="1.0"?>\n{above}{ET.tostring(root, encoding="unicode")}\n'
