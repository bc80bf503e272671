# SPDX-License-Identifier: MIT
"""Whether intervals keep their promise where the noise grows with the distance from the device.

python benchmarks/noise_with_distance.py [robots]

The positions of a 3-RRR are measured by a device at the rim of its workspace, to 5 um and 0.4 mm a
metre. Each robot is identified with that noise, and with one that is the same everywhere.
"""

import sys

import numpy as np

import symkin
from symkin.analysis.observed import Observed
from symkin.model.settings import Frames, NoiseSettings

POSES, STUDENT = 40, 1.96
BASE = (0.55, 0.0, 0.0)  # of the robot in the device's frame, m and rad


def main() -> None:
    robots = int(sys.argv[1]) if len(sys.argv) > 1 else 200
    growing = NoiseSettings(position=5e-6, reading=1e-5, per_metre=4e-4)
    robot = symkin.load_mechanism("3RRR").replace(noise=growing)
    seen = Observed("position", base=BASE)
    known = {"prior": "tolerances"}
    candidates = symkin.sample_workspace(robot, 2000)
    plan = symkin.make_plan(robot, candidates, POSES, observe=seen, **known)
    away = np.linalg.norm(plan.poses[:, :2] + BASE[:2], axis=1)
    alike = NoiseSettings(float(np.sqrt(np.mean(growing.at(away) ** 2))), reading=1e-5)
    print(f"distances {away.min():.2f} to {away.max():.2f} m, {robots} robots, {POSES} poses")
    print("noise            coverage of 95 %   chi-square / degrees   error, mm   promised, mm")
    for name, noise in (("with distance", growing), ("alike", alike)):
        inside, chi, errors, promised = [], [], [], []
        for seed in range(robots):
            taken = symkin.simulate(robot, plan, seed, observe=seen)
            placed = robot.replace(noise=noise, frames=Frames(BASE))
            found = symkin.identify(placed, taken.measurements, **known)
            true = dict(zip(robot_names(robot), taken.actual.parameters.ravel(), strict=True))
            own = [each for each in found.unknowns if each.name in true and each.deviation > 0]
            off = [(each.value - true[each.name]) / each.deviation for each in own]
            inside += [abs(each) < STUDENT for each in off]
            chi.append(found.chi_square_ratio)
            reached = symkin.evaluate(found.mechanism, actual=taken.actual, poses=candidates)
            errors.append(reached.position_rms**2)
            promised.append(found.expected.position**2)
        rms = (1e3 * np.sqrt(np.mean(each)) for each in (errors, promised))
        print(f"{name:16} {100 * np.mean(inside):14.1f} % {np.mean(chi):18.3f}", end="")
        print("".join(f"{each:16.4f}" for each in rms))


def robot_names(robot: symkin.Mechanism) -> list[str]:
    legs = range(1, len(robot.legs) + 1)
    return [f"leg{leg}.{name}" for leg in legs for name in robot.parameter_names]


if __name__ == "__main__":
    main()
