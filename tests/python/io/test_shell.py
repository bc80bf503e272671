# SPDX-License-Identifier: MIT
"""Words of a command line, as they are typed and as they are taken apart."""

import shlex

import pytest

from symkin import shell
from symkin.present import Page
from symkin.show.rendering import command_text

WORDS = ("plain", "with space", "a&b", "x=1", "", "semi;colon", "50%")


@pytest.fixture(params=[False, True], ids=["posix", "windows"])
def windows(request, monkeypatch):
    monkeypatch.setattr(shell, "_WINDOWS", request.param)
    return request.param


def test_what_is_typed_is_taken_apart_into_the_same_words(windows):
    words = [*WORDS, r"C:\Program Files\x.toml" if windows else "it's"]
    typed = " ".join(map(shell.typed_word, words))
    assert shell.words_of(typed) == words


def test_plain_words_have_no_quotes(windows):
    path = r"out\session\robot.toml" if windows else "out/session/robot.toml"
    assert shell.typed_word(path) == path


def test_windows_has_double_quotes_and_keeps_backslashes(monkeypatch):
    monkeypatch.setattr(shell, "_WINDOWS", True)
    assert shell.typed_word(r"C:\my tools\x.exe") == r'"C:\my tools\x.exe"'
    assert shell.words_of(r'"C:\my tools\x.exe" --port COM3') == [
        r"C:\my tools\x.exe",
        "--port",
        "COM3",
    ]


def test_posix_words_are_those_of_its_shell(monkeypatch):
    monkeypatch.setattr(shell, "_WINDOWS", False)
    assert [shell.typed_word(each) for each in WORDS] == [shlex.quote(each) for each in WORDS]


@pytest.mark.usefixtures("windows")
def test_a_quotation_without_an_end_is_refused():
    with pytest.raises(ValueError, match="quotation"):
        shell.words_of('device "my port')


def test_a_proposed_command_names_a_folder_so_that_it_can_be_pasted():
    page = Page(title="", next_command="symkin evaluate {folder}/calibrated.toml --out next")
    told = command_text(page, "my out")
    assert shlex.split(told) == ["symkin", "evaluate", "my out/calibrated.toml", "--out", "next"]
    assert command_text(page) == "symkin evaluate DIR/calibrated.toml --out next"
