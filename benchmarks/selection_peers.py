# SPDX-License-Identifier: MIT
"""Pose selection against what else is at hand, on one task in one run.

Usage: OMP_NUM_THREADS=1 .venv/bin/python benchmarks/selection_peers.py [candidates] [repetitions]

24 poses of 30 000 candidates for a leg of the 3-RRR, rows of kind "paper", one thread. Prints the
median time, det(C'C)^(1/8) of the poses, their efficiency against the bound for distinct poses, and
the time in units of symkin's exchange. pyDOE3 takes part if it is installed (the extra "bench"),
AlgDesign if R is there with this package, which neither PyPI nor Debian has.
"""

import importlib.util
import shutil
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
from numpy.typing import NDArray

import symkin
from symkin.analysis.observability import observability_rows

COUNT = 24
STARTS = 10
Array = NDArray[np.float64]


class Design:
    """Chosen rows, the inverse of their information and every row's variance, by rank one."""

    def __init__(self, rows: Array, chosen: NDArray[np.intp]) -> None:
        self.rows, self.chosen = rows, chosen
        self.inverse = np.linalg.inv(rows[chosen].T @ rows[chosen])
        self.variance = np.einsum("ij,ij->i", rows @ self.inverse, rows)

    def exchange(self, place: int, candidate: int) -> None:
        for row, sign in ((self.rows[candidate], 1), (self.rows[self.chosen[place]], -1)):
            u = self.inverse @ row
            scale = sign / (1 + sign * (row @ u))
            self.inverse -= scale * np.outer(u, u)
            self.variance -= scale * (self.rows @ u) ** 2
        self.chosen[place] = candidate

    def ratios(self, places: NDArray[np.intp]) -> Array:
        """Of the determinants after and before each exchange, shape (places, n)."""
        leaving = self.chosen[places]
        cross = (self.rows[leaving] @ self.inverse) @ self.rows.T
        ratios = (1 - self.variance[leaving])[:, None] * (1 + self.variance) + cross**2
        ratios[:, self.chosen] = 0
        return ratios


def best_pairs(design: Design) -> None:
    """Fedorov (1972): the best of all exchanges, again and again."""
    every = np.arange(len(design.chosen))
    while True:
        ratios = design.ratios(every)
        place, candidate = np.unravel_index(np.argmax(ratios), ratios.shape)
        if ratios[place, candidate] < 1 + 1e-9:
            return
        design.exchange(int(place), int(candidate))


def best_candidates(design: Design) -> None:
    """Cook and Nachtsheim (1980): for each pose in turn the best that may take its place."""
    improved = True
    while improved:
        improved = False
        for place in range(len(design.chosen)):
            ratios = design.ratios(np.array([place]))[0]
            candidate = int(np.argmax(ratios))
            if ratios[candidate] > 1 + 1e-9:
                design.exchange(place, candidate)
                improved = True


def numpy_fedorov(rows: Array, descend: Callable[[Design], None]) -> NDArray[np.intp]:
    """The best of ten random starts."""
    generator = np.random.default_rng(1)
    found = []
    for _ in range(STARTS):
        design = Design(rows, generator.choice(len(rows), COUNT, replace=False))
        descend(design)
        found.append(design.chosen)
    return max(found, key=lambda chosen: log_det(rows[chosen]))


def pydoe(rows: Array) -> NDArray[np.intp]:
    """Exchange of pyDOE3, which adds a constant column itself, as the sensor offset's column is."""
    from pyDOE3.doe_optimal.optimal import optimal_design

    factors = rows[:, :-1] - rows[:, :-1].mean(axis=0)
    # Uncorrelated factors of variance one: it tells better from worse by absolute differences.
    factors = np.linalg.solve(np.linalg.cholesky(np.cov(factors.T)), factors.T).T
    design, _ = optimal_design(factors, COUNT, degree=1, method="simple_exchange")
    return np.array([np.argmin(((factors - point) ** 2).sum(axis=1)) for point in design])


