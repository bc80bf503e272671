# SPDX-License-Identifier: MIT
"""Every planar chain against numbers that were made independently."""

import json

import numpy as np
import pytest

import symkin

# One key stands for both chains of a pair that share a closure.
TWINS = {"[P]PR": "P[P]R", "R[P]P": "RP[P]"}


def chains_with_their_numbers(path):
    for chain, numbers in json.loads(path.read_text()).items():
        yield chain, numbers
        if chain in TWINS:
            yield TWINS[chain], numbers


def mechanism_of(chain, parameters, mode):
    return symkin.Mechanism(chain, [symkin.Leg(chain, parameters, mode)] * 3)


def test_every_planar_chain_has_reference_numbers(reference_file):
    named = {chain for chain, _ in chains_with_their_numbers(reference_file)}
    planar = {chain for chain in symkin.chains() if symkin.chain_info(chain).pose_space == "planar"}
    assert named == planar


def test_roots_jacobians_and_closures_equal_the_reference(reference_file):
    for chain, numbers in chains_with_their_numbers(reference_file):
        names = symkin.chain_info(chain).parameter_names
        assert tuple(numbers["parameters"]) == names, chain
        angular = symkin.chain_info(chain).reading_unit == "rad"
        turn = 2 * np.pi / numbers["parameters"]["sensor_gain"] if angular else np.inf
        for case in numbers["cases"]:
            found = set()
            for mode in (-1, 1):
                mechanism = mechanism_of(chain, numbers["parameters"], mode)
                pose = np.array([case["pose"]])
                assert mechanism.closure(0, pose, [0.5])[0] == pytest.approx(
                    case["h_at_psi_0p5"], abs=1e-9
                ), chain
                reading = mechanism.inverse_kinematics(pose)[0, 0]
                gaps = [reading - root["psi"] for root in case["roots"]]
                gaps = [gap - turn * round(gap / turn) if angular else gap for gap in gaps]
                best = int(np.argmin(np.abs(gaps)))
                assert abs(gaps[best]) < 1e-9, (chain, mode)
                found.add(best)
                root = case["roots"][best]
                # Where the reading is on another turn, dg/dgain differs by that turn: compare at
                # the reference's reading.
                derivative = mechanism.parameter_jacobian(0, pose)[0]
                derivative[-2] += (reading - root["psi"]) / numbers["parameters"]["sensor_gain"]
                np.testing.assert_allclose(derivative, root["dg_dparam"], rtol=1e-9, atol=1e-9)
                np.testing.assert_allclose(
                    mechanism.pose_jacobian(pose)[0, 0], root["dg_dpose"], rtol=1e-9, atol=1e-9
                )
            assert len(found) == len(case["roots"]), chain


def test_the_published_3rpr_reads_the_published_lengths():
    # ARTE toolbox: base points (0, 0), (2.5, 0), (1.25, 2.5) m, equilateral platform of side 0.5 m
    # with its reference point at the first joint; lengths published to four decimals.
    base = np.array([[0, 0], [2.5, 0], [1.25, 2.5]])
    platform = np.array([[0, 0], [0.5, 0], [0.25, 0.5 * np.sqrt(3) / 2]])
    legs = [
        symkin.Leg(
            "R[P]R",
            {
                "base_radius": np.hypot(*a),
                "base_angle": np.arctan2(a[1], a[0]),
                "platform_radius": np.hypot(*b),
                "platform_angle": np.arctan2(b[1], b[0]),
                "sensor_gain": 1,
                "sensor_offset": 0,
            },
        )
        for a, b in zip(base, platform, strict=True)
    ]
    readings = symkin.Mechanism("3-RPR", legs).inverse_kinematics([0.9510, 0.9792, -0.35256])
    np.testing.assert_allclose(readings[0], [1.3650, 1.3477, 1.2037], atol=1e-4)


def test_the_3rrr_agrees_with_a_rigid_body_simulator(paper):
    pose = np.array([0.3, -0.2, np.deg2rad(15)])
    published = {
        -1: [37.65024225, 185.5702522, -69.00212221],
        1: [0.13059051, 104.30269157, -107.92444691],
    }
    for mode, degrees in published.items():
        legs = [symkin.Leg(leg.chain, leg.parameters, mode) for leg in paper.legs]
        mechanism = paper.replace(legs=legs)
        cranks = mechanism.inverse_kinematics(pose)[0] + mechanism.parameters[:, -1]
        gaps = (cranks - np.deg2rad(degrees) + np.pi) % (2 * np.pi) - np.pi
        np.testing.assert_allclose(gaps, 0, atol=1e-9)


def test_sensor_offsets_of_the_paper(paper):
    np.testing.assert_allclose(paper.parameters[:, -1], [np.pi / 6, 5 * np.pi / 6, -np.pi / 2])
