# SPDX-License-Identifier: MIT
"""A measuring device sets what nobody has said otherwise."""

import numpy as np
import pytest

import symkin
from symkin.analysis.observed import Observed
from symkin.errors import MechanismFileError, SymkinError
from symkin.model.devices import DEVICES, device_of
from symkin.model.settings import NoiseSettings
from symkin.options import Observable, Visit
from symkin.show.devices import device_in_words, device_notes

TRACKER, CAPTURE, GAUGE = "laser tracker, 3 reflectors", "motion capture", "dial gauge"


def with_file(tmp_path, shipped, *sections):
    """A shipped mechanism's file without its noise, and with other sections."""
    source = symkin.load_mechanism(shipped).source.read_text(encoding="utf-8")
    kept = [
        part for part in source.split("\n[") if not part.startswith(("noise]", "measurements]"))
    ]
    path = tmp_path / "robot.toml"
    path.write_text("\n[".join(kept) + "\n" + "\n".join(sections), encoding="utf-8")
    return path


def test_every_device_of_the_table_is_whole():
    for device in DEVICES.values():
        assert device.visit in Visit.__args__
        assert set(device.observe) <= set(Observable.__args__)
        assert device.source
        assert (device.position is None) == (device.observe == ("readings",))
        assert (device.orientation is not None) == (device.observe == ("pose",))
        assert device.kind not in device_in_words(device)


@pytest.mark.parametrize(
    ("said", "kind"), [("Laser", TRACKER), ("cmm", "CMM"), ("bed", "bed probe")]
)
def test_a_beginning_of_a_devices_name_will_do(said, kind):
    assert device_of(said).kind == kind


def test_a_file_sets_what_its_device_does_not_and_goes_before_it(tmp_path):
    device = f'[device]\nkind = "{CAPTURE}"\n'
    robot = symkin.load_mechanism(with_file(tmp_path, "hexapod_jugglebot", device))
    assert (robot.noise.position, robot.noise.orientation, robot.noise.reading) == (2e-4, 1e-3, 0)
    assert robot.identification.frames == ("base", "target")
    (note,) = device_notes(robot)
    assert "position noise 0.2" in note
    assert "yours" not in note
    own = "[noise]\nposition = 5e-5\nreading = 1e-3\n[frames]\ntarget = [0, 0, 0.1, 0, 0, 0]\n"
    path = with_file(tmp_path, "hexapod_jugglebot", device, 'visit = "sets"\n', own)
    robot = symkin.load_mechanism(path)
    assert (robot.noise.position, robot.noise.orientation, robot.noise.reading) == (
        5e-5,
        1e-3,
        1e-3,
    )
    assert robot.identification.frames == ("base",)  # since the target is placed
    assert robot.device.visit == "sets"
    assert "(yours: position noise 0.05" in device_notes(robot)[0]


def test_a_mechanism_with_a_device_is_written_and_read_back(tmp_path):
    robot = symkin.load_mechanism("hexapod_jugglebot").with_device("camera")
    symkin.save_mechanism(robot, tmp_path / "robot.toml")
    assert symkin.load_mechanism(tmp_path / "robot.toml") == robot


def test_another_device_takes_the_place_of_the_first_and_of_its_frames():
    robot = symkin.load_mechanism("hexapod_jugglebot")
    moved = robot.with_device(CAPTURE).with_device(TRACKER)
    assert moved.noise.position == DEVICES[TRACKER].position
    assert moved.noise.reading == robot.noise.reading
    assert moved.identification.frames is None
    assert moved.with_device("laser") is moved


@pytest.mark.parametrize(
    ("robot", "kind", "words"),
    [
        ("3RRR", "bed probe", "expected a robot that moves in space"),
        ("agile_eye", TRACKER, "a platform that only turns"),
        ("3RRR", "lazer tracker", "expected one of"),
        ("3RRR", "", "expected one of"),
    ],
)
def test_a_device_that_cannot_serve_is_refused_with_what_is_missing(robot, kind, words):
    with pytest.raises(SymkinError, match=words):
        symkin.load_mechanism(robot).with_device(kind)


def test_a_file_with_an_unknown_device_names_the_line(tmp_path):
    path = with_file(tmp_path, "3RRR", '[device]\nkind = "motion captur"\ndistance = 1')
    assert symkin.load_mechanism(path).device.kind == CAPTURE  # which begins so
    path = with_file(tmp_path, "3RRR", '[device]\nkind = "motion kapture"')
    with pytest.raises(MechanismFileError, match=r'toml:\d+: device.kind: .*"motion capture"'):
        symkin.load_mechanism(path)


