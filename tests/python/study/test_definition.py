"""What a study's file may say, and what it stands for."""

import pickle
from collections.abc import Callable
from pathlib import Path

import pytest

import symkin
from symkin.study import StudyDefinition, builtin_studies, builtin_text, load_study


@pytest.fixture
def written(tmp_path: Path) -> Callable[[str], Path]:
    """Write a study's file."""

    def written(text: str) -> Path:
        path = tmp_path / "mine.toml"
        path.write_text(text, encoding="utf-8")
        return path

    return written


def test_lists_expand_to_their_product_in_a_fixed_order() -> None:
    study = StudyDefinition(
        mechanisms=("3RRR", "5bar"), designs=("legs", "orbits"), estimators=("implicit", "joint")
    )
    assert [cell.id for cell in study.cells] == [
        f"{mechanism}/{design}/noise_aware/O1/{count}/{estimator}/all"
        for mechanism, count in (("3RRR", 24), ("5bar", 18))
        for design in ("legs", "orbits")
        for estimator in ("implicit", "joint")
    ]


def test_cells_are_products_of_their_own_with_the_lists_of_the_study_for_the_rest() -> None:
    study = StudyDefinition(
        mechanisms=("3RRR",),
        pose_counts=(12, 24),
        cell=(
            {"designs": "mechanism", "estimators": "joint"},
            {"id": "paper", "rows": "paper", "pose_counts": 24, "margin_sigmas": 0},
        ),
    )
    assert [cell.id for cell in study.cells] == [
        "3RRR/mechanism/noise_aware/O1/12/joint/all",
        "3RRR/mechanism/noise_aware/O1/24/joint/all",
        "paper",
    ]
    assert study.cells[-1].margin_sigmas == 0
    assert study.cells[-1].rows == "paper"


def test_names_of_cells_say_what_is_unusual() -> None:
    (cell,) = StudyDefinition(
        mechanisms=("3RRR",), methods=("random",), use_symmetry=(False,), margin_sigmas=(0,),
        losses=("huber",), noise_levels=(2,), tolerance_levels=(0.5,),
    ).cells  # fmt: skip
    assert cell.id.endswith("/random/each-leg/margin-0/huber/noise-2/tolerance-0.5")


def test_pose_counts_may_be_multiples_of_the_number_of_parameters() -> None:
    study = StudyDefinition(mechanisms=("3RRR", "5bar"), pose_counts=("1.5p", "3p"))
    assert [cell.pose_count for cell in study.cells] == [12, 24, 9, 18]


def test_parameters_that_are_held_need_no_poses() -> None:
    delta = symkin.load_mechanism("linear_delta")
    assert len(delta.legs[0].parameters) == 9
    assert delta.estimated_counts == (7, 7, 7)
    (cell,) = StudyDefinition(mechanisms=(delta,), pose_counts=("3p",)).cells
    assert cell.pose_count == 21


