# SPDX-License-Identifier: MIT
from __future__ import annotations

import os
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from symkin.errors import MeasurementError
from symkin.storage.tables import read_table, write_table

Write = Callable[..., Path]


@pytest.mark.parametrize(
    "text",
    [
        "a,b\n1,2\n3,4.5\n",
        "a,b\r\n1,2\r\n3,4.5",
        "\ufeffa,b\n1,2\n3,4.5\n",
        '"a", b \n1, 2\n\n3,4.5 \n',
        "a,b\r1,2\r3,4.5\r",
        "a;b\n1;2\n3;4,5\n",
        "a\tb\n1,0\t2\n3\t4,5\n",
        "a;b\n1;2\n3;4.5\n",
        '"a"; b\n"1"; 2\n3;"4,5"\n',
        "# tracker 7\n#\na,b\n1,2\n  # lunch\n3,4.5\n",
        "a,b\n1,2\n3,4.5\n,\n,\n",
        "a,b\n1,2\n+3.e0,+.45e+1\n",
        "a;\u00a0b\n1;2\u2009\n3;4,5\u00a0\n",
    ],
)
@pytest.mark.parametrize("encoding", ["utf-8", "utf-8-sig", "utf-16"])
def test_csv_is_read_however_a_laboratory_writes_it(
    tmp_path: Path, text: str, encoding: str
) -> None:
    path = tmp_path / "t.csv"
    path.write_bytes(text.encode("utf-8" if text.startswith("\ufeff") else encoding))
    table = read_table(path)
    assert table.names == ["a", "b"]
    assert table.row_count == 2
    assert table.numbers("a").dtype == np.float64
    assert table.numbers("a").tolist() == [1.0, 3.0]
    assert table.numbers("b").tolist() == [2.0, 4.5]


def test_a_csv_in_latin_1_is_read(tmp_path: Path) -> None:
    path = tmp_path / "t.csv"
    path.write_bytes("a;Größe in µm\n1;2,5\n".encode("latin-1"))
    assert read_table(path).numbers("Größe in µm").tolist() == [2.5]


def test_rows_are_numbered_as_lines_of_the_file(write: Write) -> None:
    text = 'a,note\n1,x\n# y\n\n2,"two\n# lines"\n3,z\n'
    assert read_table(write(text, "t.csv")).row_numbers.tolist() == [2, 5, 7]
    parquet = write("", "t.parquet")
    write_table(parquet, {"a": [1, 2]})
    assert read_table(parquet).row_numbers.tolist() == [1, 2]


@pytest.mark.parametrize("name", ["t.csv", "t.parquet"])
@settings(max_examples=20, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(values=st.lists(st.floats(allow_nan=False, allow_infinity=False), min_size=1))
def test_written_numbers_read_back_to_the_same_floats(
    tmp_path: Path, name: str, values: list[float]
) -> None:
    count = len(values)
    columns = {"x_m": np.array(values), "leg": np.arange(count), "role": ["spare"] * count}
    write_table(tmp_path / name, columns)
    table = read_table(tmp_path / name)
    assert table.names == ["x_m", "leg", "role"]
    assert np.array_equal(table.numbers("x_m"), values)
    assert table.words("role", ("primary", "spare")) == ["spare"] * count
    assert table.whole_numbers("leg", 0, count).tolist() == list(range(count))


def test_csv_is_written_plainly(tmp_path: Path) -> None:
    columns = {"leg": [1, 2], "role": ["primary", "spare"], "psi_1_rad": np.array([0.1, np.nan])}
    write_table(tmp_path / "t.csv", columns)
    expected = "leg,role,psi_1_rad\n1,primary,0.1\n2,spare,\n"
    assert (tmp_path / "t.csv").read_text() == expected


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("", "the file is empty"),
        ("\n\n", "the file is empty"),
        ("# a\n\n", "no rows below the header"),
        ("a,b", "no rows below the header"),
        ("a,b\n", "no rows below the header"),
        ("a,b\n1,2\n3\n", "row 3 has 1 cells; expected 2"),
        ("a,b\n1,2\n3,4,5\n", "row 3 has 3 cells; expected 2"),
        ("b,b\n1,2\n", 'column "b" occurs twice'),
        ("a,b\n1,2\n3,x\n", 'row 3 has "x" in column "b"; expected a number'),
        ("a,b\n1,2\n3,1.5 mm\n", 'row 3 has "1.5 mm" in column "b"'),
        ("a,b\n1,2\n3,nan\n", 'row 3 has nan in column "b"; expected a finite number'),
        ("a,b\n1,2\n3,-inf\n", 'row 3 has -inf in column "b"'),
        ("a,b\n1,2\n3,\n", 'row 3 is empty in column "b"'),
        ("a,b\n1,\n3,\n", 'row 2 is empty in column "b"'),
        ("a,b\n1,true\n", 'row 2 has "true" in column "b"; expected a number'),
        ("a,b\n1,1_000\n", 'row 2 has "1_000"'),
        ("a,b\n1,0x1F\n", 'row 2 has "0x1F"'),
        ("a,b\n1,\u0661\n", 'in column "b"; expected a number'),
        ('a,b\n1,"1,5"\n', 'row 2 has "1,5"'),
        ("a;b\n1,5;1.234,5\n", 'row 2 has "1.234,5"'),
        ("a;b\n1;1,234\n1;2.5\n", 'has "1,234" and "2.5"; expected one kind of decimal mark'),
        ("# t\n\na,b\n1,2\n# u\n3,x\n", 'row 6 has "x"'),
        ('a,b\n"1\n",2\n3,x\n', 'row 4 has "x"'),
        ("1,2\n3,4\n", "its first row has numbers; expected the names"),
        ("a,b\n1,\x002\n", "row 2 has a character '\\x00'"),
        ("a,b\n1," + "9" * 200_000, "row 2 cannot be read"),
        ("a,b\n1,2\n3,1e999\n", 'row 3 has inf in column "b"'),
    ],
)
def test_a_bad_csv_is_refused_with_its_row(write: Write, text: str, words: str) -> None:
    path = write(text, "t.csv")
    with pytest.raises(MeasurementError) as error:
        read_table(path).numbers("b")
    assert str(error.value).startswith(f"{path}: ")
    assert words in str(error.value)


