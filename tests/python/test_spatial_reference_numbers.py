# SPDX-License-Identifier: MIT
"""Legs in space and shipped mechanisms against numbers that were made independently."""

import json
from functools import cache

import numpy as np
import pytest

import symkin
from symkin import _core
from symkin.analysis.workspace import workspace_coordinates
from symkin.model.chains import shortest
from symkin.model.settings import WorkspaceSettings

SHIPPED = {
    "linear_delta": "linear_delta_kossel",
    "rotary_delta": "rotary_delta_flexpicker",
    "hexa": "hexa_servo",
    "hexaglide": "hexaglide_vertical",
    "agile_eye": "agile_eye",
    "3RPS": "3rps_heliostat",
}
BOUND = {"3rps_heliostat": "R[P]S", "3prs_vertical": "[P]RS"}
CHAINS = [
    f"{chain} {platform}"
    for chain in ("[P]US", "[R]US", "U[P]S")
    for platform in ("rigid", "translating")
] + ["[R]RR spherical", "R[P]S rigid", "[P]RS rigid"]


@cache
def read(path):
    return json.loads(path.read_text())


@pytest.fixture(params=CHAINS)
def chain(request, shared_reference):
    name, platform = request.param.split()
    return name, platform, read(shared_reference / "spatial_chains.json")[request.param]


@pytest.fixture(params=SHIPPED)
def built(request, shared_reference):
    numbers = read(shared_reference / "spatial_mechanisms.json")[SHIPPED[request.param]]
    return symkin.load_mechanism(request.param), numbers


def mechanism_of(name, platform, parameters, mode):
    count = 6 // symkin.chain_info(name, platform).closures
    return symkin.Mechanism(name, [symkin.Leg(name, parameters, mode)] * count, platform=platform)


def assert_close(values, expected):
    np.testing.assert_allclose(values, expected, rtol=1e-9, atol=1e-9)


def test_parameters_are_named_in_the_same_order(chain):
    name, platform, numbers = chain
    assert list(symkin.chain_info(name, platform).parameter_names) == numbers["parameter_names"]


def test_roots_of_each_working_mode_and_their_derivatives_equal_the_reference(chain):
    name, platform, numbers = chain
    turn = 2 * np.pi if symkin.chain_info(name, platform).reading_unit == "rad" else None
    for leg in numbers["sets"]:
        for case in leg["cases"]:
            pose = np.array([case["pose"]])
            for root in case["roots"]:
                mechanism = mechanism_of(
                    name, platform, leg["parameters"], root.get("working_mode", 1)
                )
                gain = leg["parameters"]["sensor_gain"]
                later = mechanism.inverse_kinematics(pose)[0, 0] - root["psi"]  # by whole turns
                assert abs(shortest(np.array(gain * later), turn)) < 1e-9
                rows = _core.linearise(mechanism.core, 0, pose, np.array([root["psi"]]))
                assert_close(rows.closure, [0, root.get("plane_closure", 0)][: len(rows.closure)])
                assert_close(rows.by_parameters, np.atleast_2d(root["dh_dparam"]))
                assert_close(rows.by_pose, np.atleast_2d(root["dh_dpose"]))
                assert_close(rows.by_reading, np.atleast_1d(root["dh_dpsi"]))
                by_parameters = np.array(root["dg_dparam"])  # of psi = (q - offset) / gain
                by_parameters[mechanism.parameter_names.index("sensor_gain")] -= later / gain
                assert_close(mechanism.parameter_jacobian(0, pose)[0], by_parameters)
                assert_close(mechanism.pose_jacobian(pose)[0, 0], root["dg_dpose"])


