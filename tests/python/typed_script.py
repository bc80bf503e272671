# SPDX-License-Identifier: MIT
"""A script that uses every verb of a robot: `mypy --strict` accepts it, and no misspelt option.

The lint run checks it with the package, and would complain of a comment that ignores nothing. So
does `pyright`, which lint does without, since it wants Node.
"""

# pyright: strict, reportUnnecessaryTypeIgnoreComment=true

from pathlib import Path

import symkin
from symkin.estimate import Estimate


def everything(folder: Path) -> Estimate[symkin.Robot]:
    """Plan, simulate, identify by legs and together, and use what comes back."""
    robot = symkin.load_mechanism("3RRR")
    print(robot.check(seed=1).text())
    candidates = robot.sample_workspace(200, seed=1)
    plan = robot.plan(10, seed=1, design="legs")
    simulated = robot.simulate(plan, 1)
    found = robot.identify(simulated.measurements, loss="none")
    together = robot.identify(simulated, shared=["sensor_gain"], gauge="nominal")
    for each in (found, together):
        radius = each.params["leg1.base_radius"]
        print(radius.value - radius.nominal, radius.deviation, radius.unit, radius.status)
        print(each.chi_square / each.degrees_of_freedom, each.limit, len(each.names))
        print(each.covariance.shape, each.trustworthy, [doubt.code for doubt in each.doubts])
    calibrated: symkin.Robot = together.mechanism
    error = calibrated.evaluate(actual=simulated.actual, poses=candidates)
    print(error.position_rms, found.cross_validated(3).cross_validation)
    calibrated.replace(name="calibrated").save(folder / "calibrated.toml")
    again = symkin.read_estimate(found.save(folder / "found.json"))
    print(symkin.read_result(error.save(folder / "error.json")).text())
    for asked in robot.measure(0.001, observe="position", seed=1):
        print(asked.pose, asked.readings)
        break
    print(robot.run(seed=1).identification.mechanism.check().text())
    return again


def misspelt(robot: symkin.Robot, measured: symkin.Measurements) -> None:
    """What nobody should run."""
    robot.plan(24, desing="legs")  # type: ignore[call-arg]
    robot.identify(measured, loss="hubber")  # type: ignore[arg-type]
    robot.measure(0.001, obsreve="position")  # type: ignore[call-arg]
    robot.run(estimater="joint")  # type: ignore[call-arg]
    robot.evaluate(actual=robot, pose=measured.poses)  # type: ignore[call-arg]
    robot.identify(measured).chisquare  # type: ignore[attr-defined]  # noqa: B018
    robot.identify(measured).params["leg1.base_radius"].sigma  # type: ignore[attr-defined]  # noqa: B018
