# SPDX-License-Identifier: MIT
"""Figures that are drawn when a page needs them."""

from __future__ import annotations

from collections.abc import Callable
from contextvars import copy_context
from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import FigureBase


def plotted(
    name: str, *arguments: Any, module: str = "symkin.show.figures", **options: Any
) -> Callable[[], FigureBase | Axes]:
    """Return what draws a figure of a module that imports matplotlib, which takes a while.

    It is drawn in the units in which its page is told.
    """
    told = copy_context()
    return lambda: told.copy().run(
        lambda: getattr(import_module(module), name)(*arguments, **options)
    )
