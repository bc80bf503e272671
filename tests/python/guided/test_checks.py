# SPDX-License-Identifier: MIT
"""Wrong rows, slips and drawings that are not right, in a guided session."""

import shlex

import numpy as np
import pytest

import symkin
from symkin.guided import SimulatedDevice, tries_table
from symkin.guided.choosing import Chooser
from symkin.model.settings import Tolerances
from symkin.planning.simulation import disturb
from symkin.show.guided import end_text, progress_text

ACCURACY, FEW = 1e-4, {"candidates": 200, "seed": 1}


@pytest.fixture(scope="module")
def robot():
    return symkin.load("3RRR")


def run(robot, spoil, actual=None, rows=40):
    """A session that resolves its verdicts itself; `spoil` changes what try n measured."""
    session, verdicts = robot.measure(ACCURACY, **FEW), []
    device = SimulatedDevice(robot, seed=3, actual=actual)
    for n, ask in zip(range(1, rows), session, strict=False):
        session.add(spoil(n, device(ask)))
        verdicts.append(session.resolve())
    return session, verdicts


@pytest.mark.parametrize(
    ("spoil", "likely"),
    [
        (
            lambda row: row | {"psi_1_rad": row["psi_3_rad"], "psi_3_rad": row["psi_1_rad"]},
            "the readings of legs 1 and 3 exchanged",
        ),
        (
            lambda row: row | {name: row[name] / 25.4 for name in ("x_m", "y_m")},
            "x, y in inches",  # typed where mm were asked for
        ),
    ],
)
def test_a_slip_of_the_hand_is_seen_at_once_and_named(robot, spoil, likely):
    session, (*_, verdict) = run(robot, lambda n, row: spoil(row) if n == 7 else row, rows=8)
    assert verdict.doubtful == 7
    assert verdict.likely == likely
    session.correct(7, verdict.edited, verdict.likely)
    assert session.verdict.fine
    assert session.progress.rows == 7
    assert session.progress.repaired


def test_a_first_row_that_no_robot_like_the_drawing_has_is_doubted_and_its_unit_named(robot):
    session, device = robot.measure(ACCURACY, **FEW), SimulatedDevice(robot, seed=3)
    found = device(session.next())
    in_mm = {name: 1e3 * found[name] for name in ("x_m", "y_m")}
    session.add(found | in_mm)
    assert "No estimate yet: " in progress_text(session, session.progress)
    assert (session.verdict.doubtful, session.verdict.likely) == (1, "x, y in mm")
    session.correct(1, session.verdict.edited, session.verdict.likely)
    assert session.verdict.fine
    assert session.progress.rows == 1


def test_a_wrong_row_is_decided_by_its_repeat_and_more_is_asked_afterwards(robot):
    wrong = 10 * robot.noise.position
    spoil = lambda n, row: row | {"x_m": row["x_m"] + wrong} if n == 12 else row  # noqa: E731
    session, verdicts = run(robot, spoil)
    assert [(v.doubtful, v.decided) for v in verdicts if not v.fine] == [(12, ""), (12, "row")]
    assert all(each.tolerances == 1 for each in verdicts)
    progress = session.progress
    assert progress.reached
    assert progress.repaired
    assert progress.confidence == pytest.approx(0.975)


@pytest.mark.parametrize(("again", "decided"), [(-10, "row"), (38, "robot")])
def test_a_repeat_that_is_off_too_tells_a_wrong_row_by_how_far_apart_both_are(
    robot, again, decided
):
    off = {12: 40 * robot.noise.position, 13: again * robot.noise.position}
    spoil = lambda n, row: row | {"x_m": row["x_m"] + off.get(n, 0.0)}  # noqa: E731
    _, verdicts = run(robot, spoil, rows=14)
    assert [(v.doubtful, v.decided) for v in verdicts if not v.fine] == [(12, ""), (12, decided)]


def test_a_row_that_no_robot_has_is_wrong_where_one_has_its_repeat(robot):
    def spoil(n, row):
        x = 1e3 * row["x_m"] if n == 7 else row["x_m"] - 6 * robot.noise.position * (n == 8)
        return row | {"x_m": x, "phi_rad": row["phi_rad"] + (n == 7)}

    _, verdicts = run(robot, spoil, rows=9)
    assert [(v.doubtful, v.decided) for v in verdicts if not v.fine] == [(7, ""), (7, "row")]


