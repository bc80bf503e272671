# SPDX-License-Identifier: MIT
"""Declared legs that are known chains: computed as those, with the same answers."""

from __future__ import annotations

import dataclasses
from pathlib import Path

import numpy as np
import pytest

import symkin
from symkin import _core
from symkin.model.chains import chain_info
from symkin.model.declared import declare, declared_chain
from symkin.planning.simulation import disturb
from symkin.show.mechanism import held_parameters

HEAD = """\
schema = 1
name = "declared"
chain = "leg"
{platform}
[chains.leg]
{leg}

[symmetry]
group = "{group}"
legs = {legs}

[workspace]
{box}
[noise]
position = "0.1 mm"
orientation = 1e-4
reading = 1e-5

[tolerances]
length = "10 mm"
angle = "10 mrad"
gain = 0.01
"""
PLANE = 'x = ["-0.3 m", "0.3 m"]\ny = ["-0.3 m", "0.3 m"]\nphi = ["-0.3 rad", "0.3 rad"]\n'
SPACE = (
    'x = ["-0.05 m", "0.05 m"]\ny = ["-0.05 m", "0.05 m"]\nz = ["{low} m", "{high} m"]\n'
    'home = ["0 m", "0 m", "{home} m"{turn}]\n'
)
TILT = 'rx = ["-0.1 rad", "0.1 rad"]\nry = ["-0.1 rad", "0.1 rad"]\nrz = ["-0.1 rad", "0.1 rad"]\n'
BASE = '{ name = "base", azimuth = "20 deg", x = "0.5 m", z = 0 }'
PLATFORM = '{ name = "platform", azimuth = "60 deg", x = "0.3 m", z = 0 }'


def dyad(first: str, second: str, *, on_point: bool) -> str:
    """The path of a planar leg of two links; a point ends in the last joint."""
    base, home = ("2.1 m", (124, 87)) if on_point else ("6 m / sqrt(3)", (152, 48))
    end = "" if on_point else ', { name = "platform", azimuth = "205 deg", x = "0.9 m" }'
    return (
        f'path = [ {{ name = "base", azimuth = "210 deg", x = "{base}", y = "0.1 m" }},\n'
        f'  "a: {first}", {{ name = "proximal", x = "1 m" }},\n'
        f'  "b: {second}", {{ name = "distal", x = "1.8 m" }}, "R"{end} ]\n'
        f'home = {{ a = "{home[0]} deg", b = "{home[1]} deg" }}'
    )


