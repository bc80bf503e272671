# SPDX-License-Identifier: MIT
"""Many robots of one drawing."""

import csv
import dataclasses
import json
from pathlib import Path

import numpy as np
import pytest

import symkin
from symkin.cli import main
from symkin.data.measurements import Measurements
from symkin.data.reading import read_fleet
from symkin.data.writing import measurement_columns
from symkin.errors import MeasurementError, SymkinError
from symkin.estimate import EstimateOptions, Fleet
from symkin.estimate.fleet_sources import robots_of_files
from symkin.model.framing import framed
from symkin.model.settings import Frames, IdentificationSettings, NoiseSettings
from symkin.shell import typed_word, words_of
from symkin.storage.tables import write_table


@pytest.fixture(scope="module")
def mechanism() -> symkin.Mechanism:
    return symkin.load_mechanism("3RRR")


@pytest.fixture(scope="module")
def robots(mechanism: symkin.Mechanism) -> dict[str, Measurements]:
    candidates = symkin.sample_workspace(mechanism, 2000, seed=1)
    plan = symkin.make_plan(mechanism, candidates, 16)
    return {
        f"robot {seed}": symkin.simulate(mechanism, plan, seed=seed).measurements
        for seed in range(1, 7)
    }


def test_a_robot_of_a_fleet_is_identified_as_it_is_alone(mechanism, robots):
    for estimator, poses in (("implicit", "own"), ("inverse", "all"), ("joint", "all")):
        fleet = symkin.identify_many(mechanism, robots, estimator, poses=poses)
        for row, measured in ((0, robots["robot 1"]), (5, robots["robot 6"])):
            alone = symkin.identify(mechanism, measured, estimator, poses=poses)
            # A fleet has its own solver, a robot alone that of Ceres.
            errors = fleet.parameters[row] - alone.mechanism.parameters
            np.testing.assert_array_less(np.abs(errors), 1e-6 * alone.deviations)
            np.testing.assert_allclose(fleet.deviations[row], alone.deviations, rtol=1e-6)
            np.testing.assert_allclose(
                fleet.chi_square[row], [fit.chi_square for fit in alone.goodness], rtol=1e-6
            )
        assert fleet.robots == tuple(robots)
        assert set(fleet.verdicts) == {"fits"}


def test_a_fleet_is_measured_in_its_devices_frame(mechanism, robots):
    placed = mechanism.replace(frames=Frames(base=(1.0, -0.5, 3.0), target=(0.05, 0.0, 0.17)))
    shorter = {
        name: each.subset(np.arange(len(each.poses) - left))
        for left, (name, each) in enumerate(robots.items())
    }
    seen = {
        name: dataclasses.replace(each, poses=framed(placed, each.poses))
        for name, each in shorter.items()
    }
    found = symkin.identify_many(placed, seen)
    known = symkin.identify_many(mechanism, shorter)
    np.testing.assert_allclose(found.parameters, known.parameters, rtol=0, atol=1e-12)
    np.testing.assert_allclose(found.deviations, known.deviations, rtol=1e-9)


@pytest.mark.parametrize("said", ["argument", "file"])
def test_of_which_errors_is_told_leaves_a_fleet_leg_by_leg(mechanism, robots, said):
    settings = dataclasses.replace(mechanism.identification or IdentificationSettings(), of="x")
    asked = {"of": "x"} if said == "argument" else {}
    drawn = mechanism if asked else mechanism.replace(identification=settings)
    found = symkin.identify_many(drawn, robots, **asked)
    assert (found.options.of, found.options.estimator) == ("x", "implicit")
    plain = symkin.identify_many(mechanism, robots)
    np.testing.assert_array_equal(found.parameters, plain.parameters)
    with pytest.raises(symkin.SymkinError, match=r"no .z"):
        symkin.identify_many(mechanism, robots, of="z")


def test_a_failed_robot_is_a_row_that_says_why(mechanism, robots):
    few = robots["robot 2"].subset(np.arange(5))
    still = dataclasses.replace(
        robots["robot 3"], readings=np.full_like(robots["robot 3"].readings, 0.3)
    )
    flat = Measurements.of(np.zeros((20, 2)), np.zeros((20, 3)))
    spoilt = robots | {"robot 2": few, "robot 3": still, "robot 4": flat}
    fleet = symkin.identify_many(mechanism, spoilt)
    assert fleet.verdicts == ("fits", "failed", "failed", "failed", "fits", "fits")
    assert "need at least as many" in fleet.failures[1]
    assert "do not show all" in fleet.failures[2]
    assert "poses of 2 coordinates" in fleet.failures[3]
    assert np.isnan(fleet.parameters[1:4]).all()
    assert np.isnan(fleet.chi_square[1:4]).all()
    sound = symkin.identify_many(mechanism, robots)
    np.testing.assert_array_equal(fleet.parameters[4:], sound.parameters[4:])
    assert "robot 3" in fleet.text()


