# SPDX-License-Identifier: MIT
"""Whatever is unknown, from whatever was observed: estimates, and verdicts that are honest."""

import dataclasses

import numpy as np
import pytest

import symkin
from symkin.analysis.observed import Observed
from symkin.errors import NotIdentifiableError, SymkinError
from symkin.estimate.evidence import models
from symkin.estimate.evidence.outliers import blunders_of
from symkin.estimate.problem import observed_count
from symkin.model.settings import Frames, IdentificationSettings, NoiseSettings

SEED = 11


@pytest.fixture(scope="module")
def plan():
    return symkin.load_mechanism("3RRR").plan(20, seed=3, visit="sets")


@pytest.fixture(scope="module")
def taken(paper, plan):
    """A robot, and full poses of it that serve all legs."""
    return simulated(paper, plan)


@pytest.fixture(scope="session")
def paper():
    return symkin.load_mechanism("3RRR")


def simulated(mechanism, plan, observe="pose", seed=SEED, actual=None):
    made = symkin.simulate(mechanism, plan, seed=seed, observe=observe, actual=actual)
    return dataclasses.replace(made, measurements=made.measurements.for_all_legs())


def in_deviations(found, actual):
    own = [each for each in found.unknowns if each.name.startswith("leg")]
    values, deviations = (np.array([getattr(u, n) for u in own]) for n in ("value", "deviation"))
    return (values - actual.parameters.ravel()) / deviations


def status(found, name):
    return next(each.status for each in found.unknowns if each.name == name)


def value(found, name):
    return next(each.value for each in found.unknowns if each.name == name)


# What may be observed.


@pytest.mark.parametrize(
    ("observe", "frames", "options"),
    [
        (Observed("position"), None, {}),
        (Observed("distance", anchors=((2.0, 1.0),)), Frames(anchors=((2.0, 1.0),)), {}),
        (
            Observed("pose", base=(1.0, -0.5, 3.0), target=(0.05, 0.0, 0.17)),
            None,
            {"frames": ["base", "target"]},
        ),
        (
            Observed("points", points=((0.3, 0.0), (0.0, 0.2))),
            Frames(points=((0.3, 0.0), (0.0, 0.2))),
            {},
        ),
    ],
    ids=["position", "distance", "frames", "points"],
)
def test_robots_are_found_with_honest_deviations(paper, plan, observe, frames, options):
    errors, chi_squares = [], []
    for seed in range(8):
        made = simulated(paper, plan, observe, seed)
        found = symkin.identify(paper.replace(frames=frames), made.measurements, **options)
        assert found.legs == ()
        assert found.converged
        assert found.doubts == ()
        errors.append(in_deviations(found, made.actual))
        chi_squares.append(found.chi_square / found.degrees_of_freedom)
    assert 0.9 < np.mean(np.abs(errors) < 1.96) < 0.995
    assert np.mean(chi_squares) == pytest.approx(1, abs=0.1)


def test_readings_alone_do_where_legs_are_redundant():
    quiet = symkin.load_mechanism("4RRR").replace(noise=NoiseSettings(1e-4, 1e-4, 1e-4))
    made = simulated(quiet, quiet.plan(20, seed=3), "readings")
    found = symkin.identify(quiet, made.measurements)
    assert found.trustworthy
    assert found.data_rank == 25
    assert len(found.unseen) == 7
    assert np.mean(np.abs(in_deviations(found, made.actual)) < 1.96) > 0.85


def test_the_plane_that_a_probe_touched_is_found(hexapod):
    quiet = hexapod.replace(noise=NoiseSettings(1e-4, 1e-4, 1e-3))
    plane = (0.2, 0.01, -0.02)
    made = simulated(quiet, quiet.plan(15, seed=3), Observed("height", plane=plane))
    found = symkin.identify(quiet, made.measurements, frames=["plane"])
    assert found.converged
    own = [each for each in found.unknowns if each.name.startswith("plane.")]
    errors = [(each.value - true) / each.deviation for each, true in zip(own, plane, strict=True)]
    assert np.abs(errors).max() < 4
    assert found.frames.plane == tuple(each.value for each in own)


