# SPDX-License-Identifier: MIT
"""Logs of machines and devices, read as tables of measurements."""

from __future__ import annotations

import io
import json
import zipfile

import numpy as np
import pytest

import symkin
from symkin import cli
from symkin.analysis.clocks import Track, align_clocks, rests_of
from symkin.errors import SymkinError
from symkin.exports.firmware import LinearDelta
from symkin.exports.logs import FORMATS, import_log, log_format_of
from symkin.exports.printers import printer_of, workspace_of

ROD, RADIUS, HEIGHT = 250.0, 105.0, 300.0
BUILT = LinearDelta(
    0.1056, np.radians([210.2, 329.9, 90.0]), np.full(3, 0.25),
    0.2995 + np.sqrt(0.25**2 - 0.1056**2) + np.array([1e-4, -2e-4, 0.0]), np.ones(3),
)  # fmt: skip
BELIEVED = LinearDelta(
    RADIUS * 1e-3, np.radians([210.0, 330.0, 90.0]), np.full(3, ROD * 1e-3),
    HEIGHT * 1e-3 + np.sqrt(0.25**2 - 0.105**2) * np.ones(3), np.ones(3),
)  # fmt: skip


def written(folder, name, text):
    path = folder / name
    path.write_text(text, encoding="utf-8", newline="\n")
    return path


def printer(delta):
    legs = delta.legs((0.0, 0.0, 0.0))
    return printer_of("printer", legs, workspace_of(delta, 0.08), few=True)


def touched_at(x, y):
    """Height that the controller reports where the built printer touches the bed, mm."""
    built, believed = map(printer, (BUILT, BELIEVED))
    z = 0.0
    for _ in range(8):  # where the controller believes to be as the built one is at zero
        readings = believed.inverse_kinematics([[x * 1e-3, y * 1e-3, z]])
        z -= float(built.forward_kinematics(readings)[0][0, 2])
    return 1e3 * z


G33 = {"c": (0, 0), "x": 210, "y": 330, "z": 90, "yz": 30, "zx": 150, "xy": 270}


def marlin_log(radius=80.0):
    def at(name):
        if name == "c":
            return touched_at(0, 0)
        angle = np.radians(G33[name])
        return touched_at(radius * np.cos(angle), radius * np.sin(angle))

    z = {name: f"{name}:{at(name):+.2f}" for name in G33}
    return (
        "Send: M503\n"
        f"Recv: echo:  M665 L{ROD:.2f} R{RADIUS:.2f} H{HEIGHT:.2f} S160.00 X0.00 Y0.00 Z0.00 "
        "A0.00 B0.00 C0.00 ; (Diagonal rod, radius, height)\n"
        "Recv: echo:  M666 X0.00 Y0.00 Z0.00 ; Endstop adjustment\n"
        "Recv: ok\n"
        "Recv: Mean: 0.001234 Min: -0.002 Max: 0.003 Range: 0.005\n"
        "Recv: Standard Deviation: 0.004200\n"
        "G33 Auto Calibrate\n"
        "Checking... AC\n"
        f".Height:{HEIGHT:.2f}    Ex:+0.00  Ey:+0.00  Ez:+0.00  Radius:{RADIUS:.2f}\n"
        ".             Tx:+0.00  Ty:+0.00  Tz:+0.00\n"
        f".      {z['c']}   {z['x']}   {z['y']}   {z['z']}\n"
        f".             {z['yz']}  {z['zx']}  {z['xy']}\n"
        "Iteration : 01                                 std dev:0.312\n"
    )


def test_a_marlin_log_becomes_heights_and_a_printer(tmp_path):
    path = written(tmp_path, "g33.log", marlin_log())
    assert log_format_of(path).name == "marlin"
    found = import_log(path, radius=0.08)
    assert len(found.columns["height_m"]) == 7
    assert found.mechanism.parameters[0, 0] == pytest.approx(ROD * 1e-3)
    assert found.mechanism.noise.position == pytest.approx(4.2e-6)
    built = printer(BUILT)
    readings = np.column_stack([found.columns[f"psi_{leg}_m"] for leg in (1, 2, 3)])
    # Ways from endstops are what the sensors of the built printer show where it touches its bed.
    poses, _ = built.forward_kinematics(readings)
    assert np.abs(poses[:, 2]).max() < 1e-5  # the log has hundredths of a millimetre
    assert any("7 probed points" in each for each in found.took)
    assert any("iterations" in each for each in found.left)


def test_a_log_of_g33_without_its_radius_says_what_to_add(tmp_path):
    path = written(tmp_path, "g33.log", marlin_log())
    with pytest.raises(SymkinError, match="--radius 80mm"):
        import_log(path)


def test_marlin_without_its_geometry_says_what_to_add(tmp_path):
    text = "\n".join(line for line in marlin_log().splitlines() if "M66" not in line)
    with pytest.raises(SymkinError, match=r"rods.*M503"):
        import_log(written(tmp_path, "g33.log", text), radius=0.08)


