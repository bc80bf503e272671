# SPDX-License-Identifier: MIT
"""Deltas that a probe calibrates: what heights show, and what they do not."""

import dataclasses
import json
import re

import numpy as np
import pytest

import symkin
from symkin.analysis.probing import PrintedLength, with_printed_length
from symkin.data.reading import write_measurements
from symkin.errors import MeasurementError, SymkinError
from symkin.estimate.precision import in_words
from symkin.estimate.problem import KINDS
from symkin.model.settings import NoiseSettings
from symkin.planning.simulation import disturb

STEP = 1e-3 / 80
POINTS = np.array(
    [(x, y) for x in np.linspace(-0.075, 0.075, 7) for y in np.linspace(-0.075, 0.075, 7)]
)
POINTS = POINTS[np.linalg.norm(POINTS, axis=1) < 0.076]


@pytest.fixture(scope="module")
def delta():
    shipped = symkin.load_mechanism("linear_delta")
    return shipped.replace(
        noise=NoiseSettings(1e-5, 0.0, STEP / np.sqrt(12)),
        tolerances=dataclasses.replace(shipped.tolerances, angle=1e-3, gain=2e-4),
    )


def touched(actual, seed=1):
    random = np.random.default_rng([seed, 1])
    poses = np.column_stack([POINTS, 3e-4 + POINTS @ [0.002, -0.001]])
    poses[:, 2] += random.normal(0, 1e-5, len(poses))
    readings = np.round(actual.inverse_kinematics(poses) / STEP) * STEP
    return symkin.Measurements.of(
        np.full(poses.shape, np.nan),
        readings,
        reading_unit="m",
        pose_space="translating",
        heights=np.zeros(len(poses)),
    )


def printed(believed, actual, length=0.1):
    ends = np.array([[-length / 2, 0.0, 0.0], [length / 2, 0.0, 0.0]])
    poses, _ = actual.forward_kinematics(believed.replace(frames=None).inverse_kinematics(ends))
    return float(np.linalg.norm(poses[1] - poses[0]))


@pytest.fixture(scope="module")
def actual(delta):
    return disturb(delta, 3)


@pytest.fixture(scope="module")
def probed(delta, actual):
    return symkin.identify(delta, touched(actual))


def test_a_probed_bed_is_unknown_and_the_tolerances_are_priors(probed):
    assert probed.trustworthy
    assert probed.options.frames == ("plane",)
    assert probed.options.prior == "tolerances"
    plane = [each for each in probed.unknowns if each.name.startswith("plane.")]
    off = [each.value for each in plane] - np.array([3e-4, 0.002, -0.001])
    assert np.abs(off / [each.deviation for each in plane]).max() < 3


def test_what_was_asked_for_is_not_changed(delta, actual):
    found = symkin.identify(delta, touched(actual), free=["sensor_offset"])
    assert found.options.frames == ()
    assert set(found.names) == {f"leg{leg}.sensor_offset" for leg in (1, 2, 3)}


def test_heights_are_smaller_and_predicted_by_each_other(probed):
    heights = probed.heights
    assert heights.fitted < heights.after < 2e-5 < heights.before
    assert heights.size_with_length < heights.size_after < heights.size_before


def test_heights_show_radii_and_end_stops_but_not_rods(probed):
    known = {each.parameter: each for each in probed.heights.shown}
    assert in_words(known["base_radius"].common) == "shown"
    assert in_words(known["sensor_offset"].between) == "shown"
    assert in_words(known["sensor_offset"].common) == "not shown"
    assert not known["distal_length"].is_shown
    assert any("do not show length of the rods" in str(note) for note in probed.notes)
    rods = [each for each in probed.unknowns if each.name.endswith("distal_length")]
    assert not any(each.shown for each in rods)


def test_parameters_that_the_prior_knows_as_well_are_not_called_free(probed):
    weak = [each for each in probed.unknowns if each.deviation > 0.5 * each.prior]
    assert weak
    assert not any(each.shown for each in weak)


