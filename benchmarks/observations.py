# SPDX-License-Identifier: MIT
"""Whether intervals and chi-square hold for rows in pairs, ties, planes, bars and attitudes.

    python benchmarks/observations.py [ROBOTS] [CASE ...]
    python benchmarks/observations.py hubs

Every robot differs from a shipped one by its tolerances, which are priors; what is observed has the
noise that is declared. Prints for each case, by default all of them and 300 robots: how many were
identified, the mean of chi-square and its standard error beside the degrees of freedom, how many of
the parameters their 95% intervals hold, as printed and by the model's covariance alone, and the
parameters' errors over their deviations, root mean square. Unknown frames count among the
parameters.

`hubs`: seconds of processor for so many differences of height from one and the same row of a delta,
and as heights above that row, and how far apart both estimates are, in standard deviations.
"""

from __future__ import annotations

import dataclasses
import sys
import time
from collections.abc import Callable, Iterator
from typing import Any

import numpy as np

import symkin
from symkin.analysis.observed import Observed
from symkin.model.settings import Frames
from symkin.planning.observing import where_observed
from symkin.planning.simulation import disturb

WITHIN = 1.959964
SHEET = 0.02  # m, of the sheet above the base
DRILLED = [
    ("leg1.proximal_length", "leg2.distal_length"),
    ("leg2.proximal_length", "leg3.proximal_length"),
]

Case = tuple[symkin.Mechanism, Observed, int, dict[str, Any]]


def linear_delta() -> symkin.Mechanism:
    """A printer with upright towers, made within 0.3 mm and 2 mrad."""
    nominal = symkin.load_mechanism("linear_delta")
    made = dataclasses.replace(nominal.tolerances, length=3e-4, angle=2e-3, gain=1e-9)
    noise = dataclasses.replace(nominal.noise, position=3e-5, reading=2e-5)
    return nominal.replace(tolerances=made, noise=noise)


def planar() -> symkin.Mechanism:
    """The 3-RRR, made within 0.2 mm and 1 mrad at a tenth of its size."""
    nominal = symkin.load_mechanism("3RRR")
    noise = dataclasses.replace(nominal.noise, position=2e-5, orientation=1e-4, reading=5e-5)
    made = dataclasses.replace(nominal.tolerances, gain=1e-9)
    return nominal.replace(noise=noise, tolerances=made)


def hexapod() -> symkin.Mechanism:
    """The shipped hexapod, made within 0.3 mm and 1 mrad, its struts read to 20 um."""
    nominal = symkin.load_mechanism("hexapod_jugglebot")
    spool = float(np.abs(nominal.parameters[0, nominal.parameter_names.index("sensor_gain")]))
    made = dataclasses.replace(nominal.tolerances, length=3e-4, angle=1e-3, gain=1e-9)
    noise = dataclasses.replace(
        nominal.noise, position=5e-5, orientation=1e-4, reading=2e-5 / spool
    )
    return nominal.replace(noise=noise, tolerances=made)


def heights_and_distances() -> Case:
    """A delta whose bed is probed, and between two rows of which a caliper measures."""
    given: dict[str, Any] = {"frames": ["plane"]}
    return linear_delta(), Observed(("height", "separation")), 30, given


def differences_alone() -> Case:
    """A delta of which nothing is measured but between rows."""
    return linear_delta(), Observed(("rise", "separation")), 40, {}


def same_point() -> Case:
    """A planar robot that touches the same point twice, turned otherwise; see `_touching`."""
    robot = planar().replace(frames=Frames(target=(0.03, 0.01, 0.0)))
    return robot, Observed(("offset",)), 40, {"frames": ["target"]}


def tied() -> Case:
    """A planar robot of which links of two legs were drilled in one clamping, see `_drilled`."""
    return planar(), Observed(("position",)), 30, {"tie": [f"{a} = {b}" for a, b in DRILLED]}


