# SPDX-License-Identifier: MIT
"""The chunks of a study on the disk: each proves what it is of, and one run alone writes them."""

from __future__ import annotations

import hashlib
import json
import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from symkin.errors import SymkinError
from symkin.storage.output_files import OutputFiles, alone
from symkin.study.definition import StudyDefinition
from symkin.study.robots import COLUMNS

Chunk = tuple[int, int]  # first robot, and the one behind the last
Columns = dict[str, NDArray[Any]]

TABLES = ("table.csv", "table.parquet")
_OTHER_FILES = (*TABLES, "results.json", "report.html")


class Parts:
    """The chunks of a study in a folder.

    Attributes
    ----------
    folder : Path
        Of the study; they are in ``parts`` of it.
    own : bool
        Whether what lay in the folder is this study's.
    damaged : list of str
        Names of parts that were there, but are not what they should be.
    """

    def __init__(self, folder: Path, definition: StudyDefinition, *, overwrite: bool) -> None:
        self.folder, self._parts = folder, folder / "parts"
        self._digest, self.damaged = definition.digest, list[str]()
        self.own = False
        mark = self._parts / "study.json"
        if mark.exists():
            self.own = _digest_of(mark) == self._digest
            if not self.own and not overwrite:
                raise SymkinError(
                    f"{folder}: holds the parts of another study (its definition, a mechanism or "
                    "the version of symkin was another); choose another folder, or allow them to "
                    "be removed (--overwrite, in Python overwrite=True)"
                )
            if not self.own:
                for part in self._parts.glob("*.part"):
                    part.unlink()
        if not self.own:
            for name in _OTHER_FILES:
                if (folder / name).exists() and not overwrite:
                    raise SymkinError(
                        f"{folder / name}: exists, and no parts beside it say that it is this "
                        "study's; choose another folder, or allow files to be replaced "
                        "(--overwrite, in Python overwrite=True)"
                    )
            for name in _OTHER_FILES:
                (folder / name).unlink(missing_ok=True)
            with OutputFiles(overwrite=True) as outputs:
                document = {"digest": self._digest, "study": definition.name}
                outputs.file(mark).write_text(
                    json.dumps(document) + "\n", encoding="utf-8", newline="\n"
                )

    @classmethod
    @contextmanager
    def opened(cls, folder: Path, definition: StudyDefinition, overwrite: bool) -> Iterator[Parts]:
        """Keep other runs out of the folder as long as this one lives."""
        fresh = not (folder / "parts").exists()
        with alone(folder / "parts"):
            try:
                parts = cls(folder, definition, overwrite=overwrite)
            except SymkinError:
                if fresh:
                    shutil.rmtree(folder / "parts")
                raise
            yield parts

    def read(self, chunk: Chunk) -> Columns | None:
        """A chunk that was computed already, if it is there and proves to be that."""
        path = self._path(chunk)
        try:
            head, _, body = path.read_bytes().partition(b"\n")
        except OSError:
            return None
        if head != self._head(chunk, body):
            self.damaged.append(path.name)
            return None
        with np.load(BytesIO(body), allow_pickle=False) as stored:
            return {name: stored[name] for name in COLUMNS}

    def write(self, chunk: Chunk, columns: Columns) -> None:
        """Write a chunk, whole or not at all."""
        body = BytesIO()
        np.savez_compressed(body, **columns)  # type: ignore[arg-type]
        content = body.getvalue()
        with OutputFiles(overwrite=True) as outputs:
            place = outputs.file(self._path(chunk))
            place.write_bytes(self._head(chunk, content) + b"\n" + content)

    def _path(self, chunk: Chunk) -> Path:
        first, end = chunk
        return self._parts / f"robots-{first:07d}-{end:07d}.part"

    def _head(self, chunk: Chunk, body: bytes) -> bytes:
        """The first line of a part: whose it is, and the digest of what follows."""
        of = {"study": self._digest, "robots": list(chunk)}
        return json.dumps(of | {"sha256": hashlib.sha256(body).hexdigest()}).encode()


def _digest_of(mark: Path) -> str:
    try:
        document = json.loads(mark.read_text(encoding="utf-8"))
        return str(document["digest"])
    except (OSError, ValueError, KeyError, TypeError):
        return ""
