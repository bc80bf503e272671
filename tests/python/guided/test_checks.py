# SPDX-License-Identifier: MIT
"""Wrong rows, slips and drawings that are not right, in a guided session."""

import pytest

import symkin
from symkin.guided import SimulatedDevice
from symkin.model.settings import Tolerances
from symkin.planning.simulation import disturb

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


def test_a_slip_becomes_a_step_before_which_rows_still_count(robot):
    slip = 5 * max(robot.noise.reading, robot.noise.orientation)
    spoil = lambda n, row: row | {"psi_2_rad": row["psi_2_rad"] + slip * (n >= 14)}  # noqa: E731
    session, verdicts = run(robot, spoil)
    found = [v.slipped for v in verdicts if v.slipped is not None]
    assert len(found) == 1
    assert abs(found[0] - 14) <= 2
    assert session.progress.reached
    steps = [each for each in session.estimate.unknowns if ".step" in each.name]
    assert len(steps) == 3
    assert steps[1].value == pytest.approx(slip, rel=0.4)


def test_a_session_does_not_end_while_a_repeat_says_that_something_has_slipped(robot):
    slip = 7 * robot.noise.orientation
    spoil = lambda n, row: row | {"psi_2_rad": row["psi_2_rad"] + slip * (n >= 16)}  # noqa: E731
    session, verdicts = run(robot, spoil)
    assert [v.decided for v in verdicts if v.decided] == ["robot"]
    assert len(verdicts) > 20  # 16 would do for a robot that stays as it is
    assert session.progress.reached
    assert sum(".step" in each.name for each in session.estimate.unknowns) == 3


def test_a_slip_in_the_last_row_shows_when_the_first_poses_are_measured_again(robot):
    slip = 5 * robot.noise.orientation
    spoil = lambda n, row: row | {"psi_3_rad": row["psi_3_rad"] + slip * (n >= 15)}  # noqa: E731
    session, verdicts = run(robot, spoil)
    assert len(verdicts) > 20  # 18 would do for a robot that stays as it is
    assert any(each.slipped for each in verdicts)
    assert session.progress.reached
    assert sum(".step" in each.name for each in session.estimate.unknowns) == 3


def test_a_drawing_with_too_small_tolerances_is_told_before_rows_are_blamed(robot):
    wider = Tolerances(**{name: 3 * value for name, value in vars(robot.tolerances).items()})
    made = disturb(robot.replace(tolerances=wider), 3)
    session, verdicts = run(robot, lambda _, row: row, actual=made)
    assert session.progress.reached
    assert 1.5 < verdicts[-1].tolerances < 5
    assert session.robot.tolerances.length > 1.5 * robot.tolerances.length
    assert not session.progress.repaired
