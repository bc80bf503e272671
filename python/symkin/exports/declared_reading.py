# SPDX-License-Identifier: MIT
"""Models for simulators as mechanisms: what of a tree and its loops is a leg, joint by joint.

The platform is a body; a leg is all that hangs together between the base and it. Its path runs to
where it holds the platform, by the tree or by a constraint; what closes further loops within the
leg, or holds the platform too, is a loop of its own, or a rod, where it is one between two points.
"""

from __future__ import annotations

import dataclasses
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from itertools import zip_longest
from typing import Any, NamedTuple

import numpy as np

from symkin import _core
from symkin.errors import SymkinError, did_you_mean
from symkin.exports.scene import WORLD, Loop, Moving, Scene, frame_of
from symkin.exports.scenes import bodies_in_words, turn_from_z
from symkin.files.declared_legs import declared_leg
from symkin.model.chains import Leg, chain_info, common_reading_unit, platform_of
from symkin.model.declared import declare, declared_chain
from symkin.model.mechanism import Mechanism
from symkin.model.poses import (
    POSE_SPACES,
    PoseSpace,
    Transform,
    coordinates_of,
    poses_from_bounds,
    roll_pitch_yaw,
    rotations_from_quaternions,
    rotations_from_vectors,
)
from symkin.model.settings import WorkspaceSettings
from symkin.storage.toml_file import WrongValueError, dotted
from symkin.values import Array

_Path = Sequence[tuple[Array, Moving | None]]  # transforms, each with the joint behind it
_PLATFORM = "platform"
_NOTHING = 1e-12  # m and rad
_CROSSING = 1e-9
_ALIKE = 0.3  # m and rad: joints at home of legs that stand alike
_AROUND = 0.05  # of the size, m, and rad: the box around home
_SLOTS = ("x", "y", "z", "roll", "pitch", "yaw")
_ASSUMED = (
    "The workspace is a small box around home, and noise and tolerances are symkin's: a model says "
    "nothing of them",
    "Lengths of links that are not zero, and all points at base and platform, count as parameters; "
    "write exact, or further numbers, in the file",
)
_SPACES = {  # joints by which a platform moves, slides by their axes and hinges
    ("x", "y", "z"): "translating",
    ("x", "y", "z", "rz"): "schoenflies",
    ("x", "y"): "point",
    ("x", "y", "rz"): "planar",
}


class _End(NamedTuple):
    """Where a leg holds the platform."""

    body: str
    frame: Array  # there, in the body's
    beside: list[tuple[Array, Moving | None]]  # the way there from the platform's
    closes: str  # what of them agrees


class _Rod(NamedTuple):
    """A rod at the end of a path."""

    path: list[tuple[Array, Moving | None]]  # to where it begins
    length: float  # or what a strut has beside its slide's value
    slide: Moving | None


@dataclasses.dataclass
class _Draft:
    """A leg while it is read; frames by the names of its transforms."""

    bodies: Sequence[str]
    paths: list[list[str]]  # names of transforms, and joints as the file has them
    frames: dict[str, Array]
    platform_paths: list[list[str]]
    platform: bool  # whether its path ends at the platform
    several: bool = False  # whether it is written as a list of paths, of which none closes
    closes: str = ""
    rods: list[dict[str, Any]] = dataclasses.field(default_factory=list)
    loops: list[dict[str, Any]] = dataclasses.field(default_factory=list)
    home: dict[str, float] = dataclasses.field(default_factory=dict)
    sensors: list[tuple[str, float, float]] = dataclasses.field(default_factory=list)

    @property
    def kind(self) -> str:
        """What legs of one chain have in common."""
        rods = [{**each, "length": isinstance(each["length"], str)} for each in self.rods]
        paths = self.paths, self.platform_paths
        return repr((paths, self.closes, rods, self.loops, [*self.home]))


