# SPDX-License-Identifier: MIT
"""Symmetry groups, which of them a mechanism has, and how they carry legs and poses."""

from __future__ import annotations

import copyreg
import dataclasses
import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from symkin import _core
from symkin._core import SymmetryElement
from symkin.model.chains import chain_info, parameter_values, platform_of
from symkin.model.declared import declared_chain
from symkin.model.given import MechanismGiven, as_mechanism
from symkin.model.mechanism import Leg, Mechanism
from symkin.model.poses import pose_rows
from symkin.model.settings import DeclaredSymmetry
from symkin.model.symmetry.about_axis import (
    declared_pairs,
    filled_up,
    images_about_axis,
    orbits_about_axis,
    verify_about_axis,
)
from symkin.model.symmetry.pairs import (
    SymmetryPair,
    SymmetryPairs,
    fixes_home,
    symmetry_pairs,
)
from symkin.options import checks
from symkin.results import Result
from symkin.values import Array, Value, field, record

__all__ = [
    "Carrying",
    "DetectedSymmetry",
    "NamedGroup",
    "SymmetryElement",
    "SymmetryFrame",
    "SymmetryGroup",
    "carrier_words",
    "core_pair_of",
    "core_pairs",
    "declared_about_z",
    "declared_group",
    "describe_element",
    "detect_symmetry",
    "detect_within",
    "generate_legs",
    "generate_orbits",
    "group_title",
    "leg_carriers",
    "map_poses",
    "mechanism_groups",
    "named_group",
    "observability_group",
    "subgroup_names",
    "symmetry_deviations",
    "symmetry_group",
    "verify_declared",
]

# What carries a leg onto another, and poses with it.
Carrying = SymmetryElement | SymmetryPair

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

    base_centre: Array
    platform_centre: Array
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

    @property
    def arguments(self) -> dict[str, Any]:
        """What `of_arguments` makes it of."""
        maker, given = self.__dict__["_made_by"]
        if maker is SymmetryGroup:
            return dict(zip(("name", "axis"), given, strict=True))
        return dict(zip(("mechanism", "limits", "which"), given, strict=True))

    @classmethod
    def of_arguments(
        cls,
        *,
        name: str = "",
        axis: float = 0.0,
        mechanism: Mechanism | None = None,
        limits: tuple[float, float, float] = (0.0, 0.0, 0.0),
        which: str = "structure",
    ) -> SymmetryGroup:
        """Return the group of a name, or that of a mechanism, found again."""
        return cls(name, axis) if mechanism is None else _found_again(mechanism, limits, which)

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


def declared_group(symmetry: DeclaredSymmetry) -> SymmetryGroup:
    """Return the group object of a declaration."""
    return SymmetryGroup(symmetry.group, symmetry.axis)


def declared_about_z(mechanism: Mechanism) -> DeclaredSymmetry | None:
    """Return the declared symmetry if it is about Z; one about another axis is found from legs."""
    declared = mechanism.symmetry
    return declared if declared is not None and declared.about_z else None


def generate_legs(reference: Leg, symmetry: DeclaredSymmetry, count: int) -> list[Leg]:
    """Carry the reference leg to all legs of a mechanism.

    Parameters
    ----------
    reference : Leg
        Leg 1.
    symmetry : DeclaredSymmetry
        Its `elements`, or the natural order: the rotations r0, r1, ... when there are as many legs
        as rotations, r0, s0, r1, s1, ... when there are as many as elements of a dihedral group.
    count : int
        Number of legs.

    Raises
    ------
    SymkinError
        If the group does not carry one leg to so many.
    """
    group, elements = _carrying(symmetry, count)
    if not symmetry.about_z:
        labels = [element.label for element in elements]
        return images_about_axis(
            reference, _platform_of(reference), declared_pairs(symmetry), labels
        )
    return _images(reference, _platform_of(reference), group, elements)


