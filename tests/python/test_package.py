# SPDX-License-Identifier: MIT
"""The package as a whole: its names, and what an import brings."""

from __future__ import annotations

import subprocess
import sys
import tomllib
from pathlib import Path

import pytest

import symkin

_EVERY_NAME_FIRST = """
import sys, symkin
for name in symkin.__all__:
    for loaded in [n for n in sys.modules if n.startswith("symkin") and not n.endswith("_core")]:
        del sys.modules[loaded]
    import symkin
    getattr(symkin, name)
"""


def printed(code: str) -> str:
    command = [sys.executable, "-c", code]
    return subprocess.run(command, capture_output=True, text=True, check=True).stdout


def test_every_name_at_the_top_can_be_the_first_that_is_used() -> None:
    assert printed(_EVERY_NAME_FIRST) == ""


def test_importing_the_package_imports_hardly_anything_of_it() -> None:
    loaded = printed("import sys, symkin; print(*sys.modules)").split()
    own = {name for name in loaded if name.startswith("symkin")}
    assert own == {"symkin"}
    assert not {"matplotlib", "numpy", "pandas", "pyarrow", "tomllib", "typer"} & set(loaded)


def test_the_version_is_said_without_numpy() -> None:
    code = "import sys; sys.argv = ['symkin', '--version']; import symkin.__main__ as entry; "
    shown = printed(f"{code}entry.main(); print('numpy' in sys.modules)").splitlines()
    assert shown == [f"symkin {symkin.__version__}", "False"]


def test_the_top_of_the_package_is_small_and_completed() -> None:
    assert len(symkin.__all__) <= 43
    assert symkin.__all__ == sorted(symkin.__all__)
    assert {*symkin.__all__, "plot", "model", "__version__"} <= set(dir(symkin))
    for name in symkin.__all__:
        assert getattr(symkin, name) is not None
    assert symkin.load is symkin.load_mechanism
    assert symkin.__version__.count(".") == 2


def test_an_absent_name_is_an_attribute_error() -> None:
    with pytest.raises(AttributeError, match="module 'symkin' has no attribute 'lod'"):
        _ = symkin.lod


def test_every_mutation_stands_in_its_source_once() -> None:
    root = Path(__file__).resolve().parents[2]
    listed = tomllib.loads((root / "tests/mutations.toml").read_text(encoding="utf-8"))["mutation"]
    stale = []
    for mutation in listed:
        source = root / "cpp/symkin" / mutation["file"]
        if not source.exists() or source.read_text(encoding="utf-8").count(mutation["before"]) != 1:
            stale.append(mutation["before"])
    assert not stale
