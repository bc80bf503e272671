# SPDX-License-Identifier: MIT
from __future__ import annotations

import dataclasses
import math
import tomllib
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

import symkin
from symkin.errors import SymkinError, SymmetryError
from symkin.files.mechanism_writer import save_mechanism
from symkin.files.template import mechanism_template
from symkin.model.mechanism import Leg, Mechanism
from symkin.model.settings import (
    DeclaredSymmetry,
    JointLimits,
    MeasurementColumns,
    NoiseSettings,
    ProtocolSettings,
    Tolerances,
    WorkspaceSettings,
)
from symkin.robot import load_mechanism
from symkin.storage.shipped import shipped_folder
from symkin.storage.toml_file import toml_value

Write = Callable[..., Path]

SETTINGS = (
    "name", "chain", "platform", "reading_unit", "working_modes", "symmetry", "workspace", "noise",
    "tolerances", "protocol", "joint_limits", "measurement_columns",
)  # fmt: skip


def assert_same(a: Mechanism, b: Mechanism) -> None:
    assert np.array_equal(a.parameters, b.parameters)
    for name in SETTINGS:
        assert getattr(a, name) == getattr(b, name), name
    if a.deviations is None or b.deviations is None:
        assert a.deviations is b.deviations
    else:
        assert np.array_equal(a.deviations, b.deviations, equal_nan=True)


def calibrated(nominal: Mechanism, seed: int = 1) -> Mechanism:
    random = np.random.default_rng(seed)
    legs = [
        Leg(
            leg.chain,
            {name: value + 1e-3 * random.normal() for name, value in leg.parameters.items()},
            leg.working_mode,
        )
        for leg in nominal.legs
    ]
    deviations = 1e-5 * random.uniform(size=(len(legs), len(nominal.parameter_names)))
    return nominal.replace(legs=legs, symmetry=None, deviations=deviations, name="calibrated")


@pytest.mark.parametrize("name", ["3RRR", "hexapod_jugglebot"])
def test_a_calibrated_mechanism_reads_back_to_the_same_floats(tmp_path: Path, name: str) -> None:
    mechanism = calibrated(load_mechanism(name))
    save_mechanism(mechanism, tmp_path / "calibrated.toml")
    assert_same(load_mechanism(tmp_path / "calibrated.toml"), mechanism)


@pytest.mark.parametrize("name", ["3RRR", "hexapod_jugglebot"])
def test_a_mechanism_without_a_file_reads_back_too(tmp_path: Path, name: str) -> None:
    mechanism = load_mechanism(name).replace(source=None)
    for index, variant in enumerate((mechanism, calibrated(mechanism))):
        path = tmp_path / f"{index}.toml"
        save_mechanism(variant, path)
        assert_same(load_mechanism(path), variant)


# Points by coordinates come back but for rounding, see test_drawn_points.py.
# Declared legs share numbers, see tests/python/declared.
KNOWN_CHAINS = sorted(path.stem for path in shipped_folder().glob("*.toml"))
POLAR = [name for name in KNOWN_CHAINS if symkin.load_mechanism(name).points is None]


@pytest.mark.parametrize("name", POLAR)
def test_what_was_read_from_a_file_is_all_written_again(tmp_path: Path, name: str) -> None:
    mechanism = load_mechanism(name)
    for index, variant in enumerate((mechanism, calibrated(mechanism))):
        path = tmp_path / f"{index}.toml"
        save_mechanism(variant, path)
        assert_same(load_mechanism(path), variant)
        again = tmp_path / f"{index} again.toml"
        save_mechanism(load_mechanism(path), again)
        assert again.read_bytes() == path.read_bytes()


def test_the_text_explains_itself(tmp_path: Path) -> None:
    save_mechanism(calibrated(load_mechanism("3RRR")), tmp_path / "calibrated.toml")
    text = (tmp_path / "calibrated.toml").read_text()
    assert text.startswith("#:schema mechanism.schema.json\n")
    assert 'chain = "[R]RR"  # joints from base to platform' in text
    assert "working_mode = -1  # sign of (proximal link) x (distal link)" in text
    assert "x = [-0.55, 0.55]  # m\n" in text
    assert "reach_margin = 0.05  # m\n" in text
    for line in text.splitlines():
        if line.startswith(("base_angle", "sensor_offset", "phi")):
            assert line.endswith("  # rad")
    for leg in (1, 2, 3):
        assert f"[[legs]]  # leg {leg}\n" in text
    assert "[symmetry]" not in text


