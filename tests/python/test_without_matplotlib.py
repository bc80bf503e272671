# SPDX-License-Identifier: MIT
"""Matplotlib is an extra: without it everything works but pictures."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

import symkin

_NOTE = 'this page has no figures, which need matplotlib: pip install "symkin[figures]"'
_WITHOUT = "import sys; sys.modules['matplotlib'] = None; "
_RUN = f"""{_WITHOUT}
from symkin.cli import main
code = main(["run", "5bar", "--out", sys.argv[1]])
assert sys.modules["matplotlib"] is None
sys.exit(code)
"""
_SUMMARY = f"""{_WITHOUT}
import symkin
print(symkin.check_mechanism(symkin.load_mechanism("5bar"))._repr_html_())
"""


def _python(code: str, *arguments: object) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, "-c", code, *map(str, arguments)]
    return subprocess.run(command, capture_output=True, text=True, check=False)


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """What `symkin run` writes."""
    folder = tmp_path_factory.mktemp("bare") / "run"
    ended = _python(_RUN, folder)
    assert (ended.returncode, ended.stderr) == (0, "")
    return folder


def test_a_run_writes_all_its_files(folder: Path) -> None:
    assert {file.name for file in folder.iterdir()} == set(symkin.pipeline.ProtocolResult.FILES)


def test_its_page_says_once_what_to_install_in_place_of_the_figures(folder: Path) -> None:
    page = (folder / "report.html").read_text(encoding="utf-8")
    assert page.replace("&#34;", '"').count(_NOTE) == 1
    assert 'class="plot"' not in page
    assert page.count("<table") > 3
    assert '<figure class="movable"' in page


def test_its_links_lead_to_sections_that_are_there(folder: Path) -> None:
    page = (folder / "report.html").read_text(encoding="utf-8")
    wanted = {part.split('"')[0] for part in page.split('href="#')[1:]}
    assert wanted
    assert all(f'id="{name}"' in page for name in wanted)


def test_a_notebook_shows_the_summary() -> None:
    ended = _python(_SUMMARY)
    assert ended.returncode == 0, ended.stderr
    assert 'class="symkin"' in ended.stdout
    assert 'class="plot"' not in ended.stdout


@pytest.mark.parametrize("module", ["symkin.plot", "symkin.show.figures.estimates"])
def test_plotting_says_what_to_install(module: str) -> None:
    ended = _python(f"{_WITHOUT} import {module}")
    assert ended.stderr.splitlines()[-1] == (
        'ImportError: figures need matplotlib: pip install "symkin[figures]"'
    )
