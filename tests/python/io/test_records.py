# SPDX-License-Identifier: MIT
"""Records as plain values and back."""

import json
import math

import numpy as np
import pytest

import symkin
from symkin.errors import ResultsError
from symkin.files.mechanism_file import shipped_mechanisms
from symkin.model.mechanism import Mechanism
from symkin.model.settings import JointLimits
from symkin.storage.records import decoded, encoded


def through_json(kind, value):
    return decoded(kind, json.loads(json.dumps(encoded(value), allow_nan=False)))


@pytest.mark.parametrize("name", shipped_mechanisms())
def test_every_shipped_mechanism_comes_back_to_the_last_bit(name):
    robot = symkin.load_mechanism(name)
    again = through_json(Mechanism, robot)
    assert again == robot
    assert again.source == robot.source
    assert again.arguments.keys() == robot.arguments.keys()


def test_numbers_that_json_does_not_have_come_back():
    assert through_json(JointLimits, JointLimits()) == JointLimits()
    limits = JointLimits((-math.inf, 0.1), (1 / 3, math.inf))
    assert through_json(JointLimits, limits) == limits
    values = np.array([[math.nan, math.inf, -math.inf], [0.1, 1 / 3, 1e-300]])
    hint = symkin.model.sensor_table.NDArray[np.float64]
    np.testing.assert_array_equal(through_json(hint, values), values)
    assert through_json(hint, np.zeros((0, 3))).shape == (0, 3)


def test_what_has_no_form_is_refused():
    with pytest.raises(ResultsError, match="a object cannot be saved"):
        encoded({"a": object()})
    with pytest.raises(ResultsError, match="is no JointLimits"):
        decoded(JointLimits, {"lower": [0.0], "higher": 1.0})
    with pytest.raises(ResultsError, match="is no Mechanism"):
        decoded(Mechanism, [1, 2])
