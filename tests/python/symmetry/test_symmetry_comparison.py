# SPDX-License-Identifier: MIT
"""The symmetry that there is, against the one declared or nearly there."""

import numpy as np
import pytest

import symkin
from symkin.model.settings import Tolerances
from symkin.model.symmetry import compare_symmetry
from symkin.planning.simulation import disturb


def changed(mechanism, leg, parameter, change):
    """The mechanism without a declaration and with one parameter changed."""
    parameters = mechanism.parameters.copy()
    parameters[leg, mechanism.parameter_names.index(parameter)] += change
    return mechanism.replace(symmetry=None).with_parameters(parameters)


@pytest.mark.parametrize(
    "name", [name for name in symkin.shipped_mechanisms() if symkin.load_mechanism(name).symmetry]
)
def test_shipped_mechanisms_have_exactly_what_they_declare(name):
    found = compare_symmetry(symkin.load_mechanism(name))
    assert found.verdict == "exact"
    assert found.deviations == ()
    assert found.sentences[0].startswith("The legs have the declared symmetry")


def test_the_one_parameter_that_breaks_a_symmetry_is_named(paper):
    found = compare_symmetry(changed(paper, 1, "distal_length", 0.0012))
    assert found.verdict == "nearly"
    assert found.found.structure.size == 2  # the mirror through leg 2 is left
    assert found.reference.paper_name == "D_6"
    assert found.reference_elements == ("r0", "r1", "r2")
    (deviation,) = found.deviations
    assert (deviation.leg, deviation.parameter) == (1, "distal_length")
    assert deviation.deviation == pytest.approx(0.0012, abs=1e-9)
    assert deviation.in_tolerances == pytest.approx(1.2, abs=1e-6)
    assert "Nearly D_6 (D_3), with the working modes C_3: within 1.2 " in found.sentences[1]


def test_deviations_are_in_the_tolerance_of_their_kind_and_the_largest_comes_first(paper):
    coarse = paper.replace(tolerances=Tolerances(length=1e-3, angle=1e-4, gain=1e-2))
    both = changed(changed(coarse, 0, "base_radius", 2e-3), 2, "platform_angle", 4e-4)
    found = compare_symmetry(changed(both, 1, "sensor_gain", 1e-3))
    named = [(item.leg, item.parameter, item.in_tolerances) for item in found.deviations[:2]]
    assert named[0] == (2, "platform_angle", pytest.approx(4, rel=0.01))
    assert named[1] == (0, "base_radius", pytest.approx(2, rel=0.01))
    (gain,) = found.sensor_deviations
    assert gain.in_tolerances == pytest.approx(0.1, rel=0.01)


def test_a_disturbed_hexapod_nearly_has_the_whole_group(hexapod):
    made = disturb(hexapod, seed=4).replace(symmetry=None)
    found = compare_symmetry(made)
    assert found.found.structure.size == 1
    assert found.verdict == "nearly"
    assert found.reference.name == "D_3"
    assert len(found.reference_elements) == 6
    deviations = np.array([item.in_tolerances for item in found.deviations])
    assert (np.diff(deviations) <= 0).all()
    assert 1 < deviations[0] < 6


@pytest.mark.parametrize("name", ["3PRR", "3RPR", "4RRR", "hexapod_jugglebot"])
def test_a_robot_as_made_nearly_has_the_whole_group_of_its_drawing(name):
    drawing = symkin.load_mechanism(name)
    whole = symkin.detect_symmetry(drawing).structure.name
    for seed in range(10):
        found = compare_symmetry(disturb(drawing, seed).replace(symmetry=None))
        assert (found.verdict, found.reference.name) == ("nearly", whole)


@pytest.mark.parametrize("name", ["3PRR", "3RPR", "3RRR", "6RRR", "hexapod_jugglebot"])
def test_any_parameter_that_alone_is_off_is_the_one_named(name):
    drawing = symkin.load_mechanism(name)
    for leg in range(len(drawing.legs)):
        for parameter in drawing.parameter_names[:-2]:
            if name == "3PRR" and parameter == "base_radius":
                continue  # three guides at 120 degrees have a centre wherever they lie
            error = 2 * (drawing.tolerances.length if "length" in parameter else 1e-3)
            found = compare_symmetry(changed(drawing, leg, parameter, error))
            largest = found.deviations[0]
            assert (largest.leg, largest.parameter) == (leg, parameter)
            assert largest.deviation == pytest.approx(error, rel=1e-3)


def with_sensors(mechanism, gains, offsets):
    """The mechanism, undeclared, with other gains and offsets."""
    parameters = mechanism.parameters.copy()
    parameters[:, -2], parameters[:, -1] = gains, offsets
    return mechanism.replace(symmetry=None).with_parameters(parameters)


