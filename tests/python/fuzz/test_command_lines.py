# SPDX-License-Identifier: MIT
"""Whatever a file or a command line holds, a command ends with its result or one sentence."""

from __future__ import annotations

import itertools
import tomllib
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import pytest

import symkin
from symkin.model.settings import ProtocolSettings

MECHANISMS = Path(__file__).parents[3] / "mechanisms"
_FEWEST = 5000


@dataclass(frozen=True)
class Case:
    """A command line, and the files that it finds in its folder."""

    arguments: tuple[str, ...]
    files: Mapping[str, bytes] = field(default_factory=dict, hash=False)

    @property
    def key(self) -> tuple[object, ...]:
        """What tells it from others."""
        return (self.arguments, *sorted(self.files.items()))


@dataclass(frozen=True)
class Robot:
    """A mechanism file with a plan of few poses and the measurements of it."""

    text: str
    plan: str
    measured: str


def _robot(name: str, folder: Path, *, listed: bool = False) -> Robot:
    text = (MECHANISMS / f"{name}.toml").read_text(encoding="utf-8")
    mechanism = symkin.load_mechanism(name)
    protocol = ProtocolSettings(pose_count=mechanism.core.parameters.shape[1], candidates=80)
    mechanism = mechanism.replace(
        protocol=protocol, symmetry=None if listed else mechanism.symmetry
    )
    path = folder / f"{name}.toml"
    if listed or "[protocol]" not in text:
        symkin.save_mechanism(mechanism, path)
        text = path.read_text()
    else:
        head, _, tail = text.partition("[protocol]")
        rest = tail.partition("\n[")
        text = (
            f"{head}[protocol]\npose_count = 10\ncandidates = 80\nseed = 1\n\n{''.join(rest[1:])}"
        )
    plan = symkin.make_plan(mechanism, symkin.sample_workspace(mechanism), spares=4)
    symkin.write_plan(plan, folder / "plan.csv", mechanism)
    measured = symkin.simulate(mechanism, plan).measurements
    symkin.write_measurements(measured, folder / "measured.csv", mechanism)
    return Robot(
        _flat(text), (folder / "plan.csv").read_text(), (folder / "measured.csv").read_text()
    )


@pytest.fixture(scope="module")
def planar(tmp_path_factory: pytest.TempPathFactory) -> Robot:
    """The 3-RRR, made by its symmetry."""
    return _robot("3RRR", tmp_path_factory.mktemp("planar"))


@pytest.fixture(scope="module")
def spatial(tmp_path_factory: pytest.TempPathFactory) -> Robot:
    """A hexapod with a column mapping."""
    return _robot("hexapod_jugglebot", tmp_path_factory.mktemp("spatial"))


@pytest.fixture(scope="module")
def listed(tmp_path_factory: pytest.TempPathFactory) -> Robot:
    """A five-bar whose legs are listed."""
    return _robot("5bar", tmp_path_factory.mktemp("listed"), listed=True)


_VALUES = [
    "true", "0", "-1", "1", "3", "135", "0.5", "-0.0", "1e308", "-1e308", "5e-324", "inf", "nan",
    "1" + "0" * 400, "9223372036854775807", "9223372036854775808", '""', '"x"', '"1 m"', '"2 deg"',
    '"(-1)**0.5"', '"1e999 m"', '"1,5 m"', '"m"', '"C3"', '"D9999999999"', '"[R]RR"', '"point"',
    "[]", "[1]", "[1, 2]", "[2, 1]", '["a", "a", "a"]', '["x_m", "y_m", "phi_rad"]', "[[1]]", "{}",
    "{ value = 1 }", "{ value = 1, standard_deviation = -1 }", "1979-05-27", r'"\u001b[31m"',
    r'"a\nb"', f'"{"a" * 600}"', '"µ"', "''",
]  # fmt: skip


def _commands(file: str) -> list[tuple[str, ...]]:
    return [
        ("evaluate", file, "--measurements", "measured.csv"),
        ("simulate", file, "--plan", "plan.csv", "--out", "out", "--overwrite"),
        ("evaluate", "sound.toml", "--actual", file, "--plan", "plan.csv"),
        ("identify", file, "measured.csv"),
        ("evaluate", "sound.toml", "--measurements", "measured.csv", "--columns", file),
    ]