# What may be unknown.


def test_full_poses_without_options_are_identified_leg_by_leg_as_ever(paper, taken):
    assert len(symkin.identify(paper, taken.measurements).legs) == 3


def test_what_is_shared_moves_by_the_same_amount_and_what_is_fixed_does_not(paper, taken):
    found = symkin.identify(
        paper, taken.measurements, shared=["*_length"], fixed=["leg2.base_radius"]
    )
    changes = found.mechanism.parameters - paper.parameters
    for name in ("proximal_length", "distal_length"):
        column = paper.parameter_names.index(name)
        assert np.ptp(changes[:, column]) < 1e-15
        assert changes[0, column] != 0
    assert changes[1, paper.parameter_names.index("base_radius")] == 0
    assert status(found, "leg2.base_radius") == "held"
    assert np.isnan(found.mechanism.deviations[1, paper.parameter_names.index("base_radius")])
    assert status(found, "leg3.distal_length") == "shared"


def test_parameters_that_are_all_shared_keep_the_symmetry(paper, taken):
    found = symkin.identify(paper, taken.measurements, free=[], shared=["*_length"])
    assert found.mechanism.symmetry == paper.symmetry


def test_a_tight_prior_holds_and_a_wide_one_does_not(paper, taken):
    free = symkin.identify(paper, taken.measurements, gauge="nominal")
    for width, follows in ((1e-9, False), (1.0, True)):
        found = symkin.identify(paper, taken.measurements, prior={"leg1.base_radius": width})
        same = value(found, "leg1.base_radius") == pytest.approx(
            value(free, "leg1.base_radius"), abs=1e-7
        )
        assert same == follows
    assert "not shown by the data" not in status(found, "leg1.base_radius")


def test_re_homing_is_the_offsets_alone(paper, taken):
    offset = paper.parameter_names.index("sensor_offset")
    shifted = taken.actual.parameters.copy()
    shifted[:, offset] += (0.02, -0.01, 0.015)
    known = taken.actual.replace(workspace=paper.workspace)
    found = symkin.identify(
        known.with_parameters(shifted), taken.measurements, free=["sensor_offset"]
    )
    errors = found.mechanism.parameters[:, offset] - taken.actual.parameters[:, offset]
    assert np.abs(errors / found.mechanism.deviations[:, offset]).max() < 4


def test_frames_are_found_wherever_the_device_stands(paper, plan):
    frames = Frames(base=(1.0, -0.5, 3.0), target=(0.05, 0.0, 0.17))
    made = simulated(paper, plan, Observed("pose", base=frames.base, target=frames.target))
    known = made.actual.replace(workspace=paper.workspace)
    found = symkin.identify(known, made.measurements, free=["base", "target"])
    for each, true in zip(found.unknowns[-6:], (*frames.base, *frames.target), strict=True):
        assert each.status == "free"
        assert abs(each.value - true) < 4 * each.deviation
    assert found.after.position_rms < 3e-4


def test_gauges_agree_on_everything_that_they_cannot_change(paper, plan):
    observe = Observed("pose", base=(1.0, -0.5, 3.0), target=(0.05, 0.0, 0.17))
    made = simulated(paper, plan, observe)
    nominal, datum = (
        symkin.identify(paper, made.measurements, frames=["base", "target"], gauge=gauge)
        for gauge in ("nominal", "datum")
    )
    assert datum.chi_square == pytest.approx(nominal.chi_square, rel=1e-9)
    assert datum.degrees_of_freedom == nominal.degrees_of_freedom
    np.testing.assert_allclose(datum.rows.residual, nominal.rows.residual, atol=1e-9)
    # Positions are those of the platform's origin, which a gauge of the target moves.
    assert datum.after.orientation_rms == pytest.approx(nominal.after.orientation_rms, rel=1e-6)
    assert "nearest to the drawing" in nominal.gauge
    assert "held as drawn" in datum.gauge
    assert sum(each.status == "held" for each in datum.unknowns) == 6


