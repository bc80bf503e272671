# SPDX-License-Identifier: MIT
"""What a model for simulators says, MJCF, URDF or SDF: bodies, their joints, and closed loops."""

from __future__ import annotations

import dataclasses
import json
import re
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any
from xml.etree import ElementTree as ET

import numpy as np

from symkin.errors import SymkinError, did_you_mean, few
from symkin.exports.common import MARK
from symkin.exports.compiled_scene import compiled_scene
from symkin.exports.scene import WORLD, Loop, Moving, Part, Scene, frame_of, of_quaternion
from symkin.model.poses import (
    quaternions_from_rotation_vectors,
    rotations_from_vectors,
    vectors_from_rotations,
)
from symkin.storage.toml_file import (
    Kind,
    WrongValueError,
    choice,
    list_of,
    one_or_list,
    quantity,
    read_at,
    read_table,
    read_toml,
    table,
    text,
)
from symkin.values import Array

_X, _Y, _Z = np.eye(3)


def read_scene(root: ET.Element, path: Path, text: str, loops: Path | None) -> Scene:
    """Read a model of a file."""
    said = re.search(rf"<!-- {MARK} (\{{.*?\}}) -->", text)
    known: dict[str, Any] = json.loads(said[1]) if said else {}
    readers = {"mujoco": _mjcf, "robot": _urdf, "sdf": _sdf}
    if root.tag not in readers:
        raise SymkinError(f"is <{root.tag}>; expected MJCF, URDF or SDF")
    if root.tag == "mujoco" and any(root.find(each) is not None for each in _COMPILED):
        scene = compiled_scene(path, known)
    else:
        scene = readers[root.tag](root, text, known)
    if loops is not None:
        scene = _with_loops(scene, loops)
    sensors = dict(scene.sensors)
    for leg, gain in enumerate(known.get("gains", ()), 1):
        if f"leg{leg}_active" in sensors or known.get("joints"):
            offset = sensors.get(f"leg{leg}_active", (1.0, 0.0))[1]
            sensors[f"leg{leg}_active"] = (float(gain), offset)
    names = {joint.name for part in scene.parts.values() for joint in part.joints}
    for what, given in (
        ("reads", sensors),
        ("has follow", scene.followers),
        ("has home values of", scene.home),
    ):
        for name in given:
            if name not in names:
                raise SymkinError(
                    f'{what} joint "{name}", which it has not{did_you_mean(name, sorted(names))}'
                )
    return dataclasses.replace(scene, sensors=sensors)


# What MuJoCo writes out.
_COMPILED = (
    *(f".//{each}" for each in ("include", "replicate", "attach", "frame", "composite")),
    *(f".//default//{each}" for each in ("joint", "site", "equality", "weld", "connect")),
)


def _mjcf(root: ET.Element, _text: str, known: Mapping[str, Any]) -> Scene:
    compiler = root.find("compiler")
    says = {} if compiler is None else compiler.attrib
    if says.get("coordinate", "local") != "local":
        raise SymkinError("has global coordinates, which MuJoCo has given up; expected local ones")
    scale = 1.0 if says.get("angle", "degree") == "radian" else np.pi / 180
    parts: dict[str, Part] = {}
    sites: dict[str, tuple[str, Array]] = {}
    order: list[tuple[Moving, float]] = []
    standing: dict[str, Array] = {}

    def read(element: ET.Element, parent: str) -> None:
        for site in element.findall("site"):
            if "name" in site.attrib:
                sites[site.attrib["name"]] = (parent, _mjcf_frame(site, scale, says))
        for body in element.findall("body"):
            name = body.attrib.get("name", f"body_{len(parts) + 1}")
            joints = [
                _mjcf_joint(each, f"{name}_joint_{number}", scale)
                for number, each in enumerate(body, 1)
                if each.tag in ("joint", "freejoint")
            ]
            order.extend(joints)
            frame = _mjcf_frame(body, scale, says)
            for joint, _ in joints:
                if joint.kind == "free":  # whose values are where the body stands in the world
                    standing[joint.name] = _standing(frame)
                    frame = np.eye(4)
            parts[name] = Part(parent, frame, tuple(joint for joint, _ in joints))
            read(body, name)

    world = root.find("worldbody")
    if world is None:
        raise SymkinError("has no <worldbody>")
    read(world, WORLD)
    scene = Scene(root.attrib.get("model", "model"), parts, (), {}, {}, {}, known)
    loops: list[Loop] = []
    followers: dict[str, tuple[str, float, float]] = {}
    for each in root.iterfind("equality/*"):
        if each.attrib.get("active", "true") == "false":
            continue
        if each.tag == "joint":
            followers |= _mjcf_follower(each)
        elif each.tag in ("connect", "weld"):
            loops.append(_mjcf_loop(each, scene, sites, f"loop_{len(loops) + 1}"))
        else:
            raise SymkinError(f"has an equality <{each.tag}>; expected connect, weld or joint")
    home = standing
    key = root.find("keyframe/key")
    if key is not None and "qpos" in key.attrib:
        values = _floats(key.attrib["qpos"])
        counts = [{"free": 7, "ball": 4}.get(joint.kind, 1) for joint, _ in order]
        if len(values) != sum(counts):
            raise SymkinError(f"has a key of {len(values)} values; expected {sum(counts)}")
        ends = np.cumsum(counts)
        for (joint, zero), count, end in zip(order, counts, ends, strict=True):
            home[joint.name] = values[end - count : end] - (zero if count == 1 else 0.0)
    zeros = {joint.name: zero for joint, zero in order}  # bodies stand there, at `ref`
    sensors = {name: (gain, -zeros.get(name, 0.0)) for name, gain in _mjcf_sensors(root).items()}
    return dataclasses.replace(scene, loops=loops, followers=followers, home=home, sensors=sensors)


