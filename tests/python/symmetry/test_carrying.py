# SPDX-License-Identifier: MIT
"""The image of a leg, whatever its errors, does at the image what the leg does at the pose."""

import dataclasses

import numpy as np
import pytest

import symkin
from symkin import _core
from symkin.analysis.observability import observability_rows
from symkin.model.symmetry import symmetry_pairs
from symkin.planning.simulation import disturb

NAMES = ["5bar", "3RPR", "3RRP", "2RRR_PRP", "3PRR", "3RPR_end_joint", "3PRP"]
SPATIAL = ["rotary_delta", "linear_delta", "hexa", "hexapod_jugglebot", "3PRS", "3RPS"]
NAMES += [*SPATIAL, "agile_eye"]


def images(made, element):
    legs = list(made.legs)
    for leg, onto in enumerate(element.permutation):
        values, mode = _core.carried_leg(made.core, leg, element.core, onto)
        named = zip(made.parameter_names, values.tolist(), strict=True)
        own = {name: value for name, value in named if name in made.legs[onto].parameters}
        legs[onto] = dataclasses.replace(made.legs[onto], parameters=own, working_mode=mode)
    return made.replace(legs=tuple(legs), symmetry=None)


@pytest.mark.parametrize("name", NAMES)
def test_carried_legs_read_at_the_image_what_the_legs_read_at_the_pose(name):
    nominal = symkin.load_mechanism(name)
    made = disturb(nominal, 3).replace(symmetry=None)
    poses = symkin.sample_workspace(nominal, 10, seed=2).poses
    readings = made.inverse_kinematics(poses)
    for element in symmetry_pairs(nominal).pairs[:24]:
        image = images(made, element)
        signs = np.array([each.sign for each in element.joints])
        onto = list(element.permutation)
        found = image.inverse_kinematics(element.map_poses(made, poses))[:, onto]
        apart = found - signs * readings
        if nominal.reading_unit == "rad":  # by turns of the joint
            gains = np.abs(image.sensor_gains)[onto]
            apart = np.remainder(apart * gains + np.pi, 2 * np.pi) - np.pi
        np.testing.assert_allclose(apart, 0, atol=1e-12, err_msg=element.words)


@pytest.mark.parametrize("name", ["5bar", "3RRP", "rotary_delta", "hexapod_jugglebot"])
def test_derivatives_of_carried_legs_turn_rows_into_those_of_the_reference(name):
    mechanism = symkin.load_mechanism(name)
    poses = symkin.sample_workspace(mechanism, 20, seed=2).poses
    for element in symmetry_pairs(mechanism).keep_modes:
        onto, own = element.permutation[0], mechanism.estimated[0]
        by = _core.carried_derivatives(mechanism.core, 0, element.core, onto)[np.ix_(own, own)]
        rows = observability_rows(mechanism, onto, element.map_poses(mechanism, poses))
        expected = element.joints[0].sign * observability_rows(mechanism, 0, poses)
        apart = min(np.abs(rows @ by - sign * expected).max() for sign in (1, -1))
        assert apart < 1e-8 * np.abs(expected).max()