def test_what_no_observation_shows_is_said_of_every_number(paper, plan):
    found = symkin.identify(paper, simulated(paper, plan, "position").measurements)
    assert found.data_rank == len(found.names) - 1
    assert "platform_angle" in found.unseen[0]
    assert status(found, "leg1.platform_angle") == "shown by the data and priors together"
    assert status(found, "leg1.base_angle") == "free"
    assert "priors" in found.gauge
    assert found.gauge in " ".join(found.text(whole=True).lower().split())


def test_what_a_prior_alone_says_is_not_called_found(paper, plan):
    found = symkin.identify(
        paper,
        simulated(paper, plan, "position").measurements,
        prior={"leg1.platform_angle": 1e-6, "leg2.platform_angle": 1e-6},
    )
    assert status(found, "leg1.platform_angle") == "held by its prior: not shown by the data"
    assert any("platform_angle of legs 1, 2" in str(note) for note in found.notes)


def test_a_leg_that_nothing_was_read_of_is_no_sound_one_though_priors_hold_it(paper, taken):
    readings = np.array(taken.measurements.readings)
    readings[:, 2] = np.nan  # as of a column whose name is misspelt
    seen = dataclasses.replace(taken.measurements, readings=readings)
    found = symkin.identify(paper, seen, prior="tolerances")
    assert [(each.code, each.legs) for each in found.doubts] == [("leg-not-read", (2,))]
    assert not found.trustworthy
    assert found.page().verdict == "doubtful"
    held = symkin.identify(paper, seen, prior="tolerances", fixed=["leg3.*"])
    assert held.trustworthy  # since nobody asks for them


@pytest.mark.parametrize("options", [{"prior": "tolerances"}, {}])
def test_a_verdict_says_how_much_of_the_error_priors_leave(paper, plan, options):
    seen = simulated(paper, plan, "position").measurements
    found = symkin.identify(paper, seen, **options)
    assert found.trustworthy
    assert found.expected.held.orientation == pytest.approx(found.expected.orientation, rel=0.1)
    assert found.expected.held.position < 0.3 * found.expected.position
    words = found.page().judgement
    assert "of the expected orientation error of" in words
    assert "is what the priors leave" in words
    assert "position" not in words


def test_what_nothing_shows_and_no_prior_holds_is_refused_by_name(paper, plan):
    observe = Observed("position", target=(0.05, 0.0, 0.0))
    with pytest.raises(NotIdentifiableError, match=r"target\.phi"):
        symkin.identify(
            paper.replace(frames=Frames(target=(0.05, 0.0, 0.0))),
            simulated(paper, plan, observe).measurements,
            free=["target", "sensor_offset"],
        )


def test_a_mechanism_says_what_is_unknown_by_default(paper, taken):
    settings = IdentificationSettings(shared=("sensor_gain",), prior={"base_radius": "0.1 mm"})
    found = symkin.identify(paper.replace(identification=settings), taken.measurements)
    assert status(found, "leg1.sensor_gain") == "shared"
    assert found.options.prior == {"base_radius": "0.1 mm"}
    other = symkin.identify(
        paper.replace(identification=settings), taken.measurements, shared=["base_radius"]
    )
    assert status(other, "leg1.sensor_gain") == "free"


# What cannot be done is refused.


def test_estimators_that_look_at_one_leg_say_why_they_cannot(paper, taken, plan):
    with pytest.raises(SymkinError, match=r'"implicit".*expected "joint" here, since shared was'):
        symkin.identify(paper, taken.measurements, "implicit", shared=["sensor_gain"])
    partial = simulated(paper, plan, "position").measurements
    with pytest.raises(SymkinError, match="since row 2 has no measured phi"):
        symkin.identify(paper, partial, "paper")


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"gauge": "fixed"}, "gauge is 'fixed'; expected \"prior\""),
        ({"loss_per": "row"}, "loss_per is 'row'; expected \"pose\""),
        ({"noise": "guess"}, "noise is 'guess'; expected a NoiseSettings or \"estimate\""),
        ({"sensor": "cubic"}, "sensor is 'cubic'"),
    ],
)
def test_options_that_mean_nothing_are_refused(paper, taken, options, message):
    with pytest.raises(SymkinError, match=message):
        symkin.identify(paper, taken.measurements, **options)


