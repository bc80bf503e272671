# SPDX-License-Identifier: MIT
"""Whether guided measuring pays: sessions on simulated robots, with what goes wrong in one.

    .venv/bin/python benchmarks/guided.py [3RRR linear_delta delta_heights hexapod_jugglebot]

Each session is a robot of its own, made within the tolerances, and decides by itself (`resolve`).
Met is the share of the sessions whose robot really keeps the accuracy, over the workspace; alarmed
that in which a row or a slip was doubted; found after: rows from a slip until it was found. A slip
is of 5 standard deviations of a reading from what all else says of it that is measured at a pose:
so large is what a row shows of it. Moved is the
device by 20 standard deviations of a position, and as much at 0.2 m from where it was; named is the
share of the sessions that call it that; with --known-frames its place was as declared before. Batch
is a
plan of as many poses as are enough for the accuracy, each that fails being replaced by the next
spare: its rows, the tries that they took, and the share of the robots identified from them
that keep the accuracy; what goes wrong is the same, and nothing but failures is noticed.

    .venv/bin/python benchmarks/guided.py hexapod_jugglebot --rows 200 --candidates 30000

With --rows sessions go on until so many rows, whatever the accuracy, and what is printed is how
long a row takes: from when it is entered until it is judged and the next pose is there, by the
clock and of the processor, in the median, of 95% of the rows and of the slowest.
"""

import argparse
import time
from collections.abc import Iterator
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

import symkin
from symkin.analysis.observed import Observed
from symkin.data.measurements import Measurements
from symkin.estimate.survey import Survey
from symkin.guided import Ask, Session, SimulatedDevice
from symkin.model.settings import Tolerances
from symkin.planning.simulation import disturb

MOST = 120  # tries
SLIPS_AT = 14
KINDS = ("sound", "failures", "region", "tolerances", "slip", "moved")
MOVED = 20.0  # standard deviations of a position
TINY = 0.25  # of the accuracy wanted: what 200 rows do not reach
RADIUS = 0.2  # m, at which a turn moves as much


class Case(NamedTuple):
    """What is measured of a robot, what is unknown, and how well what is to be known, m."""

    robot: str
    accuracy: float
    observe: str
    unknowns: dict[str, Any]
    of: str | None = None


TOLERATED = {"prior": "tolerances"}
CASES = {
    "3RRR": Case("3RRR", 1e-4, "pose", {}),
    "linear_delta": Case("linear_delta", 6e-5, "position", {"frames": ["base"], **TOLERATED}),
    "delta_heights": Case(
        "linear_delta", 4e-5, "height", {"frames": ["plane"], **TOLERATED}, of="height"
    ),
    "hexapod_jugglebot": Case(
        "hexapod_jugglebot", 4e-4, "position", {"frames": ["base", "target"], **TOLERATED}
    ),
}


