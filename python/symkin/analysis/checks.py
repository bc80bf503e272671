# SPDX-License-Identifier: MIT
"""What a mechanism is like before anything is measured."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from functools import cached_property
from typing import Any, Literal

import numpy as np

from symkin.analysis.conditions import Conditions, check_conditions
from symkin.analysis.measurable import MeasurableSymmetry, measurable_symmetry
from symkin.analysis.observability import (
    Observability,
    analyse_observability,
    rows_of_leg,
)
from symkin.analysis.readings_alone import ReadingsAlone, readings_alone
from symkin.analysis.workspace import WorkspaceSample, sample_workspace
from symkin.errors import SymkinError, named_legs
from symkin.files.mechanism_file import typed_name
from symkin.model.chains import ChainInfo
from symkin.model.given import MechanismGiven, as_mechanism
from symkin.model.mechanism import Mechanism
from symkin.model.poses import pose_rows
from symkin.model.symmetry import (
    NamedGroup,
    SymmetryComparison,
    SymmetryPairs,
    compare_symmetry,
    leg_carriers,
    symmetry_group,
    symmetry_pairs,
)
from symkin.model.symmetry.groups import core_pairs, mechanism_groups
from symkin.model.tolerances import UNKNOWN
from symkin.options import checks
from symkin.results import Result
from symkin.values import Array, FrozenMapping, Value, field, plain, record

__all__ = ["CheckResult", "HomePose", "LegOrigin", "check_mechanism", "undefined_angles"]

# Enough for two digits of the workspace's share of its box, and drawn in milliseconds.
_SAMPLE_SIZE = 500
_TESTED, _TESTED_SLOW = 20_000, 2_000  # poses of the box for each element
_ALONE = 200  # poses at which ranks are taken
_SHIFT = {
    "base": "shift the origin of the base frame, in the mechanism and in the measured poses alike",
    "platform": "shift the origin of the platform frame, which is the point that poses give",
}


@record
class LegOrigin(Value):
    """Where a leg comes from.

    Attributes
    ----------
    reference : int
        The first leg (from 0) of its orbit.
    element : str
        The group element that carries the reference to it, such as ``"r1"``.
    """

    reference: int = field(number=True)
    element: str


@record
class HomePose(Value):
    """The mechanism at its home pose.

    Attributes
    ----------
    pose : ndarray, shape (coordinates,)
        m and rad (spatial: position and quaternion).
    readings : ndarray, shape (legs,)
        In the sensor's unit.
    serial : ndarray, shape (legs,)
        dh/dq, zero at a serial singularity.
    parallel : float
        det(dg/dpose), zero at a parallel singularity.
    condition : float
        Of dq/dpose, rotations scaled by the characteristic length.
    """

    pose: Array
    readings: Array
    serial: Array
    parallel: float
    condition: float


@record
class CheckResult(Result):
    """What `check_mechanism` finds.

    Attributes
    ----------
    mechanism : Mechanism
        As given.
    group : str
        Its symmetry, such as ``"C3"``: the declared one, or
    declared : bool
        (if not declared) the one found that keeps the working modes.
    comparison : SymmetryComparison
        The symmetry that the legs have, against the declared one or one that is near.
    groups : tuple of NamedGroup
        G_M, its subgroup that keeps the working modes and G_C; with workspace settings G_W and G_Q
        too.
    pairs : SymmetryPairs
        All symmetries, about any axes: those that keep the working modes, and of these those that
        fix home.
    origins : tuple of LegOrigin
        For each leg.
    home : HomePose
        At the home pose.
    sample : WorkspaceSample or None
        Poses drawn; None for a mechanism without workspace settings, or with unusable ones.
    observability : tuple of Observability
        Of each leg at its `leg_poses`; empty without a sample.
    conditions : Conditions or None
        The paper's conditions on symmetry, tested; None without a sample.
    unusable : str or None
        Why the workspace that the mechanism has could not be sampled, such as a singular home.
    readings_alone : ReadingsAlone or None
        What readings show without a measuring device; None where they are as many as the degrees of
        freedom, and without a sample.
    measurable : MeasurableSymmetry or None
        Which symmetries box, joint limits and noise keep; None where no pose is carried by any, and
        without a sample.
    """

    mechanism: Mechanism
    group: str
    declared: bool
    comparison: SymmetryComparison
    groups: tuple[NamedGroup, ...]
    pairs: SymmetryPairs
    origins: tuple[LegOrigin, ...]
    home: HomePose
    sample: WorkspaceSample | None
    observability: tuple[Observability, ...]
    conditions: Conditions | None
    unusable: str | None = None
    readings_alone: ReadingsAlone | None = None
    measurable: MeasurableSymmetry | None = None

    @property
    def undefined(self) -> tuple[str, ...]:
        """Joints at the origin of their frame, where an angle means nothing, in words."""
        legs = range(len(self.mechanism.legs))
        return tuple(each for leg in legs for each in undefined_angles(self.mechanism, leg))

    @property
    def untested(self) -> str:
        """Why conditions and identifiability were not tested; empty if they were."""
        if self.sample is not None:
            return ""
        return self.unusable or "no [workspace] in the file"

    @property
    def share(self) -> float:
        """Share of the box that the workspace takes; NaN without workspace settings."""
        return math.nan if self.sample is None else self.sample.share

    @property
    def leg_poses(self) -> tuple[Array, ...]:
        """For each leg the sample's poses, carried by the element that carries its reference.

        There a symmetric mechanism shows the same of every leg (Eq. 10). Empty without a sample.
        """
        if self.sample is None:
            return ()
        return _leg_poses(self.mechanism, self.sample)

    @property
    def orbits(self) -> tuple[tuple[int, ...], ...]:
        """Legs (from 0) that are images of each other, the reference leg first."""
        references = dict.fromkeys(origin.reference for origin in self.origins)
        return tuple(
            tuple(leg for leg, origin in enumerate(self.origins) if origin.reference == reference)
            for reference in references
        )

    @property
    def missing(self) -> bool:
        """Whether the legs do not have the symmetry that the file declares."""
        declared = self.comparison.declared
        return declared is not None and self.comparison.reference is declared

    @property
    def blind(self) -> bool:
        """Whether some combination of a leg's parameters is shown by no pose of the workspace."""
        return any(leg.unseen for leg in self.observability)

    @cached_property
    def weak(self) -> Mapping[str, float]:
        """Parameters that the drawing knows better than measurements will, and how many times.

        Expected standard deviations over tolerances of more than 10, the largest of any leg, from
        the closures of as many poses as the protocol takes, of what the workspace has on average.
        Empty without a sample, and where some combination is not shown at all.
        """
        mechanism = self.mechanism
        if self.sample is None or self.blind or not any(mechanism.noise.deviations.values()):
            return FrozenMapping()
        found: dict[str, float] = {}
        sets = self.leg_poses
        firsts = {each: readings[0] for readings in mechanism.leg_readings for each in readings}
        for leg in dict.fromkeys(firsts[each.reference] for each in self.origins):
            for name, times in _over_tolerances(mechanism, leg, sets[leg]):
                if times > UNKNOWN:
                    found[name] = max(times, found.get(name, 0.0))
        return FrozenMapping(found)

    @property
    def verdict(self) -> str:
        """Whether one choice of poses serves all legs, or which leg differs, in a sentence."""
        if self.missing:
            return f"The file says that the legs are alike, but {_difference(self.comparison)}."
        first = {readings[0] for readings in self.mechanism.leg_readings}
        orbits, count = [orbit for orbit in self.orbits if orbit[0] in first], len(first)
        if count == 1:
            return "All of it is one leg: poses are chosen for the whole."
        if len(orbits) == 1:
            sensors = sorted({each.parameter for each in self.comparison.sensor_deviations})
            but = f" but for {' and '.join(sensors)}" if sensors else ""
            who, whom = ("Both legs", "both") if count == 2 else (f"All {count} legs", "all")
            return f"{who} are alike{but}: poses chosen for one serve {whom}."
        if len(orbits) < count:
            kinds = "; ".join(named_legs(orbit) for orbit in orbits)
            return f"The legs are of {len(orbits)} kinds ({kinds}): poses for one of each."
        if self.comparison.reference is None:
            return "No leg is like another: poses cannot be shared by symmetry."
        difference = _difference(self.comparison)
        near = self.comparison.verdict == "nearly"
        alike = "alike within tolerances, not exactly" if near else "not alike"
        who = "The legs of each chain" if self.mechanism.mixed else "The legs"
        return f"{who} are {alike}: {difference}."

    @property
    def least_poses(self) -> int:
        """Poses that a leg needs at least: one closure for each of its parameters."""
        return self.mechanism.least_poses

    @property
    def design(self) -> Literal["legs", "mechanism"]:
        """The design of `make_plan` that is its default for this file."""
        mechanism, asked = self.mechanism, self.mechanism.identification
        usual = mechanism.device is None and (asked is None or not asked.unusual)
        apart = not (mechanism.ties or mechanism.noise.varies)
        return "legs" if usual and apart else "mechanism"

    @property
    def shortest_design(self) -> Literal["legs", "orbits", "mechanism"]:
        """The design of `make_plan` that asks for the fewest measurements."""
        if self.design == "mechanism":
            return self.design
        if len(self.orbits) == 1:
            return "orbits"
        redundant = self.mechanism.straight.redundant
        return "legs" if redundant and not self.mechanism.noise.reading else "mechanism"

    @property
    def next_command(self) -> str:
        """The command that plans the measurements; empty while something must be changed first."""
        unready = self.missing or self.sample is None or self.blind
        if unready or self.mechanism.source is None:
            return ""
        return f"symkin plan {typed_name(self.mechanism)} --out planned"

    @property
    def next_step(self) -> str:
        """What to do now: what to change, or the command that plans the measurements."""
        if self.missing:
            return "correct the legs, or take the [symmetry] out of the file"
        if self.sample is None:
            return "give the file a [workspace] that can be sampled, and check again"
        if self.blind:
            return (
                "take a larger workspace, another sensor or fewer parameters; more poses do not "
                "help"
            )
        return self.next_command or "symkin.plan(mechanism)"

    def columns(self) -> Mapping[str, Sequence[Any]]:
        """Return a row a leg; legs count from 1, as in all tables."""
        mechanism, seen = self.mechanism, self.observability
        known = np.where(mechanism.has_parameter, mechanism.parameters, np.nan)
        return {
            "leg": list(range(1, len(self.origins) + 1)),
            "reference": [origin.reference + 1 for origin in self.origins],
            "element": [origin.element for origin in self.origins],
            "working_mode": list(mechanism.working_modes),
            **dict(zip(mechanism.parameter_names, known.T, strict=True)),
            f"home_reading_{mechanism.reading_unit}": self.home.readings,
            **({"rank": [leg.rank for leg in seen]} if seen else {}),
            **({"condition": [leg.condition for leg in seen]} if seen else {}),
        }

    def to_dict(self) -> dict[str, Any]:
        """Return all that was found as plain values; legs count from 1."""
        mechanism = self.mechanism
        document = {
            "mechanism": mechanism.name,
            "file": mechanism.source,
            "chain": mechanism.chain,
            "pose_space": mechanism.pose_space,
            "reading_unit": mechanism.reading_unit,
            "verdict": self.verdict,
            "measuring": {
                "identifiable": None if self.sample is None else not self.blind,
                "least_poses": self.least_poses,
                "deviations_in_tolerances": self.weak,
                "design": self.design,
                "shortest_design": self.shortest_design,
                "next": self.next_step,
            },
            "symmetry": {
                "group": self.group,
                "declared": self.declared,
                **self.comparison.to_dict(),
                "groups": self.groups,
                "pairs": self.pairs.to_dict(),
                "orbits": [[leg + 1 for leg in orbit] for orbit in self.orbits],
            },
            "conditions": self.conditions,
            "legs": [
                {
                    "leg": number,
                    **({"chain": leg.chain} if mechanism.mixed else {}),
                    "reference_leg": origin.reference + 1,
                    "element": origin.element,
                    "working_mode": leg.working_mode,
                    "parameters": leg.parameters,
                }
                for number, (leg, origin) in enumerate(
                    zip(mechanism.legs, self.origins, strict=True), 1
                )
            ],
            "home": self.home,
            "workspace": self.sample,
            "unusable": self.unusable,
            "undefined": self.undefined,
            "identifiability": [
                {
                    "leg": number,
                    **shown.to_dict(),
                    "held": mechanism.held[number - 1],
                }
                for number, shown in enumerate(self.observability, 1)
            ],
        }
        plain_document: dict[str, Any] = plain(document)
        return plain_document