# Verdicts.


def test_a_sound_robot_is_trusted(paper, taken):
    found = symkin.identify(paper, taken.measurements, gauge="nominal")
    assert found.trustworthy
    assert found.text().splitlines()[2].startswith("Converged; nothing")


@pytest.mark.parametrize(("factor", "code"), [(0.3, "residuals-large"), (3.0, "residuals-small")])
def test_a_wrong_noise_is_told(paper, taken, factor, code):
    declared = paper.noise
    wrong = NoiseSettings(factor * declared.position, factor * declared.orientation)
    found = symkin.identify(paper, taken.measurements, gauge="nominal", noise=wrong)
    assert not found.trustworthy
    assert code in [doubt.code for doubt in found.doubts]


def test_a_frame_that_nobody_mentioned_is_told(paper, plan):
    moved = Observed("pose", base=(0.02, -0.01, 0.03))
    made = simulated(paper, plan, moved)
    found = symkin.identify(paper, made.measurements, prior="tolerances")
    assert not found.trustworthy
    (doubt,) = found.doubts
    assert doubt.code == "frame-not-as-drawn"
    assert doubt.options == {"frames": ("base",)}


def test_a_curved_sensor_is_told_and_found(paper, taken):
    bent = taken.actual.replace(curvature=[[2e-3, 0, 0]] * 3)
    readings = bent.inverse_kinematics(taken.measurements.poses)
    measurements = dataclasses.replace(taken.measurements, readings=readings)
    straight = symkin.identify(paper, measurements, gauge="nominal")
    (doubt,) = (each for each in straight.doubts if each.code == "sensor-curved")
    assert doubt.options == {"sensor": "quadratic"}
    assert "at unseen poses from" in doubt.remedy
    curved = symkin.identify(paper, measurements, sensor="quadratic")
    found = [value(curved, f"leg{leg}.sensor_quadratic") for leg in (1, 2, 3)]
    np.testing.assert_allclose(found, 2e-3, atol=5e-4)
    assert "sensors that bend" in straight.text(whole=True)
    assert curved.residual_rms < straight.residual_rms


@pytest.mark.parametrize(("name", "column"), [("readings", 1), ("poses", 1), ("poses", 2)])
@pytest.mark.parametrize("off", [5e-3, -5e-3])
def test_an_observation_is_off_by_what_it_is_too_large_by(paper, taken, name, column, off):
    robot = paper.replace(noise=dataclasses.replace(paper.noise, reading=1e-5))
    values = np.array(getattr(taken.measurements, name))
    values[7, column] += off
    spoiled = dataclasses.replace(taken.measurements, **{name: values})
    found = symkin.identify(robot, spoiled, "joint", prior="tolerances")
    worst = found.outliers[0]
    assert (worst.row, worst.size) == (7, pytest.approx(off, abs=1e-3))
    rows, known = found.rows, np.isfinite(found.rows.t)
    assert np.sign(worst.student) == np.sign(off)
    np.testing.assert_array_equal(np.sign(rows.blunder[known]), np.sign(rows.t[known]))
    np.testing.assert_array_equal(np.sign(rows.residual[known]), np.sign(rows.t[known]))


def test_a_blunder_is_named_with_its_reading_leg_and_size(paper, taken):
    readings = np.array(taken.measurements.readings)
    readings[7, 1] += 5e-3
    spoiled = dataclasses.replace(taken.measurements, readings=readings)
    found = symkin.identify(paper, spoiled, gauge="nominal")
    row = taken.measurements.row_numbers[7]
    doubt = found.doubts[0] if found.doubts[0].rows else found.doubts[1]
    assert (doubt.code, doubt.legs, doubt.rows) == ("rows-unlike", (1,), (row,))
    assert doubt.size == pytest.approx(5e-3, abs=1e-3)
    assert blunders_of(found)[0].size == doubt.size
    without = symkin.identify(paper, spoiled, loss_per="reading")
    assert (7, "reading of leg 2") in without.rejected
    assert without.trustworthy


