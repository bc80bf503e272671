# SPDX-License-Identifier: MIT
"""Bodies and joints of legs that a file declares joint by joint, for models of simulators."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping, Sequence

import numpy as np

from symkin import _core
from symkin.errors import MechanismError, SymkinError
from symkin.exports.bodies import Body, Closure, Coupling, Joint, Structure, universal
from symkin.model.declared import declared_chain
from symkin.model.mechanism import Mechanism
from symkin.model.poses import Transform, rotations_from_vectors, transforms
from symkin.values import Array, record

_Z = np.array([0.0, 0.0, 1.0])
_STILL = np.eye(4)
_YAW = -2  # what follows the platform's turn, as the core has it
Step = tuple[str, int]


@record
class _End:
    """Where a path ends: a body, a transform in its frame, and the body's frames at the poses."""

    body: str
    fixed: Array  # 4 x 4
    rotation: Array  # (N, 3, 3)
    position: Array  # (N, 3)

    @property
    def points(self) -> Array:
        """The end in the base's frame, (N, 3)."""
        return np.asarray(self.position + self.rotation @ self.fixed[:3, 3])


class _Leg:
    """One leg, taken apart path by path; what two paths begin with is one branch."""

    def __init__(
        self,
        readings: Sequence[int],
        mechanism: Mechanism,
        rows: Array,
        platform: Transform,
        yaw: str,
    ) -> None:
        first = readings[0]
        chain = declared_chain(mechanism.chains[first])
        assert chain is not None
        self.name, self.chain = f"leg{first + 1}", chain
        self.own = {**chain.nominal, **mechanism.legs[first].parameters}
        # Of each joint that is read: its name, and its value where the model has it at zero.
        self.read: dict[int, tuple[str, float]] = {}
        for number in readings:
            declared = declared_chain(mechanism.chains[number])
            for index, (_, _, read, *_) in enumerate(declared.joints if declared else ()):
                if read:
                    zero = mechanism.legs[number].parameters["sensor_offset"]
                    self.read[index] = f"leg{number + 1}_active", zero
        self._numbers, self._ratios = chain.numbers_with(self.own)
        self.platform, self.yaw = platform, yaw
        self.bodies: list[Body] = []
        self.couplings: list[Coupling] = []
        self.closures: list[Closure] = []
        self.values: dict[str, Array] = {}
        parameters = np.array([self.own[name] for name in (*(s[0] for s in chain.scalars), "hand")])
        joints = np.asarray(_core.joints_at(chain.core(), parameters, rows))
        own = [index for index, joint in enumerate(chain.joints) if joint[3] == -1]
        self._columns = {index: joints[:, column] for column, index in enumerate(own)}
        self._reached: dict[tuple[Step, ...], _End] = {}
        self._count = len(rows)

    def take_apart(self) -> None:
        """Make bodies of all paths, and closures of all loops."""
        for number, (left, right, compares, length, read) in enumerate(self.chain.loops):
            name = f"{self.name}_end" if number == 0 else f"{self.name}_end_{number + 1}"
            if compares == "rotation":
                raise MechanismError(
                    "a model of bodies and joints is not written for declared legs that turn about "
                    "a centre"
                )
            path = [tuple(step) for step in left]
            turns = compares in ("pose", "planar pose")
            if compares == "planar pose" and self._is_free_turn(path[-1]):
                path, turns = path[:-1], False  # a hinge at the end holds a point
            end, other = self._walk(path), self._walk([tuple(step) for step in right])
            if compares == "distance":
                self._rod(name, end, other, length, read)
                continue
            self._close(name, end, other, turns=turns)

    def _close(self, name: str, end: _End, other: _End, *, turns: bool) -> None:
        frames = (end.fixed[:3, :3], other.fixed[:3, :3]) if turns else (None, None)
        self.closures.append(
            Closure(name, end.body, end.fixed[:3, 3], other.fixed[:3, 3], other.body, *frames)
        )

    def _rod(self, name: str, end: _End, other: _End, length: int, read: int) -> None:
        links = np.einsum("nji,nj->ni", end.rotation, other.points - end.points)
        place, called = end.fixed[:3, 3], name.replace("_end", "_rod")
        if read < 0:
            size = self.own[next(each[0] for each in self.chain.scalars if each[1] == length)]
            rod, values = universal(called, "link", end.body, place, size, links)
            self.bodies.append(rod)
            tip = rod.tip
        else:
            size = float(np.linalg.norm(links[0]))
            lower, values = universal(called, "lower", end.body, place, size / 2, links)
            active_name, zero = self.read[read]
            active = Joint(active_name, "slide", _Z)
            upper = Body(
                f"{called}_upper", lower.name, zero * _Z, np.eye(3), (active,), -size / 2 * _Z
            )
            self.bodies += [lower, upper]
            self.values[active.name] = np.linalg.norm(links, axis=1) - zero
            rod, tip = upper, np.zeros(3)
        self.values |= values
        self.closures.append(Closure(name, rod.name, tip, other.fixed[:3, 3], other.body))

    def _is_free_turn(self, step: Step) -> bool:
        return step[0] == "joint" and self._stands_alone(step[1])

    def _stands_alone(self, joint: int) -> bool:
        kind, _, _, follows, *_ = self.chain.joints[joint]
        return bool(kind == "R" and joint not in self.read and follows == -1)

    def _walk(self, steps: Sequence[Step]) -> _End:
        count = self._count
        still = np.broadcast_to(np.eye(3), (count, 3, 3)), np.zeros((count, 3))
        end = _End("", _STILL, *still)
        for number, (kind, index) in enumerate(steps, 1):
            if kind == "pose":
                end = _End("platform", _STILL, self.platform.rotation, self.platform.translation)
            elif kind == "transform":
                end = dataclasses.replace(end, fixed=end.fixed @ self._transform(index))
            else:
                so_far = tuple(steps[:number])
                if so_far not in self._reached:
                    self._reached[so_far] = self._moved(end, index)
                end = self._reached[so_far]
        return end

    def _moved(self, end: _End, index: int) -> _End:
        """A body behind a joint."""
        kind, axis, _, follows, _, offset = self.chain.joints[index]
        ratio = self._ratios[index]
        called, along = f"{self.name}_joint{index + 1}", np.array(axis, dtype=float)
        zero = 0.0
        if follows == -1:
            whole = self._columns[index]
        elif follows == _YAW:
            whole = ratio * self._values_of_yaw() + offset
            self.couplings.append(Coupling(called, self.yaw, ratio, offset))
        else:
            followed, shift = self._name_of(follows)
            whole = ratio * self._columns[follows] + offset
            self.couplings.append(Coupling(called, followed, ratio, offset + ratio * shift))
        if index in self.read:
            called, zero = self.read[index]
        placed = end.fixed @ _motion(kind, along, zero)
        joint = Joint(called, "hinge" if kind == "R" else "slide", along)
        self.bodies.append(
            Body(
                called.replace("_active", "_driven") + "_body",
                end.body,
                placed[:3, 3],
                placed[:3, :3],
                (joint,),
                np.zeros(3),
            )
        )
        self._draw_to(end)
        self.values[called] = whole - zero
        rotation = end.rotation @ end.fixed[:3, :3]
        position = end.points
        if kind == "R":
            rotation = rotation @ rotations_from_vectors(whole[:, None] * along)
        else:
            position = position + whole[:, None] * (rotation @ along)
        return _End(self.bodies[-1].name, _STILL, rotation, position)

    def _draw_to(self, end: _End) -> None:
        """Draw the body before a joint up to it."""
        for number, body in enumerate(self.bodies):
            if body.name == end.body and not body.tip.any():
                self.bodies[number] = dataclasses.replace(body, tip=end.fixed[:3, 3])

    def _name_of(self, index: int) -> tuple[str, float]:
        """A joint by itself, and its value where the model has it at zero."""
        return self.read.get(index, (f"{self.name}_joint{index + 1}", 0.0))

    def _values_of_yaw(self) -> Array:
        """The platform's turn about z."""
        turned = self.platform.rotation
        return np.asarray(np.arctan2(turned[:, 1, 0], turned[:, 0, 0]))

    def _transform(self, index: int) -> Array:
        numbers = self._numbers[index]
        azimuth, *place = numbers[:4]
        roll, pitch, yaw = numbers[4:7]
        matrix = np.eye(4)
        first = _turn("z", azimuth)
        matrix[:3, 3] = first @ place
        drawn = first @ _turn("z", yaw) @ _turn("y", pitch) @ _turn("x", roll)
        matrix[:3, :3] = drawn @ rotations_from_vectors(np.array([numbers[7:]]))[0]
        return matrix