@checks()
def check_mechanism(mechanism: MechanismGiven, seed: int | None = None) -> CheckResult:
    """Check what a mechanism file describes: symmetry, home pose, workspace, identifiability.

    Parameters
    ----------
    mechanism : Mechanism
        The nominal one.
    seed : int, optional
        Of the poses drawn from the workspace; by default the protocol's.

    Returns
    -------
    CheckResult
        If home is not in the workspace, or hardly any pose of its box is, without a sample and what
        rests on it; `CheckResult.unusable` says why.
    """
    mechanism = as_mechanism(mechanism)
    sample, unusable = None, None
    if mechanism.workspace is not None:
        try:
            sample = sample_workspace(mechanism, _SAMPLE_SIZE, seed)
        except SymkinError as error:
            unusable = str(error)
    sets = () if sample is None else _leg_poses(mechanism, sample)
    comparison = compare_symmetry(mechanism)
    legs = [mechanism.leg_info(each) for each in range(len(mechanism.legs))]
    tested = _TESTED if all(map(_is_quick, legs)) else _TESTED_SLOW
    conditions = check_conditions(mechanism, tested, seed) if sample is not None else None
    groups = mechanism_groups(mechanism, comparison.found)
    pairs = symmetry_pairs(mechanism)
    return CheckResult(
        mechanism=mechanism,
        group=symmetry_group(mechanism).name,
        declared=mechanism.symmetry is not None,
        comparison=comparison,
        groups=groups if conditions is None else conditions.groups,
        pairs=pairs,
        origins=tuple(
            LegOrigin(reference, element.label) for reference, element in leg_carriers(mechanism)
        ),
        home=_home(mechanism),
        sample=sample,
        observability=tuple(
            analyse_observability(mechanism, leg, poses) for leg, poses in enumerate(sets)
        ),
        conditions=conditions,
        unusable=unusable,
        readings_alone=None if sample is None else readings_alone(mechanism, sample.poses[:_ALONE]),
        measurable=None if sample is None else measurable_symmetry(mechanism, sample, pairs),
    )