def test_parameters_held_at_wrong_values_are_told(paper, taken):
    offset = paper.parameter_names.index("sensor_offset")
    wrong = paper.parameters.copy()
    wrong[:, offset] += 0.02
    found = symkin.identify(
        paper.with_parameters(wrong), taken.measurements, fixed=["sensor_offset"]
    )
    # The base frame turned by as much does nearly the same, and not as well.
    (told,) = found.doubts
    assert (told.code, told.legs, told.others) == ("drawn-wrong", (0, 1, 2), ())
    assert told.size == pytest.approx(-0.02, rel=0.02)
    assert found.redrawn is not None
    assert symkin.identify(found.redrawn, taken.measurements, fixed=["sensor_offset"]).trustworthy


def test_parameters_that_the_data_hardly_show_are_told(paper, taken):
    random = np.random.default_rng(3)
    poses = 0.02 * random.uniform(-1, 1, (40, 3))
    readings = taken.actual.inverse_kinematics(poses)
    noisy = poses + paper.noise.position * random.standard_normal(poses.shape)
    found = symkin.identify(paper, symkin.Measurements.of(noisy, readings), gauge="nominal")
    assert "parameters-unknown" in [doubt.code for doubt in found.doubts]
    held = symkin.identify(paper, symkin.Measurements.of(noisy, readings), prior="tolerances")
    silent = [each for each in held.unknowns if each.status.startswith("held by its prior")]
    assert silent
    named = silent[0].name.partition(".")[2]
    assert any(f"{named} of leg" in str(note) for note in held.notes)


def test_as_many_unknowns_as_equations_are_not_trusted(paper, taken):
    few = taken.measurements.subset(np.arange(8))
    found = symkin.identify(paper, few, gauge="nominal")
    assert found.degrees_of_freedom == 0
    assert "nothing-to-spare" in [doubt.code for doubt in found.doubts]


def test_noise_is_estimated_with_the_unknowns(paper, plan):
    noise = NoiseSettings(2e-4, 1e-4, 3e-4)
    made = simulated(paper.replace(noise=noise), plan)
    wrong = paper.replace(noise=NoiseSettings(1e-4, 3e-4, 1e-4))
    found = symkin.identify(wrong, made.measurements, noise="estimate", gauge="nominal")
    for each in ("position", "orientation", "reading"):
        assert getattr(found.noise, each) == pytest.approx(getattr(noise, each), rel=0.6)
    assert found.chi_square / found.degrees_of_freedom == pytest.approx(1, abs=0.01)
    assert "noise-estimated" in [note.code for note in found.notes]


def test_noise_is_estimated_of_sensors_that_read_lengths_hardly_told_from_poses(hexapod):
    # Each iteration of the fixed point alone would take a thirtieth of what is left of the way.
    poses = symkin.sample_workspace(hexapod, 144, seed=4).poses
    plan = symkin.Plan(
        hexapod,
        np.full(144, -1),
        np.arange(144),
        np.zeros(144, dtype=bool),
        poses,
        hexapod.inverse_kinematics(poses),
    )
    made = simulated(hexapod, plan)
    estimates = []
    for start in (hexapod.noise, NoiseSettings(1e-3, 3e-4, 3e-3)):
        found = symkin.identify(
            hexapod.replace(noise=start), made.measurements, noise="estimate", gauge="nominal"
        )
        assert found.chi_square / found.degrees_of_freedom == pytest.approx(1, abs=0.01)
        estimates.append(list(found.noise.deviations.values()))
    assert estimates[0] == pytest.approx(estimates[1], rel=5e-3)
    assert estimates[0] == pytest.approx(list(hexapod.noise.deviations.values()), rel=0.5)


