# SPDX-License-Identifier: MIT
"""Joints at the origin of their frame: an angle is undefined, which is not a lack of poses."""

import pytest

import symkin
from symkin.analysis.checks import check_mechanism, undefined_angles
from symkin.errors import NotIdentifiableError
from symkin.model.settings import WorkspaceSettings
from symkin.storage.shipped import shipped_folder

KNOWN_CHAINS = sorted(path.stem for path in shipped_folder().glob("*.toml"))


def with_values(mechanism, leg, **values):
    legs = list(mechanism.legs)
    legs[leg] = symkin.Leg(
        legs[leg].chain, {**legs[leg].parameters, **values}, legs[leg].working_mode
    )
    return mechanism.replace(legs=tuple(legs), symmetry=None)


def test_a_base_point_at_the_origin_is_told_from_a_parameter_that_no_pose_shows(paper):
    textbook = paper.replace(
        legs=tuple(
            symkin.Leg(
                leg.chain,
                {**leg.parameters, "base_radius": radius, "base_angle": angle},
                leg.working_mode,
            )
            for leg, radius, angle in zip(
                paper.legs, (0, 6, 6), (0, 0, 1.0471975511965976), strict=True
            )
        ),
        symmetry=None,
        workspace=WorkspaceSettings(
            lower=(2.6, 1.4, -0.3),
            upper=(3.4, 2.0, 0.3),
            home=(3, 1.732, 0),
            characteristic_length=0.9,
        ),
    )
    poses = symkin.sample_workspace(textbook, 200).poses
    with pytest.raises(NotIdentifiableError) as caught:
        symkin.make_plan(textbook, poses, 12)
    assert "leg 1: base_radius is 0 m: its base point is the frame's origin" in str(caught.value)
    assert "base_angle is undefined; shift the origin of the base frame" in str(caught.value)
    result = check_mechanism(textbook)
    assert len(result.undefined) == 1
    assert result.undefined[0] in str(caught.value)


@pytest.mark.parametrize(
    ("values", "said"),
    [
        ({"platform_radius": 0}, "platform_azimuth are undefined; shift the origin of the"),
        ({"base_radius": -1e-5}, "base_polar_angle and base_azimuth are undefined"),
        ({"base_polar_angle": 0}, "its base point is on Z, where base_azimuth is undefined"),
    ],
)
def test_each_end_of_a_spatial_leg_is_named_with_its_angles(hexapod, values, said):
    (sentence,) = undefined_angles(with_values(hexapod, 4, **values), 4)
    assert sentence.startswith("leg 5: ")
    assert said in sentence


@pytest.mark.parametrize("name", KNOWN_CHAINS)
def test_no_shipped_mechanism_has_one_though_guides_pass_through_centres(name):
    assert check_mechanism(symkin.load_mechanism(name)).undefined == ()


def test_a_refusal_for_another_reason_says_nothing_of_origins(paper):
    poses = symkin.sample_workspace(paper, 200).poses
    alike = poses[:1].repeat(50, axis=0)
    with pytest.raises(NotIdentifiableError) as caught:
        symkin.make_plan(paper, alike, 12, margin_sigmas=0)
    assert "undefined" not in str(caught.value)