def test_probed_points_of_g30_have_their_places(tmp_path):
    points = [(0, 0), (60, 0), (-30, 52), (-30, -52), (30, 26)]
    lines = [f"Recv: Bed X: {x:.2f} Y: {y:.2f} Z: {touched_at(x, y):.3f}" for x, y in points]
    text = marlin_log().split("G33 Auto")[0] + "\n".join(lines) + "\n"
    found = import_log(written(tmp_path, "g30.log", text))
    assert len(found.columns["height_m"]) == 5
    poses, _ = printer(BUILT).forward_kinematics(
        np.column_stack([found.columns[f"psi_{leg}_m"] for leg in (1, 2, 3)])
    )
    assert np.abs(poses[:, 2]).max() < 1e-6


def reprap_log(points):
    commands = [f"G30 P{i} X{x} Y{y} Z-99999" for i, (x, y) in enumerate(points)]
    heights = " ".join(f"{touched_at(x, y):.3f}" for x, y in points)
    return "\n".join(
        [
            "M665",
            f"Diagonals {ROD:.3f}:{ROD:.3f}:{ROD:.3f}, delta radius {RADIUS:.3f}, homed height "
            f"{HEIGHT:.3f}, bed radius 85.0, X 0.000°, Y 0.000°, Z 0.000°",
            "M666",
            "Endstop adjustments X0.00 Y0.00 Z0.00, tilt X0.00% Y0.00%",
            *commands,
            f"G32 bed probe heights: {heights}, mean 0.100, deviation from mean 0.020",
            "Calibrated 6 factors using 9 points, (mean, deviation) before (0.1, 0.2) after (0, 0)",
        ]
    )


def test_a_reprap_log_becomes_heights_at_the_points_of_its_commands(tmp_path):
    points = [(0, 0), *((round(70 * np.cos(a), 1), round(70 * np.sin(a), 1))
                        for a in np.linspace(0, 5.4, 10))]  # fmt: skip
    found = import_log(written(tmp_path, "duet.log", reprap_log(points)))
    readings = np.column_stack([found.columns[f"psi_{leg}_m"] for leg in (1, 2, 3)])
    assert len(readings) == len(points)
    poses, _ = printer(BUILT).forward_kinematics(readings)
    assert np.abs(poses[:, 2]).max() < 1e-6
    assert any("1 calibrations" in each for each in found.left)
    # And what is identified from it knows the built printer's bed.
    table = {name: np.asarray(values) for name, values in found.columns.items()}
    said = symkin.identify(found.mechanism, table, noise=found.mechanism.noise)
    assert said.heights.before > 10 * said.heights.fitted


def test_reprap_commands_say_what_its_reports_say(tmp_path):
    points = [(0, 0), (60, 0), (-30, 52), (-30, -52), (30, 26)]
    said = reprap_log(points).replace("X 0.000°, Y 0.000°", "X 0.500°, Y -0.200°")
    said = said.replace("adjustments X0.00 Y0.00 Z0.00", "adjustments X0.10 Y-0.20 Z0.10")
    commands = [
        f"M665 R{RADIUS} L{ROD}:{ROD}:{ROD} B85 H{HEIGHT} X0.5 Y-0.2 Z0",
        "M666 X0.10 Y-0.20 Z0.10",
    ]
    reported = import_log(written(tmp_path, "reports.log", said))
    text = "\n".join([*commands, *said.splitlines()[4:]])
    commanded = import_log(written(tmp_path, "commands.log", text))
    assert commanded.mechanism.legs == reported.mechanism.legs
    assert commanded.columns.keys() == reported.columns.keys()
    for name, values in commanded.columns.items():
        np.testing.assert_allclose(values, reported.columns[name], rtol=0, atol=1e-12)
    level = said.replace("X0.10 Y-0.20 Z0.10", "X0.00 Y0.00 Z0.00")
    plain = import_log(written(tmp_path, "level.log", level))
    for leg, lower in enumerate((1e-4, -2e-4, 1e-4), 1):
        name = f"psi_{leg}_m"
        np.testing.assert_allclose(np.add(reported.columns[name], lower), plain.columns[name])


def test_reprap_commands_leave_what_they_do_not_say(tmp_path):
    points = [(0, 0), (60, 0), (-30, 52)]
    head = f"M665 R{RADIUS} L{ROD} B85 H{HEIGHT} X0.5 Y-0.2\nM666 X0.10 Y-0.20 Z0.10\n"
    tail = "\n".join(reprap_log(points).splitlines()[4:])
    once = import_log(written(tmp_path, "once.log", head + tail))
    again = import_log(written(tmp_path, "again.log", f"{head}M665 X0.5\nM666 A0 B0\n{tail}"))
    assert again.mechanism.legs == once.mechanism.legs


