"""A small study, and a Dask cluster on this machine."""

from collections.abc import Iterator
from pathlib import Path

import pytest

from symkin.study import StudyDefinition, StudyResult, run_study

distributed = pytest.importorskip("distributed")

SMALL = """
title = "A small study"
mechanisms = ["3RRR"]
candidates = 2000
evaluation_poses = 50
estimators = ["paper", "implicit", "inverse"]
use = ["own", "all"]
robots = 120
seed = 3
"""


@pytest.fixture(scope="session")
def small(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The file of a study of six cells and three chunks."""
    path = tmp_path_factory.mktemp("study") / "small.toml"
    path.write_text(SMALL, encoding="utf-8")
    return path


@pytest.fixture(scope="session")
def undisturbed(small: Path, tmp_path_factory: pytest.TempPathFactory) -> tuple[StudyResult, Path]:
    """The study, run in one process, and its folder."""
    out = tmp_path_factory.mktemp("undisturbed") / "out"
    result = run_study(small, out)
    assert isinstance(result, StudyResult)
    return result, out


@pytest.fixture(scope="session")
def cluster() -> Iterator["distributed.LocalCluster"]:
    """Two worker processes behind a scheduler."""
    with distributed.LocalCluster(
        n_workers=2, threads_per_worker=1, processes=True, dashboard_address=":0"
    ) as running:
        yield running


@pytest.fixture(scope="session")
def one_cell() -> StudyDefinition:
    """A study of a single cell and few robots."""
    return StudyDefinition(
        mechanisms=("3RRR",), robots=3, candidates=1000, evaluation_poses=20, pose_counts=(12,)
    )


@pytest.fixture(scope="session")
def ran(one_cell: StudyDefinition, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder of its run."""
    out = tmp_path_factory.mktemp("ran") / "out"
    run_study(one_cell, out)
    return out
