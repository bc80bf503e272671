# SPDX-License-Identifier: MIT
from __future__ import annotations

import pytest

from symkin.estimate import precision


@pytest.fixture(autouse=True, scope="package")
def few_poses():
    """Bounds over few poses of the workspace, which take the time of a session."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(precision, "_SAMPLES", 200)
        yield
