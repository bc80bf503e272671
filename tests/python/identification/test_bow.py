# SPDX-License-Identifier: MIT
"""Beds that are not flat: their bow as an unknown, or found out."""

import dataclasses

import numpy as np
import pytest

import symkin
from symkin.analysis.observed import Observed
from symkin.estimate.problem import KINDS
from symkin.model.settings import Frames

PLANE = (3e-4, 2e-3, -1e-3)
BOW = 4e-4


@pytest.fixture(scope="module")
def delta():
    drawn = symkin.load("linear_delta")
    tolerances = dataclasses.replace(drawn.tolerances, angle=1e-3, gain=2e-4, length=5e-4)
    noise = dataclasses.replace(drawn.noise, position=1e-5)
    return drawn.replace(tolerances=tolerances, noise=noise)


@pytest.fixture(scope="module")
def plan(delta):
    return symkin.make_plan(
        delta, symkin.sample_workspace(delta, 1500, seed=1), 36, observe="height"
    )


def rim_of(plan):
    return float(np.hypot(*plan.poses[:, :2].T).max())


def touched(delta, plan, seed, bow=BOW):
    plane = (*PLANE, bow, rim_of(plan))
    return symkin.simulate(delta, plan, seed, observe=Observed(("height",), plane=plane))


def off_the_plane(found, actual):
    """How uneven a bed that it believes flat is for the printer, root mean square."""
    x, y = (each.ravel() for each in np.meshgrid(*2 * (np.linspace(-0.06, 0.06, 7),)))
    wanted = np.column_stack([x, y, 0 * x])
    readings = found.mechanism.replace(frames=None).inverse_kinematics(wanted)
    height = actual.forward_kinematics(readings)[0][:, 2]
    flat = np.column_stack([np.ones_like(x), x, y])
    return float(np.std(height - flat @ np.linalg.lstsq(flat, height, rcond=None)[0]))


def test_a_bow_is_estimated_and_the_printer_with_it(delta, plan):
    sim = touched(delta, plan, 1)
    flat = symkin.identify(delta, sim.measurements)
    bowed = symkin.identify(delta, sim.measurements, bow="0.3 mm")
    bow = bowed.params["plane.bow"]
    assert bow.unit == "m"
    assert bow.prior == pytest.approx(3e-4)
    assert abs(bow.value - BOW) < 3 * bow.deviation < 6e-4
    assert not bowed.doubts
    assert off_the_plane(bowed, sim.actual) < 0.6 * off_the_plane(flat, sim.actual)
    assert bowed.mechanism.frames.plane[3:] == pytest.approx((bow.value, rim_of(plan)), rel=0.05)


def test_intervals_of_a_bow_hold_the_truth(delta, plan):
    errors = []
    for seed in range(1, 13):
        bow = 3e-4 * np.random.default_rng(seed).normal()
        found = symkin.identify(delta, touched(delta, plan, seed, bow).measurements, bow=3e-4)
        own = found.params["plane.bow"]
        errors.append((own.value - bow * (found.mechanism.frames.plane[4] / rim_of(plan)) ** 2)
                      / own.deviation)  # fmt: skip
    assert np.mean(np.abs(errors) < 1.96) >= 0.8
    assert 0.5 < np.std(errors) < 1.5


def test_a_bed_that_nobody_said_to_be_bowed_is_named_or_noted(delta, plan):
    found = [symkin.identify(delta, touched(delta, plan, seed).measurements) for seed in range(4)]
    named = [doubt for each in found for doubt in each.doubts if doubt.code == "bed-bowed"]
    assert named
    assert all(doubt.size > 1e-4 for doubt in named)
    assert dict(named[0].options) == {"bow": "1 mm"}
    for each in found:
        (note,) = (note for note in each.notes if note.code == "held-as-exact")
        assert "bed (that it is flat)" in str(note)


def test_a_flat_bed_is_not_called_bowed(delta, plan):
    for seed in range(3):
        found = symkin.identify(delta, touched(delta, plan, seed, 0.0).measurements)
        assert not found.doubts


