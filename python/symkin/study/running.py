# SPDX-License-Identifier: MIT
"""Running a study here or on a cluster: chunk by chunk, each on the disk as soon as it is there."""

from __future__ import annotations

import functools
import json
import os
import pickle
import shutil
import zipfile
from collections.abc import Callable, Iterator, Mapping, Sequence
from io import BytesIO
from pathlib import Path
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from symkin.cluster import begun, opened_client, spread
from symkin.errors import SymkinError, one_of
from symkin.model.mechanism import Mechanism
from symkin.planning import Plan
from symkin.storage.output_files import OutputFiles
from symkin.storage.tables import write_table
from symkin.study.cost import CostResult, measure_cost
from symkin.study.definition import Cell, StudyDefinition, extension_of, load_study
from symkin.study.result import StudyResult
from symkin.study.robots import COLUMNS, Job, planned

__all__ = ["Chunk", "Progress", "compute", "make_plans", "run_study"]

Array = NDArray[np.float64]
PlanKey = tuple[Any, ...]
Chunk = tuple[int, int]  # first robot, and the one behind the last
Columns = dict[str, NDArray[Any]]
Progress = Callable[[str, float], None]
TableFormat = Literal["csv", "parquet"]

_ROWS = 300  # of a chunk: what a kill can lose is a second of every core


def run_study(
    definition: StudyDefinition | str | os.PathLike[str],
    out: str | os.PathLike[str] | None = None,
    *,
    robots: int | None = None,
    workers: int = 1,
    scheduler: str | None = None,
    format: TableFormat = "csv",  # noqa: A002  # as the command's option
    progress: Progress | None = None,
    overwrite: bool = False,
) -> StudyResult | CostResult:
    """Run a study, or what is left of one that was interrupted.

    Robots are computed in chunks. Each is written to ``out/parts`` when it is there, and is not
    computed again; so a study may be killed and started again, and more robots may be added. The
    same definition gives the same table, byte for byte, wherever it is computed.

    A script that asks for more than one process must do so below ``if __name__ == "__main__":``,
    since they import it.

    Parameters
    ----------
    definition : StudyDefinition, str or path
        What to compare; a name or a file as `load_study` takes it.
    out : str or path, optional
        Folder for ``table.csv`` or ``table.parquet`` and the parts; without one nothing is written.
    robots : int, optional
        In each cell, by default the definition's.
    workers : int
        Processes on this machine. More than one need Dask (``symkin[cluster]``).
    scheduler : str, optional
        Address of a Dask scheduler, whose workers compute instead.
    format : {"csv", "parquet"}
        Of the table.
    progress : callable, optional
        Told what is being done and which share of it is done, from 0 to 1.
    overwrite : bool
        Whether what another study left in the folder may be removed.

    Returns
    -------
    StudyResult, or CostResult for a definition of that kind

    Raises
    ------
    SymkinError
        If the folder holds another study, or the cluster does not answer.
    """
    one_of("format", format, TableFormat)
    if not isinstance(definition, StudyDefinition):
        definition = load_study(definition)
    if robots is not None:
        definition = definition.replace(robots=robots)
    if not 1 <= workers <= 1024:
        raise SymkinError(f"workers is {workers}; expected from 1 to 1024")
    if workers > 1 and scheduler is not None:
        raise SymkinError(
            "workers on this machine and a scheduler are asked for; expected one of the two"
        )
    tell = progress or (lambda _doing, _share: None)
    parts = None if out is None else _Parts(Path(out), definition, overwrite)
    if definition.kind == "cost":
        if workers > 1 or scheduler is not None:
            raise SymkinError(
                "a study of cost measures times, so it runs in one process; leave out workers and "
                "scheduler"
            )
        result: StudyResult | CostResult = measure_cost(definition, tell)
    else:
        result = _simulated(definition, parts, workers, scheduler, tell)
    if parts is not None:
        name = f"table.{format}"
        with OutputFiles(overwrite=parts.own or overwrite) as outputs:
            write_table(outputs.folder(Path(parts.folder), name) / name, result.columns())
    return result


def _simulated(
    definition: StudyDefinition,
    parts: _Parts | None,
    workers: int,
    scheduler: str | None,
    tell: Progress,
) -> StudyResult:
    found: dict[Chunk, Columns] = {}
    for chunk in _chunks(definition):
        known = None if parts is None else parts.read(chunk)
        if known is not None:
            found[chunk] = known
    left = [chunk for chunk in _chunks(definition) if chunk not in found]
    tell("sampling the workspace", 0.0)
    tasks = max(len(left), len(definition.cells))
    with opened_client(workers, scheduler, tasks) as client:
        job = Job.of(definition, lambda poses: make_plans(definition, poses, client), tell)
        # What needs no robot's result goes first: it would be waited for at the end.
        extension = None if client is None else extension_of(definition)
        others = begun(extension[1].calls(definition, job), client) if extension else None
        done = sum(end - first for first, end in found)
        tell("simulating robots", done / definition.robots)
        for chunk, columns in compute(job, left, client):
            if parts is not None:
                parts.write(chunk, columns)
            found[chunk] = columns
            done += chunk[1] - chunk[0]
            tell("simulating robots", done / definition.robots)
        extension_parts = others() if others else None
    table = _joined(job, [found[chunk] for chunk in sorted(found)])
    return StudyResult(definition, table, job, extension_parts=extension_parts)


