# SPDX-License-Identifier: MIT
"""What the suites share: shipped mechanisms, and outside data if it lies beside the project."""

from pathlib import Path

import hypothesis
import pytest

import symkin

hypothesis.settings.register_profile("deterministic", derandomize=True, deadline=None)
hypothesis.settings.load_profile("deterministic")

SHARED = Path(__file__).resolve().parents[3] / "shared"


@pytest.fixture
def unillustrated(monkeypatch: pytest.MonkeyPatch) -> None:
    """Pages without figures, as without matplotlib: for tests that look at something else."""
    monkeypatch.setattr("symkin.show.rendering._can_draw", lambda: False)


@pytest.fixture(scope="session")
def paper() -> symkin.Mechanism:
    """The 3-RRR of Durango et al. (2010)."""
    return symkin.load_mechanism("3RRR")


@pytest.fixture(scope="session")
def hexapod() -> symkin.Mechanism:
    """A cable-spool Stewart platform."""
    return symkin.load_mechanism("hexapod_jugglebot")


@pytest.fixture(scope="session")
def hexapod_table() -> Path:
    """The hexapod's 108 measured poses, which are not part of the project."""
    path = SHARED / "data" / "jugglebot" / "108_calibration_poses.csv"
    if not path.exists():
        pytest.skip("the measured poses of the hexapod are not at hand")
    return path


@pytest.fixture(scope="session")
def reference_file() -> Path:
    """Reference numbers of the planar chains, made independently of the project."""
    path = SHARED / "reference" / "planar_chains.json"
    if not path.exists():
        pytest.skip("the reference numbers are not at hand")
    return path


@pytest.fixture(scope="session")
def shared_reference() -> Path:
    """The folder of reference numbers, made independently of the project."""
    path = SHARED / "reference"
    if not path.is_dir():
        pytest.skip("the reference numbers are not at hand")
    return path