# What comes out of it.


def test_the_calibrated_file_reads_back_with_its_frames_and_sensors(paper, plan, tmp_path):
    observe = Observed("pose", base=(1.0, -0.5, 3.0), target=(0.05, 0.0, 0.17))
    made = simulated(paper, plan, observe)
    found = symkin.identify(paper, made.measurements, frames=["base", "target"], sensor="quadratic")
    report = found.write(tmp_path / "out")
    assert report.exists()
    assert {each.name for each in report.parent.iterdir()} == set(found.FILES)
    read = symkin.load_mechanism(tmp_path / "out" / "calibrated.toml")
    assert read == found.mechanism
    assert read.workspace == paper.workspace
    evaluated = symkin.evaluate(read, measurements=made.measurements)
    assert evaluated.position_rms == pytest.approx(found.after.position_rms)
    with pytest.raises(SymkinError, match="since the sensors are curved"):
        symkin.identify(read.replace(frames=None), made.measurements, "implicit")
    assert len(read.plan(20).poses) >= 20


def test_results_hold_what_the_page_says(paper, taken, tmp_path):
    found = symkin.identify(paper, taken.measurements, shared=["sensor_gain"])
    document = symkin.read_results(found.save(tmp_path / "results.json"))
    told = document["identification"]
    assert told["degrees_of_freedom"] == found.degrees_of_freedom
    assert told["params"]["leg1.proximal_length"]["value"] == found.unknowns[0].value
    assert document["settings"]["shared"] == ["sensor_gain"]
    text = found.text(whole=True)
    for each in found.unknowns:
        assert each.name.partition(".")[2] in text


def test_cross_validation_predicts_observations_in_their_own_units(paper, plan):
    made = simulated(paper, plan, "position")
    found = symkin.identify(paper, made.measurements).cross_validated(3)
    validation = found.cross_validation
    assert set(validation.observed_rms) == {"readings_rad", "pose_m"}
    assert 1e-4 < validation.observed_rms["pose_m"] < 3e-4
    assert "Readings from the others of the pose" in validation.text()
    same = symkin.cross_validate(paper, made.measurements, 3)
    assert same.observed_rms == validation.observed_rms


def test_a_curved_sensor_goes_there_and_back(paper):
    curved = paper.replace(curvature=[[1e-2, 2e-2, -1e-2]] * 3)
    poses = np.random.default_rng(1).uniform(-0.2, 0.2, (20, 3))
    readings = curved.inverse_kinematics(poses)
    assert np.abs(readings - paper.inverse_kinematics(poses)).max() > 1e-3
    back, converged = curved.forward_kinematics(readings)
    assert converged.all()
    np.testing.assert_allclose(back, poses, atol=1e-12)
    assert np.abs(curved.closure(1, poses, readings[:, 1])).max() < 1e-12


def test_straight_sensors_are_cross_validated_once_for_all_doubts_about_them(
    paper, taken, monkeypatch
):
    validated = []

    unseen_rms = models._unseen_rms

    def counted(nominal, measurements, options):
        validated.append(options.sensor)
        return unseen_rms(nominal, measurements, options)

    monkeypatch.setattr(models, "_unseen_rms", counted)
    readings = taken.measurements.readings
    bent = readings + 0.01 * readings**2 + 0.004 * np.cos(readings)
    found = symkin.identify(paper, dataclasses.replace(taken.measurements, readings=bent))
    asked = [doubt.remedy for doubt in found.doubts if "sensor" in doubt.options]
    assert len(asked) == 2
    assert len({words.partition("from ")[2].partition(" to ")[0] for words in asked}) == 1
    assert validated == ["linear", "quadratic", "eccentric"]