def _is_quick(chain: ChainInfo) -> bool:
    """Whether a leg's joints are known in closed form: a hundred times as fast."""
    return not chain.declared or bool(chain.runs_as)


def _leg_poses(mechanism: Mechanism, sample: WorkspaceSample) -> tuple[Array, ...]:
    """Poses carried to each leg by the element that carries its reference leg (Eqs. 14, 22)."""
    rows = pose_rows(sample)
    pairs = core_pairs(mechanism, (each for _, each in leg_carriers(mechanism)))
    return tuple(pair.transform_poses(mechanism.straight, rows) for pair in pairs)


def _over_tolerances(mechanism: Mechanism, leg: int, poses: Array) -> Iterator[tuple[str, float]]:
    """Standard deviations to expect of a leg's parameters, in tolerances, from such poses."""
    rows, names, tolerances = rows_of_leg(mechanism, leg, poses, "noise_aware")
    rows = rows[np.isfinite(rows).all(axis=1)] * tolerances
    _, values, directions = np.linalg.svd(rows, full_matrices=False)
    share = mechanism.protocol.pose_count / len(poses)
    deviations = np.linalg.norm(directions / values[:, None], axis=0) / math.sqrt(share)
    yield from zip(names, deviations.tolist(), strict=True)


def _home(mechanism: Mechanism) -> HomePose:
    serial, parallel, condition = mechanism.singularity_measures(mechanism.home)
    return HomePose(
        pose=mechanism.home,
        readings=mechanism.inverse_kinematics(mechanism.home)[0],
        serial=serial[0],
        parallel=float(parallel[0]),
        condition=float(condition[0]),
    )


