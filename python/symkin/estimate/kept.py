# SPDX-License-Identifier: MIT
"""What is computed of an estimate when it is first asked for, and then kept."""

from __future__ import annotations

import functools
from collections.abc import Callable
from typing import Any, Concatenate, ParamSpec, TypeVar

_Owner = TypeVar("_Owner")
_Asked = ParamSpec("_Asked")
_Result = TypeVar("_Result")


def once(
    function: Callable[Concatenate[_Owner, _Asked], _Result],
) -> Callable[Concatenate[_Owner, _Asked], _Result]:
    """Compute what follows from an estimate once, for its copies and for `replace` too."""
    name = function.__name__

    @functools.wraps(function)
    def kept(found: _Owner, /, *asked: _Asked.args, **how: _Asked.kwargs) -> _Result:
        keeps: Kept | None = getattr(found, "kept", None)
        if keeps is None:  # the bare fields, as a fleet has them
            return function(found, *asked, **how)
        known = keeps.known
        key = f"{name} {asked} {how}" if asked or how else name
        if key not in known:
            known[key] = function(found, *asked, **how)
        result: _Result = known[key]
        return result

    return kept


class Kept:
    """What was computed of an estimate, and the fields that it was computed from."""

    def __init__(self, basis: dict[str, object]) -> None:
        self.basis = basis
        self.known: dict[str, Any] = {}
