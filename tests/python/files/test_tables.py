# SPDX-License-Identifier: MIT
from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from symkin.errors import MeasurementError
from symkin.files.tables import read_table, write_table

Write = Callable[..., Path]


@pytest.mark.parametrize(
    "text",
    [
        "a,b\n1,2\n3,4.5\n",
        "a,b\r\n1,2\r\n3,4.5",
        "\ufeffa,b\n1,2\n3,4.5\n",
        '"a", b \n1, 2\n\n3,4.5 \n',
    ],
)
def test_csv_is_read_whatever_its_line_ends_blanks_and_quotes(write: Write, text: str) -> None:
    table = read_table(write(text, "t.csv"))
    assert table.names == ["a", "b"]
    assert table.row_count == 2
    assert table.numbers("a").dtype == np.float64
    assert table.numbers("a").tolist() == [1.0, 3.0]
    assert table.numbers("b").tolist() == [2.0, 4.5]


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
        ("\n\n", "no rows below the header"),
        ("a,b", "no rows below the header"),
        ("a,b\n", "no rows below the header"),
        ("a,b\n1,2\n3\n", "row 2 has 1 cells; expected 2"),
        ("a,b\n1,2\n3,4,5\n", "row 2 has 3 cells; expected 2"),
        ("a;b\n1;2\n", "separated by semicolons; expected commas"),
        ("a\tb\n1\t2\n", "separated by tabs; expected commas"),
        ("b,b\n1,2\n", 'column "b" occurs twice'),
        ("a,b\n1,2\n3,x\n", 'row 2 has "x" in column "b"; expected a number'),
        ("a,b\n1,2\n3,1.5 mm\n", 'row 2 has "1.5 mm" in column "b"'),
        ("a,b\n1,2\n3,nan\n", 'row 2 has nan in column "b"; expected a finite number'),
        ("a,b\n1,2\n3,-inf\n", 'row 2 has -inf in column "b"'),
        ("a,b\n1,2\n3,\n", 'row 2 is empty in column "b"'),
        ("a,b\n1,\n3,\n", 'row 1 is empty in column "b"'),
        ("a,b\n1,true\n", 'column "b" holds bool; expected numbers'),
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
    binary = tmp_path / "binary.csv"
    binary.write_bytes(b"\xff\xfe\x00")
    with pytest.raises(MeasurementError, match="cannot be read"):
        read_table(binary)


def test_an_empty_cell_is_nan_only_where_that_is_allowed(write: Write) -> None:
    table = read_table(write("a,b\n1,\n2,3\n", "t.csv"))
    assert np.array_equal(table.numbers("b", empty_allowed=True), [np.nan, 3], equal_nan=True)
    with pytest.raises(MeasurementError, match="row 1 is empty"):
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
    with pytest.raises(MeasurementError, match=f"row 2 has {shown} .* whole number from 1 to 3"):
        table.whole_numbers("leg", 1, 3)


def test_an_unknown_word_is_refused(write: Write) -> None:
    table = read_table(write("role,x\nprimary,0\nmain,0\n", "t.csv"))
    with pytest.raises(MeasurementError, match=r'row 2 has "main" .* primary or spare'):
        table.words("role", ("primary", "spare"))
