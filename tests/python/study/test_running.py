"""The same table, however and wherever it is computed, and after whatever interrupts it."""

import builtins
import logging
import os
import re
import shutil
import signal
import socket
import subprocess
import sys
import threading
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import distributed
import numpy as np
import pytest

import symkin
from symkin.cluster import dask_client
from symkin.storage.tables import read_table
from symkin.study import StudyDefinition, StudyResult, run_study


def _command(study: Path, out: Path, *options: str) -> list[str]:
    return [sys.executable, "-m", "symkin", "study", str(study), "--out", str(out), *options]


def _table(folder: Path) -> bytes:
    return (folder / "table.csv").read_bytes()


def _complain() -> None:
    """Log as a worker does whose scheduler has closed before it, then fail."""
    logging.getLogger("distributed.worker").error("no heartbeat")
    raise ValueError("told")


def test_what_workers_log_is_not_shown_but_what_fails_is_raised(
    capfd: pytest.CaptureFixture[str],
) -> None:
    with dask_client(1) as client, pytest.raises(ValueError, match="told"):
        client.submit(_complain).result()
    assert capfd.readouterr().err == ""


def test_two_processes_make_the_same_table(
    small: Path, undisturbed: tuple[StudyResult, Path], tmp_path: Path
) -> None:
    subprocess.run(_command(small, tmp_path, "--workers", "2"), check=True, capture_output=True)
    assert _table(tmp_path) == _table(undisturbed[1])


def test_a_study_that_was_killed_continues_where_it_stopped(
    small: Path, undisturbed: tuple[StudyResult, Path], tmp_path: Path
) -> None:
    with subprocess.Popen(_command(small, tmp_path), stdout=subprocess.DEVNULL) as running:
        while running.poll() is None and not list(tmp_path.glob("parts/*.part")):
            time.sleep(0.01)
        running.send_signal(signal.SIGKILL)
    found = {path: path.stat().st_mtime_ns for path in tmp_path.glob("parts/*.part")}
    assert 0 < len(found) < 3
    assert not (tmp_path / "table.csv").exists()
    run_study(small, tmp_path)
    assert _table(tmp_path) == _table(undisturbed[1])
    assert all(path.stat().st_mtime_ns == written for path, written in found.items())


def test_a_worker_that_is_killed_loses_nothing(
    small: Path,
    undisturbed: tuple[StudyResult, Path],
    tmp_path: Path,
    cluster: distributed.LocalCluster,
) -> None:
    killed = []

    def kill_one(_doing: str, _share: float) -> None:
        if not killed:
            killed.append(next(iter(cluster.workers.values())).pid)
            os.kill(killed[0], signal.SIGKILL)

    run_study(small, tmp_path, scheduler=cluster.scheduler_address, progress=kill_one)
    assert killed
    assert _table(tmp_path) == _table(undisturbed[1])


def test_robots_can_be_added(
    small: Path, undisturbed: tuple[StudyResult, Path], tmp_path: Path
) -> None:
    few = run_study(small, tmp_path, robots=60)
    assert isinstance(few, StudyResult)
    assert few.robots == 60
    run_study(small, tmp_path)
    assert _table(tmp_path) == _table(undisturbed[1])


def _flipped(at: int) -> Callable[[bytes], bytes]:
    def changed(part: bytes) -> bytes:
        damaged = bytearray(part)
        damaged[at] ^= 0x10
        return bytes(damaged)

    return changed


_HEAD = b'{"study": "another", "robots": [0, 20], "sha256": "'
_DAMAGES: dict[str, Callable[[bytes], bytes]] = {
    "emptied": lambda _: b"",
    "torn in its head": lambda part: part[:40],
    "torn in its body": lambda part: part[:-100],
    "with bytes behind it": lambda part: part + b"\0",
    "without its head": lambda part: part.partition(b"\n")[2],
    "without its body": lambda part: part.partition(b"\n")[0] + b"\n",
    "of another study": lambda part: _HEAD + part.partition(b'"sha256": "')[2],
    "of other robots": lambda part: part.replace(b'"robots": [0, ', b'"robots": [1, ', 1),
    "of text": lambda _: b"robot,seed\n1,1\n",
    "of zeros": lambda part: bytes(len(part)),
    "twice": lambda part: part + part,
    **{f"with bit {at} flipped": _flipped(at) for at in (3, 60, 200, 1000, -1)},
}