def test_what_speaks_against_a_robot_of_a_fleet_is_what_does_alone(mechanism, robots):
    one, two = robots["robot 1"], robots["robot 2"]
    exchanged = dataclasses.replace(two, readings=two.readings[:, [1, 0, 2]])
    nudged = np.array(one.readings)
    nudged[3, 1] += 0.01
    fleet = {"a": one, "b": dataclasses.replace(one, readings=nudged), "c": exchanged}
    found = symkin.identify_many(mechanism, fleet)
    assert found.verdicts[:2] == ("fits", "doubtful")
    for doubts, measured in zip(found.doubts, fleet.values(), strict=True):
        assert doubts == symkin.identify(mechanism, measured).doubts
    assert [doubt.code for doubt in found.doubts[2]] == ["columns-exchanged"]
    assert found.columns()["doubt_codes"][2] == "columns-exchanged"
    assert found.to_dict()["doubts"][2][0]["legs"] == [1, 2]
    assert "c: likely cause: the readings of legs 1, 2 are in the columns" in found.text()
    loud = NoiseSettings(position=1e-3, orientation=1e-3)
    quiet = symkin.identify_many(mechanism, {"a": one}, noise=loud)
    assert quiet.doubts[0] == symkin.identify(mechanism, one, noise=loud).doubts
    assert "residuals-small" in {doubt.code for doubt in quiet.doubts[0]}


def test_of_many_doubtful_robots_the_first_are_looked_into(mechanism, robots, monkeypatch):
    monkeypatch.setattr("symkin.estimate.fleet_doubts._EXAMINED", 1)
    moved = mechanism.parameters.copy()
    moved[1, 0] += 0.02
    other = mechanism.replace(symmetry=None).with_parameters(moved)
    two = {name: robots[name] for name in ("robot 1", "robot 2")}
    first, second = symkin.identify_many(other, two).doubts
    assert first == symkin.identify(other, robots["robot 1"]).doubts != ()
    assert [doubt.code for doubt in second] == ["not-examined"]


def test_a_cause_that_most_robots_have_is_told_once_with_the_drawing_that_mends_it(
    mechanism, robots, tmp_path, capsys
):
    zero = list(mechanism.parameter_names).index("sensor_offset")
    moved = mechanism.parameters.copy()
    moved[1, zero] += 0.05
    other = mechanism.replace(symmetry=None).with_parameters(moved)
    found = symkin.identify_many(other, robots)
    (note,) = (note for note in found.notes if note.code == "cause-shared")
    assert note.legs == (1,)
    assert note.figures["count"] == len(robots)
    assert found.redrawn is not None
    assert np.abs(found.redrawn.parameters - mechanism.parameters).max() < 0.005
    assert set(symkin.identify_many(found.redrawn, robots).verdicts) == {"fits"}
    assert found.text().count("likely cause") == 1
    table, drawing = tmp_path / "all.csv", tmp_path / "moved.toml"
    columns = [measurement_columns(each, mechanism) for each in robots.values()]
    named = {"robot": np.repeat([*robots], [len(each) for each in robots.values()])}
    joined = {name: np.concatenate([each[name] for each in columns]) for name in columns[0]}
    write_table(table, named | joined)
    symkin.save_mechanism(other, drawing)
    out = tmp_path / "out"
    assert main(["identify-batch", str(drawing), str(table), "--out", str(out)]) == 0
    assert "corrected.toml" in capsys.readouterr().out
    again = symkin.identify_many(str(out / "corrected.toml"), str(table))
    assert set(again.verdicts) == {"fits"}
    # Of robots with causes of their own there is none that they share.
    swapped = {
        name: dataclasses.replace(each, readings=each.readings[:, order])
        for (name, each), order in zip(
            robots.items(), ([1, 0, 2], [0, 2, 1], [2, 1, 0], [0, 1, 2]), strict=False
        )
    }
    own = symkin.identify_many(mechanism, swapped)
    assert own.redrawn is None
    assert "cause-shared" not in {note.code for note in own.notes}


