# SPDX-License-Identifier: MIT
"""How visible every leg's parameters are at its own poses."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray

from symkin.plot.style import (
    SMALL,
    flat_axes,
    leg_patches,
    leg_style,
    legend_below,
    new_figure,
)

__all__ = ["observability_figure"]


def observability_figure(names: Sequence[str], r_diagonals: NDArray[np.float64]) -> Figure:
    """Draw abs(R_ii) (Eqs. 9, 10) of all legs side by side for each parameter.

    Parameters
    ----------
    names : sequence of str
        The p parameters.
    r_diagonals : ndarray, shape (legs, p)
        In units of the reading over the parameter's.

    Returns
    -------
    Figure
    """
    legs, count = r_diagonals.shape
    figure = new_figure(8.6, 3.6)
    axes = flat_axes(
        figure, figure.add_gridspec(1, 1)[0], y="|R$_{ii}$|, reading per parameter (SI)"
    )
    width = 0.8 / legs
    for leg, values in enumerate(r_diagonals):
        places = np.arange(count) - 0.4 + width * (leg + 0.5)
        axes.bar(places, values, 0.88 * width, color=leg_style(leg).colour)
    axes.set_yscale("log")
    shown = r_diagonals[r_diagonals > 0]
    if shown.size:
        axes.set_ylim(10 ** np.floor(np.log10(shown.min()) - 0.3), shown.max() * 2)
    axes.grid(False, axis="x")
    axes.set_xticks(range(count), [_two_lines(name) for name in names], fontsize=SMALL)
    axes.tick_params(axis="x", length=0)
    legend_below(figure, leg_patches(legs))
    return figure


def _two_lines(name: str) -> str:
    """``platform_polar_angle`` as a label that fits under a group of bars."""
    first, _, rest = name.partition("_")
    return f"{first}\n{rest.replace('_', ' ')}"