@pytest.fixture
def folder(ran: Path, tmp_path: Path) -> Path:
    """A copy of a study that has run."""
    return Path(shutil.copytree(ran, tmp_path / "study"))


@pytest.mark.parametrize("damage", _DAMAGES)
def test_a_damaged_part_is_named_and_computed_again(
    one_cell: StudyDefinition, ran: Path, folder: Path, damage: str
) -> None:
    (part,) = folder.glob("parts/*.part")
    part.write_bytes(_DAMAGES[damage](part.read_bytes()))
    (folder / "table.csv").unlink()
    told: list[str] = []
    run_study(one_cell, folder, progress=lambda doing, _: told.append(doing))
    assert _table(folder) == _table(ran)
    assert any("damaged" in doing and part.name in doing for doing in told)


def test_parts_that_were_exchanged_are_computed_again(
    small: Path, undisturbed: tuple[StudyResult, Path], tmp_path: Path
) -> None:
    folder = tmp_path / "study"
    shutil.copytree(undisturbed[1], folder)
    first, second, *_ = sorted(folder.glob("parts/*.part"))
    one, other = first.read_bytes(), second.read_bytes()
    first.write_bytes(other)
    second.write_bytes(one)
    run_study(small, folder)
    assert _table(folder) == _table(undisturbed[1])


_MARKS = {
    "missing": None,
    "empty": "",
    "torn": '{"digest": "',
    "of another study": '{"digest": "0", "study": "other"}',
    "of another kind": "[1, 2]",
}


@pytest.mark.parametrize("mark", _MARKS)
def test_parts_that_do_not_say_whose_they_are_are_refused_and_kept(
    one_cell: StudyDefinition, ran: Path, folder: Path, mark: str
) -> None:
    (folder / "parts" / "study.json").unlink()
    text = _MARKS[mark]
    if text is not None:
        (folder / "parts" / "study.json").write_text(text, encoding="utf-8")
    files = {path: path.read_bytes() for path in folder.rglob("*") if path.is_file()}
    with pytest.raises(symkin.SymkinError, match=r"exists, and no parts|parts of another study"):
        run_study(one_cell, folder)
    assert {path: path.read_bytes() for path in files} == files
    run_study(one_cell, folder, overwrite=True)
    assert _table(folder) == _table(ran)


@pytest.mark.parametrize("name", ["parts", "parts/study.json", "table.csv", "PART"])
def test_what_stands_in_the_place_of_a_file_is_refused_and_kept(
    one_cell: StudyDefinition, folder: Path, name: str
) -> None:
    """A folder where a file belongs, or a file where a folder does."""
    (part,) = folder.glob("parts/*.part")
    place = part if name == "PART" else folder / name
    if place.is_dir():
        shutil.rmtree(place)
        place.write_text("mine", encoding="utf-8")
    else:
        place.unlink()
        place.mkdir()
        (place / "mine").write_text("mine", encoding="utf-8")
    with pytest.raises(symkin.SymkinError, match=f"{re.escape(place.name)}|another study"):
        run_study(one_cell, folder)
    mine = place if place.is_file() else place / "mine"
    assert mine.read_text(encoding="utf-8") == "mine"


def test_a_second_run_in_the_folder_is_refused_while_the_first_lives(
    one_cell: StudyDefinition, tmp_path: Path
) -> None:
    refused: list[str] = []

    def meanwhile(_doing: str, _share: float) -> None:
        if not refused:
            with pytest.raises(symkin.SymkinError, match="another run is at work") as told:
                run_study(one_cell.replace(seed=2), tmp_path, overwrite=True)
            refused.append(str(told.value))

    run_study(one_cell, tmp_path, progress=meanwhile)
    assert refused
    run_study(one_cell, tmp_path)  # and not when it has ended


def test_parts_of_another_study_are_refused_and_kept(
    one_cell: StudyDefinition, tmp_path: Path
) -> None:
    run_study(one_cell, tmp_path)
    whole = _table(tmp_path)
    with pytest.raises(symkin.SymkinError, match="parts of another study"):
        run_study(one_cell.replace(seed=2), tmp_path)
    assert _table(tmp_path) == whole
    run_study(one_cell.replace(seed=2), tmp_path, overwrite=True)
    assert _table(tmp_path) != whole


