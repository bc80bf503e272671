# SPDX-License-Identifier: MIT
"""An accuracy of single coordinates: of z alone, or of the height above a bed."""

import json

import numpy as np
import pytest

import symkin
from symkin.analysis.observed import Observed
from symkin.data.measurements import Measurements
from symkin.errors import SymkinError
from symkin.estimate.survey import Survey
from symkin.guided import SimulatedDevice
from symkin.model.settings import Frames
from symkin.show.entering import entered, obeyed, touches
from symkin.show.guided import end_text
from symkin.show.served import session_state

FEW = {"candidates": 300, "seed": 1}
ACCURACY = 8e-5


@pytest.fixture(scope="module")
def delta():
    return symkin.load("linear_delta")


@pytest.fixture(scope="module")
def done(delta, tmp_path_factory):
    folder = tmp_path_factory.mktemp("heights") / "session"
    session = delta.measure(ACCURACY, folder, of="height", observe="height", **FEW)
    device = SimulatedDevice(delta, seed=2, observe="height")
    for _, ask in zip(range(40), session, strict=False):
        session.add(device(ask))
    return session


def test_heights_alone_reach_an_accuracy_of_the_height_above_the_bed(delta, done):
    assert done.progress.reached
    assert done.progress.position_bound < ACCURACY
    assert "such robots keep, over the bed (rms):" in end_text(done, done.progress)
    bed = delta.sample_workspace(500, seed=3).poses * [1, 1, 0]
    found = symkin.identify(done.folder / "robot.toml", done.folder / "measured.csv")
    told = found.expected_accuracy(bed, of="height")
    assert told.position_bound == pytest.approx(done.progress.position_bound, rel=0.1)
    assert (told.of, found.expected_accuracy(bed).of) == ("height", None)
    assert found.expected_accuracy(bed).position_bound > 10 * ACCURACY  # x and y are not shown
    # Which the session's drawing says, so that identify promises what the session did.
    assert (found.options.of, found.expected.of) == ("height", "height")
    assert found.expected.position_bound == done.progress.position_bound
    assert "Height above the bed, mm" in found.text(whole=True)


def test_a_session_goes_on_with_the_same_coordinates_alone(delta, done):
    assert json.loads((done.folder / "session.json").read_text())["accuracy"] == {
        "height": ACCURACY
    }
    again = delta.measure(ACCURACY, done.folder, of="height", observe="height", **FEW)
    assert again.progress == done.progress
    with pytest.raises(SymkinError, match=r"another accuracy .*8e-05 m of height"):
        delta.measure(ACCURACY, done.folder, observe="height", **FEW)


def test_where_all_coordinates_are_never_known_those_that_are_shown_are_told(delta):
    progress = delta.measure(ACCURACY, observe="height", **FEW).progress
    assert progress.never
    assert [*progress.shown] == ["height"]
    assert progress.shown["height"] < ACCURACY < progress.position_floor
    alone = delta.measure(ACCURACY, of="height", observe="height", **FEW).progress
    assert not alone.never
    assert alone.position_floor == pytest.approx(progress.shown["height"])
    assert not alone.shown


@pytest.mark.parametrize("plane", [(0.0, 0.0, 0.0), (1e-3, 0.05, -0.03)])
def test_heights_change_with_the_unknowns_as_their_finite_differences(delta, plane):
    target = (2e-3, -1e-3, 5e-3, 0.0, 0.0, 0.0)
    robot = delta.replace(frames=Frames(plane=plane, target=target))
    poses = robot.sample_workspace(20, seed=1).poses
    readings = robot.inverse_kinematics(poses)
    survey = Survey.of(robot, poses, Observed.of(robot, "height"), {"frames": ["plane"]})
    effects = survey._heights(poses)[:, 0]
    step = 1e-6

    def heights(changed):
        taken = changed.forward_kinematics(readings, poses)[0]
        made = Measurements.of(taken, readings, pose_space=robot.pose_space)
        return Observed.of(changed, "height").exact(made).heights

    for column, name in enumerate(survey.unknowns):
        found = []
        for sign in (1, -1):
            if name.startswith("plane."):
                moved = np.array(plane)
                moved[int(name[-1])] += sign * step
                changed = robot.replace(frames=Frames(plane=tuple(moved), target=target))
            else:
                leg, _, parameter = name.partition(".")
                values = np.array(robot.parameters)
                values[int(leg[3:]) - 1, robot.parameter_names.index(parameter)] += sign * step
                changed = robot.with_parameters(values, symmetry=None)
            found.append(heights(changed))
        slope = (found[0] - found[1]) / (2 * step)
        assert effects[:, column] == pytest.approx(slope, rel=1e-5, abs=1e-7)


