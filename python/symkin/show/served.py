# SPDX-License-Identifier: MIT
"""A guided session as a page for the phone at the robot: the same session, the same words."""

from __future__ import annotations

import hmac
import ipaddress
import json
import socket
import threading
from collections.abc import Callable, Mapping
from contextlib import suppress
from contextvars import copy_context
from importlib.util import find_spec
from typing import TYPE_CHECKING, Any

from symkin.errors import SymkinError
from symkin.guided import Ask, Session, Verdict
from symkin.show.entering import decisions, entered, entries_of, obeyed, touching
from symkin.show.guided import end_text, pose_cells, progress_text, reading_cells, verdict_text
from symkin.show.rendering import rendered
from symkin.show.sketch import sketch

if TYPE_CHECKING:  # an extra
    from starlette.applications import Starlette
    from starlette.requests import Request
    from starlette.responses import Response

_LOOPBACK = ["127.0.0.1", "localhost", "[::1]"]
_MOST_BYTES = 100_000  # of what is told at once
_BROKEN_THERE = 10_000  # characters of a line: pages break them
_KEYS = frozenset("soartdku")


def session_state(session: Session, told: str = "") -> dict[str, Any]:
    """Return what the page shows of a session; `told` is what the last entry has come to."""
    ask, problem = _asked(session)
    found, verdict = session.progress, session.verdict
    ended = found.reached or found.never
    whole = found.rows + (0 if found.reached else found.more)
    return {
        "robot": session.robot.name,
        "tries": session.tries,
        "ask": None if ask is None else _told(session, ask),
        "entries": [
            {"name": each.name, "unit": each.unit, "column": each.column, "read": each.is_reading}
            for each in (*entries_of(session.asked_columns), *touching(session))
        ],
        "progress": " ".join(progress_text(session, found).partition("\n[")[0].split()),
        "share": found.rows / max(whole, 1),
        "last": told or _last(verdict),
        "decisions": decisions(verdict),
        "problem": problem,
        "end": end_text(session, found, _BROKEN_THERE) if ended or problem else "",
    }


def session_app(session: Session, *, token: str = "") -> Starlette:
    """Return the page of a session as an application, for any server that takes ASGI ones.

    Parameters
    ----------
    session : Session
        Of which nothing else asks meanwhile; its table may grow.
    token : str
        What the page's address must have as ``?token=...``; without one, only those are answered
        who call this machine by its own name.

    Raises
    ------
    SymkinError
        If Starlette is not installed.
    """
    _require("starlette")
    from starlette.applications import Starlette
    from starlette.middleware import Middleware
    from starlette.middleware.trustedhost import TrustedHostMiddleware
    from starlette.routing import Route

    page, told, alone = _Page(session), copy_context(), threading.Lock()

    def answered(answer: Callable[[Any], Response]) -> Callable[[Request], Any]:
        async def called(request: Request) -> Response:
            from starlette.concurrency import run_in_threadpool
            from starlette.responses import JSONResponse

            if not _knows(request, token):
                return JSONResponse({"error": "the address lacks the token"}, 403)
            body = await _body(request)
            if body is None:
                return JSONResponse({"error": "expected a JSON object"}, 400)

            def one_by_one() -> Response:
                with alone:  # in the units of who began it
                    return told.copy().run(answer, body)

            return await run_in_threadpool(one_by_one)

        return called

    routes = [
        Route("/", answered(page.shown)),
        Route("/state", answered(page.state)),
        Route("/tell", answered(page.tell), methods=["POST"]),
    ]
    # Otherwise a page of another site could come by a name that leads here.
    own = [] if token else [Middleware(TrustedHostMiddleware, allowed_hosts=_LOOPBACK)]
    return Starlette(routes=routes, middleware=own)


def serve(
    session: Session,
    *,
    host: str = "127.0.0.1",
    port: int = 8000,
    token: str = "",
    ready: Callable[[str], None] = print,
) -> None:
    """Serve the page of a session until Ctrl-C.

    Parameters
    ----------
    session : Session
    host : str
        Address of this machine that is listened at; by default who is at this machine alone.
    port : int
        0 takes one that is free.
    token : str
        See `session_app`; needed for other hosts than this machine alone.
    ready : callable
        Is told the page's address.

    Raises
    ------
    SymkinError
        For a host without a token, an address that cannot be listened at, and if Starlette or
        uvicorn are not installed.
    """
    _require("uvicorn")
    import uvicorn

    if not (token or on_loopback(host)):
        raise SymkinError(
            f'host "{host}" lets others in the network enter rows; expected a token with it'
        )
    app = session_app(session, token=token)
    try:
        listening = socket.create_server((host, port), family=_family(host))
    except (OSError, OverflowError) as error:
        raise SymkinError(f"{host}, port {port}: cannot be listened at: {error}") from error
    with listening:
        named = f"[{host}]" if ":" in host else host
        asked = f"?token={token}" if token else ""
        ready(f"http://{named}:{listening.getsockname()[1]}/{asked}")
        server = uvicorn.Server(uvicorn.Config(app, log_level="warning", access_log=False))
        with suppress(KeyboardInterrupt):
            server.run(sockets=[listening])


