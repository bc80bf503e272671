# SPDX-License-Identifier: MIT
"""All symmetries of a mechanism: one motion of the base, one of the platform.

A pair (g, h) carries the legs onto each other and the pose X to ``g X h^-1``; proper or improper,
about any centres and axes. Not all pairs are of use for poses: of those that keep the working
modes, those that fix home are the paper's G_M.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from symkin import _core
from symkin.errors import SymkinError
from symkin.model.given import MechanismGiven, as_mechanism
from symkin.model.mechanism import Mechanism
from symkin.model.poses import pose_rows
from symkin.model.symmetry.naming import element_words, group_name
from symkin.options import checks
from symkin.results import Result
from symkin.values import Array, Value, field, record

_ROUNDING = 1e-6  # m and rad
_SAME = 1e-3  # of matrices' entries and shifts in m: less than between two elements


@record
class Motion(Value):
    """What an element does to one of the two spaces: ``p -> linear p + shift``.

    Attributes
    ----------
    linear : ndarray, shape (3, 3)
        Orthogonal, of determinant 1 or -1. In the plane z stays as it is.
    shift : ndarray, shape (3,)
        m.
    """

    linear: Array
    shift: Array


@record
class JointMap(Value):
    """What a pair does to the joint of a leg: ``q' = sign q + constant``.

    Attributes
    ----------
    sign : int
        1 or -1.
    mode_factor : int
        1 or -1: the working mode in which the leg arrives, over its own.
    constant : float
        m or rad, as the joint.
    """

    sign: int
    mode_factor: int
    constant: float


@record
class SymmetryPair(Value):
    """One symmetry: a motion of the base with one of the platform.

    Attributes
    ----------
    label : str
        ``"p0"``, ``"p1"``, ...: its number among all elements.
    base, platform : Motion
        g and h. A platform that does not turn follows g's linear part.
    exchange : bool
        Whether base and platform change roles: then X goes to ``g X^-1 h``.
    words : str
        What it does, in words.
    permutation : tuple of int
        The leg (from 0) onto which each leg goes.
    joints : tuple of JointMap
        One a leg.
    keeps_modes : bool
        Whether every leg arrives in the working mode of the leg where it arrives.
    fixes_home : bool
        Whether home is its own image.
    permutes_readings : bool
        Whether also the sensors agree: readings at the image are those of the pose, permuted and
        with the joints' signs.
    """

    label: str
    base: Motion
    platform: Motion
    exchange: bool
    words: str
    permutation: tuple[int, ...] = field(number=True)
    joints: tuple[JointMap, ...]
    keeps_modes: bool
    fixes_home: bool
    permutes_readings: bool

    @property
    def improper(self) -> bool:
        """Whether it mirrors."""
        return bool(np.linalg.det(self.base.linear) < 0)

    @property
    def tilts(self) -> bool:
        """Whether the direction of Z does not stay on its line, in one of the two spaces."""
        return any(
            abs(abs(each.linear[2, 2]) - 1) > _ROUNDING for each in (self.base, self.platform)
        )

    @property
    def core(self) -> _core.SymmetryPair:
        """The same in the core."""
        base, platform = (
            _core.Isometry(each.linear, each.shift) for each in (self.base, self.platform)
        )
        return _core.SymmetryPair(base, platform, self.exchange)

    def map_poses(self, mechanism: Mechanism, poses: ArrayLike) -> Array:
        """Carry poses, shape (n, coordinates), to their images."""
        return self.core.transform_poses(mechanism.straight, pose_rows(poses))


@record
class SymmetryPairs(Result):
    """All pairs of a mechanism, a group.

    Attributes
    ----------
    elements : tuple of SymmetryPair
        The identity first; exchanges of base and platform last.
    planar : bool
        Whether the mechanism is planar: groups are then C_n and D_n, else Schoenflies'.
    turns : bool
        Whether the platform turns: otherwise there is no motion of it to tell.
    continuous : tuple of str
        "base" or "platform" where its joints lie on one line, so that any turn about it is a
        symmetry: of these one is listed.
    """

    elements: tuple[SymmetryPair, ...]
    planar: bool
    turns: bool
    continuous: tuple[str, ...]

    @property
    def pairs(self) -> tuple[SymmetryPair, ...]:
        """Those that leave base and platform their roles."""
        return tuple(each for each in self.elements if not each.exchange)

    @property
    def exchanges(self) -> tuple[SymmetryPair, ...]:
        """The others."""
        return tuple(each for each in self.elements if each.exchange)

    @property
    def keep_modes(self) -> tuple[SymmetryPair, ...]:
        """Pairs that keep the working modes: they map the workspace of the mode onto itself."""
        return tuple(each for each in self.pairs if each.keeps_modes)

    @property
    def fix_home(self) -> tuple[SymmetryPair, ...]:
        """Pairs that fix home, whatever the modes: the symmetry of the robot as it stands there."""
        return tuple(each for each in self.pairs if each.fixes_home)

    @property
    def keep_modes_and_home(self) -> tuple[SymmetryPair, ...]:
        """Pairs that do both: the paper's G_M, by which poses are mapped."""
        return tuple(each for each in self.keep_modes if each.fixes_home)

    def name(self, elements: Sequence[SymmetryPair], end: str = "base") -> str:
        """Name the group of what the elements do to ``"base"`` or ``"platform"``."""
        motions = [each.base if end == "base" else each.platform for each in elements]
        return group_name([each.linear for each in motions], self.planar)

    def parse(self, label: str) -> SymmetryPair:
        """Return the element of a label such as ``"p3"``."""
        for each in self.elements:
            if each.label == label:
                return each
        last = len(self.elements) - 1
        raise SymkinError(f'"{label}" is no element of the mechanism; expected p0 to p{last}')

    def group_of(self, elements: Sequence[SymmetryPair]) -> str:
        """Name what the elements do to the base; empty if they are no group."""
        kept = [each.core for each in elements]
        for outer in kept:
            for inner in kept:
                product = outer.compose(inner)
                if not any(_core.apart(product, each) < _SAME for each in kept):
                    return ""
        return self.name(elements)

    def orbits(self, elements: Sequence[SymmetryPair]) -> tuple[tuple[int, ...], ...]:
        """Legs (from 0) that the elements carry onto each other, orbit by orbit."""
        count = len(self.elements[0].permutation)
        found = {
            tuple(sorted({each.permutation[leg] for each in elements} | {leg}))
            for leg in range(count)
        }
        return tuple(sorted(found))

    def carriers(self) -> tuple[tuple[int, SymmetryPair], ...]:
        """For each leg the first leg of its orbit, and the element of G_M that carries it there."""
        elements = self.keep_modes_and_home
        found = []
        for leg in range(len(self.elements[0].permutation)):
            reference = min(each.permutation.index(leg) for each in elements)
            found.append(
                (reference, next(each for each in elements if each.permutation[reference] == leg))
            )
        return tuple(found)

    @property
    def sentences(self) -> tuple[str, ...]:
        """What there is, in words."""
        counts = [
            f"{_count(self.pairs, 'symmetry', 'symmetries')} in all",
            f"{len(self.keep_modes)} keep the working modes",
            f"{len(self.keep_modes_and_home)} of these fix home",
        ]
        found = [f"{', '.join(counts)}: {self.name(self.keep_modes_and_home)}."]
        if self.exchanges:
            found.append(
                f"{_count(self.exchanges, 'more exchanges', 'more exchange')} base and platform."
            )
        found += [
            f"All joints of the {end} lie on one line: any turn about it is a symmetry."
            for end in self.continuous
        ]
        return tuple(found)

    def to_dict(self) -> dict[str, Any]:
        """Return numbers, names and elements as plain values, legs counted from 1."""
        return {
            "pairs": len(self.pairs),
            "exchanges": len(self.exchanges),
            "keep_modes": len(self.keep_modes),
            "fix_home": len(self.fix_home),
            "keep_modes_and_home": len(self.keep_modes_and_home),
            "base_group": self.name(self.pairs),
            "platform_group": self.name(self.pairs, "platform") if self.turns else None,
            "group": self.name(self.keep_modes_and_home),
            "continuous": list(self.continuous),
            "elements": [_plain(each) for each in self.elements],
        }

    def columns(self) -> Mapping[str, Sequence[Any]]:
        """Return a row an element; legs count from 1."""
        rows = [_plain(each) for each in self.elements]
        names = "label", "words", "permutation", "keeps_modes", "fixes_home", "permutes_readings"
        return {name: [row[name] for row in rows] for name in names}


