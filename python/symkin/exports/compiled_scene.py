# SPDX-License-Identifier: MIT
"""MJCF with defaults, includes or what is repeated, as MuJoCo itself writes it out."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from symkin.errors import SymkinError
from symkin.exports.scene import WORLD, Loop, Moving, Part, Scene, frame_of, of_quaternion
from symkin.values import Array

_KINDS = ("free", "ball", "slide", "hinge")  # as MuJoCo counts them
_NO_MASS = 1e-6  # kg and kg m^2, of bodies that have none: only the geometry is read


def compiled_scene(path: Path, known: Mapping[str, Any]) -> Scene:
    """Read a model that MuJoCo compiles.

    Raises
    ------
    SymkinError
        Without MuJoCo, and where it does not take the model.
    """
    mujoco = _mujoco()
    try:
        spec = mujoco.MjSpec.from_file(str(path))
        compiler = getattr(spec, "compiler", spec)
        compiler.boundmass = compiler.boundinertia = _NO_MASS
        model = spec.compile()
    except (ValueError, mujoco.FatalError) as error:
        raise SymkinError(f"is no model that MuJoCo takes: {error}") from error
    return _Compiled(mujoco, model).scene(known)


def _mujoco() -> Any:
    try:
        import mujoco
    except ImportError as error:
        raise SymkinError(
            "has defaults, includes or repeated parts, which MuJoCo writes out: pip install "
            "mujoco, or write the model out"
        ) from error
    return mujoco


class _Compiled:
    def __init__(self, mujoco: Any, model: Any) -> None:
        self.mujoco, self.model = mujoco, model
        self.bodies = [WORLD]
        self.bodies += [model.body(i).name or f"body_{i}" for i in range(1, model.nbody)]
        self.joints: list[str] = []
        for i in range(model.njnt):
            body = int(model.jnt_bodyid[i])
            number = i - int(model.body_jntadr[body]) + 1
            self.joints.append(model.joint(i).name or f"{self.bodies[body]}_joint_{number}")

    def scene(self, known: Mapping[str, Any]) -> Scene:
        """What the model says."""
        model, kinds = self.model, self.mujoco.mjtEq
        loops: list[Loop] = []
        followers: dict[str, tuple[str, float, float]] = {}
        for i in range(model.neq):
            if not model.eq_active0[i]:
                continue
            kind = kinds(model.eq_type[i])
            if kind == kinds.mjEQ_JOINT:
                followers |= self.follower(i)
            elif kind in (kinds.mjEQ_CONNECT, kinds.mjEQ_WELD):
                loops.append(self.loop(i, f"loop_{len(loops) + 1}"))
            else:
                raise SymkinError(f"has an equality {kind.name}; expected connect, weld or joint")
        parts, standing = self.parts()
        zeros = {
            name: float(model.qpos0[model.jnt_qposadr[i]])
            for i, name in enumerate(self.joints)
            if _KINDS[model.jnt_type[i]] in ("slide", "hinge")
        }
        home = standing | (self.home(zeros) if model.nkey else {})
        sensors = {name: (gain, -zeros.get(name, 0.0)) for name, gain in self.sensors().items()}
        return Scene(self.name(), parts, loops, followers, home, sensors, known)

    def name(self) -> str:
        """The model's, the first in its table of names."""
        return str(self.model.names.split(b"\0", 1)[0].decode()) or "model"

    def parts(self) -> tuple[dict[str, Part], dict[str, Array]]:
        """The bodies, and where those stand that fly free."""
        model = self.model
        parts, standing = {}, {}
        for i, name in enumerate(self.bodies[1:], 1):
            first = int(model.body_jntadr[i])
            own = range(first, first + int(model.body_jntnum[i]))
            frame = _placed(model.body_pos[i], model.body_quat[i])
            for joint in own:
                if _KINDS[model.jnt_type[joint]] == "free":
                    standing[self.joints[joint]] = np.array(self.values(model.qpos0, joint))
                    frame = np.eye(4)
            parts[name] = Part(
                self.bodies[model.body_parentid[i]],
                frame,
                tuple(
                    Moving(
                        self.joints[joint],
                        _KINDS[model.jnt_type[joint]],
                        np.array(model.jnt_axis[joint]),
                        np.array(model.jnt_pos[joint]),
                    )
                    for joint in own
                ),
            )
        return parts, standing

    def values(self, every: Array, joint: int) -> Array:
        """Of a joint, out of those of all."""
        first = int(self.model.jnt_qposadr[joint])
        count = {"free": 7, "ball": 4}.get(_KINDS[self.model.jnt_type[joint]], 1)
        return np.asarray(every[first : first + count])

    def home(self, zeros: Mapping[str, float]) -> dict[str, Array]:
        """Joint values of the first key frame, from where bodies stand."""
        row = self.model.key_qpos[0]
        return {
            name: self.values(row, joint) - zeros.get(name, 0.0)
            for joint, name in enumerate(self.joints)
        }

    def follower(self, i: int) -> dict[str, tuple[str, float, float]]:
        """A joint that moves in proportion to another."""
        model = self.model
        offset, ratio, *rest = model.eq_data[i][:5].tolist()
        name, other = self.joints[model.eq_obj1id[i]], int(model.eq_obj2id[i])
        if other < 0 or any(rest):
            raise SymkinError(
                f'has joint "{name}" that is fixed or follows a curve; expected it to follow '
                "another in proportion"
            )
        return {name: (self.joints[other], ratio, offset)}

    def loop(self, i: int, name: str) -> Loop:
        """Two frames that meet."""
        model = self.model
        turns = bool(model.eq_type[i] == int(self.mujoco.mjtEq.mjEQ_CONNECT))
        name, data = model.equality(i).name or name, model.eq_data[i]
        ends = [int(model.eq_obj1id[i]), int(model.eq_obj2id[i])]
        if model.eq_objtype[i] == int(self.mujoco.mjtObj.mjOBJ_SITE):
            frames = [_placed(model.site_pos[each], model.site_quat[each]) for each in ends]
            ends = [int(model.site_bodyid[each]) for each in ends]
        elif turns:
            frames = [frame_of(np.array(data[k : k + 3]), np.eye(3)) for k in (0, 3)]
        else:  # a point of the second body, and where its frame is in the first
            frames = [_placed(data[3:6], data[6:10]), frame_of(np.array(data[:3]), np.eye(3))]
        body, other = (self.bodies[each] for each in ends)
        return Loop(name, body, frames[0], other, frames[1], turns)

    def sensors(self) -> dict[str, float]:
        """Gains of joints that are read: by tendons of symkin, by sensors, or that are driven."""
        model, mujoco = self.model, self.mujoco
        found: dict[str, float] = {}
        for i in range(model.ntendon):
            first = int(model.tendon_adr[i])
            of_symkin = str(model.tendon(i).name).startswith("reading_")
            if of_symkin and int(model.tendon_num[i]) == 1:
                found[self.joints[model.wrap_objid[first]]] = 1 / float(model.wrap_prm[first])
        driven = [
            int(model.actuator_trnid[i][0])
            for i in range(model.nu)
            if model.actuator_trntype[i] == int(mujoco.mjtTrn.mjTRN_JOINT)
        ]
        read = [
            int(model.sensor_objid[i])
            for i in range(model.nsensor)
            if model.sensor_type[i] == int(mujoco.mjtSensor.mjSENS_JOINTPOS)
        ]
        for joint in (*driven, *read):
            found.setdefault(self.joints[joint], 1.0)
        return found


def _placed(position: Array, quaternion: Array) -> Array:
    return frame_of(np.array(position), of_quaternion(np.array(quaternion)))