def test_each_parameter_has_its_standard_deviation_beside_it(
    tmp_path: Path, paper: Mechanism
) -> None:
    mechanism = calibrated(paper)
    save_mechanism(mechanism, tmp_path / "calibrated.toml")
    text = (tmp_path / "calibrated.toml").read_text()
    assert mechanism.deviations is not None
    value, deviation = mechanism.parameters[0, 0], mechanism.deviations[0, 0]
    expected = f"proximal_length = {{ value = {value}, standard_deviation = {deviation} }}  # m"
    assert expected in text


def test_the_header_says_where_the_parameters_come_from(tmp_path: Path, paper: Mechanism) -> None:
    path = tmp_path / "calibrated.toml"
    save_mechanism(calibrated(paper), path, header="Estimator: implicit.\nResidual: 0.1 mm rms.")
    assert "\n# Estimator: implicit.\n# Residual: 0.1 mm rms.\n#\n# Lengths" in path.read_text()


def test_the_same_mechanism_gives_the_same_bytes(tmp_path: Path, paper: Mechanism) -> None:
    for name in ("a.toml", "b.toml"):
        save_mechanism(calibrated(paper), tmp_path / name)
    assert (tmp_path / "a.toml").read_bytes() == (tmp_path / "b.toml").read_bytes()


def test_a_mechanism_of_listed_legs_is_changed_leg_by_leg(write: Write, listed_text: str) -> None:
    original = load_mechanism(write(listed_text))
    legs = list(original.legs)
    legs[1] = Leg("[R]RR", {**legs[1].parameters, "platform_angle": -0.41}, 1)
    mechanism = original.replace(legs=legs)
    path = write("", "new.toml")
    save_mechanism(mechanism, path, overwrite=True)
    text = path.read_text()
    assert "platform_angle = -0.41  # rad" in text
    assert "distal_length = { value = 1.7, standard_deviation = 0.0002 }  # m" in text
    assert_same(load_mechanism(path), mechanism)


def test_another_reference_leg_stays_a_reference_leg(tmp_path: Path, paper: Mechanism) -> None:
    from symkin.model.symmetry import generate_legs

    assert paper.symmetry is not None
    reference = Leg("[R]RR", {**paper.legs[0].parameters, "distal_length": 1.6}, -1)
    mechanism = paper.replace(legs=generate_legs(reference, paper.symmetry, 3))
    path = tmp_path / "longer.toml"
    save_mechanism(mechanism, path)
    assert_same(load_mechanism(path), mechanism)
    assert "[[legs]]" not in path.read_text()
    assert "distal_length = 1.6  # m\n" in path.read_text()


def test_changed_settings_replace_those_of_the_template(tmp_path: Path, paper: Mechanism) -> None:
    mechanism = paper.replace(
        workspace=None,
        noise=NoiseSettings(position=2e-4, orientation=1e-4, reading=1e-5),
        joint_limits=JointLimits(-3.0, math.inf),
    )
    path = tmp_path / "changed.toml"
    save_mechanism(mechanism, path)
    assert_same(load_mechanism(path), mechanism)
    text = path.read_text()
    assert "\nposition = 0.0002  # m, standard deviation\norientation = 0.0001  # rad\n" in text
    assert "\nreading = 1e-05  # rad\n" in text
    assert "[workspace]" not in text


def test_a_dropped_symmetry_keeps_equal_legs_in_full(tmp_path: Path, paper: Mechanism) -> None:
    mechanism = paper.replace(symmetry=None)
    save_mechanism(mechanism, tmp_path / "listed.toml")
    assert_same(load_mechanism(tmp_path / "listed.toml"), mechanism)


def test_a_symmetry_that_the_legs_have_lost_is_not_written(
    tmp_path: Path, paper: Mechanism
) -> None:
    mechanism = calibrated(paper).replace(symmetry=DeclaredSymmetry("C3"))
    with pytest.raises(SymmetryError, match="leg"):
        save_mechanism(mechanism, tmp_path / "broken.toml")
    assert not (tmp_path / "broken.toml").exists()


