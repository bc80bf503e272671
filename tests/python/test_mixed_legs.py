# SPDX-License-Identifier: MIT
"""Legs of different chains in one mechanism."""

from __future__ import annotations

import json
import math
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

import symkin
from symkin.chains import ABSENT
from symkin.errors import MechanismError, MechanismFileError, SymkinError
from symkin.identification.problem import core_setup, layout_of
from symkin.io.mechanism_schema import mechanism_schema
from symkin.io.template import mechanism_template
from symkin.mechanism import Leg, Mechanism
from symkin.observability import analyse_observability, parameter_tolerances
from symkin.settings import DeclaredSymmetry, NoiseSettings, ProtocolSettings, WorkspaceSettings
from symkin.symmetry import generate_orbits, leg_carriers, map_poses
"""The planar one that is shipped, and a hexapod of struts and sliders."""


@pytest.fixture(scope="module")
def planar() -> Mechanism:
    return symkin.load_mechanism("2RRR_PRP")


@pytest.fixture(scope="module")
def spatial() -> Mechanism:
    """Three struts and three sliders, without symmetry."""
    strut = symkin.load_mechanism("hexapod_jugglebot")
    return strut


def test_a_leg_has_its_own_names_roles_and_units(planar: Mechanism) -> None:
    names = planar.parameter_names
    assert planar.chains == ("[R]RR", "[R]RR", "[P]RP")
    assert planar.chain == "2 [R]RR + 1 [P]RP"
    assert planar.mixed
    assert set(planar.legs[2].parameters) < set(names)
    absent = ~planar.has_parameter
    assert [names[i] for i in np.flatnonzero(absent[2])] == ["proximal_length", "distal_length"]
    assert not absent[:2].any()
    assert (planar.parameters[absent] == 0).all()
    roles = dict(zip(names, planar.parameter_roles(2), strict=True))
    assert roles["proximal_length"] == ABSENT
    assert roles["base_radius"] == ("base", "direction_distance")
    assert planar.parameter_roles(0)[names.index("base_radius")] == ("base", "radius")
    units = [dict(zip(names, planar.parameter_units(leg), strict=True)) for leg in (0, 2)]
    assert (units[0]["sensor_gain"], units[1]["sensor_gain"]) == ("", "m/rad")
    assert (units[0]["sensor_offset"], units[1]["sensor_offset"]) == ("rad", "m")
    assert planar.estimated_counts == (8, 8, 6)
    assert planar.least_poses == 8
    assert "distal_length" not in planar.estimated_names(2)


def test_the_core_has_the_columns_of_the_mechanism(planar: Mechanism) -> None:
    for leg, chain in enumerate(planar.straight.chains):
        told = [(each.end.name, each.kind.name) for each in chain.parameters]
        assert [each.name for each in chain.parameters] == list(planar.parameter_names)
        assert told == list(planar.parameter_roles(leg))
    assert (parameter_tolerances(planar)[~planar.has_parameter] == 0).all()
