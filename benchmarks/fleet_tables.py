# SPDX-License-Identifier: MIT
"""Reading the measurements of a fleet, beside pandas and pyarrow, in one run.

Usage: OMP_NUM_THREADS=1 .venv/bin/python benchmarks/fleet_tables.py [robots]

3-RRRs with 72 rows each in one table: as CSV with commas, with semicolons and decimal commas, and
as Parquet. Every reader runs three times in processes of its own; the least processor time counts,
and the most memory that it takes beside its modules. symkin's time includes what pandas and pyarrow
do not do: units are told, all cells and rows checked, and the robots taken apart.
"""

import os
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np

import symkin
from symkin.storage.tables import csv_text, write_table

REPETITIONS = 3
SIMULATED = 40  # robots, whose measurements the others have too
_OWN = (
    "import symkin, pyarrow.parquet; from symkin.data.reading import read_fleet; "
    "from symkin.storage.tables import read_table; robot = symkin.load_mechanism('3RRR')|"
)
OWN = {
    "symkin, columns": _OWN + "read_table(path)",
    "symkin, robots": _OWN + "read_fleet(path, robot)",
    "symkin, robots identified": _OWN + "symkin.identify_many(robot, path, threads=1)",
}
PANDAS, ARROW = (
    "import pandas, pyarrow.parquet|pandas.",
    "import pyarrow.csv as csv, pyarrow.parquet|",
)
READERS = {
    "commas.csv": {
        **OWN,
        "pandas": PANDAS + "read_csv(path)",
        "pandas, every digit": PANDAS + "read_csv(path, float_precision='round_trip')",
        "pyarrow": ARROW + "csv.read_csv(path)",
    },
    "semicolons.csv": {
        **OWN,
        "pandas": PANDAS + "read_csv(path, sep=';', decimal=',')",
        "pyarrow": ARROW + "csv.read_csv(path, parse_options=csv.ParseOptions(delimiter=';'), "
        "convert_options=csv.ConvertOptions(decimal_point=','))",
    },
    "fleet.parquet": {
        **OWN,
        "pandas": PANDAS + "read_parquet(path)",
        "pyarrow": ARROW + "pyarrow.parquet.read_table(path)",
    },
}


def processor() -> str:
    """The processor's name."""
    for line in Path("/proc/cpuinfo").read_text().splitlines():
        if line.startswith("model name"):
            return line.partition(":")[2].strip()
    return "unknown processor"


def write_fleet(folder: Path, robots: int) -> None:
    """The same measurements in three files."""
    mechanism = symkin.load_mechanism("3RRR")
    plan = symkin.plan(mechanism)
    made = [symkin.simulate(mechanism, plan, seed=seed) for seed in range(1, SIMULATED + 1)]
    columns = [each.measurements.columns(mechanism) for each in made]
    texts = [csv_text(each).splitlines() for each in columns]
    names = [f"R{robot:06}" for robot in range(1, robots + 1)]
    with (
        (folder / "commas.csv").open("w") as commas,
        (folder / "semicolons.csv").open("w") as other,
    ):
        commas.write(f"robot,{texts[0][0]}\n")
        other.write(f"robot;{texts[0][0]}\n".replace(",", ";"))
        for robot, name in enumerate(names):
            lines = [f"{name},{row}\n" for row in texts[robot % SIMULATED][1:]]
            commas.writelines(lines)
            other.writelines(line.replace(",", ";").replace(".", ",") for line in lines)
    rows = len(texts[0]) - 1
    together = {
        key: np.concatenate([columns[robot % SIMULATED][key] for robot in range(robots)])
        for key in columns[0]
    }
    write_table(folder / "fleet.parquet", {"robot": np.repeat(names, rows).tolist(), **together})


def measured(task: str, path: Path) -> tuple[float, float]:
    """Processor time, s, and memory, MiB."""
    modules, _, call = task.partition("|")
    program = (
        f"import time\n{modules}\n"
        "status = lambda: open('/proc/self/status').read()\n"
        "most = lambda: int(status().partition('VmHWM:')[2].split()[0]) / 1024\n"
        f"path, before, start = {str(path)!r}, most(), time.process_time()\nkept = {call}\n"
        "print(time.process_time() - start, most() - before)"
    )
    told = []
    for _ in range(REPETITIONS):
        run = subprocess.run(
            [sys.executable, "-c", program], capture_output=True, check=True, text=True
        )
        told.append([float(number) for number in run.stdout.split()])
    return min(seconds for seconds, _ in told), max(memory for _, memory in told)


def main(robots: int = 10_000) -> None:
    """Print a row for each file and reader."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        write_fleet(folder, robots)
        print(f"{processor()}, {robots} robots\n\n| file | MB | reader | s | MiB |")
        print("|---|---|---|---|---|")
        for file, readers in READERS.items():
            size = (folder / file).stat().st_size / 1e6
            for reader, task in readers.items():
                seconds, memory = measured(task, folder / file)
                print(f"| {file} | {size:.0f} | {reader} | {seconds:.2f} | {memory:.0f} |")


if __name__ == "__main__":
    os.environ.setdefault("OMP_NUM_THREADS", "1")
    main(*map(int, sys.argv[1:]))
