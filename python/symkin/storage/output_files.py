# SPDX-License-Identifier: MIT
"""Output files that appear whole or not at all, and replace others only if they may."""

from __future__ import annotations

import errno
import os
import re
import shutil
from collections.abc import Iterable, Iterator
from contextlib import ExitStack, contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path
from secrets import token_hex
from types import TracebackType

from symkin.errors import SymkinError

_HAS_LOCKS = True
try:
    import fcntl
except ImportError:  # Windows, where files can be locked, and folders cannot
    import msvcrt

    _HAS_LOCKS = False
    _FAR = 2**30  # behind the end of any such file: what is locked there cannot be read

# The process that writes is named for whoever finds its files after it was killed.
_STAGE = ".symkin-"
_UNFINISHED = "symkin-unfinished-"
_FILES = (".toml", ".csv", ".json", ".html", ".parquet", ".cfg", ".xml", ".txt", ".log")
_DISK_FAILS = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG, errno.EIO)

# Those of this process. What is written in one is moved as a whole, whoever writes it.
_open_stages: set[Path] = set()


@dataclass
class _Stage:
    """Where files are written that shall be in `folder`; locked as long as its process lives."""

    path: Path
    folder: Path
    lock: ExitStack

    def announce(self) -> None:
        """Show it to the user, as long as some of its files are moved and others are not."""
        _open_stages.discard(self.path)
        name = _UNFINISHED + self.path.name.removeprefix(_STAGE)
        self.path = self.path.rename(self.path.with_name(name))

    @property
    def moves(self) -> list[tuple[Path, Path]]:
        """What was written, and where it goes."""
        files = (file for file in sorted(self.path.rglob("*")) if file.is_file())
        return [(file, self.folder / file.relative_to(self.path)) for file in files]


