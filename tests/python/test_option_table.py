"""An option has one name, type, default and check in Python, in files and on the command line."""

import dataclasses
import inspect
from collections.abc import Callable
from typing import Any, Literal, get_args, get_origin

import numpy as np
import pytest
import typer

import symkin
from symkin.cli import app
from symkin.cli.options import Measured
from symkin.errors import SymkinError
from symkin.estimate.fleet import identify_robots
from symkin.estimate.options import EstimateOptions
from symkin.files import mechanism_schema
from symkin.model.settings import IdentificationSettings, NoiseSettings, ProtocolSettings
from symkin.options import OPTIONS
from symkin.options.arguments import hints_of

FUNCTIONS: dict[str, Callable[..., Any]] = {
    name: getattr(symkin, name)
    for name in symkin.__all__
    if inspect.isfunction(getattr(symkin, name))
}
FUNCTIONS |= {"identify_robots": identify_robots}
FUNCTIONS |= {
    f"Robot.{name}": method
    for name, method in inspect.getmembers(symkin.Robot, inspect.isfunction)
    if name in ("check", "sample_workspace", "plan", "simulate", "identify", "run", "save")
}
# Parameters that are something else than the option of their name.
HOMONYMS = {
    ("evaluate", "poses"): "poses",
    ("make_plan", "candidates"): "poses",
    ("pose_count_curve", "candidates"): "poses",
    ("select_poses", "rows"): "rows of numbers",
    ("select_poses", "count"): "how many are selected",
    ("detect_symmetry", "poses"): "poses",
    ("select_poses", "spares"): "poses that may be lost",
    ("identify_robots", "robots"): "the robots themselves",
    ("align_frames", "robot"): "poses that the robot reports",
}
# Of single commands alone, though other commands have an option of that name.
ARGUMENTS = {("kinematics", "table"), ("align", "table"), ("align", "robot"), ("accept", "table")}
# Defaults that a function has for itself, and why.
OWN_DEFAULTS = {
    ("cross_validate", "seed"): "of a function that has no mechanism's protocol to ask",
    ("select_poses", "seed"): "likewise",
    ("select_poses", "time_limit"): "where a plan's None ends",
}
# What is of the command line alone: files, printing, and what Python says by other means.
COMMAND_LINE_ALONE = {
    "mechanism", "out", "as_json", "columns", "help",  # of every command
    "measurements", "files", "file", "name", "show", "result", "version", "debug", "verbose",
    "required", "measured", "avoid", "plan", "actual", "model",  # a file or text for an object
    "sensor_table", "printed", "cross_validate", "cross_validate_blocks", "accuracy",
    "base", "target", "points", "anchors", "plane",  # of an Observed
    "orientations", "forward", "to", "endstops", "nominal", "chain", "legs",
    "device", "host", "port", "serve", "angles", "convention",
    "lost",  # of a simulated device
    "beside", "radius", "body",  # of a log that is imported
    "calibrated", "tolerance", "uncertainty", "about", "first", "second", "devices",
}  # fmt: skip


def parameters() -> list[tuple[str, str, inspect.Parameter]]:
    return [
        (name, each.name, each)
        for name, function in FUNCTIONS.items()
        for each in inspect.signature(function).parameters.values()
        if each.name in OPTIONS
    ]


def words_of(annotation: Any) -> set[str]:
    """All words of literals in an annotation."""
    if get_origin(annotation) is Literal:
        return set(get_args(annotation))
    return set().union(*map(words_of, get_args(annotation))) if get_args(annotation) else set()


@pytest.mark.parametrize(
    ("function", "name", "parameter"),
    [pytest.param(*each, id=".".join(each[:2])) for each in parameters()],
)
def test_a_function_has_the_options_of_the_table(function, name, parameter):
    if (function, name) in HOMONYMS:
        return
    option = OPTIONS[name]
    hints = hints_of(inspect.unwrap(FUNCTIONS[function]))
    if option.words and get_origin(option.kind) is Literal:
        assert set(option.words) <= words_of(hints[name])
    if (function, name) not in OWN_DEFAULTS:
        assert (None if parameter.default == () else parameter.default) == option.default


