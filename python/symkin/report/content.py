# SPDX-License-Identifier: MIT
"""What a page is made of, before it is HTML."""

from __future__ import annotations

import base64
import io
from collections.abc import Sequence
from dataclasses import dataclass

from matplotlib.figure import Figure

__all__ = ["Group", "Image", "Section", "Summary", "Table", "image"]

_DOTS_PER_INCH = 160  # of the file
_PIXELS_PER_INCH = 108  # on the page


@dataclass(frozen=True)
class Group:
    """Rows of a table that belong together; the first cell of each is its heading."""

    rows: Sequence[Sequence[str]]
    title: str = ""


@dataclass(frozen=True)
class Table:
    """A table with a caption and a heading above each column.

    Attributes
    ----------
    wordy : bool
        Whether its cells are words, set to the left, rather than numbers.
    """

    caption: str
    columns: Sequence[str]
    groups: Sequence[Group]
    wordy: bool = False


@dataclass(frozen=True)
class Image:
    """A figure as the bytes of a PNG file, with the text for those who cannot see it.

    In `caption`, as in all texts of a page, ``G_M`` is a symbol with a subscript.
    """

    name: str
    alternative: str
    caption: str
    png: bytes
    width: int  # on the page, px

    @property
    def address(self) -> str:
        """The image itself as a data address."""
        return "data:image/png;base64," + base64.b64encode(self.png).decode("ascii")


@dataclass(frozen=True)
class Section:
    """A section of the page: paragraphs, then tables and images in their order."""

    anchor: str
    title: str
    paragraphs: Sequence[str]
    parts: Sequence[Table | Image] = ()

    @property
    def images(self) -> list[Image]:
        """Its images."""
        return [part for part in self.parts if isinstance(part, Image)]


@dataclass(frozen=True)
class Summary:
    """What stands on top of the page.

    Attributes
    ----------
    title, subtitle : str
        Of the page.
    figures : sequence of (label, value, remark)
        The few numbers that matter.
    verdict : {"good", "doubtful", "bad"}
        For the looks; `judgement` says it in words.
    judgement : str
        Whether the estimate converged and can be trusted.
    doubts : sequence of str
        Why not.
    paragraphs : sequence of str
        What was done and what came out.
    """

    title: str
    subtitle: str
    figures: Sequence[tuple[str, str, str]]
    verdict: str
    judgement: str
    doubts: Sequence[str]
    paragraphs: Sequence[str]


def image(figure: Figure, name: str, *, alternative: str, caption: str) -> Image:
    """Draw a figure."""
    buffer = io.BytesIO()
    figure.savefig(buffer, format="png", dpi=_DOTS_PER_INCH)
    width = round(_PIXELS_PER_INCH * figure.get_figwidth())
    return Image(name, alternative, caption, buffer.getvalue(), width)