def test_robots_that_hardly_show_a_parameter_are_doubted_where_it_matters(monkeypatch):
    drawn = symkin.load("5bar")
    exact = drawn.replace(tolerances=dataclasses.replace(drawn.tolerances, gain=1e-5))
    plan = exact.plan(9, candidates=1000, spares=0)
    thin = {f"{seed}": exact.simulate(plan, seed).measurements for seed in range(1, 9)}
    alone = [symkin.identify(exact, each) for each in thin.values()]
    for each in alone:
        assert "parameters-unneeded" in {note.code for note in each.notes}
    monkeypatch.setattr("symkin.estimate.fleet_doubts._EXAMINED", 2)
    found = symkin.identify_many(exact, thin)
    trusted = ["fits" if each.trustworthy else "doubtful" for each in alone]
    assert list(found.verdicts) == trusted == ["fits"] * 8


def test_robots_whose_poses_are_not_whole_are_identified_together(mechanism, robots):
    def without(measured, rows):
        poses = np.array(measured.poses)
        poses[rows, 2] = np.nan
        return dataclasses.replace(measured, poses=poses)

    positions = {name: without(each, slice(None)) for name, each in robots.items()}
    found = symkin.identify_many(mechanism, positions)
    assert found.options.estimator == "joint"
    alone = symkin.identify(mechanism, positions["robot 2"])
    np.testing.assert_array_equal(found.parameters[1], alone.mechanism.parameters)
    assert found.doubts[1] == alone.doubts
    some = robots | {"robot 2": without(robots["robot 2"], 3)}
    by_leg = symkin.identify_many(mechanism, some)
    assert by_leg.verdicts.count("failed") == 1
    assert "has no measured phi" in by_leg.failures[1]
    assert '"joint"' in by_leg.failures[1]
    both = symkin.identify_many(mechanism, some, "joint")
    whole = symkin.identify_many(mechanism, robots, "joint")
    assert set(both.verdicts) == {"fits"}
    np.testing.assert_array_equal(both.parameters[[0, 2]], whole.parameters[[0, 2]])
    alone = symkin.identify(mechanism, some["robot 2"])
    np.testing.assert_array_equal(both.parameters[1], alone.mechanism.parameters)
    with pytest.raises(SymkinError, match='"implicit" looks at each leg by itself'):
        symkin.identify_many(mechanism, positions, "implicit")


def test_an_estimate_that_is_no_mechanism_fails(mechanism, robots):
    # Zeros half a turn off: from there the length of a crank comes out negative.
    turned = dataclasses.replace(robots["robot 2"], readings=robots["robot 2"].readings + np.pi)
    for estimator in ("implicit", "joint"):
        found = symkin.identify_many(mechanism, robots | {"robot 2": turned}, estimator)
        assert found.verdicts == ("fits", "failed", "fits", "fits", "fits", "fits")
        assert "leg 2 of chain [R]RR: proximal_length = -1.5" in found.failures[1]
        assert "with another sign, zero or working mode" in found.failures[1]


def test_a_robot_that_has_not_converged_fails(mechanism, robots):
    names = list(mechanism.parameter_names)
    other = mechanism.parameters.copy()
    other[:, names.index("proximal_length")] *= 0.02
    start = mechanism.replace(symmetry=None, workspace=None).with_parameters(other)
    two = {name: robots[name] for name in ("robot 1", "robot 2")}
    found = symkin.identify_many(start, two, max_iterations=3)
    assert set(found.verdicts) <= {"failed", "doubtful"}
    assert any("no convergence in 3 steps" in failure for failure in found.failures)


def test_the_table_is_the_same_on_any_number_of_threads_and_in_dask(mechanism, robots, tmp_path):
    many = {f"{name} {copy}": each for name, each in robots.items() for copy in range(60)}
    tables = []
    for how in ({"threads": 1}, {"threads": 2}, {"workers": 2}):
        fleet = symkin.identify_many(mechanism, many, **how)
        path = fleet.write(tmp_path / str(len(tables)))
        tables.append(path.read_bytes())
    assert tables[0] == tables[1] == tables[2]