def _mjcf_joint(element: ET.Element, name: str, scale: float) -> tuple[Moving, float]:
    kind = "free" if element.tag == "freejoint" else element.attrib.get("type", "hinge")
    axis = _floats(element.attrib.get("axis", "0 0 1"), 3)
    zero = _floats(element.attrib.get("ref", "0"), 1)[0] * (scale if kind == "hinge" else 1.0)
    anchor = _floats(element.attrib.get("pos", "0 0 0"), 3)
    return _moving(element.attrib.get("name", name), kind, axis, anchor), zero


def _mjcf_frame(element: ET.Element, scale: float, says: Mapping[str, str]) -> Array:
    given = element.attrib
    rotation = np.eye(3)
    if "quat" in given:
        rotation = of_quaternion(_unit(_floats(given["quat"], 4), "quat"))
    elif "xyaxes" in given:
        across = _floats(given["xyaxes"], 6).reshape(2, 3)
        first = _unit(across[0], "xyaxes of which the first is")
        second = _unit(across[1] - first * (first @ across[1]), "parallel xyaxes, an angle of")
        rotation = np.column_stack([first, second, np.cross(first, second)])
    elif "zaxis" in given:
        rotation = turn_from_z(_unit(_floats(given["zaxis"], 3), "zaxis"))
    elif "axisangle" in given:
        *axis, angle = _floats(given["axisangle"], 4)
        rotation = _about(_unit(np.array(axis), "axisangle"), scale * angle)
    elif "euler" in given:
        order = says.get("eulerseq", "xyz")
        if not re.fullmatch("[xyzXYZ]{3}", order):
            raise SymkinError(f'has eulerseq "{order}"; expected three of x, y and z')
        for letter, angle in zip(order, _floats(given["euler"], 3), strict=True):
            turn = _about(np.eye(3)["xyz".index(letter.lower())], scale * angle)
            rotation = rotation @ turn if letter.islower() else turn @ rotation
    return frame_of(_floats(given.get("pos", "0 0 0"), 3), rotation)


def _mjcf_follower(element: ET.Element) -> dict[str, tuple[str, float, float]]:
    given = element.attrib
    offset, ratio, *rest = _floats(given.get("polycoef", "0 1 0 0 0"))
    if "joint2" not in given or any(rest):
        raise SymkinError(
            f'has joint "{given.get("joint1")}" that is fixed or follows a curve; expected it to '
            "follow another in proportion"
        )
    return {_said(element, "joint1"): (given["joint2"], float(ratio), float(offset))}


