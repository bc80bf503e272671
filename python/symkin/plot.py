# SPDX-License-Identifier: MIT
"""The figures of the reports, each a function; `symkin.show.figures` has what is said of all."""

from symkin.show.figures import *  # noqa: F403
from symkin.show.figures import __all__ as __all__