@pytest.mark.parametrize("name", ["all.csv", "all.parquet"])
def test_one_table_with_a_column_robot_is_a_fleet(mechanism, robots, tmp_path, name):
    parts = [measurement_columns(each, "rad") for each in robots.values()]
    together = {key: np.concatenate([part[key] for part in parts]) for key in parts[0]}
    names = [robot for robot, each in robots.items() for _ in range(len(each.poses))]
    order = np.random.default_rng(1).permutation(len(names))
    shuffled = {key: values[order] for key, values in together.items()}
    labels = np.array(names)[order]
    if name == "all.parquet":  # numbers
        labels = np.array([int(label[-1]) for label in labels])
    write_table(tmp_path / name, {"robot": labels.tolist(), **shuffled})
    fleet = symkin.identify_many(mechanism, tmp_path / name)
    expected = symkin.identify_many(mechanism, robots)
    assert fleet.robots == tuple(dict.fromkeys(map(str, labels)))
    for row, robot in enumerate(fleet.robots):
        np.testing.assert_allclose(
            fleet.parameters[row], expected.parameters[int(robot[-1]) - 1], atol=1e-9
        )
    with pytest.raises(MeasurementError, match="the name or number of the robot"):
        read_fleet(dict(together), mechanism)


@pytest.fixture
def small_parts(monkeypatch):
    monkeypatch.setattr("symkin.storage.table_blocks._CSV_BYTES", 3000)
    monkeypatch.setattr("symkin.storage.table_blocks._PARQUET_ROWS", 20)
    monkeypatch.setattr("symkin.estimate.fleet_sources._ROWS", 1)


def table_of(robots, path, order=None, **others):
    parts = [measurement_columns(each, "rad") for each in robots.values()]
    columns = {key: np.concatenate([part[key] for part in parts]) for key in parts[0]}
    labels = np.array([robot for robot, each in robots.items() for _ in range(len(each))])
    columns = {"robot": labels, **columns, "remark": np.zeros(len(labels)), **others}
    order = slice(None) if order is None else order
    write_table(path, {key: values[order] for key, values in columns.items()})
    return path


@pytest.mark.usefixtures("small_parts")
@pytest.mark.parametrize("name", ["all.csv", "all.csv.gz", "all.parquet"])
def test_a_table_read_in_parts_gives_the_same_fleet(mechanism, robots, tmp_path, monkeypatch, name):
    nudged = np.array(robots["robot 2"].readings)
    nudged[3, 1] += 0.01
    some = robots | {
        "robot 2": dataclasses.replace(robots["robot 2"], readings=nudged),
        'the "5th", \N{LATIN SMALL LETTER U WITH DIAERESIS}': robots["robot 5"],
        "robot 6": robots["robot 6"].subset(np.arange(5)),
    }
    path = table_of(some, tmp_path / name)
    parts = list(robots_of_files(mechanism, [path]))
    assert len(parts) > 3
    in_parts = symkin.identify_many(mechanism, path, tolerances="estimate")
    monkeypatch.setattr("symkin.storage.table_blocks._CSV_BYTES", 10**7)
    monkeypatch.setattr("symkin.storage.table_blocks._PARQUET_ROWS", 10**5)
    assert len(list(robots_of_files(mechanism, [path]))) == 1
    whole = symkin.identify_many(mechanism, path, tolerances="estimate")
    assert whole.verdicts == ("fits", "doubtful", "fits", "fits", "fits", "failed", "fits")
    assert in_parts == dataclasses.replace(whole, seconds=in_parts.seconds)
    assert in_parts.notes == whole.notes
    assert in_parts.made_within


@pytest.mark.usefixtures("small_parts")
@pytest.mark.parametrize("name", ["all.csv", "all.parquet"])
def test_numbers_of_rows_are_used_once_in_a_table_read_in_parts(
    mechanism, robots, tmp_path, monkeypatch, name
):
    # Each robot's in an order of their own, those of later robots below those before.
    own = np.arange(sum(map(len, robots.values()))).reshape(len(robots), -1)
    numbers = np.random.default_rng(1).permuted(own[::-1], axis=1).ravel()
    none = np.full(len(numbers), np.nan)
    for last, refused in ((numbers[-1], False), (numbers[-2], True), (numbers[3], True)):
        given = {"row": np.append(numbers[:-1], last), "pair1_row": none, "pair1_height_m": none}
        path = table_of(robots, tmp_path / name, **given)
        said = []
        for size in (1, 10**4):
            monkeypatch.setattr("symkin.storage.table_blocks._CSV_BYTES", 3000 * size)
            monkeypatch.setattr("symkin.storage.table_blocks._PARQUET_ROWS", 20 * size)
            try:
                assert (len(list(robots_of_files(mechanism, [path]))) > 3) == (size == 1)
                said.append("")
            except MeasurementError as error:
                said.append(str(error))
        assert said[0] == said[1]
        assert (f'has {last} in column "row", as another row has' in said[0]) == refused