def test_a_table_that_is_not_the_studys_is_not_replaced(
    one_cell: StudyDefinition, tmp_path: Path
) -> None:
    (tmp_path / "table.csv").write_text("mine\n", encoding="utf-8")
    with pytest.raises(symkin.SymkinError, match=r"table\.csv: exists"):
        run_study(one_cell, tmp_path)
    assert (tmp_path / "table.csv").read_text(encoding="utf-8") == "mine\n"
    assert not (tmp_path / "parts").exists()


def test_a_parquet_table_has_the_same_numbers(one_cell: StudyDefinition, tmp_path: Path) -> None:
    result = run_study(one_cell, tmp_path, format="parquet")
    assert isinstance(result, StudyResult)
    table = read_table(tmp_path / "table.parquet")
    assert table.numbers("position_rms_m").tolist() == result.table["position_rms_m"].tolist()
    assert table.words("cell", list(result.cells)) == result.table["cell"].tolist()


def test_without_dask_one_process_works_and_two_say_what_to_install(
    one_cell: StudyDefinition, monkeypatch: pytest.MonkeyPatch
) -> None:
    real = builtins.__import__

    def without(name: str, *rest: Any) -> Any:
        if name.partition(".")[0] in ("dask", "distributed"):
            raise ImportError(name)
        return real(name, *rest)

    monkeypatch.setattr(builtins, "__import__", without)
    run_study(one_cell)
    with pytest.raises(symkin.SymkinError, match=r"pip install 'symkin\[cluster\]'"):
        run_study(one_cell, workers=2)


def test_a_port_that_is_silent_is_told(
    one_cell: StudyDefinition, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("symkin.cluster._CONNECT", 1)
    with socket.socket() as silent:
        silent.bind(("127.0.0.1", 0))
        silent.listen()
        address = f"tcp://127.0.0.1:{silent.getsockname()[1]}"
        with pytest.raises(symkin.SymkinError, match="no Dask scheduler answers"):
            run_study(one_cell, scheduler=address)


@pytest.mark.parametrize(
    ("answer", "words"),
    [
        (socket.gaierror(-2, "Name or service not known"), "Name or service not known"),
        (None, "no answer within 0.1 s"),
    ],
)
def test_a_host_that_nobody_knows_is_told_at_once(
    one_cell: StudyDefinition,
    monkeypatch: pytest.MonkeyPatch,
    answer: OSError | None,
    words: str,
) -> None:
    asked = threading.Event()

    def resolved(*_: object) -> None:
        if answer is not None:
            raise answer
        asked.wait(5)

    monkeypatch.setattr("symkin.cluster.socket.getaddrinfo", resolved)
    monkeypatch.setattr("symkin.cluster._RESOLVED", 0.1)
    with pytest.raises(symkin.SymkinError, match=f"nowhere cannot be resolved .{words}"):
        run_study(one_cell, scheduler="tcp://nowhere:8786")
    asked.set()


def test_tls_without_certificates_is_told(one_cell: StudyDefinition) -> None:
    with pytest.raises(symkin.SymkinError, match=r"TLS needs certificates.*distributed\.comm\.tls"):
        run_study(one_cell, scheduler="tls://127.0.0.1:1")


def test_a_scheduler_that_does_not_answer_is_told(
    one_cell: StudyDefinition, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("symkin.cluster._CONNECT", 0.5)
    with pytest.raises(symkin.SymkinError, match="no Dask scheduler answers"):
        run_study(one_cell, scheduler="tcp://127.0.0.1:9")


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"workers": 0}, "workers is 0; expected a whole number from 1"),
        ({"workers": 2, "scheduler": "tcp://127.0.0.1:9"}, "expected one of the two"),
        ({"format": "xls"}, 'expected "csv" or "parquet"'),
    ],
)
def test_wrong_options_are_refused(
    one_cell: StudyDefinition, options: dict[str, Any], words: str
) -> None:
    with pytest.raises(symkin.SymkinError, match=words):
        run_study(one_cell, **options)


def test_progress_begins_where_the_run_before_stopped(
    one_cell: StudyDefinition, tmp_path: Path
) -> None:
    shares: list[float] = []
    run_study(one_cell, tmp_path, progress=lambda _doing, share: shares.append(share))
    assert np.all(np.diff(shares) >= 0)
    assert shares[-1] == 1
    again: list[tuple[str, float]] = []
    run_study(one_cell, tmp_path, progress=lambda *told: again.append(told))
    assert [share for doing, share in again if doing == "simulating robots"] == [1]