@pytest.mark.parametrize("said", ["tilt X1.00% Y-2.00%", "M666 A1 B-2"])
def test_the_tilt_that_reprap_gives_the_bed_moves_the_carriages(tmp_path, said):
    points = [(0, 0), (60, 0), (-30, 52)]
    level = import_log(written(tmp_path, "level.log", reprap_log(points)))
    text = reprap_log(points)
    if said.startswith("tilt"):
        text = text.replace("tilt X0.00% Y0.00%", said)
    else:
        text = text.replace("G30 P0", f"{said}\nG30 P0")
    tilted = import_log(written(tmp_path, "tilted.log", text))
    rise = np.array(points) @ [1e-2, -2e-2] * 1e-3
    for name in ("psi_1_m", "psi_2_m", "psi_3_m"):
        np.testing.assert_allclose(np.subtract(tilted.columns[name], level.columns[name]), rise)
    assert tilted.mechanism.legs == level.mechanism.legs


def test_reprap_heights_without_positions_are_refused(tmp_path):
    text = "\n".join(
        line for line in reprap_log([(0, 0), (50, 0)]).splitlines() if not line.startswith("G30")
    )
    with pytest.raises(SymkinError, match=r"no positions.*G30 P0"):
        import_log(written(tmp_path, "duet.log", text))


@pytest.fixture(scope="module")
def five_bar():
    return symkin.load("5bar")


def motion(robot, rests=10, seed=1):
    """Times and poses of a robot that moves from rest to rest, at 1 kHz."""
    random = np.random.default_rng(seed)
    workspace = robot.workspace
    low, high = np.array(workspace.lower), np.array(workspace.upper)
    middle, half = (low + high) / 2, 0.2 * (high - low)
    stops = middle + half * random.uniform(-1, 1, (rests, len(low)))
    parts = []
    for a, b in zip(stops, [*stops[1:], stops[-1]], strict=True):
        parts.append(np.repeat(a[None], 1000, axis=0))
        s = np.linspace(0, 1, 900)[:, None]
        parts.append(a + (b - a) * (10 * s**3 - 15 * s**4 + 6 * s**5))
    poses = np.concatenate(parts)
    return np.arange(len(poses)) * 1e-3, poses


OFFSET, PPM = 1.2345, 80e-6


def recorded(robot, seed=1):
    """A take at 100 Hz and encoders at 200 Hz, on clocks of their own."""
    random = np.random.default_rng(seed)
    times, poses = motion(robot, seed=seed)
    take = np.arange(times[0] + 0.2, times[-1] - 0.2, 0.01)
    at = np.column_stack([np.interp(take, times, each) for each in poses.T])
    at = at + random.normal(0, 1e-4, at.shape)
    encoder = np.arange(times[0] + 0.1, times[-1] - 0.3, 0.005)
    there = np.column_stack([np.interp(encoder, times, each) for each in poses.T])
    step = 2 * np.pi / 8192
    readings = np.round(robot.inverse_kinematics(there) / step) * step
    return take, at, (encoder - OFFSET) / (1 + PPM), readings


def encoders_csv(times, readings):
    names = ",".join(f"psi_{k + 1}_rad" for k in range(readings.shape[1]))
    rows = [f"{t:.6f}," + ",".join(f"{v:.9f}" for v in row)
            for t, row in zip(times, readings, strict=True)]  # fmt: skip
    return "\n".join([f"time_s,{names}", *rows]) + "\n"


def motive_csv(times, places, lost=0.02, seed=3, unseen=()):
    """As Motive exports a rigid body, y up, in millimetres; turned if places have an angle."""
    seen = np.random.default_rng(seed).random(len(times)) >= lost
    seen[list(unseen)] = False
    head = (
        "Format Version,1.23,Take Name,Take 1,Capture Frame Rate,100.0,Export Frame Rate,100.0,"
        "Rotation Type,Quaternion,Length Units,Millimeters,Coordinate Space,Global\n\n"
        f",Type{',Rigid Body' * 8},Marker,Marker,Marker\n"
        f",Name{',plate' * 8},plate:Marker1,plate:Marker1,plate:Marker1\n"
        f",ID{',1' * 8},2,2,2\n"
        ",,Rotation,Rotation,Rotation,Rotation,Position,Position,Position,Mean Marker Error,"
        "Position,Position,Position\n"
        "Frame,Time (Seconds),X,Y,Z,W,X,Y,Z,,X,Y,Z\n"
    )
    rows = []
    for i, (t, (x, y, *angle), there) in enumerate(zip(times, places, seen, strict=True)):
        half = sum(angle) / 2
        turn = f"0,{np.sin(half):.9f},0,{np.cos(half):.9f}"
        own = f"{turn},{1e3 * x:.4f},0,{-1e3 * y:.4f},0.1,1,2,3" if there else "," * 10
        rows.append(f"{i},{t:.6f},{own}")
    return head + "\n".join(rows) + "\n"