@pytest.mark.usefixtures("small_parts")
def test_rows_of_a_robot_that_are_apart_are_gathered_and_told(mechanism, robots, tmp_path):
    count = sum(map(len, robots.values()))
    order = np.random.default_rng(1).permutation(count)
    apart = symkin.identify_many(mechanism, table_of(robots, tmp_path / "all.csv", order))
    assert [note.code for note in apart.notes] == ["screened", "columns-unread", "rows-apart"]
    together = symkin.identify_many(mechanism, robots)
    for row, robot in enumerate(apart.robots):
        known = together.parameters[list(robots).index(robot)]
        np.testing.assert_allclose(apart.parameters[row], known, atol=1e-9)


@pytest.mark.usefixtures("small_parts")
def test_what_is_wrong_far_down_a_table_is_named_by_its_line(mechanism, robots, tmp_path, capsys):
    path = table_of(robots, tmp_path / "all.csv")
    lines = path.read_text().splitlines()
    row = len(lines) - 3
    for spoilt, said in (
        (lines[row - 1].replace(",", ",x", 1), f'row {row} has "x'),
        (lines[row - 1] + ",1", f"row {row} has"),
    ):
        path.write_text("\n".join(["# by hand", *lines[: row - 2], spoilt, *lines[row:]]))
        with pytest.raises(MeasurementError, match=said):
            symkin.identify_many(mechanism, path)
        assert main(["identify-batch", "3RRR", str(path)]) != 0
        told = capsys.readouterr()
        assert said in " ".join((told.out + told.err).split())


@pytest.mark.parametrize("name", ["all.csv", "all.csv.gz", "all.parquet"])
def test_a_robot_of_a_table_of_many_is_read_by_its_name(mechanism, robots, tmp_path, name):
    order = np.random.default_rng(1).permutation(sum(map(len, robots.values())))
    path = table_of(robots, tmp_path / name, order)
    by_name = read_fleet(path, mechanism)
    assert [each.robot for each in by_name.values()] == list(by_name)
    for robot, expected in by_name.items():
        read = symkin.read_measurements(path, mechanism, robot=robot)
        assert read == expected
        assert (read.robot, read.source) == (robot, path)
        assert read.unread == expected.unread == ("remark",)
        np.testing.assert_array_equal(read.row_numbers, expected.row_numbers)
    with pytest.raises(MeasurementError, match=r'"robot 9" in column "robot"; did you mean "robot'):
        symkin.read_measurements(path, mechanism, robot="robot 9")
    with pytest.raises(
        MeasurementError, match=r'"x" in column "robot" \(there are robot .* 1 more'
    ):
        symkin.read_measurements(path, mechanism, robot="x")
    with pytest.raises(SymkinError, match="robot is 3; expected a text"):
        symkin.read_measurements(path, mechanism, robot=3)
    with pytest.raises(MeasurementError, match=r"rows of 6 robots.* --robot 'robot \d', in Python"):
        symkin.read_measurements(path, mechanism)


def test_what_is_wrong_with_other_robots_of_a_table_is_theirs(mechanism, robots, tmp_path):
    path = table_of(robots, tmp_path / "all.csv")
    lines = path.read_text().splitlines()
    lines[-1] = ",".join([*lines[-1].split(",")[:-2], "none", "0"])
    path.write_text("\n".join(lines) + "\n")
    first = symkin.read_measurements(path, mechanism, robot="robot 1")
    np.testing.assert_array_equal(first.readings, robots["robot 1"].readings)
    with pytest.raises(
        MeasurementError, match=f'row {len(lines)} has "none" in column "psi_3_rad"'
    ):
        symkin.read_measurements(path, mechanism, robot="robot 6")


def test_tries_of_a_robot_that_were_taken_back_are_its_own(mechanism, robots):
    columns = symkin.Measurements.columns(robots["robot 1"], mechanism)
    count = len(robots["robot 1"])
    status = ["ok"] * (2 * count)
    status[1] = "undone"  # the second row of the first robot
    table = {name: np.tile(values, 2) for name, values in columns.items()}
    table |= {"robot": np.repeat(["a", "b"], count), "row": np.tile(np.arange(1, count + 1), 2)}
    table["status"] = np.array(status)
    for robot, kept in (("a", count - 1), ("b", count)):
        assert len(symkin.read_measurements(table, mechanism, robot=robot)) == kept
    assert {robot: len(each) for robot, each in read_fleet(table, mechanism).items()} == {
        "a": count - 1, "b": count,
    }  # fmt: skip
    table["status"] = np.repeat(["undone", "ok"], count)
    with pytest.raises(MeasurementError, match='no row of robot "a" counts'):
        read_fleet(table, mechanism)