def declared_structure(
    mechanism: Mechanism, rows: Array, platform: Body, moves: Mapping[str, Array]
) -> Structure:
    """Take a mechanism with declared legs apart, at home, the first row, and at poses.

    Raises
    ------
    SymkinError
        Where home is out of reach, or a leg is of a known chain.
    """
    legs = range(len(mechanism.legs))
    chains = [declared_chain(mechanism.chains[leg]) for leg in legs]
    for number, chain in enumerate(chains, 1):
        if chain is None:
            raise MechanismError(
                f"leg {number} is of a known chain and others are declared; a model of bodies and "
                "joints is written for the ones or the others"
            )
    if np.isnan(mechanism.inverse_kinematics(rows[:1])).any():
        raise SymkinError(f'home of "{mechanism.name}" is out of reach; a model is built there')
    yaw = platform.joints[-1].name
    placed = transforms(mechanism.pose_space, rows)
    made = [_Leg(leg, mechanism, rows, placed, yaw) for leg in mechanism.leg_readings]
    values: dict[str, Array] = dict(moves)
    far = 0.0
    for leg in made:
        leg.take_apart()
        values |= leg.values
        places = [np.linalg.norm(each.position) for each in leg.bodies if not each.parent]
        far = max(far, *map(float, places))
    size = far + float(np.linalg.norm(placed.translation[0]))
    return Structure(
        (platform, *(body for leg in made for body in leg.bodies)),
        tuple(closure for leg in made for closure in leg.closures),
        {name: each[1:] for name, each in values.items()},
        {name: each[0] for name, each in values.items()},
        size,
        tuple(coupling for leg in made for coupling in leg.couplings),
    )


def _turn(axis: str, angle: float) -> Array:
    vector = np.zeros((1, 3))
    vector[0, "xyz".index(axis)] = angle
    return np.asarray(rotations_from_vectors(vector)[0])


def _motion(kind: str, axis: Array, value: float) -> Array:
    matrix = np.eye(4)
    if kind == "R":
        matrix[:3, :3] = rotations_from_vectors((value * axis)[None])[0]
    else:
        matrix[:3, 3] = value * axis
    return matrix
