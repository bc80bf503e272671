# SPDX-License-Identifier: MIT
"""``symkin measure`` and ``simulate-device``: beside whoever measures."""

from __future__ import annotations

import contextlib
import math
import os
import secrets
import sys
import textwrap
from pathlib import Path
from typing import Annotated

import typer

import symkin
from symkin.cli.console import JsonOption, print_json, progress, say
from symkin.cli.options import (
    AccuracyOption,
    AvoidOption,
    Measured,
    MechanismArgument,
    Unknown,
    accuracies_of,
    command,
    option,
    refuse_unless,
    region_of,
    share_of,
)
from symkin.errors import SymkinError
from symkin.guided import Session
from symkin.guided.device import Device, Failed
from symkin.guided.simulated import SimulatedDevice
from symkin.options import Coordinates
from symkin.show.entering import KEYS, QUIT, TOUCHING, entries_of, obeyed, quits, touches
from symkin.show.guided import (
    GOES_ON,
    WIDTH,
    ask_text,
    begun_text,
    end_text,
    progress_text,
    resolved_text,
    verdict_text,
)
from symkin.show.rendering import typed
from symkin.show.served import on_loopback
from symkin.show.served import serve as serve_page
from symkin.show.units import in_units

_NOT_YET = 1
_HOST, _PORT = "127.0.0.1", 8000
_TOKEN = "page.token"
_HELP = ("?", "h", "help")
_STRANGE, _PATIENCE = 20.0, 6  # sigma, and rows in turn that are off by so much with a device


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
    of: Coordinates | None = None,
    confidence: str = "0.95",
    device: Annotated[
        str | None,
        option(
            "COMMAND",
            "A program that moves and measures, asked in lines of JSON; without, rows are typed, "
            "pasted or piped.",
        ),
    ] = None,
    serve: Annotated[
        bool,
        typer.Option(
            "--serve", help="Enter rows on a page in the browser, such as a phone's at the robot."
        ),
    ] = False,
    host: Annotated[
        str,
        option(
            "ADDRESS",
            "Of this machine, where others in the network may open that page, with the token that "
            "is printed; by default this machine alone.",
        ),
    ] = _HOST,
    port: Annotated[
        int, option("PORT", "Of that page; 0: one that is free.", min=0, max=65535)
    ] = _PORT,
    by: Measured,
    observe: list[str] | None = None,
    unknown: Unknown,
    candidates: int | None = None,
    margin_sigmas: float = 3.0,
    avoid: AvoidOption = None,
    seed: int | None = None,
    units: str = "",
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

    With --serve it is a page in the browser that asks and takes the rows, for a phone at the robot;
    Ctrl-C ends it, and the same command goes on. It needs the extra "serve": pip install
    "symkin[serve]".

    With --device a program measures. It reads a line of JSON from standard input and answers with
    one; `symkin simulate-device` is one that plays a robot.

    Exit code: 0 if the accuracy is reached; 1 if not, or not yet.
    """
    refuse_unless(not (serve and device), "--serve goes without --device, which asks nobody")
    refuse_unless(serve or (host, port) == (_HOST, _PORT), "--host and --port go with --serve")
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
                of=of,
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
        for line in begun_text(session):
            tell(line)
        if device is not None:
            _by_device(session, device, tell)
        elif serve:
            _by_page(session, host, port, out)
        else:
            try:
                _by_hand(session, tell)
            except KeyboardInterrupt:
                tell(f"\n{GOES_ON}")
                raise
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
        strange = 0
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
            failure = session.progress.failure
            off = math.nan if verdict is None else verdict.deviations
            strange = strange + 1 if failure or off > _STRANGE else 0
            if strange == _PATIENCE:
                raise SymkinError(
                    f"the last {_PATIENCE} rows fit no robot like the drawing; compare the units "
                    "of the device, its frame and the order of the legs with it"
                )


def _by_page(session: Session, host: str, port: int, folder: Path) -> None:
    """Serve the page; its address goes to stderr, whatever is printed of the session."""

    def ready(address: str) -> None:
        sys.stderr.write(f"{address}\nOpen this page to measure; Ctrl-C ends it.\n")
        sys.stderr.flush()

    token = "" if on_loopback(host) else _token(folder / _TOKEN)
    serve_page(session, host=host, port=port, token=token, ready=ready)


def _token(path: Path) -> str:
    """The session's token, the same when it goes on, so that an open page does; its owner's."""
    with contextlib.suppress(FileNotFoundError):
        kept = path.read_text(encoding="ascii", errors="replace").strip()
        if kept:
            return kept
    token = secrets.token_urlsafe(16)
    descriptor = os.open(path, os.O_WRONLY | os.O_CREAT | os.O_TRUNC, 0o600)
    with open(descriptor, "w", encoding="ascii") as file:  # noqa: PTH123
        file.write(token)
    return token


def _keys() -> str:
    keys = ", ".join(f"{key} {what}" for key, what in KEYS.items())
    return f"Enter the row; {keys}, {QUIT} quit"


def _by_hand(session: Session, tell: _Screen) -> None:
    tell(_keys())
    if touches(session):
        tell("\n".join(textwrap.wrap(TOUCHING, WIDTH)))
    for ask in session:
        tell(f"\n{progress_text(session, session.progress)}\n{ask_text(session, ask)}")
        entries = entries_of(session.asked_columns)
        # Of the first of two rows between which something is measured.
        commanded = session.asked_columns != session.columns
        shown = [entry.told for entry in entries] + ["(Enter: as commanded)"] * commanded
        prompt = f"{' '.join(shown)} >"
        done = False
        while not done:
            tell(prompt)
            line = sys.stdin.readline()
            if not line or quits(line):
                return
            if line.strip().lower() in _HELP:
                tell(_keys())
                continue
            try:
                told = obeyed(session, line) if line.strip() else ""
                if commanded and not line.strip() and not session.refresh():
                    session.add({})
                    break
            except SymkinError as error:
                tell(f"!  {error}")
                continue
            if told:
                tell(told)
            done = bool(line.strip()) or session.refresh()


@command('symkin measure 5bar --accuracy 0.1mm --out out --device "symkin simulate-device 5bar"')
def simulate_device(
    *,
    mechanism: MechanismArgument,
    actual: Annotated[
        Path | None,
        option("FILE", "The robot as made; by default one within the tolerances."),
    ] = None,
    observe: list[str] | None = None,
    lost: Annotated[
        float, option("SHARE", "Of the poses, whose target it loses.", min=0, max=1)
    ] = 0.0,
    seed: int | None = None,
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