def test_a_fleet_reads_tables_of_tries_as_one_robot_is_read(mechanism, robots, tmp_path):
    columns = symkin.Measurements.columns(robots["robot 1"], mechanism)
    count = len(robots["robot 1"])
    table = {name: np.append(values, values[-1]) for name, values in columns.items()}
    table |= {"row": [*range(1, count + 1), 3], "status": ["ok"] * count + ["undone"]}
    write_table(tmp_path / "one.csv", table)
    read = symkin.read_measurements(tmp_path / "one.csv", mechanism)
    assert len(read) == count - 1
    assert next(robots_of_files(mechanism, [tmp_path / "one.csv"])) == {"one": read}
    # What takes a row back may stand far below it, behind other robots.
    lines = [{name: values[line] for name, values in table.items()} for line in range(count + 1)]
    rows = [
        *({"robot": "a", **line} for line in lines[:-1]),
        *({"robot": "b", **line} for line in lines[:-1]),
        {"robot": "a", **lines[-1]},
    ]
    write_table(tmp_path / "all.csv", {name: [row[name] for row in rows] for name in rows[0]})
    fleet = symkin.identify_many(mechanism, tmp_path / "all.csv")
    alone = symkin.identify_many(mechanism, {"a": read, "b": robots["robot 1"]})
    np.testing.assert_array_equal(fleet.parameters, alone.parameters)


@pytest.mark.parametrize("column", ["serial", "SN"])
def test_a_robot_is_read_by_another_column_that_names_robots(mechanism, robots, tmp_path, column):
    path = table_of(robots, tmp_path / "all.csv")
    path.write_text(path.read_text().replace("robot,", f"{column},", 1))
    with pytest.raises(MeasurementError, match=f'"{column}" is not read, and has 6.*--robot'):
        symkin.read_measurements(path, mechanism)
    read = symkin.read_measurements(path, mechanism, robot="robot 2")
    np.testing.assert_array_equal(read.readings, robots["robot 2"].readings)
    assert read.unread == ("remark",)
    path.write_text(path.read_text().replace(f"{column},", "who,", 1))
    with pytest.raises(MeasurementError, match=r'column "robot" .* is missing'):
        symkin.read_measurements(path, mechanism, robot="robot 2")


def test_a_fleet_says_how_a_doubtful_robot_is_identified_by_itself(
    mechanism, robots, tmp_path, capsys, monkeypatch
):
    monkeypatch.setattr("symkin.estimate.fleet_doubts._EXAMINED", 1)
    loud = {
        name: dataclasses.replace(each, readings=each.readings + 1e-3 * np.sin(each.readings * 99))
        for name, each in robots.items()
        if name in ("robot 3", "robot 5")
    }
    path = table_of(robots | loud, tmp_path / "all.csv")
    fleet = symkin.identify_many(mechanism, path)
    assert [fleet["robot 3"]["verdict"], fleet["robot 5"]["doubt_codes"]] == [
        "doubtful", "not-examined",
    ]  # fmt: skip
    assert fleet.sources == {
        robot: f"{typed_word(path)} --robot '{robot}'" for robot in ("robot 3", "robot 5")
    }
    fleet.save(tmp_path / "fleet.json")
    assert symkin.read_result(tmp_path / "fleet.json").sources == fleet.sources
    command = fleet.text().splitlines()[-1].strip()
    assert command == f"symkin identify 3RRR {fleet.sources['robot 5']}"
    assert main([*words_of(command)[1:], "--json"]) == 0
    told = json.loads(capsys.readouterr().out)
    assert told["measurements"]["robot"] == "robot 5"
    alone = symkin.identify(mechanism, loud["robot 5"])
    assert told["identification"]["chi_square"] == pytest.approx(alone.chi_square, rel=1e-9)
    mapping = tmp_path / "columns.toml"
    mapping.write_text(
        'measurements = { position = ["x_m", "y_m"], angle = "phi_rad", leg = "leg", robot = "ID", '
        'readings = ["psi_1_rad", "psi_2_rad", "psi_3_rad"] }'
    )
    path.write_text(path.read_text().replace("robot,", "ID,", 1))
    mapped = symkin.identify_many(mechanism, path, columns=symkin.load_columns(mapping))
    assert mapped.sources == fleet.sources
    command = mapped.text().splitlines()[-1].strip()
    assert f"--columns {typed_word(mapping)} {fleet.sources['robot 5']}" in command
    assert main([*words_of(command)[1:], "--json"]) == 0
    again = json.loads(capsys.readouterr().out)
    assert again["identification"] == told["identification"]
    sound = symkin.identify_many(mechanism, table_of(robots, tmp_path / "sound.csv"))
    assert sound.sources == {}
    assert "Next" not in sound.text()


