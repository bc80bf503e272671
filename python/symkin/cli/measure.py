# SPDX-License-Identifier: MIT
"""``symkin measure`` and ``simulate-device``: beside whoever measures."""

from __future__ import annotations

import contextlib
import math
import re
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Annotated

import typer

import symkin
from symkin.cli.console import JsonOption, print_json, progress, say
from symkin.cli.options import (
    AccuracyOption,
    AvoidOption,
    CandidatesOption,
    ConfidenceOption,
    Measured,
    MechanismArgument,
    SeedOption,
    Unknown,
    accuracies_of,
    command,
    of,
    option,
    region_of,
    share_of,
)
from symkin.errors import SymkinError
from symkin.guided import Session
from symkin.guided.beginning import SETTINGS
from symkin.guided.device import Device, Failed
from symkin.guided.simulated import SimulatedDevice
from symkin.show.guided import (
    ask_text,
    end_text,
    entry_units,
    progress_text,
    resolved_text,
    verdict_text,
)
from symkin.show.rendering import typed
from symkin.show.units import in_units

_KEYS = "Enter the row; s skip, o occluded, a avoid region, r repeat, u undo, q quit"
_NOT_YET = 1


@command(
    'symkin measure 3RRR --accuracy 0.075mm --out session --device "symkin simulate-device 3RRR"',
    "symkin identify session/robot.toml session/measured.csv --out calibrated",
)
def measure(
    *,
    mechanism: MechanismArgument,
    out: Annotated[
        Path,
        option(
            "DIR",
            "Folder of the session: measured.csv, robot.toml and session.json. A session that is "
            "there goes on.",
        ),
    ],
    accuracy: AccuracyOption = None,
    confidence: ConfidenceOption = "0.95",
    device: Annotated[
        str | None,
        option(
            "COMMAND",
            "A program that moves and measures, asked in lines of JSON; without, rows are typed, "
            "pasted or piped.",
        ),
    ] = None,
    by: Measured,
    observe: Annotated[list[str] | None, of("observe")] = None,
    unknown: Unknown,
    candidates: CandidatesOption = None,
    margin_sigmas: Annotated[float, of("margin_sigmas")] = 3.0,
    avoid: AvoidOption = None,
    seed: SeedOption = None,
    units: Annotated[str, of("units")] = "",
    as_json: JsonOption = False,
) -> None:
    """Measure a robot, pose by pose, until an accuracy is reached.

    The pose that helps most is asked for, with the readings that command it. What was measured is
    entered in a line, in the order and the units of the prompt; readings that are not entered are
    those commanded. Every line goes to measured.csv in the folder at once: a session that was ended
    goes on, with the same pose, and other programs may append rows too. After every row the
    drawing's tolerances are tested, that row and those before it, and whether something has
    slipped; measuring a doubtful pose again decides. It is enough when such robots keep the
    accuracy with the wanted confidence; `symkin identify` with robot.toml and measured.csv says the
    same.

    With --device a program measures. It reads a line of JSON from standard input and answers with
    one; `symkin simulate-device` is one that plays a robot.

    Exit code: 0 if the accuracy is reached; 1 if not, or not yet.
    """
    wanted = accuracies_of(accuracy)
    share = share_of(confidence, "confidence")
    with in_units(units):
        with progress() as stage:
            stage("reading the mechanism")
            loaded = by.on(symkin.load_mechanism(mechanism), estimates=True)
            stage("choosing poses")
            session = symkin.measure(
                loaded,
                wanted[0],
                out,
                orientation=wanted[1],
                confidence=share,
                noise=by.estimated,
                candidates=candidates,
                seed=seed,
                avoid=[region_of(text) for text in avoid or ()],
                margin_sigmas=margin_sigmas,
                observe=observe,  # type: ignore[arg-type]  # which it checks
                **unknown.arguments(),
            )
        tell = _Silent() if as_json else _Screen()
        with _alone(out):
            if session.torn:
                tell(
                    f"The last line of the table was not complete, and is set aside: {session.torn}"
                )
            if device is not None:
                _by_device(session, device, tell)
            else:
                _by_hand(session, tell)
        found = session.progress
        if as_json:
            print_json({"command": "measure", **found.to_dict()})
        else:
            say(typed(f"\n{end_text(session, found)}"))
    if not found.reached:
        raise typer.Exit(_NOT_YET)


class _Screen:
    """Where a session is told."""

    def __call__(self, text: str) -> None:
        say(typed(text))
        sys.stdout.flush()


class _Silent(_Screen):
    def __call__(self, text: str) -> None:
        pass


def _by_device(session: Session, command_line: str, tell: _Screen) -> None:
    with Device(command_line, session) as device:
        for ask in session:
            tell(f"\n{ask_text(session, ask)}")
            found = device.measure(ask)
            if isinstance(found, Failed):
                session.fail(found.why, remark=found.remark)
                tell(f"last {ask.row}   {found.why}")
                if session.suggests_avoiding:
                    session.avoid()
                    tell("The second failure there: the region is left out from now on.")
                continue
            session.add(found.row, device=device.name, remark=found.remark)
            tell(progress_text(session, session.progress))
            verdict = session.resolve()
            if verdict is not None:
                tell(verdict_text(verdict))
                if not verdict.fine:
                    tell(resolved_text(verdict))