def _with_value(text: str, key: Sequence[str | int], value: str | None) -> str:
    """The text with another value of a key, which is removed by None; tables of a list count."""
    lines, header, seen = [], [], {}
    for line in text.splitlines():
        stripped = line.strip()
        if stripped.startswith("["):
            name = stripped.split("]")[0].strip("[")
            seen[name] = seen.get(name, -1) + 1
            header = [name, seen[name]] if stripped.startswith("[[") else [name]
        found = stripped.split("=")[0].strip()
        if [*header, found] == list(key) and "=" in stripped and not stripped.startswith("#"):
            if value is not None:
                lines.append(f"{found} = {value}")
            continue
        lines.append(line)
    return "\n".join(lines) + "\n"


def _keys(values: Mapping[str, Any]) -> Iterator[tuple[str | int, ...]]:
    for name, value in values.items():
        if isinstance(value, dict):
            yield from ((name, key) for key in value)
        elif isinstance(value, list) and value and isinstance(value[0], dict):
            yield from ((name, 0, key) for key in value[0])
        else:
            yield (name,)


def _mechanism_cases(robots: Sequence[Robot]) -> Iterator[Case]:
    for robot in robots:
        data = {
            "sound.toml": robot.text.encode(),
            "plan.csv": robot.plan.encode(),
            "measured.csv": robot.measured.encode(),
        }
        keys = list(_keys(tomllib.loads(robot.text)))
        commands = itertools.cycle(_commands("spoilt.toml"))
        for key, value in itertools.product(keys, [*_VALUES, None]):
            spoilt = _with_value(robot.text, key, value).encode()
            yield Case(next(commands), {**data, "spoilt.toml": spoilt})
        for spoilt in _broken(robot.text):
            yield Case(("check", "spoilt.toml"), {"spoilt.toml": spoilt})


def _flat(text: str) -> str:
    """The text with each key on a line, and without comments."""
    lines: list[str] = []
    depth = 0
    for line in text.splitlines():
        bare = line.split("#")[0].rstrip()
        if depth:
            lines[-1] += " " + bare.strip()
        else:
            lines.append(bare)
        depth += bare.count("[") - bare.count("]")
    flat = "\n".join(filter(None, lines)) + "\n"
    assert tomllib.loads(flat) == tomllib.loads(text)
    return flat