def mechanism_of_scene(scene: Scene, body: str = "") -> tuple[Mechanism, tuple[str, ...]]:
    """Return a mechanism with declared legs, and what was assumed."""
    reader = _Reader(scene, body or _PLATFORM)
    drafts = reader.drafts()
    platform = platform_of(reader.space.name)
    free: tuple[str, ...] = tuple(scene.known.get("free", ()))
    legs, alone = _of_chains(drafts, reader, platform, free, alone=True)
    if not alone:
        legs, _ = _of_chains(drafts, reader, platform, free, alone=False)
    # The first reading of each leg, the second, ...; then what legs bind without one.
    of_each = [legs[id(draft)] for draft in drafts]
    counts = [len(draft.sensors) for draft in drafts]
    ordered = [
        leg
        for part in ([o[:n] for o, n in zip(of_each, counts, strict=True)],
                     [o[n:] for o, n in zip(of_each, counts, strict=True)])
        for row in zip_longest(*part)
        for leg in row
        if leg is not None
    ]  # fmt: skip
    infos = [chain_info(each.chain, platform) for each in ordered]
    info, units = infos[0], list(reader.space.units)
    far = max(
        (float(np.linalg.norm(f[:3, 3])) for d in drafts for f in d.frames.values()), default=1.0
    )
    middle = np.array([reader.home[units.index(each)] for each in info.box])
    size = np.array([_AROUND * (far if unit == "m" else 1.0) for unit in info.box.values()])
    lower, upper, home = (
        info.whole(each.tolist()) for each in (middle - size, middle + size, middle)
    )
    box = WorkspaceSettings(lower, upper, home=home)
    unit = scene.known.get("reading_unit") or common_reading_unit(infos, "leg")
    mechanism = Mechanism(scene.name, ordered, platform=platform, reading_unit=unit, workspace=box)
    return mechanism, _ASSUMED


def _of_chains(
    drafts: Sequence[_Draft],
    reader: _Reader,
    platform: str,
    free: Sequence[str],
    *,
    alone: bool,
) -> tuple[dict[int, list[Leg]], bool]:
    """The legs of each draft, and whether they can stand as those of one chain, where asked for."""
    legs: dict[int, list[Leg]] = {}
    waiting, number = list(drafts), 0
    while waiting:
        number += 1
        label = "leg" if number == 1 else f"leg_{number}"
        group = [each for each in waiting if _stand_alike(waiting[0], each)]
        chains, made = _of_one_chain(label, group, reader, platform, free, alone=alone)
        # One that stands on another branch has a chain of its own.
        kept = [each for each in group if _closes(chains[0], made[id(each)][0], reader)]
        if len(kept) < len(group):
            group = kept or group[:1]
            chains, made = _of_one_chain(label, group, reader, platform, free, alone=alone)
        closures = chain_info(chains[0], platform).closures
        equations = max(closures, len(chains))
        if equations > max(1, len(group[0].sensors)) and not free:
            raise SymkinError(
                f"has legs that bind the platform, {equations} equations each; expected which "
                f"of {', '.join(reader.space.units)} can be chosen, free = [...] in a file of loops"
            )
        if alone and closures > 1 and len(group) < len(drafts):
            return {}, False
        legs |= made
        waiting = [each for each in waiting if id(each) not in legs]
    return legs, True


def _stand_alike(first: _Draft, other: _Draft) -> bool:
    """Whether legs have the same joints, which stand nearly alike at home."""
    return first.kind == other.kind and all(
        abs(value - other.home[name]) < _ALIKE for name, value in first.home.items()
    )


def _of_one_chain(
    label: str,
    group: Sequence[_Draft],
    reader: _Reader,
    platform: str,
    free: Sequence[str],
    *,
    alone: bool,
) -> tuple[list[str], dict[int, list[Leg]]]:
    """The chains of legs that are alike, of each reading and equation beside, and the legs."""
    table = {**reader.table(group), "pose": reader.home, **({"free": list(free)} if free else {})}
    try:
        declared = declared_leg(label, table, {"platform": platform}, alone=alone)
    except WrongValueError as error:
        if group[0].sensors:
            place = f"{dotted(error.keys)}: " if error.keys else ""
            raise SymkinError(f"{place}{error}") from error
        raise SymkinError(
            f"has a leg of {bodies_in_words(group[0].bodies)} of which no joint is read; expected "
            f"an actuator, a sensor, or active = [...] in a file of loops: {error}"
        ) from error
    chains = [declare(each) for each in declared]
    return chains, {id(each): _legs_of(chains, each, reader.planar) for each in group}


