# SPDX-License-Identifier: MIT
"""Shared parameters go with their roles: mirror images change by the opposite."""

import dataclasses

import numpy as np
import pytest

import symkin
from symkin.errors import SymkinError
from symkin.estimate.parameters import shared_by_role
from symkin.estimate.sharing import ties_by_role
from symkin.estimate.unknowns import Layout
from symkin.model.core_setup import core_setup
from symkin.planning.simulation import disturb


def laid_out(mechanism, **options):
    return Layout.of(mechanism, core_setup(mechanism), **options)


def factors(layout, name):
    """Of a parameter, leg by leg, by how much it moves with the column of that name."""
    column = layout.names.index(name)
    rows = [i for i, each in enumerate(layout.scalars) if each.partition(".")[2] == name]
    return layout.by_columns[rows, column].tolist()


@pytest.fixture(scope="module")
def five_bar():
    return symkin.load_mechanism("5bar")


@pytest.fixture(scope="module")
def mirrored(five_bar):
    """A five-bar with errors that keep its mirror, measured."""
    errors = {
        "proximal_length": 4e-4,
        "distal_length": -3e-4,
        "base_radius": 2e-4,
        "base_angle": 1e-3,
        "sensor_offset": -2e-3,
        "sensor_gain": 1e-3,
    }
    against = ("base_angle", "sensor_offset")
    legs = tuple(
        dataclasses.replace(
            leg,
            parameters={
                name: value + errors[name] * (-1 if number and name in against else 1)
                for name, value in leg.parameters.items()
            },
        )
        for number, leg in enumerate(five_bar.legs)
    )
    actual = five_bar.replace(legs=legs, symmetry=None)
    poses = symkin.sample_workspace(five_bar, 30, seed=2).poses
    readings = actual.inverse_kinematics(poses)
    measured = symkin.Measurements.of(poses, readings, reading_unit="rad", pose_space="point")
    return actual, measured


def test_mirror_images_share_by_the_opposite_amount_and_turned_ones_by_the_same(five_bar):
    made = laid_out(five_bar, shared=["base_*", "sensor_*"])
    assert factors(made, "base_angle") == [1, -1]
    assert factors(made, "sensor_offset") == [1, -1]
    assert factors(made, "base_radius") == factors(made, "sensor_gain") == [1, 1]
    hexapod = symkin.load_mechanism("hexapod_jugglebot")
    made = laid_out(hexapod, shared=["*_azimuth"])
    assert factors(made, "base_azimuth") == factors(made, "platform_azimuth") == [1, -1] * 3
    star = symkin.load_mechanism("3RPR")
    assert factors(laid_out(star, shared=["base_angle"]), "base_angle") == [1, 1, 1]


def test_a_robot_that_was_made_shares_as_its_drawing_does(five_bar):
    made = laid_out(disturb(five_bar, 4).replace(symmetry=None), shared=["base_angle"])
    assert factors(made, "base_angle") == [1, -1]


def test_gains_of_sensors_that_count_the_other_way_share_by_the_opposite(five_bar):
    parameters = five_bar.parameters.copy()
    parameters[1, five_bar.parameter_names.index("sensor_gain")] *= -1
    turned = five_bar.with_parameters(parameters, symmetry=None)
    assert factors(laid_out(turned, shared=["sensor_gain"]), "sensor_gain") == [1, -1]


def test_what_is_shared_by_role_is_identified_and_told(five_bar, mirrored):
    actual, measured = mirrored
    names = list(five_bar.parameter_names)
    found = symkin.identify(five_bar, measured, shared=names)
    np.testing.assert_allclose(found.mechanism.parameters, actual.parameters, atol=1e-8)
    assert len(found.names) == len(names)
    assert found.params["leg2.base_angle"].status == "shared"
    assert found.params["leg2.base_angle"].deviation == pytest.approx(
        found.params["leg1.base_angle"].deviation
    )
    words = shared_by_role(found.unknowns)
    assert words == (
        "leg2.base_angle = -leg1.base_angle",
        "leg2.sensor_offset = -leg1.sensor_offset",
    )
    assert ", ".join(words) in " ".join(found.text(whole=True).split())


def test_a_prior_of_a_parameter_that_is_shared_by_role_is_one_draw(five_bar):
    made = laid_out(five_bar, shared=["base_angle"], prior={"base_angle": 1e-3})
    assert made.prior[made.names.index("base_angle")] == pytest.approx(1e-3)


def test_ties_by_role_are_written_as_equations_and_do_what_sharing_does(five_bar, mirrored):
    actual, measured = mirrored
    assert ties_by_role(five_bar, "base_radius") == ("leg1.base_radius = leg2.base_radius",)
    (text,) = ties_by_role(five_bar, "base_angle")
    assert text == "-leg1.base_angle + 3.14159265358979 rad = leg2.base_angle"
    tied = symkin.identify(five_bar, measured, tie=["base_angle by role", "sensor_offset by role"])
    written = symkin.identify(
        five_bar, measured, tie=[text, *ties_by_role(five_bar, "sensor_offset")]
    )
    np.testing.assert_allclose(tied.mechanism.parameters, actual.parameters, atol=1e-8)
    np.testing.assert_allclose(
        tied.mechanism.parameters, written.mechanism.parameters, rtol=0, atol=1e-12
    )
    assert text in " ".join(tied.text(whole=True).split())
    prior = laid_out(five_bar, tie=["base_angle by role"], prior="tolerances")
    tolerance = five_bar.tolerances.angle
    assert prior.prior[prior.names.index("leg1.base_angle")] == pytest.approx(tolerance)


@pytest.mark.parametrize(
    ("name", "tie", "why"),
    [
        ("3RRR_asymmetric", "base_angle by role", "no symmetry carries a leg"),
        ("5bar", "base_angel by role", 'did you mean "base_angle"'),
    ],
)
def test_ties_by_role_that_tie_nothing_are_refused(name, tie, why):
    with pytest.raises(SymkinError, match=why):
        laid_out(symkin.load_mechanism(name), tie=[tie])


def test_an_estimate_that_is_nearly_symmetric_shares_as_the_drawing_does():
    """Legs some micrometres off a mirror: what they share goes with nothing else by a rounding."""
    delta = symkin.load_mechanism("linear_delta").replace(symmetry=None)
    parameters = delta.parameters.copy()
    parameters[:2, delta.parameter_names.index("base_azimuth")] += [8.3e-5, 7.0e-5]
    estimated = delta.with_parameters(parameters)
    free = ["sensor_offset", "base_radius", "leg1.base_azimuth", "leg2.base_azimuth"]
    drawn, found = (
        laid_out(each, free=free, shared=["base_radius"]) for each in (delta, estimated)
    )
    assert found.names == drawn.names
    assert factors(found, "base_radius") == pytest.approx([1, 1, 1])