def test_a_file_says_bow_and_radius_and_is_read_back(delta, tmp_path):
    frames = Frames(plane=(*PLANE, BOW, 0.08))
    symkin.save_mechanism(delta.replace(frames=frames), tmp_path / "bowed.toml")
    assert symkin.load(tmp_path / "bowed.toml").frames == frames
    text = (tmp_path / "bowed.toml").read_text(encoding="utf-8")
    (tmp_path / "asked.toml").write_text(
        text + '\n[identification]\nbow = "0.2 mm"\n', encoding="utf-8"
    )
    assert symkin.load(tmp_path / "asked.toml").identification.bow == pytest.approx(2e-4)
    wrong = text.replace("0.08", "-0.08")
    (tmp_path / "wrong.toml").write_text(wrong, encoding="utf-8")
    with pytest.raises(symkin.SymkinError, match="radius of the rim above zero"):
        symkin.load(tmp_path / "wrong.toml")


def test_a_plan_promises_what_a_bow_costs(delta, plan):
    sample = symkin.sample_workspace(delta, 400, seed=1)
    asked = {"observe": "height", "frames": ["plane"], "prior": "tolerances"}
    flat = symkin.predict_accuracy(delta, plan, sample, **asked)
    bowed = symkin.predict_accuracy(delta, plan, sample, bow="0.3 mm", **asked)
    assert flat.position < bowed.position < 2 * flat.position


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"bow": "0"}, "positive standard deviation"),
        ({"bow": "3 apples"}, "apples"),
        ({"bow": "0.1 mm", "assume": {"bed": "0.1 mm"}}, "expected one of both"),
    ],
)
def test_a_wrong_bow_is_refused_in_words(delta, plan, options, words):
    with pytest.raises(symkin.SymkinError, match=words):
        symkin.identify(delta, touched(delta, plan, 1).measurements, **options)


def test_a_bow_without_heights_is_refused(delta):
    with pytest.raises(symkin.SymkinError, match="a bed that is probed"):
        symkin.make_plan(delta, symkin.sample_workspace(delta, 300, seed=1), 12, bow="0.1 mm")


def test_differences_of_height_bend_with_the_bed(delta, plan):
    exact = delta.replace(noise=dataclasses.replace(delta.noise, position=1e-7, reading=1e-9))
    bed = (*PLANE, BOW, rim_of(plan))
    both = Observed(("height", "rise"), plane=bed)
    taken = symkin.simulate(exact, plan, 1, actual=exact, observe=both).measurements
    assert np.isfinite(taken.rises).sum() == len(taken) // 2
    asked = {"frames": ["plane"], "fixed": ["leg*"], "assume": {"tolerances": 0}}
    flat = symkin.identify(exact, taken, **asked)
    bowed = symkin.identify(exact, taken, bow="0.3 mm", **asked)
    own = bowed.params["plane.bow"]
    at_rim = own.value * (rim_of(plan) / bowed.mechanism.frames.plane[4]) ** 2
    assert abs(at_rim - BOW) < 4 * own.deviation < 1e-6
    of_rises = bowed.rows.kind == KINDS.index("rises")
    assert of_rises.sum() == len(taken) // 2
    assert np.sqrt(np.mean(bowed.rows.t[of_rises] ** 2)) < 1.5
    assert np.sqrt(np.mean(flat.rows.t[of_rises] ** 2)) > 100


def test_a_bow_is_estimated_from_differences_of_height_alone(delta, plan):
    bed = Observed(("rise",), plane=(*PLANE, BOW, rim_of(plan)))
    errors = []
    for seed in range(4):
        taken = symkin.simulate(delta, plan, seed, observe=bed).measurements
        own = symkin.identify(delta, taken, bow="0.3 mm").params["plane.bow"]
        errors.append((own.value - BOW) / own.deviation)
    assert own.deviation < 0.8 * own.prior
    assert 0.3 < np.sqrt(np.mean(np.square(errors))) < 2