def _mjcf_loop(
    element: ET.Element, scene: Scene, sites: Mapping[str, tuple[str, Array]], name: str
) -> Loop:
    given = element.attrib
    name, turns = given.get("name", name), element.tag == "connect"
    if "site1" in given:
        try:
            (body, frame), (other, beside) = (sites[_said(element, f"site{n}")] for n in (1, 2))
        except KeyError as error:
            raise SymkinError(f"has loop {name} with site {error}, which it has not") from error
        return Loop(name, body, frame, other, beside, turns)
    body, other = _said(element, "body1"), given.get("body2", "world")
    body, other = ("" if each == "world" else each for each in (body, other))
    frame = frame_of(_floats(given.get("anchor", "0 0 0"), 3), np.eye(3))
    if turns:
        beside = _within(_at_zero(scene, other), _at_zero(scene, body) @ frame)
        return Loop(name, body, frame, other, beside, turns)
    relative = _floats(given.get("relpose", "0 1 0 0 0 0 0"), 7)
    if relative[3:].any():
        frame = frame_of(relative[:3], of_quaternion(relative[3:]))
        return Loop(name, body, frame, other, np.eye(4), turns)
    beside = _within(_at_zero(scene, other), _at_zero(scene, body))
    return Loop(name, body, np.eye(4), other, beside, turns)


def _at_zero(scene: Scene, body: str) -> Array:
    """Where a body stands while all joints are at zero."""
    placed = np.eye(4)
    for name in scene.line(body):
        placed = placed @ scene.parts[name].frame
    return placed


def _mjcf_sensors(root: ET.Element) -> dict[str, float]:
    """Gains of joints that are read: by tendons of symkin, by sensors, or that are driven."""
    found: dict[str, float] = {}
    for fixed in root.iterfind("tendon/fixed"):
        joints = fixed.findall("joint")
        if fixed.attrib.get("name", "").startswith("reading_") and len(joints) == 1:
            found[joints[0].attrib["joint"]] = 1 / float(joints[0].attrib["coef"])
    for element in (*root.iterfind("actuator/*"), *root.iterfind("sensor/jointpos")):
        if "joint" in element.attrib:
            found.setdefault(element.attrib["joint"], 1.0)
    return found


_URDF_KINDS = {"continuous": "hinge", "revolute": "hinge", "prismatic": "slide", "floating": "free"}
_CUT = re.compile(
    r"cut joint (\S+), (ball|fixed): (?:point|frame) ([^a-zA-Z]+?) of (\w+) = "
    r"(?:point|frame) ([-+.eE\d ]+?) of (\w+)"
)


def _urdf(root: ET.Element, text: str, known: Mapping[str, Any]) -> Scene:
    joints = root.findall("joint")
    children = {_link(each, "child") for each in joints}
    bases = [
        name for name in (_said(link, "name") for link in root.findall("link"))
        if name not in children
    ]  # fmt: skip
    if len(bases) != 1:
        raise SymkinError(f"has {len(bases)} links without a parent; expected one, the base")
    parts: dict[str, Part] = {}
    followers = {}
    for each in joints:
        name, kind = _said(each, "name"), _said(each, "type")
        parent, child = _link(each, "parent"), _link(each, "child")
        if child in parts:
            raise SymkinError(f'has link "{child}" with two parents, which URDF has not')
        moving: tuple[Moving, ...] = ()
        if kind != "fixed":
            if kind not in _URDF_KINDS:
                raise SymkinError(f'has joint "{name}" of type "{kind}", which is not read')
            axis = each.find("axis")
            along = _X if axis is None else _floats(_said(axis, "xyz"), 3)
            moving = (_moving(name, _URDF_KINDS[kind], along),)
        origin = each.find("origin")
        frame = np.eye(4) if origin is None else _posed(
            origin.attrib.get("xyz", "0 0 0"), origin.attrib.get("rpy", "0 0 0")
        )  # fmt: skip
        parts[child] = Part("" if parent == bases[0] else parent, frame, moving)
        mimic = each.find("mimic")
        if mimic is not None:
            ratio, offset = (
                float(_floats(mimic.attrib.get(key, drawn), 1)[0])
                for key, drawn in (("multiplier", "1"), ("offset", "0"))
            )
            followers[name] = (_said(mimic, "joint"), ratio, offset)
    loops = [
        Loop(name, body, _numbered(first), other, _numbered(second), kind == "ball")
        for name, kind, first, body, second, other in _CUT.findall(text)
    ]
    driven = [each for each in root.iterfind("transmission/joint") if "name" in each.attrib]
    sensors = {each.attrib["name"]: (1.0, 0.0) for each in driven}
    named = {each.attrib["name"] for each in joints}
    home = {  # a joint that would be called as its link is has another name
        name if name in named else f"{name}_joint": np.atleast_1d(value)
        for name, value in known.get("joints", {}).items()
    }
    return Scene(root.attrib.get("name", "model"), parts, loops, followers, home, sensors, known)


