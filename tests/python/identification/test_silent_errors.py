# SPDX-License-Identifier: MIT
"""Mistakes that people make when they measure are refused or doubted, with the likely cause."""

from __future__ import annotations

import math
import re
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import pytest

import symkin
from symkin.errors import NotIdentifiableError
from symkin.estimate.evidence import scatter
from symkin.estimate.evidence.residuals import doubts_of_residuals
from symkin.estimate.precision import directions_of
from symkin.model.settings import Tolerances
from symkin.planning.simulation import disturb

DECLARED = Path(__file__).parents[3] / "mechanisms" / "declared"

Change = Callable[[symkin.Mechanism, symkin.Measurements], symkin.Measurements]


@dataclass(frozen=True)
class SilentError:
    """A mistake, and codes of which a doubt must have one; or a word of the refusal.

    `where` says for which mechanisms it is a mistake at all.
    """

    name: str
    change: Change
    codes: tuple[str, ...]
    where: Callable[[symkin.Mechanism], bool] = lambda _: True


def turning(mechanism: symkin.Mechanism) -> bool:
    """Whether the active joints are angles."""
    return symkin.chain_info(mechanism.chain, mechanism.platform).reading_unit == "rad"


def has_modes(mechanism: symkin.Mechanism) -> bool:
    return not np.array_equal(
        mechanism.inverse_kinematics(mechanism.home),
        other_modes(mechanism, range(len(mechanism.legs))).inverse_kinematics(mechanism.home),
    )


def turns(mechanism: symkin.Mechanism) -> bool:
    """Whether the platform does."""
    return mechanism.pose_space != "point"


def other_modes(mechanism, legs):
    """The mechanism with other working modes."""
    changed = [
        replace(leg, working_mode=-leg.working_mode) if number in legs else leg
        for number, leg in enumerate(mechanism.legs)
    ]
    return mechanism.replace(legs=changed, symmetry=None)


def size_of(mechanism):
    """Of its workspace, m."""
    position = {"planar": 2, "point": 2, "spatial": 3}[mechanism.pose_space]
    return float(
        np.abs(mechanism.parameters).max()
        if mechanism.workspace is None
        else np.max(np.subtract(mechanism.workspace.upper, mechanism.workspace.lower)[:position])
    )


def with_readings(change):
    """A change of the readings alone."""

    def changed(mechanism, measured):
        return replace(measured, readings=change(mechanism, measured.readings.copy()))

    return changed


def with_poses(change):
    """A change of the poses alone."""

    def changed(mechanism, measured):
        return replace(measured, poses=change(mechanism, measured.poses.copy()))

    return changed


def column(leg, change):
    """A change of one leg's readings."""

    def changed(mechanism, readings):
        readings[:, leg] = change(mechanism, readings[:, leg])
        return readings

    return with_readings(changed)


def swap(_, readings):
    return readings[:, [1, 0, *range(2, readings.shape[1])]]


def shift(share):
    """By a share of the size; further than the tolerances could explain."""

    def changed(mechanism, poses):
        poses[:, 0] += max(share * size_of(mechanism), 10 * mechanism.tolerances.length)
        return poses

    return changed


def turn(least):
    """The poses in a base frame turned about Z; further than the tolerances could explain."""

    def changed(mechanism, poses):
        angle = max(least, 10 * mechanism.tolerances.angle)
        c, s = math.cos(angle), math.sin(angle)
        poses[:, :2] = poses[:, :2] @ np.array([[c, s], [-s, c]])
        if mechanism.pose_space == "planar":
            poses[:, 2] += angle
        elif mechanism.pose_space == "spatial":
            x, y, z, w = poses[:, 3:].T.copy()
            ch, sh = math.cos(angle / 2), math.sin(angle / 2)
            poses[:, 3:] = np.column_stack(
                [ch * x - sh * y, ch * y + sh * x, ch * z + sh * w, ch * w - sh * z]
            )
        return poses

    return changed


def scale_positions(least):
    """By a factor; more than the tolerance of a gain could explain."""

    def changed(mechanism, poses):
        factor = max(least, 1 + 5 * mechanism.tolerances.gain)
        position = 3 if mechanism.pose_space == "spatial" else 2
        poses[:, :position] *= factor
        return poses

    return changed


def mirror_y(mechanism, poses):
    signs = {
        "planar": (1, -1, -1),
        "point": (1, -1),
        "spatial": (1, -1, 1, -1, 1, -1, 1),
    }[mechanism.pose_space]
    return poses * np.array(signs, dtype=float)


def outliers(share):
    def changed(mechanism, measured):
        rng = np.random.default_rng(5)
        poses = measured.poses.copy()
        count = max(1, round(share * len(poses)))
        rows = rng.permutation(len(poses))[:count]
        poses[rows, 0] += 100 * mechanism.noise.position * rng.choice([-1, 1], count)
        return replace(measured, poses=poses)

    return changed


def first(extra):
    """As many poses as a leg has parameters, and `extra`."""

    def changed(mechanism, measured):
        count = len(mechanism.parameter_names) + extra
        rows = np.linspace(0, len(measured.poses) - 1, count).astype(int)
        return measured.subset(rows)

    return changed


def planned(mechanism, measured):
    """Nominal readings at commanded poses, as a plan has them."""
    readings = mechanism.inverse_kinematics(measured.poses)
    return replace(measured, readings=readings)


def flipped(legs):
    """The robot stands in other working modes than its file says."""

    def changed(mechanism, measured):
        which = range(len(mechanism.legs)) if legs is None else legs
        robot = other_modes(mechanism, which)
        rng = np.random.default_rng(3)
        made = disturb(robot, 3)
        exact = made.inverse_kinematics(measured.poses)
        poses = measured.poses.copy()
        poses[:, :2] += mechanism.noise.position * rng.standard_normal((len(poses), 2))
        kept = np.isfinite(exact).all(axis=1)
        return replace(
            symkin.Measurements.of(poses[kept], exact[kept]),
        )

    return changed


def alike(mechanism, measured):
    rng = np.random.default_rng(4)
    home = mechanism.home
    noise = mechanism.noise.position * rng.standard_normal((len(measured.poses), len(home)))
    if mechanism.pose_space == "spatial":
        noise[:, 3:] = 0
    poses = measured.poses[:1] + noise
    return replace(
        measured,
        poses=poses,
        readings=np.tile(measured.readings[:1], (len(poses), 1)),
    )


def quantised(mechanism, readings):
    step = np.ptp(readings) / 256 if not turning(mechanism) else 2 * math.pi / 256
    return np.round(readings / step) * step