class Trial:
    """One robot as it was made and as it is measured, and what goes wrong meanwhile."""

    def __init__(self, kind: str, robot: symkin.Robot, case: Case, seed: int) -> None:
        """Make it."""
        tolerances = vars(robot.tolerances)
        drawn = robot
        if kind == "tolerances":
            wide = {name: value and 3 * value for name, value in tolerances.items()}
            drawn = robot.replace(tolerances=Tolerances(**wide))
        self.kind, self.robot, self.case = kind, robot, case
        self.actual = disturb(drawn, seed)
        lost = 0.1 if kind == "failures" else 0.0
        self.device = SimulatedDevice(robot, seed, self.actual, observe=case.observe, lost=lost)
        self.sample = robot.sample_workspace(1000, seed=1).poses
        if case.of == "height":  # which is of the bed, z = 0
            self.sample = self.sample * [1, 1, 0]
        size = robot.space.size
        self._direction = np.random.default_rng(seed).normal(size=size)
        along = self.sample[:, :size] @ self._direction
        self._hidden = np.quantile(along, 0.85) if kind == "region" else np.inf
        self.slip = 5 * self._deviation()
        shift, turn = np.random.default_rng([seed, 9]).normal(size=(2, size))
        by = MOVED * robot.noise.position
        self._shift = by * shift / np.linalg.norm(shift)
        self._turn = by / RADIUS * turn / np.linalg.norm(turn)

    def _deviation(self) -> float:
        """Of a reading from what all else says of it that is measured at a pose (rms)."""
        robot, unknowns = self.robot, self.case.unknowns | TOLERATED
        poses = robot.sample_workspace(100, seed=1).poses
        survey = Survey.of(robot, poses, Observed.of(robot, self.case.observe), unknowns)
        assert survey is not None  # since there are priors
        shown = survey.rows(poses)[..., survey.unknowns.index("leg2.sensor_offset")]
        gain = robot.parameters[1, robot.parameter_names.index("sensor_gain")]
        return float(1 / (gain * np.sqrt(np.mean(np.square(shown).sum(axis=1)))))

    def at(self, pose: NDArray[np.float64], readings: NDArray[np.float64], row: int) -> Any:
        """What the device tells at a pose, if it is taken as the row of that number."""
        found = self.device.at(readings)
        if pose[: len(self._direction)] @ self._direction > self._hidden:
            return "occluded"
        if not isinstance(found, str) and self.kind == "slip" and row >= SLIPS_AT:
            column = next(name for name in found if name.startswith(("psi_2", "psi2")))
            found = found | {column: found[column] + self.slip}
        if not isinstance(found, str) and self.kind == "moved" and row >= SLIPS_AT:
            space = self.robot.space
            names = [f"{axis}_m" for axis in space.position]
            names += ["phi_rad"] if "phi_rad" in found else []
            seen = self._as_moved(np.array([[found[name] for name in names]]))[0]
            found = found | dict(zip(names, seen.tolist(), strict=True))
        return found

    def _as_moved(self, positions: NDArray[np.float64]) -> NDArray[np.float64]:
        """Positions, or planar poses, as the device sees them from where it is in the end."""
        angle = np.linalg.norm(self._turn)
        if not self.robot.space.in_space:
            rotation = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
            there = positions[:, :2] @ rotation.T + self._shift
            return np.column_stack([there, positions[:, 2:] + angle])
        axis = self._turn / angle
        across = np.cross(axis, positions)
        turned = positions + np.sin(angle) * across + (1 - np.cos(angle)) * np.cross(axis, across)
        return turned + self._shift

    def keeps(self, model: symkin.Mechanism) -> bool:
        """Whether the accuracy is kept over the workspace, by the robot as it is in the end."""
        actual = self.actual
        if self.kind == "slip":  # what its sensors show now
            parameters = np.array(actual.parameters)
            names = actual.parameter_names
            gain = parameters[1, names.index("sensor_gain")]
            parameters[1, names.index("sensor_offset")] -= gain * self.slip
            actual = actual.with_parameters(parameters, symmetry=None)
        readings = self.robot.inverse_kinematics(self.sample)
        taken = actual.forward_kinematics(readings, self.sample)[0]
        there = np.isfinite(taken).all(axis=1)
        if self.case.of == "height":
            there &= np.isfinite(model.forward_kinematics(readings, self.sample)[0]).all(axis=1)
            known = model.forward_kinematics(readings[there], self.sample[there])[0]
            c0, c1, c2 = model.frames.plane[:3]
            above = known[:, 2] - (c0 + c1 * known[:, 0] + c2 * known[:, 1])
            off = above / np.hypot(1.0, np.hypot(c1, c2)) - taken[there, 2]
            return bool(np.sqrt(np.mean(off**2)) <= self.case.accuracy)
        seen = taken[there]
        if self.case.observe == "position":  # which leaves open how the target is turned
            seen[:, self.robot.space.size :] = np.nan
        if self.kind == "moved":
            seen[:, : self.robot.space.size] = self._as_moved(seen[:, : self.robot.space.size])
        truth = Measurements.of(seen, readings[there], pose_space=actual.pose_space)
        error = symkin.evaluate(model, measurements=truth)
        return bool(error.position_rms <= self.case.accuracy)


