# SPDX-License-Identifier: MIT
from __future__ import annotations

from collections.abc import Callable

import pytest

import symkin
from symkin.planning.simulation import disturb


@pytest.fixture(scope="session")
def made() -> Callable[[str], symkin.Mechanism]:
    """A shipped mechanism as a workshop makes it: no leg like another, gains that are not 1."""
    return lambda name: disturb(symkin.load_mechanism(name), seed=1)
