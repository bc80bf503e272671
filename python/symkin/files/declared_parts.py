# SPDX-License-Identifier: MIT
"""The joints and transforms of a declared leg, as its path lists them."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from symkin.errors import SymkinError, did_you_mean
from symkin.storage.quantities import evaluate_quantity
from symkin.storage.toml_file import WrongValueError, check_keys
from symkin.values import Array

_Values = dict[str, Any]

# In the core's order.
SLOTS = ("azimuth", "x", "y", "z", "roll", "pitch", "yaw", "rx", "ry", "rz")
_LENGTHS = ("x", "y", "z")
_TURNS = ("roll", "pitch", "yaw")  # as it is drawn
_ERRORS = ("x", "y", "z", "rx", "ry", "rz")
_PLANAR_ERRORS = ("x", "y", "rz")
_KEYS = ("name", *SLOTS, "aim", "errors", "exact")
_ROD_KEYS = ("name", "from", "at", "to", "end", "length")
_LOOP_KEYS = ("from", "path", "to", "at", "closes")
# How a number goes over in the mirror of x and z: see ParameterKind.
_KINDS = {
    "x": "coordinate",
    "y": "mirrored_coordinate",
    "z": "coordinate",
    "roll": "mirrored_written_turn",
    "pitch": "written_turn",
    "yaw": "mirrored_written_turn",
    "azimuth": "mirrored_written_turn",
    "rx": "mirrored_small_turn",
    "ry": "small_turn",
    "rz": "mirrored_small_turn",
}
_AXES = {"x": (1.0, 0.0, 0.0), "y": (0.0, 1.0, 0.0), "z": (0.0, 0.0, 1.0)}
_JOINT = re.compile(
    r"(?:(?P<name>[A-Za-z]\w*)\s*:\s*)?(?P<kind>\[[RP]\]|[RPUCS])(?P<axes>(?:\s+[xyz])*)"
    r"(?:\s*=\s*(?P<rule>.+))?"
)
_FACTOR = r"(?P<sign>-?)\s*(?P<ratio>[0-9.]+(?:[eE][-+]?\d+)?)?\s*\*?\s*"
_RULE = re.compile(
    _FACTOR + r"(?:(?P<number>[A-Za-z]\w*)(?:\s*\*\s*|\s+))?(?P<joint>[A-Za-z]\w*)"
    r"(?:\s*(?P<plus>[-+])\s*(?P<offset>.+))?"
)
# Another number of the leg; no unit or function has such a name.
_NAMED = re.compile(_FACTOR + r"(?P<number>[A-Za-z]\w*_\w+)")
_NAME = re.compile(r"[A-Za-z]\w*")
_EXPECTED = (
    'expected "name: [R] z" with R, P, U or C, an axis x, y or z (two of a U, none in the plane), '
    "brackets where a sensor reads, or a transform { name = ..., x = ... }"
)
Step = tuple[str, int]
_POSE: Step = ("pose", 0)
_POSE_YAW = -2  # as the core has it


def turn_about_z(angle: float) -> Array:
    """Its matrix."""
    cosine, sine = np.cos(angle), np.sin(angle)
    return np.array([[cosine, -sine, 0.0], [sine, cosine, 0.0], [0.0, 0.0, 1.0]])


def transform_matrix(values: Mapping[str, float]) -> Array:
    """A transform as drawn, 4 x 4, without roll, pitch and yaw."""
    matrix = np.eye(4)
    matrix[:3, :3] = turn_about_z(values["azimuth"])
    matrix[:3, 3] = matrix[:3, :3] @ [values["x"], values["y"], values["z"]]
    return matrix


class LegBuilder:
    """A leg while its tables are read."""

    def __init__(self, *, planar: bool, turn: str = "") -> None:
        self.planar = planar
        self.turn = turn  # what the platform's turn about z is called, which joints may follow
        self.joints: list[tuple[str, tuple[float, ...], bool, int, float, float]] = []
        self.names: list[str] = []  # of the joints
        self.values: list[dict[str, float]] = []  # of the transforms
        self.transforms: list[str] = []  # their names
        self.loops: list[list[Any]] = []
        self.left_steps: list[Step] = []
        self.right_steps: list[Step] = [_POSE]
        self.aimed: list[int] = []
        self.ends_in_ball = False
        self._behind_ball: list[Step] = []
        self._places: dict[str, list[Step]] = {}  # of transforms and joints: the path up to them
        self._estimated: list[list[str]] = []  # of each transform, which numbers are parameters
        self._exact: list[set[str]] = []
        self._frozen: dict[int, dict[str, float]] = {}
        self._lengths: dict[int, str] = {}  # transforms that are the length of a rod
        # Of a transform and slot, or a joint and "": the number that it names, and a factor.
        self._named: dict[tuple[str, int, str], tuple[int, str, float]] = {}

    def is_of_platform(self, index: int) -> bool:
        """Whether a transform stands on the platform's side."""
        return ("transform", index) in self.right_steps

    @property
    def own_joints(self) -> list[int]:
        """The joints that stand by themselves."""
        return [index for index, joint in enumerate(self.joints) if joint[3] == -1]

    @property
    def own_names(self) -> list[str]:
        """Their names."""
        return [self.names[index] for index in self.own_joints]

    def read_path(self, raw: Any, *, whole: bool) -> None:
        """The path from base to platform; its last transform is the platform's, unless `whole`.

        Of several, each from the base, none closes by itself: rods and loops go on from them.
        """
        if has_several_paths(raw):
            self._read_several(raw, "path", [], "base")
            return
        steps = self._steps(raw, "path")
        behind = self._behind_ball
        if not (behind or whole or self.ends_in_ball) and len(steps) > 1:
            behind = [steps[-1]] if steps[-1][0] == "transform" else []
        self.left_steps = [step for step in steps if step not in behind]
        self.right_steps += behind
        self._remember(self.left_steps)

    def read_platform_path(self, raw: Any) -> None:
        """More of the platform's side, from its frame to the leg's end, or to several."""
        if has_several_paths(raw):
            self._read_several(raw, "platform_path", [_POSE], "platform")
            return
        self.right_steps += self._steps(raw, "platform_path")
        self._remember(self.right_steps)

    def _read_several(self, raw: list[Any], key: str, start: list[Step], end: str) -> None:
        for number, each in enumerate(raw):
            try:
                steps = [*start, *self._steps(each, key)]
            except WrongValueError as error:
                raise WrongValueError(str(error), (key, number, *error.keys[1:])) from error
            if self.ends_in_ball:
                raise WrongValueError(
                    "has a ball joint; expected rods, or loops that close on a point, behind "
                    "several paths",
                    (key, number),
                )
            self._need_turning(steps, f"{end}_{number + 1}")
            self._remember(steps)

    def _remember(self, steps: list[Step]) -> None:
        """Of names in several paths the first counts."""
        called = {"transform": self.transforms, "joint": self.names}
        made = {
            called[kind][index]: steps[: number + 1]
            for number, (kind, index) in enumerate(steps)
            if kind != "pose"
        }
        self._places = made | self._places

    def close(self, compares: str) -> None:
        """Close the path on the platform."""
        self._need_turning(self.left_steps, "base")
        if compares not in ("point", "planar point") or len(self.right_steps) > 1:
            self._need_turning(self.right_steps, "platform")
        self.loops.append([list(self.left_steps), list(self.right_steps), compares, -1, -1])

    def read_rod(self, raw: Any) -> None:
        """A rod between two points: one distance."""
        _check_keys(raw, _ROD_KEYS)
        name = _name_of(raw, f"rod_{len(self.loops) + 1}")
        start = self._up_to(raw.get("from", "base"), "from")
        to_platform = raw.get("to", "platform") == "platform"
        other = self.right_steps if to_platform else self._up_to(raw["to"], "to")
        at = self._transform({"name": f"{name}_at", **_table(raw, "at")}, "at")
        end = self._transform({"name": f"{name}_end", **_table(raw, "end")}, "end")
        left, right = [*start, ("transform", at)], [*other, ("transform", end)]
        self._need_turning(left, "base")
        self._need_turning(right, "platform")
        if "length" not in raw:
            raise WrongValueError("this key is missing", ("length",))
        length = raw["length"]
        read = re.fullmatch(r"\[([A-Za-z]\w*)\]", length) if isinstance(length, str) else None
        if read:
            joint = self._joint(read[1], "P", "x", read=True)
            self.loops.append([left, right, "distance", -1, joint])
            return
        index = self._add_transform(f"{name}_length")
        self._lengths[index] = f"{name}_length"
        self.values[index]["x"] = _number(length, "m", ("length",))
        self._estimated[index] = ["x"]
        self.loops.append([left, right, "distance", index, -1])

    def read_loop(self, raw: Any, *, planar: bool) -> None:
        """A further loop, from a transform or joint of a path to the body that a joint moves."""
        _check_keys(raw, _LOOP_KEYS)
        start = self._up_to(raw.get("from"), "from")
        path = self._steps(raw.get("path", []), "path")
        to_platform = raw.get("to") == "platform" and "platform" not in self.names
        end = [_POSE] if to_platform else self._up_to(raw.get("to"), "to")
        closes = raw.get("closes", "point")
        if closes not in ("point", "pose"):
            raise WrongValueError(f"is {closes!r}; expected 'point' or 'pose'", ("closes",))
        at = self._transform({"name": f"at_{len(self.loops)}", **_table(raw, "at")}, "at")
        compares = f"planar {closes}" if planar else closes
        left, right = [*start, *path], [*end, ("transform", at)]
        if to_platform:
            self._need_turning(left, "base")
            self._need_turning(right, "platform")
        self._remember(left)
        self.loops.append([left, right, compares, -1, -1])

    def write_turn(self, index: int, slot: str) -> None:
        """Make a turn that was found a constant of the leg."""
        if slot not in self._estimated[index]:
            self._estimated[index].append(slot)
        self._frozen.setdefault(index, {})[slot] = self.values[index][slot]

    def numbers(self, index: int) -> list[float]:
        """The numbers of a transform in the core's order."""
        return [float(self.values[index][slot]) for slot in SLOTS]

    def scalars(self) -> tuple[list[list[Any]], dict[str, float], list[str]]:
        """The parameters: what each is, its drawn value, and which of them are exact."""
        ends = self._ends()
        uses = self._uses(ends)
        scalars: list[list[Any]] = []
        nominal: dict[str, float] = {}
        exact = []
        turning = self._turning
        for index, name in enumerate(self.transforms):
            is_frame = index in turning and self._is_frame(index)
            if is_frame:
                self._estimated[index] += sorted({*_TURNS} - {*self._estimated[index]})
            for slot in sorted(self._estimated[index], key=SLOTS.index):
                end, kind = ends.get(index, "none"), _KINDS[slot]
                if slot == "azimuth" and index in turning:
                    kind = "axis_azimuth"
                elif slot in _TURNS and is_frame:
                    kind = f"frame_{slot}"
                own = f"{name}_{slot}"
                if index in self._lengths:
                    own, kind = self._lengths[index], "length"
                if own in nominal:
                    raise SymkinError(f"two numbers are called {own}")
                is_exact = slot in self._exact[index]
                places = uses.get((index, slot), [])
                scalars.append([own, index, SLOTS.index(slot), end, kind, is_exact, places])
                nominal[own] = float(self.values[index][slot])
                exact += [own] * is_exact
        return scalars, nominal, exact

    def _uses(self, ends: Mapping[int, str]) -> dict[tuple[int, str], list[list[Any]]]:
        """Where else each number stands: kind, index, slot and factor."""
        uses: dict[tuple[int, str], list[list[Any]]] = {}
        for (kind, index, slot), (transform, of, factor) in self._named.items():
            user = f"{self.transforms[index]}_{slot}" if slot else self.names[index]
            named = f"{self.transforms[transform]}_{of}"
            places = {named: ends.get(transform)} | ({user: ends.get(index)} if slot else {})
            for place, end in places.items():
                if end:  # whose numbers change with its frame
                    raise SymkinError(
                        f"{user} names {named}, and {place} belongs to the {end}; expected numbers "
                        "of links"
                    )
            number = SLOTS.index(slot) if slot else 0
            uses.setdefault((transform, of), []).append([kind, index, number, factor])
        return uses

    def written(self, table: Mapping[str, Any]) -> _Values:
        """The table with the turns of ``aim`` in numbers."""

        def frozen(item: Any) -> Any:
            if not isinstance(item, dict) or "aim" not in item:
                return item
            index = self.transforms.index(str(item["name"]))
            kept = {key: value for key, value in item.items() if key != "aim"}
            return kept | {
                slot: f"{value!r} rad" for slot, value in self._frozen.get(index, {}).items()
            }

        return {
            key: [frozen(each) for each in value] if isinstance(value, list) else value
            for key, value in table.items()
        }

    @property
    def _turning(self) -> set[int]:
        """The transforms with which a leg turns about Z: the first at either end of a loop."""
        found = set()
        for steps in (steps for loop in self.loops for steps in loop[:2]):
            first = steps[steps[:1] == [_POSE] :][:1]
            found |= {index for kind, index in first if kind == "transform"}
        return found

    def _is_frame(self, index: int) -> bool:
        """Whether a transform is drawn turned about other axes than Z, and moves nothing."""
        return not {*_LENGTHS} & {*self._estimated[index]} and bool(
            {*_TURNS} & {*self._estimated[index]}
        )

    def _ends(self) -> dict[int, str]:
        """On which end each transform stands, if on one."""
        ends: dict[int, str] = {}
        for steps in (steps for loop in self.loops for steps in loop[:2]):
            of_platform = steps[:1] == [_POSE]
            for kind, index in steps:
                if kind == "joint" and not of_platform:
                    break
                if kind == "transform":
                    ends.setdefault(index, "platform" if of_platform else "base")
        return ends

    def _need_turning(self, steps: list[Step], end: str) -> None:
        """Begin an end with a transform that has an azimuth, in place."""
        place = 1 if steps[:1] == [_POSE] else 0
        if len(steps) <= place or steps[place][0] != "transform":
            steps.insert(place, ("transform", self._add_transform(end)))
        index = steps[place][1]
        if "azimuth" not in self._estimated[index]:
            self._estimated[index].append("azimuth")

    def _steps(self, raw: Any, key: str) -> list[Step]:
        if not isinstance(raw, list):
            raise WrongValueError("is not a list of joints and transforms; expected one", (key,))
        steps: list[Step] = []
        for number, item in enumerate(raw):
            try:
                steps += self._step(item, steps)
            except WrongValueError as error:
                raise WrongValueError(str(error), (key, number, *error.keys)) from error
            except SymkinError as error:
                raise WrongValueError(str(error), (key, number)) from error
        return steps

    def _step(self, item: Any, steps: list[Step]) -> list[Step]:
        if isinstance(item, dict):
            made = ("transform", self._transform(item, ""))
            if self.ends_in_ball:
                self._behind_ball.append(made)
            return [made]
        if not isinstance(item, str):
            raise WrongValueError(f"is {item!r}; {_EXPECTED}")
        found = _JOINT.fullmatch(item.strip())
        if found is None:
            raise WrongValueError(f'is "{item}"; {_EXPECTED}')
        kind, axes = found["kind"], found["axes"].split()
        if self.ends_in_ball:
            raise WrongValueError("stands behind a ball joint, which ends a leg")
        if kind == "S":
            if not steps:
                raise WrongValueError(
                    "a ball joint at the base lets the leg spin, which nothing shows: expected a U"
                )
            self.ends_in_ball = True
            return []
        return [("joint", index) for index in self._joints(found, kind, axes)]

    def _joints(self, found: re.Match[str], kind: str, axes: list[str]) -> list[int]:
        name, rule = found["name"], found["rule"]
        name = name or f"joint_{len(self.joints) + 1}"
        read = kind.startswith("[")
        letter = kind.strip("[]")
        wanted = {"U": 2, "C": 1}.get(letter, 1)
        if not axes and letter == "R":
            axes = ["z"]
        elif not axes and letter == "P":
            axes = ["x"]
        if len(axes) != wanted or (letter == "U" and axes[0] == axes[1]):
            raise WrongValueError(f"a {letter} has {wanted} axes; {_EXPECTED}")
        if letter in "UC" and rule:
            raise WrongValueError("only R and P follow other joints")
        if letter == "U":
            return [self._joint(f"{name}_{axis}", "R", axis) for axis in axes]
        if letter == "C":
            return [self._joint(f"{name}_{each}", each, axes[0]) for each in "PR"]
        if not rule:
            return [self._joint(name, letter, axes[0], read=read)]
        followed = self._followed(rule, letter)
        return [self._joint(name, letter, axes[0], followed=followed)]

    def _followed(self, rule: str, letter: str) -> tuple[int, float, float]:
        found = _RULE.fullmatch(rule.strip())
        if found is None:
            raise WrongValueError(f'follows "{rule}"; expected such as "-a" or "2 a + 0.3 rad"')
        if found["joint"] == self.turn and self.turn not in self.names:
            ratio = self._ratio(found, letter, "R")
            offset = evaluate_quantity(found["offset"], "rad") if found["offset"] else 0.0
            return _POSE_YAW, ratio, -offset if found["plus"] == "-" else offset
        if found["joint"] not in self.names:
            raise WrongValueError(
                f"follows {found['joint']}, no joint before it"
                f"{did_you_mean(found['joint'], self.names)}"
            )
        joint = self.names.index(found["joint"])
        if self.joints[joint][3] != -1:
            raise WrongValueError(f"follows {found['joint']}, which follows another joint itself")
        ratio = self._ratio(found, letter, self.joints[joint][0])
        offset = 0.0
        if found["offset"]:
            offset = evaluate_quantity(found["offset"], "rad" if letter == "R" else "m")
        return joint, ratio, -offset if found["plus"] == "-" else offset

    def _ratio(self, rule: re.Match[str], letter: str, followed: str) -> float:
        """What a joint, the next, is times the one that it follows."""
        if rule["number"] is None:
            return _factor(rule)
        if (letter, followed) != ("P", "R"):
            raise WrongValueError(
                f"has {rule['number']}, a length, for its ratio; expected a P that follows an R"
            )
        return self._name_number("joint", len(self.joints), "", rule)

    def _name_number(self, kind: str, index: int, slot: str, found: re.Match[str]) -> float:
        """The drawn value of what is a number before it, times a factor."""
        numbers = {
            f"{name}_{of}": (transform, of)
            for transform, name in enumerate(self.transforms)
            for of in self._estimated[transform]
            if of in _LENGTHS and transform not in self._lengths
        }
        if found["number"] not in numbers:
            raise WrongValueError(
                f"names {found['number']}, no x, y or z that is written before it"
                f"{did_you_mean(found['number'], list(numbers))}",
                (slot,) if slot else (),
            )
        transform, of = numbers[found["number"]]
        self._named[kind, index, slot] = transform, of, _factor(found)
        return _factor(found) * self.values[transform][of]

    def _joint(
        self,
        name: str,
        kind: str,
        axis: str,
        *,
        read: bool = False,
        followed: tuple[int, float, float] = (-1, 1.0, 0.0),
    ) -> int:
        if name in self.names:
            raise WrongValueError(f"two joints are called {name}")
        self.names.append(name)
        self.joints.append((kind, _AXES[axis], read, *followed))
        return len(self.joints) - 1

    def _add_transform(self, name: str) -> int:
        if name in self.transforms:
            raise WrongValueError(f"two transforms are called {name}")
        self.transforms.append(name)
        self.values.append(dict.fromkeys(SLOTS, 0.0))
        self._estimated.append([])
        self._exact.append(set())
        return len(self.transforms) - 1

    def _transform(self, raw: Any, key: str) -> int:
        try:
            return self._read_transform(raw)
        except WrongValueError as error:
            raise WrongValueError(str(error), (key, *error.keys) if key else error.keys) from error

    def _read_transform(self, raw: Mapping[str, Any]) -> int:
        _check_keys(raw, _KEYS)
        index = self._add_transform(_name_of(raw, f"link_{len(self.transforms) + 1}"))
        values, estimated = self.values[index], self._estimated[index]
        named_slots = []
        for slot in SLOTS:
            if slot not in raw:
                continue
            number, length = raw[slot], slot in _LENGTHS
            named = _NAMED.fullmatch(number.strip()) if isinstance(number, str) and length else None
            if named:
                values[slot] = self._name_number("transform", index, slot, named)
                named_slots.append(slot)
                continue
            values[slot] = _number(number, "m" if length else "rad", (slot,))
            estimated.append(slot)
        if "aim" in raw:
            self.aimed.append(index)
        errors = raw.get("errors", [])
        if errors == "all":
            errors = _PLANAR_ERRORS if self.planar else _ERRORS
            errors = [slot for slot in errors if slot not in named_slots]
        for slot in errors:
            if slot not in _ERRORS:
                raise WrongValueError(
                    f'is {errors!r}; expected "all" or some of {_ERRORS}', ("errors",)
                )
            if slot in named_slots:
                raise WrongValueError(f"has {slot!r}, which names another number", ("errors",))
            if slot not in estimated:
                estimated.append(slot)
        exact = raw.get("exact", False)
        if exact is True:
            exact = list(estimated)
        for slot in exact or []:
            if slot not in estimated:
                why = "names another number" if slot in named_slots else "is not written"
                raise WrongValueError(f"has {slot!r}, which {why}", ("exact",))
            self._exact[index].add(slot)
        return index

    def _up_to(self, name: Any, key: str) -> list[Step]:
        """The path up to a joint or transform, with it; nothing at the base without a path."""
        if isinstance(name, str) and name in self._places:
            return self._places[name]
        if name == "base":
            return []
        raise WrongValueError(
            f"is {name!r}; expected a joint or transform of a path"
            f"{did_you_mean(str(name), list(self._places))}",
            (key,),
        )


