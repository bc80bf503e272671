# SPDX-License-Identifier: MIT
"""Where pages look for the interval."""

from symkin.plot.estimates import INTERVAL as INTERVAL
