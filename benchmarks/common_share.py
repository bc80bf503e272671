# SPDX-License-Identifier: MIT
"""What it gains, and costs, to fit the scale of the tolerances and the legs' common share.

    .venv/bin/python benchmarks/common_share.py [ROBOTS] [POSES] [legs | mechanism] [MECHANISM ...]

Robots are made with errors of which the legs have a share of the variance in common, by the signs
of the drawing's symmetry, measured at poses that were chosen for the first leg, or for all legs at
once, and identified with the tolerances as priors and with fitted ones. Of both the end-effector
error is the root mean square over robots and a sample of the workspace; the ratios, fitted over
tolerances, have their 95% interval from the scatter of the robots. "in 95%" is the share of the
parameters whose 95% interval holds the truth; the last columns are medians of what was fitted.

    .venv/bin/python benchmarks/common_share.py bound [POSES] [MECHANISM ...]

prints instead what a prior gains to first order that knows the share, and that it is 0.9: no other
can gain more on average. A robot a design is measured for it.
"""

import sys

import numpy as np

import symkin
from symkin.estimate.fitted_prior import _alike as alike_by_symmetry
from symkin.model.symmetry.roles import role_images
from symkin.model.tolerances import parameter_tolerances

# Common share of the variance, and times the stated tolerances.
MADE = ((0.9, 1.0), (0.5, 1.0), (0.0, 1.0), (0.9, 0.3), (0.0, 3.0))
PRIORS = ("tolerances", "fitted")
WITHIN = 1.959963984540054
DRAWS = 1000  # of the bootstrap
STEP = 1e-3  # tolerances


def made(mechanism: symkin.Mechanism, share: float, scale: float, seed: int) -> symkin.Mechanism:
    """Make a robot with errors of which legs have a share in common."""
    tolerances = np.asarray(parameter_tolerances(mechanism))
    rng = np.random.default_rng(seed)
    of_first, own = rng.standard_normal((2, *tolerances.shape))
    common = np.zeros_like(own)
    for leg, image in enumerate(role_images(mechanism)):
        brings = image.by * tolerances[image.reference] / tolerances[leg][:, None].clip(1e-300)
        drawn = np.where(tolerances[image.reference] > 0, of_first[image.reference], 0.0)
        size = np.linalg.norm(brings * (tolerances[image.reference] > 0), axis=1)
        common[leg] = (brings @ drawn) / np.where(size > 0, size, 1.0)
    errors = scale * (np.sqrt(share) * common + np.sqrt(1 - share) * own) * tolerances
    return mechanism.with_parameters(mechanism.parameters + errors, symmetry=None)


def row(
    mechanism: symkin.Mechanism, poses: int, design: str, share: float, scale: float, robots: int
) -> str:
    """Identify robots by both priors."""
    plan = symkin.plan(mechanism, poses, design=design)
    where = symkin.sample_workspace(mechanism, 300, seed=1).poses
    squares, inside, shares, failed = [], [], [], 0
    for seed in range(robots):
        actual = made(mechanism, share, scale, seed)
        try:
            taken = symkin.simulate(mechanism, plan, seed, actual=actual).measurements
            if design == "legs":
                taken = taken.subset(np.flatnonzero(taken.leg_sets == 0))
            found = [symkin.identify(mechanism, taken, prior=each) for each in PRIORS]
            errors = [symkin.evaluate(each.mechanism, actual=actual, poses=where) for each in found]
        except symkin.SymkinError:
            failed += 1
            continue
        squares.append([(each.position_rms**2, each.orientation_rms**2) for each in errors])
        off = [np.abs(each.mechanism.parameters - actual.parameters) for each in found]
        known = [each.deviations > 0 for each in found]
        inside.append([
            np.mean((each < WITHIN * one.deviations)[of])
            for each, one, of in zip(off, found, known, strict=True)
        ])  # fmt: skip
        fitted = found[1].fitted_prior
        shares.append([fitted.scale, *(each.share for each in fitted.common)])
    of_all = np.array(squares)
    mean = np.sqrt(of_all.mean(axis=0))
    rng = np.random.default_rng(1)
    again = np.array(
        [of_all[rng.integers(0, len(of_all), len(of_all))].mean(axis=0) for _ in range(DRAWS)]
    )
    low, high = np.quantile(np.sqrt(again[:, 1] / again[:, 0]), [0.025, 0.975], axis=0)
    ratios = "".join(
        f"{mean[1, i] / mean[0, i]:8.3f} ({low[i]:.3f} to {high[i]:.3f})" for i in range(2)
    )
    coverage = np.mean(inside, axis=0)
    typical = "".join(f"{each:6.2f}" for each in np.median(shares, axis=0))
    return (
        f"{mechanism.name:20}{share:6.1f}{scale:6.1f}{1e6 * mean[0, 0]:9.1f}{1e6 * mean[1, 0]:9.1f}"
        f"{ratios}{coverage[0]:8.1%}{coverage[1]:8.1%}{failed:4}  {typical}"
    )


