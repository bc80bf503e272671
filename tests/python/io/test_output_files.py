# SPDX-License-Identifier: MIT
"""Files are old or new, whatever happens, and replaced only if they may be."""

from __future__ import annotations

import ast
import os
import signal
import subprocess
import sys
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress
from pathlib import Path

import pytest

import symkin
from symkin.analysis.checks import check_mechanism
from symkin.errors import SymkinError
from symkin.model.settings import ProtocolSettings
from symkin.pipeline import ProtocolResult
from symkin.storage.output_files import OutputFiles
from symkin.storage.results_file import write_results

NAMES = ("a.txt", "b.txt", "c.txt", "d.txt")


def _write(path: Path, text: str, *, overwrite: bool = False) -> None:
    with OutputFiles(overwrite=overwrite) as outputs:
        outputs.file(path).write_text(text)


def _names(folder: Path) -> list[str]:
    return sorted(path.name for path in folder.iterdir())


def test_a_file_that_exists_is_replaced_only_if_told_so(tmp_path: Path) -> None:
    path = tmp_path / "plan.csv"
    path.write_text("mine")
    with pytest.raises(SymkinError, match=r"plan\.csv: exists; .*--overwrite"):
        _write(path, "two")
    assert path.read_text() == "mine"
    _write(path, "two", overwrite=True)
    assert path.read_text() == "two"
    assert _names(tmp_path) == ["plan.csv"]


def test_targets_are_refused_when_they_are_named(tmp_path: Path) -> None:
    (tmp_path / "report.html").write_text("mine")
    with pytest.raises(SymkinError, match="exists"):
        OutputFiles().file(tmp_path / "report.html")
    with pytest.raises(SymkinError, match=r"report\.html: exists"):
        OutputFiles().folder(tmp_path, "plan.html", "report.html")
    (tmp_path / "file").write_text("mine")
    (tmp_path / "folder").mkdir()
    with OutputFiles(overwrite=True) as outputs:
        with pytest.raises(SymkinError, match="is not a folder"):
            outputs.folder(tmp_path / "file")
        with pytest.raises(SymkinError, match=r'is to be a folder, .* without ".toml"'):
            outputs.folder(tmp_path / "calibrated.toml")
        with pytest.raises(SymkinError, match="is a folder; expected a file"):
            outputs.file(tmp_path / "folder")
        with pytest.raises(SymkinError, match="cannot be written to: "):
            outputs.file(tmp_path / "file" / "plan.csv")
        with pytest.raises(SymkinError, match="not a regular file"):
            outputs.file(Path("/dev/null"))
    assert _names(tmp_path) == ["file", "folder", "report.html"]


def test_a_target_that_cannot_be_written_is_refused_when_it_is_named(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "kept.csv").write_text("mine")
    # Root, as whom tests may run, may write everywhere but in /proc.
    monkeypatch.setattr(os, "access", lambda path, mode: (path.name, mode) != ("kept.csv", os.W_OK))
    with OutputFiles(overwrite=True) as outputs:
        with pytest.raises(SymkinError, match="write-protected"):
            outputs.file(tmp_path / "kept.csv")
        with pytest.raises(SymkinError, match="/proc: cannot be written to: "):
            outputs.file(Path("/proc/plan.csv"))


@pytest.mark.parametrize("first", ["file", "folder"])
def test_two_outputs_do_not_share_a_place(tmp_path: Path, first: str) -> None:
    (tmp_path / "real").mkdir()
    (tmp_path / "link").symlink_to(tmp_path / "real")

    def named(file: str, folder: str, *names: str) -> None:
        with OutputFiles() as outputs:
            steps: list[Callable[[], object]] = [
                lambda: outputs.file(tmp_path / file),
                lambda: outputs.folder(tmp_path / folder, *names),
            ]
            for step in steps if first == "file" else reversed(steps):
                step()

    named("real/plan.csv", "link", "plan.html")
    for file, folder, names in (
        ("real/plan.html", "link", ["plan.html"]),
        ("rep", "rep", []),
        ("rep", "rep/page", []),
    ):
        with pytest.raises(SymkinError, match=r"two outputs|a file and a folder"):
            named(file, folder, *names)
    with OutputFiles() as outputs:
        outputs.file(tmp_path / "real" / "a")
        with pytest.raises(SymkinError, match="two outputs"):
            outputs.file(tmp_path / "link" / "a")


