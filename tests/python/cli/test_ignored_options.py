# SPDX-License-Identifier: MIT
"""No option is passed over in silence: what does not go together is refused, with its name."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest

IDENTIFY = "identify 3RRR {run}/measurements.csv"
EVALUATE = "evaluate 3RRR --measurements {run}/measurements.csv"
PLAN = "plan 3RRR --out {out}"
SIMULATE = "simulate 3RRR --plan {run}/plan.csv --out {out}"
BATCH = "identify-batch 3RRR {run}/measurements.csv"

UNUSED = {
    f"{EVALUATE} --seed 1": "--seed",
    "evaluate 3RRR --actual {run}/actual.toml --plan {run}/plan.csv --seed 0": "--seed",
    "study --show protocols --robots 5": "--show",
    "study --show protocols --mechanism 3RRR": "--show",
    "study --show protocols --accuracy 1mm": "--show",
    "study --show protocols --workers 2": "--show",
    "study --show protocols --scheduler tcp://nobody:1": "--show",
    "study --show protocols --format parquet": "--show",
    "study --show protocols --overwrite": "--show",
    "study --show protocols --json": "--show",
    "study --show protocols paper": "--show",
    "study cost --robots 3 --out {out}": "--robots",
    f"{IDENTIFY} --seed 0": "--cross-validate",
    f"{IDENTIFY} --seed 0 --cross-validate 3 --cross-validate-blocks": "--seed",
    f"{IDENTIFY} --cross-validate-blocks": "--cross-validate",
    f"{IDENTIFY} --loss-per pose": "--loss",
    f"{BATCH} --table parquet": "--out",
    f"{BATCH} --workers 2 --scheduler tcp://nobody:1": "--scheduler",
    f"{BATCH} --workers 2 --threads 2": "--threads",
    f"{PLAN} --columns {{run}}/columns.toml": "--measured",
    f"{PLAN} --time-limit 3": "--method exhaustive",
    f"{PLAN} --design mechanism --no-symmetry": "--no-symmetry",
    f"{PLAN} --design orbits --no-symmetry": "--no-symmetry",
    "plan linear_delta --observe height --no-symmetry --out {out}": "--no-symmetry",
    f"{PLAN} --method all --pose-count 5": "--pose-count",
    f"{PLAN} --method all --spares 5": "--spares",
    f"{PLAN} --method all --minimum-distance 5cm": "minimum distance",
    "run 3RRR --method all --pose-count 5 --out {out}": "--pose-count",
    f"{SIMULATE} --observe readings --base 1,2,0": "--base",
    f"{SIMULATE} --observe readings --target 1,2,0": "--target",
    f"{SIMULATE} --observe position --plane 0,0,0": "--plane",
    f"{SIMULATE} --anchors 0,0": "anchors",
    f"{SIMULATE} --points 0,0": "points",
    "plan linear_delta --observe height --base 0,0,1,0,0,0 --out {out}": "--base",
    "export 3RRR --to json --endstops 1": "endstops",
    "export 3RRR --to json --grid 5": "grid",
    "export 3RRR --to mjcf --nominal 3RRR": "nominal",
    "export hexapod_jugglebot --to linuxcnc --endstops 1": "endstops",
    "--version check 3RRR": "--version",
    "align {run}/measurements.csv --device x_m,y_m --robot x_m,y_m": "column x_m, y_m is",
}


@pytest.mark.parametrize(("line", "word"), UNUSED.items(), ids=UNUSED)
def test_an_option_that_would_change_nothing_is_refused(
    refused: Callable, protocol: Path, tmp_path: Path, line: str, word: str
) -> None:
    out = tmp_path / "out"
    refused(*line.format(run=protocol, out=out).split(), words=word)
    assert not out.exists()
