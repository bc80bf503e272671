# SPDX-License-Identifier: MIT
"""The report: one HTML page with tables and figures."""

from symkin.report.html import write_identification_report, write_report

__all__ = ["write_identification_report", "write_report"]
