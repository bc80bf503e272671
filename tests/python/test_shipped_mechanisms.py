# SPDX-License-Identifier: MIT
"""Every mechanism that comes with symkin: its symmetry, and the protocol on it."""

import numpy as np
import pytest

import symkin
from symkin import _core
from symkin.analysis.observability import analyse_observability
from symkin.analysis.workspace.study import check_elements, other_working_modes
from symkin.errors import SymmetryError
from symkin.model.settings import DeclaredSymmetry, ProtocolSettings
from symkin.model.symmetry import leg_carriers, observability_group, verify_declared
from symkin.storage.shipped import shipped_folder

# The structure's group in the paper's notation, and the usual name of its subgroup that keeps the
# working modes.
GROUPS = {
    "2RRR_PRP": ("D_2", "D_1"),
    "3PRS": ("D_6", "D_3"),
    "3RPS": ("D_6", "D_3"),
    "3PRP": ("D_6", "D_3"),
    "3PRR": ("D_6", "C_3"),
    "3RPR": ("D_6", "D_3"),
    "3RPR_end_joint": ("D_6", "C_3"),
    "3RRP": ("D_6", "C_3"),
    "3RRR": ("D_6", "C_3"),
    "3RRR_asymmetric": ("C_1", "C_1"),
    "4RRR": ("D_8", "C_4"),
    "5bar": ("D_4", "D_1"),
    "6RRR": ("D_6", "D_3"),
    "agile_eye": ("D_6", "C_3"),
    "hangprinter": ("C_1", "C_1"),
    "hexa": ("D_6", "D_3"),
    "hexaglide": ("D_6", "D_3"),
    "hexapod_jugglebot": ("D_6", "D_3"),
    "linear_delta": ("D_6", "D_3"),
    "lsst_camera_hexapod": ("D_6", "D_3"),
    "rotary_delta": ("D_6", "D_3"),
}
SYMMETRIC = sorted(set(GROUPS) - {"3RRR_asymmetric", "hangprinter"})
# Legs of two chains are two orbits.
ORBITS = {"2RRR_PRP": [0, 0, 2]}


@pytest.fixture(params=sorted(GROUPS))
def shipped(request):
    return symkin.load_mechanism(request.param)


@pytest.fixture(params=SYMMETRIC)
def symmetric(request):
    return symkin.load_mechanism(request.param)


def test_the_groups_are_told_of_all_shipped_mechanisms():
    known = {path.stem for path in shipped_folder().glob("*.toml")}  # others: tests/python/declared
    assert set(GROUPS) == known < {*symkin.shipped_mechanisms()}


def test_the_detected_group_is_the_expected_one(shipped):
    found = symkin.detect_symmetry(shipped)
    assert (found.structure.paper_name, found.with_modes.name) == GROUPS[shipped.name]


def test_a_declared_group_is_there_and_carries_leg_1_to_all_legs_of_its_chain(symmetric):
    verify_declared(symmetric)
    origins = [leg for leg, _ in leg_carriers(symmetric)]
    assert origins == ORBITS.get(symmetric.name, [0] * len(symmetric.legs))
    assert (observability_group(symmetric) is None) == (symmetric.name in ORBITS)


def test_all_six_legs_of_the_hexapod_are_one_orbit(hexapod):
    permutations = symkin.detect_symmetry(hexapod).permutations.values()
    assert {permutation[0] for permutation in permutations} == set(range(6))


def test_the_asymmetric_mechanism_names_what_breaks_a_symmetry():
    mechanism = symkin.load_mechanism("3RRR_asymmetric")
    assert [leg for leg, _ in leg_carriers(mechanism)] == [0, 1, 2]
    with pytest.raises(SymmetryError, match=r"leg \d.*(_length|_radius|_angle|_offset)"):
        verify_declared(mechanism.replace(symmetry=DeclaredSymmetry("C3")))


def test_home_is_far_from_singularities_and_the_box_is_worth_sampling(shipped):
    _, _, condition = shipped.singularity_measures(shipped.home)
    assert condition[0] < shipped.workspace.conditioning_limit / 2
    sample = symkin.sample_workspace(shipped, 2000)
    assert len(sample.poses) / sample.drawn > 0.1


def test_symmetrical_observability_holds_to_rounding(symmetric):
    # Eq. 10, for every element of the structure: an element that flips the working modes carries
    # the legs onto those of the mechanism with the other modes.
    found = symkin.detect_symmetry(symmetric)
    poses = symkin.sample_workspace(symmetric, 60).poses
    for element in found.structure.elements:
        keeps = found.keeps_modes[element.label]
        image = symmetric if keeps else other_working_modes(symmetric)
        image_poses = _core.transform_poses(found.structure.core, element, symmetric.core, poses)
        for leg, onto in enumerate(found.permutations[element.label]):
            of_leg = analyse_observability(symmetric, leg, poses)
            of_image = analyse_observability(image, onto, image_poses)
            # Gain and offset come last; an element that does not keep the sensors moves the gain's
            # column by a multiple of the offset's.
            alike = slice(None) if keeps else slice(None, -2)
            np.testing.assert_allclose(
                of_image.r_diagonal[alike], of_leg.r_diagonal[alike], rtol=1e-9
            )


def test_workspace_theorem_and_active_joint_conjecture_hold(symmetric):
    # Eqs. 2 and 5.
    structure = symkin.detect_symmetry(symmetric).structure
    for check in check_elements(symmetric, structure, count=5000, seed=3):
        assert check.mismatches == 0
        assert check.inside > 500
        assert not check.keeps_modes or check.reading_deviation <= 1e-12


def test_the_whole_protocol_improves_the_robot(shipped):
    settings = ProtocolSettings(shipped.protocol.pose_count, candidates=1500, seed=1)
    result = symkin.run_protocol(shipped.replace(protocol=settings))
    assert result.identification.trustworthy
    assert result.after.failed == 0
    for kind, _ in shipped.space.errors:
        before, after = (getattr(each, f"{kind}_rms") for each in (result.before, result.after))
        assert after < before / 3