def commands() -> list[tuple[str, inspect.Parameter]]:
    """Parameters of commands, as typer is given them."""
    return [
        (name, each)
        for name, command in typer.main.get_command(app).commands.items()
        for each in inspect.signature(command.callback).parameters.values()
    ]


@pytest.mark.parametrize(
    ("command", "given"),
    [pytest.param(name, each, id=f"{name} {each.name}") for name, each in commands()],
)
def test_the_command_line_has_the_options_of_the_table(command, given):
    kind, info = get_args(given.annotation)
    if given.name in COMMAND_LINE_ALONE or (command, given.name) in ARGUMENTS:
        assert given.name not in OPTIONS or not info.param_decls
        return
    option = OPTIONS[given.name]
    assert info.help == option.help
    assert all(each.startswith(option.flag) for each in info.param_decls or ())
    assert (float(given.default) if option.unit else given.default) == option.default
    if option.words:
        assert words_of(kind) == set(option.words) or kind == list[str] | None
    if option.kind in (int, float) and not option.unit:
        assert kind in (option.kind, option.kind | None)
        assert (info.min, info.max) == (option.least, option.most)


def test_files_have_the_options_of_the_table():
    for section, settings in (
        (mechanism_schema.IDENTIFICATION, IdentificationSettings),
        (mechanism_schema.PROTOCOL, ProtocolSettings),
    ):
        keys = section.schema["properties"]
        names = {each.name for each in dataclasses.fields(settings)}
        assert set(keys) == names - {"assume"}  # which has a section of its own
        for name, schema in keys.items():
            option = OPTIONS[name]
            own = schema.get("items", schema)
            words = [own["const"]] if "const" in own else own.get("enum", ())
            # Of the noise, whose deviations have a section of their own, one word alone.
            assert tuple(words) == (("estimate",) if name == "noise" else option.words)
            if option.kind is int:
                assert (schema["minimum"], schema["maximum"]) == (option.least, option.most)


def test_what_is_unknown_has_the_same_names_wherever_it_is_said():
    unknown = {each.name for each in dataclasses.fields(IdentificationSettings)}
    assert unknown <= {each.name for each in dataclasses.fields(EstimateOptions)}
    for verb in ("identify", "identify_many", "Robot.identify"):
        assert unknown <= set(inspect.signature(FUNCTIONS[verb]).parameters)


def test_every_option_is_used_by_some_command():
    used = {each.name for _, each in commands()}
    assert set(OPTIONS) <= used


@pytest.mark.parametrize(
    ("name", "wrong", "expected"),
    [
        ("seed", -1, "expected a whole number from 0 to 9223372036854775807"),
        ("seed", 1.5, "expected a whole number"),
        ("seed", True, "expected a whole number"),
        ("seed", np.zeros(2, int), "expected a whole number"),
        ("pose_count", 0, "from 1 to 1000000"),
        ("pose_count", "24", "expected a whole number"),
        ("margin_sigmas", -1.0, "expected a number, 0 or more"),
        ("margin_sigmas", float("nan"), "expected a number"),
        ("symmetry", "no", "expected True or False"),
        ("design", "legz", 'expected "legs", "orbits" or "mechanism"'),
        ("free", 3, "expected a list of texts"),
        ("free", [3], "expected texts in the list"),
        ("frames", ["bas"], 'expected "base", "target"'),
    ],
)
def test_a_value_that_an_option_cannot_have_is_refused(name, wrong, expected):
    with pytest.raises(SymkinError, match=expected):
        OPTIONS[name].check(wrong)


@pytest.mark.parametrize(
    ("name", "right"),
    [
        *(("seed", np.int64(3)), ("seed", None), ("margin_sigmas", 2), ("free", "leg1.*")),
        *(("free", ("a", "b")), ("candidates", np.zeros((3, 3))), ("noise", "estimate")),
    ],
)
def test_a_value_that_an_option_can_have_is_taken(name, right):
    OPTIONS[name].check(right)


def test_the_noise_of_a_command_is_all_that_a_file_may_say_of_it():
    noise = NoiseSettings(2e-5, 3e-5, 4e-5, 5e-6, 6e-5, 7e-6, "z")
    said = [f"{name}={value}" for name, value in vars(noise).items()]
    assert Measured(noise=said).on(symkin.load_mechanism("3RRR")).noise == noise