def ball_bar() -> Case:
    """A planar robot on a bar about two centres that are known to a centimetre or not at all."""
    anchors = ((0.25, 0.1), (-0.1, 0.3))
    robot = planar().replace(frames=Frames(anchors=anchors))
    return robot, Observed(("distance",), anchors=anchors), 40, {"frames": ["anchors"]}


def tilt() -> Case:
    """A hexapod of which roll and pitch alone are seen."""
    return hexapod(), Observed(("tilt",)), 60, {}


def position_and_tilt() -> Case:
    """A hexapod of which the position is seen, and roll and pitch."""
    return hexapod(), Observed(("position", "tilt")), 40, {}


def held_in_a_plane() -> Case:
    """A delta whose tool slides on a sheet, flat to 30 um, which is where the drawing has it."""
    robot = linear_delta().replace(frames=Frames(plane=(SHEET, 0.0, 0.0)))
    return robot, Observed(("height",)), 60, {"free": ["leg?"]}


def along_an_edge() -> Case:
    """A hexapod that a dial gauge follows along a straightedge, nobody knows where that is."""
    base = (0.0, 0.02, -0.775, 0.0, 0.0, 0.3)
    robot = hexapod().replace(frames=Frames(base=base))
    unknown: dict[str, Any] = {"frames": ["base"]}
    return robot, Observed(("straightness",), base=base), 60, unknown


def along_and_across() -> Case:
    """A hexapod whose position is seen to 10 um along the beam, and to 0.1 mm across."""
    base = (2.0, 1.5, -0.4, 0.2, 0.3, -0.1)
    robot = hexapod()
    noise = dataclasses.replace(robot.noise, position=1e-4, along=1e-5)
    robot = robot.replace(noise=noise, frames=Frames(base=base))
    return robot, Observed(("position",), base=base), 40, {}


CASES: dict[str, Callable[[], Case]] = {
    each.__name__: each
    for each in (
        heights_and_distances,
        differences_alone,
        same_point,
        tied,
        ball_bar,
        tilt,
        position_and_tilt,
        held_in_a_plane,
        along_an_edge,
        along_and_across,
    )
}


def _drilled(actual: symkin.Mechanism) -> symkin.Mechanism:
    """The robot with links as long as those that they were drilled with."""
    parameters, names = np.array(actual.parameters), actual.parameter_names
    for pair in DRILLED:
        (leg, own), (other, its) = (
            (int(block[3:]) - 1, names.index(name))
            for block, _, name in (each.partition(".") for each in pair)
        )
        parameters[other, its] = parameters[leg, own]
    return actual.with_parameters(parameters, symmetry=None)


