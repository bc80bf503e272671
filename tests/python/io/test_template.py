# SPDX-License-Identifier: MIT
from __future__ import annotations

from pathlib import Path

import pytest

import symkin
from symkin.files.template import mechanism_template


def _counts(info: symkin.model.chains.ChainInfo, counts: tuple[int, ...]) -> tuple[int, ...]:
    return (6 // info.closures,) if info.pose_space == "spatial" else counts


CASES = [
    (chain, legs, platform)
    for platform, counts in (
        ("rigid", (3, 4, 5, 6)),
        ("point", (2, 3, 4, 5, 6)),
        ("translating", (3, 4)),
        ("spherical", (3, 4)),
    )
    for chain in symkin.chains(platform)
    for legs in _counts(symkin.chain_info(chain, platform), counts)
    # A guide has no other side, so opposite legs would be the same one.
    if not (platform == "point" and chain in ("[P]PR", "P[P]R") and legs in (4, 6))
]


@pytest.mark.parametrize(("chain", "legs", "platform"), CASES)
def test_a_template_is_a_mechanism_with_a_workspace(
    tmp_path: Path, chain: str, legs: int, platform: str
) -> None:
    path = tmp_path / "robot.toml"
    path.write_text(mechanism_template(chain, legs, platform))
    mechanism = symkin.load_mechanism(path)
    assert mechanism.protocol.pose_count == 3 * max(mechanism.estimated_counts)
    assert (mechanism.name, mechanism.chain) == ("robot", chain)
    assert (len(mechanism.legs), mechanism.platform) == (legs, platform)
    # Most of its box can be used.
    sample = symkin.sample_workspace(mechanism, 500)
    assert len(sample.poses) > sample.drawn / 3
    _, _, condition = mechanism.singularity_measures(mechanism.home)
    assert condition[0] < 12


@pytest.mark.parametrize(
    "case",
    [
        ("[R]RR", 3, "rigid"),
        ("[P]RR", 2, "point"),
        ("U[P]S", 6, "rigid"),
        ("U[P]S", 4, "translating"),
        ("[R]RR", 3, "spherical"),
    ],
)
def test_the_whole_protocol_runs_on_a_template(tmp_path: Path, case: tuple[str, int, str]) -> None:
    path = tmp_path / "robot.toml"
    path.write_text(mechanism_template(*case).replace("= 20000", "= 500"))
    result = symkin.load_mechanism(path).run()
    for kind, _ in result.nominal.space.errors:
        before, after = (getattr(each, f"{kind}_rms") for each in (result.before, result.after))
        assert after < before / 3


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("[R]RX",), "unknown chain"),
        (("[R]RR", 2), r'3 to 64; two hold a "point" \(--platform\), as in a five-bar'),
        (("[R]RR", 1, "point"), "1 legs for a point platform; expected 2 to 64"),
        (("[P]PR", 4, "point"), "two of them would be the same; expected 2 or an odd number"),
        (("U[P]S", 5), "5 legs for a spatial platform; expected 6"),
        (
            ("[R]RR", 3, "rigd"),
            'expected "rigid", "point", "translating", "spherical" or "schoenflies"',
        ),
        (("U[P]S", 3, "spherical"), "turn about one centre"),
        (("8 [R]RR + 8 [P]RR",), "too many ways to place 16 legs"),
    ],
)
def test_a_template_that_cannot_be_is_refused(arguments: tuple[object, ...], words: str) -> None:
    with pytest.raises(symkin.SymkinError, match=words):
        mechanism_template(*arguments)
