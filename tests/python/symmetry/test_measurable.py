# SPDX-License-Identifier: MIT
"""The symmetry of what can be measured: box, joint limits and noise."""

import numpy as np
import pytest

import symkin
from symkin.analysis.measurable import _noise_of_closures, measurable_symmetry
from symkin.model.framing import framed, unframed
from symkin.model.settings import Frames, JointLimits, NoiseSettings

PLACED = Frames(base=(2.0, 1.0, 0.5), target=(0.05, 0.02, 0.3))


@pytest.fixture(scope="module")
def poses(paper):
    return symkin.sample_workspace(paper, 300, seed=2).poses


def test_a_robot_whose_box_limits_and_noise_are_symmetric_keeps_all(paper, poses):
    found = measurable_symmetry(paper, poses)
    assert (found.robot, found.group, found.with_images) == ("C_3", "C_3", 1)
    assert found.efficiency == pytest.approx(1, abs=1e-6)
    assert all(each.kept for each in found.elements)
    assert found.carried.endswith("carried poses are as good.")


def test_a_leg_with_limits_of_its_own_leaves_the_poses_whose_images_it_reaches(paper):
    limited = paper.replace(joint_limits=JointLimits(lower=(0.3, -np.inf, -np.inf)))
    poses = symkin.sample_workspace(limited, 400, seed=2).poses
    found = measurable_symmetry(limited, poses)
    assert found.group == "C_1"
    assert found.elements[1].broken == ("joint limits",)
    readings = paper.inverse_kinematics(poses)
    # Under turns each leg's reading comes to leg 1.
    assert found.with_images == pytest.approx(np.mean((readings > 0.3).all(axis=1)))
    assert 0.1 < found.with_images < 0.9
    assert "1 keeps joint limits, too: what can be measured has C_1" in found.sentences[0]
    page = symkin.check_mechanism(limited).page()
    assert any(each.startswith("Joint limits tell legs apart") for each in page.notes)
    (symmetry,) = (each for each in page.sections if each.anchor == "symmetry")
    assert found.sentences[0] in symmetry.paragraphs


def test_noise_of_closures_is_that_of_readings_at_poses_as_measured(paper):
    noise = NoiseSettings(1e-5, 4e-5, 2e-5, along=1e-4, direction="beam")
    robot = paper.replace(frames=PLACED, noise=noise)
    pose = np.array([[0.05, -0.1, 0.2]])
    rng = np.random.default_rng(1)
    seen = np.repeat(framed(robot, pose), 40_000, axis=0)
    beam = seen[0, :2] / np.linalg.norm(seen[0, :2])
    across = np.array([-beam[1], beam[0]])
    errors = rng.standard_normal((len(seen), 3)) * [1e-4, 1e-5, 4e-5]
    seen[:, :2] += errors[:, :1] * beam + errors[:, 1:2] * across
    seen[:, 2] += errors[:, 2]
    readings = paper.inverse_kinematics(unframed(robot, seen))
    spread = np.hypot(readings.std(axis=0), noise.reading)
    np.testing.assert_allclose(_noise_of_closures(robot, pose)[0], spread, rtol=0.02)


@pytest.mark.parametrize(
    ("changes", "kept"),
    [
        ({"frames": Frames(base=PLACED.base)}, True),
        ({"frames": Frames(target=PLACED.target)}, False),  # a turn moves the target
        ({"noise": NoiseSettings(1e-4, 1e-4, along=2e-4, direction="beam")}, True),
        (
            {
                "noise": NoiseSettings(1e-4, 1e-4, along=2e-4, direction="beam"),
                "frames": Frames(base=PLACED.base),
            },
            False,
        ),
    ],
)
def test_noise_is_the_same_at_images_where_device_and_target_are_in_the_middle(
    paper, poses, changes, kept
):
    found = measurable_symmetry(paper.replace(**changes), poses)
    assert all(each.kept for each in found.elements) == kept
    assert (found.efficiency > 1 - 1e-6) == kept
