# SPDX-License-Identifier: MIT
"""Tables that are no plain file: compressed, open already, or columns in memory."""

from __future__ import annotations

import gzip
import sys
from collections.abc import Callable
from io import BytesIO, StringIO
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import symkin
from symkin.data.columns import pose_column_names, reading_column_names
from symkin.data.measurements import Measurements
from symkin.data.pose_tables import read_pose_list
from symkin.errors import MeasurementError
from symkin.model.mechanism import Mechanism
from symkin.storage import tables


@pytest.fixture
def text(tmp_path: Path, paper: Mechanism, measured: Measurements) -> str:
    symkin.write_measurements(measured, tmp_path / "m.csv", paper)
    return (tmp_path / "m.csv").read_text()


def columns_of(measured: Measurements) -> dict[str, Any]:
    names = pose_column_names("planar") + reading_column_names(3, "rad")
    return dict(zip(names, np.hstack([measured.poses, measured.readings]).T, strict=True))


def assert_alike(read: Measurements, measured: Measurements) -> None:
    assert np.array_equal(read.poses, measured.poses)
    assert np.array_equal(read.readings, measured.readings, equal_nan=True)


@pytest.mark.parametrize(
    "opened",
    [
        StringIO,
        lambda text: BytesIO(text.encode()),
        lambda text: BytesIO(text.encode("utf-16")),
        lambda text: BytesIO(gzip.compress(text.encode())),
    ],
)
def test_measurements_are_read_from_an_open_stream(
    paper: Mechanism, measured: Measurements, text: str, opened: Callable[[str], Any]
) -> None:
    read = symkin.read_measurements(opened(text), paper)
    assert_alike(read, measured)
    assert read.source is None
    assert read.row_numbers[0] == 2


@pytest.mark.usefixtures("text")
def test_measurements_are_read_from_an_open_file(
    tmp_path: Path, paper: Mechanism, measured: Measurements
) -> None:
    for mode in ("r", "rb"):
        with (tmp_path / "m.csv").open(mode) as file:
            assert_alike(symkin.read_measurements(file, paper), measured)


def test_a_fault_in_a_stream_is_told_with_its_row(paper: Mechanism, text: str) -> None:
    wrong = text.replace("\n0.", "\nx0.", 1).replace("\n-0.", "\nx-0.", 1)
    with pytest.raises(MeasurementError, match=r'^the stream: row \d+ has "x'):
        symkin.read_measurements(StringIO(wrong), paper)
    for empty in (StringIO(""), BytesIO(b" \n"), BytesIO(gzip.compress(b""))):
        with pytest.raises(MeasurementError, match="the stream: the file is empty"):
            symkin.read_measurements(empty, paper)


def test_a_stream_that_cannot_be_read_is_refused(tmp_path: Path, paper: Mechanism) -> None:
    (tmp_path / "latin.csv").write_bytes("x_m;größe\n1;2\n".encode("latin-1"))
    file = (tmp_path / "latin.csv").open(encoding="utf-8")
    with file, pytest.raises(MeasurementError, match=r"latin\.csv: cannot be read: 'utf-8' codec"):
        symkin.read_measurements(file, paper)
    with pytest.raises(MeasurementError, match="cannot be read: I/O operation on closed file"):
        symkin.read_measurements(file, paper)


@pytest.mark.parametrize("name", ["m.csv.gz", "m.csv"])
def test_a_file_compressed_by_gzip_is_read_whatever_its_name(
    tmp_path: Path, paper: Mechanism, measured: Measurements, text: str, name: str
) -> None:
    path = tmp_path / name
    path.write_bytes(gzip.compress(text.encode()))
    read = symkin.read_measurements(path, paper)
    assert_alike(read, measured)
    assert read.source == path


def test_a_table_is_written_compressed_always_to_the_same_bytes(
    tmp_path: Path, paper: Mechanism, measured: Measurements, text: str
) -> None:
    for name in ("a.csv.gz", "b.csv.gz"):
        symkin.write_measurements(measured, tmp_path / name, paper)
    assert gzip.decompress((tmp_path / "a.csv.gz").read_bytes()).decode() == text
    assert (tmp_path / "a.csv.gz").read_bytes() == (tmp_path / "b.csv.gz").read_bytes()