FIRMWARE = {
    "free": ["sensor_offset", "base_radius", "leg1.base_azimuth", "leg2.base_azimuth"],
    "shared": ["base_radius"],
}


def test_what_a_firmware_does_not_know_counts_with_its_tolerances(delta):
    """Held rods, leans and gains, and towers that share a radius: the size that is told holds."""
    off, alone = [], []
    for seed in range(1, 41):
        actual = disturb(delta, seed)
        found = symkin.identify(delta, touched(actual, seed), **FIRMWARE)
        exact = symkin.identify(delta, touched(actual, seed), **FIRMWARE, assume={"tolerances": 0})
        np.testing.assert_array_equal(found.mechanism.parameters, exact.mechanism.parameters)
        error = abs(printed(found.mechanism, actual) - 0.1) / 0.1
        off.append(error / found.heights.size_after)
        alone.append(error / exact.heights.size_after)
    assert 0.55 < np.mean(np.array(off) < 1) < 0.85
    assert np.mean(np.array(off) < 1.96) > 0.9
    assert np.mean(np.array(alone) < 1.96) < 0.6
    assert "held-as-exact" in {note.code for note in exact.notes}
    held = {each.name for each in found.assumed}
    assert {"leg1.distal_length", "leg2.base_radius", "leg3.sensor_gain"} < held
    assert not held & {"leg1.base_height", "leg1.guide_azimuth", "leg1.sensor_offset"}


def test_what_is_said_of_a_held_parameter_counts_before_its_tolerance(delta, actual):
    told = {"distal_length": "20 um", "base_radius": "10 um"}
    found = symkin.identify(delta, touched(actual), **FIRMWARE, assume=told)
    deviations = {each.name: each.deviation for each in found.assumed}
    assert deviations["leg2.distal_length"] == pytest.approx(2e-5)
    assert deviations["leg2.base_radius"] == pytest.approx(1e-5)
    assert deviations["leg2.guide_swing"] == delta.tolerances.angle
    with pytest.raises(SymkinError, match="sensor_offset, which is estimated; a prior says"):
        symkin.identify(delta, touched(actual), **FIRMWARE, assume={"sensor_offset": "1 mm"})


def test_one_printed_length_settles_the_size(delta, actual, probed):
    piece = PrintedLength(0.1, printed(delta, actual), 2e-5)
    found = symkin.identify(delta, with_printed_length(delta, touched(actual), piece))
    assert found.trustworthy
    assert found.heights.size_after < 0.6 * probed.heights.size_after
    assert abs(printed(found.mechanism, actual) - 0.1) < 6e-5 < abs(printed(delta, actual) - 0.1)


def test_a_ruler_may_lie_in_any_direction(delta, actual):
    taken = with_printed_length(
        delta, touched(actual), PrintedLength(0.1, printed(delta, actual), 2e-5)
    )
    turned = np.array(taken.poses)
    turned[-2:, :2] = turned[-2:, :2] @ np.array([[0, 1], [-1, 0]]) + [0.3, -0.2]
    found = symkin.identify(delta, taken)
    other = symkin.identify(delta, dataclasses.replace(taken, poses=turned))
    assert other.chi_square == pytest.approx(found.chi_square, abs=1e-6)
    np.testing.assert_allclose(
        other.mechanism.parameters, found.mechanism.parameters, rtol=0, atol=1e-9
    )


def test_of_sound_printers_what_is_shown_is_within_three_deviations(delta):
    errors, sizes = [], {"before": [], "after": []}
    for seed in range(12):
        actual = disturb(delta, seed)
        found = symkin.identify(delta, touched(actual, seed))
        covariance = np.asarray(found.covariance)
        columns = [found.names.index(f"leg{leg}.base_radius") for leg in (1, 2, 3)]
        radius = delta.parameter_names.index("base_radius")
        off = (found.mechanism.parameters - actual.parameters)[:, radius].mean()
        errors.append(off / np.sqrt(covariance[np.ix_(columns, columns)].mean()))
        sizes["before"].append(printed(delta, actual) - 0.1)
        sizes["after"].append(printed(found.mechanism, actual) - 0.1)
    assert np.abs(errors).max() < 3
    assert np.std(errors) > 0.3
    before, after = (np.sqrt(np.mean(np.square(each))) for each in sizes.values())
    assert after < before / 3