def on_loopback(host: str) -> bool:
    """Whether an address is that of this machine alone."""
    try:
        return ipaddress.ip_address(host).is_loopback
    except ValueError:
        return host == "localhost"


class _Page:
    """What is answered; one question at a time."""

    def __init__(self, session: Session) -> None:
        from starlette.responses import HTMLResponse, JSONResponse

        self._session, self._html, self._json = session, HTMLResponse, JSONResponse
        self._said = (session.tries, "")  # of the state that it was said of
        self._did: Mapping[str, Any] = {}  # last

    def shown(self, _: Mapping[str, Any]) -> Response:
        text = rendered("session.html", robot=self._session.robot.name)
        headers = {"Referrer-Policy": "no-referrer", "Cache-Control": "no-store"}
        return self._html(text, headers=headers)

    def state(self, _: Mapping[str, Any]) -> Response:
        tries, said = self._said
        return self._json(
            session_state(self._session, said if tries == self._session.tries else "")
        )

    def tell(self, body: Mapping[str, Any]) -> Response:
        """Do what was entered, once: what was entered of an older state was done, or is too late.

        A phone that did not hear the answer asks again.
        """
        session = self._session
        try:
            session.refresh()
        except SymkinError as spoilt:  # the table, by another program
            return self._json({"error": str(spoilt)}, 422)
        if self._did and body == self._did:
            return self.state({})
        if body.get("tries") != session.tries:
            error = "This pose has been told of already: nothing was entered now."
            return self._json({"error": error, **session_state(session)}, 409)
        try:
            said = self._done(body)
        except SymkinError as error:
            return self._json({"error": str(error)}, 422)
        self._said, self._did = (session.tries, said), body
        return self._json(session_state(session, said))

    def _done(self, body: Mapping[str, Any]) -> str:
        key, row = body.get("key"), body.get("row")
        if isinstance(row, dict) and all(isinstance(each, str) for each in row.values()):
            entered(self._session, row)
            return ""
        if isinstance(key, str) and key in _KEYS:
            return obeyed(self._session, key)
        raise SymkinError("what was sent is neither a row nor a key")


def _last(verdict: Verdict | None) -> str:
    if verdict is None:
        return ""
    return verdict_text(verdict, _BROKEN_THERE) or f"row {verdict.row} is saved"


def _asked(session: Session) -> tuple[Ask | None, str]:
    try:
        return session.next(), ""
    except SymkinError as error:  # no pose is left, or the table was spoilt
        return None, str(error)


def _told(session: Session, ask: Ask) -> dict[str, Any]:
    return {
        "row": ask.row,
        "again": ask.repeat_of,
        "ahead": len(ask.ahead),
        "pose": pose_cells(session, ask.pose),
        "readings": reading_cells(session, ask.readings),
        "drawing": sketch(session.robot, ask.pose),
    }


def _knows(request: Request, token: str) -> bool:
    given = request.headers.get("x-token") or request.query_params.get("token", "")
    return hmac.compare_digest(given.encode(), token.encode()) if token else True


async def _body(request: Request) -> dict[str, Any] | None:
    """What was sent, an object; None for what no page of ours sends."""
    if request.method != "POST":
        return {}
    # Forms of other sites cannot send this type without asking.
    if request.headers.get("content-type", "").partition(";")[0] != "application/json":
        return None
    text = b""
    async for part in request.stream():
        text += part
        if len(text) > _MOST_BYTES:
            return None
    try:
        found = json.loads(text)
    except (ValueError, RecursionError):
        return None
    return found if isinstance(found, dict) else None


def _family(host: str) -> socket.AddressFamily:
    return socket.AF_INET6 if ":" in host else socket.AF_INET


def _require(module: str) -> None:
    if find_spec(module) is None:
        raise SymkinError(f'the page of a session needs {module}: pip install "symkin[serve]"')
