# SPDX-License-Identifier: MIT
"""No array, however wrong, does more than raise: every public callable, in a child process.

A sixth of all changes of a single argument; with SYMKIN_FUZZ_SECONDS all of them, and many at once
for so long, drawn from SYMKIN_FUZZ_SEED.
"""

from __future__ import annotations

import inspect
import json
import os
import pkgutil
import re
import subprocess
import sys
from pathlib import Path

from symkin import _core

FOLDER = Path(__file__).parent
REFERENCE = FOLDER.parents[2] / "docs" / "api"
SECONDS = os.environ.get("SYMKIN_FUZZ_SECONDS", "0")
SEED = os.environ.get("SYMKIN_FUZZ_SEED", "1")
MOST_CRASHES = 20  # named before the rest is left

# They are called through others.
CALLED_BY_OTHERS = {
    "Frame": "_core.fit_jointly",
    "MeasurementSet": "_core.identify",
    "Observed": "_core.fit_jointly",
    "PoseSet": "_core.simulate",
    "SelectionOptions": "_core.select_poses",
    "Setup": "_core.fit_jointly",
    "WorkspaceOptions": "_core.sample_workspace",
}
# What symkin makes for its user, who only reads it.
RESULTS = {
    "Acceptance",
    "AlignedErrors",
    "Alignment",
    "Ask",
    "Assumed",
    "ClosureRows",
    "CommonShare",
    "ConstantOrientation",
    "CostResult",
    "Covariate",
    "CrossValidation",
    "Curve",
    "Estimate",
    "Evaluation",
    "Expected",
    "FittedPrior",
    "Fleet",
    "HomePose",
    "Imported",
    "Influence",
    "Job",
    "Latent",
    "Layout",
    "LegFit",
    "LocalErrors",
    "ModeSlices",
    "Motion",
    "Observability",
    "PaperFindings",
    "PoseAccuracy",
    "PoseCountCurve",
    "SeenPoses",
    "Selection",
    "StudyResult",
    "Survey",
    "SymmetryFrame",
    "WorkspaceSample",
}


def walk(log: Path, first: int) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [sys.executable, FOLDER / "array_walk.py", log, str(first), SEED, SECONDS],
        capture_output=True,
        text=True,
        check=False,
    )


def test_a_wrong_array_gives_a_result_or_a_refusal_and_never_a_crash(tmp_path: Path) -> None:
    failures, count = [], 0
    log, first = tmp_path / "log", 0
    for _ in range(MOST_CRASHES):
        log.unlink(missing_ok=True)
        process = walk(log, first)
        lines = [json.loads(line) for line in log.read_text().splitlines()] if log.exists() else []
        names = {line["number"]: line["name"] for line in lines if "name" in line}
        count += len(names)
        failures += [
            f"{names[line['number']]}: {line['failure']}" for line in lines if line.get("failure")
        ]
        if process.returncode == 0:
            break
        assert names, process.stderr
        first = max(names) + 1
        failures.append(f"{names[first - 1]}: the process ended with {process.returncode}")
    print(f"{count} cases")
    assert not failures, f"{len(failures)} of {count} cases:\n" + "\n".join(failures)
    assert count > 2500


def test_every_public_callable_that_takes_arrays_is_walked() -> None:
    source = (FOLDER / "array_calls.py").read_text()
    missing = [name for name in (*_of_core(), *_of_package()) if f'"{name}' not in source]
    assert [name for name in missing if not _in_a_loop(name, source)] == []


def _of_core() -> list[str]:
    names = []
    for name, each in vars(_core).items():
        arguments = each.__init__.__doc__ if inspect.isclass(each) else each.__doc__
        if "numpy" in str(arguments).split("->")[0]:
            names.append(CALLED_BY_OTHERS.get(name, f"_core.{name}"))
    return names


def _of_package() -> list[str]:
    """What the reference documents, the further names too."""
    names = []
    reference = "".join(page.read_text() for page in sorted(REFERENCE.glob("*.md")))
    documented = set(re.findall(r"^\.\. auto(?:class|function):: (symkin\.\S+)", reference, re.M))
    for path in documented:
        name = path.rpartition(".")[2]
        # A robot is a mechanism, and its verbs are functions with the same options.
        if name in {*RESULTS, "Robot"} or path.startswith("symkin.plot."):
            continue
        each = pkgutil.resolve_name(path)
        if _takes_arrays(each):
            names.append(name)
        if inspect.isclass(each):
            own = name.replace("Kinematics", "Mechanism")  # which has its methods
            names += [
                f"{own}.{method}"
                for method, function in inspect.getmembers(each, inspect.isroutine)
                if not method.startswith("_") and _takes_arrays(function)
            ]
    return names


def _takes_arrays(function: object) -> bool:
    try:
        parameters = inspect.signature(function).parameters.values()  # type: ignore[arg-type]
    except (TypeError, ValueError):
        return False
    return any(re.search("Array", str(parameter.annotation)) for parameter in parameters)


def _in_a_loop(name: str, source: str) -> bool:
    """Names such as those of `for name in ("closure", "linearise")`."""
    return f'"{name.split(".")[-1]}"' in source