def _chunks(definition: StudyDefinition) -> Iterator[Chunk]:
    """The chunks of a study: the same whatever computes them, and all but the last for any size."""
    size = max(1, _ROWS // len(definition.cells))
    for first in range(0, definition.robots, size):
        yield first, min(first + size, definition.robots)


def _joined(job: Job, chunks: list[Columns]) -> Columns:
    """Rows of all chunks, cell by cell."""
    columns = {name: np.concatenate([chunk[name] for chunk in chunks]) for name in COLUMNS}
    order = np.lexsort((columns["robot"], columns["cell"]))
    names = np.array([cell.id for cell in job.cells])
    return {
        name: names[values[order]] if name == "cell" else values[order]
        for name, values in columns.items()
    }


class _Parts:
    """The chunks of a study on the disk."""

    def __init__(self, folder: Path, definition: StudyDefinition, overwrite: bool) -> None:
        self.folder, self._parts = folder, folder / "parts"
        self._digest = definition.digest
        self.own = False  # whether what lies in the folder is this study's
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
                shutil.rmtree(self._parts)
        if not self.own:
            for name in ("table.csv", "table.parquet", "results.json", "report.html"):
                if (folder / name).exists() and not overwrite:
                    raise SymkinError(
                        f"{folder / name}: exists, and no parts beside it say that it is this "
                        "study's; choose another folder, or allow files to be replaced "
                        "(--overwrite, in Python overwrite=True)"
                    )
            with OutputFiles() as outputs:
                document = {"digest": self._digest, "study": definition.name}
                outputs.file(mark).write_text(json.dumps(document) + "\n", encoding="utf-8")

    def read(self, chunk: Chunk) -> Columns | None:
        """A chunk that was computed already, if it is there and whole."""
        try:
            whole = BytesIO(self._path(chunk).read_bytes())
            with np.load(whole, allow_pickle=False) as stored:
                columns = {name: stored[name] for name in COLUMNS}
        except (OSError, KeyError, ValueError, EOFError, zipfile.BadZipFile):
            return None
        return columns

    def write(self, chunk: Chunk, columns: Columns) -> None:
        """Write a chunk, whole or not at all."""
        with (
            OutputFiles(overwrite=True) as outputs,
            outputs.file(self._path(chunk)).open("wb") as file,
        ):
            np.savez_compressed(file, **columns)  # type: ignore[arg-type]

    def _path(self, chunk: Chunk) -> Path:
        first, end = chunk
        return self._parts / f"robots-{first:07d}-{end:07d}.npz"


def _digest_of(mark: Path) -> str:
    try:
        document = json.loads(mark.read_text(encoding="utf-8"))
        return str(document["digest"])
    except (OSError, ValueError, KeyError, TypeError):
        return ""


def compute(job: Job, chunks: Sequence[Chunk], client: Any) -> Iterator[tuple[Chunk, Columns]]:
    """Chunks of robots, in whatever order they are ready; without a client computed here."""
    if client is None:
        for chunk in chunks:
            yield chunk, job.chunk(*chunk)
        return
    # The job goes with every chunk: data of its own would be lost with its worker.
    parcel = pickle.dumps(job.light())
    yield from spread(client, _chunk, ((parcel, chunk) for chunk in chunks))


def make_plans(
    definition: StudyDefinition, candidates: Mapping[str, Array], client: Any
) -> Iterator[tuple[PlanKey, Plan | str]]:
    """The plans of a study, in whatever order they are ready; without a client made here.

    `candidates` are the poses to choose from, by the mechanism's name.
    """
    cells = {cell.plan_key: cell for cell in definition.cells}
    # Those that take longest first, so that no process has one left when the others are done.
    cells = dict(sorted(cells.items(), key=lambda item: -_cost(definition, item[1])))
    calls = (
        (key, definition.loaded[cell.mechanism], cell, candidates[cell.mechanism], definition.seed)
        for key, cell in cells.items()
    )
    if client is None:
        for call in calls:
            yield _plan(*call)
    else:
        yield from spread(client, _plan, calls)


def _cost(definition: StudyDefinition, cell: Cell) -> int:
    """How long a plan takes, in a unit of its own: some criteria take the time of six others."""
    counts = [len(leg.parameters) for leg in definition.loaded[cell.mechanism].legs]
    unknowns = sum(counts) if cell.design == "mechanism" else max(counts)
    return unknowns**2 * (1 if cell.criterion == "O1" else 6)


def _plan(
    key: PlanKey, mechanism: Mechanism, cell: Cell, candidates: Array, seed: int
) -> tuple[PlanKey, Plan | str]:
    return key, planned(mechanism, cell, candidates, seed)


def _chunk(parcel: bytes, chunk: Chunk) -> tuple[Chunk, Columns]:
    return chunk, _unpacked(parcel).chunk(*chunk)


@functools.lru_cache(maxsize=2)
def _unpacked(parcel: bytes) -> Job:
    job: Job = pickle.loads(parcel)
    return job
