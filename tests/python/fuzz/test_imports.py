# SPDX-License-Identifier: MIT
"""Files of other programs, damaged: each is read or refused in words, beginning from valid ones."""

import random
from pathlib import Path

import pytest

import symkin
from symkin.exports.reading import import_mechanism

PRINTER = """[printer]
kinematics: delta
delta_radius: 174.75
[stepper_a]
position_endstop: 297.05
arm_length: 333.0
rotation_distance: 40
microsteps: 16
[stepper_b]
[stepper_c]
[delta_calibrate]
radius: 50
#*# <---------------------- SAVE_CONFIG ---------------------->
#*# [printer]
#*# delta_radius = 174.9
"""


def valid(kind: str) -> str:
    return PRINTER if kind == "cfg" else symkin.export(symkin.load_mechanism("3RRR"), kind).text


def damaged(text: str, chance: random.Random) -> str:
    """A few bytes exchanged, removed or added."""
    data = bytearray(text.encode())
    for _ in range(chance.randint(1, 5)):
        at, what = chance.randrange(len(data) - 40), chance.random()
        if what < 0.4:
            data[at] = chance.randrange(32, 127)
        elif what < 0.7:
            del data[at : at + chance.randrange(1, 30)]
        else:
            data[at:at] = bytes(chance.choices(b'[]{}:=0.-eE\n<>" ', k=3))
    return data.decode()


@pytest.mark.parametrize("kind", ["mjcf", "urdf", "cfg"])
def test_a_damaged_file_is_read_or_refused_in_words(kind: str, tmp_path: Path) -> None:
    chance, text, refused = random.Random(3), valid(kind), list[str]()
    for _ in range(150):
        path = tmp_path / "damaged"
        path.write_text(damaged(text, chance), encoding="utf-8")
        try:
            import_mechanism(path)
        except symkin.SymkinError as error:
            refused.append(str(error))
    assert all("damaged" in each for each in refused)
    assert 30 <= len(refused) <= 145  # neither all at the first look, nor hardly damaged


@pytest.mark.parametrize("home", ["[]", "[" * 100_000, '"abc"', "[NaN, 0, 0]"])
def test_a_home_that_is_none_is_refused(home: str, tmp_path: Path) -> None:
    path = tmp_path / "model.xml"
    path.write_text(valid("mjcf").replace('"home": [0.0, 0.0, 0.0]', f'"home": {home}'))
    assert home in path.read_text(encoding="utf-8")
    with pytest.raises(symkin.SymkinError, match=r"model\.xml"):
        import_mechanism(path)


def test_a_section_with_a_continued_key_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "printer.cfg"
    path.write_text(
        "[printer]\nkinematics: delta\n  more\n : x\n[stepper_a]\n  arm_length\n", "utf-8"
    )
    with pytest.raises(symkin.SymkinError, match=r"printer\.cfg"):
        import_mechanism(path)


def test_a_file_of_a_hundred_megabytes_is_refused_without_being_read(tmp_path: Path) -> None:
    path = tmp_path / "printer.cfg"
    with path.open("wb") as file:
        file.truncate(100_000_000)
    with pytest.raises(symkin.SymkinError, match="has 100000000 bytes; expected at most"):
        import_mechanism(path)
