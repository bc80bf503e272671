# SPDX-License-Identifier: MIT
"""Units that stand in a line of their own below the names of a CSV's columns."""

import numpy as np
import pytest

from symkin.errors import MeasurementError
from symkin.storage.table_blocks import table_blocks
from symkin.storage.tables import read_table
from symkin.storage.unit_rows import with_units_in_names


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
    text = with_units_in_names(b"x_m,L [mm],psi\nm,mm,RAD\n1,2,3\n")
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
    assert with_units_in_names(text) == text


def test_it_is_done_once():
    once = with_units_in_names(b"x,y\nmm,\n1,2\n")
    assert with_units_in_names(once) == once
