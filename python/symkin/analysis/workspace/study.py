# SPDX-License-Identifier: MIT
"""What a workspace looks like, and whether it has the symmetry of the legs, tested on poses."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from symkin import _core
from symkin.analysis.workspace import (
    WorkspaceSample,
    inside_workspace,
    sample_workspace,
    workspace_options,
)
from symkin.errors import SymkinError
from symkin.model.given import MechanismGiven, as_mechanism
from symkin.model.mechanism import Mechanism
from symkin.model.symmetry import DetectedSymmetry, SymmetryElement, SymmetryGroup, detect_symmetry
from symkin.options import checks
from symkin.results import Result
from symkin.values import Array, Value, field, plain, record

_PAPER_ORIENTATIONS = (0.0, 0.4, 0.6)  # rad, section 6.2
_TURNS = 3600  # orientations at which a singularity is looked for
_BEYOND_BOX = 0.1  # of the box's side
_SINGULAR = 1e8  # condition number beyond which rounding decides the determinant's sign
READING_ROUNDING = 1e-9  # rad or m, far above what the readings inside a workspace differ by


@record
class ConstantOrientation(Value):
    """The workspace at one orientation of the platform, on a grid over the box and a little more.

    Grids are addressed ``[row of y, column of x]``.

    Attributes
    ----------
    orientation : float
        rad; of a spatial platform about Z, at home's height and tilt; NaN for a point. Of a
        platform that the legs bind the last coordinate of `slice_coordinates` instead: of a 3-RPS
        the height, m.
    x, y : ndarray, shape (columns,), (rows,)
        Centres of the cells, m; of such a platform the first two of those: of a 3-RPS the tilts rx
        and ry, rad.
    reach_margin : ndarray, shape (rows, columns)
        Of the leg that is nearest to the end of its reach, m. Zero at a serial (type 1)
        singularity, negative out of reach, infinite where nothing limits it.
    serial : ndarray, shape (rows, columns)
        Smallest abs(dh/dq) of the legs; NaN out of reach.
    parallel : ndarray, shape (rows, columns)
        det(dh/dpose) over its value at home. Zero at a parallel (type 2) singularity, NaN out of
        reach; with more legs than degrees of freedom sqrt(det(J'J)) of J = dg/dpose instead, which
        has no sign.
    side : ndarray of int, shape (rows, columns)
        Sign of det(dg/dpose), which bounds the workspace's aspect: 1 as at home, -1 on the other
        side, 0 out of reach or singular to rounding.
    aspects : ndarray of int, shape (rows, columns)
        Number of the connected region without singularities that the cell belongs to, from 1 for
        the largest; 0 where `side` is. Regions may be connected through other orientations.
    usable : ndarray of bool, shape (rows, columns)
        Whether the pose is in the workspace, its box included.
    readings : ndarray, shape (rows, columns, legs)
        The active-joint workspace of the orientation, in the sensor's unit; NaN where a leg cannot
        reach.
    units : tuple of str
        Of `orientation`, and of x and y, whose square areas have.
    """

    orientation: float
    x: Array
    y: Array
    reach_margin: Array
    serial: Array
    parallel: Array
    side: NDArray[np.int8]
    aspects: NDArray[np.intp]
    usable: NDArray[np.bool_]
    readings: Array
    units: tuple[str, str] = field(private=True, default=("rad", "m"))

    @property
    def cell_area(self) -> float:
        """Area of a cell, m^2 or rad^2."""
        return float((self.x[1] - self.x[0]) * (self.y[1] - self.y[0]))

    @property
    def reachable_area(self) -> float:
        """Area of the grid that all legs reach."""
        return self.cell_area * float((self.reach_margin >= 0).sum())

    @property
    def usable_area(self) -> float:
        """Area of the workspace."""
        return self.cell_area * float(self.usable.sum())

    def area_of_side(self, side: int) -> float:
        """Reachable area on one side (1 or -1) of the parallel singularities."""
        return self.cell_area * float((self.side == side).sum())

    @property
    def aspect_areas(self) -> Array:
        """Area of each numbered aspect: positive on home's side, negative on the other."""
        cells = np.bincount(self.aspects.ravel(), self.side.ravel())[1:]
        return np.asarray(self.cell_area * cells, dtype=np.float64)

    def to_dict(self) -> dict[str, Any]:
        """Return orientation, or height, and areas, without the grids."""
        place, unit = {"rad": "orientation_rad", "m": "height_m"}[self.units[0]], self.units[1]
        return {
            place: plain(self.orientation),
            f"reachable_area_{unit}2": self.reachable_area,
            f"usable_area_{unit}2": self.usable_area,
            f"aspect_areas_{unit}2": plain(self.aspect_areas),
        }


@record
class ModeSlices(Value):
    """Constant-orientation workspaces of a mechanism in its working modes.

    Attributes
    ----------
    mechanism : Mechanism
        Whose they are.
    slices : tuple of ConstantOrientation
        See `constant_orientations`.
    singular_orientations : ndarray
        See `singular_orientations`, rad.
    """

    mechanism: Mechanism = field(private=True)
    slices: tuple[ConstantOrientation, ...]
    singular_orientations: Array

    @property
    def title(self) -> str:
        """Such as ``"working mode -1"``; ``"working modes +-"`` where the legs' modes differ."""
        modes = self.mechanism.working_modes
        if len(set(modes)) == 1:
            return f"working mode {modes[0]:+d}"
        return "working modes " + "".join("+" if mode > 0 else "-" for mode in modes)

    def to_dict(self) -> dict[str, Any]:
        """Return modes, singular orientations and areas."""
        return {
            "working_modes": list(self.mechanism.working_modes),
            "singular_orientations_at_home_rad": plain(self.singular_orientations),
            "slices": plain(self.slices),
        }


def mode_slices(
    mechanism: Mechanism, orientations: Sequence[float] | None = None, resolution: int = 201
) -> ModeSlices:
    """Evaluate `constant_orientations` and `singular_orientations` of a mechanism."""
    return ModeSlices(
        mechanism,
        constant_orientations(mechanism, orientations, resolution),
        singular_orientations(mechanism),
    )


def constant_orientations(
    mechanism: Mechanism, orientations: Sequence[float] | None = None, resolution: int = 201
) -> tuple[ConstantOrientation, ...]:
    """Evaluate constant-orientation workspaces, one for each orientation.

    The grids, of so many cells along each side, cover the x and y of the workspace's box, and a
    tenth more on each side to show where the legs' reach ends. Orientations are rad, by default
    home's, and 0.4 and 0.6 rad on from it, as in the paper. A point platform has one workspace,
    whatever is given. A platform that the legs bind is shown over two coordinates that they leave
    it, see `slice_coordinates`, at home's value of a third and those where the box ends, and
    nothing can be given. Raises `SymkinError` without a workspace, and where home is singular.
    """
    if resolution < 2:
        raise SymkinError(f"the resolution is {resolution}; expected at least 2 cells a side")
    options = workspace_options(mechanism)
    home = mechanism.home_coordinates
    across, along = slice_coordinates(mechanism)
    if not mechanism.space.turns:
        orientations = (math.nan,)
    elif mechanism.bound:
        if orientations is not None:
            raise SymkinError(
                f'the legs of "{mechanism.name}" bind its platform; its workspace is shown over '
                "two coordinates that they leave it, at values of a third of its own"
            )
        ends = float(options.lower[along]), float(options.upper[along])
        orientations = sorted({ends[0], float(home[along]), ends[1]})
    elif orientations is None:
        orientations = [float(home[along]) + turn for turn in _PAPER_ORIENTATIONS]
    shares = (np.arange(resolution) + 0.5) / resolution * (1 + 2 * _BEYOND_BOX) - _BEYOND_BOX
    x, y = (
        low + shares * (high - low)
        for low, high in zip(options.lower[across], options.upper[across], strict=True)
    )
    return tuple(_constant_orientation(mechanism, home, angle, x, y) for angle in orientations)


def slice_coordinates(mechanism: Mechanism) -> tuple[list[int], int]:
    """Return the two coordinates that a slice spans, and that at whose value it is taken.

    The first two and the orientation about Z; of a platform that the legs bind two positions that
    they leave free, or two turns where these are not as many, and the last of the others.

    Raises
    ------
    SymkinError
        Where the legs leave fewer than three coordinates, or no two of a kind.
    """
    if not mechanism.bound:
        return [0, 1], mechanism.space.dof - 1
    positions = [each for each in mechanism.free if each < mechanism.space.size]
    turns = [each for each in mechanism.free if each not in positions]
    across = (positions if len(positions) > 1 else turns)[:2]
    left = [each for each in mechanism.free if each not in across]
    if len(across) < 2 or not left:
        raise SymkinError(
            f'the legs of "{mechanism.name}" leave {len(positions)} positions and {len(turns)} '
            "turns of its platform free; a workspace is shown over two of a kind and one more"
        )
    return across, left[-1]


def _slice_units(mechanism: Mechanism) -> tuple[str, str]:
    """Of the coordinate at whose value a slice is taken, and of those that it spans."""
    if not mechanism.bound:
        return "rad", mechanism.space.closure_unit
    units = [*mechanism.space.units.values()]
    (first, _), along = slice_coordinates(mechanism)
    return units[along], units[first]


def other_working_modes(mechanism: Mechanism) -> Mechanism | None:
    """Return the mechanism with every leg in its other mode; None if no chain has another."""
    has_other = [
        _core.chain_info(chain, mechanism.platform).mode_is_orientation
        for chain in mechanism.chains
    ]
    if not any(has_other):
        return None
    legs = [
        dataclasses.replace(leg, working_mode=-leg.working_mode if other else leg.working_mode)
        for leg, other in zip(mechanism.legs, has_other, strict=True)
    ]
    return mechanism.replace(legs=legs)


def singular_orientations(mechanism: Mechanism) -> Array:
    """Orientations at home's position where the platform meets a parallel singularity, rad.

    Within half a turn of home, ascending, interpolated between samples. Empty for a
    platform that never turns or that the legs bind, and with more legs than degrees of freedom,
    whose determinant has no sign.
    """
    home = mechanism.home_coordinates
    if not mechanism.space.turns or mechanism.bound:
        return np.empty(0)
    angles = home[-1] + np.linspace(-math.pi, math.pi, _TURNS + 1)
    values = np.tile(home, (len(angles), 1))
    values[:, -1] = angles
    poses = mechanism.poses_at(values)
    parallel = _relative_determinant(mechanism, poses)
    serial = mechanism.singularity_measures(poses)[0]
    before, after = parallel[:-1], parallel[1:]
    # Through a serial singularity it may jump; a pose out of reach has NaN.
    smooth = (serial[:-1] * serial[1:] > 0).all(axis=1)
    crossed = np.flatnonzero((before * after < 0) & smooth)
    share = before[crossed] / (before[crossed] - after[crossed])
    return np.asarray(angles[crossed] + share * (angles[1] - angles[0])) + 0.0


def _constant_orientation(
    mechanism: Mechanism, home: Array, orientation: float, x: Array, y: Array
) -> ConstantOrientation:
    values = np.tile(home, (len(y), len(x), 1))
    across, along = slice_coordinates(mechanism)
    values[..., across[0]], values[..., across[1]] = x, y[:, np.newaxis]
    if mechanism.space.turns:
        values[..., along] = orientation
    shape = values.shape[:2]
    poses = mechanism.poses_at(values).reshape(len(x) * len(y), -1)
    reach = _core.reach_margin(mechanism.straight, poses).min(axis=1)
    serial, determinant, condition = mechanism.singularity_measures(poses)
    sign = np.sign(determinant) * np.sign(mechanism.singularity_measures(mechanism.home)[1])
    regular = (reach >= 0) & (condition < _SINGULAR)
    side = np.where(regular, sign, 0).astype(np.int8).reshape(shape)
    return ConstantOrientation(
        orientation=float(orientation),
        x=x,
        y=y,
        reach_margin=reach.reshape(shape),
        serial=np.abs(serial).min(axis=1).reshape(shape),
        parallel=_relative_determinant(mechanism, poses).reshape(shape),
        side=side,
        aspects=_connected_regions(side),
        usable=(inside_workspace(mechanism, poses) & _in_box(mechanism, values)).reshape(shape),
        readings=mechanism.inverse_kinematics(poses).reshape(*shape, -1),
        units=_slice_units(mechanism),
    )


def _in_box(mechanism: Mechanism, values: Array) -> NDArray[np.bool_]:
    """Whether the box holds the positions of poses; an orientation is drawn as it is asked for."""
    options = workspace_options(mechanism)
    across, _ = slice_coordinates(mechanism)
    position, lower, upper = values[..., across], options.lower[across], options.upper[across]
    return np.asarray(((position >= lower) & (position <= upper)).all(axis=-1).ravel())


def _relative_determinant(mechanism: Mechanism, poses: Array) -> Array:
    """`ConstantOrientation.parallel` of poses."""
    _, _, condition = mechanism.singularity_measures(mechanism.home)
    if not condition[0] < _SINGULAR:  # NaN if it is out of reach
        raise SymkinError(f'the home pose of mechanism "{mechanism.name}" is singular')
    return _determinant(mechanism, poses) / _determinant(mechanism, mechanism.home)


def _determinant(mechanism: Mechanism, poses: Array) -> Array:
    """det(dh/dpose) up to its sign: finite at the end of a leg's reach, unlike det(dg/dpose)."""
    serial, parallel, _ = mechanism.singularity_measures(poses)
    if mechanism.straight.redundant:
        return parallel
    return np.asarray(parallel * serial.prod(axis=1))


def _connected_regions(side: NDArray[np.int8]) -> NDArray[np.intp]:
    """Number the connected regions of equal non-zero values, from 1 for the largest."""
    labels = np.arange(1, side.size + 1).reshape(side.shape)
    labels[side == 0] = 0
    while True:
        before = labels.copy()
        for first, second in (np.s_[:-1, :], np.s_[1:, :]), (np.s_[:, :-1], np.s_[:, 1:]):
            joined = (side[first] == side[second]) & (side[first] != 0)
            for here, there in (first, second), (second, first):
                np.minimum(labels[here], labels[there], out=labels[here], where=joined)
        # A label is the number of a cell of the same region: that cell's own label is lower.
        labels = np.concatenate([[0], labels.ravel()])[labels]
        if np.array_equal(labels, before):
            break
    found, sizes = np.unique(labels[labels > 0], return_counts=True)
    ranks = np.zeros(side.size + 1, dtype=np.intp)
    ranks[found[np.argsort(-sizes, kind="stable")]] = np.arange(1, len(found) + 1)
    return ranks[labels]


@record
class ElementCheck(Value):
    """The workspace theorem (Eq. 2) and the active-joint conjecture (Eq. 5) for one element.

    Attributes
    ----------
    element : str
        Such as ``"r1"`` or ``"s0"``.
    keeps_modes : bool
        Whether it keeps the working modes. One that does not maps the workspace onto that of the
        opposite modes, and is tested against it.
    keeps_aspect : bool
        Whether it keeps the working modes and home's side of the parallel singularities, so that it
        can map the workspace onto itself.
    tested, inside, unreachable : int
        Poses drawn from the box; how many are in the workspace, or beyond a leg's reach.
    mismatches : int
        Poses that are in the workspace while their images are not, or the reverse; or that a leg
        reaches while its image does not reach theirs.
    reading_deviation : float
        Largest difference between the readings at the image of a pose and the image of its
        readings, in the sensor's unit.
    """

    element: str
    keeps_modes: bool
    keeps_aspect: bool
    tested: int
    inside: int
    unreachable: int
    mismatches: int
    reading_deviation: float


@record
class WorkspaceStudy(Result):
    """A mechanism's workspace.

    Attributes
    ----------
    mechanism : Mechanism
        Whose it is.
    symmetry : DetectedSymmetry
        Found from the legs.
    modes : tuple of ModeSlices
        The constant-orientation workspaces, first in the mechanism's own working modes, then, if
        they were asked for, in the others.
    sample : WorkspaceSample
        Poses of the total workspace; the readings there are the active-joint workspace.
    elements : tuple of ElementCheck
        For each element of the structure's group.
    """

    mechanism: Mechanism
    symmetry: DetectedSymmetry
    modes: tuple[ModeSlices, ...]
    sample: WorkspaceSample
    elements: tuple[ElementCheck, ...]

    @property
    def slices(self) -> tuple[ConstantOrientation, ...]:
        """The constant-orientation workspaces in the mechanism's own working modes."""
        return self.modes[0].slices

    @property
    def share(self) -> float:
        """Share of the box that the total workspace takes."""
        return self.sample.share

    @property
    def workspace_group(self) -> tuple[str, ...]:
        """G_W: elements that map this workspace, in its modes and its aspect, onto itself."""
        return tuple(
            check.element for check in self.elements if check.keeps_aspect and check.mismatches == 0
        )

    def columns(self) -> Mapping[str, Sequence[Any]]:
        """Return a row for each constant orientation of each working mode."""
        rows = [
            {"working_modes": modes.title, **found.to_dict()}
            for modes in self.modes
            for found in modes.slices
        ]
        return {name: [row[name] for row in rows] for name in rows[0]}

    def to_dict(self) -> dict[str, Any]:
        """Return figures and verdicts, without poses and grids."""
        symmetry, sample, unit = self.symmetry, self.sample, self.mechanism.reading_unit
        elements = [check.to_dict() for check in self.elements]
        for element in elements:
            element[f"reading_deviation_{unit}"] = element.pop("reading_deviation")
        return {
            "mechanism": self.mechanism.name,
            "symmetry": {
                "structure": symmetry.structure.name,
                "structure_in_the_paper": symmetry.structure.paper_name,
                "with_working_modes": symmetry.with_modes.name,
                "workspace": list(self.workspace_group),
            },
            "elements": elements,
            "total_workspace": {"poses": len(sample), **sample.to_dict()},
            "active_joint_workspace": {
                f"lower_{unit}": sample.readings.min(axis=0).tolist(),
                f"upper_{unit}": sample.readings.max(axis=0).tolist(),
            },
            "constant_orientations": plain(self.modes),
        }


@checks()
def study_workspace(
    mechanism: MechanismGiven,
    orientations: Sequence[float] | None = None,
    count: int = 100_000,
    seed: int | None = None,
    resolution: int = 201,
    both_modes: bool = False,
) -> WorkspaceStudy:
    """Study the workspace and the active-joint workspace (section 6.2 of the paper).

    Parameters
    ----------
    mechanism : Mechanism
        With its workspace settings.
    orientations : sequence of float, optional
        Of the constant-orientation workspaces, rad; see `constant_orientations`.
    count : int
        Poses of the total workspace, and poses tested for each element of the symmetry.
    seed : int, optional
        By default the protocol's. The same seed gives the same study.
    resolution : int
        Cells along each side of the constant-orientation workspaces.
    both_modes : bool
        Whether to evaluate these with all legs in their other working mode too.

    Raises
    ------
    SymkinError
        If the mechanism has no workspace, its home is not in it, or hardly any pose of its box is.
    """
    mechanism = as_mechanism(mechanism)
    seed = mechanism.protocol.seed if seed is None else seed
    symmetry = detect_symmetry(mechanism)
    shown = [mechanism, other_working_modes(mechanism) if both_modes else None]
    return WorkspaceStudy(
        mechanism=mechanism,
        symmetry=symmetry,
        modes=tuple(mode_slices(each, orientations, resolution) for each in shown if each),
        sample=sample_workspace(mechanism, count, seed),
        elements=check_elements(mechanism, symmetry.structure, count, seed),
    )


def check_elements(
    mechanism: Mechanism,
    group: SymmetryGroup,
    count: int,
    seed: int,
    tolerance: tuple[float, float, float] | None = None,
) -> tuple[ElementCheck, ...]:
    """Test the theorem and the conjecture on so many poses of the box for each element of a group.

    The group maps the legs onto themselves within a tolerance of lengths (m), angles (rad) and
    gains, by default that of `detect_symmetry`.

    Raises
    ------
    SymmetryError
        If an element does not.
    """
    tested = _core.verify_workspace_symmetry(
        mechanism.straight,
        workspace_options(mechanism),
        group.core,
        group.elements,
        count,
        seed,
        _core.SymmetryTolerance(*(tolerance or ())),
    )
    return tuple(
        ElementCheck(
            element=element.label,
            keeps_modes=found.keeps_modes,
            keeps_aspect=found.keeps_modes and _keeps_side(mechanism, group, element),
            tested=found.tested,
            inside=found.inside,
            unreachable=found.unreachable,
            mismatches=found.mismatches,
            reading_deviation=found.reading_deviation,
        )
        for element, found in zip(group.elements, tested, strict=True)
    )


def _keeps_side(mechanism: Mechanism, group: SymmetryGroup, element: SymmetryElement) -> bool:
    """Whether det(dg/dpose) has the same sign at home and at its image."""
    home = mechanism.home[np.newaxis]
    image = _core.transform_poses(group.core, element, mechanism.straight, home)
    _, parallel, _ = mechanism.singularity_measures(np.concatenate([home, image]))
    return bool(parallel[0] * parallel[1] > 0)
