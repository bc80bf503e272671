"""What the rows of a study are, and what is made of them."""

import dataclasses

import numpy as np
import pytest

import symkin
from symkin.study import StudyDefinition, StudyResult, run_study


@pytest.fixture(scope="module")
def compared() -> StudyResult:
    """Two estimators, and one plan of each of two designs."""
    study = StudyDefinition(
        mechanisms=("3RRR",),
        designs=("legs", "mechanism"),
        estimators=("implicit", "joint"),
        candidates=2000,
        evaluation_poses=200,
        robots=60,
    )
    result = run_study(study)
    assert isinstance(result, StudyResult)
    return result


def test_a_row_is_what_the_public_functions_give(compared: StudyResult) -> None:
    name = "3RRR/legs/noise_aware/O1/24/joint/all"
    row = {column: values[5] for column, values in compared.rows(name).items()}
    plan, mechanism = compared.plan(name), compared.plan(name).mechanism
    simulated = symkin.simulate(mechanism, plan, int(row["seed"]))
    found = symkin.identify(mechanism, simulated.measurements, "joint")
    after = symkin.evaluate(found.mechanism, actual=simulated.actual, poses=compared.poses(name))
    assert row["robot"] == 5
    assert row["position_rms_m"] == after.position_rms
    assert row["orientation_max_rad"] == after.orientation_max
    assert row["measured_poses"] == len(simulated.measurements.poses)
    assert row["chi_square_ratio"] == found.chi_square_ratio


def test_all_cells_have_the_same_robots(compared: StudyResult) -> None:
    before = compared.table["position_before_m"].reshape(4, -1)
    assert np.all(before == before[0])
    assert len(set(compared.table["seed"].tolist())) == compared.robots


def test_figures_of_a_cell_are_those_of_its_rows(compared: StudyResult) -> None:
    name = "3RRR/mechanism/noise_aware/O1/24/joint/all"
    rows, summary = compared.rows(name), compared.cells[name]
    assert summary.position.rms == pytest.approx(np.sqrt(np.mean(rows["position_rms_m"] ** 2)))
    assert summary.coverage == pytest.approx(rows["inside_95"].mean())
    predicted = symkin.predict_accuracy(
        compared.plan(name).mechanism, compared.plan(name), compared.poses(name), "joint"
    )
    assert summary.position.predicted == predicted.position
    assert summary.measured_poses == 24


def test_simulations_agree_with_predictions_within_their_own_errors(compared: StudyResult) -> None:
    for summary in compared.cells.values():
        for error in (summary.position, summary.orientation):
            assert abs(error.ratio - 1) < 0.03 + 3 * error.ratio_error
        assert abs(summary.coverage - 0.95) < 0.01 + 3 * summary.coverage_error


def test_an_interval_holds_what_it_should_as_often_as_it_says() -> None:
    from symkin.study.result import root_mean_square

    random = np.random.default_rng(1)
    hits = 0
    for _ in range(1000):
        _, low, high = root_mean_square(np.abs(random.normal(size=100)))
        hits += low <= 1 <= high
    assert 0.92 < hits / 1000 < 0.96


def test_a_paired_comparison_knows_more_than_its_cells(compared: StudyResult) -> None:
    first, second = list(compared.cells)[:2]
    found = compared.compare(first, second)
    cells = compared.cells
    ratio = cells[first].position.rms / cells[second].position.rms
    assert found.position.value == pytest.approx(ratio)
    assert found.position.low < ratio < found.position.high
    unpaired = np.hypot(
        *(np.log(cells[name].position.high / cells[name].position.low) for name in (first, second))
    )
    assert np.log(found.position.high / found.position.low) < unpaired
    same = compared.compare(first, first)
    assert (same.position.value, same.position.low, same.position.high) == (1, 1, 1)


def test_a_cell_that_does_not_exist_names_the_nearest(compared: StudyResult) -> None:
    with pytest.raises(symkin.SymkinError, match='did you mean "3RRR/legs/noise_aware/O1/24/joint'):
        compared.rows("3RRR/legs/noise_aware/O1/24/join/all")


def test_robots_of_other_tolerances_are_not_compared() -> None:
    result = run_study(
        StudyDefinition(
            mechanisms=("5bar",), tolerance_levels=(1, 2), robots=2, candidates=1000,
            evaluation_poses=20,
        )
    )  # fmt: skip
    assert isinstance(result, StudyResult)
    with pytest.raises(symkin.SymkinError, match="have other robots"):
        result.compare(*result.cells)


def test_what_cannot_be_planned_or_measured_is_a_row_that_says_why() -> None:
    result = run_study(
        StudyDefinition(
            mechanisms=("3RRR_asymmetric",),
            cell=(
                {"designs": "orbits"},
                {"designs": "legs", "pose_counts": 3},
                {"designs": "legs", "tolerance_levels": 150},
            ),
            robots=2, candidates=1000, evaluation_poses=20,
        )
    )  # fmt: skip
    assert isinstance(result, StudyResult)
    orbits, few, crooked = result.cells.values()
    assert (orbits.failed, few.failed, crooked.failed) == (2, 2, 2)
    assert all("no orbit" in reason for reason in orbits.failures)
    assert all(reason.startswith("no plan") for reason in few.failures)
    assert any("can take only" in reason for reason in crooked.failures)
    assert np.isnan(orbits.position.rms)
    page = result.text(whole=True)
    assert "robots failed in 3 cells" in page


def test_the_cheapest_protocol_reaches_the_wanted_accuracy_and_the_next_smaller_does_not(
    compared: StudyResult,
) -> None:
    found = compared.for_accuracy(position=5e-5)
    (recommendation,) = found.recommendations
    best, *others = recommendation.protocols
    assert best.enough
    assert best.position < best.position_bound <= 5e-5
    assert all(best.measured_poses <= other.measured_poses for other in others if other.enough)
    plan = symkin.make_plan(
        compared.plan(best.cell.id).mechanism,
        compared.plan(best.cell.id).candidates,
        best.pose_count - 1,
        1,
        design=best.cell.design,
        spares=0,
    )
    fewer = symkin.predict_accuracy(
        plan.mechanism, plan, plan.candidates, best.cell.estimator, poses=best.cell.use
    )
    assert fewer.position_bound > 5e-5
    assert "the cheapest protocol" in found.text(whole=True)
    with pytest.raises(symkin.SymkinError, match="expected a positive one"):
        compared.for_accuracy(position=-1)


def test_the_page_of_cells_is_written_whole(compared: StudyResult, tmp_path: object) -> None:
    page = compared.page()
    assert {section.anchor for section in page.sections} == {"cells"}
    assert "simulated, 95% interval" in compared._repr_html_() or compared.text()
    report = compared.report(tmp_path / "report.html")  # type: ignore[operator]
    text = report.read_text(encoding="utf-8")
    assert "All cells" in text
    assert text.count("<svg") == 1


def test_results_have_a_json_form(compared: StudyResult) -> None:
    document = compared.to_dict()
    assert [cell["cell"]["id"] for cell in document["cells"]] == list(compared.cells)
    assert document["cells"][0]["position_m"]["ratio"] == pytest.approx(1, abs=0.2)
    assert dataclasses.replace(compared) == compared