def asks_of(session: Session) -> Iterator[Ask]:
    """What a session asks for, until it ends or no pose is left."""
    while True:
        try:
            ask = session.next()
        except symkin.SymkinError:
            return
        if ask is None:
            return
        yield ask


def session_of(trial: Trial, seed: int, candidates: int) -> dict[str, float]:
    """One session; what came of it."""
    case = trial.case
    session = trial.robot.measure(
        case.accuracy,
        of=case.of,
        candidates=candidates,
        seed=seed,
        observe=case.observe,
        **case.unknowns,
    )
    counts = {"tries": 0, "alarms": 0, "found": np.nan}
    waited, named = [], False
    for ask in asks_of(session):
        counts["tries"] += 1
        if counts["tries"] > MOST:
            break
        found = trial.at(ask.pose, ask.readings, session.progress.rows + 1)
        begin = time.perf_counter()
        if isinstance(found, str):
            session.fail(found)
            if session.suggests_avoiding:
                session.avoid()
        else:
            session.add(found)
            verdict = session.resolve()
            counts["alarms"] += not verdict.fine
            named = session.estimate is not None and any(
                name.startswith("step") and name.endswith((".rx", ".phi"))
                for name in session.estimate.names
            )
            # Of the last rows a slip is taken where a repeat says the same: there is no verdict.
            if session.robot.identification.step and np.isnan(counts["found"]):
                counts["found"] = session.progress.rows - SLIPS_AT + 1
        waited.append(time.perf_counter() - begin)
    reached = session.estimate is not None and session.progress.reached
    return counts | {
        "rows": session.progress.rows,
        "met": reached and trial.keeps(session.estimate.mechanism),
        "reached": reached,
        "alarmed": counts["alarms"] > 0,
        "named": named,
        "seconds": float(np.median(waited)),
    }


def answered(trial: Trial, seed: int, candidates: int, rows: int) -> NDArray[np.float64]:
    """How long each of so many rows takes, by the clock and of the processor, s."""
    case = trial.case
    session = trial.robot.measure(
        TINY * case.accuracy,
        of=case.of,
        candidates=candidates,
        seed=seed,
        observe=case.observe,
        **case.unknowns,
    )
    taken, ask = [], session.asked()
    while session.progress.rows < rows:
        found = trial.at(ask.pose, ask.readings, session.progress.rows + 1)
        begin = np.array([time.perf_counter(), time.process_time()])
        if isinstance(found, str):
            session.fail(found)
        else:
            session.add(found)
            session.resolve()
        ask = session.asked()
        taken.append(np.array([time.perf_counter(), time.process_time()]) - begin)
    return np.array(taken)


def times_of(taken: NDArray[np.float64]) -> str:
    """Of all rows, in a line."""
    figures = np.quantile(taken, [0.5, 0.95, 1.0], axis=0).T
    told = (" ".join(f"{each:5.2f}" for each in own) for own in figures)
    return "{:4d} rows   clock {} s   processor {} s".format(len(taken), *told)


def plan_of(robot: symkin.Robot, case: Case, needed: int | None) -> symkin.Plan:
    """So many poses, or as many as are enough, with as many spares."""
    sample = robot.sample_workspace(3000, seed=1)
    asked = {"observe": case.observe, "design": "mechanism"} | case.unknowns
    if needed is None and case.of is not None:
        needed = next(n for n in range(15, MOST, 3) if _known(robot, case, sample, asked, n))
    elif needed is None:
        curve = symkin.pose_count_curve(robot, sample, [24], estimator="joint", **asked)
        needed = curve.for_accuracy(case.accuracy).tried
    return symkin.make_plan(robot, sample, needed, spares=needed, **asked)


def _known(robot: symkin.Robot, case: Case, sample: Any, asked: dict[str, Any], n: int) -> bool:
    """Whether so many poses are enough, by what they tell of the robot as drawn."""
    plan = symkin.make_plan(robot, sample, n, **asked)
    device = SimulatedDevice(robot, 1, robot, observe=case.observe)
    rows = [device.at(readings) for readings in plan.readings]
    table = {name: [row[name] for row in rows] for name in rows[0]}
    found = symkin.identify(robot, table, "joint", **case.unknowns)
    poses = sample.poses * [1, 1, 0]  # of the bed, z = 0
    return bool(found.expected_accuracy(poses, of=case.of).position_bound <= case.accuracy)