def _by_hand(session: Session, tell: _Screen) -> None:
    entries = entry_units(session.columns)
    tell(_KEYS)
    for ask in session:
        tell(f"\n{progress_text(session, session.progress)}\n{ask_text(session, ask)}")
        while True:
            tell(
                " ".join(name.replace(" ", "[") + "]" * (" " in name) for name, *_ in entries)
                + " >"
            )
            line = sys.stdin.readline()
            if not line or line.strip().lower() == "q":
                return
            try:
                done = _obeyed(session, line.strip(), entries, tell)
            except SymkinError as error:
                tell(f"!  {error}")
                continue
            if done or session.refresh():
                break


def _obeyed(
    session: Session, line: str, entries: list[tuple[str, float, str]], tell: _Screen
) -> bool:
    """Do what a line says; whether there is a new pose to ask for."""
    key = line.lower()
    if key == "s":
        session.skip()
    elif key == "o":
        session.fail("occluded")
        if session.suggests_avoiding:
            tell("The second failure there: a leaves the region out.")
    elif key == "a":
        session.avoid()
    elif key in ("r", "t", "d", "k"):
        _decide(session, key)
    elif key == "u":
        tell(f"Row {session.undo()} is taken back.")
    elif line:
        session.add(_row(line, entries))
        verdict = session.verdict
        if verdict is not None:
            tell(verdict_text(verdict))
    return bool(line) or session.refresh()


def _decide(session: Session, key: str) -> None:
    """Do what is wanted about a doubtful row or a slip; without one, repeat or drop the last."""
    verdict = session.verdict
    if verdict is None:
        raise SymkinError("there is no row yet")
    number, slipped = verdict.doubtful, verdict.slipped
    if key == "r":
        session.repeat(number)
    elif key == "t" and slipped is not None:
        session.slip(slipped)
    elif key == "t" and number is not None and verdict.likely:
        session.correct(number, verdict.edited, verdict.likely)
    elif key == "d" and number is not None:
        session.drop(number)
    elif key == "k" and number is not None:
        session.keep(number)
        if verdict.decided == "robot":
            session.keep(verdict.row)
    elif key == "k" and slipped is not None:
        session.keep(slipped)
    else:
        raise SymkinError(f"nothing is doubtful that {key} could decide")


def _row(line: str, entries: list[tuple[str, float, str]]) -> dict[str, float]:
    """A row that was typed or pasted: all columns, or those before the readings."""
    parts = re.split(r"[\s;]+", line) if re.search(r"[\s;]", line) else line.split(",")
    parts = [part.rstrip(",").replace(",", ".") for part in parts if part.strip(",")]
    measured = [each for each in entries if not each[2].startswith("psi_")]
    given = entries if len(parts) == len(entries) else measured
    if len(parts) != len(given):
        names = ", ".join(name for name, *_ in entries)
        counts = f"{len(measured)} or " if measured else ""
        raise SymkinError(
            f"{len(parts)} values were entered; expected {counts}{len(entries)}: {names}"
        )
    row = {}
    for part, (name, factor, column) in zip(parts, given, strict=True):
        try:
            row[column] = math.nan if part in ("-", "?") else factor * float(part)
        except ValueError:
            raise SymkinError(
                f'"{part}" is no number ({name}); expected one, or - for none'
            ) from None
    return row


@contextlib.contextmanager
def _alone(folder: Path) -> Iterator[None]:
    """Be the only one that asks in a folder."""
    try:
        import fcntl
    except ImportError:  # where nothing locks so
        yield
        return
    with (folder / SETTINGS).open("rb") as file:
        try:
            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError as error:
            raise SymkinError(
                f"{folder}: another symkin measures there; end it first, or append rows to its "
                "measured.csv"
            ) from error
        yield


@command('symkin measure 5bar --accuracy 0.1mm --out out --device "symkin simulate-device 5bar"')
def simulate_device(
    *,
    mechanism: MechanismArgument,
    actual: Annotated[
        Path | None,
        option("FILE", "The robot as made; by default one within the tolerances."),
    ] = None,
    observe: Annotated[list[str] | None, of("observe")] = None,
    lost: Annotated[
        float, option("SHARE", "Of the poses, whose target it loses.", min=0, max=1)
    ] = 0.0,
    seed: SeedOption = None,
) -> None:
    """Play a robot and a measuring device, for `symkin measure --device`.

    It reads requests, a line of JSON each, from standard input, and answers with what a robot made
    within the tolerances would do and the device see, until there are no more.
    """
    loaded = symkin.load_mechanism(mechanism)
    device = SimulatedDevice(
        loaded,
        loaded.protocol.seed if seed is None else seed,
        actual,
        observe=tuple(observe or ("pose",)),  # type: ignore[arg-type]  # which it checks
        lost=lost,
    )

    def answer(line: str) -> None:
        sys.stdout.write(f"{line}\n")
        sys.stdout.flush()

    device.serve(sys.stdin, answer)
