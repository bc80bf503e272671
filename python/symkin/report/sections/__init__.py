# SPDX-License-Identifier: MIT
"""Sections of the report: each function takes results and returns what the page shows of them."""
