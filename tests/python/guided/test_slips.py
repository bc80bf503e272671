# SPDX-License-Identifier: MIT
"""Slips that a session hardly sees: it goes on where there may be one, and says what is hidden."""

import dataclasses

import numpy as np
import pytest

import symkin
from symkin.estimate.evidence.changes import largest_of_steps, step_scores, terms_of_changes
from symkin.estimate.evidence.linear_rows import LinearRows, linear_rows
from symkin.estimate.evidence.residuals import ALARMS
from symkin.estimate.evidence.unseen import POWER
from symkin.guided import SimulatedDevice
from symkin.guided.knowledge import Knowledge
from symkin.model.settings import Tolerances
from symkin.planning.simulation import disturb
from symkin.show.guided import end_text, progress_text

ACCURACY, FEW = 4e-5, {"of": "height", "observe": "height", "candidates": 500}
SUSPECTED, SOUND = 7, 1  # seeds
SLIP = 2.5e-4  # m, of a carriage: less than two deviations of a height


@pytest.fixture(scope="module")
def delta():
    return symkin.load("linear_delta")


def run(delta, seed, slip=0.0, upto=60):
    """A session of heights that decides by itself, and the verdicts; leg 2 slips at row 14."""
    session, verdicts = delta.measure(ACCURACY, seed=seed, **FEW), []
    device = SimulatedDevice(delta, seed=seed, observe="height")
    for n, ask in zip(range(1, upto + 1), session, strict=False):
        row = device(ask)
        session.add(row | {"psi_2_m": row["psi_2_m"] + slip * (n >= 14)})
        verdicts.append(session.resolve())
        if session.progress.suspected is not None:
            break
    return session, verdicts


def test_the_row_that_would_show_most_of_a_step_is_found_without_measuring_it():
    random = np.random.default_rng(1)
    jacobian, one = random.normal(size=(20, 2, 6)), random.normal(size=(20, 2))
    column = np.where(np.arange(20)[:, None] < 13, -one, 0.0)

    def left(jacobian, column):
        flat, values = jacobian.reshape(-1, 6), column.ravel()
        return np.square(values - flat @ np.linalg.lstsq(flat, values)[0]).sum()

    basis = np.linalg.qr(jacobian.reshape(-1, 6))[0].reshape(20, 2, 6)
    fields = {each.name: np.zeros((20, 2)) for each in dataclasses.fields(LinearRows)}
    rows = LinearRows(**fields | {"basis": basis, "components": (), "spare": 34})
    again = [
        left(np.concatenate([jacobian, jacobian[[i]]]), np.concatenate([column, np.zeros((1, 2))]))
        for i in range(20)
    ]
    more = np.array(again) - left(jacobian, column)
    assert rows.shown_by_repeating(column) == pytest.approx(more)


@pytest.fixture(scope="module")
def doubtful(delta):
    """A session that would be enough, but that something may have slipped."""
    session, verdicts = run(delta, seed=SUSPECTED, slip=SLIP)
    assert all(each.fine for each in verdicts)
    return session


def test_a_session_goes_on_as_long_as_something_may_have_slipped(doubtful):
    progress = doubtful.progress
    assert not progress.reached
    assert progress.position_bound < ACCURACY
    assert abs(progress.suspected - 14) <= 4
    assert f"may have slipped at row {progress.suspected}" in progress_text(doubtful, progress)
    assert f"may have slipped at row {progress.suspected}" in end_text(doubtful, progress)
    ask = doubtful.next()
    assert ask.repeat_of is not None


def test_who_leaves_out_to_see_to_it_ends_the_session(delta):
    session, _ = run(delta, seed=SUSPECTED, slip=SLIP)
    session.skip()
    assert session.progress.reached


def test_what_may_have_slipped_is_found_before_the_session_ends(delta, monkeypatch):
    def found():
        session, device = delta.measure(ACCURACY, seed=SUSPECTED, **FEW), device_of(delta)
        for n, ask in zip(range(1, 60), session, strict=False):
            row = device(ask)
            session.add(row | {"psi_2_m": row["psi_2_m"] + SLIP * (n >= 14)})
            session.resolve()
        assert session.progress.reached
        return session.slips

    assert found()
    monkeypatch.setattr(Knowledge, "suspected", lambda *_: None)
    assert not found()