class OutputFiles:
    """A context in which outputs are written, to places that are moved at its end.

    Every target is checked when it is named, so before anything is computed: it may be named once
    only, must lie where files can be written, may not be one of the `inputs`, and may not exist
    unless `overwrite` says so. Until the end nothing is changed; then each file is replaced as a
    whole, or removed if it was not written again. A process that is killed between two of several
    files leaves a folder ``symkin-unfinished-...`` with the others beside them.

    Parameters
    ----------
    inputs : iterable of path or None
        Files that are never replaced.
    overwrite : bool
        Whether other files may be.
    """

    def __init__(self, inputs: Iterable[Path | None] = (), overwrite: bool = False) -> None:
        self._inputs = [path for path in inputs if path is not None]
        self._overwrite = overwrite
        self._targets: set[Path] = set()
        self._owned: set[Path] = set()
        self._folders: set[Path] = set()
        self._stages: list[_Stage] = []
        self._made: list[Path] = []
        self._torn = False

    def file(self, path: Path) -> Path:
        """Return where to write a file that shall be at `path`."""
        if path.parent in _open_stages:
            return path
        # A link stays one, and what it points to is the file.
        target = Path(os.path.realpath(path)) if path.is_symlink() else path
        self._claim(target.parent, target.name)
        if path.is_dir():
            raise SymkinError(f"{path}: is a folder; expected a file")
        self._require_free(target)
        return self._stage(target.parent).path / target.name

    def folder(self, path: Path, *names: str) -> Path:
        """Return an empty folder in which to write what shall be in the folder `path`.

        Files with `names` may be written, others should not be. Of those that are not, none of an
        earlier run stays beside the others.
        """
        if path in _open_stages:
            return path
        if path.suffix.lower() in _FILES and not path.exists():
            raise SymkinError(
                f"{path}: is to be a folder, for several files; choose a name without "
                f'"{path.suffix}"'
            )
        self._claim(path, *names)
        if path.exists() and not path.is_dir():
            raise SymkinError(f"{path}: is not a folder; choose another place")
        for name in names:
            self._require_free(path / name)
        self._owned.update(path / name for name in names)
        return self._stage(path).path

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
        done = False
        try:
            if kind is None:
                self._move()
                done = True
        except OSError as failure:
            error = failure
        finally:
            self._close(undo=not done)
        told = kind is None or (isinstance(error, OSError) and error.errno in _DISK_FAILS)
        # What was written for the context around this one is for that to tell.
        if isinstance(error, OSError) and told and self._folders:
            raise SymkinError(self._failure(error)) from error

    def _claim(self, folder: Path, *names: str) -> None:
        """Refuse two outputs in one place, before any of them is made."""
        real = Path(os.path.realpath(folder))
        self._folders.add(real)
        for name in names:
            if real / name in self._targets:
                raise SymkinError(f"{folder / name}: is to hold two outputs; expected two files")
            self._targets.add(real / name)
        for target in self._targets:
            if any(target == place or target in place.parents for place in self._folders):
                raise SymkinError(
                    f"{target}: is to be a file and a folder with files; choose another place for "
                    "one of them"
                )

    def _require_free(self, target: Path) -> None:
        if not os.path.lexists(target):
            return
        if any(
            path.exists() and target.exists() and path.samefile(target) for path in self._inputs
        ):
            raise SymkinError(
                f"{target}: is an input of this command; choose another place for its output"
            )
        if not target.is_file():
            raise SymkinError(f"{target}: is not a regular file; choose another place")
        if not self._overwrite:
            raise SymkinError(
                f"{target}: exists; choose another place, or allow files to be replaced "
                f"(--overwrite, in Python overwrite=True){_left_unfinished(target.parent)}"
            )
        if not os.access(target, os.W_OK):
            raise SymkinError(f"{target}: is write-protected; choose another place")

    def _stage(self, folder: Path) -> _Stage:
        try:
            missing = [path for path in (folder, *folder.parents) if not path.exists()]
            self._made = missing + self._made
            folder.mkdir(parents=True, exist_ok=True)
            _sweep(folder)
            path = folder / f"{_STAGE}{os.getpid()}-{token_hex(4)}"
            path.mkdir()  # mkdtemp's files are their owner's alone on Windows, wherever they go
            stage = _Stage(path, folder, ExitStack())
            stage.lock.enter_context(_locked([path], wait=False))
        except OSError as error:
            self._close(undo=True)
            raise SymkinError(f"{folder}: cannot be written to: {error.strerror}") from error
        self._stages.append(stage)
        _open_stages.add(path)
        return stage

    def _move(self) -> None:
        moves = [move for stage in self._stages for move in stage.moves]
        self._require_distinct([target for _, target in moves])
        for staged, _ in moves:
            _flush(staged)
        with _locked(sorted(self._folders)):
            written = {target for _, target in moves}
            stale = {target for target in self._owned - written if os.path.lexists(target)}
            changed = written | stale
            for target in sorted(changed):
                self._require_free(target)
            if len(changed) > 1:
                self._torn = True
                for stage in self._stages:
                    stage.announce()
                moves = [move for stage in self._stages for move in stage.moves]
            for target in sorted(stale):
                target.unlink()
            for staged, target in moves:
                target.parent.mkdir(parents=True, exist_ok=True)
                staged.replace(target)
            self._torn = False
            for folder in {target.parent for target in changed}:
                _flush(folder)
                _sweep_unfinished(folder, written | self._owned)

    def _require_distinct(self, targets: list[Path]) -> None:
        real = [os.path.realpath(target) for target in targets]
        for target, place in zip(targets, real, strict=True):
            if real.count(place) > 1:
                raise SymkinError(f"{target}: is to hold two outputs; expected two files")

    def _close(self, *, undo: bool) -> None:
        for stage in self._stages:
            if not self._torn:
                shutil.rmtree(stage.path, ignore_errors=True)
            stage.lock.close()
        _open_stages.difference_update(stage.path for stage in self._stages)
        self._stages.clear()
        for folder in self._made if undo else ():
            with suppress(OSError):
                folder.rmdir()
        self._made.clear()

    def _failure(self, error: OSError) -> str:
        where = ", ".join(str(folder) for folder in sorted(self._folders))
        if self._torn:
            return (
                f"{where}: {error.strerror} while files were moved there; those in "
                f"{_UNFINISHED}... were not"
            )
        return f"{where}: {error.strerror}; no file there was changed"


def _left_unfinished(folder: Path) -> str:
    """What to know of the files in a folder, after a sentence."""
    for path in folder.glob(f"{_UNFINISHED}*"):
        if _is_abandoned(path):
            return (
                "; a command was killed while it moved its files there, and what it did not move "
                f"is in {path.name}: files may be of two runs"
            )
    return ""