def test_held_parameters_that_contradict_are_named(delta):
    shipped = symkin.load_mechanism("linear_delta").replace(noise=delta.noise)
    measured = touched(disturb(shipped, 2))
    found = symkin.identify(shipped, measured, free=["guide_swing"], frames=["plane"])
    said = " ".join([found.failure, *map(str, found.doubts)])
    assert not found.trustworthy
    assert "held or shared" in said
    assert "contradicts" in said or "free them" in said


def test_commanded_positions_beside_heights_are_refused(delta, actual):
    measured = touched(actual)
    taken, _ = delta.forward_kinematics(measured.readings)
    taken = np.column_stack([taken[:, :2], np.full(len(taken), np.nan)])
    with pytest.raises(SymkinError, match="commanded, not measured"):
        symkin.identify(delta, dataclasses.replace(measured, poses=taken))


@pytest.mark.parametrize(
    ("values", "words"),
    [((0.1, -0.1), "above zero"), ((0.1, 0.1, 0.0), "above zero"), ((100.0, 0.1), "units")],
)
def test_impossible_printed_lengths_are_refused(values, words):
    with pytest.raises(SymkinError, match=words):
        PrintedLength(*values)


def test_a_printed_length_beyond_reach_is_refused(delta, actual):
    with pytest.raises(SymkinError, match="out of reach"):
        with_printed_length(delta, touched(actual), PrintedLength(1.0, 1.0))


def test_readings_without_heights_say_what_to_add(delta):
    table = {f"psi_{leg}_mm": [100.0 + leg, 120.0] for leg in (1, 2, 3)}
    with pytest.raises(MeasurementError, match="height_mm of zeros"):
        symkin.read_measurements(table, delta)


def test_steps_are_read_as_lengths(delta, actual):
    measured = touched(actual)
    counted = delta.replace(reading_step=STEP)
    table = {f"psi_{leg}_step": measured.readings[:, leg - 1] / STEP for leg in (1, 2, 3)}
    read = symkin.read_measurements({**table, "height_mm": np.zeros(len(POINTS))}, counted)
    np.testing.assert_allclose(read.readings, measured.readings, atol=1e-12)


def test_results_tell_heights_before_and_after(probed):
    heights = json.loads(json.dumps(probed.to_dict()))["heights"]
    assert heights["before_rms_m"] == probed.heights.before
    assert heights["after_rms_m"] == probed.heights.after
    assert "Height, rms" in probed.text()
    section = next(each for each in probed.page().sections if each.anchor == "heights")
    assert any("rods" in each for each in section.paragraphs)


def test_seven_points_do_not_tell_how_well_an_eighth_is_predicted(delta, actual):
    few = symkin.identify(delta, touched(actual)[:7])
    assert np.isnan(few.heights.after)
    assert few.heights.fitted < few.heights.before
    assert "too few to say" in " ".join(few.text().split())


def test_a_written_probe_table_gives_the_same(probed, delta, actual, tmp_path):
    write_measurements(touched(actual), tmp_path / "probe.csv", delta)
    again = symkin.identify(delta, symkin.read_measurements(tmp_path / "probe.csv", delta))
    assert again.chi_square == pytest.approx(probed.chi_square, rel=1e-9)


def test_positions_in_the_frame_of_the_robot_are_taken_so_where_frames_are_said(delta, actual):
    measured = touched(actual)
    taken, _ = actual.forward_kinematics(measured.readings)
    marks = np.column_stack([taken[:, :2], np.full(len(taken), np.nan)])
    measured = dataclasses.replace(measured, poses=marks)
    found = symkin.identify(delta, measured, frames=["plane"], prior="tolerances")
    assert not any(each.name.startswith("base.") for each in found.unknowns)
    assert found.degrees_of_freedom > 0
    assert not found.unexplained