def _plain(element: SymmetryPair) -> dict[str, Any]:
    return {
        "label": element.label,
        "words": element.words,
        "exchange": element.exchange,
        "permutation": [leg + 1 for leg in element.permutation],
        "keeps_modes": element.keeps_modes,
        "fixes_home": element.fixes_home,
        "permutes_readings": element.permutes_readings,
        "base": {"linear": element.base.linear.tolist(), "shift_m": element.base.shift.tolist()},
        "platform": {
            "linear": element.platform.linear.tolist(),
            "shift_m": element.platform.shift.tolist(),
        },
    }


def _count(elements: Sequence[SymmetryPair], one: str, more: str) -> str:
    return f"{len(elements)} {one if len(elements) == 1 else more}"


@checks()
def symmetry_pairs(
    mechanism: MechanismGiven, tolerance: float = 1e-6, gain_tolerance: float | None = None
) -> SymmetryPairs:
    """Find all symmetries of a mechanism, about any centres and axes, by matching its legs.

    A declared symmetry is not used. Where joints are counts and how long links are; sensors do not,
    nor do working modes: each element says what it does to them.

    Parameters
    ----------
    mechanism : Mechanism
        Its home decides which elements fix it.
    tolerance : float
        By which places of joints and lengths of links (m) and directions (rad) may be off those of
        a symmetric mechanism. The image of a leg may then be off by up to four times that.
    gain_tolerance : float, optional
        The same for sensor gains, by default `tolerance`.

    Returns
    -------
    SymmetryPairs
    """
    mechanism = as_mechanism(mechanism)
    gain = tolerance if gain_tolerance is None else gain_tolerance
    limits = _core.SymmetryTolerance(tolerance, tolerance, gain)
    found = _core.find_pairs(mechanism.straight, mechanism.home, limits)
    ends = {"base": found.continuous_base, "platform": found.continuous_platform}
    return SymmetryPairs(
        elements=tuple(
            _element(mechanism, f"p{number}", each, tolerance)
            for number, each in enumerate(found.pairs)
        ),
        planar=_is_planar(mechanism),
        turns=mechanism.space.turns,
        continuous=tuple(end for end, continuous in ends.items() if continuous),
    )