def _sweep(folder: Path) -> None:
    """Remove what killed processes were writing."""
    for path in folder.glob(f"{_STAGE}*"):
        if _is_abandoned(path):
            shutil.rmtree(path, ignore_errors=True)


def _sweep_unfinished(folder: Path, written: set[Path]) -> None:
    """Remove what killed processes did not move, if all of it has been written since."""
    for path in folder.glob(f"{_UNFINISHED}*"):
        left = {folder / file.relative_to(path) for file in path.rglob("*") if file.is_file()}
        if left <= written and _is_abandoned(path):
            shutil.rmtree(path, ignore_errors=True)


def _is_abandoned(stage: Path) -> bool:
    """Whether the process of a stage is no more.

    Its number may be that of another process by now, or of one in another container; the lock tells
    the second. Without locks nobody knows.
    """
    if not _HAS_LOCKS:
        return False
    number = re.match(rf"(?:{re.escape(_STAGE)}|{_UNFINISHED})(\d+)-", stage.name)
    if number is None or not stage.is_dir():
        return False
    try:
        os.kill(int(number[1]), 0)
    except ProcessLookupError:
        pass
    except (OSError, OverflowError):
        return False
    else:
        return False
    try:
        with _locked([stage], wait=False):
            return True
    except OSError:
        return False


@contextmanager
def _locked(folders: Iterable[Path], *, wait: bool = True) -> Iterator[None]:
    """Keep other processes that lock these folders out; in order, so that nobody waits for ever."""
    with ExitStack() as opened:
        for folder in folders if _HAS_LOCKS else ():
            descriptor = os.open(folder, os.O_RDONLY)
            opened.callback(os.close, descriptor)
            _lock(descriptor, wait=wait)
        yield


@contextmanager
def alone(folder: Path) -> Iterator[None]:
    """Let one run at a time work in a folder, which is made; for as long as its process lives.

    Raises
    ------
    SymkinError
        If another one does, or nothing can be written there.
    """
    busy = f"{folder}: another run is at work there; wait for its end, or choose another folder"
    with cannot_be_written(folder):
        folder.mkdir(parents=True, exist_ok=True)
    with only_one(folder / "lock", busy):
        yield


@contextmanager
def only_one(path: Path, busy: str) -> Iterator[None]:
    """Let one process at a time hold a file, which is made, for as long as it lives.

    Raises
    ------
    SymkinError
        With the words of `busy` if another one does, or if it cannot be written.
    """
    with cannot_be_written(path.parent):
        descriptor = os.open(path, os.O_RDWR | os.O_CREAT, 0o666)
    try:
        try:
            if _HAS_LOCKS:
                _lock(descriptor, wait=False)
            else:
                _lock_far("LK_NBLCK", descriptor)
        except BlockingIOError:
            raise SymkinError(busy) from None
        try:
            yield
        finally:
            if not _HAS_LOCKS:
                _lock_far("LK_UNLCK", descriptor)
    finally:
        os.close(descriptor)


@contextmanager
def cannot_be_written(folder: Path) -> Iterator[None]:
    """Say so of a folder in which something fails."""
    try:
        yield
    except OSError as error:
        raise SymkinError(f"{folder}: cannot be written to: {error.strerror}") from error


def _lock_far(how: str, descriptor: int) -> None:
    """Lock a byte of an open file, or let it go, as Windows does."""
    windows = vars(msvcrt)  # which has these nowhere else
    os.lseek(descriptor, _FAR, os.SEEK_SET)
    try:
        windows["locking"](descriptor, windows[how], 1)
    except PermissionError:
        raise BlockingIOError from None


def _lock(descriptor: int, *, wait: bool) -> None:
    """Lock an open file or folder, where there are locks."""
    if not _HAS_LOCKS:
        return
    try:
        fcntl.flock(descriptor, fcntl.LOCK_EX if wait else fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        raise
    except OSError:  # a file system without locks
        pass


def _flush(path: Path) -> None:
    """Have a file or a folder on the disk before anything relies on it."""
    if not _HAS_LOCKS and path.is_dir():
        return
    descriptor = os.open(path, os.O_RDONLY if _HAS_LOCKS else os.O_RDWR)  # as Windows wants it
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)