@pytest.mark.parametrize("name", builtin_studies())
def test_built_in_studies_can_be_loaded_and_copied(name: str, tmp_path: Path) -> None:
    assert load_study(name).cells
    if "mechanisms/" not in builtin_text(name):
        copy = tmp_path / f"{name}.toml"
        copy.write_text(builtin_text(name), encoding="utf-8")
        assert load_study(copy).digest == load_study(name).digest


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ('mechanism = ["3RRR"]', ["mine.toml:1: mechanism: unknown key", '"mechanisms"']),
        ("robots = 3", ["mechanisms: this key is missing"]),
        ('mechanisms = ["3RRR"]\ndesigns = ["orbit"]', [":2: designs", "'orbit'", '"orbits"']),
        ('mechanisms = ["3RRR"]\n\nrobots = 0', [":3: robots", "greater than or equal to 1"]),
        ('mechanisms = ["3RRR"]\nnoise_levels = [0]', [":2: noise_levels", "positive"]),
        ('mechanisms = ["3RRR"]\npose_counts = ["3q"]', [":2: pose_counts", '"3p"']),
        ('mechanisms = ["3RRR"]\nuse = ["all", "all"]', [":2: use", "twice"]),
        ('mechanisms = ["3RRR"]\n[[cell]]\nloss = ["none"]', [":3: cell[1].loss", '"losses"']),
        (
            'mechanisms = ["3RRR"]\n[[cell]]\nid = "a"\nrows = ["paper", "noise_aware"]',
            ['"a" names 2 combinations'],
        ),
        ('mechanisms = ["3RRR"]\n[[cell]]\n[[cell]]', ["two cells", "each combination once"]),
        ('mechanisms = ["3RRR"]\nkind = "cots"', [":2: kind", '"cost"']),
        ('mechanisms = ["4RR"]', ["4RR", '"4RRR"']),
        (
            'mechanisms = ["3RRR"]\nkind = "cost"\ndesigns = ["legs"]',
            [":3: designs: changes nothing in a study of cost"],
        ),
        ('mechanisms = ["3RRR"]\nkind = "cost"\n[[cell]]', [":3: cell: changes nothing"]),
        (
            'mechanisms = ["3RRR"]\nkind = "cost"\npose_counts = [9, 10]',
            [":3: pose_counts: has 2 values"],
        ),
        ('mechanisms = ["3RRR"]\nrepetitions = 3', ["study of accuracy"]),
        ('mechanisms = ["3RRR"]\nreading_noises = [1e-5]', ["study of accuracy"]),
    ],
)
def test_a_wrong_study_is_refused(
    written: Callable[[str], Path], text: str, words: list[str]
) -> None:
    with pytest.raises(symkin.SymkinError) as caught:
        load_study(written(text))
    assert all(word in str(caught.value) for word in words), str(caught.value)


def test_a_misspelt_study_names_the_nearest_one() -> None:
    with pytest.raises(symkin.errors.StudyFileError, match='did you mean "protocols"'):
        load_study("protocol")


def test_a_wrong_definition_in_python_names_the_argument() -> None:
    with pytest.raises(symkin.SymkinError, match=r"criteria\[1\]: is 'O7'; expected 'O1'"):
        StudyDefinition(mechanisms=("3RRR",), criteria=("O7",))  # type: ignore[arg-type]
    with pytest.raises(symkin.SymkinError, match="robots: changes nothing in a study of cost"):
        StudyDefinition(mechanisms=("3RRR",), kind="cost", robots=20)


def test_a_mechanism_file_is_looked_for_beside_the_study(
    written: Callable[[str], Path], paper: symkin.Mechanism
) -> None:
    study = written('mechanisms = ["robot.toml"]')
    symkin.save_mechanism(paper.replace(name="robot"), study.parent / "robot.toml")
    assert list(load_study(study).loaded) == ["robot"]


def test_two_mechanisms_of_one_name_are_refused(paper: symkin.Mechanism) -> None:
    other = paper.replace(noise=symkin.model.settings.NoiseSettings(1e-3))
    with pytest.raises(symkin.SymkinError, match='two have the name "3RRR"'):
        _ = StudyDefinition(mechanisms=(paper, other)).cells


def test_the_digest_tells_what_changes_rows_and_nothing_else(paper: symkin.Mechanism) -> None:
    study = StudyDefinition(mechanisms=(paper,))
    assert study.replace(robots=5, title="Another").digest == study.digest
    noisier = paper.replace(noise=symkin.model.settings.NoiseSettings(1e-3))
    for other in (
        study.replace(seed=2),
        study.replace(estimators=("joint",)),
        study.replace(evaluation_poses=7),
        study.replace(mechanisms=(noisier,)),
    ):
        assert other.digest != study.digest


def test_a_definition_can_be_pickled() -> None:
    study = load_study("symmetry")
    assert pickle.loads(pickle.dumps(study)).cells == study.cells
