# SPDX-License-Identifier: MIT
"""Who looks on while a cause is searched, and may end that without losing the estimate."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import AbstractContextManager
from contextvars import ContextVar

from symkin.values import set_to

_TOLD: ContextVar[Callable[[], None] | None] = ContextVar("told", default=None)


def watched_search(tell: Callable[[int], None]) -> AbstractContextManager[None]:
    """Show the search for what is wrong with measurements, which Ctrl-C then ends by itself.

    What speaks against an estimate is said without a cause then, and that the search was ended. Of
    a search that nobody watches, as in a script, Ctrl-C ends the script.

    Parameters
    ----------
    tell : callable
        Called with how many fits have been tried, before each.
    """
    count = 0

    def told() -> None:
        nonlocal count
        count += 1
        tell(count)

    return set_to(_TOLD, told)


def unwatched_search() -> AbstractContextManager[None]:
    """Have Ctrl-C end everything again."""
    return set_to(_TOLD, None)


def looked() -> None:
    """Tell whoever watches that a correction is tried."""
    if (tell := _TOLD.get()) is not None:
        tell()


def is_watched() -> bool:
    """Whether Ctrl-C ends the search alone."""
    return _TOLD.get() is not None
