# SPDX-License-Identifier: MIT
"""What becomes of robots that are made outside their tolerances, where these are priors.

Usage: .venv/bin/python benchmarks/drawing_conflict.py [robots | linear]

Robots of the 3-RRR made at several times the tolerances of its file, of which 60 positions are
measured with both frames unknown. Stopped are those that the comparison with the drawing doubts,
trusted those that chi-square does not doubt either. Of all and of the trusted: how many 95%
intervals of the legs' parameters hold the truth, by the model's covariance and as they are printed.
With `linear` 400 000 robots of the linear model at one of these estimates, and at one of a linear
delta of which 40 heights are probed, in seconds; of those trusted also how many would hold if
intervals were widened by the root of q/k in place of q/k.
"""

import dataclasses
import sys

import numpy as np

import symkin
from symkin import _core
from symkin.estimate.conflict import LIMIT
from symkin.estimate.estimate import Estimate
from symkin.model.settings import Frames

_PRIORS = {"prior": "tolerances", "frames": ["base", "target"]}
_INTERVAL = 1.96
_SHOWN = 0.1  # eigenvalue of a direction that is compared with the drawing


def main() -> None:
    """Print a line for each multiple of the tolerances."""
    wanted = sys.argv[1] if len(sys.argv) > 1 else "200"
    nominal = symkin.load("3RRR").replace(
        frames=Frames(base=(0.3, -0.2, 0.4), target=(0.1, 0.05, 0))
    )
    sample = symkin.sample_workspace(nominal, 2000, seed=1)
    plan = symkin.make_plan(nominal, sample, 60, design="mechanism", spares=30, margin_sigmas=9)
    if wanted == "linear":
        print("3-RRR, 60 positions, both frames unknown")
        taken = symkin.simulate(nominal, plan, 1, observe="position")
        in_linear_model(symkin.identify(nominal, taken.measurements, **_PRIORS))
        print("linear delta, 40 heights")
        delta = symkin.load("linear_delta")
        sample = symkin.sample_workspace(delta, 2000, seed=1)
        plan = symkin.make_plan(delta, sample, 40, design="mechanism", observe="height")
        taken = symkin.simulate(delta, plan, 1, observe="height")
        in_linear_model(symkin.identify(delta, taken.measurements, prior="tolerances"))
        return
    robots = int(wanted)
    print("made at   stopped   trusted   hold, all: model, printed   of the trusted")
    for factor in (0.0, 0.5, 1.0, 1.5, 2.0, 3.0):
        limits = nominal.tolerances
        wide = {
            each: factor * getattr(limits, each) + 1e-15 for each in ("length", "angle", "gain")
        }
        made = nominal.replace(tolerances=dataclasses.replace(limits, **wide))
        stopped, trusted, plain, printed = [], [], [], []
        for seed in range(1, robots + 1):
            taken = symkin.simulate(made, plan, seed, observe="position")
            found = symkin.identify(nominal, taken.measurements, **_PRIORS)
            assert found.conflict is not None
            stopped.append(min(found.conflict.p_large, found.conflict.p_small) < LIMIT)
            trusted.append(not stopped[-1] and not found.unexplained)
            errors = (found.mechanism.parameters - taken.actual.parameters).ravel()
            own = [name.startswith("leg") for name in found.names]
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
    print("made at   trusted   hold, all: model, printed   of the trusted: by the root, printed")
    for factor in (1.0, 1.5, 2.0, 3.0):
        random, all_hold, trusted_hold = np.random.default_rng(1), [], []
        for _ in range(20):
            truth = factor * random.normal(size=(20_000, len(known)))
            estimate = truth @ shown + random.normal(size=truth.shape) @ root.T
            q = np.sum((estimate @ vectors[:, tested]) ** 2 / values[tested], axis=1)
            errors = np.abs(estimate - truth) / np.sqrt(np.diag(known))
            ratio = np.maximum(q / degrees, 1)[:, None]
            held = np.stack(
                [np.mean(errors < _INTERVAL * ratio**each, axis=1) for each in (0, 0.5, 1)], axis=1
            )
            passed = [_core.chi_square_tail(each, degrees) >= LIMIT for each in q.tolist()]
            all_hold.append(held)
            trusted_hold.append(held[np.array(passed)])
        every, good = 100 * np.concatenate(all_hold), 100 * np.concatenate(trusted_hold)
        means = (100 * len(good) / len(every), *every.mean(axis=0)[::2], *good.mean(axis=0)[1:])
        print(f"{factor:7.1f} " + " ".join(f"{each:10.1f}%" for each in means), flush=True)


if __name__ == "__main__":
    main()