ALG_DESIGN = """
library(AlgDesign)
rows <- as.data.frame(matrix(readBin("rows.bin", "double", {size}), ncol = {columns}, byrow = TRUE))
set.seed(1)
begin <- proc.time()
found <- optFederov(~ . - 1, rows, nTrials = {count}, nRepeats = {starts})
cat((proc.time() - begin)[["elapsed"]], found$rows)
"""


def alg_design(rows: Array) -> tuple[float, NDArray[np.intp]]:
    with TemporaryDirectory() as folder:
        rows.tofile(Path(folder) / "rows.bin")
        script = ALG_DESIGN.format(
            size=rows.size, columns=rows.shape[1], count=COUNT, starts=STARTS
        )
        answer = subprocess.run(
            ["Rscript", "-e", script], cwd=folder, check=True, capture_output=True, text=True
        ).stdout.split()
    return float(answer[0]), np.array(answer[1:], dtype=np.intp) - 1


def has_alg_design() -> bool:
    if shutil.which("Rscript") is None:
        return False
    script = "quit(status = !requireNamespace('AlgDesign', quietly = TRUE))"
    return subprocess.run(["Rscript", "-e", script], check=False).returncode == 0


def log_det(rows: Array) -> float:
    return float(np.linalg.slogdet(rows.T @ rows)[1])


def timed(
    method: Callable[[Array], NDArray[np.intp]], rows: Array, repetitions: int
) -> tuple[float, NDArray[np.intp]]:
    times = []
    for _ in range(repetitions):
        begin = time.perf_counter()
        chosen = method(rows)
        times.append(time.perf_counter() - begin)
    return float(np.median(times)), chosen


def main(candidates: int, repetitions: int) -> None:
    mechanism = symkin.load_mechanism("3RRR")
    poses = symkin.sample_workspace(mechanism, candidates).poses
    rows = observability_rows(mechanism, 0, poses)
    few = max(1, repetitions // 5)

    def exchange(rows: Array) -> NDArray[np.intp]:
        return symkin.select_poses(rows, COUNT, threads=1).indices

    def active(rows: Array) -> NDArray[np.intp]:
        return symkin.select_poses(rows, COUNT, method="sun_hollerbach", threads=1).indices

    results = {
        "symkin exchange": timed(exchange, rows, 5 * repetitions),
        "symkin sun_hollerbach, 10 starts": timed(active, rows, repetitions),
        "NumPy Fedorov, best pair, 10 starts": timed(
            lambda rows: numpy_fedorov(rows, best_pairs), rows, few
        ),
        "NumPy Fedorov, pose by pose, 10 starts": timed(
            lambda rows: numpy_fedorov(rows, best_candidates), rows, few
        ),
    }
    if importlib.util.find_spec("pyDOE3") is None:
        print("pyDOE3 is not installed: left out")
    else:
        results["pyDOE3 simple exchange"] = timed(pydoe, rows, 1)
    if has_alg_design():
        results["R AlgDesign optFederov, 10 starts"] = alg_design(rows)
    else:
        print("R with AlgDesign is not installed: left out")

    certificate = symkin.select_poses(rows, COUNT).certificate
    best = results["symkin exchange"]
    log_bound = log_det(rows[best[1]]) / 8 - np.log(certificate.efficiency)
    print(f"{candidates} candidates, {COUNT} poses, median of up to {5 * repetitions} runs")
    print(f"{'':40} {'time':>10} {'det^(1/8)':>10} {'efficiency':>11} {'time ratio':>11}")
    for name, (seconds, chosen) in results.items():
        value = log_det(rows[chosen]) / 8
        print(
            f"{name:40} {1e3 * seconds:7.1f} ms {np.exp(value):10.6f}"
            f" {np.exp(value - log_bound):11.5f} {seconds / best[0]:11.1f}"
        )


if __name__ == "__main__":
    arguments = [int(text) for text in sys.argv[1:]] + [30_000, 5][len(sys.argv) - 1 :]
    main(*arguments)
