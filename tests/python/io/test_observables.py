"""The table of observables is what options, columns, noise and simulation follow from."""

import dataclasses

import numpy as np
import pytest

import symkin
from symkin.analysis.observed import Observed
from symkin.data.measurements import Measurements
from symkin.data.observables import OBSERVABLES, Sizes, words_with
from symkin.model.poses import POSE_SPACES
from symkin.model.settings import Frames, NoiseSettings
from symkin.options import OPTIONS

NOISE = NoiseSettings(position=1e-3, orientation=2e-3, reading=3e-3)
SPACE = POSE_SPACES["spatial"]
SIZES = Sizes(SPACE, legs=6, reading_unit="m", points=2, distances=3, pairs=2)


def test_every_word_of_the_option_is_of_one_observable():
    words = [word for each in OBSERVABLES.values() for word in each.words]
    assert sorted(words) == sorted(OPTIONS["observe"].words)


def test_measurements_hold_every_observable_and_its_deviations():
    names = {each.name for each in dataclasses.fields(Measurements)}
    assert {*OBSERVABLES} <= names
    assert {each.deviations for each in OBSERVABLES.values()} <= names


def test_no_column_is_of_two_observables():
    stems = [
        stem
        for each in OBSERVABLES.values()
        for stem, _ in (*each.columns(SIZES), *each.deviation_columns(SIZES))
    ]
    assert len(set(stems)) == len(stems)
    for each in OBSERVABLES.values():
        if each.numbered:
            pattern = each.numbers(SPACE, "m|mm")
            assert all(pattern.fullmatch(f"{stem}_mm") for stem, _ in each.columns(SIZES))


def test_frames_are_those_that_a_mechanism_has():
    frames = {name for each in OBSERVABLES.values() for name in each.frames}
    of_anchors = {"zeros"}
    assert frames | of_anchors == {each.name for each in dataclasses.fields(Frames)}
    assert words_with("plane") == {"height", "rise"}


@pytest.fixture(scope="module")
def observed():
    """All that can be observed of a robot at once, each row with deviations of its own."""
    robot = symkin.load("hexapod_jugglebot")
    robot = robot.replace(noise=dataclasses.replace(robot.noise, reading=1e-5))
    between = ("separation", "rise", "offset")
    kinds = ("pose", "points", "distance", "height", "attitude", "reported", *between)
    wanted = Observed(
        kinds, points=((0.1, 0, 0), (0, 0.1, 0)), anchors=((1.0, 0, 0), (0, 1.0, 0)), spread=0.2
    )
    plan = robot.plan(12, candidates=300, spares=0)
    taken = symkin.simulate(robot, plan, 1, observe=wanted).measurements
    axes = np.tile([0.6, 0.0, 0.8], (len(taken), 1))
    turned = np.linspace(-0.1, 0.1, len(taken))
    return robot, dataclasses.replace(
        taken, turns=turned, turn_deviations=np.full(len(taken), 1e-4), turn_axes=axes
    )


def test_each_has_the_noise_of_its_row(observed):
    robot, taken = observed
    plain = dataclasses.replace(taken, **{each.deviations: None for each in OBSERVABLES.values()})
    found = plain.standard_deviations(NOISE)
    assert found.keys() == OBSERVABLES.keys()
    for name, each in OBSERVABLES.items():
        assert np.array_equal(
            found[name],
            np.broadcast_to(
                each.noise(NOISE, robot.space, getattr(taken, name)), found[name].shape
            ),
        )
    assert not found["reported"].any()


@pytest.mark.parametrize("name", [*OBSERVABLES])
def test_each_is_written_and_read_by_itself(observed, name, tmp_path):
    robot, taken = observed
    others = {
        field: None
        for each in OBSERVABLES.values()
        if each.name != name
        for field in ((each.name, each.deviations) if each.is_further else (each.deviations,))
    }
    alone = dataclasses.replace(taken, **others)
    alone.save(tmp_path / "table.csv", robot)
    read = symkin.read_measurements(tmp_path / "table.csv", robot)
    for field in (name, OBSERVABLES[name].deviations):
        if getattr(taken, field) is not None:
            np.testing.assert_allclose(getattr(read, field), getattr(taken, field), atol=1e-12)
    assert read.unread == ()


def test_pairs_name_their_other_row_however_a_table_is_sorted(observed):
    robot, taken = observed
    alone = {each.name: None for each in OBSERVABLES.values() if each.is_further}
    alone |= {each.deviations: None for each in OBSERVABLES.values()}
    pairs = dataclasses.replace(taken, **(alone | {"separations": taken.separations}))
    table = dict(pairs.columns(robot))
    order = np.random.default_rng(1).permutation(len(taken))
    read = symkin.read_measurements({name: each[order] for name, each in table.items()}, robot)
    first = read.partner_places[read.partner_places[:, 0] >= 0, 0]
    own = np.flatnonzero(read.partner_places[:, 0] >= 0)
    np.testing.assert_array_equal(order[own], order[first] + 1)
    part = read.subset(own[:3])  # without their other rows
    assert (part.partner_places == -1).all()
    assert len(dataclasses.replace(part, times=np.arange(3.0))) == 3
    assert len(np.unique(read.first_of_block)) == len(taken) // 2


@pytest.mark.parametrize(
    ("changes", "why"),
    [
        ({"row": None}, 'column "row" .number of each row'),
        ({"row": [1, 2, 2, 4]}, 'has 2 in column "row", as another row has'),
        (
            {"pair1_row": [np.nan, 9, np.nan, 3]},
            'has 9 in column "pair1_row"; expected what another',
        ),
        (
            {"pair1_row": [np.nan, 2, np.nan, 3]},
            'has 2 in column "pair1_row"; expected what another',
        ),
        (
            {"pair2_row": [np.nan, 1, np.nan, 3], "pair1_row": None},
            'column "pair2_row" has number 2',
        ),
        ({"pair1_distance_sd_mm": [1, -1, 1, 1]}, "expected 0 or more"),
    ],
)
def test_pairs_that_cannot_be_are_refused_in_a_sentence(changes, why):
    robot = symkin.load("linear_delta")
    readings = robot.inverse_kinematics(np.linspace(0, [0.03] * 3, 4))
    table = {f"psi_{leg + 1}_m": each for leg, each in enumerate(readings.T)}
    table |= {"row": [1, 2, 3, 4], "pair1_row": [np.nan, 1, np.nan, 3]}
    table |= {"pair1_distance_mm": [np.nan, 17.3, np.nan, 17.3]} | changes
    table = {name: np.array(each) for name, each in table.items() if each is not None}
    with pytest.raises(symkin.errors.MeasurementError, match=why):
        symkin.read_measurements(table, robot)