@pytest.mark.parametrize(
    ("robot", "kind", "kinds", "unknown"),
    [
        ("hexapod_jugglebot", TRACKER, ("points",), {"base", "point1", "point3"}),
        ("3RRR", "camera", ("pose",), {"base", "target"}),
        ("linear_delta", TRACKER, ("position",), {"base"}),
        ("linear_delta", GAUGE, ("height",), {"plane"}),
    ],
)
def test_a_plan_and_an_estimate_are_for_what_the_device_sees(robot, kind, kinds, unknown):
    robot = symkin.load_mechanism(robot).with_device(kind)
    plan = symkin.plan(robot, 30, candidates=150, spares=4, method="random")
    assert plan.basis.survey.observed.kinds == kinds
    assert plan.basis.design == "mechanism"
    blocks = {name.partition(".")[0] for name in plan.basis.survey.unknowns}
    assert unknown <= blocks
    measured = symkin.simulate(robot, plan, seed=3).measurements
    found = symkin.identify(robot, measured)
    assert found.converged
    assert {name.partition(".")[0] for name in found.names} == blocks
    assert found.least < found.chi_square < found.limit


def test_a_run_of_a_robot_with_a_device_is_measured_by_it():
    robot = symkin.load_mechanism("3RRR").with_device("camera")
    robot = robot.replace(protocol=symkin.model.settings.ProtocolSettings(15, 150))
    result = symkin.run_protocol(robot, method="random")
    assert result.identification.estimator == "joint"
    assert "base.x" in result.identification.names
    after, before = result.after.aligned.position_rms, result.before.aligned.position_rms
    assert after < before / 5
    assert any(CAPTURE not in note and "camera" in note for note in result.summary().notes)


def test_noise_grows_with_the_distance_from_the_device():
    far = NoiseSettings(position=1e-4, per_metre=2e-4)
    robot = symkin.load_mechanism("3RRR").replace(noise=far)
    plan = symkin.plan(robot, 150, candidates=400, spares=9, method="random", prior="tolerances")
    seen = Observed("position", base=(1.0, 0.0, 0.0))
    exact = symkin.simulate(
        robot.replace(noise=NoiseSettings(1e-300)), plan, 1, robot, observe=seen
    ).measurements
    noisy = symkin.simulate(robot, plan, 1, robot, observe=seen).measurements
    away = np.linalg.norm(exact.poses[:, :2], axis=1)
    errors = (noisy.poses - exact.poses)[:, :2] / (1e-4 + 2e-4 * away)[:, None]
    assert errors.std() == pytest.approx(1, abs=0.12)
    sigma = noisy.standard_deviations(far)["poses"]
    assert sigma[:, 0] == pytest.approx(1e-4 + 2e-4 * away, rel=1e-2)
    assert (sigma[:, 2] == far.orientation).all()


def test_what_grows_with_distance_is_planned_for_and_estimated_with():
    shipped = symkin.load_mechanism("3RRR")
    near, far = (shipped.replace(noise=NoiseSettings(1e-4, per_metre=each)) for each in (0, 1e-4))
    plans = [
        symkin.plan(each, 20, candidates=200, spares=4, method="random") for each in (near, far)
    ]
    assert plans[0].basis.survey is None
    assert plans[1].expected.position > 1.02 * plans[0].expected.position
    found = symkin.identify(far, symkin.simulate(far, plans[1], seed=2))
    assert found.estimator == "joint"
    assert found.least < found.chi_square < found.limit
    half = far.replace(noise=NoiseSettings(5e-5, per_metre=5e-5))
    again = symkin.identify(half, found.measurements, noise="estimate").noise
    assert again.per_metre == pytest.approx(again.position)  # as declared, of twice the size
    assert again.position == pytest.approx(1e-4, rel=0.35)


def test_whoever_says_a_position_noise_means_it_everywhere(tmp_path):
    device = f'[device]\nkind = "{TRACKER}"\n'
    robot = symkin.load_mechanism(with_file(tmp_path, "hexapod_jugglebot", device))
    assert (robot.noise.position, robot.noise.per_metre) == (7.5e-6, 3e-6)
    own = symkin.load_mechanism(
        with_file(tmp_path, "hexapod_jugglebot", device, "[noise]\nposition = 1e-5\n")
    )
    assert (own.noise.position, own.noise.per_metre) == (1e-5, 0)