@pytest.mark.parametrize(
    ("gains", "offsets", "differing"),
    [
        (1, 0, "sensor_offset differs"),
        ([1, 1.1, 1.2], None, "sensor_gain differs"),
        ([1, 1.1, 1.2], [0.1, 0.7, 2], "sensor_gain and sensor_offset differ"),
    ],
)
def test_sensors_that_differ_leave_the_structure_its_group(paper, gains, offsets, differing):
    found = compare_symmetry(
        with_sensors(paper, gains, paper.parameters[:, -1] if offsets is None else offsets)
    )
    assert (found.verdict, found.sensors) == ("exact", "broken")
    assert (found.found.structure.paper_name, found.found.with_modes.name) == ("D_6", "C_3")
    assert found.deviations == ()
    assert found.only_sensors_differ == f"only {differing}"
    assert found.sentences[1].startswith(f"Only {differing}: the structure has the symmetry")


def test_an_encoder_that_was_mounted_a_little_off_is_named(paper):
    found = compare_symmetry(changed(paper, 1, "sensor_offset", 0.002))
    assert (found.verdict, found.sensors) == ("exact", "nearly")
    (deviation,) = found.sensor_deviations
    assert (deviation.leg, deviation.parameter) == (1, "sensor_offset")
    assert deviation.deviation == pytest.approx(0.002)


def test_a_mechanism_with_symmetric_sensors_says_nothing_of_them(paper):
    found = compare_symmetry(paper)
    assert (found.sensors, found.sensor_deviations, len(found.sentences)) == ("exact", (), 1)


def test_rounded_numbers_nearly_have_the_symmetry(paper):
    rounded = paper.replace(symmetry=None).with_parameters(paper.parameters.round(4))
    found = compare_symmetry(rounded)
    assert found.found.structure.size < 6
    assert found.verdict == "nearly"
    assert found.reference.paper_name == "D_6"
    assert found.worst < 0.1
    assert all("angle" in item.parameter for item in found.deviations)
    assert {item.parameter for item in found.sensor_deviations} == {"sensor_offset"}


def test_an_asymmetric_mechanism_is_trivial_and_what_breaks_the_nearest_group_is_named():
    found = compare_symmetry(symkin.load_mechanism("3RRR_asymmetric"))
    assert found.verdict == "broken"
    assert found.found.structure.name == "C_1"
    assert "trivial" in found.sentences[0]
    assert found.sentences[1].startswith("Far from the nearest, D_6 (D_3)")
    deviations = {(item.leg, item.parameter): item.deviation for item in found.deviations}
    # The file's base angles are 205, 340 and 85 degrees: leg 2 is 15 degrees off.
    assert deviations[1, "base_angle"] == pytest.approx(np.radians(15))
    assert deviations[0, "base_radius"] == pytest.approx(0.55 - 0.52)
    assert {item.parameter for item in found.deviations[:2]} == {"base_angle", "platform_angle"}
    assert {item.parameter for item in found.sensor_deviations} == {"sensor_offset"}
    assert "Of the sensors, sensor_offset differs" in found.sentences[2]


@pytest.mark.parametrize(("change", "verdict"), [(0.001, "nearly"), (0.1, "broken")])
def test_a_declared_symmetry_that_is_absent_is_compared_with(paper, change, verdict):
    broken = changed(paper, 2, "proximal_length", change).replace(symmetry=paper.symmetry)
    found = compare_symmetry(broken)
    assert found.verdict == verdict
    assert found.reference is found.declared
    assert "do not have the declared symmetry C_3" in found.sentences[0]
    assert [(item.leg, item.parameter) for item in found.deviations] == [(2, "proximal_length")]


def test_an_exact_symmetry_stays_exact_beside_a_larger_one_that_is_near(paper):
    parameters = paper.parameters.copy()
    parameters[:, paper.parameter_names.index("platform_angle")] += 0.001
    turned = paper.with_parameters(parameters)  # keeps C3, and the mirrors of the platform turn
    assert compare_symmetry(turned).verdict == "exact"
    parameters[:, paper.parameter_names.index("sensor_offset")] += 0.001
    found = compare_symmetry(paper.with_parameters(parameters))
    assert found.sentences[0] == "The legs have the declared symmetry C_3."


def test_standard_deviations_of_a_calibrated_mechanism_are_handed_on(paper):
    nearly = changed(paper, 1, "distal_length", 0.001)
    known = nearly.with_parameters(nearly.parameters, np.full((3, 8), 0.5))
    assert compare_symmetry(known).deviations[0].standard_deviation == 0.5
    assert np.isnan(compare_symmetry(nearly).deviations[0].standard_deviation)
