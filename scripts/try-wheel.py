# SPDX-License-Identifier: MIT
"""Do what the README promises with the installed package: `symkin run 3RRR`, its Python example.

Usage: python try-wheel.py README.md, from anywhere but the source directory, with a Python into
which the wheel and what it depends on are installed and nothing else. Ends with a traceback where
something fails; prints what it took.
"""

import importlib.util
import os
import re
import subprocess
import sys
import sysconfig
import tempfile
import time
from pathlib import Path

INSTALLERS = ("pip", "setuptools", "pkg_resources", "wheel", "_distutils_hack")
IMPORT = """
import time
start, work = time.perf_counter(), time.process_time()
import {}
print(time.perf_counter() - start, time.process_time() - work)
"""


def took(wall: float, work: float) -> str:
    return f"{wall:.2f} s ({work:.2f} s of processor time)"


def installed() -> dict[str, float]:
    """Megabytes of each package with its bytecode, without what only installs packages."""
    sizes = {}
    for folder in Path(sysconfig.get_paths()["purelib"]).iterdir():
        if folder.is_dir() and not folder.name.startswith(INSTALLERS):
            files = (file for file in folder.rglob("*") if file.is_file())
            sizes[folder.name] = sum(file.stat().st_size for file in files) / 1e6
    return sizes


def seconds(command: list[str], cwd: Path) -> str:
    """Of a program that must end well; not every system knows the processor time of another."""
    start, before = time.perf_counter(), os.times()
    subprocess.run(command, cwd=cwd, check=True, stdout=subprocess.DEVNULL)
    after = os.times()
    work = after.children_user + after.children_system
    work -= before.children_user + before.children_system
    return took(time.perf_counter() - start, work)


def import_seconds(module: str, cwd: Path) -> str:
    """The shortest of five times, without the start of the interpreter."""
    code = IMPORT.format(module)
    outputs = [subprocess.check_output([sys.executable, "-c", code], cwd=cwd) for _ in range(5)]
    wall, work = (min(map(float, times)) for times in zip(*map(bytes.split, outputs), strict=True))
    return took(wall, work)


def main(readme: Path) -> None:
    origin = Path(importlib.util.find_spec("symkin").origin)
    if not origin.is_relative_to(sysconfig.get_paths()["purelib"]):
        raise SystemExit(f"symkin is taken from {origin}, which is not installed")
    # An extra, which the README's example must do without.
    if importlib.util.find_spec("matplotlib") is not None:
        raise SystemExit("matplotlib is installed, so that a bare install is not what is tried")
    text = readme.read_text(encoding="utf-8")
    example = re.search(r"^```python\n(.*?)^```", text, re.MULTILINE | re.DOTALL)[1]
    with tempfile.TemporaryDirectory() as folder:
        place = Path(folder)
        run = seconds([sys.executable, "-m", "symkin", "run", "3RRR", "--out", "first"], place)
        if not (place / "first" / "report.html").is_file():
            raise SystemExit("symkin run 3RRR wrote no report.html")
        print(f"symkin run 3RRR        {run}")
        print(f"README's example       {seconds([sys.executable, '-c', example], place)}")
        print(f"import numpy           {import_seconds('numpy', place)}")
        print(f"import symkin          {import_seconds('symkin', place)}")
    sizes = sorted(installed().items(), key=lambda item: -item[1])
    largest = ", ".join(f"{name} {size:.0f}" for name, size in sizes[:5])
    print(f"installed              {sum(size for _, size in sizes):.0f} MB ({largest})")


if __name__ == "__main__":
    main(Path(sys.argv[1]))