def test_a_take_and_encoders_are_joined_at_rests(tmp_path, five_bar):
    take, at, times, readings = recorded(five_bar)
    path = written(tmp_path, "take.csv", motive_csv(take, at))
    encoders = written(tmp_path, "encoders.csv", encoders_csv(times, readings))
    assert log_format_of(path).name == "motive"
    found = import_log(path, encoders, mechanism=five_bar)
    assert len(found.columns["time_s"]) == 10
    poses = np.column_stack([found.columns["x_m"], found.columns["y_m"]])
    psi = np.column_stack([found.columns["psi_1_rad"], found.columns["psi_2_rad"]])
    there, _ = five_bar.forward_kinematics(psi)
    assert np.abs(poses - there).max() < 2e-4
    assert not any(name.startswith("p1") for name in found.columns)
    assert any("encoders' clock" in each for each in found.took)
    assert any("1 markers" in each for each in found.left)
    said = symkin.identify(five_bar, {k: np.asarray(v) for k, v in found.columns.items()})
    assert said.converged


def test_a_rest_whose_first_sample_was_lost_keeps_its_attitude(tmp_path):
    robot = symkin.load("3RRR")
    take, at, times, readings = recorded(robot)
    encoders = written(tmp_path, "encoders.csv", encoders_csv(times, readings))
    path = written(tmp_path, "take.csv", motive_csv(take, at))
    whole = import_log(path, encoders, mechanism=robot).columns
    psi = np.column_stack([whole[f"psi_{leg}_rad"] for leg in (1, 2, 3)])
    there, _ = robot.forward_kinematics(psi)
    assert np.abs(whole["phi_rad"] - there[:, 2]).max() < 1e-3
    seen, shown = Track(take, at[:, :2]), Track(times, robot.forward_kinematics(readings)[0][:, :2])
    rests = rests_of(seen, shown, align_clocks(seen, shown))
    first = [int(np.searchsorted(take, begin)) + more for begin, _ in rests for more in (-1, 0, 1)]
    written(tmp_path, "take.csv", motive_csv(take, at, unseen=first))
    lost = import_log(path, encoders, mechanism=robot).columns
    np.testing.assert_allclose(lost["phi_rad"], whole["phi_rad"], rtol=0, atol=1e-4)


def test_a_marker_that_was_hardly_seen_does_not_hide_the_motion(tmp_path):
    robot = symkin.load("3RRR")
    take, at, times, readings = recorded(robot)
    encoders = written(tmp_path, "encoders.csv", encoders_csv(times, readings))
    head = "Format Version,1.23,Rotation Type,Quaternion,Length Units,Millimeters\n"
    for row in (("Type", *["Marker"] * 9), ("Name", *"aaabbbccc"), ("ID", *"111222333")):
        head += f",{','.join(row)}\n"
    head += f",{',Position' * 9}\nFrame,Time (Seconds){',X,Y,Z' * 3}\n"
    body = np.array([[0.05, 0.0], [0.0, 0.06], [-0.05, 0.02]])
    sine, cosine = np.sin(at[:, 2]), np.cos(at[:, 2])
    turns = np.array([[cosine, -sine], [sine, cosine]]).transpose(2, 0, 1)
    seen = at[:, None, :2] + body @ turns.transpose(0, 2, 1)
    log = head
    for i, (t, points) in enumerate(zip(take, seen, strict=True)):
        cells = [f"{1e3 * x:.4f},0,{-1e3 * y:.4f}" for x, y in points]
        cells[2] = ",," if i > 3 else cells[2]
        log += f"{i},{t:.6f},{','.join(cells)}\n"
    found = import_log(written(tmp_path, "take.csv", log), encoders, mechanism=robot)
    assert len(found.columns["time_s"]) == 10
    psi = np.column_stack([found.columns[f"psi_{leg}_rad"] for leg in (1, 2, 3)])
    poses, _ = robot.forward_kinematics(psi)
    first = poses[:, :2] + 0.05 * np.column_stack([np.cos(poses[:, 2]), np.sin(poses[:, 2])])
    shown = np.column_stack([found.columns["p1_x_m"], found.columns["p1_y_m"]])
    assert np.abs(shown - first).max() < 1e-3
    assert np.isnan(found.columns["p3_x_m"]).all()


def test_clocks_are_aligned_to_half_a_millisecond(five_bar):
    errors = []
    for seed in range(1, 6):
        take, at, times, readings = recorded(five_bar, seed)
        first = Track(take, at)
        second = Track(times, five_bar.forward_kinematics(readings)[0])
        clocks = align_clocks(first, second)
        middle = times.mean()
        errors.append(clocks.of_first(middle) - (OFFSET + (1 + PPM) * middle))
        assert abs(clocks.rate - 1 - PPM) < 2e-4
        assert len(rests_of(first, second, clocks)) == 10
    assert np.sqrt(np.mean(np.square(errors))) < 3e-4
    assert np.abs(errors).max() < 5e-4


def test_a_robot_beside_the_table_of_its_log_stays(tmp_path, five_bar, capsys):
    take, at, times, readings = recorded(five_bar)
    path = written(tmp_path, "take.csv", motive_csv(take, at))
    encoders = written(tmp_path, "encoders.csv", encoders_csv(times, readings))
    robot = tmp_path / "mechanism.toml"
    symkin.save_mechanism(five_bar, robot)
    before = robot.read_bytes()
    command = ["import", path, encoders, "--mechanism", robot, "--out", tmp_path, "--overwrite"]
    for _ in range(2):
        assert cli.main([str(each) for each in command]) == 0
    assert robot.read_bytes() == before
    assert f"symkin identify {robot} {tmp_path / 'measurements.csv'}" in capsys.readouterr().out