def batch_of(trial: Trial, plan: symkin.Plan) -> dict[str, float]:
    """The same by a plan that was made beforehand."""
    rows: list[dict[str, float]] = []
    tries, wanted = 0, int(np.sum(~plan.spare))
    for pose, readings in zip(plan.poses, plan.readings, strict=True):
        if len(rows) == wanted:
            break
        tries += 1
        found = trial.at(pose, readings, len(rows) + 1)
        if not isinstance(found, str):
            rows.append(found)
    table = {name: [row[name] for row in rows] for name in rows[0]}
    measured = symkin.read_measurements(table, trial.robot)
    found = symkin.identify(trial.robot, measured, "joint", **trial.case.unknowns)
    return {"tries": tries, "rows": len(rows), "met": trial.keeps(found.mechanism)}


def main() -> None:
    """Print a line for each robot and each thing that goes wrong."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("robots", nargs="*", default=["3RRR"], choices=[*CASES])
    parser.add_argument("--sessions", type=int, default=40)
    parser.add_argument("--candidates", type=int, default=500)
    parser.add_argument("--poses", type=int, help="of the plan; as many as are enough")
    parser.add_argument("--kinds", nargs="*", default=KINDS, choices=KINDS)
    parser.add_argument("--known-frames", action="store_true")
    parser.add_argument("--rows", type=int, help="of a session, of which the time is told")
    given = parser.parse_args()
    for name in given.robots:
        case = CASES[name]
        robot = symkin.load(case.robot)
        if given.known_frames:
            unknowns = {key: each for key, each in case.unknowns.items() if key != "frames"}
            case = case._replace(unknowns=unknowns)
        if given.rows:
            print(f"{name}, {given.candidates} candidates: median, 95% of the rows, the slowest")
            for kind in given.kinds:
                timed = [
                    answered(Trial(kind, robot, case, seed), seed, given.candidates, given.rows)
                    for seed in range(1, given.sessions + 1)
                ]
                print(f"{kind:10s} {times_of(np.concatenate(timed))}", flush=True)
            continue
        plan = plan_of(robot, case, given.poses)
        print(f"{name}, {given.sessions} sessions each, accuracy {1e3 * case.accuracy:g} mm")
        print(
            "             rows  tries  reached    met  alarmed  found after  seconds a row | "
            "batch: rows  tries    met"
        )
        for kind in given.kinds:
            guided, batch = [], []
            for seed in range(1, given.sessions + 1):
                guided.append(session_of(Trial(kind, robot, case, seed), seed, given.candidates))
                batch.append(batch_of(Trial(kind, robot, case, seed), plan))
            print(line_of(kind, guided, batch), flush=True)


def line_of(kind: str, guided: list[dict[str, float]], batch: list[dict[str, float]]) -> str:
    """Means of the sessions, and of the plans beside them."""

    def means(found: list[dict[str, float]]) -> dict[str, float]:
        return {
            name: float(np.mean([each[name] for each in found])) for name in found[0]
            if name != "found"
        }  # fmt: skip

    own, other = means(guided), means(batch)
    delays = [each["found"] for each in guided if np.isfinite(each["found"])]
    after = f"{np.median(delays):.0f} ({len(delays)})" if delays else "-"
    after += f", named {own['named']:.0%}" if kind == "moved" else ""
    return (
        f"{kind:10s} {own['rows']:6.1f} {own['tries']:6.1f} {own['reached']:8.0%} "
        f"{own['met']:6.0%} "
        f"{own['alarmed']:8.0%} {after:>12s} {own['seconds']:14.2f} | {other['rows']:11.1f} "
        f"{other['tries']:6.1f} {other['met']:6.0%}"
    )


if __name__ == "__main__":
    main()
