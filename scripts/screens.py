# SPDX-License-Identifier: MIT
"""Runs the commands of pages that show what they print, and writes what they print now.

Usage: .venv/bin/python scripts/screens.py [--check] [--beside FOLDER] docs/tutorial.md ...

Commands of a page run one after the other in a folder of their own, which begins with the files of
FOLDER. Of a command that shows nothing, nothing is written; output that is shown in part, with a
line "...", is left to a person and named. With --check pages stay as they are, and the exit code
says whether they are as the commands print now.
"""

import argparse
import os
import re
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

PROGRAM = Path(sys.executable).with_name("symkin")
BLOCK = re.compile(r"(?<=^```console\n)(.*?)(?=^```)", re.MULTILINE | re.DOTALL)


def printed(command: str, folder: Path) -> str:
    """What a command prints in a folder."""
    path = f"{PROGRAM.parent}{os.pathsep}{os.environ['PATH']}"
    done = subprocess.run(
        ["bash", "-c", command], cwd=folder, env={**os.environ, "PATH": path},
        capture_output=True, text=True, check=False,
    )  # fmt: skip
    return done.stdout + done.stderr


def refreshed(block: str, folder: Path) -> str:
    """The block with what its commands print now; symkin's alone are run."""
    parts = re.split(r"^(?=\$ )", block, flags=re.MULTILINE)
    told = []
    for part in parts:
        found = re.match(r"\$ (symkin (?:.*\\\n)*.*\n)", part)
        if not found or "--serve" in found[1]:  # which goes on until Ctrl-C
            told.append(part)
            continue
        now, shown = printed(found[1], folder), part[found.end() :]
        if "..." in shown.splitlines():
            print(f"  in part: {found[1].strip()}")
            told.append(part)
        else:
            empty = "\n" * (len(shown) - len(shown.rstrip("\n")) - 1)
            told.append(part[: found.end()] + (now + empty if shown.strip() else shown))
    return "".join(told)


def main() -> int:
    """Refresh the pages of the command line."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--check", action="store_true")
    parser.add_argument("--beside", type=Path)
    parser.add_argument("pages", type=Path, nargs="+")
    given = parser.parse_args()
    old = []
    for page in given.pages:
        print(page)
        with tempfile.TemporaryDirectory() as folder:
            if given.beside:
                shutil.copytree(given.beside, folder, dirs_exist_ok=True)
            text = page.read_text(encoding="utf-8")
            now = BLOCK.sub(lambda found, at=Path(folder): refreshed(found[1], at), text)
        if now != text:
            old.append(page)
            if not given.check:
                page.write_text(now, encoding="utf-8")
    print("".join(f"as it was: {page}\n" for page in old) or "all as the commands print now")
    return int(given.check and bool(old))


if __name__ == "__main__":
    sys.exit(main())