def _element(
    mechanism: Mechanism, label: str, found: _core.FoundPair, tolerance: float
) -> SymmetryPair:
    pair = found.pair
    return SymmetryPair(
        label=label,
        base=Motion(pair.base.linear, pair.base.shift),
        platform=Motion(pair.platform.linear, pair.platform.shift),
        exchange=pair.exchange,
        words=_words(pair, _is_planar(mechanism), mechanism.space.turns),
        permutation=tuple(found.permutation),
        joints=tuple(
            JointMap(joint.sign, joint.mode_factor, joint.constant) for joint in found.joints
        ),
        keeps_modes=found.keeps_modes,
        fixes_home=fixes_home(mechanism, pair, max(tolerance, _ROUNDING)),
        permutes_readings=found.permutes_readings,
    )


def _is_planar(mechanism: Mechanism) -> bool:
    return mechanism.pose_space in ("planar", "point")


def _words(pair: _core.SymmetryPair, planar: bool, turns: bool) -> str:
    base = element_words(pair.base.linear, planar)
    platform = element_words(pair.platform.linear, planar)
    words = base if not turns or platform == base else f"{base}; platform: {platform}"
    return f"base and platform exchanged, {words}" if pair.exchange else words


def fixes_home(
    mechanism: Mechanism, pair: _core.SymmetryPair, tolerance: float = _ROUNDING
) -> bool:
    """Whether home is its own image, to four tolerances (m, rad)."""
    home = mechanism.home
    image = pair.transform_poses(mechanism.straight, home[None, :])[0]
    off = image - home
    if mechanism.space.has_angle:
        off[-1] = math.remainder(off[-1], 2 * math.pi)
    elif mechanism.space.turns:  # a quaternion is the same turned round; half an angle, about
        turned = np.array([image[-4:] - home[-4:], image[-4:] + home[-4:]])
        off[-4:] = 2 * turned[np.argmin(np.abs(turned).max(axis=1))]
    return bool(np.abs(off).max() <= _core.IMAGE_TOLERANCES * tolerance)