def test_a_log_that_holds_the_geometry_takes_no_other_robot(tmp_path, capsys):
    path, out = written(tmp_path, "g33.log", marlin_log()), tmp_path / "out"
    command = ["import", path, "--radius", "80 mm", "--out", out, "--mechanism", "linear_delta"]
    assert cli.main([str(each) for each in command]) == 2
    assert "says the robot's geometry itself" in capsys.readouterr().err
    assert not out.exists()


def test_logs_of_other_motions_are_refused(tmp_path, five_bar):
    take, at, _, _ = recorded(five_bar, 1)
    _, _, times, readings = recorded(five_bar, 2)
    path = written(tmp_path, "take.csv", motive_csv(take, at))
    encoders = written(tmp_path, "encoders.csv", encoders_csv(times, readings[::-1]))
    with pytest.raises(SymkinError, match=r"not alike|share no rest|not of one motion"):
        import_log(path, encoders, mechanism=five_bar)


@pytest.mark.parametrize("kept", [slice(None, 950), slice(900, None), slice(500, 1500)])
def test_a_take_may_begin_and_end_anywhere_in_the_encoders_log(tmp_path, five_bar, kept):
    take, at, times, readings = recorded(five_bar)
    path = written(tmp_path, "take.csv", motive_csv(take[kept], at[kept]))
    encoders = written(tmp_path, "encoders.csv", encoders_csv(times, readings))
    found = import_log(path, encoders, mechanism=five_bar)
    poses = np.column_stack([found.columns["x_m"], found.columns["y_m"]])
    psi = np.column_stack([found.columns["psi_1_rad"], found.columns["psi_2_rad"]])
    assert len(poses) >= 4
    assert np.abs(poses - five_bar.forward_kinematics(psi)[0]).max() < 3e-4


def test_logs_in_other_units_than_they_say_are_refused_and_the_file_named(tmp_path, five_bar):
    take, at, times, readings = recorded(five_bar)
    said = motive_csv(take, at)
    path = written(tmp_path, "take.csv", said)
    metres = written(tmp_path, "metres.csv", said.replace("Millimeters", "Meters"))
    told = encoders_csv(times, readings)
    encoders = written(tmp_path, "encoders.csv", told)
    degrees = written(tmp_path, "degrees.csv", encoders_csv(times, np.degrees(readings)))
    one = [line.rpartition(",")[0] for line in told.splitlines()]
    for first, second, words in (
        (metres, encoders, r"encoders.csv: .*1e\+03 times as far apart"),
        (path, degrees, "degrees.csv: .*not in the units"),
        (path, written(tmp_path, "one.csv", "\n".join(one)), "one.csv: has no readings of leg 2"),
        (
            path,
            written(tmp_path, "twice.csv", told + told.partition("\n")[2]),
            "twice.csv: the times of a log",
        ),
    ):
        with pytest.raises(SymkinError, match=words):
            import_log(first, second, mechanism=five_bar)


def test_a_take_beside_encoders_needs_the_robot(tmp_path, five_bar):
    take, at, times, readings = recorded(five_bar)
    path = written(tmp_path, "take.csv", motive_csv(take, at))
    encoders = written(tmp_path, "encoders.csv", encoders_csv(times, readings))
    with pytest.raises(SymkinError, match="--mechanism"):
        import_log(path, encoders)
    with pytest.raises(SymkinError, match='no rigid body "other"; expected plate'):
        import_log(path, encoders, mechanism=five_bar, body="other")


def test_a_take_alone_is_a_row_a_sample(tmp_path, five_bar):
    take, at, _, _ = recorded(five_bar)
    said = motive_csv(take[:50], at[:50], lost=0)
    found = import_log(written(tmp_path, "take.csv", said))
    other = said.replace(",", ";").replace(".", ",")  # as a German sheet has it
    semicolons = import_log(written(tmp_path, "german.csv", other))
    for name, values in found.columns.items():
        assert semicolons.columns[name] == pytest.approx(values)
    assert found.columns["x_m"] == pytest.approx(at[:50, 0], abs=1e-6)
    assert found.columns["y_m"] == pytest.approx(at[:50, 1], abs=1e-6)  # z is up
    assert found.columns["qw"] == pytest.approx(np.ones(50))


VICON = """Segments
100
,,Global Angle robot:plate,,,Global Translation robot:plate,,
Frame,Sub Frame,RX,RY,RZ,TX,TY,TZ
,,deg,deg,deg,mm,mm,mm
1,0,0,0,90,100,200,300
2,0,0,0,90,101,200,300
3,0,,,,,,
4,0,0,0,90,103,200,300
"""


