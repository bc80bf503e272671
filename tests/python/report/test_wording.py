# SPDX-License-Identifier: MIT
"""Numbers as a person reads them."""

import math
import re

import numpy as np
import pytest

import symkin
from symkin.show import wording
from symkin.show.rendering import page_html

SPACE = "\N{NO-BREAK SPACE}"


@pytest.mark.parametrize(
    ("value", "text"),
    [
        (2.9364, "2.94"),
        (50.0, "50.0"),
        (9.999, "10.0"),
        (1234.5, "1230"),
        (0.066159, "0.0662"),
        (0.00036, "0.000360"),
        (-1.5, "\N{MINUS SIGN}1.50"),
        (0.0, "0"),
        (math.nan, wording.NONE),
        (6.05e-5, f"6.05{SPACE}\xd7{SPACE}10\u207b\u2075"),
    ],
)
def test_numbers_have_three_significant_digits(value, text):
    assert wording.significant(value) == text


def test_small_lengths_are_in_millimetres():
    assert wording.milli(8.2e-5, "m") == f"0.0820{SPACE}mm"
    assert wording.milli(math.nan, "m") == wording.NONE


def test_what_rounding_leaves_of_an_error_is_no_power_of_ten():
    assert wording.milli(-7.2e-17, "m") == f"< 0.00001{SPACE}mm"
    assert wording.milli(2.5e-8, "m") == f"0.0000250{SPACE}mm"
    assert wording.milli(np.radians(0.0042), "rad") == "0.00420\N{DEGREE SIGN}"


def test_given_numbers_keep_the_digits_that_were_given():
    assert wording.setting(0.1, "mm") == f"0.1{SPACE}mm"
    assert wording.setting(20.0) == "20"


@pytest.mark.parametrize(("deviation", "decimals"), [(0.0016, 4), (0.25, 2), (30.0, 0), (0.0, 6)])
def test_digits_follow_the_standard_deviation(deviation, decimals):
    assert wording.decimals_of(deviation) == decimals


def test_changes_of_an_error_are_told_as_a_factor():
    assert wording.ratio(2.94, 0.0662) == "44 times smaller"
    assert wording.ratio(1.0, 2.0) == "2.0 times larger"
    assert wording.ratio(0.0, 0.0) == wording.NONE


def test_counts_have_their_thousands_apart():
    assert wording.plural(30000, "pose") == f"30{SPACE}000 poses"
    assert wording.plural(1, "pose lies", "poses lie") == "1 pose lies"


def test_a_number_that_rounds_to_nothing_has_no_sign():
    assert wording.fixed(-1e-9, 3) == "0.000"
    assert wording.fixed(-0.0006, 3) == "\N{MINUS SIGN}0.001"


def test_the_page_of_a_plan_is_light_and_says_a_style_of_many_markers_once():
    text = page_html(symkin.plan("3RRR", candidates=2000).page())
    assert len(text.encode()) <= 300_000
    assert "DejaVu" not in text
    # Alone in a group, a marker may have one of its own.
    assert not re.search(r'<use [^>]* style="[^"]*"/>\s*<use [^>]* style="', text)