@pytest.mark.parametrize("x", [0.4, 4.0, 1e3])  # m; of the last no robot is found
def test_a_row_that_nobody_decides_stays_the_doubtful_one(robot, x):
    session, device = robot.measure(ACCURACY, **FEW), SimulatedDevice(robot, seed=3)
    for n, ask in zip(range(1, 24), session, strict=False):
        session.add(device(ask) | ({"x_m": x} if n == 8 else {}))
        if n >= 8:
            assert session.verdict.doubtful == 8
            assert session.verdict.tolerances == 1
            assert not session.progress.reached
    session.drop(8)
    assert session.verdict.fine


def test_a_slip_becomes_a_step_before_which_rows_still_count(robot):
    slip = 5 * max(robot.noise.reading, robot.noise.orientation)
    spoil = lambda n, row: row | {"psi_2_rad": row["psi_2_rad"] + slip * (n >= 14)}  # noqa: E731
    session, verdicts = run(robot, spoil)
    found = [v.slipped for v in verdicts if v.slipped is not None]
    assert len(found) == 1
    assert abs(found[0] - 14) <= 2
    assert session.progress.reached
    (step,) = (each for each in session.estimate.unknowns if ".step" in each.name)
    assert step.name.startswith("leg2.")  # it is plain which sensor has slipped
    assert step.value == pytest.approx(slip, rel=0.4)


def test_a_session_does_not_end_while_a_repeat_says_that_something_has_slipped(robot):
    slip = 7 * robot.noise.orientation
    spoil = lambda n, row: row | {"psi_2_rad": row["psi_2_rad"] + slip * (n >= 16)}  # noqa: E731
    session, verdicts = run(robot, spoil)
    assert [v.decided for v in verdicts if v.decided] == ["robot"]
    assert len(verdicts) > 20  # 16 would do for a robot that stays as it is
    assert session.progress.reached
    steps = [each.name for each in session.estimate.unknowns if ".step" in each.name]
    assert [name.partition(".")[0] for name in steps] == ["leg2"]


def test_a_slip_in_the_last_row_shows_when_the_first_poses_are_measured_again(robot):
    slip = 5 * robot.noise.orientation
    spoil = lambda n, row: row | {"psi_3_rad": row["psi_3_rad"] + slip * (n >= 15)}  # noqa: E731
    session, verdicts = run(robot, spoil)
    assert len(verdicts) > 20  # 18 would do for a robot that stays as it is
    assert any(each.slipped for each in verdicts)
    assert session.progress.reached
    steps = [each.name for each in session.estimate.unknowns if ".step" in each.name]
    assert [name.partition(".")[0] for name in steps] == ["leg3"]


def test_a_drawing_with_too_small_tolerances_is_told_before_rows_are_blamed(robot):
    wider = Tolerances(**{name: 3 * value for name, value in vars(robot.tolerances).items()})
    made = disturb(robot.replace(tolerances=wider), 3)
    session, verdicts = run(robot, lambda _, row: row, actual=made)
    assert session.progress.reached
    assert 1.5 < verdicts[-1].tolerances < 5
    assert session.robot.tolerances.length > 1.5 * robot.tolerances.length
    assert not session.progress.repaired


def test_wider_tolerances_are_told_from_a_few_rows_on_and_nothing_has_slipped(robot):
    wider = Tolerances(**{name: 3 * value for name, value in vars(robot.tolerances).items()})
    for seed in (4, 5, 6):
        made = disturb(robot.replace(tolerances=wider), seed)
        _, verdicts = run(robot, lambda _, row: row, actual=made)
        assert all(each.slipped is None for each in verdicts)
        assert sum(not each.fine for each in verdicts) <= 4  # a row of the first ones, its repeat
        assert any(each.tolerances > 1.5 for each in verdicts[:8])


def test_a_row_that_is_wrong_by_far_is_no_reason_to_widen_tolerances(robot):
    wrong = 100 * robot.noise.position
    spoil = lambda n, row: row | {"x_m": row["x_m"] + wrong} if n == 4 else row  # noqa: E731
    _, verdicts = run(robot, spoil)
    assert [(v.doubtful, v.decided) for v in verdicts if not v.fine] == [(4, ""), (4, "row")]
    assert all(each.tolerances == 1 for each in verdicts)