def test_a_damaged_or_boundless_compressed_file_is_refused(
    tmp_path: Path, paper: Mechanism, text: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "m.csv.gz"
    path.write_bytes(gzip.compress(text.encode())[:-20])
    with pytest.raises(MeasurementError, match=r"m\.csv\.gz: cannot be decompressed"):
        symkin.read_measurements(path, paper)
    monkeypatch.setattr(tables, "MOST_BYTES", 100)
    path.write_bytes(gzip.compress(text.encode()))
    with pytest.raises(MeasurementError, match="holds more than 100 bytes"):
        symkin.read_measurements(path, paper)


def test_measurements_and_plans_are_read_from_columns_in_memory(
    paper: Mechanism, measured: Measurements
) -> None:
    columns = columns_of(measured)
    columns["psi_2_rad"] = columns["psi_2_rad"].copy()
    columns["psi_2_rad"][3] = np.nan
    read = symkin.read_measurements(columns, paper)
    assert np.isnan(read.readings).sum() == 1
    assert_alike(read.subset(np.arange(3)), measured.subset(np.arange(3)))
    assert read.row_numbers.tolist() == list(range(1, 13))
    rows = {"leg": [1, 2, 3] * 4, "order": np.repeat([1, 2, 3, 4], 3), "role": ["primary"] * 12}
    plan = symkin.read_plan(rows | columns_of(measured), paper)
    assert np.array_equal(plan.poses, measured.poses)
    assert np.array_equal(read_pose_list(columns, paper), measured.poses)


def test_measurements_are_read_from_a_data_frame(paper: Mechanism, measured: Measurements) -> None:
    pandas = pytest.importorskip("pandas")
    frame = pandas.DataFrame(columns_of(measured))
    assert_alike(symkin.read_measurements(frame, paper), measured)
    texts = frame.astype(str)  # as of a file whose columns were read as text
    texts.loc[2, "psi_1_rad"] = None
    assert np.isnan(symkin.read_measurements(texts, paper).readings[2, 0])


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"x_m": [1.0, 2.0]}, r"the columns have shapes \(2,\), \(12,\); expected one length"),
        ({"x_m": np.zeros((12, 2))}, "expected one length"),
        ({"x_m": [True] * 12}, 'column "x_m" holds bool; expected numbers'),
        ({"x_m": ["a"] * 12}, 'the table: row 1 has "a" in column "x_m"'),
        ({"x_m": [np.inf] * 12}, "expected a finite number"),
        ({"psi_1_rad": [""] * 11 + ["1e"]}, 'row 12 has "1e" in column "psi_1_rad"'),
    ],
)
def test_columns_that_are_no_table_are_refused(
    paper: Mechanism, measured: Measurements, change: dict[str, Any], words: str
) -> None:
    with pytest.raises(MeasurementError, match=words):
        symkin.read_measurements(columns_of(measured) | change, paper)


def test_what_is_no_table_at_all_is_refused(paper: Mechanism) -> None:
    for nothing in (3, None, [1, 2], np.zeros((3, 3))):
        with pytest.raises(MeasurementError, match="is no table; expected a file, a stream"):
            symkin.read_measurements(nothing, paper)
    with pytest.raises(MeasurementError, match="no rows"):
        symkin.read_measurements({}, paper)


def test_parquet_without_its_library_says_what_to_install(
    tmp_path: Path, paper: Mechanism, measured: Measurements, monkeypatch: pytest.MonkeyPatch
) -> None:
    symkin.write_measurements(measured, tmp_path / "m.parquet", paper)
    assert_alike(symkin.read_measurements(BytesIO((tmp_path / "m.parquet").read_bytes()), paper),
                 measured)  # fmt: skip
    monkeypatch.setitem(sys.modules, "pyarrow", None)
    for use in (
        lambda: symkin.read_measurements(tmp_path / "m.parquet", paper),
        lambda: symkin.write_measurements(measured, tmp_path / "n.parquet", paper),
    ):
        with pytest.raises(MeasurementError, match=r"pip install 'symkin\[parquet\]'"):
            use()
    assert not (tmp_path / "n.parquet").exists()
