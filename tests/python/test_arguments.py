"""What public functions take: mechanisms as files, and a sentence for what nothing can be."""

import inspect
import math
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import symkin
from symkin.errors import SymkinError
from symkin.model.settings import ProtocolSettings

FEW = ProtocolSettings(pose_count=10, candidates=200, seed=1)


@pytest.fixture(scope="module")
def given(tmp_path_factory) -> dict[str, Any]:
    """Arguments by name, those that verbs agree in."""
    folder = tmp_path_factory.mktemp("given")
    robot = symkin.load("3RRR").replace(protocol=FEW)
    robot.save(folder / "robot.toml")
    sample = robot.sample_workspace()
    plan = robot.plan(10, candidates=sample)
    simulation = robot.simulate(plan)
    measured = simulation.measurements
    measured.save(folder / "measured.csv", robot)
    symkin.write_plan(plan, folder / "plan.csv", robot)
    (folder / "results.json").write_text("{}")
    return {
        "folder": folder,
        "mechanism": robot,
        "sample": sample.poses,
        "plan": plan,
        "measurements": measured,
        "actual": simulation.actual,
    }


CALLS: dict[str, Callable[[dict[str, Any]], dict[str, Any]]] = {
    "accept": lambda of: {
        "calibrated": of["mechanism"], "measurements": of["measurements"], "tolerance": 1.0,
    },
    "align_frames": lambda of: {"measured": of["sample"][:9], "robot": of["sample"][:9] + 0.01},
    "chain_info": lambda _: {"chain": "[R]RR"},
    "chains": lambda _: {},
    "check_mechanism": lambda of: {"mechanism": of["mechanism"]},
    "compare": lambda of: {
        "first": of["folder"] / "results.json", "second": of["folder"] / "results.json",
    },
    "compare_symmetry": lambda of: {"mechanism": of["mechanism"]},
    "cross_validate": lambda of: {**both(of), "folds": 2},
    "detect_symmetry": lambda of: {"mechanism": of["mechanism"]},
    "evaluate": lambda of: {"model": of["mechanism"], "measurements": of["measurements"]},
    "export": lambda of: {"mechanism": of["mechanism"], "to": "json"},
    "identify": lambda of: both(of),
    "identify_many": lambda of: {**both(of), "measurements": {"one": of["measurements"]}},
    "load": lambda of: {"path_or_name": of["folder"] / "robot.toml"},
    "load_columns": lambda of: {"path": of["folder"] / "robot.toml"},
    "make_plan": lambda of: {"mechanism": of["mechanism"], "candidates": of["sample"]},
    "measure": lambda of: {
        "mechanism": of["mechanism"], "accuracy": 1e-4, "candidates": of["sample"],
    },
    "plan": lambda of: {"mechanism": of["mechanism"], "pose_count": 10},
    "pose_count_curve": lambda of: {
        "mechanism": of["mechanism"], "candidates": of["sample"], "counts": [8, 9],
    },
    "predict_accuracy": lambda of: {
        "mechanism": of["mechanism"], "plan": of["plan"], "workspace": of["sample"],
    },
    "read_estimate": lambda of: {"path": of["folder"] / "results.json"},
    "read_result": lambda of: {"path": of["folder"] / "results.json"},
    "read_measurements": lambda of: {
        "source": of["folder"] / "measured.csv", "mechanism": of["mechanism"],
    },
    "read_plan": lambda of: {"source": of["folder"] / "plan.csv", "mechanism": of["mechanism"]},
    "read_results": lambda of: {"path": of["folder"] / "results.json"},
    "run_protocol": lambda of: {"mechanism": of["mechanism"]},
    "run_study": lambda _: {"definition": "nosuch"},
    "sample_workspace": lambda of: {"mechanism": of["mechanism"], "candidates": 20},
    "save_mechanism": lambda of: {
        "mechanism": of["mechanism"], "path": of["folder"] / "saved.toml", "overwrite": True,
    },
    "select_poses": lambda _: {"rows": np.random.default_rng(1).normal(size=(20, 3)), "count": 6},
    "simulate": lambda of: {"mechanism": of["mechanism"], "plan": of["plan"]},
    "study_workspace": lambda of: {"mechanism": of["mechanism"], "count": 50, "resolution": 9},
    "write_measurements": lambda of: {
        "measurements": of["measurements"], "path": of["folder"] / "w.csv",
        "mechanism": of["mechanism"], "overwrite": True,
    },
    "write_plan": lambda of: {
        "plan": of["plan"], "path": of["folder"] / "wp.csv",
        "mechanism": of["mechanism"], "overwrite": True,
    },
}  # fmt: skip
WITHOUT_ARGUMENTS = {"mechanism_schema", "shipped_mechanisms", "load_mechanism"}


def both(of: dict[str, Any]) -> dict[str, Any]:
    return {"mechanism": of["mechanism"], "measurements": of["measurements"]}


def names_of(verb: str) -> list[str]:
    """Parameters that a wrong value is given for."""
    return [*inspect.signature(getattr(symkin, verb)).parameters]