POINT = 'x = ["-0.3 m", "0.3 m"]\ny = ["-0.3 m", "0.3 m"]\nhome = ["0 m", "0 m"]\n'
STRUT_HOME = SPACE.format(low=0.5, high=0.7, home=0.6, turn=", 0, 0, 0") + TILT
CRANK = (
    'path = [ { name = "base", azimuth = "20 deg", x = "0.2 m", y = "30 mm", z = 0 }, "q: [R] y", '
    '{ name = "crank", x = "0.25 m" }, "U y z", { name = "rod", x = "0.6 m" }, "S", '
)
CRANK_HOME = SPACE.format(low=-0.6, high=-0.5, home=-0.55, turn="")
# By the known chain and what is special: the platform, the leg, the group, legs, and the workspace.
CASES = {
    "[R]RR": ("", dyad("[R]", "R", on_point=False), "D3", 6, PLANE),
    "[R]RR on a point": (
        'platform = "point"\n',
        dyad("[R]", "R", on_point=True),
        "C3",
        3,
        POINT,
    ),
    "R[R]R": ("", dyad("R", "[R]", on_point=False), "C3", 3, PLANE),
    "R[R]R on a point": (
        'platform = "point"\n',
        dyad("R", "[R]", on_point=True),
        "C3",
        3,
        POINT,
    ),
    "R[P]R": (
        "",
        'path = [ { name = "base", azimuth = "210 deg", x = "2 m" }, "R", "q: [P]", "R",\n'
        '  { name = "platform", azimuth = "260 deg", x = "0.9 m", y = "0.1 m" } ]\n'
        'home = { q = "1.68 m" }',
        "C3",
        3,
        PLANE,
    ),
    "R[P]R on a point": (
        'platform = "point"\n',
        'path = [ { name = "base", azimuth = "210 deg", x = "2 m", y = "0.1 m" }, "R", "q: [P]" ]\n'
        'platform_path = []\nhome = { q = "2 m" }',
        "C3",
        3,
        POINT,
    ),
    "U[P]S": (
        "",
        f'path = [ {BASE[:-2]}, y = "0.1 m", aim = "S" }}, "U x y", "q: [P] z", "S", {PLATFORM} ]',
        "D3",
        6,
        STRUT_HOME,
    ),
    "U[P]S translating": (
        'platform = "translating"\n',
        f'path = [ {BASE[:-2]}, aim = "S" }}, "U x y", "q: [P] z", "S", '
        '{ name = "platform", azimuth = "20 deg", x = "0.1 m", exact = true } ]',
        "C3",
        3,
        SPACE.format(low=0.5, high=0.7, home=0.6, turn=""),
    ),
    "U[P]S a cable": (
        "",
        'rods = [ { name = "cable", from = "base", at = { x = "0.5 m", y = "0.2 m", z = 0 }, '
        'end = { x = "0.1 m", y = "0.25 m", z = 0 }, length = "[q]" } ]',
        "D3",
        6,
        STRUT_HOME,
    ),
    "[R]US": (
        "",
        CRANK + '{ name = "platform", azimuth = "60 deg", x = "0.15 m", y = "0.1 m", z = 0 } ]\n'
        'home = { q = "20 deg" }',
        "D3",
        6,
        SPACE.format(low=-0.6, high=-0.5, home=-0.55, turn=", 0, 0, 0") + TILT,
    ),
    "[R]US translating": (
        'platform = "translating"\n',
        CRANK + '{ name = "platform", azimuth = "20 deg", x = "0.06 m", exact = true } ]\n'
        'home = { q = "20 deg" }',
        "C3",
        3,
        CRANK_HOME,
    ),
    "[R]US a rod": (
        'platform = "translating"\n',
        'path = [ { name = "base", azimuth = "20 deg", x = "0.2 m", z = 0 }, "q: [R] y", '
        '{ name = "crank", x = "0.25 m" } ]\n'
        'rods = [ { name = "rod", from = "crank", length = "0.6 m" } ]\n'
        'home = { q = "20 deg" }',
        "C3",
        3,
        CRANK_HOME,
    ),
    "[P]US": (
        "",
        'path = [ { name = "base", azimuth = "20 deg", x = "0.5 m", y = "0.1 m", z = 0 }, '
        '"q: [P] z" ]\n'
        'rods = [ { name = "rod", from = "q", end = { x = "0.1 m", y = "0.25 m", z = 0 }, '
        'length = "0.6 m" } ]\nhome = { q = "0.1 m" }',
        "D3",
        6,
        STRUT_HOME,
    ),
    "[P]US along x": (
        "",
        'path = [ { name = "base", azimuth = "20 deg", x = "0.5 m", y = "0.1 m", z = 0 }, '
        '"q: [P] x", "U z y", { name = "rod", x = "0.7 m" }, "S", '
        '{ name = "platform", azimuth = "60 deg", x = "0.25 m", z = 0 } ]\n'
        'home = { q = "-40 mm" }',
        "D3",
        6,
        STRUT_HOME,
    ),
    "[P]US translating": (
        'platform = "translating"\n',
        'path = [ { name = "base", azimuth = "20 deg", x = "0.3 m", z = 0 }, "q: [P] z" ]\n'
        'rods = [ { name = "rod", from = "q", length = "0.5 m" } ]\n'
        'home = { q = "0.9 m" }',
        "C3",
        3,
        SPACE.format(low=0.4, high=0.6, home=0.5, turn=""),
    ),
}


