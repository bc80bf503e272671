# SPDX-License-Identifier: MIT
"""Which of two lists belong together: the assignment of least cost."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from symkin.values import Array


def assigned(costs: Array) -> NDArray[np.intp]:
    """Give each row a column of its own at the least total of finite costs, (n, n); shape (n,).

    By shortest augmenting paths (Jonker and Volgenant, Computing 38, 1987).
    """
    count = len(costs)
    of_column = np.full(count, -1, dtype=np.intp)  # its row
    prices = np.zeros(count)
    for row in range(count):
        least = np.full(count, np.inf)
        before = np.full(count, -1, dtype=np.intp)
        reached = np.zeros(count, dtype=bool)
        current, length, column = row, 0.0, -1
        while True:
            own = 0.0 if column < 0 else costs[current, column] - prices[column]
            through = length + costs[current] - prices - own
            shorter = ~reached & (through < least)
            least[shorter], before[shorter] = through[shorter], column
            column = int(np.argmin(np.where(reached, np.inf, least)))
            length, reached[column] = float(least[column]), True
            if of_column[column] < 0:
                break
            current = int(of_column[column])
        prices[reached] += least[reached] - length
        while column >= 0:
            earlier = int(before[column])
            of_column[column] = row if earlier < 0 else of_column[earlier]
            column = earlier
    order = np.empty(count, dtype=np.intp)
    order[of_column] = np.arange(count)
    return order
