# SPDX-License-Identifier: MIT
"""Whether robots come out as accurate as the first-order prediction promises.

    OMP_NUM_THREADS=1 .venv/bin/python benchmarks/shipped_accuracy.py [ROBOTS] [MECHANISM ...]

For each mechanism (by default every shipped one of known chains) robots with errors and noise as
declared are planned for, measured and identified with `implicit` and `joint` on all poses. A row
prints the end-effector error after calibration, root mean square over robots and 1000 poses of the
workspace, against its prediction before any measurement: for position and orientation together, as
one length.
The ratio has its 95% interval from the scatter of the robots. "before" is the error as drawn, and
"in 95%" the share of the parameters whose 95% interval holds the truth.
"""

import math
import sys
import time

import symkin
from symkin.storage.shipped import shipped_folder
from symkin.study import StudyDefinition

CLOSED_FORM = sorted(path.stem for path in shipped_folder().glob("*.toml"))
_NORMAL_95 = 1.959963984540054


def rows(name: str, robots: int) -> list[str]:
    """Simulate and identify, and return a row an estimator."""
    study = StudyDefinition(
        mechanisms=(name,), estimators=("implicit", "joint"), robots=robots, seed=1
    )
    made = []
    for summary in symkin.run_study(study).cells.values():
        if summary.failed == summary.robots:
            made.append(f"{name:20}{summary.cell.estimator:10}none: {next(iter(summary.failures))}")
            continue
        both = summary.combined
        reach = math.exp(_NORMAL_95 * both.ratio_error / both.ratio)
        interval = f"{both.ratio / reach:.3f} to {both.ratio * reach:.3f}"
        made.append(
            f"{name:20}{summary.cell.estimator:10}{1e3 * both.before:10.3f}"
            f"{1e3 * both.predicted:11.5f}{1e3 * both.rms:11.5f}{both.ratio:8.3f}"
            f"{interval:>18}{summary.coverage:8.1%}{summary.chi_square:7.3f}{summary.failed:8}"
        )
    return made


def main(robots: int, names: list[str]) -> None:
    """Print the rows of all mechanisms."""
    print(f"{robots} robots a row; errors in mm")
    print(
        f"{'mechanism':20}{'estimator':10}{'before':>10}{'predicted':>11}{'simulated':>11}"
        f"{'ratio':>8}{'95% interval':>18}{'in 95%':>8}{'chi2':>7}{'failed':>8}{'s':>6}"
    )
    for name in names:
        start = time.process_time()
        lines = rows(name, robots)
        lines[-1] += f"{time.process_time() - start:6.0f}"
        print("\n".join(lines), flush=True)


if __name__ == "__main__":
    given = sys.argv[1:]
    main(int(given[0]) if given else 200, given[1:] or CLOSED_FORM)