def _difference(comparison: SymmetryComparison) -> str:
    """Which leg differs, or differs most, and by what, in the units of a workshop."""
    if not comparison.deviations:
        return "the legs differ by little more than rounding"
    worst = comparison.deviations[0]
    alone = all(each.leg == worst.leg for each in comparison.deviations)
    scale, unit = {"m": (1e3, " mm"), "rad": (math.degrees(1), " degrees")}.get(
        worst.unit, (1.0, f" {worst.unit}" if worst.unit else "")
    )
    times = worst.in_tolerances
    tolerances = f"{times:.0f}" if times >= 100 else f"{times:.2g}"
    return (
        f"leg {worst.leg + 1} differs{'' if alone else ' most'}, {worst.parameter} by "
        f"{scale * abs(worst.deviation):.2g}{unit} ({tolerances} tolerances)"
    )


def undefined_angles(mechanism: Mechanism, leg: int) -> tuple[str, ...]:
    """Say which joints of a leg (from 0) have no angle, being within a tolerance of the origin.

    Such a joint can be identified, but not by its polar coordinates. A sentence for each end, with
    what to do; empty for nearly every leg.
    """
    return tuple(_undefined(mechanism, leg))


def _undefined(mechanism: Mechanism, leg: int) -> Iterator[str]:
    values = mechanism.legs[leg].parameters
    joints = mechanism.chains[leg].replace("[", "").replace("]", "")
    for (end, remedy), joint in zip(_SHIFT.items(), (joints[0], joints[-1]), strict=True):
        radius = values.get(f"{end}_radius")
        if radius is None and not mechanism.space.moves:
            yield from _undefined_axis(mechanism, leg, end)
        in_space = f"{end}_height" in values
        if radius is None or (joint == "P" and not in_space):  # a normal has its angle anywhere
            continue
        polar = values.get(f"{end}_polar_angle")
        azimuth = "azimuth" if f"{end}_azimuth" in values else "angle"
        if abs(radius) <= mechanism.tolerances.length:
            names = [f"{end}_{azimuth}"] if polar is None else [f"{end}_polar_angle"]
            names += [] if polar is None else [f"{end}_{azimuth}"]
            place = "on Z" if in_space else "the frame's origin"
            where = f"{end}_radius is {radius:g} m: its {end} point is {place}"
        elif polar is not None and abs(radius * math.sin(polar)) <= mechanism.tolerances.length:
            names = [f"{end}_{azimuth}"]
            where = f"{end}_polar_angle is {math.degrees(polar):g} deg: its {end} point is on Z"
        else:
            continue
        verb = "are" if len(names) > 1 else "is"
        yield f"leg {leg + 1}: {where}, where {' and '.join(names)} {verb} undefined; {remedy}"


def _undefined_axis(mechanism: Mechanism, leg: int, end: str) -> Iterator[str]:
    """Of an axis along Z its meridian, from which the angle of a link on the base counts."""
    polar = mechanism.legs[leg].parameters[f"{end}_polar_angle"]
    if abs(math.sin(polar)) > mechanism.tolerances.angle:
        return
    what = "where base_azimuth does what sensor_offset does"
    if end == "platform":
        what = "where platform_azimuth is undefined"
    yield (
        f"leg {leg + 1}: {end}_polar_angle is {math.degrees(polar):g} deg: its {end} axis is on Z, "
        f"{what}; turn the {end} frame"
        + (", in the mechanism and in the measured poses alike" if end == "base" else "")
    )