def test_the_file_that_was_read_is_overwritten_only_on_demand(
    write: Write, paper_text: str
) -> None:
    path = write(paper_text)
    mechanism = calibrated(load_mechanism(path))
    with pytest.raises(SymkinError, match="exists"):
        save_mechanism(mechanism, path)
    with pytest.raises(SymkinError, match="exists"):
        save_mechanism(mechanism.replace(source=None), path)
    assert path.read_text() == paper_text
    save_mechanism(mechanism, path, overwrite=True)
    assert_same(load_mechanism(path), mechanism)


def test_a_point_with_a_negative_radius_is_written_as_the_same_point(tmp_path: Path) -> None:
    mechanism = symkin.load_mechanism("3RPR").replace(symmetry=None)
    values = mechanism.parameters.copy()
    values[:, [0, 2]] *= -1
    values[:, [1, 3]] += np.pi
    mechanism = mechanism.with_parameters(values)
    save_mechanism(mechanism, tmp_path / "positive.toml")
    written = load_mechanism(tmp_path / "positive.toml")
    assert (written.parameters[:, [0, 2]] > 0).all()
    poses = symkin.sample_workspace(mechanism, 20, 1).poses
    assert written.inverse_kinematics(poses) == pytest.approx(mechanism.inverse_kinematics(poses))


def test_a_mechanism_whose_file_could_not_be_read_is_not_written(
    tmp_path: Path, paper: Mechanism
) -> None:
    assert paper.workspace is not None
    far = paper.replace(workspace=dataclasses.replace(paper.workspace, home=(50.0, 0.0, 0.0)))
    with pytest.raises(SymkinError, match=r"could not be read: .*far\.toml.*beyond the reach"):
        save_mechanism(far, tmp_path / "far.toml")
    assert list(tmp_path.iterdir()) == []


finite = st.floats(-10, 10).map(lambda value: value + 0.0)
positive = st.floats(1e-6, 10)
deviation = st.one_of(st.just(math.nan), st.floats(0, 1))


_PRINTED = st.characters(codec="utf-8", exclude_categories=("C", "Z"))


@st.composite
def mechanisms(draw: st.DrawFn) -> Mechanism:
    names = symkin.chain_info("U[P]S").parameter_names
    bounded = {"base_radius": positive, "platform_radius": positive, "sensor_gain": positive}
    count = draw(st.integers(6, 7))
    legs = [
        Leg(
            "U[P]S",
            {name: draw(bounded.get(name, finite)) for name in names},
            draw(st.sampled_from([-1, 1])),
        )
        for _ in range(count)
    ]
    deviations = [[draw(deviation) for _ in names] for _ in range(count)]
    lower = tuple(draw(st.floats(-2, 2)) + 0.0 for _ in range(6))
    return Mechanism(
        draw(st.text(min_size=1, max_size=10, alphabet=_PRINTED)),
        legs,
        reading_unit=draw(st.sampled_from(["m", "rad"])),
        deviations=None if np.isnan(deviations).all() else np.array(deviations),
        workspace=WorkspaceSettings(
            lower=lower,
            upper=tuple(value + draw(positive) for value in lower),
            reach_margin=draw(st.none() | positive),
            conditioning_limit=draw(positive),
            characteristic_length=draw(st.one_of(st.none(), positive)),
            home=draw(st.one_of(st.none(), st.just(lower))),
        ),
        noise=NoiseSettings(draw(positive), draw(positive), draw(positive)),
        tolerances=Tolerances(draw(positive), draw(positive), draw(positive)),
        protocol=ProtocolSettings(draw(st.integers(1, 99)), draw(st.integers(1, 99)), 7),
        measurement_columns=MeasurementColumns(
            position=("x", "y", "z"),
            readings=tuple(f"q{leg}" for leg in range(count)),
            rotation_vector=("a", "b", "c"),
            position_unit=draw(st.sampled_from([None, "mm"])),
        ),
    )


@settings(
    max_examples=25, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture]
)
@given(mechanisms())
def test_any_mechanism_reads_back(tmp_path: Path, mechanism: Mechanism) -> None:
    save_mechanism(mechanism, tmp_path / "any.toml", overwrite=True)
    assert_same(load_mechanism(tmp_path / "any.toml"), mechanism)