def test_errors_of_single_coordinates_make_up_that_of_the_position(delta):
    asked = {"frames": ["base"], "prior": "tolerances"}
    plan = symkin.plan(delta, 20, observe="position", candidates=300, **asked)
    taken = symkin.simulate(delta, plan, 1)
    found = symkin.identify(delta, taken.measurements, **asked)
    poses = delta.sample_workspace(200, seed=2).poses
    whole = found.expected_accuracy(poses).position
    parts = {of: found.expected_accuracy(poses, of=of).position for of in ("x", "y", "z", "xy")}
    assert np.hypot(parts["xy"], parts["z"]) == pytest.approx(whole)
    assert np.hypot(parts["x"], parts["y"]) == pytest.approx(parts["xy"])
    assert min(parts.values()) > 0


def test_coordinates_that_a_robot_does_not_have_are_refused(delta):
    planar = symkin.load("3RRR")
    with pytest.raises(SymkinError, match='no "z"; expected x, y'):
        planar.measure(1e-4, of="z", **FEW)
    with pytest.raises(SymkinError, match="no accuracy of the position is wanted"):
        planar.measure(orientation=1e-3, of="y", **FEW)
    with pytest.raises(SymkinError, match="no height is observed"):
        delta.measure(1e-4, of="height", observe="position", **FEW)


def test_of_the_coordinates_that_are_wanted_fewer_rows_are_needed():
    robot = symkin.load("3RRR")
    whole = robot.measure(2e-4, **FEW)
    alone = robot.measure(2e-4, of="x", **FEW)
    assert alone.progress.more < whole.progress.more


def test_where_a_probe_touched_is_entered_as_the_controller_says_it(delta):
    """A robot whose touch the controller sees 0.3 mm above the bed is 0.3 mm lower than drawn."""
    by_z, by_readings = (
        delta.measure(ACCURACY, of="height", observe="height", **FEW) for _ in "ab"
    )
    ask = by_z.asked()
    assert touches(by_z)
    obeyed(by_z, "z 0.3")
    (readings,) = delta.inverse_kinematics(ask.pose[None] + [[0, 0, 3e-4]])
    obeyed(by_readings, " ".join(f"{1e3 * each:.9f}" for each in readings) + " 0")
    one, other = by_z.measurements, by_readings.measurements
    assert one.readings == pytest.approx(other.readings)
    assert one.heights == pytest.approx(other.heights) == [0.0]
    for _ in range(12):
        obeyed(by_z, "z=0,3")
    assert (
        by_z.estimate.mechanism.forward_kinematics(ask.readings[None], ask.pose[None])[0][0, 2] < 0
    )


def test_a_page_takes_where_a_probe_touched(delta):
    page, terminal = (delta.measure(ACCURACY, of="height", observe="height", **FEW) for _ in "ab")
    *_, field = session_state(page)["entries"]
    assert (field["name"], field["unit"]) == ("or z where it touched", "mm")
    entered(page, {field["column"]: "-0,25"})
    obeyed(terminal, "z -0.25")
    assert page.measurements.readings == pytest.approx(terminal.measurements.readings)
    with pytest.raises(SymkinError, match="expected one of them"):
        entered(page, {field["column"]: "-0,25", "height_m": "0.25"})
    with pytest.raises(SymkinError, match=r'"a" is no number \(z mm\)'):
        obeyed(terminal, "z a")
    robot = symkin.load("3RRR").measure(1e-4, **FEW)
    assert not touches(robot)
    assert {each["column"] for each in session_state(robot)["entries"]} == set(robot.columns)


def test_what_is_held_counts_in_what_a_session_plans_as_in_what_it_promises(delta):
    asked = {"observe": "height", "free": ["base_radius", "sensor_offset"]}
    exact = delta.measure(1e-3, assume={"tolerances": 0}, **asked, **FEW).progress
    counted = delta.measure(1e-3, **asked, **FEW).progress
    assert not exact.never
    assert counted.never
    assert counted.position_floor > 10 * exact.position_floor
    session = delta.measure(1.2 * counted.position_floor, **asked, **FEW)
    device = SimulatedDevice(delta, seed=2, observe="height")
    rows = [session.add(device(ask)) for _, ask in zip(range(20), session, strict=False)]
    assert session.progress.reached
    assert len(rows) < 20
    assert session.progress.position_bound > counted.position_floor
