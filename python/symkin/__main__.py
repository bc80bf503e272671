# SPDX-License-Identifier: MIT
"""``python -m symkin`` is the command line."""

from __future__ import annotations

import importlib
import sys

from symkin.version import version


def main() -> int:
    """Run the command line; which version it is, is said without loading all that it can do."""
    if sys.argv[1:] == ["--version"]:
        sys.stdout.write(f"symkin {version()}\n")
        return 0
    code: int = importlib.import_module("symkin.cli").main()
    return code


if __name__ == "__main__":
    sys.exit(main())
