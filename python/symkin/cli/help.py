# SPDX-License-Identifier: MIT
"""Help texts with examples."""

from __future__ import annotations

import inspect
from collections.abc import Callable
from typing import TypeVar

__all__ = ["with_example"]

_Command = TypeVar("_Command", bound=Callable[..., None])


def with_example(*lines: str) -> Callable[[_Command], _Command]:
    """Add command lines to a command's help, where they stay as they are."""

    def add(command: _Command) -> _Command:
        text = inspect.cleandoc(command.__doc__ or "")
        example = "\n".join(f"  {line}" for line in lines)
        # A line with a backspace alone tells typer not to fill the paragraph that follows.
        command.__doc__ = f"{text}\n\n\b\nExample:\n{example}"
        return command

    return add