def _closes(chain: str, leg: Leg, reader: _Reader) -> bool:
    """Whether a leg closes at home on its chain's branch."""
    declared = declared_chain(chain)
    assert declared is not None
    names = (*(scalar[0] for scalar in declared.scalars), "hand")
    own = np.array([leg.parameters[name] for name in names])
    pose = poses_from_bounds(reader.space.name, reader.home)
    return bool(np.isfinite(_core.joints_at(declared.core(), own, pose[None])).all())


def _legs_of(chains: Sequence[str], draft: _Draft, planar: bool) -> list[Leg]:
    """A leg with its own numbers, once for each reading and equation beside."""
    own = {
        f"{name}_{slot}": value
        for name, frame in draft.frames.items()
        for slot, value in {**dict.fromkeys(_SLOTS, 0.0), **_numbers(frame, planar)}.items()
    }
    made = []
    for chain, sensor in zip_longest(chains, draft.sensors):
        gain, offset = (1.0, 0.0) if sensor is None else sensor[1:]
        declared = declared_chain(chain)
        assert declared is not None
        values = {each: own.get(each, drawn) for each, drawn in declared.nominal.items()}
        values |= {rod["name"] + "_length": rod["length"] for rod in draft.rods
                   if isinstance(rod["length"], float)}  # fmt: skip
        made.append(Leg(chain, values | {"sensor_gain": gain, "sensor_offset": offset}, 1))
    return made


