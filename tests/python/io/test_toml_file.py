# SPDX-License-Identifier: MIT
from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from symkin.errors import MechanismFileError
from symkin.storage.toml_file import KeyPath, dotted, read_toml

# The value of every key is its own line.
NUMBERED = '''\
# comment
a = 2
b.c = 3

[t]  # five
x = 6
list = [
  8,
  9, # nine
  [10, 10],
]
inline = { p = 12, q = { r = 12 } }
text = """
[legs]
x = 1
"""
after = 17

[[legs]]
x = 20
[legs.sub]
x = 22
[[legs]]
"x" = 24
[t.more]
x = 26
[u.v.w]
x = 28
'''


def leaves(values: Any, keys: KeyPath = ()) -> Iterator[tuple[KeyPath, Any]]:
    items = values.items() if isinstance(values, dict) else enumerate(values)
    for key, value in items:
        if isinstance(value, dict | list):
            yield from leaves(value, (*keys, key))
        elif isinstance(value, int):
            yield (*keys, key), value


@pytest.mark.parametrize("newline", ["\n", "\r\n"])
def test_every_key_is_found_on_its_line(write: Callable[..., Path], newline: str) -> None:
    path = write("")
    path.write_bytes(NUMBERED.replace("\n", newline).encode())
    source = read_toml(path)
    found = dict(leaves(source.values))
    assert len(found) == 15
    for keys, line in found.items():
        assert source.line_of(keys) == line, dotted(keys)


@pytest.mark.parametrize(
    ("keys", "line"),
    [
        (("t",), 5),  # in two pieces, so at the first
        (("legs",), 19),
        (("legs", 1), 23),
        (("legs", 0, "sub"), 21),
        (("u",), 27),
        (("b",), 3),
        (("t", "list"), 7),
    ],
)
def test_a_table_is_found_at_its_header(
    write: Callable[..., Path], keys: KeyPath, line: int
) -> None:
    assert read_toml(write(NUMBERED)).line_of(keys) == line


def test_an_absent_key_is_placed_at_the_table_that_lacks_it(write: Callable[..., Path]) -> None:
    source = read_toml(write(NUMBERED))
    assert source.line_of(("legs", 1, "absent")) == 23
    assert source.line_of(("absent", "x")) == 1


def test_a_long_statement_is_found_where_it_begins_in_no_time(write: Callable[..., Path]) -> None:
    numbers = "1,\n" * 200_000
    source = read_toml(write(f"[t]\na = 1\nb = [\n{numbers}]\n"))
    begun = time.perf_counter()
    assert source.line_of(("t", "b")) == 3
    assert source.line_of(("t", "b", 199_999)) == 3
    assert time.perf_counter() - begun < 5


def test_an_error_names_file_line_and_key(write: Callable[..., Path]) -> None:
    path = write(NUMBERED)
    error = read_toml(path).error(("legs", 1, "x"), "is wrong")
    assert str(error) == f"{path}:24: legs[2].x: is wrong"
    assert (error.path, error.line, error.key) == (path, 24, "legs[2].x")


@pytest.mark.parametrize(
    ("text", "line", "words"),
    [
        ("", None, "empty"),
        (" \n\n", None, "empty"),
        ("a = 1\nb == 2\n", 2, "not valid TOML"),
        ("a = 1\n\na = 2\n", 3, "Cannot overwrite a value"),
        ("b = 1\na = [1,\n", 2, "ends too early"),
    ],
)
def test_a_text_that_is_not_toml_is_refused_with_its_line(
    write: Callable[..., Path], text: str, line: int | None, words: str
) -> None:
    with pytest.raises(MechanismFileError, match=words) as error:
        read_toml(write(text))
    assert error.value.line == line


def test_a_file_that_cannot_be_read_is_refused(tmp_path: Path) -> None:
    with pytest.raises(MechanismFileError, match="no such file"):
        read_toml(tmp_path / "absent.toml")
    with pytest.raises(MechanismFileError, match="is a directory"):
        read_toml(tmp_path)
    binary = tmp_path / "binary.toml"
    binary.write_bytes(b"\xff\xfe\x00")
    with pytest.raises(MechanismFileError, match="UTF-8"):
        read_toml(binary)


@settings(max_examples=150, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(st.text(alphabet='ab1=.[]{}",#\n -', max_size=40))
def test_any_text_is_read_or_refused(write: Callable[..., Path], text: str) -> None:
    try:
        source = read_toml(write(text))
    except MechanismFileError:
        return
    lines = text.count("\n") + 1
    for keys, _ in leaves(source.values):
        assert 1 <= source.line_of(keys) <= lines
