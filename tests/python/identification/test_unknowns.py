# SPDX-License-Identifier: MIT
"""What is unknown is said by patterns, and becomes columns."""

import numpy as np
import pytest

import symkin
from symkin.errors import SymkinError
from symkin.estimate.unknowns import Layout
from symkin.model.core_setup import core_setup
from symkin.model.settings import Frames


@pytest.fixture
def five_bar():
    return symkin.load_mechanism("5bar")


def layout(mechanism, **options):
    return Layout.of(mechanism, core_setup(mechanism), **options)


def test_by_default_every_parameter_of_every_leg_is_free(paper):
    made = layout(paper)
    assert made.names == tuple(
        f"leg{leg}.{name}" for leg in (1, 2, 3) for name in paper.parameter_names
    )
    assert np.isinf(made.prior).all()


def test_a_pattern_without_a_dot_is_of_any_leg_or_of_a_whole_block(paper):
    made = layout(paper, free=["sensor_offset", "leg2", "base"])
    assert set(made.names) == {
        "leg1.sensor_offset",
        "leg3.sensor_offset",
        *(f"leg2.{name}" for name in paper.parameter_names),
        "base.x",
        "base.y",
        "base.phi",
    }


def test_curvature_is_free_with_the_sensor_or_by_its_full_name(paper):
    assert "leg2.sensor_sine" not in layout(paper, free=["leg2.*"]).names
    assert "leg2.sensor_sine" in layout(paper, free=["leg2.*"], sensor="eccentric").names
    assert layout(paper, free=["leg1.sensor_quadratic"]).names == ("leg1.sensor_quadratic",)


def test_what_is_fixed_is_held_whatever_else_says_so(paper):
    made = layout(paper, free=["leg1.*_length"], fixed=["*.distal_length"])
    assert made.names == ("leg1.proximal_length",)


def test_shared_parameters_of_one_name_have_one_column(paper):
    made = layout(paper, shared=["*_length", "leg[12].sensor_gain"])
    assert "proximal_length" in made.names
    assert "distal_length" in made.names
    assert "leg1+leg2.sensor_gain" in made.names
    assert "leg3.sensor_gain" in made.names
    column = made.names.index("proximal_length")
    assert [made.scalars[i] for i in made.members(column)] == [
        f"leg{leg}.proximal_length" for leg in (1, 2, 3)
    ]


def test_what_is_shared_is_free_too(paper):
    made = layout(paper, free=["leg1.base_radius"], shared=["sensor_gain"])
    assert set(made.names) == {"leg1.base_radius", "sensor_gain"}


def test_sensors_and_frames_add_their_scalars(hexapod):
    made = layout(hexapod, sensor="quadratic", frames=["target", "plane"])
    assert {"leg6.sensor_quadratic", "target.rz", "plane.c2"} <= set(made.names)
    assert "leg6.sensor_sine" not in made.names
    assert "base.x" not in made.names


def test_points_are_free_with_their_tolerance_and_anchors_without_one(paper):
    placed = paper.replace(frames=Frames(points=((0.1, 0.2),), anchors=((2.0, 1.0),)))
    made = layout(placed, frames=["points", "anchors"])
    tolerances = dict(zip(made.names, made.column_tolerances, strict=True))
    assert tolerances["point1.y"] == paper.tolerances.length
    assert tolerances["anchor1.x"] == 0


def test_tolerances_are_priors_of_what_has_one(paper):
    made = layout(paper, prior="tolerances", frames=["base"])
    priors = dict(zip(made.names, made.prior, strict=True))
    assert priors["leg1.base_radius"] == paper.tolerances.length
    assert np.isinf(priors["base.x"])


def test_a_prior_of_its_own_may_have_a_unit(paper):
    made = layout(paper, prior={"leg1.*_length": "0.2 mm", "sensor_offset": 1e-4})
    priors = dict(zip(made.names, made.prior, strict=True))
    assert priors["leg1.distal_length"] == pytest.approx(2e-4)
    assert priors["leg3.sensor_offset"] == 1e-4
    assert np.isinf(priors["leg2.distal_length"])


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"free": ["sensor_ofset"]}, 'free "sensor_ofset" matches no unknown.*"sensor_offset"'),
        ({"fixed": ["leg4.*"]}, 'fixed "leg4.*" matches no unknown'),
        ({"shared": ["basis_radius"]}, 'did you mean "base_radius"'),
        ({"prior": {"leg1.base_radus": 1e-3}}, 'did you mean "leg1.base_radius"'),
        ({"prior": "tolerance"}, "prior is 'tolerance'; expected \"tolerances\""),
        ({"prior": {"base.x": 1e-3}}, "base.x, which is not free"),
        ({"prior": {"sensor_gain": 0.0}}, "expected a positive standard deviation"),
        ({"prior": {"base_radius": "1 deg"}}, 'the prior of "base_radius"'),
        ({"frames": ["bases"]}, "frames is 'bases'; expected \"base\""),
        ({"frames": ["points"]}, "this mechanism has none"),
        ({"frames": ["plane"]}, "a planar mechanism has none"),
        ({"sensor": "cubic"}, "sensor is 'cubic'; expected \"linear\""),
        ({"fixed": ["leg*"]}, "nothing is free"),
        ({"shared": ["sensor_gain", "leg[12].sensor_*"]}, "leg1.sensor_gain is shared twice"),
        (
            {"shared": ["leg1.proximal_length", "leg3.base_radius"]},
            "--tie 'leg1.proximal_length = leg3.base_radius'",
        ),
        ({"shared": ["leg1.*"]}, "ties nothing: it matches leg1.proximal_length, "),
        (
            {"shared": "leg2.sensor_gain"},
            "leg2.sensor_gain; .* \"sensor_gain\", .* --tie 'leg1.sensor_gain = leg2.sensor_gain'",
        ),
    ],
)
def test_what_means_nothing_is_refused_with_what_would(paper, options, message):
    with pytest.raises(SymkinError, match=message):
        layout(paper, **options)


def test_lengths_have_no_period(five_bar):
    lengths = five_bar.replace(reading_unit="m")
    with pytest.raises(SymkinError, match="the sensors of this mechanism read lengths"):
        layout(lengths, sensor="eccentric")


def test_a_pattern_that_matches_nothing_is_no_mistake_of_the_measurements(paper):
    plan = symkin.make_plan(paper, symkin.sample_workspace(paper, 3000, seed=1), seed=1)
    measurements = symkin.simulate(paper, plan, 1).measurements
    with pytest.raises(SymkinError, match=r'"leg9.\*" matches no unknown') as refused:
        symkin.identify(paper, measurements, free=["leg9.*"])
    assert "Likely cause" not in str(refused.value)


@pytest.mark.parametrize("name", ["rotary_delta", "linear_delta"])
def test_both_frames_of_a_platform_that_never_turns_are_refused_with_what_to_ask_for(name):
    robot = symkin.load_mechanism(name)
    taken = robot.simulate(robot.plan(40, seed=1, candidates=400), seed=1).measurements
    every, asked = taken.for_all_legs(), {"frames": ["base", "target"], "prior": "tolerances"}
    for refused in (
        lambda: symkin.identify(robot, every, frames=["base", "target"]),
        lambda: robot.plan(20, seed=1, candidates=200, observe="position", **asked),
    ):
        with pytest.raises(SymkinError, match=r'such as frames "base" alone'):
            refused()
    assert symkin.identify(robot, every, frames=["base"]).trustworthy
