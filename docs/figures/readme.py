# SPDX-License-Identifier: MIT
"""Writes the pictures of README.md: the mechanism of `make run`, and what the run achieves."""

from pathlib import Path

import matplotlib as mpl

import symkin
from symkin import plot

FOLDER = Path(__file__).parent


def write(figure, name):
    figure.savefig(FOLDER / name, metadata={"Date": None})


if __name__ == "__main__":
    mpl.rcParams["svg.hashsalt"] = "symkin"
    mechanism = symkin.load_mechanism("3RRR")
    result = symkin.run_protocol(mechanism)
    write(plot.mechanism(mechanism).figure, "mechanism.svg")
    write(plot.error_histogram(result.before, result.after), "result.svg")