def device_of(delta):
    return SimulatedDevice(delta, seed=SUSPECTED, observe="height")


def test_the_slip_that_is_told_as_hidden_is_noticed_in_as_many_sessions(delta):
    session, _ = run(delta, seed=SOUND)
    progress, estimate = session.progress, session.estimate
    assert progress.reached
    hidden = progress.hidden
    assert hidden.position > ACCURACY
    told = " ".join(end_text(session, progress).replace("\u00a0", " ").split())
    assert f"by {1e3 * hidden.size:.3f} mm, is noticed in 90 % of such sessions" in told
    rows = linear_rows(estimate, ())
    steps = [each for each in terms_of_changes(estimate, rows) if each.what == "step"]
    random = np.random.default_rng(1)
    n = len(rows.residual)
    before = np.arange(n)[:, None] < n // 2
    shares = []
    for leg in range(3):
        column = np.where(before, -rows.by_leg[..., leg], 0.0)
        seen = 0
        for _ in range(300):
            noise = random.normal(size=rows.residual.shape)
            residual = rows.left(noise + hidden.size * column)
            _, scores, alike = step_scores(rows.by_leg[..., leg], rows.basis, residual)
            seen += largest_of_steps(np.abs(scores).max(), alike) < ALARMS / len(steps)
        shares.append(seen / 300)
    assert min(shares) == pytest.approx(POWER, abs=0.05)


def beyond(delta, seed, upto=60):
    """A session of a robot three times its tolerances from the drawing, and its verdicts."""
    wider = Tolerances(**{name: 3 * value for name, value in vars(delta.tolerances).items()})
    made = disturb(delta.replace(tolerances=wider), seed)
    device = SimulatedDevice(delta, seed, made, observe="height")
    session, verdicts = delta.measure(ACCURACY, seed=seed, **FEW), []
    for _, ask in zip(range(upto), session, strict=False):
        session.add(device(ask))
        verdicts.append(session.resolve())
    return session, verdicts


def test_heights_of_a_robot_beyond_its_tolerances_are_not_taken_for_a_slip(delta):
    session, verdicts = beyond(delta, seed=2)
    assert any(each.decided == "robot" for each in verdicts)  # which a slip might explain, too
    assert not any(each.slipped for each in verdicts)
    assert session.progress.reached
    assert not session.progress.repaired
    assert session.progress.rows < 32  # 37 with a step


def test_poses_are_chosen_for_the_errors_over_the_bed_as_it_is_known(delta):
    session, _ = beyond(delta, seed=13, upto=20)
    chooser, found = session._chooser, session.estimate
    survey = chooser._survey(found, chooser.candidates[:5, 0])
    assert np.abs(survey.observed.plane[1:]).max() > 0.01  # a bed that leans
    assert set(survey.unknowns) == set(found.names)
    own = [found.names.index(name) for name in survey.unknowns]
    covariance = found.model_covariance[np.ix_(own, own)]
    bound = chooser._bounds(chooser._forms(survey), covariance, session.confidence)["position"]
    assert bound == pytest.approx(session.progress.position_bound, rel=0.02)


def test_a_session_does_not_end_by_a_last_row_that_few_sound_ones_have(delta):
    asked = {"observe": "position", "candidates": 500, "frames": ["base"], "prior": "tolerances"}
    session, rows = delta.measure(6e-5, seed=9, **asked), 0
    device = SimulatedDevice(delta, 9, disturb(delta, 9), observe="position")
    for ask in session:
        row, rows = device(ask), session.progress.rows + 1
        session.add(row | {"psi_2_m": row["psi_2_m"] + 2.2e-4 * (rows >= 14)})
        session.resolve()
    assert rows > 14  # of which the last one alone is after the slip
    assert [*session.slips] == [14]