def generate_orbits(
    references: Sequence[Leg], symmetry: DeclaredSymmetry, platform: str = "rigid"
) -> list[Leg]:
    """Carry each reference leg to its orbit: the legs of a mechanism, orbit by orbit.

    Parameters
    ----------
    references : sequence of Leg
        One of each orbit; they may have different chains.
    symmetry : DeclaredSymmetry
        Its `elements`, or all of its group in the order r0, s0, r1, s1, ... carry each of them.
        Where an image of a leg is the leg itself, or another image, as that of a leg on a mirror,
        it is not doubled; rotations, which keep the working mode, go before reflections.
    platform : {"rigid", "point", "translating", "spherical", "schoenflies"}
        See `Mechanism`.
    """
    group, elements = _carrying(symmetry)
    if not symmetry.about_z:
        labels = [element.label for element in elements]
        return orbits_about_axis(references, platform, declared_pairs(symmetry), labels)
    legs = []
    for number, leg in enumerate(references, 1):
        info = chain_info(leg.chain, platform)
        whole = dataclasses.replace(leg, parameters=parameter_values(leg, info, number))
        fixed = _stabiliser(whole, group, platform)
        kept: list[SymmetryElement] = []
        for element in sorted(elements, key=lambda each: each.reflection):
            back = group.inverse(element)
            if not any(group.compose(back, other) in fixed for other in kept):
                kept.append(element)
        own = [element for element in elements if element in kept]
        legs += _images(whole, platform, group, own)
    return legs


def _carrying(
    symmetry: DeclaredSymmetry, count: int | None = None
) -> tuple[SymmetryGroup, Sequence[SymmetryElement]]:
    """The group and the elements that carry a leg to so many, by default to all images."""
    group = declared_group(symmetry)
    if symmetry.elements is not None:
        return group, [group.parse(label) for label in symmetry.elements]
    return group, _core.generating_elements(group.core, group.size if count is None else count)


def _stabiliser(leg: Leg, group: SymmetryGroup, platform: str) -> set[SymmetryElement]:
    """The elements that carry a leg onto itself, working mode and sensor aside."""
    info = chain_info(leg.chain, platform)
    core = filled_up([leg], info, platform)
    return {
        element
        for element in group.elements
        if _core.image_of_legs(core, group.core, element, _core.SymmetryTolerance())
        .deviations[0]
        .in_tolerances
        <= _core.IMAGE_TOLERANCES
    }


def _images(
    reference: Leg, platform: str, group: SymmetryGroup, elements: Sequence[SymmetryElement]
) -> list[Leg]:
    info = chain_info(reference.chain, platform)
    names = info.parameter_names
    # Mechanism checks the names; here the values are only put in order.
    given = reference.parameters
    defaults = {name: given.get(other, np.nan) for name, other in info.defaults.items()}
    values = np.array([given.get(name, defaults.get(name, np.nan)) for name in names])
    parameters, modes = _core.generate_legs(
        group.core, reference.chain, platform, values, reference.working_mode, list(elements)
    )
    return [
        Leg(reference.chain, dict(zip(names, row, strict=True)), mode)
        for row, mode in zip(parameters.tolist(), modes, strict=True)
    ]


def verify_declared(mechanism: Mechanism) -> None:
    """Check that a mechanism has the symmetry that it declares, working modes and sensors aside.

    Raises
    ------
    SymmetryError
        Naming the element, the leg, the parameter and its deviation.
    """
    if mechanism.symmetry is not None and not mechanism.symmetry.about_z:
        verify_about_axis(mechanism, mechanism.symmetry)
    elif mechanism.symmetry is not None:
        _core.verify_symmetry(mechanism.straight, declared_group(mechanism.symmetry).core)


@record
class DetectedSymmetry(Result):
    """The symmetry of a mechanism, found from its legs alone.

    Attributes
    ----------
    structure : SymmetryGroup
        G_M: the largest group that maps the legs onto themselves, working modes and sensors aside.
    with_modes : SymmetryGroup
        Its subgroup that keeps the working modes too.
    permutations : dict of str to tuple of int
        For each element of the structure, by label, the leg (from 0) onto which each leg goes.
    keeps_modes : dict of str to bool
        Whether the element keeps the working modes.
    """

    structure: SymmetryGroup
    with_modes: SymmetryGroup
    permutations: Mapping[str, tuple[int, ...]] = field(number=True)
    keeps_modes: Mapping[str, bool]


@checks()
def detect_symmetry(
    mechanism: MechanismGiven, tolerance: float = 1e-6, gain_tolerance: float | None = None
) -> DetectedSymmetry:
    """Find the largest symmetry group C_n or D_n of a mechanism, about any centre and axis.

    Rotations are about Z and mirrors contain it; `symmetry_pairs` finds those about other axes too.
    Where joints are counts and how long links are; gains and offsets of the sensors, and azimuths
    of joints in the centre, do not.

    Parameters
    ----------
    mechanism : Mechanism
        Its declared symmetry is not used.
    tolerance : float
        By which every parameter may be off that of a symmetric mechanism: m for lengths, rad for
        angles. The image of a leg may then be off by up to four times that.
    gain_tolerance : float, optional
        The same for sensor gains, by default `tolerance`: of several elements that carry a leg
        equally well the one is preferred that carries its sensor too.
    """
    return detect_within(as_mechanism(mechanism), _tolerance(tolerance, gain_tolerance))