def test_vicon_has_rotation_vectors_and_millimetres(tmp_path):
    found = import_log(written(tmp_path, "vicon.csv", VICON))
    assert found.columns["x_m"][[0, 1, 3]] == pytest.approx([0.1, 0.101, 0.103])
    assert np.isnan(found.columns["x_m"][2])
    assert found.columns["time_s"] == pytest.approx([0, 0.01, 0.02, 0.03])
    assert found.columns["qz"][0] == pytest.approx(np.sqrt(0.5))


MARKERS = """Trajectories
200
,,robot:a,,,robot:b,,
Frame,Sub Frame,X,Y,Z,X,Y,Z
,,mm,mm,mm,mm,mm,mm
10,0,1,2,3,4,5,6
11,0,1,2,3,4,5,6
"""


def test_vicon_markers_become_points(tmp_path):
    found = import_log(written(tmp_path, "markers.csv", MARKERS))
    assert found.columns["p2_z_m"] == pytest.approx([6e-3, 6e-3])
    assert found.columns["time_s"][1] == pytest.approx(0.005)


def test_lengths_of_vicon_in_another_unit_are_refused(tmp_path):
    log = MARKERS.replace("mm,mm,mm,mm", "mm,mm,in,mm")
    with pytest.raises(SymkinError, match='has lengths in "in"; expected mm, cm or m'):
        import_log(written(tmp_path, "inches.csv", log))
    found = import_log(written(tmp_path, "bare.csv", MARKERS.replace("mm", "")))
    assert found.columns["p2_z_m"] == pytest.approx([6, 6])


def test_topics_of_a_ros_bag_are_joined_too(tmp_path, five_bar):
    take, at, times, readings = recorded(five_bar)
    poses = [
        "%time,field.header.seq,field.header.frame_id,field.pose.position.x,"
        "field.pose.position.y,field.pose.position.z,field.pose.orientation.x,"
        "field.pose.orientation.y,field.pose.orientation.z,field.pose.orientation.w"
    ]
    for i, (t, (x, y)) in enumerate(zip(take, at, strict=True)):
        poses.append(f"{round(1e9 * (t + 1000))},{i},world,{x:.6f},{y:.6f},0,0,0,0,1")
    joints = ["%time,field.header.seq,field.name0,field.name1,field.position0,field.position1"]
    for i, (t, (a, b)) in enumerate(zip(times, readings, strict=True)):
        joints.append(f"{round(1e9 * (t + 1000))},{i},left,right,{a:.8f},{b:.8f}")
    path = written(tmp_path, "pose.csv", "\n".join(poses) + "\n")
    beside = written(tmp_path, "joints.csv", "\n".join(joints) + "\n")
    found = import_log(path, beside, mechanism=five_bar)
    assert len(found.columns["psi_1_rad"]) == 10
    assert any("field.header.seq" in each for each in found.left)
    with pytest.raises(SymkinError, match=r"position\.x"):
        import_log(beside)
    stamped = ["header.stamp.sec,header.stamp.nanosec,header.frame_id," + poses[0][50:]]
    for (_, *own), t in zip((row.split(",") for row in poses[1:]), take, strict=True):
        stamped.append(f"{int(t) + 1700000000},{round(1e9 * (t % 1)) % 10**9},{','.join(own[1:])}")
    shown = ["header.stamp.sec,header.stamp.nanosec,position[0],position[1]"]
    for t, (a, b) in zip(times, readings, strict=True):
        shown.append(f"{int(t // 1)},{int(1e9 * (t % 1))},{a:.8f},{b:.8f}")
    second = import_log(
        written(tmp_path, "ros2.csv", "\n".join(stamped)),
        written(tmp_path, "shown.csv", "\n".join(shown)),
        mechanism=five_bar,
    )
    for name, values in found.columns.items():
        assert second.columns[name] == pytest.approx(values, abs=1e-6)


def test_json_records_are_flattened(tmp_path):
    records = [
        {"position": {"x_mm": 1.5, "y_mm": 2}, "psi": [0.1, 0.2], "note": "a"},
        {"position": {"x_mm": 2.5, "y_mm": None}, "psi": [0.3, 0.4], "note": "b"},
    ]
    path = written(tmp_path, "log.json", json.dumps({"robot": "r", "rows": records}))
    found = import_log(path)
    assert found.columns["position_x_mm"] == pytest.approx([1.5, 2.5])
    assert np.isnan(found.columns["position_y_mm"][1])
    assert found.columns["psi_2"] == pytest.approx([0.2, 0.4])
    assert any("note" in each for each in found.left)
    assert any("robot" in each for each in found.left)
    lines = written(tmp_path, "log.jsonl", "\n".join(json.dumps(each) for each in records))
    assert import_log(lines).columns["psi_1"] == pytest.approx([0.1, 0.3])


def test_a_stray_line_among_records_is_told_and_left_out(tmp_path):
    records = [json.dumps({"x_mm": k, "psi_1": 0.1 * k}) for k in range(12)]
    stray = "\n".join(["# began at 10:00", *records[:5], "lost", *records[5:]])
    with pytest.raises(SymkinError, match=r"stray\.jsonl: lines 1, 7 are no records as JSON"):
        import_log(written(tmp_path, "stray.jsonl", stray))
    told = written(tmp_path, "told.jsonl", stray.replace("# began at 10:00\n", ""))
    found = import_log(told)
    assert found.columns["x_mm"] == pytest.approx(np.arange(12))
    assert found.left == ("line 6, which is no record as JSON",)