def test_either_all_files_are_written_or_none(tmp_path: Path) -> None:
    (tmp_path / "second").write_text("mine")
    outputs = OutputFiles()
    folder = outputs.folder(tmp_path)
    (folder / "first").write_text("one")
    (folder / "second").write_text("two")
    with pytest.raises(SymkinError, match="second: exists"):
        outputs.__exit__(None, None, None)
    assert _names(tmp_path) == ["second"]
    assert (tmp_path / "second").read_text() == "mine"


def test_what_an_earlier_run_wrote_and_this_one_does_not_is_removed(tmp_path: Path) -> None:
    for name in NAMES:
        (tmp_path / name).write_text("earlier")

    def write(*names: str, overwrite: bool) -> None:
        with OutputFiles(overwrite=overwrite) as outputs:
            folder = outputs.folder(tmp_path, "a.txt", *names)
            (folder / "a.txt").write_text("now")

    with pytest.raises(SymkinError, match=r"a\.txt: exists"):
        write("b.txt", "c.txt", overwrite=False)
    with suppress(KeyboardInterrupt), OutputFiles(overwrite=True) as outputs:
        outputs.folder(tmp_path, *NAMES)
        raise KeyboardInterrupt
    assert _names(tmp_path) == [*NAMES]
    write("b.txt", "c.txt", overwrite=True)
    assert _names(tmp_path) == ["a.txt", "d.txt"]  # of which d.txt is somebody else's
    assert (tmp_path / "a.txt").read_text() == "now"


def test_a_failed_command_leaves_nothing(tmp_path: Path) -> None:
    outputs = OutputFiles()
    outputs.file(tmp_path / "new" / "folder" / "plan.csv").write_text("half")
    outputs.__exit__(ZeroDivisionError, ZeroDivisionError(), None)
    assert _names(tmp_path) == []


def test_an_input_is_never_replaced(tmp_path: Path) -> None:
    path = tmp_path / "input.csv"
    path.write_text("mine")
    (tmp_path / "link.csv").symlink_to(path)
    (tmp_path / "same.csv").hardlink_to(path)
    for name in ("input.csv", "link.csv", "same.csv"):
        with (
            pytest.raises(SymkinError, match="is an input"),
            OutputFiles([path], overwrite=True) as outputs,
        ):
            outputs.file(tmp_path / name)
    with (
        pytest.raises(SymkinError, match="is an input"),
        OutputFiles([path], overwrite=True) as outputs,
    ):
        (outputs.folder(tmp_path) / "input.csv").write_text("two")
    assert path.read_text() == "mine"


def test_a_link_stays_one(tmp_path: Path) -> None:
    (tmp_path / "data").mkdir()
    (tmp_path / "plan.csv").symlink_to(tmp_path / "data" / "plan.csv")
    _write(tmp_path / "plan.csv", "one")
    _write(tmp_path / "plan.csv", "two", overwrite=True)
    assert (tmp_path / "plan.csv").is_symlink()
    assert (tmp_path / "data" / "plan.csv").read_text() == "two"


# Writes four files and kills itself before one of the renames; the last rename is never reached.
_KILLED = """
import os, pathlib, signal, sys
from symkin.storage.output_files import OutputFiles

folder, left = pathlib.Path(sys.argv[1]), int(sys.argv[2])
replace = pathlib.Path.replace

def replace_or_die(self, target):
    global left
    if left == 0:
        os.kill(os.getpid(), signal.SIGKILL)
    left -= 1
    return replace(self, target)

pathlib.Path.replace = replace_or_die
with OutputFiles(overwrite=True) as outputs:
    stage = outputs.folder(folder)
    for name in sys.argv[3:]:
        (stage / name).write_text("new")
    if left < 0:
        os.kill(os.getpid(), signal.SIGKILL)
"""


def _killed(folder: Path, moved: int) -> None:
    killed = subprocess.run([sys.executable, "-c", _KILLED, folder, str(moved), *NAMES])
    assert killed.returncode == -signal.SIGKILL


def test_a_process_killed_while_it_writes_changes_nothing_and_is_swept(tmp_path: Path) -> None:
    _write(tmp_path / "a.txt", "old")
    _killed(tmp_path, -1)
    assert len(_names(tmp_path)) == 2
    _write(tmp_path / "plan.csv", "one")
    assert _names(tmp_path) == ["a.txt", "plan.csv"]
    assert (tmp_path / "a.txt").read_text() == "old"