def bound(mechanism: symkin.Mechanism, poses: int, design: str, share: float) -> list[float]:
    """Errors of position and orientation under the true prior, over those under tolerances."""
    plan = symkin.plan(mechanism, poses, design=design)
    taken = symkin.simulate(mechanism, plan, 0).measurements
    if design == "legs":
        taken = taken.subset(np.flatnonzero(taken.leg_sets == 0))
    found = symkin.identify(mechanism, taken, prior="tolerances")
    own = np.eye(len(found.names))
    legs = [int(name[3:].partition(".")[0]) - 1 for name in found.names]
    places = [mechanism.parameter_names.index(name.partition(".")[2]) for name in found.names]
    tolerances = np.asarray(parameter_tolerances(mechanism))[legs, places]
    covariance = found.model_covariance / np.outer(tolerances, tolerances)
    shown, directions = np.linalg.eigh(np.linalg.inv(covariance) - own)
    information = directions * shown.clip(0) @ directions.T
    kinds, alike = alike_by_symmetry(mechanism, [*found.names])
    alike = alike * (kinds[:, None] == kinds)
    drawn = share * alike + (1 - share) * own
    known = np.linalg.inv(information + np.linalg.inv(drawn))
    filtered = np.linalg.inv(information + own)
    taken_as_own = filtered @ (information + drawn) @ filtered
    where = symkin.sample_workspace(mechanism, 100, seed=1).poses
    readings = mechanism.inverse_kinematics(where)
    columns = []
    for leg, place, tolerance in zip(legs, places, tolerances, strict=True):
        moved = []
        for way in (1, -1):
            parameters = mechanism.parameters.copy()
            parameters[leg, place] += way * STEP * tolerance
            other = mechanism.with_parameters(parameters, symmetry=None)
            moved.append(other.forward_kinematics(readings)[0])
        columns.append((moved[0] - moved[1]) / (2 * STEP))
    moves, size = np.stack(columns, axis=-1), mechanism.space.size
    parts = [part for part in (moves[:, :size], moves[:, size:]) if part.shape[1]]
    return [
        float(np.sqrt(np.divide(*(np.einsum("pci,ij,pcj->", part, each, part) for each in both))))
        for part in parts
        for both in [(known, taken_as_own)]
    ]


def bounds(poses: int, names: list[str]) -> None:
    """Print a row for each mechanism and design."""
    print(f"a known share of 0.9 over tolerances, {poses} poses, to first order")
    print(f"{'mechanism':20}{'design':>11}{'position':>10}{'orientation':>13}")
    for name in names:
        mechanism = symkin.load_mechanism(name)
        for design in ("legs", "mechanism"):
            ratios = bound(mechanism, poses, design, 0.9)
            told = "".join(
                f"{each:{width}.3f}" for each, width in zip(ratios, (10, 13), strict=False)
            )
            print(f"{name:20}{design:>11}{told}", flush=True)


def main(robots: int, poses: int, design: str, names: list[str]) -> None:
    """Print a row for each share and scale of each mechanism."""
    print(f"{robots} robots a row, {poses} poses, design {design}; errors in um")
    print(
        f"{'mechanism':20}{'share':>6}{'scale':>6}{'tol.':>9}{'fitted':>9}"
        f"{'ratio, position':>25}{'ratio, orientation':>25}{'in 95%':>11}{'':6}fail  scale, shares"
    )
    for name in names:
        mechanism = symkin.load_mechanism(name)
        for share, scale in MADE:
            print(row(mechanism, poses, design, share, scale, robots), flush=True)


if __name__ == "__main__":
    given = sys.argv[1:]
    counts = [int(each) for each in given if each.isdigit()]
    designs = [each for each in given if each in ("legs", "mechanism", "bound")]
    named = [each for each in given if not each.isdigit() and each not in designs]
    names = named or ["3RRR", "hexapod_jugglebot"]
    if designs == ["bound"]:
        bounds((counts or [8])[0], names)
    else:
        main(*(counts + [100, 8][len(counts) :]), (designs or ["legs"])[0], names)