def test_what_a_datum_holds_is_no_unknown_of_the_size(delta, actual):
    free, frames = ["sensor_offset", "plane"], ["plane"]
    found = symkin.identify(
        delta, touched(actual), free=free, frames=frames, prior={}, gauge="datum"
    )
    assert found.gauge == "leg1.sensor_offset is held as drawn, and carries the others"
    assert len(found.names) == 5
    assert found.heights.size_after < found.heights.size_before


def test_a_wrong_height_is_named_by_its_row_of_which_it_may_be_any_observation(delta, actual):
    taken = touched(actual)
    heights = np.array(taken.heights)
    heights[7] += 1e-3
    found = symkin.identify(delta, dataclasses.replace(taken, heights=heights))
    told = next(each for each in found.doubts if each.code == "rows-unlike")
    assert told.rows == (taken.row_numbers[7],)
    assert "or as well another observation of that row" in str(told)


@pytest.mark.parametrize("factor", [2.0, 0.5])
def test_steps_that_are_wrong_by_two_are_told_in_words(factor):
    delta = symkin.load_mechanism("linear_delta")
    plan = symkin.make_plan(delta, symkin.sample_workspace(delta, 2000), 12, observe="height")
    measured = symkin.simulate(delta, plan, seed=1, observe="height").measurements
    wrong = dataclasses.replace(measured, readings=factor * measured.readings)
    found = symkin.identify(delta, wrong)
    assert not found.trustworthy
    assert found.doubts or found.failure
    assert isinstance(found.notes, tuple)  # what the heights show among them


def test_a_height_is_off_by_what_it_is_off_when_it_is_left_out(probed, delta, actual):
    measured, rows = touched(actual), probed.rows
    heights = rows.kind == KINDS.index("heights")
    for row in (0, 7, 20):
        kept = np.arange(len(measured)) != row
        others = symkin.identify(delta, measured[kept])
        x, y, z = others.mechanism.forward_kinematics(measured.readings[[row]])[0][0]
        c0, c1, c2 = (each.value for each in others.unknowns if each.name.startswith("plane."))
        off = z - (c0 + c1 * x + c2 * y)
        said = float(rows.blunder[heights & (rows.pose == row)][0])
        assert abs(said) == pytest.approx(abs(off), rel=0.02)


@pytest.mark.parametrize(("count", "doubted"), [(6, True), (8, True), (13, False), (21, False)])
def test_so_few_points_that_no_other_predicts_one_are_doubted(count, doubted):
    robot = symkin.load_mechanism("linear_delta").with_device("bed probe")
    plan = symkin.plan(robot, count, candidates=300, spares=3)
    found = symkin.identify(robot, symkin.simulate(robot, plan, seed=3))
    said = [doubt for doubt in found.doubts if doubt.code == "others-say-little"]
    assert bool(said) == doubted
    assert found.trustworthy != doubted
    if doubted:  # what is said is what leaving out each would do, to first order
        fitted, left_out = (
            float(re.search(rf"{words} ([0-9.]+) mm", str(said[0]))[1])
            for words in ("times the", "predicted to")
        )
        assert left_out == pytest.approx(said[0].size * fitted, rel=0.02)


def test_a_point_left_out_is_predicted_as_badly_as_the_doubt_says():
    robot = symkin.load_mechanism("linear_delta").with_device("bed probe")
    plan = symkin.plan(robot, 8, candidates=300, spares=3)
    measured = symkin.simulate(robot, plan, seed=3).measurements
    (doubt,) = symkin.identify(robot, measured).doubts
    off = []
    for row in range(len(measured)):
        others = symkin.identify(robot, measured.subset(np.delete(np.arange(len(measured)), row)))
        c0, c1, c2 = others.frames.plane
        x, y, z = others.mechanism.forward_kinematics(measured.readings[row])[0][0]
        above = (z - c0 - c1 * x - c2 * y) / np.hypot(1, np.hypot(c1, c2))
        off.append(above - measured.heights[row])
    said = float(re.search(r"predicted to ([0-9.]+) mm", str(doubt))[1])
    assert said == pytest.approx(1e3 * np.sqrt(np.mean(np.square(off))), rel=0.1)