def test_a_file_that_is_no_table_is_refused(tmp_path: Path, write: Write) -> None:
    with pytest.raises(MeasurementError, match="no such file"):
        read_table(tmp_path / "absent.csv")
    with pytest.raises(MeasurementError, match="is a directory"):
        read_table(tmp_path)
    with pytest.raises(MeasurementError, match="cannot be read"):
        read_table(write("hello", "t.parquet"))
    os.mkfifo(tmp_path / "pipe")
    for never_ending in (tmp_path / "pipe", Path("/dev/zero")):
        with pytest.raises(MeasurementError, match="is a device or a pipe"):
            read_table(never_ending)
    loop = tmp_path / "loop"
    loop.symlink_to(loop)
    with pytest.raises(MeasurementError, match="cannot be read: Too many levels"):
        read_table(loop)
    binary = tmp_path / "binary.csv"
    binary.write_bytes(b"\xff\xfe\x00")
    with pytest.raises(MeasurementError, match="cannot be read"):
        read_table(binary)


@pytest.mark.parametrize("name", ["t.csv", "t.parquet"])
def test_names_are_read_as_they_are_written_and_none_is_empty(tmp_path: Path, name: str) -> None:
    cells = {"robot": ["007", "B", "007"], "empty": ["a", "", "b"], "x": [1.0, 2.5, 1.0]}
    write_table(tmp_path / name, cells)
    table = read_table(tmp_path / name)
    for column, distinct in (("robot", ["007", "B"]), ("x", ["1", "2.5"])):
        labels = table.labels(column)
        assert (labels.codes.tolist(), list(labels.distinct)) == ([0, 1, 0], distinct)
    with pytest.raises(MeasurementError, match='is empty in column "empty"; expected a name'):
        table.labels("empty")
    with pytest.raises(MeasurementError, match='has "B" in column "robot"; expected a number'):
        table.numbers("robot")


def test_an_empty_cell_is_nan_only_where_that_is_allowed(write: Write) -> None:
    table = read_table(write("a,b\n1,\n2,3\n", "t.csv"))
    assert np.array_equal(table.numbers("b", empty_allowed=True), [np.nan, 3], equal_nan=True)
    with pytest.raises(MeasurementError, match="row 2 is empty"):
        table.numbers("b")


def test_a_missing_column_is_answered_with_the_nearest_and_all_names(write: Write) -> None:
    table = read_table(write("x_m,y_m,phi_rad\n1,2,3\n", "t.csv"))
    with pytest.raises(MeasurementError) as error:
        table.require("ph_rad", "platform angle")
    assert 'column "ph_rad" (platform angle) is missing; did you mean "phi_rad"?' in str(
        error.value
    )
    assert "(columns present: x_m, y_m, phi_rad)" in str(error.value)


@pytest.mark.parametrize(("cell", "shown"), [("0", "0"), ("4", "4"), ("1.5", "1.5")])
def test_a_leg_number_out_of_range_is_refused(write: Write, cell: str, shown: str) -> None:
    table = read_table(write(f"leg,x\n1,0\n{cell},0\n", "t.csv"))
    with pytest.raises(MeasurementError, match=f"row 3 has {shown} .* whole number from 1 to 3"):
        table.whole_numbers("leg", 1, 3)


def test_an_unknown_word_is_refused(write: Write) -> None:
    table = read_table(write("role,x\nprimary,0\nmain,0\n", "t.csv"))
    with pytest.raises(MeasurementError, match=r'row 3 has "main" .* primary or spare'):
        table.words("role", ("primary", "spare"))