@pytest.mark.parametrize("moved", range(4))
def test_a_process_killed_while_it_moves_leaves_whole_files_and_says_so(
    tmp_path: Path, moved: int
) -> None:
    for name in NAMES:
        _write(tmp_path / name, "old")
    _killed(tmp_path, moved)
    texts = [(tmp_path / name).read_text() for name in NAMES]
    assert texts == ["new"] * moved + ["old"] * (4 - moved)
    (left,) = tmp_path.glob("symkin-unfinished-*")
    assert _names(left) == list(NAMES[moved:])
    with pytest.raises(SymkinError, match=f"was killed .* in {left.name}: .* of two runs"):
        _write(tmp_path / "a.txt", "next")
    # Another output does not make up for it, those of the same command do.
    _write(tmp_path / "plan.csv", "one")
    assert left.exists()
    with OutputFiles(overwrite=True) as outputs:
        folder = outputs.folder(tmp_path, *NAMES)
        for name in NAMES:
            (folder / name).write_text("next")
    assert _names(tmp_path) == [*NAMES, "plan.csv"]
    assert {(tmp_path / name).read_text() for name in NAMES} == {"next"}


def test_what_a_living_process_writes_is_left_alone(tmp_path: Path) -> None:
    with OutputFiles() as outputs:
        written = outputs.file(tmp_path / "one.csv")
        written.write_text("one")
        _write(tmp_path / "two.csv", "two")
        assert written.read_text() == "one"
    assert _names(tmp_path) == ["one.csv", "two.csv"]


def test_a_stage_that_another_container_holds_is_left_alone(tmp_path: Path) -> None:
    import fcntl

    gone = subprocess.run(
        [sys.executable, "-c", "import os; print(os.getpid())"], text=True, capture_output=True
    ).stdout.strip()
    stage = tmp_path / f".symkin-{gone}-abc"
    stage.mkdir()
    descriptor = os.open(stage, os.O_RDONLY)
    fcntl.flock(descriptor, fcntl.LOCK_EX)
    _write(tmp_path / "one.csv", "one")
    assert stage.exists()
    os.close(descriptor)
    _write(tmp_path / "two.csv", "two")
    assert not stage.exists()


# As on Windows: without what POSIX alone has, folders cannot be opened, files are locked by msvcrt,
# and os.kill would end a process.
_WITHOUT_LOCKS = """
import contextlib, importlib, os, pathlib, signal, subprocess, sys, types
ROOMS = "acceptance", "identify", "measure", "mechanism", "protocol", "show"
ALL = ("symkin.cluster", "symkin.show.served", *(f"symkin.cli.{room}" for room in ROOMS))

def import_all():
    for name in ALL:
        importlib.import_module(name)

# What it imports of others.
told = "import importlib, sys; [importlib.import_module(each) for each in sys.argv[1:]]; " \\
    "print(*sys.modules)"
for name in subprocess.check_output([sys.executable, "-c", told, *ALL], text=True).split():
    if not name.startswith("symkin"):
        with contextlib.suppress(Exception):
            importlib.import_module(name)
del sys.modules["shutil"]  # which looks at what is there when it is imported
for name in ("fcntl", "resource", "pwd", "grp", "termios", "tty", "pty", "syslog"):
    sys.modules[name] = None
for place, names in ((os, ("fork", "getuid", "uname", "killpg", "setsid", "sched_getaffinity")),
                     (signal, ("SIGKILL", "SIGHUP", "SIGALRM", "pthread_sigmask"))):
    for name in names:
        delattr(place, name)
held = []

def locking(descriptor, how, count):
    file = os.fstat(descriptor).st_ino, os.lseek(descriptor, 0, os.SEEK_CUR), count
    if how == 0:
        held.remove(file)
    elif file in held:
        raise PermissionError(13, "Permission denied")
    else:
        held.append(file)

sys.modules["msvcrt"] = types.SimpleNamespace(locking=locking, LK_UNLCK=0, LK_NBLCK=2)
open_file = os.open

def open_no_folder(path, *how):
    if os.path.isdir(path):
        raise PermissionError(path)
    return open_file(path, *how)

def unless_open(change):
    def changed(path, *others, **how):
        for place in map(os.path.realpath, (path, *others)):
            for descriptor in os.listdir("/proc/self/fd"):
                held_open = os.path.realpath(f"/proc/self/fd/{descriptor}")
                if held_open == place or held_open.startswith(place + os.sep):
                    raise PermissionError(13, "Permission denied", place)
        return change(path, *others, **how)
    return changed

os.open, os.kill = open_no_folder, None
for name in ("replace", "rename"):  # which fail there as long as a file is open
    setattr(os, name, unless_open(getattr(os, name)))
import_all()
import symkin
"""