def _link(joint: ET.Element, end: str) -> str:
    element = joint.find(end)
    if element is None:
        raise SymkinError(f'has joint "{joint.attrib.get("name")}" without a {end}')
    return _said(element, "link")


def _moving(name: str, kind: str, axis: Array, anchor: Array | None = None) -> Moving:
    anchor = np.zeros(3) if anchor is None else anchor
    return Moving(name, kind, _unit(axis, f'joint "{name}" with axis'), anchor)


def _posed(xyz: str, rpy: str) -> Array:
    return frame_of(_floats(xyz, 3), _turned(*_floats(rpy, 3)))


def _turned(roll: float, pitch: float, yaw: float) -> Array:
    return _about(_Z, yaw) @ _about(_Y, pitch) @ _about(_X, roll)


def _numbered(text: str) -> Array:
    """A point, or a frame by point and roll, pitch, yaw."""
    numbers = text.split()
    return _posed(" ".join(numbers[:3]), " ".join(numbers[3:]) or "0 0 0")


_SDF_KINDS = {"revolute": "hinge", "continuous": "hinge", "prismatic": "slide"}


def _sdf(root: ET.Element, _text: str, known: Mapping[str, Any]) -> Scene:
    """Links stand at home, where joints are at zero; the second parents of links close loops."""
    model = root.find(".//model")
    if model is None:
        raise SymkinError("has no <model>")
    placed = {WORLD: np.eye(4)}
    for link in model.findall("link"):
        pose = link.find("pose")
        if pose is not None and pose.attrib:
            raise SymkinError("has poses relative to other frames; expected all in the model's")
        placed[_said(link, "name")] = _sdf_pose(pose)
    parts: dict[str, Part] = {}
    loops, later = [], []
    for joint in model.findall("joint"):
        name, kind = _said(joint, "name"), _said(joint, "type")
        parent, child = (_text_of(joint, end) for end in ("parent", "child"))
        parent = "" if parent == "world" else parent
        for each in (parent, child):
            if each not in placed:
                raise SymkinError(f'has joint "{name}" of link "{each}", which it has not')
        at = joint.find("pose")
        if at is not None and at.attrib:
            raise SymkinError(f'has joint "{name}" posed relative to another frame; not read')
        there = placed[child] @ _sdf_pose(at)
        if child in parts or kind == "ball":
            later.append((name, kind, parent, child, there))
            continue
        moving: tuple[Moving, ...] = ()
        frame = _within(placed[parent], placed[child])
        if kind != "fixed":
            if kind not in _SDF_KINDS:
                raise SymkinError(f'has joint "{name}" of type "{kind}", which is not read')
            axis = _floats(_text_of(joint, "axis/xyz"), 3)
            local = _within(placed[child], there)
            one = _moving(name, _SDF_KINDS[kind], local[:3, :3] @ axis)
            moving = (dataclasses.replace(one, anchor=local[:3, 3]),)
        parts[child] = Part(parent, frame, moving)
    for name, kind, parent, child, there in later:
        if kind not in ("ball", "fixed"):
            raise SymkinError(
                f'has link "{child}" with a second parent by joint "{name}" of type "{kind}"; '
                "expected ball or fixed"
            )
        first, second = (_within(placed[each], there) for each in (parent, child))
        loops.append(Loop(name, parent, first, child, second, kind == "ball"))
    free = [name for name in placed if name and name not in parts]
    home = {}
    for name in free:  # nothing holds it but loops
        moving = (Moving(f"{name}_free", "free", np.zeros(3), np.zeros(3)),)
        parts[name] = Part("", np.eye(4), moving)
        home[f"{name}_free"] = _standing(placed[name])
    sensors = {}
    readings = known.get("readings", ())
    for leg, (gain, reading) in enumerate(zip(known.get("gains", ()), readings, strict=True), 1):
        sensors[f"leg{leg}_active"] = (float(gain), -float(gain) * float(reading))
    # All joints are at zero together.
    followers = {
        name: (str(followed), float(ratio), 0.0)
        for name, (followed, ratio, _) in known.get("followers", {}).items()
    }
    name = model.attrib.get("name", "model")
    return Scene(name, parts, loops, followers, home, sensors, known)


def _sdf_pose(element: ET.Element | None) -> Array:
    return np.eye(4) if element is None else _numbered(element.text or "0 0 0")