def test_what_slipped_in_two_legs_is_a_step_of_every_leg(robot):
    slip = 8 * max(robot.noise.reading, robot.noise.orientation)

    def spoil(n, row):
        moved = {name: row[name] + slip for name in ("psi_1_rad", "psi_2_rad")}
        return row | moved if n >= 14 else row

    session, _ = run(robot, spoil)
    assert session.progress.reached
    steps = {each.name[:4]: each for each in session.estimate.unknowns if ".step" in each.name}
    assert set(steps) == {"leg1", "leg2", "leg3"}
    assert [steps[leg].value for leg in ("leg1", "leg2")] == pytest.approx([slip, slip], rel=0.4)


def test_a_step_that_was_taken_at_a_wrong_row_is_held_once_the_right_one_is_found(robot):
    slip = 8 * max(robot.noise.reading, robot.noise.orientation)
    spoil = lambda n, row: row | {"psi_2_rad": row["psi_2_rad"] + slip * (n >= 14)}  # noqa: E731
    session, device = robot.measure(ACCURACY, **FEW), SimulatedDevice(robot, seed=3)
    for n, ask in zip(range(1, 40), session, strict=False):
        session.add(spoil(n, device(ask)))
        if n == 13:
            session.slip(3)
        else:
            session.resolve()
    assert session.progress.reached
    (step,) = (each for each in session.estimate.unknowns if ".step" in each.name)
    assert step.value == pytest.approx(slip, rel=0.4)
    assert len(session.robot.identification.fixed) == 5


def test_a_session_by_hand_is_not_enough_as_long_as_something_is_doubtful(robot, tmp_path):
    folder = tmp_path / "my session"
    session, device = robot.measure(ACCURACY, folder, **FEW), SimulatedDevice(robot, seed=3)
    while session.progress.closing != 1:
        session.add(device(session.next()))
    found = device(session.next())
    session.add(found | {"psi_2_rad": found["psi_2_rad"] + 12 * robot.noise.orientation})
    assert session.progress.position_bound < 2 * ACCURACY
    doubtful = session.verdict
    assert not doubtful.fine
    assert not session.progress.reached
    while not session.progress.undecided:  # nobody decides, and it is never enough
        session.add(device(session.next()))
        assert not session.progress.reached
        assert session.tries < 40
    assert "decided what does not fit" in progress_text(session, session.progress)
    assert "decided what does not fit" in end_text(session, session.progress)
    session.drop(session.verdict.doubtful)
    while session.next() is not None:
        session.add(device(session.next()))
        session.resolve()
    assert session.progress.reached
    *_, identify = end_text(session, session.progress).splitlines()
    files = [str(folder / name) for name in ("robot.toml", "measured.csv")]
    asked = ["--confidence", "0.975", "--out", "calibrated"]
    assert shlex.split(identify) == ["symkin", "identify", *files, *asked]


def test_a_slip_that_looks_like_a_robot_beyond_its_tolerances_is_told_from_that(robot):
    slip = 40 * robot.noise.orientation
    spoil = lambda n, row: row | {"psi_2_rad": row["psi_2_rad"] + slip * (n >= 14)}  # noqa: E731
    session, verdicts = run(robot, spoil)
    (found,) = (n for n, each in enumerate(verdicts, 1) if each.slipped is not None)
    assert found <= 18
    assert session.progress.reached
    assert verdicts[-1].tolerances == 1


def test_a_device_that_was_moved_is_named_with_the_shift_and_the_turn():
    delta = symkin.load("linear_delta")
    shift, turn = np.array([3e-4, -4e-4, 6e-4]), np.array([3e-3, 0.0, -4e-3])
    session = delta.measure(6e-5, candidates=300, seed=1, observe="position", frames=["base"])
    device = SimulatedDevice(delta, seed=2, observe="position")
    for n, ask in zip(range(1, 40), session, strict=False):
        row = device(ask)
        if n >= 14:
            seen = np.array([row[name] for name in ("x_m", "y_m", "z_m")])
            seen += shift + np.cross(turn, seen)
            row |= dict(zip(("x_m", "y_m", "z_m"), seen.tolist(), strict=True))
        session.add(row)
        session.resolve()
    assert session.progress.reached
    ((row, steps),) = session.slips.items()
    assert row == 14
    found = {each.name.partition(".")[2]: each for each in steps}
    for name, value in zip(("x", "y", "z", "rx", "ry", "rz"), (*shift, *turn), strict=True):
        assert found[name].value == pytest.approx(value, abs=4 * found[name].deviation)
    assert found["z"].deviation < shift[2] / 5
    assert "measuring device was moved at row 14" in progress_text(session, session.progress)


