# SPDX-License-Identifier: MIT
"""Symmetry groups, their elements, and the names that they have in the paper and elsewhere."""

from __future__ import annotations

import copyreg
import math
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from symkin import _core
from symkin._core import SymmetryElement
from symkin.result import Value, record

__all__ = [
    "NamedGroup",
    "SymmetryElement",
    "SymmetryFrame",
    "SymmetryGroup",
    "describe_element",
    "group_title",
    "named_group",
    "subgroup_names",
]

copyreg.pickle(SymmetryElement, lambda each: (SymmetryElement, (each.rotation, each.reflection)))


@record
class SymmetryFrame(Value):
    """Where a symmetry stands in the frames of base and platform.

    Attributes
    ----------
    base_centre, platform_centre : ndarray, shape (2,)
        What the rotations turn about, in the frame of each, m.
    base_axis, platform_axis : float
        Azimuth of the line of the reflection ``s0`` in each, rad.
    """

    base_centre: NDArray[np.float64]
    platform_centre: NDArray[np.float64]
    base_axis: float
    platform_axis: float


class SymmetryGroup(Value):
    """A group of rotations, or of rotations and reflections, about Z.

    Parameters
    ----------
    name : str
        ``"C3"``, ``"D3"``, ...
    axis : float
        Azimuth of the reflection ``s0``, rad.

    Raises
    ------
    SymkinError
        For another name. The methods that take an element, or its label, raise it if the group
        does not have that.
    """

    core: _core.SymmetryGroup

    def __init__(self, name: str, axis: float = 0.0) -> None:
        self._set(_core.SymmetryGroup(name, axis), (SymmetryGroup, (name, axis)))

    @classmethod
    def of_core(
        cls, core: _core.SymmetryGroup, made_by: tuple[Callable[..., Any], tuple[Any, ...]]
    ) -> SymmetryGroup:
        """Wrap a group of the core; `made_by` makes it again, for a copy or a pickle."""
        group = cls.__new__(cls)
        group._set(core, made_by)
        return group

    def _set(self, core: _core.SymmetryGroup, made_by: tuple[Any, ...]) -> None:
        object.__setattr__(self, "core", core)
        object.__setattr__(self, "_made_by", made_by)

    @property
    def name(self) -> str:
        """Such as ``"C_3"`` or ``"D_3"``."""
        return self.core.name

    @property
    def paper_name(self) -> str:
        """The paper's: ``"D_6"`` for the dihedral group with six elements."""
        return self.core.paper_name

    @property
    def title(self) -> str:
        """The paper's name, with the usual one if it is another: ``"D_6 (D_3)"``."""
        return group_title(self.paper_name, self.name)

    @property
    def rotations(self) -> int:
        """How many rotations."""
        return self.core.rotations

    @property
    def dihedral(self) -> bool:
        """Whether it has reflections."""
        return self.core.dihedral

    @property
    def size(self) -> int:
        """How many elements."""
        return self.core.size

    @property
    def elements(self) -> list[SymmetryElement]:
        """All elements: ``r0``, ``r1``, ..., ``s0``, ``s1``, ..."""
        return self.core.elements

    @property
    def frame(self) -> SymmetryFrame:
        """Centre and axis in the frames of base and platform, as they were found."""
        frame = self.core.frame
        return SymmetryFrame(
            frame.base_centre, frame.platform_centre, frame.base_axis, frame.platform_axis
        )

    def parse(self, label: str) -> SymmetryElement:
        """Return the element of a label such as ``"r1"``."""
        return self.core.parse(label)

    def compose(self, outer: SymmetryElement, inner: SymmetryElement) -> SymmetryElement:
        """Return the element that does `inner`, then `outer`."""
        return self.core.compose(outer, inner)

    def inverse(self, element: SymmetryElement) -> SymmetryElement:
        """Return the element that undoes one."""
        return self.core.inverse(element)

    def angle(self, element: SymmetryElement) -> float:
        """Return the angle of a rotation, or of a reflection's line from the axis, rad."""
        return self.core.angle(element)

    def to_dict(self) -> dict[str, Any]:
        """Return names, elements in words and place as plain values."""
        return {
            "name_in_the_paper": self.paper_name,
            "name": self.name,
            "elements": {each.label: describe_element(self, each) for each in self.elements},
            "axis_rad": self.frame.base_axis,
            "centre_m": self.frame.base_centre.tolist(),
        }

    def __setattr__(self, name: str, value: object) -> None:
        """Refuse: a group does not change."""
        raise AttributeError(f"a group does not change: {name} cannot be set")

    def __eq__(self, other: object) -> bool:
        """Whether it is the same group in the same place."""
        if not isinstance(other, SymmetryGroup):
            return NotImplemented
        return self.name == other.name and self.frame == other.frame

    def __hash__(self) -> int:  # type: ignore[override]
        """Agree with ``==``."""
        return hash((self.name, self.frame.base_axis))

    def __repr__(self) -> str:
        """Return name and axis."""
        return f"SymmetryGroup({self.name.replace('_', '')!r}, axis={self.frame.base_axis:.6g})"

    def __reduce__(self) -> tuple[Any, ...]:
        """Make it again when it is unpickled."""
        made_by: tuple[Any, ...] = self.__dict__["_made_by"]
        return made_by

    def __deepcopy__(self, memo: object) -> SymmetryGroup:
        """Return itself: it does not change."""
        return self