class _Reader:
    """A model with its platform."""

    def __init__(self, scene: Scene, platform: str) -> None:
        if platform not in scene.parts:
            raise SymkinError(
                f'has no body "{platform}"{did_you_mean(platform, sorted(scene.parts))}, which '
                f"would be the platform; it has {bodies_in_words(list(scene.parts))}"
            )
        self.scene, self.platform = scene, platform
        self.at_ends: set[str] = set()  # transforms at base and platform that bear other names
        line = [joint for _, joint in scene.joints_to(platform)]
        moving = self._moving(line)
        carried = moving is None  # by a leg
        self.carriers = {platform} if carried else set(scene.line(platform))
        space, self.yaw = moving or (self._carried_space(), "")
        self.space: PoseSpace = POSE_SPACES[space]
        self.planar = self.space.size == 2
        self.home = self._home_pose(carried or not line)

    def _moving(self, line: Sequence[Moving]) -> tuple[str, str] | None:
        """How a platform moves by joints of its own, and the joint of its turn about z.

        None where it does not: where one of them is read, or they leave it fewer freedoms than
        such platforms have, they are a leg's.
        """
        if any(joint.name in self.scene.sensors for joint in line):
            return None
        if not line:
            return self._carried_space(), ""
        if [joint.kind for joint in line] == ["free"]:
            return "spatial", ""
        along = [int(np.argmax(np.abs(joint.axis))) for joint in line]
        names = tuple(
            ("" if joint.kind == "slide" else "r") + "xyz"[axis]
            for joint, axis in zip(line, along, strict=True)
            if joint.kind in ("slide", "hinge") and joint.axis[axis] > 1 - _NOTHING
        )
        if len(names) < len(line) or names not in _SPACES:
            return None
        return _SPACES[names], line[-1].name if names[-1] == "rz" else ""

    def _carried_space(self) -> str:
        every = [joint for part in self.scene.parts.values() for joint in part.joints]
        in_plane = all(each.kind == "hinge" and abs(each.axis[2]) > 1 - _NOTHING for each in every)
        return "planar" if in_plane else "spatial"

    def value(self, joint: str) -> float:
        return float(self.scene.home.get(joint, np.zeros(1))[0])

    def _home_pose(self, carried: bool) -> list[float]:
        """Where the platform stands at home: position, then angle or rotation vector."""
        placed = np.eye(4)
        for name in self.scene.line(self.platform):
            part = self.scene.parts[name]
            placed = placed @ part.frame
            for joint in part.joints:
                placed = placed @ self._motion(joint)
        if not carried:
            start = np.eye(4)
            for name in self.scene.line(self.platform):
                start = start @ self.scene.parts[name].frame
            if not np.allclose(start[:3, :3], np.eye(3), atol=_NOTHING):
                raise SymkinError("has a platform that is turned before its joints move it")
        motion = Transform(placed[None, :3, :3], placed[None, :3, 3])
        return [float(each) for each in coordinates_of(self.space.name, motion)[0]]

    def _motion(self, joint: Moving) -> Array:
        moved = np.eye(4)
        if joint.kind == "free":
            value = self.scene.home.get(joint.name)
            if value is None or len(value) != 7:
                raise SymkinError(
                    f'says not where body "{self.platform}" is at home; expected a key frame, or '
                    f'home = {{ "{joint.name}" = [x, y, z, qw, qx, qy, qz] }} in a file of loops'
                )
            moved[:3, :3] = rotations_from_quaternions(value[None, [4, 5, 6, 3]])[0]
            moved[:3, 3] = value[:3]
        elif joint.kind == "slide":
            moved[:3, 3] = self.value(joint.name) * joint.axis
        elif joint.kind == "hinge":
            turn = rotations_from_vectors((self.value(joint.name) * joint.axis)[None])[0]
            moved[:3, :3] = turn
            moved[:3, 3] = joint.anchor - turn @ joint.anchor
        return moved

    def _components(self) -> list[list[str]]:
        """Bodies that hang together without base and platform, in the model's order."""
        of = {name: name for name in self.scene.parts if name not in self.carriers}

        def root(name: str) -> str:
            while of[name] != name:
                name = of[name]
            return name

        for name in list(of):
            parent = self.scene.parts[name].parent
            if parent in self.carriers and parent != self.platform:
                raise SymkinError(f'has body "{name}" on what moves the platform')
            if parent not in (WORLD, self.platform):
                of[root(name)] = root(parent)
        for loop in self.scene.loops:
            for end in (loop.body, loop.other):
                if end == WORLD:
                    raise SymkinError(f'has loop "{loop.name}" that ends at the base, not a leg')
            if loop.body in of and loop.other in of:
                of[root(loop.body)] = root(loop.other)
        found: dict[str, list[str]] = {}
        for name in of:
            found.setdefault(root(name), []).append(name)
        return list(found.values())

    def _held(self, bodies: Sequence[str]) -> Iterator[_End]:
        """Where a leg holds the platform."""
        if self.scene.parts[self.platform].parent in bodies:
            yield _End(self.platform, np.eye(4), [(np.eye(4), None)], "pose")
        for loop in self.scene.loops:
            ends = ((loop.body, loop.frame), (loop.other, loop.other_frame))
            for (one, frame), (other, beside) in (ends, ends[::-1]):
                if one in bodies and not self.is_behind(one) and self.is_behind(other):
                    way = self.path(other, beside, self.platform)
                    yield _End(one, frame, way, "point" if loop.turns else "pose")

    def is_behind(self, body: str) -> bool:
        """Whether a body is the platform, or hangs on it."""
        return self.platform in self.scene.line(body)

    def path(
        self, body: str, frame: Array, start: str = WORLD
    ) -> list[tuple[Array, Moving | None]]:
        """Transforms, each with the joint behind it, to a frame of a body; axes are x, y or z."""
        steps: list[tuple[Array, Moving | None]] = []
        fixed: Array = np.eye(4)
        line = self.scene.line(body)
        for name in line[line.index(start) + 1 if start else 0 :]:
            part = self.scene.parts[name]
            fixed = fixed @ part.frame
            for joint in part.joints:
                if joint.kind == "free":
                    raise SymkinError(f'has body "{name}" that flies free within a leg')
                to = frame_of(joint.anchor, self._turn_to(joint))
                axis = to[:3, :3].T @ joint.axis
                steps.append((fixed @ to, dataclasses.replace(joint, axis=axis)))
                fixed = np.asarray(np.linalg.inv(to))
        return [*steps, (fixed @ frame, None)]

    def _turn_to(self, joint: Moving) -> Array:
        """Axes of which one is the joint's; those of its body, where they are."""
        if self.planar and joint.kind == "hinge" and abs(joint.axis[2]) < 1 - _NOTHING:
            raise SymkinError(f'has joint "{joint.name}" that leaves the plane of the platform')
        if np.abs(joint.axis).max() > 1 - _NOTHING or joint.kind == "ball":
            return np.eye(3)
        if self.planar:
            x, y, _ = joint.axis
            return np.array([[x, -y, 0.0], [y, x, 0.0], [0.0, 0.0, 1.0]])
        return turn_from_z(joint.axis)

    def drafts(self) -> list[_Draft]:
        """The legs."""
        components = self._components()
        legs = []
        for bodies in components:
            ends = list(self._held(bodies))
            if not ends and not any(self.scene.parts[each].joints for each in bodies):
                continue  # a piece of the base
            if not ends:
                raise SymkinError(
                    f"has bodies {bodies_in_words(bodies)} that do not hold the platform; expected "
                    "a loop from them to it"
                )
            legs.append((bodies, ends))
        if not legs:
            raise SymkinError("has no body that holds the platform")
        few = len(legs) < self.space.dof
        return [_LegReader(self, bodies, ends, few=few).draft() for bodies, ends in legs]

    def table(self, group: Sequence[_Draft]) -> dict[str, Any]:
        """The table of a chain, with the first leg's numbers."""
        first = group[0]
        keys = {name: self._keys(name, [each.frames[name] for each in group])
                for name in first.frames}  # fmt: skip
        own = {name: _numbers(frame, self.planar) for name, frame in first.frames.items()}

        def item(name: str) -> Any:
            if name not in keys:
                return name
            return {"name": name} | {slot: own[name].get(slot, 0.0) for slot in keys[name]}

        def items(names: Sequence[str]) -> list[Any]:
            return [item(name) for name in names if keys.get(name, True)]

        def point(name: str, *, named: bool) -> dict[str, Any]:
            made = dict(item(name))
            return made if named else {key: each for key, each in made.items() if key != "name"}

        def of_rod(rod: Mapping[str, Any]) -> dict[str, Any]:
            ends = {end: point(f"{rod['name']}_{end}", named=False) for end in ("at", "end")}
            return {**rod, **ends}

        def of_loop(loop: Mapping[str, Any]) -> dict[str, Any]:
            return {**loop, "path": items(loop["path"]), "at": point(loop["at"], named=True)}

        def of_paths(paths: Sequence[Sequence[str]]) -> list[Any]:
            return [items(each) for each in paths] if first.several else items(paths[0])

        table: dict[str, Any] = {"path": of_paths(first.paths), "home": dict(first.home)}
        if first.platform_paths:
            table["platform_path"] = of_paths(first.platform_paths)
        if first.platform:
            table["closes"] = first.closes
        if first.rods:
            table["rods"] = [of_rod(each) for each in first.rods]
        if first.loops:
            table["loops"] = [of_loop(each) for each in first.loops]
        return table

    def _keys(self, name: str, frames: Sequence[Array]) -> list[str]:
        """The numbers of a transform that are written: where one leg has one, and all of an end."""
        numbers = [_numbers(each, self.planar) for each in frames]
        ends = (
            name in ("base", "mount", "platform") or name.endswith("_end") or name in self.at_ends
        )
        always = ("x", "y") if self.planar else ("x", "y", "z")
        return [
            slot
            for slot in _SLOTS
            if any(slot in each for each in numbers) or (ends and slot in always)
        ]