def detect_within(mechanism: Mechanism, tolerance: _core.SymmetryTolerance) -> DetectedSymmetry:
    """Find the largest group within a tolerance; see `detect_symmetry`."""
    found = _core.detect_symmetry(mechanism.straight, tolerance)
    limits = tolerance.length, tolerance.angle, tolerance.gain

    def group(which: str) -> SymmetryGroup:
        # The core places a group only where it finds one: a copy of it has to be found again.
        return SymmetryGroup.of_core(
            getattr(found, which), (_found_again, (mechanism, limits, which))
        )

    return DetectedSymmetry(
        structure=group("structure"),
        with_modes=group("with_modes"),
        permutations={image.element.label: tuple(image.permutation) for image in found.images},
        keeps_modes={image.element.label: image.keeps_modes for image in found.images},
    )


def _found_again(
    mechanism: Mechanism, limits: tuple[float, float, float], which: str
) -> SymmetryGroup:
    found = detect_within(mechanism, _core.SymmetryTolerance(*limits))
    return found.structure if which == "structure" else found.with_modes


def symmetry_deviations(mechanism: Mechanism, group: SymmetryGroup, tolerance: float) -> Array:
    """How every leg differs from a perfectly symmetric mechanism, shape (legs, p); m, rad.

    Each leg is carried back to the first leg of its orbit and compared with the median of the
    orbit; signs are those of the leg where it stands. Elements are used that map legs onto each
    other within `tolerance`.

    Returns
    -------
    ndarray, shape (legs, p)
    """
    return _core.symmetry_deviations(mechanism.straight, group.core, _tolerance(tolerance, None))


def symmetry_group(mechanism: Mechanism) -> SymmetryGroup:
    """Return the declared group, or else the one found about Z that keeps the working modes."""
    declared = declared_about_z(mechanism)
    if declared is not None:
        return declared_group(declared)
    return detect_symmetry(mechanism).with_modes


def leg_carriers(mechanism: Mechanism) -> list[tuple[int, Carrying]]:
    """For each leg the first leg (from 0) of its orbit, and the element that carries it there.

    Where no symmetry is declared, and all pairs that keep the working modes and home make fewer
    orbits than those about Z, the elements are such pairs (see `symmetry_pairs`).

    For a fully symmetric mechanism these elements are G_C (Eqs. 7, 21), all from leg 0. A leg that
    is nobody's image is its own reference. So is one whose element puts another leg, such as a
    slider with a rod on the mirror, into its other working mode: there the images of poses are
    those of another assembly, which may not reach them.

    Returns
    -------
    list of (int, SymmetryElement or SymmetryPair)
        One for each leg.
    """
    found = _carriers_about_z(mechanism)
    if declared_about_z(mechanism) is None and any(reference for reference, _ in found):
        pairs = symmetry_pairs(mechanism).carriers()
        if len({each for each, _ in pairs}) < len({each for each, _ in found}):
            return list(pairs)
    return found


def _carriers_about_z(mechanism: Mechanism) -> list[tuple[int, Carrying]]:
    group = symmetry_group(mechanism)
    flips: dict[SymmetryElement, bool] = {}

    def flips_modes(element: SymmetryElement) -> bool:
        if element not in flips:
            image = _core.image_of_legs(
                mechanism.straight, group.core, element, _core.SymmetryTolerance()
            )
            flips[element] = image.keeps_structure and not image.keeps_modes
        return flips[element]

    carriers = _core.leg_carriers(mechanism.straight, group.core)
    return [
        (leg, group.parse("r0"))
        if flips_modes(carrier.element)
        else (carrier.reference, carrier.element)
        for leg, carrier in enumerate(carriers)
    ]


def observability_group(mechanism: Mechanism) -> list[Carrying] | None:
    """G_C (Eqs. 7, 21): for each leg the element that carries leg 1 onto it.

    None for a mechanism in which some leg is not an image of leg 1.
    """
    carriers = leg_carriers(mechanism)
    if any(reference != 0 for reference, _ in carriers):
        return None
    return [element for _, element in carriers]


def map_poses(mechanism: Mechanism, element: Carrying | str, poses: ArrayLike) -> Array:
    """Carry poses by an element of the mechanism's group (Eqs. 14, 22).

    Parameters
    ----------
    mechanism : Mechanism
        Its group is the declared one, or else the one found.
    element : SymmetryElement, SymmetryPair or str
        Such as ``"r1"``, or ``"p3"`` of the mechanism's `symmetry_pairs`.
    poses : array_like, shape (N, coordinates)
        One pose a row.

    Returns
    -------
    ndarray, shape (N, coordinates)
    """
    (pair,) = core_pairs(mechanism, [element])
    return pair.transform_poses(mechanism.straight, pose_rows(poses))