@record
class NamedGroup(Value):
    """A group of the paper, or a set of elements that is none.

    Attributes
    ----------
    symbol : str
        Such as ``"G_M"``.
    meaning : str
        Of what it is the group.
    paper_name : str
        ``"D_6"`` for the dihedral group with six elements; empty if the elements form no group.
    name : str
        The usual name of the same, ``"D_3"``.
    elements : tuple of str
        By label: ``"r0"``, ``"r1"``, ..., ``"s0"``, ...
    described : tuple of str
        The same in words.
    """

    symbol: str
    meaning: str
    paper_name: str
    name: str
    elements: tuple[str, ...]
    described: tuple[str, ...]

    @property
    def title(self) -> str:
        """Its name in the paper, with the usual one if it is another: ``"D_6 (D_3)"``."""
        return group_title(self.paper_name, self.name) if self.name else "no group"

    def to_dict(self) -> dict[str, Any]:
        """Return it as plain values, each element with what it does."""
        return {
            "symbol": self.symbol,
            "meaning": self.meaning,
            "name_in_the_paper": self.paper_name,
            "name": self.name,
            "elements": dict(zip(self.elements, self.described, strict=True)),
        }


def named_group(
    symbol: str, meaning: str, group: SymmetryGroup, elements: Sequence[SymmetryElement]
) -> NamedGroup:
    """Name some elements of a group."""
    return NamedGroup(
        symbol,
        meaning,
        *subgroup_names(group, elements),
        tuple(element.label for element in elements),
        tuple(describe_element(group, element) for element in elements),
    )


def subgroup_names(group: SymmetryGroup, elements: Sequence[SymmetryElement]) -> tuple[str, str]:
    """Name a set of elements in the paper's and the usual notation, emptily if it is no group."""
    inside = set(elements)
    if {group.compose(outer, inner) for outer in inside for inner in inside} != inside:
        return "", ""
    rotations = sum(not element.reflection for element in inside)
    if len(inside) == rotations:
        return f"C_{rotations}", f"C_{rotations}"
    return f"D_{2 * rotations}", f"D_{rotations}"


def group_title(paper_name: str, name: str) -> str:
    """Return the paper's name of a group, with the usual one if it is another: ``D_6 (D_3)``."""
    return paper_name if paper_name == name else f"{paper_name} ({name})"


def describe_element(group: SymmetryGroup, element: SymmetryElement) -> str:
    """Say in words what an element of a group does."""
    turn = group.angle(element)
    if element.reflection:
        azimuth = math.remainder(group.frame.base_axis + turn, math.pi) % math.pi
        return f"reflection about the axis at {_degrees(azimuth)}"
    if element.rotation == 0:
        return "the identity"
    return f"rotation by {_degrees(turn)}"


def _degrees(angle_rad: float) -> str:
    return f"{math.degrees(angle_rad):.4g}\N{DEGREE SIGN}"