def _numbers(frame: Array, planar: bool) -> dict[str, float]:
    """The numbers of a transform that are not zero."""
    angles = roll_pitch_yaw(frame[None, :3, :3])[0]
    numbers = dict(zip(_SLOTS, map(float, (*frame[:3, 3], *angles)), strict=True))
    if planar:
        if max(abs(numbers["roll"]), abs(numbers["pitch"])) > _CROSSING:
            raise SymkinError("has a leg that leaves the plane in which the platform moves")
        numbers = {slot: numbers[slot] for slot in ("x", "y", "yaw")}
    return {slot: value for slot, value in numbers.items() if abs(value) > _NOTHING}


class _LegReader:
    """One leg while it is read."""

    def __init__(
        self, model: _Reader, bodies: Sequence[str], ends: Sequence[_End], *, few: bool
    ) -> None:
        self.model, self.scene, self.bodies, self.few = model, model.scene, bodies, few
        self.ends = sorted(ends, key=lambda end: not any(map(self._is_read, self._line(end.body))))
        self.names: dict[str, tuple[str, float]] = {}  # of joints here, and which way they count
        self.extra: dict[str, float] = {}  # what a strut's length has beside its slide's value
        self.made = _Draft(bodies, [], {}, [], True)
        self.behind: set[tuple[str, ...]] = set()  # joints of paths that are written
        of_tree = [model.platform] if model.platform in (end.body for end in ends) else []
        self.read = [
            joint.name
            for body in (*bodies, *of_tree)
            for joint in self.scene.parts[body].joints
            if self._is_read(joint)
        ]
        if not self.scene.sensors:
            raise SymkinError(
                "has no joint that is read; expected an actuator, a sensor, or active = [...] in a "
                "file of loops"
            )

    def _line(self, body: str) -> list[Moving]:
        return [joint for _, joint in self.scene.joints_to(body)]

    def _is_read(self, joint: Moving) -> bool:
        return joint.name in self.scene.sensors

    def draft(self) -> _Draft:
        """Read it."""
        first, *others = self.ends
        model_side = self.model.is_behind
        inner = [
            loop for loop in self.scene.loops
            if loop.body in self.bodies and loop.other in self.bodies
            and model_side(loop.body) == model_side(loop.other)
        ]  # fmt: skip
        rod = self._rod_of(first, others)
        if any(len(end.beside) > 1 for end in (others if rod is None else self.ends)):
            self._several()
        else:
            self._one(first, rod, others, "mount" if others or inner else "base")
        for number, loop in enumerate(inner, 1):
            self._add_inner(loop, f"inner_{number}")
        for name in self.read:
            if name not in self.names:
                raise SymkinError(f'reads joint "{name}", which moves nothing of the platform')
        self.made.sensors = [self._sensor(name) for name in self.names if name in self.read]
        self.made.home = {
            own: sign * self.model.value(name) + self.extra.get(name, 0.0)
            for name, (own, sign) in self.names.items()
            if name not in self.scene.followers
        }
        return self.made

    def _rod_of(self, first: _End, others: Sequence[_End]) -> _Rod | None:
        """What the leg's path ends in, where that is a rod."""
        path = self.model.path(first.body, first.frame)
        if self.few or others or any(step.kind == "ball" for _, step in path if step is not None):
            return self._rod(path, first.closes, strut=self.few)
        return None

    def _one(self, first: _End, rod: _Rod | None, others: Sequence[_End], start: str) -> None:
        """A leg of one path, and what holds the platform beside it."""
        if rod is not None:
            self.made.platform = False
            self.made.paths.append(self._written(rod.path[:-1], start))
            self._add_rod(rod, first.beside[0][0], "rod")
        else:
            path = self.model.path(first.body, first.frame)
            self.made.paths.append(self._written(path, start))
            self.made.platform_paths.append(self._written(first.beside, "platform"))
            self.made.closes = first.closes
        for number, end in enumerate(others, 2):
            path = self.model.path(end.body, end.frame)
            rod = self._rod(path, end.closes, strut=False)
            if rod is not None:
                self._add_rod(rod, end.beside[0][0], f"rod_{number}")
            else:
                at = end.beside[0][0]
                self._add_loop(path, f"loop_{number}", "platform", at, end.closes)

    def _several(self) -> None:
        """A leg that holds joints of the platform several times: paths, and rods and loops between.

        A path ends behind the last joint before a rod or, of a loop, behind the last that is read
        or that another loop has, too.
        """
        self.made.platform, self.made.several = False, True
        paths = [self.model.path(end.body, end.frame) for end in self.ends]
        for number, (end, path) in enumerate(zip(self.ends, paths, strict=True), 1):
            rod = self._rod(path, end.closes, strut=self.few)
            stem = path[: self._stem(path, paths)] if rod is None else rod.path[:-1]
            self._branch(stem, self.made.paths, "base")
            self._branch(end.beside[:-1], self.made.platform_paths, "platform")
            last = end.beside[-2][1] if len(end.beside) > 1 else None
            to, at = "platform" if last is None else self._origin([last]), end.beside[-1][0]
            if rod is not None:
                self._add_rod(rod, at, f"rod_{number}", to)
            else:
                self._add_loop(path, f"loop_{number}", to, at, end.closes)

    def _stem(self, path: _Path, paths: Sequence[_Path]) -> int:
        """How many steps of a loop's path are a path of the leg."""
        counts = Counter(step.name for each in paths for _, step in each if step is not None)
        return max(
            (
                number
                for number, (_, joint) in enumerate(path, 1)
                if joint is not None and (self._is_read(joint) or counts[joint.name] > 1)
            ),
            default=0,
        )

    def _branch(self, path: _Path, into: list[list[str]], name: str) -> None:
        """Write a path beside others, unless it is written."""
        joints = tuple(joint.name for _, joint in path if joint is not None)
        if not joints or joints in self.behind:
            return
        parted = next((each for each in joints if each in self.names), None)
        if parted is not None:
            raise SymkinError(
                f"has a leg of {bodies_in_words(self.bodies)} whose ways part behind joint "
                f'"{parted}"; expected each crank, and each joint of the platform that the leg '
                "holds, on a way of its own, with rods or links between them"
            )
        self.behind.add(joints)
        name = f"{name}_{len(into) + 1}"
        self.model.at_ends.add(name)
        into.append(self._written(path, name))

    def _sensor(self, joint: str) -> tuple[str, float, float]:
        own, sign = self.names[joint]
        gain, offset = self.scene.sensors[joint]
        return own, sign * gain, sign * offset + self.extra.get(joint, 0.0)

    def _written(self, path: _Path, first: str) -> list[str]:
        """A path as the file has it; its transforms become frames."""
        into: list[str] = []
        for number, (frame, joint) in enumerate(path):
            name = first if number == 0 else f"link_{len(self.made.frames)}"
            into.append(name)
            is_tip = joint is None and self.made.platform and self.ends[0].closes == "point"
            self.made.frames[name] = _point(frame, "point") if is_tip else frame
            if joint is not None:
                into.append(self._joint(joint))
        return into

    def _joint(self, joint: Moving) -> str:
        """A joint as the file has it."""
        if joint.kind == "ball":
            raise SymkinError(
                f'has ball joint "{joint.name}" within a leg; expected it at the end of one, '
                "before a rod, or as three hinges"
            )
        along = int(np.argmax(np.abs(joint.axis)))
        sign = float(np.sign(joint.axis[along]))
        letter = "R" if joint.kind == "hinge" else "P"
        if self._is_read(joint):
            own = "q" if len(self.read) == 1 else f"q{self.read.index(joint.name) + 1}"
            letter = f"[{letter}]"
        else:
            own = f"j{len(self.names) + 1}"
        axis = "" if self.model.planar and joint.kind == "hinge" else f" {'xyz'[along]}"
        rule = ""
        if joint.name in self.scene.followers:
            followed, ratio, offset = self.scene.followers[joint.name]
            if followed == self.model.yaw:
                word, other = self.model.space.rotation[0], 1.0
            elif followed in self.names:
                word, other = self.names[followed]
            else:
                raise SymkinError(
                    f'has joint "{joint.name}" that follows "{followed}", which is not before it '
                    "in its leg"
                )
            ratio, offset = sign * other * ratio, sign * offset
            rule = f" = {'-' if ratio < 0 else ''}{abs(ratio)!r} {word}"
            if offset:
                unit = "rad" if joint.kind == "hinge" else "m"
                rule += f" {'-' if offset < 0 else '+'} {abs(offset)!r} {unit}"
        self.names[joint.name] = (own, sign)
        return f"{own}: {letter}{axis}{rule}"

    def _is_passive(self, joint: Moving) -> bool:
        followed = {each for each, *_ in self.scene.followers.values()}
        return joint.name not in {*self.scene.sensors, *self.scene.followers, *followed}

    def _rod(
        self, path: list[tuple[Array, Moving | None]], closes: str, *, strut: bool
    ) -> _Rod | None:
        """The rod or strut that a path ends in: behind a ball, or two hinges that cross."""
        joints = [joint for _, joint in path if joint is not None]
        frames = [frame for frame, _ in path]
        slide = joints[-1] if joints and joints[-1].kind == "slide" and strut else None
        turning = joints[:-1] if slide is not None else joints
        if closes != "point" or not turning or not self._is_passive(turning[-1]):
            return None
        if turning[-1].kind == "ball":
            start = len(turning) - 1
        else:
            start = len(turning) - 2
            if start < 0 or not self._is_passive(turning[-2]):
                return None
            if turning[-1].kind != "hinge" or turning[-2].kind != "hinge":
                return None
            between = frames[start + 1]
            crossing = turning[-2].axis @ between[:3, :3] @ turning[-1].axis
            if np.linalg.norm(between[:3, 3]) > _CROSSING or abs(crossing) > _CROSSING:
                return None
        before = [*path[:start], (frames[start], None)]
        if slide is None:
            return _Rod(before, float(np.linalg.norm(frames[-1][:3, 3])), None)
        along = frames[-2][:3, :3] @ slide.axis
        beside = frames[-2][:3, 3] + frames[-2][:3, :3] @ frames[-1][:3, 3]
        straight = np.linalg.norm(beside - (beside @ along) * along) < _CROSSING
        if not self._is_read(slide) or not straight:
            return None
        return _Rod(before, float(beside @ along), slide)

    def _add_rod(self, rod: _Rod, beside: Array, name: str, to: str = "platform") -> None:
        origin = self._origin([joint for _, joint in rod.path if joint is not None])
        if origin == "base":
            self.model.at_ends.add(f"{name}_at")
        said: Any = rod.length
        if rod.slide is not None:
            self.names[rod.slide.name], said = ("q", 1.0), "[q]"
            self.extra[rod.slide.name] = rod.length
        self.made.frames[f"{name}_at"] = _point(rod.path[-1][0], "point")
        self.made.frames[f"{name}_end"] = _point(beside, "point")
        self.made.rods.append({"name": name, "from": origin, "to": to, "length": said})

    def _origin(self, joints: Sequence[Moving]) -> str:
        """The joint behind which a path leaves the main one, in the file's words."""
        if not joints:
            return "base"
        if joints[-1].name not in self.names:
            raise SymkinError(
                f'has a loop behind joint "{joints[-1].name}", which is not on its leg\'s own way '
                "to the platform"
            )
        return self.names[joints[-1].name][0]

    def _add_loop(
        self, path: list[tuple[Array, Moving | None]], name: str, to: str, at: Array, closes: str
    ) -> None:
        joints = [joint for _, joint in path if joint is not None]
        common = 0
        while common < len(joints) and joints[common].name in self.names:
            common += 1
        origin = self._origin(joints[:common])
        own = self._written(path[common:], f"{name}_start")
        self.made.frames[f"{name}_at"] = _point(at, closes)
        self.made.loops.append(
            {"from": origin, "path": own, "to": to, "at": f"{name}_at", "closes": closes}
        )

    def _add_inner(self, loop: Loop, name: str) -> None:
        """A loop within the leg: one of its ends is on the leg's own way."""
        ends = ((loop.body, loop.frame), (loop.other, loop.other_frame))
        for (body, frame), (other, beside) in (ends, ends[::-1]):
            start = self.model.platform if self.model.is_behind(other) else WORLD
            on = self.model.path(other, beside, start)
            joints = [joint for _, joint in on if joint is not None]
            if all(joint.name in self.names for joint in joints):
                closes = "point" if loop.turns else "pose"
                path, to = self.model.path(body, frame, start), self._origin(joints)
                rod = self._rod(path, closes, strut=False) if start else None
                if rod is not None:
                    self._add_rod(rod, on[-1][0], name, to)
                else:
                    self._add_loop(path, name, to, on[-1][0], closes)
                return
        raise SymkinError(f'has loop "{loop.name}" beside the leg\'s own way to the platform')


def _point(frame: Array, closes: str) -> Array:
    """A frame of which the point alone says something, where points meet."""
    return frame_of(frame[:3, 3], np.eye(3)) if closes == "point" else frame
