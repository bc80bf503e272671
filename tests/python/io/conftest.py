# SPDX-License-Identifier: MIT
from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from symkin.data.measurements import Measurements
from symkin.errors import MechanismFileError
from symkin.model.mechanism import Mechanism
from symkin.robot import load_mechanism

MECHANISMS = Path(__file__).parents[3] / "mechanisms"

# Two legs listed in full, and nothing that has a default.
LISTED = """\
schema = 1
chain = "[R]RR"

[[legs]]  # left
proximal_length = 1.5
distal_length = "150 cm"
base_radius = 3.4
base_angle = "210 deg"
platform_radius = 0.8
platform_angle = "210 deg"
sensor_gain = 1
sensor_offset = 0

[[legs]]  # right
working_mode = 1
proximal_length = 1.6
distal_length = { value = "1.7 m", standard_deviation = "0.2 mm" }
base_radius = 3.5
base_angle = -0.5
platform_radius = 0.9
platform_angle = -0.4  # measured
sensor_gain = 1.1
sensor_offset = 0.1

[[legs]]  # top
proximal_length = 1.5
distal_length = 1.5
base_radius = 3.4
base_angle = 1.6
platform_radius = 0.8
platform_angle = 1.6
sensor_gain = 1
sensor_offset = 0
"""


@pytest.fixture(scope="session")
def paper_text() -> str:
    return (MECHANISMS / "3RRR.toml").read_text(encoding="utf-8")


@pytest.fixture(scope="session")
def paper() -> Mechanism:
    return load_mechanism(MECHANISMS / "3RRR.toml")


@pytest.fixture(scope="session")
def hexapod() -> Mechanism:
    return load_mechanism(MECHANISMS / "hexapod_jugglebot.toml")


@pytest.fixture
def write(tmp_path: Path) -> Callable[..., Path]:
    def write(text: str, name: str = "file.toml") -> Path:
        path = tmp_path / name
        path.write_text(text, encoding="utf-8")
        return path

    return write


@pytest.fixture(scope="session")
def measured(paper: Mechanism) -> Measurements:
    """Twelve exact measurements of the paper's mechanism."""
    poses = np.random.default_rng(1).uniform(-0.2, 0.2, (12, 3))
    return Measurements.of(poses, paper.inverse_kinematics(poses))


@pytest.fixture(scope="session")
def listed_text() -> str:
    return LISTED


@pytest.fixture
def refused(write: Callable[..., Path]) -> Callable[..., None]:
    """Loads a text and checks that the error names a line, a key and some words."""

    def refused(text: str, line_with: str, key: str, *words: str) -> None:
        path = write(text)
        with pytest.raises(MechanismFileError) as error:
            load_mechanism(path)
        assert error.value.path == path
        assert error.value.key == key
        assert line_with in text
        assert error.value.line == text[: text.index(line_with)].count("\n") + 1
        for word in words:
            assert word in str(error.value)
        assert "\n" not in str(error.value)

    return refused
