"""A robot's methods are the functions of their names, option by option."""

import inspect
import pickle
import runpy
from collections.abc import Callable
from pathlib import Path

import pytest

import symkin
from symkin.model.mechanism import Mechanism

VERBS = {
    "check": symkin.check_mechanism,
    "sample_workspace": symkin.sample_workspace,
    "plan": symkin.plan,
    "simulate": symkin.simulate,
    "identify": symkin.identify,
    "evaluate": symkin.evaluate,
    "run": symkin.run_protocol,
    "save": symkin.save_mechanism,
}


def options(function: Callable) -> dict[str, tuple[object, object]]:
    """Defaults and annotations by name, but of the mechanism."""
    parameters = list(inspect.signature(function).parameters.values())[1:]
    return {each.name: (each.default, each.annotation) for each in parameters}


@pytest.mark.parametrize("verb", VERBS)
def test_a_verb_has_the_options_of_its_function(verb):
    assert options(getattr(symkin.Robot, verb)) == options(VERBS[verb])


def test_no_verb_takes_whatever_it_is_given(paper):
    with pytest.raises(TypeError, match="desing"):
        paper.plan(24, desing="orbits")
    with pytest.raises(TypeError, match="lose"):
        paper.identify(None, lose="huber")


def test_what_is_made_of_a_robot_is_a_robot(paper):
    assert type(paper) is symkin.Robot
    assert type(paper.replace(name="another")) is symkin.Robot
    assert type(paper.with_parameters(paper.parameters)) is symkin.Robot
    simulated = paper.simulate(paper.plan(12), 1)
    assert type(simulated.actual) is symkin.Robot
    assert type(paper.identify(simulated.measurements).mechanism) is symkin.Robot
    assert type(paper.identify(simulated.measurements, shared=["*_length"]).mechanism) is (
        symkin.Robot
    )


def test_a_mechanism_and_its_robot_are_the_same_mechanism(paper):
    plain = Mechanism(**paper.arguments)
    assert plain == paper
    assert paper == plain
    assert hash(plain) == hash(paper)
    robot = symkin.Robot.of(plain)
    assert type(robot) is symkin.Robot
    assert robot == paper
    assert type(pickle.loads(pickle.dumps(robot))) is symkin.Robot


def test_the_script_that_the_type_checker_reads_runs(tmp_path):
    script = runpy.run_path(str(Path(__file__).with_name("typed_script.py")))
    found = script["everything"](tmp_path)
    assert type(found.mechanism) is symkin.Robot
    assert symkin.load_mechanism(tmp_path / "calibrated.toml").deviations is not None