@pytest.mark.parametrize(
    ("names", "told"),
    [
        (("277", "00277", "278"), '"277" and "00277"'),
        (("A17", "a 17", "A017", "A170"), '"A17" and "a 17" and "A017"'),
        (("1 ", "01", "x", "X"), '"1 " and "01", "x" and "X"'),
        (("10", "1", "100", "0", "2"), None),
        (("1.05", "1.5", "1", "A1"), None),
    ],
)
def test_names_that_may_be_of_one_robot_are_told(mechanism, robots, names, told):
    fleet = symkin.identify_many(mechanism, dict(zip(names, robots.values(), strict=False)))
    notes = [str(note) for note in fleet.notes if note.code == "names-alike"]
    assert [note.partition(" differ")[0] for note in notes] == ([] if told is None else [told])
    assert fleet.robots == names  # they are as they were


def test_a_list_of_measurements_is_a_fleet_too(mechanism, robots):
    fleet = symkin.identify_many(mechanism, list(robots.values())[:2])
    assert fleet.robots == ("1", "2")
    with pytest.raises(MeasurementError, match="robot 1 is a int; expected Measurements"):
        symkin.identify_many(mechanism, [3])
    with pytest.raises(SymkinError, match="no robust loss"):
        symkin.identify_many(mechanism, robots, "paper", loss="huber")


def test_the_command_writes_a_row_a_file_and_says_what_failed(mechanism, robots, tmp_path, capsys):
    files = []
    for name in ("robot 1", "robot 2"):
        files.append(tmp_path / f"{name}.csv")
        symkin.write_measurements(robots[name], files[-1], mechanism)
    assert main(["identify-batch", "3RRR", *map(str, files), "--out", str(tmp_path / "a")]) == 0
    assert "2 of 2 robots fit" in capsys.readouterr().out
    broken = tmp_path / "broken, by hand.csv"
    broken.write_text("x_m,y_m\n1,2\n")
    arguments = ["identify-batch", "3RRR", *map(str, [*files, broken])]
    assert main([*arguments, "--out", str(tmp_path / "b")]) == 1
    said = capsys.readouterr()
    assert "1 of 3 robots" in said.err
    assert "Doubt: broken, by hand failed: " in " ".join(said.out.split())
    with (tmp_path / "b" / "fleet.csv").open(newline="") as file:
        rows = list(csv.DictReader(file))
    assert [row["robot"] for row in rows] == ["robot 1", "robot 2", "broken, by hand"]
    assert [row["verdict"] for row in rows] == ["fits", "fits", "failed"]
    assert "psi_1_rad" in rows[2]["failure"]
    assert rows[2]["base_radius_1_m"] == ""
    fleet = symkin.identify_many(mechanism, robots)
    assert float(rows[1]["base_radius_1_m"]) == pytest.approx(
        fleet.parameters[1, 0, list(mechanism.parameter_names).index("base_radius")], abs=1e-12
    )
    assert (tmp_path / "b" / "report.html").stat().st_size > 0


def test_options_are_those_of_identify():
    import inspect

    known = set(inspect.signature(symkin.identify_many).parameters)
    alone = set(inspect.signature(symkin.identify).parameters) - known
    assert alone == {each.name for each in dataclasses.fields(EstimateOptions)} - known


@pytest.mark.parametrize("asked", [{"shared": ["sensor_gain"]}, {"noise": "estimate"}])
def test_what_options_ask_of_a_fleet_is_asked_of_each_robot(mechanism, robots, asked):
    one = {"robot 1": robots["robot 1"]}
    found = Fleet.of(mechanism, [one], EstimateOptions(**asked))
    assert found.options.estimator == "joint"
    alone = symkin.identify(mechanism, robots["robot 1"], **asked)
    np.testing.assert_array_equal(found.parameters[0], alone.mechanism.parameters)