def _broken(text: str) -> Iterator[bytes]:
    """No TOML, or TOML that holds a key or a table in the wrong place."""
    data = text.encode()
    lines = text.splitlines()
    yield from (data[: len(data) * part // 12] for part in range(12))
    for number in range(0, len(lines), 3):
        yield "\n".join(
            lines[:number] + lines[number : number + 1] * 2 + lines[number + 1 :]
        ).encode()
        yield "\n".join([*lines[:number], "[unknown]", *lines[number:]]).encode()
        yield "\n".join([*lines[:number], "= 3", *lines[number:]]).encode()
    yield from (
        b"\xff\xfe",
        b"\x00" * 99,
        data.replace(b"\n", b"\x00"),
        data.decode().encode("utf-16"),
    )
    yield from (data + b"\n[[legs]]\n", data + b"\nlegs = 3\n", b"[" * 9999, b"a." * 999 + b"a = 1")


def _expressions() -> Iterator[str]:
    operands = ["1", "-1", "0", "1e308", "1.5.2", "pi", "m", "deg", "()", "x", "1 m", "2 rad"]
    operators = ["+", "-", "*", "/", "**", " ", ",", "//", "%", "=="]
    for first, operator, second in itertools.product(operands, operators, operands):
        yield f"{first}{operator}{second}"
    functions = ["sqrt", "sin", "asin", "atan2", "abs", "exp", "__import__", "rad"]
    for function, operand in itertools.product(functions, [*operands, "", "1, 2", "1 m, 2 m"]):
        yield f"{function}({operand})"
    yield from (
        "(" * 150,
        ")" * 9,
        "1" * 199,
        "1" * 201,
        "-" * 190 + "1",
        "m" * 190,
        "é",
        "\u202e1 m",
    )


def _expression_cases(robot: Robot) -> Iterator[Case]:
    keys = [("reference_leg", "proximal_length"), ("reference_leg", "base_angle"),
            ("tolerances", "gain"), ("joint_limits", "upper")]  # fmt: skip
    flat = robot.text + '\n[joint_limits]\nupper = "1 turn"\n'
    measured = robot.measured.encode()
    turn = itertools.cycle(range(len(keys) + 2))
    for text in _expressions():
        index = next(turn)
        if index < len(keys):
            spoilt = _with_value(flat, keys[index], f'"{text}"').encode()
            command = ("evaluate", "spoilt.toml", "--measurements", "measured.csv")
            yield Case(command, {"spoilt.toml": spoilt, "measured.csv": measured})
        elif index == len(keys):
            yield Case(("plan", "nosuch", "--out", "p", "--minimum-distance", text))
        else:
            yield Case(("workspace", "nosuch", "--out", "w", "--orientations", text))


_CELLS = [
    "", " ", "0", "-0", "1e308", "-1e308", "1e-320", "1e999", "nan", "inf", "NaN", "1_000", "0x1F",
    "1,5", "1.5.2", "1 mm", "--1", "true", "=1+1", "9" * 400, "a" * 700, "\x1b[31m", "é", "\u0661",
    '"', '"1"', "#", "50", "1.5", "2", "99", "\x00", "2020-01-01",
]  # fmt: skip


def _table_cases(robots: Sequence[Robot]) -> Iterator[Case]:
    for robot in robots:
        data = {"robot.toml": robot.text.encode()}
        measured = [
            ("identify", "robot.toml", "t.csv"),
            ("identify", "robot.toml", "t.csv", "--estimator", "joint", "--loss", "huber"),
            ("evaluate", "robot.toml", "--measurements", "t.csv"),
            ("kinematics", "robot.toml", "t.csv"),
            ("kinematics", "robot.toml", "t.csv", "--forward"),
            ("plan", "robot.toml", "--out", "o", "--overwrite", "--measured", "t.csv"),
        ]
        planned = [
            ("simulate", "robot.toml", "--plan", "t.csv", "--out", "o", "--overwrite"),
            ("evaluate", "robot.toml", "--actual", "robot.toml", "--plan", "t.csv"),
            ("plan", "robot.toml", "--out", "o", "--overwrite", "--required", "t.csv"),
        ]
        for text, commands in ((robot.measured, measured), (robot.plan, planned)):
            turn = itertools.cycle(commands)
            rows = [line.split(",") for line in text.splitlines()]
            columns = range(len(rows[0]))
            for row, column, cell in itertools.product((0, 2), columns, _CELLS):
                spoilt = [list(cells) for cells in rows]
                spoilt[row][column] = cell
                table = "\n".join(map(",".join, spoilt)).encode()
                yield Case(next(turn), {**data, "t.csv": table})
            for column, cell in itertools.product(columns, ("", "0", "1e200", "1,5")):
                spoilt = [rows[0], *([*c[:column], cell, *c[column + 1 :]] for c in rows[1:])]
                table = "\n".join(map(";".join, spoilt)).encode()
                yield Case(next(turn), {**data, "t.csv": table})
            for table in _broken_tables(text):
                yield Case(next(turn), {**data, "t.csv": table})
                renamed = tuple(word.replace("t.csv", "t.parquet") for word in next(turn))
                yield Case(renamed, {**data, "t.parquet": table})


def _broken_tables(text: str) -> Iterator[bytes]:
    data = text.encode()
    lines = text.splitlines()
    yield from (data[: len(data) * part // 12] for part in range(12))
    yield from ("\n".join(lines[:count]).encode() for count in range(1, 12))
    for old, new in ((",", ";"), (",", "\t"), (",", " "), (".", ","), ("\n", "\r"), ("\n", "\n\n"),
                     ("\n", "\n#"), ("_", "-"), ("rad", "deg"), ("_m", "_mm"), (",", ',"'),
                     ("0", "9"), ("-", ""), ("psi_1", "psi_2")):  # fmt: skip
        yield text.replace(old, new).encode()
    yield from (text.encode(name) for name in ("utf-16", "utf-16-be", "utf-32", "utf-8-sig"))
    yield from (
        "\n".join([lines[0], *lines[:0:-1]]).encode(),
        "\n".join([*lines, lines[2]]).encode(),
    )
    yield from (b"PAR1" + data, b"\x00" * 99, b"PAR1" * 9, b'"' + data, b"\xff" + data, b"#")


_WORDS = [
    "", " ", "x", "-1", "0", "1", "2", "1e3", "1.5", "nan", "inf", "-inf", "1_0", "0x1F",
    "2147483648", "9223372036854775808", "18446744073709551616", "9" * 400, "True", "-", "--",
    "--json", "é", "\x1b[31m", "a" * 700, "x=1:2", "x=1:2,x=3:4", "y=:", "phi=30:60", "0,0,0",
    "0,0.3", "5cm", "/dev/zero", "nosuch/", "all", "none", "paper", "spoilt.toml",
]  # fmt: skip
# Commands that end at the mechanism, so that what is tried is the option alone, and those that do
# not take long.
_TEMPLATES: dict[tuple[str, ...], Sequence[str]] = {
    ("check", "robot.toml"): ["--seed", "--json", "--bogus"],
    ("check", "{}"): [""],
    ("workspace", "nosuch", "--out", "w"): ["--orientations", "--count", "--resolution", "--seed"],
    ("pose-count", "nosuch"): [
        "--least-gain", "--estimator", "--poses", "--candidates", "--design", "--rows",
        "--criterion", "--seed", "--accuracy",
    ],
    ("pose-count", "robot.toml"): ["--least-gain"],
    ("plan", "robot.toml", "--out", "o", "--overwrite"): [
        "--pose-count", "--design", "--rows", "--criterion", "--required", "--measured",
        "--columns", "--avoid", "--minimum-distance", "--margin-sigmas", "--visit", "--spares",
        "--threads", "--seed", "--time-limit",
    ],
    ("plan", "nosuch", "--out", "o"): ["--method", "--candidates", "--time-limit", "--out"],
    ("simulate", "robot.toml", "--out", "o", "--overwrite", "--plan", "plan.csv"): [
        "--seed", "--observe", "--missing", "--spread", "--base", "--target", "--plane",
    ],
    ("simulate", "robot.toml", "--out", "o", "--overwrite", "--plan", "{}"): [""],
    ("kinematics", "robot.toml", "{}"): [""],
    ("identify", "robot.toml", "measured.csv"): [
        "--columns", "--estimator", "--poses", "--loss", "--cross-validate", "--seed",
    ],
    ("identify", "robot.toml", "{}"): [""],
    ("evaluate", "robot.toml"): ["--actual", "--measurements", "--plan", "--columns"],
    ("evaluate", "robot.toml", "--actual", "robot.toml"): ["--plan", "--candidates", "--seed"],
    ("export", "robot.toml", "--to", "table", "--nominal", "robot.toml"): ["--grid"],
    ("export", "robot.toml", "--to", "mjcf"): ["--endstops", "--nominal"],
    ("export", "robot.toml", "--to", "{}"): [""],
    ("import", "{}", "--out", "o"): [""],
    ("run", "nosuch", "--out", "r"): [
        "--estimator", "--poses", "--design", "--rows", "--criterion", "--seed", "--pose-count",
        "--candidates", "--margin-sigmas",
    ],
    ("{}", "robot.toml"): [""],
}  # fmt: skip


def _option_cases(robot: Robot) -> Iterator[Case]:
    data = {
        "robot.toml": robot.text.encode(),
        "plan.csv": robot.plan.encode(),
        "measured.csv": robot.measured.encode(),
    }
    for template, options in _TEMPLATES.items():
        for option, word in itertools.product(options, _WORDS):
            arguments = tuple(each.replace("{}", word) for each in template)
            yield Case((*arguments, *((option, word) if option else ())), data)


def test_no_mechanism_file_breaks_a_command(
    survive: Callable[..., None], planar: Robot, spatial: Robot, listed: Robot
) -> None:
    survive(list(_mechanism_cases([planar, spatial, listed])))


def test_no_expression_breaks_a_command(survive: Callable[..., None], planar: Robot) -> None:
    survive(list(_expression_cases(planar)))


def test_no_table_breaks_a_command(
    survive: Callable[..., None], planar: Robot, spatial: Robot
) -> None:
    survive(list(_table_cases([planar, spatial])))


def test_no_option_breaks_a_command(survive: Callable[..., None], planar: Robot) -> None:
    survive(list(_option_cases(planar)))


def test_there_are_many_cases_and_none_twice(planar: Robot, spatial: Robot, listed: Robot) -> None:
    cases = [
        *_mechanism_cases([planar, spatial, listed]),
        *_expression_cases(planar),
        *_table_cases([planar, spatial]),
        *_option_cases(planar),
    ]
    distinct = {case.key for case in cases}
    print(f"{len(distinct)} cases")
    assert len(distinct) >= _FEWEST
