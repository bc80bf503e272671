"""No column of a table of measurements is dropped in silence."""

import dataclasses

import numpy as np
import pytest

import symkin
from symkin.cli import main
from symkin.errors import MeasurementError
from symkin.model.settings import MeasurementColumns
from symkin.storage.tables import write_table


@pytest.fixture(scope="module")
def columns(paper):
    """What a laboratory measured of the 3-RRR, as the columns of a file."""
    plan = symkin.make_plan(paper, paper.sample_workspace(500, 1), 12, seed=1, spares=0)
    return dict(symkin.simulate(paper, plan, 1).measurements.columns(paper))


def renamed(columns, **names):
    return {names.get(name, name): values for name, values in columns.items()}


def test_columns_without_use_are_told_and_change_nothing(paper, columns):
    plain = symkin.read_measurements(columns, paper)
    assert plain.unread == ()
    assert plain.notes == ()
    wider = {"note": ["Monday"] * len(columns["x_m"]), **columns, "torque_Nm": columns["x_m"]}
    read = symkin.read_measurements(wider, paper)
    assert read == plain
    assert read.unread == ("note", "torque_Nm")
    notes = symkin.identify(paper, read).notes
    assert [note for note in notes if "columns note, torque_Nm" in str(note)]
    assert "columns-unread" in [note.code for note in symkin.identify(paper, read, "joint").notes]
    assert symkin.read_measurements(wider, paper, ignore=["note", "torque_Nm"]).unread == ()


@pytest.mark.parametrize(
    ("name", "mistaken", "words"),
    [
        ("phi_rad", "theta_rad", '"theta_rad" is not read, and no column holds the angle phi'),
        ("psi_1_rad", "psi1", '"psi1" is not read, and no column holds the reading of leg 1'),
        ("psi_2_rad", "PSI_2", '"PSI_2" is not read, and no column holds the reading of leg 2'),
        ("psi_3_rad", "motor_deg", '"motor_deg" is not read.*the reading of leg 3'),
        ("x_m", "tool_mm", '"tool_mm" is not read, and no column holds the coordinate x'),
    ],
)
def test_a_column_that_may_be_what_is_missed_is_refused_unless_it_is_meant(
    paper, columns, name, mistaken, words
):
    table = renamed(columns, **{name: mistaken})
    with pytest.raises(MeasurementError, match=words):
        symkin.read_measurements(table, paper)
    read = symkin.read_measurements(table, paper, ignore=[mistaken])
    assert read.unread == ()
    assert np.isnan(np.hstack([read.poses, read.readings])).any()


def test_of_a_whole_table_no_further_column_is_suspected(paper, columns):
    read = symkin.read_measurements(columns | {"theta_rad": columns["phi_rad"]}, paper)
    assert read.unread == ("theta_rad",)


def test_who_maps_columns_has_said_which_he_means(paper, columns):
    mapped = MeasurementColumns(
        position=("x_m", "y_m"), readings=("psi_1_rad", "psi_2_rad", "none"), angle="phi_rad",
        position_unit="m", orientation_unit="rad", reading_unit="rad",
    )  # fmt: skip
    read = symkin.read_measurements(columns, paper, mapped)
    assert set(read.unread) >= {"psi_3_rad"}


def test_what_is_to_be_ignored_is_a_column_without_use(paper, columns):
    with pytest.raises(MeasurementError, match=r'"torque" \(to ignore\) is missing'):
        symkin.read_measurements(columns, paper, ignore=["torque"])
    with pytest.raises(MeasurementError, match='"phi_rad" is to be ignored, and was read'):
        symkin.read_measurements(columns, paper, ignore=["phi_rad"])


def test_unread_columns_do_not_make_other_measurements(paper, columns):
    read = symkin.read_measurements(columns | {"note": columns["x_m"]}, paper)
    assert dataclasses.replace(read, unread=()) == read


def test_evaluations_and_fleets_tell_columns_without_use_too(paper, columns, tmp_path, capsys):
    wider = {**columns, "torque_Nm": columns["x_m"]}
    words = "nothing was read from column torque_Nm"
    evaluation = symkin.evaluate(paper, measurements=wider)
    assert words in evaluation.notes[0]
    assert words in evaluation.text()
    assert words in evaluation.to_dict()["notes"][0]
    assert symkin.evaluate(paper, measurements=columns) == evaluation  # whose numbers are the same
    table = {"robot": ["a"] * 20 + ["b"] * (len(columns["x_m"]) - 20), **wider}
    fleet = symkin.identify_many(paper, table)
    told = [str(note) for note in fleet.notes if note.code == "columns-unread"]
    assert told == ["nothing was read from column torque_Nm of a and b"]
    assert words in fleet.text()
    ignored = symkin.identify_many(paper, table, ignore=["torque_Nm"])
    assert [note.code for note in ignored.notes] == ["screened"]
    file = tmp_path / "table.csv"
    write_table(file, wider)
    assert main(["evaluate", "3RRR", "--measurements", str(file)]) == 0
    assert words in " ".join(capsys.readouterr().out.split())
    assert main(["identify-batch", "3RRR", str(file)]) == 0
    assert words in " ".join(capsys.readouterr().out.split())


def test_a_column_of_serial_numbers_is_no_column_of_one_robot(paper, columns):
    half = len(columns["x_m"]) // 2
    names = np.repeat(["0007", "0008"], [half, len(columns["x_m"]) - half])
    for name in ("serial", "Serial No", "SN"):
        table = {name: names, **columns}
        with pytest.raises(MeasurementError, match="2 different names") as refused:
            symkin.identify(paper, table)
        assert "identify-batch" in str(refused.value)
        quoted = f"'{name}'" if " " in name else name
        assert f"--ignore {quoted}, in Python" in str(refused.value)
        left_out = symkin.read_measurements(table, paper, ignore=[name])
        assert len(left_out) == len(names)
    assert len(symkin.read_measurements({"serial": ["1"] * len(names), **columns}, paper))