def copied(_, measured):
    rows = np.repeat(np.arange(len(measured.poses) // 3), 3)
    poses = measured.poses[rows]
    poses[:, 0] += 1e-12 * np.arange(len(rows))
    return replace(measured.subset(rows), poses=poses)


def add_turn_to_some(_, readings):
    readings[::7, 0] += 2 * math.pi
    return readings


MOVED = ("moved-together", "frame-not-as-drawn", "parameters-far", "far-from-drawing")
SILENT_ERRORS = [
    SilentError("all legs in the other working mode", flipped(None), ("working-mode",), has_modes),
    SilentError("one leg in the other working mode", flipped([0]), ("working-mode",), has_modes),
    SilentError("a plan given as measurements", planned, ("residuals-small",)),
    SilentError("two legs swapped", with_readings(swap), ("columns-exchanged",)),
    SilentError("one sign flipped", column(0, lambda _, r: -r), ("opposite-sign",)),
    SilentError("all signs flipped", with_readings(lambda _, r: -r), ("opposite-sign",)),
    SilentError(
        "half a turn added to one leg",
        column(1, lambda _, r: r + math.pi),
        ("zero-half-a-turn-off",),
        turning,
    ),
    SilentError(
        "a turn added to one leg",
        column(1, lambda _, r: r + 2 * math.pi),
        ("turns-away",),
        turning,
    ),
    SilentError(
        "a turn added to some readings", with_readings(add_turn_to_some), ("turns-lost",), turning
    ),
    SilentError("one gain 20% off", column(0, lambda _, r: 1.2 * r), ("gain",)),
    SilentError("the frame turned by 2 degrees", with_poses(turn(math.radians(2))), MOVED),
    SilentError("the frame turned by 30 degrees", with_poses(turn(math.radians(30))), MOVED),
    SilentError("the frame shifted by 1%", with_poses(shift(0.01)), MOVED),
    SilentError("a length scale 1% off", with_poses(scale_positions(1.01)), MOVED),
    SilentError(
        "one leg in degrees",
        column(0, lambda _, r: np.degrees(r)),
        ("unit-of-readings",),
        lambda m: m.reading_unit == "rad",
    ),
    SilentError(
        "all readings in degrees",
        with_readings(lambda _, r: np.degrees(r)),
        ("unit-of-readings",),
        lambda m: m.reading_unit == "rad",
    ),
    SilentError(
        "one leg in millimetres",
        column(0, lambda _, r: 1e3 * r),
        ("unit-of-readings",),
        lambda m: m.reading_unit == "m",
    ),
    SilentError(
        "positions in millimetres",
        with_poses(scale_positions(1e3)),
        ("unit-of-lengths", "moved-together"),
    ),
    SilentError("y mirrored", with_poses(mirror_y), ("convention-of-poses", "working-mode")),
    SilentError("one outlier", outliers(0), ("gross-errors", "rows-unlike")),
    SilentError("20% outliers", outliers(0.2), ("gross-errors", "few-far-off", "rows-unlike")),
    SilentError("one pose too few", first(-1), ("need",)),
    SilentError("no pose to spare", first(0), ("nothing-to-spare", "little-to-spare")),
    SilentError("one pose to spare", first(1), ("little-to-spare",)),
    SilentError("poses alike", alike, ("parameters-alike", "parameters-unknown", "show")),
    SilentError("a constant leg", column(0, lambda _, r: np.full_like(r, r[0])), ("stands-still",)),
    SilentError("8-bit readings", with_readings(quantised), ("readings-coarse", "residuals-large")),
    SilentError("copies of poses", copied, ("rows-copied",)),
]


MECHANISMS = ("3RRR", "5bar", "3PRR", "hexapod_jugglebot")


@pytest.fixture(scope="module")
def measured():
    """For each mechanism a sound robot's measurements, all poses for all legs."""
    made = {}
    for name in MECHANISMS:
        mechanism = symkin.load_mechanism(name)
        sample = symkin.sample_workspace(mechanism, 3000, 1)
        plan = symkin.make_plan(mechanism, sample, seed=1, visit="sets")
        taken = symkin.simulate(mechanism, plan, 7).measurements
        made[name] = mechanism, symkin.Measurements.of(taken.poses, taken.readings)
    return made


def doubts_of(mechanism, measurements, estimator=None, **options):
    """What is said: doubts, or the refusal with its likely cause; never nothing."""
    try:
        found = symkin.identify(mechanism, measurements, estimator, **options)
    except symkin.SymkinError as error:
        return [error.likely_cause or error]
    assert not found.trustworthy
    return list(found.doubts)


def codes_of(said):
    """Of doubts; of a refusal without a likely cause its words."""
    return [getattr(each, "code", str(each)) for each in said]


@pytest.mark.parametrize("name", MECHANISMS)
@pytest.mark.parametrize("estimator", ["paper", "inverse", "implicit", "joint"])
def test_sound_measurements_raise_no_doubt(measured, name, estimator):
    found = symkin.identify(*measured[name], estimator)
    assert found.converged
    assert found.doubts == ()


@pytest.mark.parametrize(
    ("error", "name"),
    [
        pytest.param(error, name, id=f"{error.name}-{name}")
        for error in SILENT_ERRORS
        for name in MECHANISMS
        if error.where(symkin.load_mechanism(name))
    ],
)
def test_a_mistake_is_refused_or_doubted_with_its_likely_cause(measured, name, error):
    mechanism, sound = measured[name]
    said = codes_of(doubts_of(mechanism, error.change(mechanism, sound), "implicit"))
    assert any(code in each for code in error.codes for each in said), said


WAYS = {
    "paper": {"estimator": "paper"},
    "inverse": {"estimator": "inverse"},
    "joint": {"estimator": "joint"},
    "prior": {"prior": "tolerances"},
    "fixed": {"fixed": ["leg1.distal_length"]},
    "shared": {"shared": ["distal_length"]},
    "frames": {"frames": ["base", "target"]},
    "curved": {"sensor": "quadratic"},
    "positions": {},
    "changing": {"drift": ["leg"], "growth": True, "prior": "tolerances"},
}
FEW = {"one pose too few", "no pose to spare", "one pose to spare", "poses alike"}
FRAMES = {
    "the frame turned by 2 degrees",
    "the frame turned by 30 degrees",
    "the frame shifted by 1%",
}
# What is unknown cannot be mistaken; few poses are enough for what is known, or say nothing of a
# turned frame.
EXPLAINED = {
    "prior": FEW,
    "fixed": FEW,
    "shared": FEW,
    "curved": FEW,
    "positions": FEW,
    "changing": FEW,
    "frames": FEW | FRAMES,
}


@pytest.mark.parametrize(
    ("error", "way"),
    [
        pytest.param(error, way, id=f"{error.name}-{way}")
        for error in SILENT_ERRORS
        for way in WAYS
        if error.where(symkin.load_mechanism("3RRR")) and error.name not in EXPLAINED.get(way, ())
    ],
)
def test_no_way_of_asking_trusts_a_mistake(measured, way, error):
    mechanism, sound = measured["3RRR"]
    taken = error.change(mechanism, sound)
    if way == "positions":
        taken = replace(taken, poses=taken.poses * [1, 1, np.nan])
    assert doubts_of(mechanism, taken, **WAYS[way])


@pytest.mark.parametrize("way", WAYS)
def test_no_way_of_asking_doubts_sound_measurements(measured, way):
    mechanism, sound = measured["3RRR"]
    if way == "positions":
        sound = replace(sound, poses=sound.poses * [1, 1, np.nan])
    assert symkin.identify(mechanism, sound, **WAYS[way]).doubts == ()


@pytest.mark.parametrize(
    "changes",
    [
        {"drift": ["leg"]},
        {"drift": ["frame"], "frames": ["base"]},
        {"step": [40], "growth": True},
        {"backlash": True, "sensor": "quadratic"},
    ],
    ids=str,
)
def test_a_cause_is_named_although_the_robot_changes_while_it_is_measured(measured, changes):
    mechanism, sound = measured["3RRR"]
    taken = replace(sound, readings=sound.readings[:, [1, 0, 2]])
    (doubt,) = doubts_of(mechanism, taken, prior="tolerances", **changes)
    assert (doubt.code, doubt.legs) == ("columns-exchanged", (0, 1))


def test_of_sound_poses_that_show_too_little_no_mistake_is_named():
    """Angles that are nothing but noise would be less of it in another unit."""
    mechanism = symkin.load_mechanism("3RRR")
    sound = mechanism.simulate(mechanism.plan(30), 1).measurements
    with pytest.raises(NotIdentifiableError) as refused:
        symkin.identify(mechanism, alike(mechanism, sound))
    assert getattr(refused.value, "likely_cause", None) is None


@pytest.mark.parametrize("mistake", ["two legs swapped", "one sign flipped", "one gain 20% off"])
def test_a_mistake_is_named_where_more_legs_than_freedoms_are_read_exactly(mistake):
    """No pose takes all of their readings to the last digit."""
    mechanism = symkin.load_mechanism("4RRR")
    assert mechanism.noise.reading == 0
    sound = mechanism.simulate(mechanism.plan(30), 1).measurements
    (error,) = (each for each in SILENT_ERRORS if each.name == mistake)
    (said,) = codes_of(doubts_of(mechanism, error.change(mechanism, sound)))
    assert said in error.codes


@pytest.mark.parametrize("way", WAYS)
def test_rows_that_stand_there_twice_are_named_and_nothing_else(measured, way):
    """They would be taken for sensors that run out of true, among other things."""
    mechanism, sound = measured["3RRR"]
    half = len(sound.poses) // 2
    taken = sound.subset(np.tile(2 * np.arange(half), 2))
    if way == "positions":
        taken = replace(taken, poses=taken.poses * [1, 1, np.nan])
    (doubt,) = doubts_of(mechanism, taken, **WAYS[way])
    assert doubt.code == "rows-copied"
    assert len(doubt.rows) == half


@pytest.mark.parametrize("seed", [0, 1, 2])
def test_of_one_gross_error_no_sound_row_is_named(seed):
    robot = symkin.load_mechanism("linear_delta")
    plan = symkin.make_plan(robot, symkin.sample_workspace(robot, 1000, seed=1), 20)
    taken = symkin.simulate(robot, plan, seed).measurements.for_all_legs()
    poses = np.array(taken.poses)
    poses[7, 0] += 5e-3
    found = symkin.identify(robot, replace(taken, poses=poses))
    assert found.doubts[0].code == "gross-errors"
    assert found.doubts[0].rows == (taken.row_numbers[7],)


@pytest.mark.parametrize("estimator", ["paper", "inverse", "implicit"])
@pytest.mark.parametrize(
    ("name", "code", "legs"),
    [
        ("two legs swapped", "columns-exchanged", (0, 1)),
        ("one leg in the other working mode", "working-mode", (0,)),
        ("one gain 20% off", "gain", (0,)),
        ("the frame turned by 30 degrees", "frame-not-as-drawn", ()),
    ],
)
def test_a_correction_is_the_cause_that_every_estimator_names(
    measured, estimator, name, code, legs
):
    mechanism, sound = measured["3RRR"]
    (error,) = (each for each in SILENT_ERRORS if each.name == name)
    first, *beside = doubts_of(mechanism, error.change(mechanism, sound), estimator)
    assert (first.code, first.legs, first.others) == (code, legs, ())
    assert first.is_cause
    assert not beside
    if code == "gain":
        assert first.size == pytest.approx(1.2, rel=1e-2)
    if code == "frame-not-as-drawn":
        assert first.figures["angle"] == pytest.approx(30, abs=0.5)
        assert first.options == {"frames": ("base",)}


def test_a_guide_set_to_zero_elsewhere_is_not_taken_for_another_mode(measured):
    mechanism, sound = measured["3PRR"]
    taken = column(0, lambda _, r: r + 0.3)(mechanism, sound)
    first = doubts_of(mechanism, taken, "implicit")[0]
    assert (first.code, first.legs) == ("zero", (0,))
    assert first.size == pytest.approx(0.3, abs=0.05)


def test_a_leg_in_another_mode_is_a_cause_for_all_legs_at_once_too(measured):
    mechanism, sound = measured["3RRR"]
    first = doubts_of(mechanism, flipped([0])(mechanism, sound), "joint")[0]
    assert (first.code, first.legs) == ("working-mode", (0,))
    assert "leg 1 stands in working mode +1: set working_mode = 1" in str(first)


def test_a_gain_of_the_opposite_sign_is_named_with_its_sign(measured):
    mechanism, sound = measured["hexapod_jugglebot"]
    taken = column(0, lambda _, r: -1.2 * r)(mechanism, sound)
    first = doubts_of(mechanism, taken, "implicit")[0]
    assert (first.code, first.legs) == ("gain", (0,))
    assert first.size == pytest.approx(-1.2, rel=2e-2)


def test_a_shift_of_the_columns_is_named_with_the_frame_that_would_do_the_same(measured):
    mechanism, sound = measured["3RRR"]
    taken = replace(sound, readings=np.roll(sound.readings, 1, axis=1))
    first = doubts_of(mechanism, taken, "implicit")[0]
    causes = {each.code: each for each in (first, *first.others)}
    assert causes.keys() == {"columns-exchanged", "frame-not-as-drawn"}
    assert causes["frame-not-as-drawn"].figures["angle"] == pytest.approx(120, abs=0.5)


def test_legs_whose_sets_of_poses_are_apart_are_corrected_together(measured):
    mechanism, sound = measured["3RRR"]
    readings = np.array(sound.readings)
    readings[:, [0, 1]] = readings[:, [1, 0]]
    sets = np.arange(len(readings)) % 3
    readings[np.arange(3) != sets[:, None]] = np.nan
    taken = symkin.Measurements.of(sound.poses, readings, sets)
    for change in (lambda r: r, lambda r: r * [1, 1, -1]):
        first = doubts_of(mechanism, replace(taken, readings=change(readings)), "implicit")[0]
        assert (first.code, first.legs) == ("columns-exchanged", (0, 1))
    assert [(each.code, each.legs) for each in first.then] == [("opposite-sign", (2,))]


def test_a_robot_that_shrinks_until_nothing_matters_explains_no_part_of_nonsense():
    """Its tolerances bound what a wrong unit of the lengths leaves of whatever was read."""
    robot = symkin.load_mechanism("5bar")
    plan = symkin.make_plan(robot, symkin.sample_workspace(robot, 3000, seed=1), seed=1)
    taken = symkin.simulate(robot, plan, 100).measurements.for_all_legs()
    shuffled = column(0, lambda _, r: np.random.default_rng(0).permutation(r))(robot, taken)
    assert not any(doubt.is_cause for doubt in doubts_of(robot, shuffled, "implicit"))


def test_what_a_robust_loss_rejects_is_not_held_against_a_correction(measured):
    for name in ("3RRR", "hexapod_jugglebot"):
        mechanism, sound = measured[name]
        spoilt = outliers(0)(mechanism, sound)
        taken = column(1, lambda _, r: -r)(mechanism, spoilt)
        found = symkin.identify(mechanism, taken, "implicit", loss="cauchy")
        assert (found.doubts[0].code, found.doubts[0].legs) == ("opposite-sign", (1,))


def test_gross_errors_do_not_hide_a_mistake_that_the_rest_of_the_poses_shows(measured):
    """Without the spoilt pose a gain of the opposite sign explains everything."""
    mechanism, sound = measured["hexapod_jugglebot"]
    taken = column(1, lambda _, r: -r)(mechanism, outliers(0)(mechanism, sound))
    first = doubts_of(mechanism, taken, "implicit")[0]
    assert (first.code, first.legs) == ("opposite-sign", (1,))


def test_an_estimator_that_fails_on_a_robot_far_from_its_drawing_is_no_evidence_of_a_mistake():
    """Sound readings; those of leg 1 grow 0.88 times as fast as the drawing's, which is far off."""
    drawing = symkin.load_mechanism("3RRR")
    far = drawing.replace(tolerances=Tolerances(length=0.03, angle=0.03, gain=0.03))
    plan = symkin.make_plan(drawing, symkin.sample_workspace(drawing, 3000, 1), seed=1)
    taken = symkin.simulate(far, plan, 1).measurements.for_all_legs()
    found = symkin.identify(drawing, taken, "inverse")
    assert not found.converged
    assert found.doubts
    assert not any(doubt.is_cause for doubt in found.doubts)


def test_a_correction_that_leaves_more_than_noise_is_a_part_of_what_is_wrong(measured):
    mechanism, sound = measured["3RRR"]
    noise = 2e-4 * np.random.default_rng(1).standard_normal(sound.poses.shape)
    taken = replace(sound, readings=sound.readings * [1, -1, 1], poses=sound.poses + noise)
    for estimator in ("inverse", "implicit", "joint"):
        first = doubts_of(mechanism, taken, estimator)[0]
        assert (first.code, first.legs) == ("opposite-sign", (1,))
        assert str(first).startswith("part of what is wrong may be: ")


def test_a_correction_that_converges_to_no_good_end_is_no_cause():
    """Of legs in the other working mode the signs, reversed, have a fit; it explains nothing."""
    robot = symkin.load_mechanism("5bar")
    plan = symkin.make_plan(robot, symkin.sample_workspace(robot, 3000, seed=1), seed=1)
    taken = symkin.simulate(robot, plan, 100).measurements.for_all_legs()
    said = codes_of(doubts_of(robot, flipped(None)(robot, taken), "inverse"))
    assert {"working-mode", "other-working-mode"} & set(said)
    assert "opposite-sign" not in said


def test_a_bent_sensor_is_told_with_what_helps_and_by_how_much():
    robot = symkin.load_mechanism("3RRR")
    plan = symkin.make_plan(robot, symkin.sample_workspace(robot, 1000, seed=1), 20)
    simulated = symkin.simulate(robot, plan, 1)
    bent = simulated.actual.replace(curvature=[[2e-3, 0, 0]] * 3)
    taken = simulated.measurements.for_all_legs()
    readings = bent.inverse_kinematics(taken.poses)
    for estimator in ("implicit", "joint"):
        found = symkin.identify(robot, replace(taken, readings=readings), estimator)
        doubt = next(each for each in found.doubts if each.options == {"sensor": "quadratic"})
        assert doubt.code == "sensor-curved"
        told = re.search(r"closures at unseen poses from (\S+) to (\S+) mm", str(doubt))
        assert float(told[1]) > 2 * float(told[2])
    harmful = doubts_of_residuals(found, found.tests, lambda _: None)
    doubt = next(each for each in harmful if each.code == "sensor-curved")
    assert not doubt.options
    assert not doubt.remedy
    assert "predicts poses that the fit did not see worse" in doubt.cause


def at_random(robot, seed, actual=None):
    """Measured at 40 poses that nobody planned."""
    sample = symkin.sample_workspace(robot, 1000, seed=1).poses
    poses = sample[np.random.default_rng(seed).permutation(len(sample))[:40]]
    readings, everywhere = robot.inverse_kinematics(poses), np.full(40, -1)
    none = np.zeros(40, dtype=bool)
    plan = symkin.Plan(robot, everywhere, np.arange(40), none, poses, readings)
    return symkin.simulate(robot, plan, seed, actual).measurements


@pytest.mark.parametrize(
    "changes", [{}, {"drift": ["frame"]}, {"backlash": True}, {"sensor": "quadratic"}], ids=str
)
def test_poses_that_nobody_planned_are_no_reason_for_doubt(changes):
    """They say nothing of some parameters, which the end effector does not need."""
    robot = symkin.load_mechanism("rotary_delta")
    for seed in range(1, 6):
        found = symkin.identify(robot, at_random(robot, seed), **changes)
        assert found.trustworthy
        notes = {note.code for note in found.notes}
        assert changes or {"parameters-weak", "parameters-unneeded"} & notes


def test_poses_that_hardly_tell_parameters_apart_do_with_tolerances_as_priors():
    """Between circles of unlike radii a base's height is almost the offset of the sensors."""
    robot = symkin.load_mechanism("3RPS")
    parameters = robot.parameters.copy()
    parameters[:, robot.parameter_names.index("platform_radius")] = 0.44
    robot = robot.with_parameters(parameters)
    taken = at_random(robot, 2).for_all_legs()
    (told, *_) = symkin.identify(robot, taken).doubts
    assert told.code == "parameters-alike"
    assert symkin.identify(robot, taken, **told.options).trustworthy


def test_noise_estimated_from_rows_that_do_not_belong_together_is_no_excuse_for_them():
    """Estimated as a fifth of a metre, it leaves a robot that is as likely as the drawing."""
    robot = symkin.load_mechanism("rotary_delta")
    taken = at_random(robot, 0).for_all_legs()
    assert symkin.identify(robot, taken, noise="estimate").trustworthy
    random = np.random.default_rng(0)
    mixed = replace(taken, readings=random.permuted(taken.readings, axis=0))
    assert "noise-hides-robot" in codes_of(doubts_of(robot, mixed, noise="estimate"))


def test_readings_in_steps_are_told_where_few_of_them_are_alike():
    robot = symkin.load_mechanism("3RRR")
    taken = symkin.simulate(robot, robot.plan(40), 1).measurements.for_all_legs()
    step = np.ptp(taken.readings, axis=0) / 64
    coarse = replace(taken, readings=np.round(taken.readings / step) * step)
    for sensor in ("linear", "quadratic"):
        doubts = symkin.identify(robot, coarse, sensor=sensor).doubts
        told = {each.code: each for each in doubts}["readings-coarse"]
        assert told.size == pytest.approx(step.min())
    # Decimals of a file are finer than the noise, whatever else is wrong.
    shaken = taken.readings + 1e-3 * np.random.default_rng(1).standard_normal(taken.readings.shape)
    doubts = symkin.identify(robot, replace(taken, readings=np.round(shaken, 4))).doubts
    assert "residuals-large" in {each.code for each in doubts}
    assert "readings-coarse" not in {each.code for each in doubts}


@pytest.mark.parametrize(
    ("options", "rate"),
    [
        ({"fixed": ["sensor_gain"]}, 2),
        ({"shared": ["sensor_gain"]}, 2),
        ({"frames": ["base", "target"]}, 1.02),
    ],
)
def test_a_gain_is_named_that_was_held_or_that_frames_let_look_like_a_curved_sensor(options, rate):
    robot = symkin.load_mechanism("3RRR")
    taken = symkin.simulate(robot, robot.plan(30), 1, actual=robot).measurements.for_all_legs()
    readings = taken.readings * np.array([rate, 1.0, 1.0])
    (told, *_) = symkin.identify(robot, replace(taken, readings=readings), **options).doubts
    assert (told.code, told.legs, told.others) == ("gain", (0,), ())
    assert told.size == pytest.approx(rate, rel=1e-2)


def test_a_metre_that_is_too_long_is_told_where_gains_that_are_held_explain_it_as_well():
    robot = symkin.load_mechanism("3RPS")
    taken = symkin.simulate(robot, robot.plan(40), 1, actual=robot).measurements.for_all_legs()
    poses = np.array(taken.poses)
    poses[:, :3] *= 1.002
    (told,) = symkin.identify(robot, replace(taken, poses=poses), fixed=["sensor_gain"]).doubts
    assert told.is_cause
    said = {each.code: each for each in (told, *told.others)}
    assert said.keys() <= {"moved-together", "held-is-wrong"}
    assert said["moved-together"].size == pytest.approx(2e-3, rel=0.1)
    assert "too large against the drawing's lengths" in str(told)


def test_a_curved_sensor_is_told_where_gains_that_are_held_explain_it_as_well():
    robot = symkin.load_mechanism("rotary_delta")
    for seed in (2, 3):
        taken = at_random(robot, seed).for_all_legs()
        shares = (taken.readings - taken.readings.min(axis=0)) / np.ptp(taken.readings, axis=0)
        bent = replace(taken, readings=taken.readings + 1e-3 * shares**2)
        (told,) = symkin.identify(robot, bent, fixed=["sensor_gain"]).doubts
        assert told.is_cause
        assert {"sensor-curved", "sensor-eccentric"} <= {each.code for each in (told, *told.others)}


@pytest.mark.parametrize(("name", "estimator"), [("3RRR", "implicit"), ("rotary_delta", "joint")])
def test_positions_that_are_off_with_the_square_of_the_distance_are_told(name, estimator):
    robot = symkin.load_mechanism(name)
    taken = symkin.simulate(robot, robot.plan(40), 1).measurements.for_all_legs()
    assert symkin.identify(robot, taken, estimator).trustworthy
    last = robot.space.size - 1
    away = taken.poses[:, : last + 1] - taken.poses[:, : last + 1].mean(axis=0)
    squares = np.square(away).sum(axis=1)
    poses = np.array(taken.poses)
    poses[:, last] -= 1e-3 * squares / squares.max()
    doubts = symkin.identify(robot, replace(taken, poses=poses), estimator).doubts
    (told,) = (each for each in doubts if each.code == "sags")
    assert told.figures["component"] == robot.space.position[last]
    assert told.size == pytest.approx(-1e-3, abs=4e-4)
    assert told.p < 1e-3


@pytest.mark.parametrize("estimator", ["implicit", "joint"])
def test_a_sag_that_parameters_take_up_is_told_and_not_what_they_became(estimator):
    robot = symkin.load_mechanism("rotary_delta")
    taken = at_random(robot, 1).for_all_legs()
    squares = np.square(taken.poses - taken.poses.mean(axis=0)).sum(axis=1)
    poses = np.array(taken.poses)
    poses[:, 2] -= 5e-4 * squares / squares.max()
    (told,) = symkin.identify(robot, replace(taken, poses=poses), estimator).doubts
    assert told.code == "sags"
    assert told.size == pytest.approx(-5e-4, rel=0.2)
    # A robot that is further from its drawing than said does not sag.
    parameters = robot.parameters + 4 * (disturb(robot, 1).parameters - robot.parameters)
    made = robot.with_parameters(parameters, symmetry=None)
    far = symkin.identify(robot, at_random(robot, 1, made).for_all_legs(), estimator).doubts
    assert {each.code for each in far} == {"far-from-drawing", "parameters-far"}


def distorted(poses, size, strain=None, lens=0.0):
    """As a device measures positions that is not square, or bends lines outwards."""
    away = poses[:, :size] - poses[:, :size].mean(axis=0)
    squares = np.square(away).sum(axis=1, keepdims=True)
    changed = np.array(poses)
    changed[:, :size] += lens * away * squares / squares.max()
    if strain is not None:
        changed[:, :size] += away @ np.array(strain).T
    return changed


@pytest.mark.parametrize("options", [{}, {"frames": ["base"]}, {"prior": "tolerances"}])
@pytest.mark.parametrize(
    ("name", "how", "words"),
    [
        ("5bar", {"strain": [[0.01, 0], [0, 0]]}, "longer along x than along y by 1 %"),
        ("5bar", {"strain": [[0, 0.006], [0, 0]]}, "x and y from square by 0.006"),
        ("5bar", {"lens": 0.01}, "as by a lens"),
        ("linear_delta", {"lens": 0.01}, "as by a lens"),
    ],
)
def test_a_device_that_is_distorted_is_told_and_not_what_sensors_would_do(
    name, how, words, options
):
    robot = symkin.load_mechanism(name)
    taken = at_random(robot, 1).for_all_legs()
    assert symkin.identify(robot, taken, **options).trustworthy
    poses = distorted(taken.poses, robot.space.size, **how)
    (told,) = symkin.identify(robot, replace(taken, poses=poses), **options).doubts
    assert told.code == "device-distorted"
    assert words in told.figures["terms"]


def test_a_scale_of_the_device_is_told_where_tolerances_say_how_long_links_are():
    robot = symkin.load_mechanism("5bar")
    taken = at_random(robot, 1).for_all_legs()
    poses = 1.02 * taken.poses
    (told,) = symkin.identify(robot, replace(taken, poses=poses), frames=["base"]).doubts
    assert told.code == "device-distorted"
    assert told.figures["terms"].startswith("too large by")


@pytest.mark.parametrize("options", [{}, {"prior": "tolerances"}])
@pytest.mark.parametrize("name", ["3RRR", "hexapod_jugglebot"])
def test_a_distortion_that_is_missed_is_told_with_what_it_does_to_the_robot(name, options):
    robot = symkin.load_mechanism(name)
    taken = at_random(robot, 1).for_all_legs()
    found = symkin.identify(robot, taken, **options)
    (note,) = (each for each in found.notes if each.code == "unseen")
    stretch = r"device longer along (\w) than along (\w) by ([\d.]+) % \(([\d.]+) times\)"
    shear = r"device with (\w) and (\w) from square by ([\d.]+) rad \(([\d.]+) times\)"
    told = re.search(stretch, str(note)) or re.search(shear, str(note))
    size = robot.space.size
    one, other = (robot.space.position.index(told[each]) for each in (1, 2))
    half, strain = float(told[3]) / 2, np.zeros((size, size))
    if "longer" in told[0]:
        strain[one, one], strain[other, other] = half / 100, -half / 100
    else:
        strain[one, other] = strain[other, one] = half
    assert np.abs(strain).max() <= 0.005  # no more is usual
    poses = distorted(taken.poses, size, strain=strain)
    wrong = symkin.identify(robot, replace(taken, poses=poses), **options)
    moved = symkin.evaluate(wrong.mechanism, actual=found.mechanism, poses=found.latent_poses)
    times = moved.position_rms / found.expected_at_poses.position
    assert times == pytest.approx(float(told[4]), rel=0.2)


def test_a_distortion_that_a_device_is_too_good_for_is_no_note():
    robot = symkin.load_mechanism("rotary_delta")
    told = {}
    for device in ("CMM", "motion capture"):
        own = robot.with_device(device)
        found = symkin.identify(own, at_random(own, 1).for_all_legs())
        (note,) = (each for each in found.notes if each.code == "unseen")
        told[device] = "a measuring device" in str(note)
    assert told == {"CMM": False, "motion capture": True}


def test_an_axis_from_square_by_less_than_is_usual_is_told_or_noted():
    """It moves a robot by several times what is expected before a test sees it."""
    robot = symkin.load_mechanism("3RRR")
    trusted = 0
    for seed in range(5):
        taken = at_random(robot, seed, disturb(robot, seed)).for_all_legs()
        poses = distorted(taken.poses, 2, strain=[[0, 2e-3], [0, 0]])
        found = symkin.identify(robot, replace(taken, poses=poses))
        trusted += found.trustworthy
        noted = [each for each in found.notes if each.code == "unseen"]
        assert not found.trustworthy or "a measuring device" in str(noted[0])
    assert trusted


def test_of_angles_alone_no_distortion_is_looked_for():
    robot = symkin.load_mechanism("3RRR")
    taken = at_random(robot, 1).for_all_legs()
    alone = replace(taken, poses=taken.poses * [np.nan, np.nan, 1])
    found = symkin.identify(robot, alone, prior="tolerances")
    assert "device" not in "".join(str(each) for each in found.notes if each.code == "unseen")


def test_sensors_that_run_out_of_true_are_no_distorted_device():
    robot = symkin.load_mechanism("5bar")
    taken = at_random(robot, 1).for_all_legs()
    readings = taken.readings + 3e-3 * np.sin(taken.readings + np.arange(len(robot.legs)))
    doubts = symkin.identify(robot, replace(taken, readings=readings)).doubts
    said = {each.code for told in doubts for each in (told, *told.others)}
    assert "sensor-eccentric" in said
    assert "device-distorted" not in said


@pytest.mark.parametrize("options", [{}, {"prior": "tolerances"}, {"frames": ["base"]}], ids=str)
@pytest.mark.parametrize("name", ["3RPS", "rotary_delta"])
def test_a_leg_that_has_play_is_told_with_its_size(name, options):
    robot = symkin.load_mechanism(name)
    for seed in range(1, 4):
        taken = at_random(robot, seed).for_all_legs()
        play = 3e-4 * np.random.default_rng(seed).choice([-1, 1], len(taken.readings))
        readings = np.array(taken.readings)
        readings[:, 1] += play
        told = symkin.identify(robot, replace(taken, readings=readings), **options).doubts[0]
        assert (told.code, told.legs) == ("readings-scatter", (1,))
        assert told.size == pytest.approx(3e-4, rel=0.4)


def test_play_that_chi_square_does_not_see_is_told():
    """Many poses of a plan hardly show it, so that noise explains the sum of all."""
    robot = symkin.load_mechanism("5bar")
    plan = symkin.make_plan(robot, symkin.sample_workspace(robot, 2000, seed=1), seed=1)
    told = seen = 0
    for seed in range(10):
        taken = symkin.simulate(robot, plan, seed).measurements
        assert symkin.identify(robot, taken).trustworthy
        play = np.random.default_rng(seed).choice([-1, 1], len(taken.readings))
        readings = np.array(taken.readings)
        readings[:, 0] += 3e-4 / robot.characteristic_length * play
        found = symkin.identify(robot, replace(taken, readings=readings))
        told += [each.code for each in found.doubts] == ["readings-scatter"]
        seen += found.unexplained
    assert told > seen
    assert told >= 6


@pytest.mark.parametrize("options", [{}, {"prior": "tolerances"}, {"frames": ["base"]}], ids=str)
@pytest.mark.parametrize("name", ["3RPS", "rotary_delta"])
def test_what_scatters_from_a_row_on_is_told_with_the_row(name, options):
    robot = symkin.load_mechanism(name)
    size = robot.space.size
    for seed in range(1, 4):
        random = np.random.default_rng(seed)
        taken = at_random(robot, seed).for_all_legs()
        later = np.arange(len(taken.poses)) >= 25
        rows = later[:, None] * random.standard_normal(taken.poses.shape)
        readings = np.array(taken.readings)
        readings[:, 1] += 6e-4 * rows[:, 0]
        leg = symkin.identify(robot, replace(taken, readings=readings), **options).doubts[0]
        assert (leg.code, leg.legs) == ("readings-scatter", (1,))
        assert leg.size == pytest.approx(6e-4, rel=0.5)
        poses = np.array(taken.poses)
        poses[:, :size] += 5 * robot.noise.position * rows[:, :size]
        device = symkin.identify(robot, replace(taken, poses=poses), **options).doubts[0]
        assert device.code == "rows-scatter"
        first = int(taken.row_numbers[25])
        for told in (leg, device):
            assert first - 2 <= told.rows[0] <= first + 3
            assert f"from row {told.rows[0]} on" in str(told)


def test_noise_that_is_larger_in_all_rows_is_not_told_of_some():
    robot = symkin.load_mechanism("3RRR")
    for seed in range(7):
        taken = at_random(robot, seed).for_all_legs()
        more = np.random.default_rng(seed).standard_normal(taken.poses.shape)
        poses = taken.poses + 1.2 * more * [*(robot.noise.position,) * 2, robot.noise.orientation]
        codes = {each.code for each in symkin.identify(robot, replace(taken, poses=poses)).doubts}
        assert "residuals-large" in codes
        assert "rows-scatter" not in codes


def test_play_that_is_seen_in_most_robots_only_from_some_size_on_is_noted_with_that_size():
    """The likelihood ratio for its size and its leg sees 0.3 mm in two of three robots."""
    robot = symkin.load_mechanism("5bar")
    plan = symkin.make_plan(robot, symkin.sample_workspace(robot, 2000, seed=1), seed=1)
    seen = 0
    for seed in range(20):
        taken = symkin.simulate(robot, plan, seed).measurements
        (note,) = (n for n in symkin.identify(robot, taken).notes if n.code == "unseen")
        size = float(re.search(r"play of (\S+) rad to either side of leg", str(note))[1])
        readings = np.array(taken.readings)
        readings[:, 0] += size * np.random.default_rng(seed).choice([-1, 1], len(readings))
        seen += not symkin.identify(robot, replace(taken, readings=readings)).trustworthy
    assert size == pytest.approx(3.8e-4, rel=0.1)
    assert seen >= 16


def test_the_tail_of_a_sum_of_squares_is_that_of_many():
    random = np.random.default_rng(1)
    weights = np.array([5.0, 3.0, 1.0, *(0.2,) * 20])
    sums = np.square(random.standard_normal((400_000, len(weights)))) @ weights
    for probability in (0.05, 1e-3):
        scores = np.sqrt(np.quantile(sums, 1 - probability)) * np.eye(len(weights))[0]
        told = scatter._Scatter(None, slice(0, 1), False, scores, weights, 1).p_value
        assert told == pytest.approx(probability, rel=0.1)


@pytest.mark.parametrize(
    ("name", "options"),
    [
        ("3RRR", {}),
        ("3RRR", {"prior": "tolerances"}),
        ("rotary_delta", {"frames": ["base"]}),
        ("3RPS", {"estimator": "joint"}),
    ],
)
def test_rows_of_another_robot_are_told_from_which_row_on(name, options):
    robot = symkin.load_mechanism(name)
    one, other = (at_random(robot, seed).for_all_legs() for seed in (1, 2))
    later = np.arange(len(one.poses))[:, None] >= 17
    both = replace(
        one,
        poses=np.where(later, other.poses, one.poses),
        readings=np.where(later, other.readings, one.readings),
    )
    told = symkin.identify(robot, both, **options).doubts[0]
    assert (told.code, told.rows) == ("rows-of-another-robot", (int(one.row_numbers[17]),))
    assert told.explains


def test_a_sag_is_no_other_robot():
    robot = symkin.load_mechanism("2RRR_PRP")
    said = []
    for seed in range(4):
        taken = at_random(robot, seed, disturb_but_gains(robot, seed)).for_all_legs()
        poses = np.array(taken.poses)
        squares = np.square(poses[:, :2] - robot.home[:2]).sum(axis=1)
        poses[:, 1] -= 5e-4 * squares / squares.max()
        found = symkin.identify(robot, replace(taken, poses=poses), fixed=["sensor_gain"])
        said.append({each.code for each in found.doubts})
    assert all("sags" in codes and "rows-of-another-robot" not in codes for codes in said)


def test_a_distorted_device_is_told_where_gains_are_held_and_not_a_gain():
    """Gains in metres that are held say how long lengths are, so a scale is seen, too."""
    robot = symkin.load_mechanism("2RRR_PRP")
    for seed in range(4):
        taken = at_random(robot, seed, disturb_but_gains(robot, seed)).for_all_legs()
        poses = np.array(taken.poses)
        poses[:, 0] += 0.01 * (poses[:, 0] - poses[:, 0].mean())
        found = symkin.identify(robot, replace(taken, poses=poses), fixed=["sensor_gain"])
        told = found.doubts[0]
        assert told.code == "device-distorted"
        assert re.match(r"longer along x .*, too large by 0\.\d+ %", told.figures["terms"])
        assert "gain" not in {each.code for each in found.doubts}


def test_gains_that_are_held_and_wrong_are_no_scale_of_the_device():
    robot = symkin.load_mechanism("2RRR_PRP")
    parameters = robot.parameters.copy()
    parameters[:, list(robot.parameter_names).index("sensor_gain")] *= 1.01
    made = robot.with_parameters(parameters)
    for seed in range(4):
        taken = at_random(robot, seed, made).for_all_legs()
        told = symkin.identify(robot, taken, fixed=["sensor_gain"]).doubts[0]
        assert told.code in ("drawn-wrong", "held-is-wrong")


def disturb_but_gains(robot, seed):
    """As made, with the gains of the drawing."""
    made, place = disturb(robot, seed), list(robot.parameter_names).index("sensor_gain")
    parameters = made.parameters.copy()
    parameters[:, place] = robot.parameters[:, place]
    return made.with_parameters(parameters)


def test_zeros_set_anew_and_a_device_that_was_moved_are_no_other_robot():
    robot = symkin.load_mechanism("3RRR")
    taken = at_random(robot, 1).for_all_legs()
    later = np.arange(len(taken.poses))[:, None] >= 17
    moved = replace(
        taken,
        poses=taken.poses + later * [1e-3, -2e-3, 0],
        readings=taken.readings + later * [2e-3, -1e-3, 3e-3],
    )
    doubts = symkin.identify(robot, moved).doubts
    assert doubts
    assert "rows-of-another-robot" not in {each.code for each in doubts}


def test_turns_that_a_sensor_lost_are_told_with_the_table_that_has_them():
    robot = symkin.load_mechanism("5bar")
    taken = at_random(robot, 1).for_all_legs()
    readings = np.array(taken.readings)
    late = readings[:, 0] > np.median(readings[:, 0])
    readings[late, 0] -= 2 * np.pi
    found = symkin.identify(robot, replace(taken, readings=readings))
    (told,) = found.doubts
    assert (told.code, told.legs) == ("turns-lost", (0,))
    lost = (found.corrected.readings - taken.readings) / (2 * np.pi)
    assert np.allclose(lost[:, 1], 0)
    assert np.allclose(lost[:, 0], lost[0, 0])


def drawn_wrong(robot, number, times, legs=slice(None)):
    """The drawing with one number of some legs so many times as large; by 0.04 where it is 0."""
    parameters, place = robot.parameters.copy(), list(robot.parameter_names).index(number)
    own = parameters[legs, place]
    parameters[legs, place] = np.where(own == 0, 0.04, times * own)
    return robot.with_parameters(parameters, symmetry=None)


@pytest.mark.parametrize(
    "options", [{}, {"estimator": "joint"}, {"prior": "tolerances"}, {"frames": ["base"]}]
)
@pytest.mark.parametrize(
    ("name", "number", "times"),
    [
        ("rotary_delta", "distal_length", 1.02),
        ("rotary_delta", "distal_length", 1.1),
        ("rotary_delta", "axis_elevation", 0.0),
        ("3RRR", "platform_radius", 0.95),
        ("3RPS", "base_radius", 1 / 25.4),
        ("5bar", "proximal_length", 1 / 25.4),
    ],
)
def test_a_number_that_the_drawing_has_wrong_in_all_legs_is_named(name, number, times, options):
    robot = symkin.load_mechanism(name)
    taken = symkin.simulate(robot, robot.plan(seed=1), 1).measurements
    drawn = drawn_wrong(robot, number, times)
    try:
        found = symkin.identify(drawn, taken, **options)
    except symkin.SymkinError as error:
        told = error.likely_cause
    else:
        (told,) = found.doubts
        cured = symkin.identify(found.redrawn, taken, **options)
        assert cured.trustworthy
        np.testing.assert_allclose(found.redrawn.parameters, robot.parameters, atol=2e-3)
    assert (told.code, told.figures["name"], told.others) == ("drawn-wrong", number, ())
    assert told.size == pytest.approx(1 / times if times else -0.04, rel=0.02)


@pytest.mark.parametrize(
    ("names", "times"), [("side_2_length", 1.1), ("side_1_length, side_2_length", 1 / 25.4)]
)
def test_a_number_that_a_declared_leg_has_under_several_names_is_named(names, times):
    robot = symkin.load_mechanism(DECLARED / "h4_rods.toml")
    taken = at_random(robot, 1).for_all_legs()
    drawn = robot
    for each in names.split(", "):
        drawn = drawn_wrong(drawn, each, times)
    found = symkin.identify(drawn, taken)
    (told,) = found.doubts
    assert (told.code, told.figures["name"], told.others) == ("drawn-wrong", names, ())
    assert told.size == pytest.approx(1 / times, rel=0.02)
    assert symkin.identify(found.redrawn, taken).trustworthy


def test_what_explains_as_much_as_a_number_of_the_drawing_is_named_with_it():
    robot = symkin.load_mechanism("3RRR")
    taken = symkin.simulate(robot, robot.plan(40), 1).measurements.for_all_legs()

    def drawn(number):
        parameters = robot.parameters.copy()
        parameters[:, list(robot.parameter_names).index(number)] += 0.04
        return robot.with_parameters(parameters, symmetry=None)

    for number in ("base_angle", "sensor_offset"):
        (told,) = symkin.identify(drawn(number), taken, frames=["base", "target"]).doubts
        assert {each.code for each in (told, *told.others)} == {"drawn-wrong", "zero"}
    # A target that is turned is more usual than that.
    (told,) = symkin.identify(drawn("platform_angle"), taken).doubts
    assert told.code == "frame-not-as-drawn"
    (other,) = told.others
    assert (other.code, other.figures["name"]) == ("drawn-wrong", "platform_angle")


def test_a_number_that_is_wrong_in_one_leg_is_not_said_to_be_so_in_all():
    robot = symkin.load_mechanism("rotary_delta")
    taken = at_random(robot, 1).for_all_legs()
    drawn = drawn_wrong(robot, "distal_length", 1.1, legs=slice(1))
    doubts = symkin.identify(drawn, taken).doubts
    assert "drawn-wrong" not in {each.code for each in doubts}
    assert not any(each.is_cause for each in doubts)


def test_a_drawing_that_does_not_reach_its_own_home_ends_in_no_traceback():
    robot = symkin.load_mechanism("3RRR")
    taken = at_random(robot, 1).for_all_legs()
    seen = np.where(np.arange(3) < 2, 1.0, np.nan)
    positions = replace(taken, poses=taken.poses * seen)
    drawn = drawn_wrong(robot, "proximal_length", 0.6)
    drawn = drawn_wrong(drawn, "distal_length", 0.6)
    with pytest.raises(symkin.SymkinError):
        symkin.identify(drawn, positions)


def test_a_leg_without_an_end_leaves_the_directions_of_the_others():
    robot = symkin.load_mechanism("5bar")
    taken = symkin.simulate(robot, symkin.plan(robot, 24)).measurements
    found = symkin.identify(robot, taken)
    covariance = found.covariance.copy()
    covariance[:6] = covariance[:, :6] = np.nan
    directions = directions_of(replace(found, covariance=covariance), np.ones(12))
    assert {each for way in directions for each in way.unknowns} <= set(found.names[6:])