def test_every_public_function_is_tried():
    functions = {name for name in symkin.__all__ if inspect.isfunction(getattr(symkin, name))}
    assert functions | {"chain_info"} == set(CALLS) | WITHOUT_ARGUMENTS


@pytest.mark.filterwarnings("ignore")
@pytest.mark.parametrize("verb", CALLS)
def test_whatever_is_given_is_taken_or_refused_in_a_sentence(given, verb, monkeypatch):
    monkeypatch.chdir(given["folder"])  # where "nonsense" may be written
    wrong = (
        *(-1, 2.5, math.nan, "nonsense", b"x", object(), [], {}, {"a": 1}, ["x"], [[1.0], [1, 2]]),
        *(np.zeros((2, 2, 2)), np.array("a"), Path("missing.toml"), identify_nothing),
        *(given["mechanism"], given["measurements"], given["plan"]),
    )
    for name in names_of(verb):
        for value in wrong:
            arguments = {"overwrite": True} if "overwrite" in names_of(verb) else {}
            arguments |= {**CALLS[verb](given), name: value}
            error = raised_by(getattr(symkin, verb), arguments)
            said = f"{name}={value!r}: {type(error).__name__}: {error}"
            assert error is None or isinstance(error, SymkinError), said
            assert "\n" not in str(error), said
            assert len(str(error)) < 500, said


def raised_by(function: Callable[..., object], arguments: dict[str, Any]) -> Exception | None:
    try:
        function(**arguments)
    except Exception as error:
        return error
    return None


def identify_nothing(*_: object) -> None:
    """A function, which nothing but progress is told to."""


MECHANISMS = ("mechanism", "model")


@pytest.mark.parametrize("verb", [name for name in CALLS if set(names_of(name)) & set(MECHANISMS)])
def test_a_mechanism_is_given_as_its_file_too(given, verb):
    arguments = CALLS[verb](given)
    (name,) = set(arguments) & set(MECHANISMS)
    made = [
        getattr(symkin, verb)(**{**arguments, name: each})
        for each in (given["mechanism"], given["folder"] / "robot.toml")
    ]
    assert type(made[0]) is type(made[1])
    if hasattr(made[0], "text"):
        numbers = [each.to_dict() for each in made]
        for each in numbers:
            each.pop("seconds", None)
        assert numbers[0].keys() == numbers[1].keys()


def test_what_is_found_of_a_file_has_verbs(given):
    file = str(given["folder"] / "robot.toml")
    found = symkin.identify(file, given["folder"] / "measured.csv")
    assert type(found.mechanism) is symkin.Robot
    alone = given["mechanism"].identify(given["measurements"])
    np.testing.assert_allclose(found.mechanism.parameters, alone.mechanism.parameters, rtol=1e-12)


def test_plans_and_measurements_are_given_as_their_files_too(given):
    robot, folder = given["mechanism"], given["folder"]
    taken = symkin.simulate(robot, folder / "plan.csv", 1, actual=folder / "robot.toml")
    assert taken == symkin.simulate(robot, symkin.read_plan(folder / "plan.csv", robot), 1, robot)
    (folder / "must.csv").write_text("x_mm,y_m,phi_rad\n50,0.02,0\n0,0,0.1\n")
    by_file, by_hand = (
        robot.plan(10, measured=each, required=poses)
        for each, poses in (
            (folder / "measured.csv", folder / "must.csv"),
            (given["measurements"], [[0.05, 0.02, 0], [0, 0, 0.1]]),
        )
    )
    np.testing.assert_allclose(by_file.poses, by_hand.poses, atol=1e-12)


@pytest.mark.parametrize(
    ("call", "words"),
    [
        (lambda of: symkin.identify(of["measurements"], of["mechanism"]), "mechanism is a Measur"),
        (lambda _: symkin.plan(24, "3RRR"), "mechanism is 24; expected a Mechanism"),
        (lambda _: symkin.plan("3RRR", "24"), "pose_count is '24'; expected a whole number"),
        (lambda _: symkin.plan("3RRR", seed=-1), "seed is -1; expected a whole number from 0"),
        (lambda _: symkin.plan("3RRR", seed=1.0), "seed is 1.0; expected a whole number"),
        (lambda of: symkin.simulate("3RRR", of["measurements"]), "is given as the plan"),
        (lambda of: symkin.simulate("hexapod_jugglebot", of["plan"]), "6 and spatial ones"),
        (lambda _: symkin.evaluate("3RRR", poses="a"), "poses is 'a'"),
        (lambda _: symkin.plan("3RRR", avoid="x=1:2"), "avoid is 'x=1:2'; expected a list"),
        (lambda _: symkin.plan("3RR"), 'did you mean "3RRR"'),
    ],
)
def test_what_is_swapped_or_of_another_type_is_named(given, call, words):
    with pytest.raises(SymkinError) as caught:
        call(given)
    assert words in str(caught.value)


def test_a_misspelt_argument_is_a_type_error(given):
    with pytest.raises(TypeError, match="desing"):
        symkin.plan(given["mechanism"], desing="legs")
    with pytest.raises(TypeError, match="shaerd"):
        symkin.plan(given["mechanism"], shaerd=["*_length"])