def test_a_device_whose_place_is_declared_and_that_was_moved_is_named_and_found_again(robot):
    shift, turn = np.array([1e-3, -2e-3]), 4e-3
    rotation = np.array([[np.cos(turn), -np.sin(turn)], [np.sin(turn), np.cos(turn)]])

    def moved(n, row):
        if n < 14:
            return row
        x, y = rotation @ (row["x_m"], row["y_m"]) + shift
        return row | {"x_m": x, "y_m": y, "phi_rad": row["phi_rad"] + turn}

    session, _ = run(robot, moved)
    assert session.progress.reached
    assert session.progress.rows <= 30
    ((row, steps),) = session.slips.items()
    assert row == 14
    found = {each.name.partition(".")[2]: each for each in steps}
    for name, value in zip(("x", "y", "phi"), (*shift, turn), strict=True):
        assert found[name].value == pytest.approx(value, abs=4 * found[name].deviation)
    assert session.robot.identification.frames == ("base",)
    text = " ".join(progress_text(session, session.progress).split())
    assert "measuring device was moved at row 14" in text
    assert "as the device sees it now" in text


def test_of_slips_that_are_too_close_to_be_told_apart_the_last_one_holds(robot):
    session, device = robot.measure(ACCURACY, **FEW), SimulatedDevice(robot, seed=3)
    for _, ask in zip(range(18), session, strict=False):
        session.add(device(ask))
    for row in (13, 14, 13, 14):
        session.slip(row)
    assert list(session.slips) == [14]
    assert session.estimate is not None
    assert session.verdict.slipped is None


def test_a_step_is_placed_where_it_explains_most(robot):
    def spoil(n, row):
        return row | {"psi_2_rad": row["psi_2_rad"] + 0.02} if n >= 15 else row

    session, verdicts = run(robot, spoil)
    assert [each.slipped for each in verdicts if each.slipped is not None] == [15]
    assert list(session.slips) == [15]
    assert session.progress.reached


def test_where_there_is_no_estimate_of_a_trial_nobody_looks_for_why(robot, monkeypatch):
    from symkin.estimate.evidence import corrections

    monkeypatch.setattr(corrections, "hypotheses_of", lambda *_, **__: pytest.fail("looked for"))
    device = SimulatedDevice(robot, seed=3)
    session = robot.measure(ACCURACY, **FEW)
    for n, ask in zip(range(1, 4), session, strict=False):
        row = device(ask)
        session.add(row | {"x_m": 1e3 * row["x_m"]} if n == 1 else row)
    assert session.verdict is not None


def test_a_doubtful_row_is_read_once_for_all_edits_and_no_poses_are_planned(robot, monkeypatch):
    session, device = robot.measure(ACCURACY, **FEW), SimulatedDevice(robot, seed=3)
    for _ in range(9):
        session.add(device(session.next()))
    row = device(session.next())
    read, planned = [], []
    reading, planning = tries_table.read_measurements, Chooser.plan
    monkeypatch.setattr(
        tries_table, "read_measurements", lambda *given: read.append(1) or reading(*given)
    )
    monkeypatch.setattr(Chooser, "plan", lambda *given: planned.append(1) or planning(*given))
    session.add(row | {"psi_1_rad": row["psi_3_rad"], "psi_3_rad": row["psi_1_rad"]})
    assert session.verdict.doubtful == 10
    assert len(read) < 10  # of 19 edits
    assert not planned
    session.keep(10)
    assert len(read) < 10  # what is said of rows does not change what they say


def test_the_slips_of_hand_of_a_first_impossible_row_are_read_together(robot, monkeypatch):
    session = robot.measure(4e-5, candidates=300, seed=1)
    row = SimulatedDevice(robot, seed=2)(session.asked())
    session.add({**row, "x_m": 25.4 * row["x_m"] + 40, "psi_2_rad": 1.7 * row["psi_2_rad"]})
    read, count = tries_table.read_measurements, [0]

    def counted(*given, **how):
        count[0] += 1
        return read(*given, **how)

    monkeypatch.setattr(tries_table, "read_measurements", counted)
    assert session.verdict.doubtful == 1
    assert count[0] <= 2  # there are dozens