def test_files_are_named_by_their_path_where_their_names_are_alike(mechanism, robots, tmp_path):
    paths = [tmp_path / folder / "m.csv" for folder in "ab"]
    for path in paths:
        path.parent.mkdir()
        symkin.write_measurements(robots["robot 1"], path, mechanism)
    (both,) = robots_of_files(mechanism, paths)
    assert list(both) == [str(path) for path in paths]
    (one,) = robots_of_files(mechanism, [Path(paths[0])])
    assert list(one) == ["m"]


def test_several_tables_may_each_hold_many_robots(robots, tmp_path, capsys):
    names = list(robots)
    for table, held in (("a", names[:2]), ("b", names[2:4]), ("c", names[:1])):
        parts = [measurement_columns(robots[robot], "rad") for robot in held]
        together = {key: np.concatenate([part[key] for part in parts]) for key in parts[0]}
        labels = [robot for robot in held for _ in range(len(robots[robot].poses))]
        write_table(tmp_path / f"{table}.csv", {"robot": labels, **together})
    files = [str(tmp_path / f"{table}.csv") for table in "abc"]
    assert main(["identify-batch", "3RRR", *files[:2], "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["robots"] == names[:4]
    assert main(["identify-batch", "3RRR", *files]) != 0
    assert f'c.csv: robot "{names[0]}" is in a file before it, too' in capsys.readouterr().err


ASKED = {"shared": ("sensor_gain",), "fixed": ("leg3.*",), "prior": "tolerances"}


@pytest.mark.parametrize("said_in", ["arguments", "file"])
def test_a_fleet_asks_what_one_robot_is_asked(mechanism, robots, said_in):
    two = {name: robots[name] for name in ("robot 1", "robot 2")}
    asked = dict(ASKED)
    if said_in == "file":
        mechanism = mechanism.replace(identification=IdentificationSettings(**asked))
        asked = {}
    fleet = symkin.identify_many(mechanism, two, **asked)
    assert fleet.options.estimator == "joint"
    for row, measured in enumerate(two.values()):
        alone = symkin.identify(mechanism, measured, **asked)
        np.testing.assert_array_equal(fleet.parameters[row], alone.mechanism.parameters)
        assert fleet.chi_square[row] == alone.chi_square
        assert fleet.doubts[row] == alone.doubts
        assert set(map(repr, fleet.notes)) <= set(map(repr, alone.notes))
        held = np.isnan(fleet.deviations[row])
        assert held[2].all()
        np.testing.assert_array_equal(
            fleet.deviations[row][~held], alone.mechanism.deviations[~held]
        )
    gains = fleet.parameters[:, :2, list(mechanism.parameter_names).index("sensor_gain")]
    np.testing.assert_array_equal(gains[:, 0], gains[:, 1])


def test_a_fleet_whose_frames_are_unknown_has_them_in_its_table(mechanism, robots):
    seen = {"robot 1": robots["robot 1"], "robot 2": robots["robot 2"].subset(np.arange(3))}
    frames = symkin.identify(mechanism, seen["robot 1"], frames=["base"], prior="tolerances")
    fleet = symkin.identify_many(mechanism, seen, frames=["base"], prior="tolerances")
    columns = fleet.columns()
    base = {each.name: each for each in frames.unknowns if each.name.startswith("base.")}
    for name, each in base.items():
        stem = f"{name.replace('.', '_')}"
        assert columns[f"{stem}_{each.unit}"][0] == each.value
        assert columns[f"{stem}_deviation_{each.unit}"][0] == each.deviation
    assert dict(fleet.surroundings).keys() == base.keys()


def test_a_fleet_refuses_an_estimator_that_cannot_know_what_is_asked(mechanism, robots):
    with pytest.raises(SymkinError, match='expected "joint" here, since shared was given'):
        symkin.identify_many(mechanism, robots, "implicit", shared=["sensor_gain"])


def test_the_command_line_asks_fleets_too(tmp_path, mechanism, robots, capsys):
    files = [tmp_path / f"{number}.csv" for number in (1, 2)]
    for file, measured in zip(files, robots.values(), strict=False):
        measured.save(file, mechanism)
    line = ["identify-batch", "3RRR", *map(str, files), "--shared", "sensor_gain"]
    assert main([*line, "--out", str(tmp_path / "fleet")]) == 0
    assert "estimator joint" in capsys.readouterr().out
    with (tmp_path / "fleet/fleet.csv").open() as file:
        rows = list(csv.DictReader(file))
    assert all(row["sensor_gain_1"] == row["sensor_gain_2"] for row in rows)