def has_several_paths(raw: Any) -> bool:
    """Whether a path is a list of paths."""
    return isinstance(raw, list) and bool(raw) and all(isinstance(each, list) for each in raw)


def stays_in_plane(raw: Any) -> bool:
    """Whether joints have no axes, and transforms no numbers, that leave the plane."""
    if isinstance(raw, str):
        found = _JOINT.fullmatch(raw.strip())
        if found is None:
            return True
        letter = found["kind"].strip("[]")
        return letter == "P" or (letter == "R" and not found["axes"])
    if isinstance(raw, dict):
        if {"z", "roll", "pitch", "rx", "ry", "aim"} & set(raw):
            return False
        return all(stays_in_plane(each) for each in raw.values())
    return not isinstance(raw, list) or all(map(stays_in_plane, raw))


def _check_keys(raw: Any, keys: Sequence[str]) -> None:
    if not isinstance(raw, dict):
        raise WrongValueError(f"is {raw!r}; expected a table of {', '.join(keys)}")
    check_keys(raw, keys)


def _name_of(raw: Mapping[str, Any], default: str) -> str:
    name = raw.get("name", default)
    if not isinstance(name, str) or not _NAME.fullmatch(name):
        raise WrongValueError(
            f"is {name!r}; expected a letter, then letters, digits and _", ("name",)
        )
    return name


def _table(raw: Mapping[str, Any], key: str) -> Mapping[str, Any]:
    value = raw.get(key, {})
    if not isinstance(value, dict):
        raise WrongValueError("is not a table; expected one of x, y, z", (key,))
    return value


def _factor(found: re.Match[str]) -> float:
    return float(found["ratio"] or 1) * (-1 if found["sign"] else 1)


def _number(raw: Any, unit: str, keys: tuple[str, ...]) -> float:
    try:
        return evaluate_quantity(raw, unit, direction=unit == "rad")
    except SymkinError as error:
        raise WrongValueError(str(error), keys) from error