_WRITES = """
from symkin.storage.output_files import OutputFiles, alone

folder = pathlib.Path(sys.argv[1])
for text in ("old", "new"):
    with alone(folder), OutputFiles(overwrite=True) as outputs:
        try:
            with alone(folder):
                raise AssertionError("held twice")
        except symkin.errors.SymkinError as error:
            assert "another run" in str(error)
        stage = outputs.folder(folder)
        for name in sys.argv[2:]:
            (stage / name).write_text(text)
assert not held
"""


def test_files_are_written_where_folders_cannot_be_locked(tmp_path: Path) -> None:
    (tmp_path / ".symkin-1-abandoned").mkdir()
    script = _WITHOUT_LOCKS + _WRITES
    subprocess.run([sys.executable, "-c", script, tmp_path, *NAMES], check=True)
    assert {(tmp_path / name).read_text() for name in NAMES} == {"new"}
    assert _names(tmp_path) == [".symkin-1-abandoned", *NAMES, "lock"]


# Text is written in one encoding, whatever is the system's.
_COMMANDS = """
import warnings
warnings.filterwarnings("error", category=EncodingWarning, module="symkin")
from symkin.cli import main

def done(*words, code=0):
    assert main([*map(str, words)]) == code, words

folder = pathlib.Path(sys.argv[1])
out, later, session = (folder / name for name in ("my out", "later", "session"))
done("run", "3RRR", "--out", out)
for seed in (2, 3):
    done("simulate", "3RRR", "--plan", out / "plan.csv", "--actual", out / "actual.toml",
         "--seed", seed, "--out", later, "--overwrite")
done("identify", "3RRR", later / "measurements.csv", "--out", folder / "again")
done("compare", out, folder / "again")
device = f"symkin simulate-device 3RRR --actual '{out / 'actual.toml'}'"
for accuracy in ("0.3mm", "0.3mm"):  # and goes on
    done("measure", "3RRR", "--accuracy", accuracy, "--out", session, "--device", device)
done("identify", session / "robot.toml", session / "measured.csv", "--out", folder / "guided")
done("accept", folder / "guided", later / "measurements.csv", "--tolerance", "1mm",
     "--out", folder / "certificate")
assert not held
for path in folder.rglob("*"):
    assert not path.name.startswith((".symkin-", "symkin-unfinished-")), path
    assert path.is_dir() or b"\\r" not in path.read_bytes() or path.suffix == ".html", path
"""


def test_commands_do_without_what_posix_alone_has(tmp_path: Path) -> None:
    script = _WITHOUT_LOCKS + _COMMANDS
    told = subprocess.run(
        [sys.executable, "-X", "warn_default_encoding", "-c", script, tmp_path],
        capture_output=True,
        text=True,
    )
    assert told.returncode == 0, told.stderr


def test_texts_are_written_alike_on_every_system() -> None:
    package = Path(symkin.__file__).parent
    for path in package.rglob("*.py"):
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            called = ast.unparse(node.func) if isinstance(node, ast.Call) else ""
            if called.endswith(".write_text") and not called.startswith("formatter."):
                given = {each.arg for each in node.keywords}
                assert given >= {"encoding", "newline"}, f"{path}:{node.lineno}"


def test_writers_at_the_same_time_leave_the_files_of_one(tmp_path: Path) -> None:
    def write(text: str) -> None:
        with OutputFiles(overwrite=True) as outputs:
            folder = outputs.folder(tmp_path, *NAMES)
            for name in NAMES:
                (folder / name).write_text(text)

    for _ in range(10):
        with ThreadPoolExecutor(4) as pool:
            list(pool.map(write, "1234"))
        assert len({(tmp_path / name).read_text() for name in NAMES}) == 1
    assert _names(tmp_path) == list(NAMES)


def test_of_writers_at_the_same_time_without_leave_to_replace_one_wins(tmp_path: Path) -> None:
    outputs = OutputFiles()
    outputs.file(tmp_path / "plan.csv").write_text("slow")
    _write(tmp_path / "plan.csv", "quick")
    with pytest.raises(SymkinError, match="exists"):
        outputs.__exit__(None, None, None)
    assert (tmp_path / "plan.csv").read_text() == "quick"


