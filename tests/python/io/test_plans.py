# SPDX-License-Identifier: MIT
from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from symkin.data.measurements import Measurements
from symkin.errors import MeasurementError
from symkin.model.mechanism import Mechanism
from symkin.planning import Plan
from symkin.planning.plan import write_plan
from symkin.planning.plan_files import read_plan


@pytest.fixture
def plan(paper: Mechanism, measured: Measurements) -> Plan:
    return Plan(
        mechanism=paper,
        leg_sets=np.repeat([0, 1, 2], 4),
        order=np.tile([2, 1, 3, 1], 3),
        spare=np.tile([False, False, False, True], 3),
        poses=measured.poses,
        readings=measured.readings,
    )


@pytest.mark.parametrize("name", ["plan.csv", "plan.parquet"])
def test_a_plan_reads_back_to_nanometres_and_nanoradians(
    tmp_path: Path, paper: Mechanism, plan: Plan, name: str
) -> None:
    write_plan(plan, tmp_path / name, paper)
    read = read_plan(tmp_path / name, paper)
    for field in ("leg_sets", "order", "spare"):
        assert np.array_equal(getattr(read, field), getattr(plan, field)), field
    for field in ("poses", "readings"):
        off = np.abs(getattr(read, field) - getattr(plan, field))
        assert 0 < off.max() <= 5.0001e-10, field
    write_plan(read, tmp_path / f"again-{name}", paper)
    assert (tmp_path / f"again-{name}").read_bytes() == (tmp_path / name).read_bytes()


def test_a_plan_has_no_digits_that_no_device_shows(
    tmp_path: Path, paper: Mechanism, plan: Plan
) -> None:
    write_plan(plan, tmp_path / "plan.csv", paper)
    cells = (tmp_path / "plan.csv").read_text().replace("\n", ",").split(",")
    assert max(len(cell.partition(".")[2]) for cell in cells) == 9
    assert not any("e-" in cell or cell == "-0" for cell in cells)


def test_a_plan_names_its_columns_with_units(tmp_path: Path, paper: Mechanism, plan: Plan) -> None:
    write_plan(plan, tmp_path / "plan.csv", paper)
    header = (tmp_path / "plan.csv").read_text().splitlines()[0]
    assert header == "leg,order,role,x_m,y_m,phi_rad,psi_1_rad,psi_2_rad,psi_3_rad"


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("leg,order", "leg,place", 'column "order" .the place in the set. is missing'),
        ("\n2,", "\n5,", 'row 6 has 5 in column "leg", and the mechanism has 3'),
        (",spare,", ",extra,", 'row 5 has "extra" in column "role"; expected primary or spare'),
        ("psi_2_rad", "psi_4_rad", "row 2 has no reading of leg 2"),
        ("phi_rad", "fi_rad", 'column "phi_rad"'),
    ],
)
def test_a_wrong_plan_is_refused_in_words(
    tmp_path: Path, paper: Mechanism, plan: Plan, old: str, new: str, words: str
) -> None:
    path = tmp_path / "plan.csv"
    write_plan(plan, path, paper)
    path.write_text(path.read_text().replace(old, new, 1))
    with pytest.raises(MeasurementError, match=words):
        read_plan(path, paper)


def test_a_plan_of_spares_alone_is_refused(tmp_path: Path, paper: Mechanism, plan: Plan) -> None:
    path = tmp_path / "plan.csv"
    write_plan(plan, path, paper)
    path.write_text(path.read_text().replace("primary", "spare"))
    with pytest.raises(MeasurementError, match="has spares only; expected primary poses"):
        read_plan(path, paper)


def test_the_rows_of_a_leg_come_in_their_order_without_spares(plan: Plan) -> None:
    assert plan.rows_of(1).tolist() == [5, 4, 6]
    assert plan.rows_of_set(1, spare=True).tolist() == [7]