def test_the_hexapods_sensors_are_found_to_bend(hexapod, hexapod_table):
    measured = symkin.read_measurements(hexapod_table, hexapod)
    noise = NoiseSettings(3e-4, 1e-3, 1e-4 / abs(hexapod.sensor_gains[0]))
    straight = symkin.identify(hexapod, measured, gauge="nominal", noise=noise)
    (doubt,) = (each for each in straight.doubts if "sensor" in each.options)
    assert "F(6, 594) = 86" in doubt.cause
    assert doubt.options == {"sensor": "quadratic"}
    curved = symkin.identify(hexapod, measured, sensor="quadratic", gauge="nominal", noise=noise)
    validation = curved.cross_validated(5).cross_validation
    assert validation.evaluation.position_rms < 0.75e-3
    assert validation.residual_rms < 0.4e-3


def test_a_pose_that_noise_explains_but_that_nothing_can_be_linearised_at_is_no_doubt(paper):
    """Of row 24 leg 3 was not read; the others hardly show the angle there."""
    sample = symkin.sample_workspace(paper, 3000, seed=1)
    plan = symkin.make_plan(paper, sample, 20, visit="sets")
    observe = Observed("position", missing=0.2)
    taken = symkin.simulate(paper, plan, 1022, observe=observe).measurements.for_all_legs()
    sound = symkin.identify(paper, taken, prior="tolerances")
    assert sound.aside == (22,)
    assert sound.trustworthy

    poses = np.array(taken.poses)
    poses[22, 1] += 2e-3
    wrong = symkin.identify(paper, dataclasses.replace(taken, poses=poses), prior="tolerances")
    assert ("rows-without-pose", (24,)) in [(each.code, each.rows) for each in wrong.doubts]


def test_a_rotation_alone_counts_as_three_and_is_left_out_as_a_whole():
    robot = symkin.load_mechanism("agile_eye")
    plan = symkin.make_plan(robot, symkin.sample_workspace(robot, 500, seed=1), 12)
    taken = symkin.simulate(robot, plan, 1).measurements.for_all_legs()
    assert (observed_count(taken) == 3 + len(robot.legs)).all()
    poses = np.array(taken.poses)
    poses[4] += [5e-3, 0, 0, 0]
    poses[4] /= np.linalg.norm(poses[4])
    spoiled = dataclasses.replace(taken, poses=poses)
    found = symkin.identify(robot, spoiled, loss_per="reading", prior="tolerances")
    assert {row for row, _ in found.rejected} == {4}
    assert found.trustworthy


# Which leg is which.


def exchanged(measurements, order):
    return dataclasses.replace(measurements, readings=measurements.readings[:, order])


@pytest.mark.parametrize(
    ("name", "observe", "frames", "orders"),
    [
        ("3RRR", Observed("pose", base=(1.0, -0.5, 3.0)), ["base", "target"], "2, 3, 1"),
        ("3RRR", "position", [], ""),
        ("3RRR_asymmetric", Observed("pose", base=(1.0, -0.5, 3.0)), ["base", "target"], ""),
        ("linear_delta", "height", ["plane"], "2, 3, 1 or 1, 3, 2"),
    ],
)
def test_legs_that_the_observations_do_not_tell_apart_are_named(name, observe, frames, orders):
    mechanism = symkin.load_mechanism(name)
    sample = symkin.sample_workspace(mechanism, 3000, seed=1)
    plan = symkin.make_plan(mechanism, sample, 40, design="mechanism", seed=1)
    measured = symkin.simulate(mechanism, plan, seed=2, observe=observe).measurements
    given = {"frames": frames, "prior": "tolerances"}
    found = symkin.identify(mechanism, measured, estimator="joint", **given)
    said = [str(note) for note in found.notes if note.code == "legs-interchangeable"]
    assert len(said) == bool(orders)
    if not orders:
        return
    assert f"in the order {orders} the" in said[0]
    # Indeed so: nothing else in the result shows that they were exchanged.
    other = symkin.identify(mechanism, exchanged(measured, [1, 2, 0]), estimator="joint", **given)
    assert other.converged
    assert not other.doubts
    assert other.chi_square == pytest.approx(found.chi_square, abs=1)
    assert "legs-interchangeable" in [note.code for note in other.notes]