def _touching(robot: symkin.Mechanism, count: int) -> np.ndarray:
    """Planar poses in pairs at which the target is in the same place, turned otherwise."""
    poses = symkin.sample_workspace(robot, count, seed=1).poses[: count // 2]
    arm = np.array(robot.frames.target[:2])
    turns = np.random.default_rng(1).uniform(-0.2, 0.2, len(poses))
    others = np.array(poses)
    others[:, 2] += turns
    for row, other in zip(poses, others, strict=True):
        before, after = (
            np.array([[np.cos(a), -np.sin(a)], [np.sin(a), np.cos(a)]]) @ arm
            for a in (row[2], other[2])
        )
        other[:2] = row[:2] + before - after
    return np.stack([poses, others], axis=1).reshape(-1, 3)


def figures(case: Callable[[], Case], robots: int) -> Iterator[tuple[float, ...]]:
    """Of each robot chi-square, its degrees, the shares of intervals, the mean squared error."""
    robot, observed, count, unknown = case()
    touches = observed.kinds == ("offset",)
    poses = (
        _touching(robot, count) if touches else symkin.sample_workspace(robot, count, seed=1).poses
    )
    if case is held_in_a_plane:
        poses = np.column_stack([poses[:, :2], np.full(len(poses), SHEET)])
    observed = observed.in_frames(robot.frames)
    poses = where_observed(robot, observed, poses)
    for seed in range(robots):
        actual = disturb(robot, seed)
        if case is tied:
            actual = _drilled(actual)
        readings = actual.inverse_kinematics(poses)
        there = np.isfinite(readings).all(axis=1)
        exact = symkin.Measurements.of(
            poses[there],
            readings[there],
            reading_unit=robot.reading_unit,
            pose_space=robot.pose_space,
        )
        taken = observed.measure(exact, robot.noise, seed)
        found = symkin.identify(robot, taken, prior="tolerances", **unknown)
        if not found.converged:
            continue
        errors, sizes = [], []
        for name in found.names:
            block, _, own = name.partition(".")
            at = found.names.index(name)
            sizes.append(
                [np.sqrt(each[at, at]) for each in (found.covariance, found.model_covariance)]
            )
            if block.startswith("leg"):
                place = robot.parameter_names.index(own)
                true = actual.parameters[int(block[3:]) - 1, place]
            else:
                true = np.nan_to_num(found.params[name].nominal)  # of the plane, which is 0
            errors.append(found.params[name].value - true)
        squares, by_model = np.square(np.array(errors)[:, None] / sizes).T
        yield (
            found.chi_square,
            found.degrees_of_freedom,
            float(np.mean(squares < WITHIN**2)),
            float(np.mean(by_model < WITHIN**2)),
            float(np.mean(squares)),
        )


def hubs() -> None:
    """Print a line a number of rows."""
    robot = linear_delta()
    print("rows     pairs   heights   apart")
    for rows in (40, 160, 320, 640, 1280, 2560):
        poses = symkin.sample_workspace(robot, rows + 1, seed=2).poses
        random = np.random.default_rng(1)
        readings = disturb(robot, 2).inverse_kinematics(poses)
        readings += random.normal(0, robot.noise.reading, readings.shape)
        above = poses[:, 2] - poses[0, 2] + random.normal(0, robot.noise.position, rows + 1)
        above[0], others = 0.0, np.arange(rows + 1) > 0
        of: dict[str, Any] = {"reading_unit": "m", "pose_space": "translating"}
        nothing = np.full_like(poses, np.nan)
        rises = np.where(others, above, np.nan)[:, None]
        partners = others[:, None].astype(int)
        pairs = symkin.Measurements.of(nothing, readings, **of, partners=partners, rises=rises)
        sizes = np.where(others, robot.noise.position, 0.0)
        against = symkin.Measurements.of(
            nothing, readings, **of, heights=above, height_deviations=sizes
        )
        found, seconds = [], []
        for taken, free in ((pairs, ["leg?"]), (against, ["leg?", "plane.c0"])):
            start = time.process_time()
            found.append(symkin.identify(robot, taken, free=free, prior="tolerances"))
            seconds.append(time.process_time() - start)
        one, other = (each.mechanism for each in found)
        scale = np.where(one.deviations > 0, one.deviations, np.inf)
        apart = np.abs((one.parameters - other.parameters) / scale).max()
        print(f"{rows:4d}  {seconds[0]:6.2f} s  {seconds[1]:6.2f} s  {apart:.0e}", flush=True)


def main() -> None:
    """Print a line a case."""
    if sys.argv[1:] == ["hubs"]:
        hubs()
        return
    robots = int(sys.argv[1]) if len(sys.argv) > 1 else 300
    print("case                    identified     chi-square       dof  intervals    model  error")
    for name in sys.argv[2:] or CASES:
        told = np.array(list(figures(CASES[name], robots)))
        chi, degrees, held, modelled, square = told.T
        print(
            f"{name:22s}  {len(told):4d} of {robots:<4d}  {chi.mean():7.1f} +- "
            f"{chi.std() / np.sqrt(len(chi)):.1f}  {degrees.mean():8.1f}  {held.mean():8.1%}"
            f"  {modelled.mean():8.1%}  {np.sqrt(square.mean()):5.3f}",
            flush=True,
        )


if __name__ == "__main__":
    main()