# Modules are compiled without the limit, or not kept: half of one would break every import to come.
_FULL = """
import pathlib, resource, signal, sys
sys.dont_write_bytecode = True
import symkin
from symkin.storage.output_files import OutputFiles
from symkin.storage.tables import write_table

resource.setrlimit(resource.RLIMIT_FSIZE, (4096, 4096))
path = pathlib.Path(sys.argv[1])
try:
    with OutputFiles(overwrite=True) as outputs:
        outputs.file(path.with_name("small.txt")).write_text("small")
        target = outputs.file(path)
        if path.suffix == ".txt":
            target.write_text("x" * 10000)
        else:
            write_table(target, {"x": [float(i) / 3 for i in range(2000)]})
except symkin.SymkinError as error:
    print(error)
"""


@pytest.mark.parametrize("name", ["plan.csv", "plan.parquet", "page.txt"])
@pytest.mark.parametrize("old", [None, "old"])
def test_a_disk_without_room_leaves_what_was_there(
    tmp_path: Path, name: str, old: str | None
) -> None:
    """Room is short as a limit on the size of a file makes it, by the same kind of error."""
    if old:
        (tmp_path / name).write_text(old)
    before = _names(tmp_path)
    told = subprocess.run(
        [sys.executable, "-c", _FULL, tmp_path / name], text=True, capture_output=True
    )
    assert told.stdout.startswith(f"{tmp_path}: ")
    assert told.stdout.endswith("; no file there was changed\n")
    assert _names(tmp_path) == before
    assert old is None or (tmp_path / name).read_text() == old


def test_a_disk_without_room_is_told_by_the_context_that_has_the_place(tmp_path: Path) -> None:
    def written_beside_others() -> None:
        with OutputFiles() as outputs:
            folder = outputs.folder(tmp_path, *NAMES)
            with OutputFiles() as inner:
                inner.file(folder / NAMES[0])
                raise OSError(28, "No space left on device")

    with pytest.raises(SymkinError) as told:
        written_beside_others()
    assert str(told.value).startswith(f"{tmp_path}: No space left on device")


def test_a_move_that_fails_between_two_files_says_so(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    replace = Path.replace

    def full(self: Path, target: Path) -> Path:
        if target.name == "b.txt":
            raise OSError(28, "No space left on device")
        return replace(self, target)

    monkeypatch.setattr(Path, "replace", full)
    outputs = OutputFiles()
    folder = outputs.folder(tmp_path, *NAMES)
    for name in NAMES:
        (folder / name).write_text("new")
    with pytest.raises(SymkinError, match="while files were moved"):
        outputs.__exit__(None, None, None)
    left = next(tmp_path.glob("symkin-unfinished-*"))
    assert _names(tmp_path) == ["a.txt", left.name]
    assert _names(left) == list(NAMES[1:])


@pytest.fixture(scope="module")
def result(paper: symkin.Mechanism) -> ProtocolResult:
    small = ProtocolSettings(pose_count=10, candidates=300)
    return symkin.run_protocol(paper.replace(protocol=small))


@pytest.mark.usefixtures("unillustrated")
def test_every_writer_of_the_library_asks_before_it_replaces(
    tmp_path: Path, result: ProtocolResult
) -> None:
    nominal, simulation = result.nominal, result.simulation
    identification = result.identification
    checked = check_mechanism(nominal)
    writers: dict[str, Callable[..., object]] = {
        "plan.csv": lambda path, **o: symkin.write_plan(result.plan, path, nominal, **o),
        "measurements.csv": lambda path, **o: symkin.write_measurements(
            simulation.measurements, path, nominal, **o
        ),
        "any.json": lambda path, **o: write_results({"a": 1}, path, **o),
        "calibrated.toml": lambda path, **o: symkin.save_mechanism(nominal, path, **o),
        "simulation/actual.toml": lambda path, **o: simulation.write(path.parent, **o),
        "run/report.html": lambda path, **o: result.write(path.parent, **o),
        "identified/results.json": lambda path, **o: identification.write(path.parent, **o),
        "found.toml": identification.save_calibrated,
        "found.json": identification.save,
        "found.html": identification.report,
        "check/check.json": checked.save,
        "check/check.html": checked.report,
        "run.html": result.report,
        "before.html": result.before.report,
    }
    for name, write in writers.items():
        path = tmp_path / name
        path.parent.mkdir(exist_ok=True)
        path.write_text("mine")
        with pytest.raises(SymkinError, match=f"{path.name}: exists"):
            write(path)
        assert path.read_bytes() == b"mine"
        write(path, overwrite=True)
        assert path.read_bytes() != b"mine"
    assert not [path for path in tmp_path.rglob("*") if "symkin-" in path.name]
