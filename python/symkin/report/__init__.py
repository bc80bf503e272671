# SPDX-License-Identifier: MIT
"""What results say: a description of a page, and the page as text and as HTML."""

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from symkin.report.pages import write_identification_report, write_report

__all__ = ["write_identification_report", "write_report"]


def __getattr__(name: str) -> Any:
    """Import the pages, and with them matplotlib, when they are asked for."""
    if name not in __all__:
        raise AttributeError(f"module 'symkin.report' has no attribute {name!r}")
    from symkin.report import pages

    return getattr(pages, name)