def test_closures_and_derivatives_off_the_roots_equal_the_reference(chain):
    name, platform, numbers = chain
    for leg in numbers["sets"]:
        mechanism = mechanism_of(name, platform, leg["parameters"], 1)
        for case in leg["cases"]:
            pose, off = np.array([case["pose"]]), case["off_root"]
            rows = _core.linearise(mechanism.core, 0, pose, np.array([off["psi"]]))
            assert_close(rows.closure, off["h"])
            assert_close(rows.by_parameters, np.atleast_2d(off["dh_dparam"]))
            assert_close(rows.by_pose, np.atleast_2d(off["dh_dpose"]))
            found = mechanism.closure(0, pose, [0.5])[0]
            assert_close(found, case["h_at_psi_0p5"])


def test_reach_ends_where_the_reference_says(chain):
    name, platform, numbers = chain
    for leg in numbers["sets"]:
        mechanism = mechanism_of(name, platform, leg["parameters"], 1)
        for case in leg["cases"] + leg.get("out_of_reach", []):
            pose = np.array([case["pose"]])
            margin = _core.reach_margin(mechanism.core, pose)[0, 0]
            assert_close(margin, case.get("reach_margin", np.inf))
            assert np.isnan(mechanism.inverse_kinematics(pose)[0, 0]) == (margin < 0)


def test_of_a_guide_that_coordinate_is_held_along_which_it_runs(chain):
    name, platform, numbers = chain
    notes = {
        "vertical guide": "base_height",
        "radial guide": "base_radius",
        "tangential guide": "base_azimuth",
    }
    for leg in numbers["sets"]:
        held = mechanism_of(name, platform, leg["parameters"], 1).held[0]
        upright = name == "R[P]S" and np.isclose(
            *(leg["parameters"][f"{end}_radius"] for end in ("base", "platform")), rtol=0.1
        )
        assert len(held) == (name in ("[P]US", "[P]RS") or upright)
        if name == "[P]US" and leg.get("note") in notes:
            assert held == (notes[leg["note"]],)


def test_shipped_mechanisms_read_as_the_reference_does(built):
    mechanism, numbers = built
    assert len(mechanism.legs) == len(numbers["legs"])
    for case in numbers["cases"]:
        readings = mechanism.inverse_kinematics([case["pose"]])[0]
        # The legs may come in another order.
        assert_close(np.sort(readings), np.sort(case["readings"]))


@pytest.mark.parametrize("name", BOUND)
def test_platforms_that_legs_bind_take_the_poses_of_the_reference(name, shared_reference):
    numbers = read(shared_reference / "spatial_mechanisms.json")[name]
    chain = BOUND[name]
    legs = [symkin.Leg(chain, leg["parameters"], leg["working_mode"]) for leg in numbers["legs"]]
    lower, upper = np.transpose(numbers["box"])
    workspace = WorkspaceSettings(lower, upper, home=tuple(numbers["home"]))
    mechanism = symkin.Mechanism(name, legs, workspace=workspace)
    for case in numbers["cases"]:
        pose = np.array([case["pose"]])
        # Height and tilts say it all.
        coordinates = workspace_coordinates(mechanism, pose)[0]
        assert_close(mechanism.poses_at(coordinates * [0, 0, 1, 1, 1, 0]), pose[0])
        taken, converged = mechanism.forward_kinematics([case["readings"]])
        assert converged.all()
        assert_close(taken, pose)
        assert_close(mechanism.pose_jacobian(pose)[0], case["dg_dpose"])
        serial, parallel, _ = mechanism.singularity_measures(pose)
        # Theirs has the three lengths first, and dh in place of dg.
        assert_close(parallel[0] * -np.prod(serial), -case["det_dh_dpose"])


def test_the_flexpicker_reads_the_published_angles():
    readings = symkin.load_mechanism("rotary_delta").inverse_kinematics([[0.3, 0.5, -1.1]])[0]
    np.testing.assert_allclose(np.degrees(readings), [47.5, -11.6, 21.4], atol=0.06)


def test_the_hexas_cranks_are_level_at_the_published_height():
    readings = symkin.load_mechanism("hexa").inverse_kinematics([[0, 0, 0.147835046, 0, 0, 0, 1]])
    np.testing.assert_allclose(readings, 0, atol=1e-7)