def test_a_sheet_of_excel_is_found_below_its_notes(tmp_path):
    openpyxl = pytest.importorskip("openpyxl")
    book = openpyxl.Workbook()
    book.active.title = "cover"
    book.active["A1"] = "Calibration"
    sheet = book.create_sheet("data")
    for row in (["measured on Monday"], [], ["x_mm", "y_mm", "remark"], [1, 2.5, "a"],
                [3, None, "b"], [], ["mean", 2, None]):  # fmt: skip
        sheet.append(row)
    path = tmp_path / "book.xlsx"
    book.save(path)
    found = import_log(path)
    assert found.columns["x_mm"] == pytest.approx([1, 3])
    assert np.isnan(found.columns["y_mm"][1])
    assert any("header is row 3" in each for each in found.took)
    assert any("cover" in each for each in found.left)
    assert any("remark" in each for each in found.left)


def test_a_row_of_units_below_the_names_of_a_sheet_belongs_to_them(tmp_path):
    openpyxl = pytest.importorskip("openpyxl")
    book = openpyxl.Workbook()
    for row in (["x", "y", "psi_1"], ["mm", "mm", "°"], [1, 2.5, 10], [3, 4, 11]):
        book.active.append(row)
    book.save(tmp_path / "book.xlsx")
    found = import_log(tmp_path / "book.xlsx")
    assert list(found.columns) == ["x_mm", "y_mm", "psi_1_deg"]


CLBM = (
    "[MSG:INFO: CLBM:[{bl:2412.86,   br:2375.65,   tr:1693.47,   tl:1687.84},"
    "{bl:2400.0, br:2380.5, tr:1700.0, tl:1680.0},{bl:1.0, br:2.0}]\n"
)


def test_maslow_has_four_belts(tmp_path):
    found = import_log(written(tmp_path, "maslow.log", "Maslow_tlX: 27.0\n" + CLBM))
    assert found.columns["psi_1_mm"] == pytest.approx([1687.84, 1680.0])
    assert found.columns["psi_4_mm"] == pytest.approx([2375.65, 2380.5])
    assert any("without all four" in each for each in found.left)
    assert any("tlx 27" in each for each in found.left)


def test_what_is_no_log_is_named_with_what_there_is(tmp_path):
    with pytest.raises(SymkinError, match=r"no log that symkin knows; expected .*Marlin"):
        import_log(written(tmp_path, "x.txt", "hello\n"))
    with pytest.raises(SymkinError, match=r"missing\.log"):
        import_log(tmp_path / "missing.log")


HOSTILE = {
    "deep.json": "[" * 1 + '{"a":' + "[" * 100_000 + "]" * 100_000 + "}]",
    "half.json": '[{"a": 1',
    "numbers.json": '{"a": 1}',
    "empty.json": "[{}]",
    "nan.json": '[{"a": "NaN"}]',
    "head.csv": "Format Version,1.23\n",
    "units.csv": "Format Version,1.23,Length Units,Parsecs\n\n\n\n\n",
    "rows.csv": motive_csv([0.0, 0.1], [[0, 0], [0, 0]], lost=0) + "1,x,y,z\n",
    "rate.csv": "Trajectories\nfast\n,,a\nFrame,Sub Frame,X\n,,mm\n1,0,1\n",
    "vicon.csv": "Segments\n100\n",
    "ros.csv": "%time,field.x\n",
    "words.csv": "%time,field.pose.position.x\nsoon,1\n",
    "g33.log": "G33 Auto Calibrate\n.Height:1e999    Ex:+0.00\n.    c:+0.1\n",
    "m665.log": "M665 L1 R5 H3 S1\nBed X: 0 Y: 0 Z: 0\n",
    "far.log": "M665 L100 R50 H3 S1\nBed X: 9e9 Y: 0 Z: 0\n",
    "duet.log": "G30 P0 X0 Y0\nG32 bed probe heights: not set\n",
    "clbm.log": "CLBM:[{bl:x}]\n",
}


@pytest.mark.parametrize("name", HOSTILE)
def test_hostile_files_are_refused_in_words(tmp_path, name):
    with pytest.raises(SymkinError, match=name):
        import_log(written(tmp_path, name, HOSTILE[name]), radius=0.05)


def test_damaged_workbooks_are_refused(tmp_path):
    pytest.importorskip("openpyxl")
    made = io.BytesIO()
    with zipfile.ZipFile(made, "w") as packed:
        packed.writestr("xl/workbook.xml", "<nonsense")
    for name, data in (("a.xlsx", made.getvalue()), ("b.xlsx", b"PK\x03\x04" + b"\0" * 50)):
        (tmp_path / name).write_bytes(data)
        with pytest.raises(SymkinError, match=name):
            import_log(tmp_path / name)


