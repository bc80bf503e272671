# SPDX-License-Identifier: MIT
"""What becomes of robots that are made outside their tolerances, where these are priors.

Usage: .venv/bin/python benchmarks/drawing_conflict.py [robots | linear]

Robots made at several times the tolerances of their file: the 3-RRR, of which 60 positions are
measured with both frames unknown, and a linear delta of which 40 heights are probed. Stopped are
those that the comparison with the drawing doubts, trusted those that chi-square does not doubt
either. Of all and of the trusted: how many 95% intervals of the legs' parameters hold the truth, by
the model's covariance and as they are printed.
With `linear` 400 000 robots of the linear model at one of these estimates, in seconds; of those
trusted also how many would hold if the priors' variances grew by q/k itself, and how many times as
large as the model's the variances are that are printed.
"""

import dataclasses
import sys
from typing import Any, NamedTuple

import numpy as np

import symkin
from symkin import _core
from symkin.estimate.conflict import LIMIT
from symkin.estimate.estimate import Estimate
from symkin.model.settings import Frames
from symkin.planning.simulation import Simulation

_INTERVAL = 1.96
_SHOWN = 0.1  # eigenvalue of a direction that is compared with the drawing


class Case(NamedTuple):
    """A robot, its poses, and how it is measured and identified."""

    title: str
    robot: symkin.Mechanism
    plan: symkin.Plan
    observe: str
    asked: dict[str, Any]

    def measured(self, made: symkin.Mechanism, seed: int) -> Simulation:
        """A robot made within the tolerances of another mechanism, measured."""
        return symkin.simulate(made, self.plan, seed, observe=self.observe)

    def identified(self, taken: Simulation) -> Estimate:
        """The estimate, tolerances as priors."""
        return symkin.identify(self.robot, taken.measurements, prior="tolerances", **self.asked)


def cases() -> list[Case]:
    """A robot of which all positions are measured, and one of which a bed is probed."""
    frames = Frames(base=(0.3, -0.2, 0.4), target=(0.1, 0.05, 0))
    planar, delta = symkin.load("3RRR").replace(frames=frames), symkin.load("linear_delta")
    plans = []
    for robot, count, options in (
        (planar, 60, {"spares": 30, "margin_sigmas": 9}),
        (delta, 40, {"observe": "height"}),
    ):
        sample = symkin.sample_workspace(robot, 2000, seed=1)
        plans.append(symkin.make_plan(robot, sample, count, design="mechanism", **options))
    unknown = {"frames": ["base", "target"]}
    title = "3-RRR, 60 positions, both frames unknown"
    return [
        Case(title, planar, plans[0], "position", unknown),
        Case("linear delta, 40 heights", delta, plans[1], "height", {}),
    ]


def main() -> None:
    """Print a line for each multiple of the tolerances."""
    wanted = sys.argv[1] if len(sys.argv) > 1 else "200"
    for case in cases():
        print(case.title)
        if wanted == "linear":
            in_linear_model(case.identified(case.measured(case.robot, 1)))
        else:
            identified(case, int(wanted))


def identified(case: Case, robots: int) -> None:
    """What becomes of robots that are simulated and identified one by one."""
    print("made at   stopped   trusted   hold, all: model, printed   of the trusted")
    for factor in (0.0, 0.5, 1.0, 1.5, 2.0, 3.0):
        limits = case.robot.tolerances
        wide = {
            each.name: factor * getattr(limits, each.name) + 1e-15
            for each in dataclasses.fields(limits)
            if isinstance(getattr(limits, each.name), float)
        }
        made = case.robot.replace(tolerances=dataclasses.replace(limits, **wide))
        stopped, trusted, plain, printed = [], [], [], []
        for seed in range(1, robots + 1):
            taken = case.measured(made, seed)
            found = case.identified(taken)
            assert found.conflict is not None
            stopped.append(min(found.conflict.p_large, found.conflict.p_small) < LIMIT)
            trusted.append(not stopped[-1] and not found.unexplained)
            changed = found.mechanism.parameters - taken.actual.parameters
            names = case.robot.parameter_names
            by_name = {
                f"leg{leg}.{name}": error
                for leg, row in enumerate(changed, start=1)
                for name, error in zip(names, row, strict=True)
            }
            own = [name in by_name for name in found.names]
            errors = np.array([by_name[name] for name in found.names if name in by_name])
            for held, known in ((plain, found.model_covariance), (printed, found.covariance)):
                deviations = np.sqrt(np.diag(known))[own]
                held.append(np.mean(np.abs(errors) < _INTERVAL * deviations))
        shares = [100 * np.mean(each) for each in (stopped, trusted, plain, printed)]
        good = 100 * np.mean(np.array(printed)[trusted]) if any(trusted) else np.nan
        print(
            f"{factor:7.1f} {shares[0]:8.1f}% {shares[1]:8.1f}% {shares[2]:16.1f}% "
            f"{shares[3]:8.1f}% {good:15.1f}%",
            flush=True,
        )


def in_linear_model(found: Estimate) -> None:
    """The same of robots that are drawn in the linear model at an estimate."""
    own = np.array([name.startswith("leg") for name in found.names])
    units = np.array([each.tolerance for each in found.first_unknowns])[own]
    known = found.model_covariance[np.ix_(own, own)] / np.outer(units, units)
    shown = np.eye(len(known)) - known
    values, vectors = np.linalg.eigh(shown)
    of_noise, axes = np.linalg.eigh(known @ shown)
    root = axes * np.sqrt(np.maximum(of_noise, 0))
    tested = values > _SHOWN
    degrees = int(tested.sum())
    print("made at   trusted   hold, all: model, printed   trusted: by q/k, printed   variance")
    by_model, of_priors = np.diag(known), np.diag(known @ known)
    for factor in (1.0, 1.5, 2.0, 3.0):
        random, all_hold, trusted_hold, times = np.random.default_rng(1), [], [], []
        for _ in range(20):
            truth = factor * random.normal(size=(20_000, len(known)))
            estimate = truth @ shown + random.normal(size=truth.shape) @ root.T
            q = np.sum((estimate @ vectors[:, tested]) ** 2 / values[tested], axis=1)
            squares = np.square(estimate - truth)
            ratio = q[:, None] / degrees
            variances = [
                by_model + (np.maximum(1, each) - 1) * of_priors
                for each in (np.ones_like(ratio), ratio, 1.5 * (ratio**2 - 1))
            ]
            held = np.stack(
                [np.mean(squares < _INTERVAL**2 * each, axis=1) for each in variances], axis=1
            )
            passed = [_core.chi_square_tail(each, degrees) >= LIMIT for each in q.tolist()]
            times.append(np.mean(variances[2][np.array(passed)] / by_model))
            all_hold.append(held)
            trusted_hold.append(held[np.array(passed)])
        every, good = 100 * np.concatenate(all_hold), 100 * np.concatenate(trusted_hold)
        means = (100 * len(good) / len(every), *every.mean(axis=0)[::2], *good.mean(axis=0)[1:])
        shares = " ".join(f"{each:10.1f}%" for each in means)
        print(f"{factor:7.1f} {shares} {np.mean(times):10.2f}", flush=True)


if __name__ == "__main__":
    main()
