# SPDX-License-Identifier: MIT
"""Figures that are drawn when a page needs them."""

from __future__ import annotations

from collections.abc import Callable
from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import FigureBase

__all__ = ["plotted"]


def plotted(
    name: str, *arguments: Any, module: str = "symkin.show.figures", **options: Any
) -> Callable[[], FigureBase | Axes]:
    """Return what draws a figure of a module that imports matplotlib, which takes a while."""
    return lambda: getattr(import_module(module), name)(*arguments, **options)