def core_pairs(
    mechanism: Mechanism, elements: Iterable[Carrying | str]
) -> list[_core.SymmetryPair]:
    """Return what elements, or those of such labels, do to base and platform."""
    group: SymmetryGroup | None = None  # found once, if at all
    pairs = []
    for each in elements:
        element = each
        if isinstance(element, str) and element.startswith("p"):
            element = symmetry_pairs(mechanism).parse(element)
        if isinstance(element, SymmetryPair):
            pairs.append(element.core)
            continue
        group = group or symmetry_group(mechanism)
        own = group.parse(element) if isinstance(element, str) else element
        pairs.append(core_pair_of(group, own))
    return pairs


def core_pair_of(group: SymmetryGroup, element: SymmetryElement) -> _core.SymmetryPair:
    """Return the motions of base and platform that an element of a group about Z stands for."""
    return _core.pair_of(group.core, element)


def carrier_words(mechanism: Mechanism, element: Carrying) -> str:
    """Say in words what an element that carries a leg does."""
    if isinstance(element, SymmetryPair):
        return element.words
    return describe_element(symmetry_group(mechanism), element)


def mechanism_groups(mechanism: Mechanism, found: DetectedSymmetry) -> tuple[NamedGroup, ...]:
    """Return the groups that legs and home tell: G_M, its subgroup that keeps the modes, and G_C.

    G_M is what carries the robot onto itself as it stands at home: of all pairs those that fix it.
    """
    pairs = symmetry_pairs(mechanism)
    about_z = [
        element
        for element in found.structure.elements
        if fixes_home(mechanism, core_pair_of(found.structure, element))
    ]
    kept = [element for element in about_z if found.keeps_modes[element.label]]
    carriers = list({element.label: element for _, element in leg_carriers(mechanism)}.values())

    def larger(
        meaning: str, elements: Sequence[SymmetryElement], others: Sequence[SymmetryPair]
    ) -> NamedGroup:
        """The elements about Z, by their usual names, unless others are more."""
        if len(elements) >= len(others):
            return named_group("G_M", meaning, found.structure, elements)
        return _named_pairs("G_M", meaning, pairs, others)

    return (
        larger("structure", about_z, pairs.fix_home),
        larger("with the working modes", kept, pairs.keep_modes_and_home),
        _observability_named(mechanism, carriers),
    )


def _named_pairs(
    symbol: str, meaning: str, pairs: SymmetryPairs, elements: Sequence[SymmetryPair]
) -> NamedGroup:
    name = pairs.group_of(elements)
    # The paper counts the elements of a dihedral group.
    paper = f"D_{len(elements)}" if pairs.planar and name.startswith("D") else name
    labels, words = [each.label for each in elements], [each.words for each in elements]
    return NamedGroup(symbol, meaning, paper, name, tuple(labels), tuple(words))


def _observability_named(mechanism: Mechanism, carriers: Sequence[Carrying]) -> NamedGroup:
    meaning = "G_C", "observability"
    elements = [each for each in carriers if isinstance(each, SymmetryElement)]
    if len(elements) == len(carriers):
        return named_group(*meaning, symmetry_group(mechanism), elements)
    pairs = [each for each in carriers if isinstance(each, SymmetryPair)]
    return _named_pairs(*meaning, symmetry_pairs(mechanism), pairs)


def _tolerance(tolerance: float, gain_tolerance: float | None) -> _core.SymmetryTolerance:
    gain = tolerance if gain_tolerance is None else gain_tolerance
    return _core.SymmetryTolerance(tolerance, tolerance, gain)


def _platform_of(leg: Leg) -> str:
    """The leg of a platform that never turns lacks what places it on one that does.

    That of one that only turns has arcs; a declared one is for the platform that its file says.
    """
    if chain := declared_chain(leg.chain):
        return platform_of(chain.pose_space)
    if any(name.endswith("_arc") for name in leg.parameters):
        return "spherical"
    rigid = chain_info(leg.chain).parameter_names if leg.chain in _core.chain_names("rigid") else ()
    lacks_platform = "platform_radius" in rigid and "platform_radius" not in leg.parameters
    other = "translating" if leg.chain in _core.chain_names("translating") else "point"
    return other if lacks_platform else "rigid"
