# SPDX-License-Identifier: MIT
"""Output files that appear whole or not at all, and never replace what cannot be made again."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterable
from contextlib import ExitStack
from pathlib import Path
from tempfile import TemporaryDirectory
from types import TracebackType
from typing import Any

from symkin.errors import SymkinError

__all__ = ["OutputFiles"]

_RECORD = ".symkin.json"


class OutputFiles:
    """A context in which a command writes its outputs, to places that are moved at its end.

    A file that exists is replaced only if it would be the same, if the same command wrote it and
    nobody has changed it since, or with `overwrite`; an input of the command never is. For this,
    what is written is noted with its checksum in ``.symkin.json`` beside it.

    Parameters
    ----------
    command : str
        The command that writes.
    inputs : iterable of path or None
        Files that it reads.
    overwrite : bool
        Whether files may be replaced that it did not write.
    """

    def __init__(
        self, command: str, inputs: Iterable[Path | None], overwrite: bool = False
    ) -> None:
        self._command = command
        self._inputs = [path for path in inputs if path is not None]
        self._overwrite = overwrite
        self._stages: list[tuple[Path, Path]] = []
        self._files: set[Path] = set()
        self._cleanup = ExitStack()

    def file(self, path: Path) -> Path:
        """Return where to write a file that shall be at `path`."""
        if path.is_dir():
            raise SymkinError(f"{path}: is a folder; expected a file")
        if path.resolve() in self._files:
            raise SymkinError(f"{path}: is to hold two outputs; expected two files")
        self._files.add(path.resolve())
        # A link stays one, and what it points to is the file.
        target = path.resolve() if path.is_symlink() else path
        self._require_not_an_input(target)
        return self.folder(target.parent) / target.name

    def folder(self, path: Path, *names: str) -> Path:
        """Return an empty folder in which to write what shall be in the folder `path`.

        Files with `names` will surely be written: none may be an input. Others may be.
        """
        if path.exists() and not path.is_dir():
            raise SymkinError(f"{path}: is not a folder; choose another place")
        for name in names:
            self._require_not_an_input(path / name)
        path.mkdir(parents=True, exist_ok=True)
        stage = self._cleanup.enter_context(TemporaryDirectory(prefix=".symkin-", dir=path))
        self._stages.append((Path(stage), path))
        return Path(stage)

    def __enter__(self) -> OutputFiles:
        """Begin."""
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        """Move what was written to its place, if nothing went wrong."""
        with self._cleanup:
            if kind is None:
                self._move()

    def _move(self) -> None:
        moves = [
            (staged, folder / staged.relative_to(stage))
            for stage, folder in self._stages
            for staged in sorted(stage.rglob("*"))
            if staged.is_file()
        ]
        for staged, target in moves:
            self._require_replaceable(staged, target)
        for staged, target in moves:
            target.parent.mkdir(parents=True, exist_ok=True)
            checksum = _checksum(staged)
            staged.replace(target)
            _note(target, self._command, checksum)

    def _require_not_an_input(self, target: Path) -> None:
        if target.exists() and any(
            path.exists() and path.samefile(target) for path in self._inputs
        ):
            raise SymkinError(
                f"{target}: is an input of this command; choose another place for its output"
            )

    def _require_replaceable(self, staged: Path, target: Path) -> None:
        self._require_not_an_input(target)
        if not target.exists():
            return
        if not target.is_file():
            raise SymkinError(f"{target}: is not a regular file; choose another place")
        checksum = _checksum(target)
        known = _noted(target.parent).get(target.name)
        mine = known == {"command": self._command, "sha256": checksum}
        if not (self._overwrite or mine or checksum == _checksum(staged)):
            raise SymkinError(
                f"{target}: exists, and is not as `symkin {self._command}` wrote it; choose "
                "another place, or allow it to be replaced with --overwrite"
            )


def _checksum(path: Path) -> str:
    return hashlib.sha256(path.read_bytes()).hexdigest()


def _noted(folder: Path) -> dict[str, Any]:
    """What symkin wrote in a folder; a record that cannot be read tells nothing."""
    try:
        files = json.loads((folder / _RECORD).read_text(encoding="utf-8"))["files"]
    except (OSError, ValueError, KeyError, TypeError):
        return {}
    return files if isinstance(files, dict) else {}


def _note(path: Path, command: str, checksum: str) -> None:
    files = _noted(path.parent) | {path.name: {"command": command, "sha256": checksum}}
    text = json.dumps({"files": dict(sorted(files.items()))}, indent=2) + "\n"
    (path.parent / _RECORD).write_text(text, encoding="utf-8")