def mechanism_of(name: str, tmp_path: Path) -> symkin.Mechanism:
    platform, leg, group, legs, box = CASES[name]
    path = tmp_path / "declared.toml"
    path.write_text(HEAD.format(platform=platform, leg=leg, group=group, legs=legs, box=box))
    return symkin.load_mechanism(path)


def joint_by_joint(mechanism: symkin.Mechanism) -> symkin.Mechanism:
    """The same legs, not recognised."""
    legs = []
    for leg in mechanism.legs:
        chain = declared_chain(leg.chain)
        assert chain is not None
        name = declare(dataclasses.replace(chain, recognise=False))
        legs.append(dataclasses.replace(leg, chain=name))
    return mechanism.replace(legs=legs, symmetry=None)


@pytest.mark.parametrize("name", sorted(CASES))
def test_a_declared_leg_that_is_a_known_chain_gives_the_same_answers(
    name: str, tmp_path: Path
) -> None:
    mechanism = mechanism_of(name, tmp_path)
    recognised = disturb(mechanism, seed=4).replace(symmetry=None)
    plain = joint_by_joint(recognised)
    assert chain_info(recognised.chains[0], recognised.platform).runs_as == name.split()[0]
    assert not chain_info(plain.chains[0], plain.platform).runs_as
    poses = symkin.sample_workspace(recognised, 60, seed=2).poses
    readings = plain.inverse_kinematics(poses)
    np.testing.assert_allclose(recognised.inverse_kinematics(poses), readings, atol=1e-11)
    for leg in range(len(recognised.legs)):
        ours, theirs = (
            _core.linearise(each.core, leg, poses, readings[:, leg]) for each in (recognised, plain)
        )
        # Rows up to a factor.
        for attribute in ("by_parameters", "by_pose"):
            mine, other = (
                getattr(each, attribute) / np.asarray(each.by_reading)[:, None]
                for each in (ours, theirs)
            )
            np.testing.assert_allclose(mine, other, atol=1e-9)
            ranks = [np.linalg.matrix_rank(each, tol=1e-8) for each in (mine, other)]
            assert ranks[0] == ranks[1]
    found, reached = recognised.forward_kinematics(readings)
    assert reached.mean() > 0.9
    np.testing.assert_allclose(found[reached], poses[reached], atol=1e-9)


@pytest.mark.parametrize("name", sorted(CASES))
def test_the_identified_robot_is_the_same(name: str, tmp_path: Path) -> None:
    mechanism = mechanism_of(name, tmp_path)
    plain = joint_by_joint(mechanism)
    plan = symkin.plan(mechanism, 20, candidates=100, design="mechanism")
    actual = disturb(mechanism, seed=4)
    measured = symkin.simulate(mechanism, plan, 3, actual=actual).measurements
    ours, theirs = (symkin.identify(each, measured, "joint") for each in (mechanism, plain))
    assert ours.converged
    apart = (ours.mechanism.parameters - theirs.mechanism.parameters)[mechanism.is_estimated]
    assert np.abs(apart / np.sqrt(np.diag(ours.covariance))).max() < 1e-8


def test_one_further_number_makes_it_another_leg(tmp_path: Path) -> None:
    text = HEAD.format(
        platform="",
        leg=CASES["[R]RR"][1].replace('"proximal", x', '"proximal", y = 0, x'),
        group="C3",
        legs=3,
        box=PLANE,
    )
    path = tmp_path / "other.toml"
    path.write_text(text)
    mechanism = symkin.load_mechanism(path)
    assert not chain_info(mechanism.chains[0]).runs_as


def test_a_check_says_as_what_a_declared_leg_is_computed(tmp_path: Path) -> None:
    mechanism = mechanism_of("U[P]S", tmp_path)
    assert "Every leg is the known chain U[P]S" in " ".join(held_parameters(mechanism))
