# SPDX-License-Identifier: MIT
"""Run clang-tidy on the sources that changed since they last passed, or whose headers did.

Where sources are compiled several at a time, they are checked so too; those that are compiled for
several kinds of processors once.

Usage: tidy.py BUILD_DIRECTORY SOURCE_DIRECTORY...
"""

import hashlib
import json
import os
import re
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from functools import cache
from pathlib import Path

ROOT = Path.cwd()
INCLUDE = re.compile(r'^#include "([^"]+)"', re.MULTILINE)
PRECOMPILED = re.compile(r"-include (\S+/cmake_pch\.hxx)")
OF_GCC_ALONE = re.compile(r" (?:(?:-m(?:move|store)-max|--param)=\S+|-Wno-maybe-uninitialized)")


@cache
def project_files(source: Path) -> frozenset[Path]:
    """Return the source with all headers of the project that it includes."""
    files = {source}
    for name in INCLUDE.findall(source.read_text(encoding="utf-8")):
        for header in (source.parent / name, ROOT / "cpp" / name):
            if header.is_file():
                files |= project_files(header.resolve())
                break
    return frozenset(files)


def compiled(source: Path) -> list[Path]:
    """Return the sources that are compiled with a source: itself, or those that it gathers."""
    return [file for file in sorted(project_files(source)) if file.suffix == ".cpp"]


def fingerprint(command: str, source: Path) -> str:
    digest = hashlib.sha256(command.encode())
    for file in sorted({ROOT / ".clang-tidy", *project_files(source)}):
        digest.update(file.read_bytes())
    return digest.hexdigest()


def for_clang(command: str, folder: Path) -> str:
    """Leave out GCC's own options, and include copies of precompiled headers.

    Beside the header itself lies what GCC made of it, which Clang refuses.
    """

    def copied(match: re.Match[str]) -> str:
        header = Path(match[1])
        copy = folder / f"{header.parent.name}.hxx"
        copy.write_text(header.read_text(encoding="utf-8"), encoding="utf-8")
        return f"-include {copy}"

    return PRECOMPILED.sub(copied, OF_GCC_ALONE.sub("", command))


def passes(folder: Path, source: Path) -> bool:
    run = subprocess.run(
        ["clang-tidy", "--quiet", "-p", str(folder), str(source)],
        check=False,
        capture_output=True,
        text=True,
    )
    names = " ".join(str(file.relative_to(ROOT)) for file in compiled(source))
    print(f"clang-tidy {names}", "" if run.returncode == 0 else "FAILED")
    if run.returncode != 0:
        print(run.stdout or run.stderr)
    sys.stdout.flush()
    return run.returncode == 0


def main() -> int:
    build = Path(sys.argv[1]).resolve()
    directories = [Path(name).resolve() for name in sys.argv[2:]]
    folder = build / "tidy"
    folder.mkdir(exist_ok=True)
    entries = json.loads((build / "compile_commands.json").read_text(encoding="utf-8"))
    for entry in entries:
        entry["command"] = for_clang(entry["command"], folder)
    (folder / "compile_commands.json").write_text(json.dumps(entries), encoding="utf-8")
    commands = {Path(entry["file"]).resolve(): entry["command"] for entry in entries}
    record = build / "tidy.json"
    passed = json.loads(record.read_text(encoding="utf-8")) if record.exists() else {}
    once = {tuple(compiled(source)): source for source in sorted(commands)}
    wanted = {
        source: fingerprint(commands[source], source)
        for files, source in once.items()
        if any(file.is_relative_to(directory) for directory in directories for file in files)
    }
    stale = [source for source, digest in wanted.items() if passed.get(str(source)) != digest]
    # Those that take longest first, so that no processor waits for another at the end.
    stale.sort(key=lambda source: -sum(file.stat().st_size for file in compiled(source)))
    with ThreadPoolExecutor(os.cpu_count()) as pool:
        results = dict(
            zip(stale, pool.map(lambda source: passes(folder, source), stale), strict=True)
        )
    for source in stale:
        passed.pop(str(source), None)
        if results[source]:
            passed[str(source)] = wanted[source]
    record.write_text(json.dumps(passed), encoding="utf-8")
    print(f"clang-tidy: {len(wanted)} sources, {len(stale)} changed since they last passed")
    return 0 if all(results.values()) else 1


if __name__ == "__main__":
    sys.exit(main())