@pytest.mark.parametrize("key", ["base_radius", "leg1.*", "", "größe", "½", "x-y", 'a "b" \\'])
def test_any_key_of_a_table_reads_back(key: str) -> None:
    assert tomllib.loads(f"table = {toml_value({key: 1})}") == {"table": {key: 1}}


COMMENTED = """\
# Robot 3 of the workshop.
# Moved in May.

schema = 1
name = "mine"
chain = "[R]RR"

# Detached.

# Of the drawing.
[symmetry]  # rev C
group = "C3"
legs = 3

[reference_leg]  # the motor beside the door
working_mode = -1
proximal_length = "0.4 m"  # rev C, #3
distal_length = 0.4
base_radius = "0.5 m"  # my own
base_angle = "210 deg"
platform_radius = "0.12 m"
platform_angle = "270 deg"
# Once calibrated.
sensor_gain = 1
sensor_offset = 0

[workspace]
x = [
  "-0.1 m",  # as far as the table
  # goes
  "0.1 m",
]
y = ["-0.1 m", "0.1 m"]
phi = ["-20 deg", "20 deg"]  # little
# The end.
"""


def saved_again(mechanism: Mechanism, path: Path, header: str = "") -> str:
    save_mechanism(mechanism, path, header=header, overwrite=True)
    assert_same(load_mechanism(path), mechanism)
    return path.read_text()


def test_comments_of_the_user_survive_where_they_stand(write: Write, tmp_path: Path) -> None:
    mechanism = load_mechanism(write(COMMENTED, "mine.toml"))
    text = saved_again(mechanism, tmp_path / "same.toml")
    for part in (
        'written.\n\n# Robot 3 of the workshop.\n# Moved in May.\n\nschema = 1\nname = "mine"\n',
        "\n\n# Detached.\n\n# Of the drawing.\n[symmetry]  # rev C\n",
        "\n[reference_leg]  # the motor beside the door\n",
        "\nproximal_length = 0.4  # m; rev C, #3\n",
        "\nbase_radius = 0.5  # m; my own\n",
        "\n# Once calibrated.\nsensor_gain = 1.0\n",
        "\n# as far as the table\n# goes\nx = [-0.1, 0.1]  # m\n",
        "  # rad; little\n",
    ):
        assert part in text, text
    assert text.endswith("\n\n# The end.\n")


def test_a_comment_that_says_what_symkin_would_is_said_once(tmp_path: Path) -> None:
    begun = tmp_path / "begun.toml"
    begun.write_text(mechanism_template("U[P]S", legs=6))
    text = saved_again(load_mechanism(begun), tmp_path / "same.toml")
    assert "\nworking_mode = 1  # -1 or 1: without meaning: the length is the only root\n" in text
    assert "\npose_count = 24  # for each leg: three times its 8 parameters\n" in text
    assert saved_again(load_mechanism(tmp_path / "same.toml"), tmp_path / "2.toml") == text


def test_a_comment_beside_a_changed_value_says_which_value_it_was(
    write: Write, tmp_path: Path
) -> None:
    mechanism = calibrated(load_mechanism(write(COMMENTED, "mine.toml")))
    first = saved_again(mechanism, tmp_path / "1.toml", "Residual: 0.1 mm.")
    assert '}  # m; was "0.4 m": rev C, #3\n' in first
    assert "\n[[legs]]  # leg 1; the motor beside the door\n" in first
    assert first.endswith("\n\n# The end.\n\n# Detached.\n\n# Of the drawing.\n# rev C\n")
    again = calibrated(load_mechanism(tmp_path / "1.toml"), seed=2)
    second = saved_again(again, tmp_path / "2.toml", "Residual: 0.2 mm.")
    # The first value is what it was said of, and a former header is of the former numbers.
    assert '}  # m; was "0.4 m": rev C, #3\n' in second
    assert "0.1 mm" not in second
    assert second.count("# The end.") == 1


def test_comments_survive_when_a_file_is_replaced_by_what_was_read_from_it(write: Write) -> None:
    path = write(COMMENTED, "mine.toml")
    assert "# Once calibrated." in saved_again(load_mechanism(path), path)


def test_remarks_on_shipped_mechanisms_are_not_made_of_other_robots(tmp_path: Path) -> None:
    mechanism = calibrated(load_mechanism("3RRR"))
    assert "SPDX" not in saved_again(mechanism, tmp_path / "calibrated.toml")