def _text_of(joint: ET.Element, path: str) -> str:
    element = joint.find(path)
    if element is None or not (element.text or "").strip():
        raise SymkinError(f'has joint "{joint.attrib.get("name")}" without {path}')
    return str(element.text).strip()


def _home(raw: Any) -> dict[str, Array]:
    if not isinstance(raw, dict):
        raise WrongValueError("is not a table of values of joints; expected one")
    value = one_or_list(quantity("1"), 7, 7)
    return {name: np.atleast_1d(read_at(name, value, each)) for name, each in raw.items()}


_POINT, _ANGLES = list_of(quantity("m"), 3, 3), list_of(quantity("rad"), 3, 3)
_LOOP = table(
    {
        **{name: text() for name in ("name", "body", "other")},
        **{f"{of}{name}": kind for of in ("", "other_")
           for name, kind in (("point", _POINT), ("rpy", _ANGLES))},
        "closes": choice("point", "pose"),
    },
    ("body", "other"),
)  # fmt: skip
_LOOPS = table(
    {
        "loops": list_of(_LOOP),
        "active": list_of(text()),
        "home": Kind(_home, {}),
        "free": list_of(text()),
    }
)


def _with_loops(scene: Scene, path: Path) -> Scene:
    """The model with what a file beside it says of loops, joints that are read, and home."""
    source = read_toml(path)
    said = read_table(source, _LOOPS)
    loops = list(scene.loops)
    for number, each in enumerate(said.get("loops", [])):
        for key in ("body", "other"):
            if each[key] not in scene.parts:
                told = did_you_mean(each[key], list(scene.parts))
                raise source.error(("loops", number, key), f"is {each[key]!r}, no link{told}")
        ends = [
            frame_of(each.get(f"{of}point", np.zeros(3)), _turned(*each.get(f"{of}rpy", (0, 0, 0))))
            for of in ("", "other_")
        ]
        name = each.get("name", f"loop_{number + 1}")
        turns = each.get("closes", "point") == "point"
        loops.append(Loop(name, each["body"], ends[0], each["other"], ends[1], turns))
    return dataclasses.replace(
        scene,
        loops=loops,
        home={**scene.home, **said.get("home", {})},
        sensors=dict.fromkeys(said.get("active", ()), (1.0, 0.0)) or scene.sensors,
        known={**scene.known, **({"free": said["free"]} if said.get("free") else {})},
    )


def turn_from_z(along: Array) -> Array:
    """The smallest turn that brings z to a direction."""
    axis = np.cross(_Z, along)
    sine, cosine = float(np.linalg.norm(axis)), float(along[2])
    if sine < 1e-15:
        return np.eye(3) if cosine > 0 else np.diag([1.0, -1.0, -1.0])
    return _about(axis / sine, np.arctan2(sine, cosine))


def _about(axis: Array, angle: float) -> Array:
    return np.asarray(rotations_from_vectors((angle * axis)[None])[0])


def _within(frame: Array, other: Array) -> Array:
    """Another frame as it is seen in a frame."""
    return np.asarray(np.linalg.solve(frame, other))


def _standing(frame: Array) -> Array:
    """The seven values of a free joint: position, and quaternion, its real part first."""
    vectors = vectors_from_rotations(frame[None, :3, :3])
    turned = quaternions_from_rotation_vectors(vectors)[0]
    return np.array([*frame[:3, 3], turned[3], *turned[:3]])


def _said(element: ET.Element, name: str) -> str:
    """What an element must say."""
    try:
        return element.attrib[name]
    except KeyError:
        own = element.attrib.get("name")
        of = f' "{own}"' if own else ""
        raise SymkinError(f'has <{element.tag}>{of} without "{name}"') from None


def _unit(along: Array, what: str) -> Array:
    length = np.linalg.norm(along)
    if not length > 0:
        raise SymkinError(f"has {what} 0; expected a direction")
    return np.asarray(along / length)


def _floats(text: str, count: int | None = None) -> Array:
    try:
        numbers = np.array([float(each) for each in text.split()])
    except ValueError as error:
        raise SymkinError(f'has "{text}"; expected numbers') from error
    if not np.isfinite(numbers).all() or (count is not None and len(numbers) != count):
        raise SymkinError(f'has "{text}"; expected {count or "finite"} numbers')
    return numbers


def bodies_in_words(names: Iterator[str] | Sequence[str]) -> str:
    """Names, shortened."""
    return few(list(names), 6)
