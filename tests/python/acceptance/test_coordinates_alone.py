# SPDX-License-Identifier: MIT
"""What an accuracy is asked of means the same to estimates, plans and certificates."""

import dataclasses

import numpy as np
import pytest

import symkin
from symkin.errors import SymkinError
from symkin.model.settings import Frames, IdentificationSettings, NoiseSettings
from symkin.planning.simulation import disturb
from symkin.show.wording import promise


@pytest.fixture(scope="module")
def delta():
    return symkin.load("linear_delta")


@pytest.fixture(scope="module")
def probed(delta):
    """Heights that a probe showed of a robot, twice."""
    actual = disturb(delta, 3)
    plans = (delta.plan(20, observe="height", candidates=500, seed=seed) for seed in (1, 7))
    return [
        delta.simulate(plan, seed, actual, observe="height").measurements
        for seed, plan in enumerate(plans, 3)
    ]


def test_an_estimate_expects_errors_of_the_coordinates_that_it_is_asked_of(delta):
    rows = delta.simulate(delta.plan(20, candidates=400, seed=1), 3, disturb(delta, 3))
    whole, low = (symkin.identify(delta, rows, prior="tolerances", of=of) for of in (None, "z"))
    said = delta.replace(identification=IdentificationSettings(of="z", prior="tolerances"))
    for found in (low, symkin.identify(said, rows)):
        poses = delta.sample_workspace(2000, seed=1).poses
        alone = whole.expected_accuracy(poses, of="z").position_bound
        assert found.expected.position_bound == pytest.approx(alone, rel=0.02)
        assert found.expected.of == "z"
    assert low.expected.position_bound < 0.8 * whole.expected.position_bound
    assert low.expected.position_anywhere < whole.expected.position_anywhere
    assert low.expected.worst < whole.expected.worst
    page = low.text(whole=True)
    assert "Z, mm" in page
    assert "z, root mean square" in page
    assert "over the workspace, z alone" in promise(delta.space, low.expected)
    assert low.options.on_command_line() == " --estimator joint --prior tolerances --of z"
    robot = symkin.load("3RRR")
    with pytest.raises(SymkinError, match='has no "z"; expected x, y'):
        symkin.identify(robot, robot.simulate(robot.plan(12, candidates=400, seed=1), 1), of="z")


def test_a_plan_promises_what_the_file_asks_for(delta):
    said = delta.replace(identification=IdentificationSettings(of="z", prior="tolerances"))
    other = delta.replace(identification=IdentificationSettings(prior="tolerances"))
    low, whole = (robot.plan(20, candidates=400, seed=1) for robot in (said, other))
    assert (low.expected.of, whole.expected.of) == ("z", None)
    assert low.expected.position_bound < 0.8 * whole.expected.position_bound


def test_a_mechanism_file_has_it(delta, tmp_path):
    said = delta.replace(identification=IdentificationSettings(of="height"))
    said.save(tmp_path / "delta.toml")
    assert 'of = "height"' in (tmp_path / "delta.toml").read_text()
    assert symkin.load(tmp_path / "delta.toml").identification.of == "height"


def test_a_certificate_of_heights_that_a_probe_showed(delta, probed, tmp_path):
    first, later = probed
    found = symkin.identify(delta, first, of="height")
    told = symkin.accept(found, later, 1.5e-4)  # of the height, as the calibration
    assert (told.verdict, told.of, told.held_out) == ("pass", "height", True)
    (height,) = told.judged
    assert height.limits.degrees == len(later.poses)
    assert height.before > 2 * height.limits.observed
    assert "error of the height above the bed (rms) is within 0.150" in told.text()
    told.write(tmp_path / "out")
    again = symkin.read_result(tmp_path / "out" / "acceptance.json")
    assert (again.of, again.verdict) == ("height", "pass")
    worn = dataclasses.replace(later, heights=later.heights + 4e-4)
    assert symkin.accept(found, worn, 1.5e-4).verdict == "fail"
    with pytest.raises(SymkinError, match="measured position or orientation"):
        symkin.accept(symkin.identify(delta, first), later, 1.5e-4)
    assert symkin.accept(symkin.identify(delta, first), later, 1.5e-4, of="height").of == "height"


@pytest.mark.parametrize("of", ["x", "z", "xy", "height"])
def test_errors_of_other_coordinates_count_as_none(delta, of):
    plane, base = (0.002, 0.03, -0.02), (0.1, -0.2, 0.05, 0.4, -0.3, 0.9)
    noise = NoiseSettings(1e-5, 1e-5, 2e-5)
    robot = delta.replace(noise=noise, frames=Frames(base=base, plane=plane))
    poses = symkin.sample_workspace(delta, 400, 5).poses
    random = np.random.default_rng(1)
    readings = robot.inverse_kinematics(poses)
    turn = symkin.model.poses.rotations_from_vectors(np.array([base[3:]]))[0]
    seen = poses @ turn.T + base[:3] + noise.position * random.normal(size=poses.shape)
    read = readings + noise.reading * random.normal(size=readings.shape)
    up = turn @ np.array([-0.03, 0.02, 1.0]) / np.linalg.norm([-0.03, 0.02, 1.0])
    axes = {"x": np.eye(3)[:1], "z": np.eye(3)[2:], "xy": np.eye(3)[:2], "height": up[None]}[of]
    across = np.linalg.svd(axes)[2][-1]  # an error that does not count

    def judged(off):
        table = symkin.Measurements.of(seen + off, read, reading_unit="m", pose_space="translating")
        return symkin.accept(robot, table, 1e-4, of=of).judged[0]

    sound = judged(0.002 * across)
    assert sound.verdict == "pass"
    assert sound.limits.degrees == 400 * len(axes)
    mean = sound.limits.uncertainty * np.sqrt(len(axes))
    assert sound.limits.observed == pytest.approx(mean, rel=0.1)
    assert judged(2e-4 * axes[0]).verdict == "fail"


def test_what_an_orientation_is_of_is_not_asked():
    robot = symkin.load("3RRR")
    rows = robot.simulate(robot.plan(12, candidates=400, seed=1), 1)
    with pytest.raises(SymkinError, match=r'no tolerance of the position is given; .* of "x"'):
        symkin.accept(robot, rows, orientation_tolerance=1e-3, of="x")
