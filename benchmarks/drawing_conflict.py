# SPDX-License-Identifier: MIT
"""What becomes of robots that are made outside their tolerances, where these are priors.

Usage: .venv/bin/python benchmarks/drawing_conflict.py [robots]

Robots of the 3-RRR made at several times the tolerances of its file, of which 60 positions are
measured with both frames unknown. Stopped are those that the comparison with the drawing doubts,
trusted those that chi-square does not doubt either. Of all and of the trusted: how many 95%
intervals of the legs' parameters hold the truth, by the model's covariance and as they are printed.
"""

import dataclasses
import sys

import numpy as np

import symkin
from symkin.estimate.conflict import LIMIT
from symkin.model.settings import Frames

_PRIORS = {"prior": "tolerances", "frames": ["base", "target"], "fixed": ["target.phi"]}
_INTERVAL = 1.96


def main() -> None:
    """Print a line for each multiple of the tolerances."""
    robots = int(sys.argv[1]) if len(sys.argv) > 1 else 200
    nominal = symkin.load("3RRR").replace(
        frames=Frames(base=(0.3, -0.2, 0.4), target=(0.1, 0.05, 0))
    )
    sample = symkin.sample_workspace(nominal, 2000, seed=1)
    plan = symkin.make_plan(nominal, sample, 60, design="mechanism", spares=30, margin_sigmas=9)
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


if __name__ == "__main__":
    main()
