# SPDX-License-Identifier: MIT
"""What stands around the names of a CSV's columns: units below them, or a heading above."""

import numpy as np
import pytest

from symkin.errors import MeasurementError
from symkin.storage.csv_headers import with_plain_header
from symkin.storage.table_blocks import table_blocks
from symkin.storage.tables import read_table


def test_they_come_into_the_names_and_rows_keep_their_numbers(tmp_path):
    path = tmp_path / "cmm.csv"
    path.write_text("# of a CMM\nnr;X;Roll\n;mm;(°)\n1;2,5;3\n2;;x\n", encoding="utf-8")
    (block,) = table_blocks(path, "nr")
    for table in (read_table(path), block):
        assert table.names == ["nr", "X [mm]", "Roll [deg]"]
        np.testing.assert_array_equal(table.numbers("X [mm]", empty_allowed=True), [2.5, np.nan])
        with pytest.raises(MeasurementError, match='row 5 has "x" in column "Roll'):
            table.numbers("Roll [deg]")


def test_names_that_have_a_unit_keep_it():
    text = with_plain_header(b"x_m,L [mm],psi\nm,mm,RAD\n1,2,3\n")
    assert text == b"x_m,L [mm],psi [rad]\n#m,mm,RAD\n1,2,3\n"


@pytest.mark.parametrize(
    "text",
    [
        b"",
        b"x,y\n",
        b"x,y\n1,2\n",
        b"x,y\nmm,",  # which may be cut
        b"robot,x\nA,\nB,1\n",  # a robot's name and an empty cell
        b"x,y\nmm\n1,2\n",
        b"x,y\n-,-\n1,2\n",
        b'"x","y"\nmm,mm\n1,2\n',
        b"x,y\n#mm,mm\n1,2\n",
    ],
)
def test_any_other_second_line_is_left_as_it_is(text):
    assert with_plain_header(text) == text


def test_it_is_done_once():
    once = with_plain_header(b"x,y\nmm,\n1,2\n")
    assert with_plain_header(once) == once


@pytest.mark.parametrize("hint", [b"sep=;\r\n", b"SEP=; \n"])
def test_a_spreadsheets_line_above_names_its_separator_and_no_column(tmp_path, hint):
    path = tmp_path / "sheet.csv"
    path.write_bytes(b"\xef\xbb\xbf" + hint + b"nr;x_m\n1;2,5\n2;k\n")
    (block,) = table_blocks(path, "nr")
    for table in (read_table(path), block):
        assert table.names == ["nr", "x_m"]
        with pytest.raises(MeasurementError, match='row 4 has "k"'):
            table.numbers("x_m")


def test_of_a_heading_above_it_is_said_how_it_is_passed_over(tmp_path):
    path = tmp_path / "log.csv"
    path.write_text("Device: a tracker\n\nx_m,y_m\n1,2\n", encoding="utf-8")
    with pytest.raises(MeasurementError, match=r"row 3 has 2 cells; expected 1, .* begins with #"):
        read_table(path)
