# SPDX-License-Identifier: MIT
"""Running a study here or on a cluster: chunk by chunk, each on the disk as soon as it is there."""

from __future__ import annotations

import functools
import os
import pickle
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import nullcontext
from pathlib import Path
from typing import Any

import numpy as np

from symkin.cluster import begun, opened_client, spread
from symkin.errors import SymkinError, one_of
from symkin.model.mechanism import Mechanism
from symkin.options import Format, checks
from symkin.planning import Plan
from symkin.storage.output_files import OutputFiles
from symkin.storage.tables import write_table
from symkin.study.cost import CostResult, measure_cost
from symkin.study.definition import Cell, StudyDefinition, extension_of, load_study
from symkin.study.parts import TABLES, Chunk, Columns, Parts
from symkin.study.result import StudyResult
from symkin.study.robots import COLUMNS, Job, planned
from symkin.values import Array

__all__ = ["Chunk", "Progress", "compute", "make_plans", "run_study"]

PlanKey = tuple[Any, ...]
Progress = Callable[[str, float], None]

_ROWS = 300  # of a chunk: what a kill can lose is a second of every core


@checks()
def run_study(
    definition: StudyDefinition | str | os.PathLike[str],
    out: str | os.PathLike[str] | None = None,
    *,
    robots: int | None = None,
    workers: int = 1,
    scheduler: str | None = None,
    format: Format = "csv",  # noqa: A002  # as the command's option
    progress: Progress | None = None,
    overwrite: bool = False,
) -> StudyResult | CostResult:
    """Run a study, or what is left of one that was interrupted.

    Robots are computed in chunks. Each is written to ``out/parts`` when it is there, and is not
    computed again; so a study may be killed and started again, and more robots may be added. A part
    says of what study and robots it is, and is computed again where that or its digest is wrong.
    The same definition gives the same table, byte for byte, wherever it is computed.

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
        If the folder holds another study, another run writes to it, or the cluster does not answer.
    """
    one_of("format", format, Format)
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
    if definition.kind == "cost" and (workers > 1 or scheduler is not None):
        raise SymkinError(
            "a study of cost measures times, so it runs in one process; leave out workers and "
            "scheduler"
        )
    with nullcontext() if out is None else Parts.opened(Path(out), definition, overwrite) as parts:
        result: StudyResult | CostResult
        if definition.kind == "cost":
            result = measure_cost(definition, tell)
        else:
            result = _simulated(definition, parts, workers, scheduler, tell)
        if parts is not None:
            name = f"table.{format}"
            with OutputFiles(overwrite=parts.own or overwrite) as outputs:
                write_table(outputs.folder(parts.folder, *TABLES) / name, result.columns())
    return result


def _simulated(
    definition: StudyDefinition,
    parts: Parts | None,
    workers: int,
    scheduler: str | None,
    tell: Progress,
) -> StudyResult:
    found: dict[Chunk, Columns] = {}
    for chunk in _chunks(definition):
        known = None if parts is None else parts.read(chunk)
        if known is not None:
            found[chunk] = known
    if parts is not None and parts.damaged:
        tell(f"computing damaged parts again: {', '.join(parts.damaged)}", 0.0)
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
