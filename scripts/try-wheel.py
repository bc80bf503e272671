# SPDX-License-Identifier: MIT
"""Do what the README promises with the installed package: `symkin run 3RRR`, its Python example.

Usage: python try-wheel.py README.md, from anywhere but the source directory, with a Python into
which the wheel and what it depends on are installed and nothing else. Ends with a traceback where
something fails; prints what it took.
"""

import importlib.util
import re
import subprocess
import sys
import sysconfig
import tempfile
import time
from pathlib import Path

MEGABYTE = 1e6
INSTALLERS = {"pip", "setuptools", "wheel"}


def megabytes(folder: Path) -> float:
    return sum(f.stat().st_size for f in folder.rglob("*") if f.is_file()) / MEGABYTE


def installed() -> dict[str, float]:
    """Megabytes of each package, without what only installs packages."""
    sizes = {}
    for folder in Path(sysconfig.get_paths()["purelib"]).iterdir():
        if folder.is_dir() and not folder.name.startswith((*INSTALLERS, "__")):
            sizes[folder.name] = megabytes(folder)
    return sizes


def seconds(command: list[str], cwd: Path) -> float:
    start = time.perf_counter()
    subprocess.run(command, cwd=cwd, check=True, stdout=subprocess.DEVNULL)
    return time.perf_counter() - start


def import_seconds(module: str, cwd: Path) -> float:
    """The shortest of five times, without the start of the interpreter."""
    code = f"import time; t = time.perf_counter(); import {module}; print(time.perf_counter() - t)"
    return min(
        float(subprocess.check_output([sys.executable, "-c", code], cwd=cwd)) for _ in range(5)
    )


def main(readme: Path) -> None:
    origin = Path(importlib.util.find_spec("symkin").origin)
    if not origin.is_relative_to(sysconfig.get_paths()["purelib"]):
        raise SystemExit(f"symkin is taken from {origin}, which is not installed")
    text = readme.read_text(encoding="utf-8")
    example = re.search(r"^```python\n(.*?)^```", text, re.MULTILINE | re.DOTALL)[1]
    sizes = installed()
    with tempfile.TemporaryDirectory() as folder:
        place = Path(folder)
        run = seconds([sys.executable, "-m", "symkin", "run", "3RRR", "--out", "first"], place)
        if "converged" not in (place / "first" / "results.json").read_text(encoding="utf-8"):
            raise SystemExit("symkin run 3RRR wrote no result")
        print(f"symkin run 3RRR        {run:.1f} s")
        print(f"README's example       {seconds([sys.executable, '-c', example], place):.1f} s")
        alone, package = import_seconds("numpy", place), import_seconds("symkin", place)
        print(f"import symkin          {package:.2f} s, of which numpy {alone:.2f} s")
    largest = ", ".join(
        f"{name} {size:.0f}" for name, size in sorted(sizes.items(), key=lambda i: -i[1])[:4]
    )
    own = sum(size for name, size in sizes.items() if name.startswith("symkin"))
    print(f"installed              {sum(sizes.values()):.0f} MB ({largest}); symkin {own:.1f} MB")


if __name__ == "__main__":
    main(Path(sys.argv[1]))
