# SPDX-License-Identifier: MIT
"""Mechanisms, chains and settings as plain values: equal, hashed, pickled, copied, unchangeable."""

from __future__ import annotations

import copy
import dataclasses
import pickle
import re
from typing import Any

import numpy as np
import pytest

import symkin
from symkin.model.settings import (
    DeclaredSymmetry,
    JointLimits,
    MeasurementColumns,
    NoiseSettings,
    ProtocolSettings,
    Tolerances,
    WorkspaceSettings,
)
from symkin.values import FrozenMapping

# Each with another of its kind.
VALUES: dict[str, tuple[Any, Any]] = {
    "leg": (symkin.Leg("R[P]R", {"a": 1.0}), symkin.Leg("R[P]R", {"a": 2.0})),
    "mapping": (FrozenMapping({"a": 1.0, "b": 2.0}), FrozenMapping({"a": 1.0})),
    "chain": (symkin.chain_info("[R]RR"), symkin.chain_info("[R]RR", "point")),
    "symmetry": (DeclaredSymmetry("C3", 0.0, ["r0", "r1", "r2"]), DeclaredSymmetry("C3")),
    "workspace": (
        WorkspaceSettings([-1.0, -1.0], np.array([1.0, 1.0]), home=[0.0, 0.0]),
        WorkspaceSettings((-1.0, -1.0), (1.0, 1.0)),
    ),
    "noise": (NoiseSettings(1e-3), NoiseSettings()),
    "tolerances": (Tolerances(1e-4), Tolerances()),
    "protocol": (ProtocolSettings(9), ProtocolSettings()),
    "limits": (JointLimits(upper=1.0), JointLimits()),
    "columns": (
        MeasurementColumns(["x", "y"], ["a", "b"]),
        MeasurementColumns(["x", "y"], ["a", "b"], leg="leg"),
    ),
}
for _name in symkin.shipped_mechanisms():
    _mechanism = symkin.load(_name)
    VALUES[_name] = (_mechanism, _mechanism.replace(noise=NoiseSettings(7.0)))
_deviations = np.full((3, 8), 1e-3)
_deviations[0, 0] = np.nan
_paper = symkin.load("3RRR")
VALUES["calibrated"] = (_paper.replace(deviations=_deviations), _paper)


@pytest.mark.parametrize("name", VALUES)
def test_a_value_equals_its_copies_and_no_other(name: str) -> None:
    value, other = VALUES[name]
    copies = [
        copy.copy(value),
        copy.deepcopy(value),
        *(pickle.loads(pickle.dumps(value, n)) for n in range(2, pickle.HIGHEST_PROTOCOL + 1)),
    ]
    for each in copies:
        assert each == value
        assert hash(each) == hash(value)
        assert repr(each) == repr(value)
    assert value != other
    assert other != value
    assert value != 3
    assert len({value, other, *copies}) == 2


@pytest.mark.parametrize("name", VALUES)
def test_a_value_cannot_be_changed(name: str) -> None:
    value = VALUES[name][0]
    before = hash(value)
    if dataclasses.is_dataclass(value):
        for field in dataclasses.fields(value):
            with pytest.raises(dataclasses.FrozenInstanceError):
                setattr(value, field.name, None)
            with pytest.raises(dataclasses.FrozenInstanceError):
                delattr(value, field.name)
    else:
        with pytest.raises(TypeError):
            value["a"] = 3.0
        with pytest.raises(TypeError):
            value.update(a=3.0)
    assert hash(value) == before


def test_nothing_inside_a_mechanism_can_be_changed() -> None:
    mechanism = symkin.load("3RRR").replace(deviations=_deviations)
    readings = mechanism.inverse_kinematics(mechanism.home)
    with pytest.raises(TypeError):
        mechanism.legs[0].parameters["base_radius"] = 1.0
    with pytest.raises(TypeError):
        mechanism.legs[0] = mechanism.legs[1]
    for array in (mechanism.parameters, mechanism.deviations, mechanism.home):
        with pytest.raises(ValueError, match="read-only"):
            array[...] = 0
    np.testing.assert_array_equal(mechanism.inverse_kinematics(mechanism.home), readings)


def test_what_a_mechanism_was_made_of_may_be_changed_afterwards() -> None:
    paper = symkin.load("3RRR")
    parameters = [dict(leg.parameters) for leg in paper.legs]
    legs = [symkin.Leg("[R]RR", each) for each in parameters]
    deviations = _deviations.copy()
    mechanism = symkin.Mechanism("mine", legs, deviations=deviations)
    twin = copy.deepcopy(mechanism)
    parameters[0]["base_radius"] = 99.0
    deviations[1, 1] = 99.0
    legs.pop()
    assert mechanism == twin
    assert len(mechanism.legs) == 3


def test_a_mechanism_is_the_same_wherever_it_was_read_from(tmp_path: Any) -> None:
    mechanism = symkin.load("3RRR")
    mechanism.save(tmp_path / "copy.toml")
    assert symkin.load(tmp_path / "copy.toml") == mechanism


@pytest.mark.parametrize("name", ["3RRR", "5bar", "hexapod_jugglebot"])
def test_a_pickled_mechanism_computes_the_same(name: str) -> None:
    mechanism = symkin.load(name)
    twin = pickle.loads(pickle.dumps(mechanism))
    sample = mechanism.sample_workspace(20)
    np.testing.assert_array_equal(twin.inverse_kinematics(sample), sample.readings)


def test_a_mechanism_is_shown_in_a_line_and_in_a_notebook_as_a_drawing_and_a_table() -> None:
    paper = symkin.load("3RRR")
    assert repr(paper) == '<Robot "3RRR": 3 legs [R]RR, planar, C3>'
    calibrated = paper.replace(symmetry=None, deviations=_deviations, name="<b>")
    assert repr(calibrated) == ('<Robot "<b>": 3 legs [R]RR, planar, with standard deviations>')
    shown = calibrated._repr_html_()
    assert "<b>" not in shown
    assert shown.count("<svg") == 1
    assert shown.count("<tr>") == 2 + len(paper.parameter_names)
    assert re.search(r"base_<wbr>radius, mm</th>\s*<td>3464\.102</td>", shown)


def test_the_methods_are_the_functions() -> None:
    paper = symkin.load("3RRR").replace(protocol=ProtocolSettings(10, 300, 1))
    sample = paper.sample_workspace()
    np.testing.assert_array_equal(sample.poses, symkin.sample_workspace(paper).poses)
    plan = paper.plan(10)
    np.testing.assert_array_equal(plan.poses, symkin.make_plan(paper, sample, 10).poses)
    simulation = paper.simulate(plan, seed=2)
    readings = symkin.simulate(paper, plan, 2).measurements.readings
    np.testing.assert_array_equal(simulation.measurements.readings, readings)
    found = paper.identify(simulation.measurements, estimator="joint")
    expected = symkin.identify(paper, simulation.measurements, "joint").mechanism
    assert found.mechanism == expected
    evaluation = found.mechanism.evaluate(actual=simulation.actual, poses=sample.poses)
    assert evaluation.failed == 0
    assert paper.check().sample is not None
    assert paper.run().identification.converged
