# SPDX-License-Identifier: MIT
"""``python -m symkin`` is the command line."""

from __future__ import annotations

import gc
import importlib
import os
import sys

from symkin.version import version

_GARBAGE = 100_000  # objects; a command is over before many of them are


def main() -> int:
    """Run the command line; which version it is, is said without loading all that it can do."""
    if sys.argv[1:] == ["--version"]:
        sys.stdout.write(f"symkin {version()}\n")
        return 0
    gc.set_threshold(_GARBAGE)
    # NumPy's own matrices are small here: its threads would wait for each other, and the core has
    # threads of its own.
    if "OMP_NUM_THREADS" not in os.environ:
        os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    commands = importlib.import_module("symkin.cli")
    gc.freeze()  # what has been loaded stays
    try:
        code: int = commands.main()
    finally:
        gc.freeze()  # all goes with the process: Python would look through it three times more
    return code


if __name__ == "__main__":
    sys.exit(main())
