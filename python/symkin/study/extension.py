# SPDX-License-Identifier: MIT
"""Studies that other packages bring, and what those packages say of their results.

A package offers one as an entry point of the group ``symkin.studies``, whose name is the study's
and whose object is a `StudyExtension`.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from symkin.values import record

if TYPE_CHECKING:
    from importlib.metadata import EntryPoint

GROUP = "symkin.studies"

# Packages of the project that bring studies and are not always installed.
KNOWN = {"paper": "symkin-paper, in the folder paper of symkin's source"}


@record
class StudyExtension:
    """A study with questions of its own.

    Attributes
    ----------
    file : Path
        The study, a TOML file. The extension is asked about every study that has all of its cells.
    calls : callable
        Of the `StudyDefinition` and its `Job`: the calls (a function, then its arguments) for what
        needs no robot's result. Workers make them beside the robots, so they can be pickled.
    findings : callable
        Of the `StudyResult`, and ``parts=`` what those calls returned or None: what the study says
        of the questions. It can be pickled, and has ``to_dict()``.
    page : callable
        Of the `StudyResult` and the findings: the `Page` that tells them.
    """

    file: Path
    calls: Callable[..., Sequence[tuple[Any, ...]]]
    findings: Callable[..., Any]
    page: Callable[..., Any]


def extension_names() -> list[str]:
    """Return the names of the studies that installed packages bring."""
    return sorted({each.name for each in _brought()})


def extension_named(name: str) -> StudyExtension | None:
    """Return the study that an installed package brings under a name."""
    for each in _brought(name=name):
        found = each.load()
        assert isinstance(found, StudyExtension), each.value
        return found
    return None


def _brought(name: str | None = None) -> Iterable[EntryPoint]:
    from importlib.metadata import entry_points  # which takes long to import

    return [each for each in entry_points(group=GROUP) if name is None or each.name == name]
