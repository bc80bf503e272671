# SPDX-License-Identifier: MIT
"""``python -m symkin`` is the command line."""

from __future__ import annotations

import sys

from symkin.cli import main

if __name__ == "__main__":
    sys.exit(main())