def test_damaged_logs_are_read_or_refused(tmp_path):
    random = np.random.default_rng(1)
    sound = [
        marlin_log(),
        reprap_log([(0, 0), (50, 0)]),
        VICON,
        MARKERS,
        CLBM,
        motive_csv([0.0, 0.1, 0.2], [[0, 0]] * 3),
        json.dumps([{"a": 1, "b": [1, 2]}]),
    ]
    for trial in range(150):
        text = list(sound[trial % len(sound)])
        for _ in range(1 + trial % 4):
            at = int(random.integers(len(text)))
            text[at : at + int(random.integers(0, 12))] = random.choice(
                ["", "9", ",", "\n", "-", "e", "[", "\x00", "1e400", ":"]
            )
        path = written(tmp_path, "damaged.log", "".join(text))
        said = ""
        try:
            import_log(path, radius=0.08)
        except SymkinError as error:
            said = str(error)
        assert not said or "damaged.log" in said


def test_every_format_has_a_name_of_its_own():
    names = [each.name for each in FORMATS]
    assert len(set(names)) == len(names)


def listed(names, unit=" [mm]", hidden=()):
    """A tracker's export: a row a point, semicolons and decimal commas."""
    rows = [f"Point;X{unit};Y{unit};Z{unit};Time"]
    for k, name in enumerate(names):
        if k not in hidden:
            rows.append(f"{name};{k},5;{2 * k},25;-{k},0;10:00:{k:02d}")
    return "\n".join(rows) + "\n"


NAMED = [f"A::Pose{pose:03d}::SMR{point}" for pose in (7, 8, 9, 10) for point in (1, 2, 3)]
READ = "no;psi_1_mm;psi_2_mm\n8;1,5;2,5\n7;3,5;4,5\n9;5,5;6,5\n10;7,5;8,5\n"


def test_a_trackers_list_of_points_becomes_a_row_a_pose_with_its_readings(tmp_path):
    log = written(tmp_path, "tracker.txt", listed(NAMED, hidden=(4,)))
    found = import_log(log, written(tmp_path, "read.csv", READ))
    np.testing.assert_array_equal(found.columns["p1_x_mm"], [3.5, 0.5, 6.5, 9.5])
    np.testing.assert_array_equal(found.columns["p2_y_mm"], [np.nan, 2.25, 14.25, 20.25])
    np.testing.assert_array_equal(found.columns["p3_z_mm"], [-5.0, -2.0, -8.0, -11.0])
    np.testing.assert_array_equal(found.columns["psi_2_mm"], [2.5, 4.5, 6.5, 8.5])
    np.testing.assert_array_equal(found.columns["pose"], [8, 7, 9, 10])
    assert found.took[0].endswith("11 of which were seen")
    assert found.took[1].endswith("by no")
    assert found.left == ("columns Time of the list",)


def test_names_of_points_that_come_again_begin_the_next_pose(tmp_path):
    names = ["left", "right", "top", "left", "top", "left", "right"]
    found = import_log(written(tmp_path, "tracker.txt", listed(names)))
    np.testing.assert_array_equal(found.columns["p1_x_mm"], [0.5, 3.5, 5.5])
    np.testing.assert_array_equal(found.columns["p2_x_mm"], [1.5, np.nan, 6.5])
    np.testing.assert_array_equal(found.columns["p3_x_mm"], [2.5, 4.5, np.nan])


def test_a_cameras_list_has_no_z(tmp_path):
    text = "marker,pose,X (mm),Y (mm)\nA,1,1,2\nB,1,3,4\nA,2,5,6\nB,2,7,8\nA,3,9,10\n"
    found = import_log(written(tmp_path, "camera.csv", text))
    assert sorted(found.columns) == ["p1_x_mm", "p1_y_mm", "p2_x_mm", "p2_y_mm", "pose"]
    np.testing.assert_array_equal(found.columns["p2_y_mm"], [4, 8, np.nan])


@pytest.mark.parametrize(
    ("names", "unit", "beside", "said"),
    [
        (NAMED, "", None, "does not say in which unit"),
        (NAMED[:3] + NAMED, " [mm]", None, "has point 1 of pose 7 twice"),
        ([*NAMED, "SMR 1"], " [mm]", None, "unequally many words"),
        ([f"P{i} S{i % 3} T{i % 2}" for i in range(9)], " [mm]", None, "3 words that change"),
        (["P1 S1", "P1 S2", "P2 S1", "P2 S2"], " [mm]", None, "as many poses as points"),
        (["SMR"] * 4, " [mm]", None, "the same name in all rows"),
        (NAMED, " [mm]", "psi_1_mm\n1\n2\n", "has 2 rows, and the list 4 poses"),
        (NAMED, " [mm]", "no,psi_1_mm\n7,1\n7,2\n", "has a pose twice"),
    ],
)
def test_lists_that_leave_a_choice_are_refused(tmp_path, names, unit, beside, said):
    log = written(tmp_path, "tracker.txt", listed(names, unit))
    other = None if beside is None else written(tmp_path, "read.csv", beside)
    with pytest.raises(SymkinError, match=said):
        import_log(log, other)
