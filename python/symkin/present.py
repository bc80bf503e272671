# SPDX-License-Identifier: MIT
"""What a page says, before it is text or HTML; and the one way from a result to its page.

A result is made in rooms that know nothing of pages. `page_of`, `summary_of` and `notebook_of` ask
`symkin.show`, which registers what tells each kind of result, and is loaded when it is first asked.
"""

from __future__ import annotations

import functools
import importlib
import importlib.util
from collections.abc import Callable, Mapping, Sequence
from contextlib import AbstractContextManager
from contextvars import ContextVar
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

from symkin.values import record, set_to

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import FigureBase

Headline = tuple[str, str, str]  # label, value, remark
Verdict = Literal["good", "doubtful", "bad", ""]
Asker = Literal["python", "command"]
_ASKER: ContextVar[Asker] = ContextVar("asker", default="python")
_ALL_FIGURES: ContextVar[bool] = ContextVar("all_figures", default=False)


def asker() -> Asker:
    """Who asks, in whose language remedies are told: a script, or the command line."""
    return _ASKER.get()


def asked_by(who: Asker) -> AbstractContextManager[None]:
    """Tell remedies in the language of another."""
    return set_to(_ASKER, who)


def with_figures(every: bool) -> AbstractContextManager[None]:
    """Draw every figure of pages, also those for details that a good result leaves out."""
    return set_to(_ALL_FIGURES, every or _ALL_FIGURES.get())


@record
class ErrorLine:
    """Errors of the end effector in one line: what a robot was, is, and is said to keep.

    Root mean squares in m or rad, each None where it is not known.
    """

    kind: str  # ``"position"`` in ``"m"``, or ``"orientation"`` in ``"rad"``
    unit: str
    before: float | None = None  # of the robot itself
    after: float | None = None
    expected: float | None = None  # what such robots have afterwards on average,
    bound: float | None = None  # and what so large a share of them is within
    confidence: float = 0.95
    # Before and after as the instrument has them, frames aligned,
    measured: tuple[float, float] | None = None
    instrument: float | None = None  # and what the instrument contributes to that
    aligned: float | None = None  # after the best alignment of the frames; and the largest
    largest: float | None = None


@record
class Group:
    """Rows of a table that belong together; the first cell of each is its heading."""

    rows: Sequence[Sequence[str]]
    title: str = ""


@record
class Table:
    """A table with a caption and a heading above each column."""

    caption: str
    columns: Sequence[str]
    groups: Sequence[Group]
    wordy: bool = False  # whether its cells are words, set to the left, rather than numbers
    brief: bool = False  # whether the command line prints it too
    brief_rows: int = 0  # how many rows of it, 0 for all
    others: str = "more"  # what the rows are that are not printed then
    # A row that is printed in any case: then those are spread evenly that there is room for.
    about: int | None = None


@record
class Image:
    """A figure, drawn when it is needed, with the text for those who cannot see it.

    In `caption`, as in all texts of a page, ``G_M`` is a symbol with a subscript.

    Attributes
    ----------
    details : bool
        Whether it is for the few: the page of a good result has it where all figures are asked
        for, since drawing them takes longer than an estimate.
    """

    name: str
    alternative: str
    caption: str
    draw: Callable[[], FigureBase | Axes]
    details: bool = False


@record
class Movable:
    """A mechanism that the reader of the page can move.

    `data` is what the page's script draws it from, calculated when it is needed.
    """

    name: str
    alternative: str
    caption: str
    data: Callable[[], Mapping[str, Any]]


@record
class Section:
    """A section of the page: paragraphs, then tables and images in their order.

    Attributes
    ----------
    details : bool
        Whether it is for the few: the page shows its title, and the rest at a click.
    """

    anchor: str
    title: str
    paragraphs: Sequence[str] = ()
    parts: Sequence[Table | Image | Movable] = ()
    details: bool = False


@record
class Page:
    """A result, told."""

    title: str  # of the page
    subtitle: str = ""
    errors: Sequence[ErrorLine] = ()  # of the end effector, a line each of position and orientation
    headlines: Sequence[Headline] = ()  # the other few numbers that matter
    verdict: Verdict = ""  # for the looks; `judgement` says it in words
    judgement: str = ""  # whether the result can be trusted
    doubts: Sequence[str] = ()  # why not; and what to know besides
    notes: Sequence[str] = ()
    paragraphs: Sequence[str] = ()  # what was done and what came out
    next_step: str = ""  # what to do now
    # The command that does it, on a line of its own; ``{folder}`` stands for where the result's
    # files are.
    next_command: str = ""
    sections: Sequence[Section] = ()  # the rest, most important first
    # Names of the files that are written beside the page, which links to them.
    files: Sequence[str] = ()
    # What it was made from; the page's foot has their SHA-256.
    inputs: Sequence[tuple[str, Path | bytes]] = ()
    one_page: bool = False  # whether it is set small on paper, to be one sheet

    def __str__(self) -> str:
        """Return title, verdict and the few numbers that matter, a line each."""
        return summary_text(self)


def figures_of(page: Page) -> dict[str, Callable[[], FigureBase | Axes]]:
    """Return what draws each figure of a page, by name."""
    parts = (part for section in page.sections for part in section.parts)
    return {part.name: part.draw for part in parts if isinstance(part, Image)}


def for_details(section: Section) -> Section:
    """The same section, whose figures are for details."""
    parts = [
        replace(each, details=True) if isinstance(each, Image) else each for each in section.parts
    ]
    return replace(section, parts=parts)


def draws(page: Page, image: Image) -> bool:
    """Whether a page has a figure: one for details where there are doubts, or it was asked for."""
    return not image.details or page.verdict != "good" or _ALL_FIGURES.get()


def _load_what_tells(kind: type) -> None:
    """Load the module of `symkin.show` that tells a kind of result, by page or in a notebook.

    First the one that bears the name of the result's own module, since a command asks for one page;
    where that does not tell it, all of them.
    """
    for module in (kind.__module__.rpartition(".")[2], "pages"):
        if all(each.dispatch(kind) is each.dispatch(object) for each in (page_of, notebook_of)):
            name = f"symkin.show.{module}"
            if importlib.util.find_spec(name):
                importlib.import_module(name)


def _teller(function: Any, result: object) -> Any:
    """What a function of this module has registered for a result; None if nothing."""
    _load_what_tells(type(result))
    told = function.dispatch(type(result))
    return None if told is function.dispatch(object) else told


def kinds_told() -> list[type]:
    """The classes that there are pages of."""
    importlib.import_module("symkin.show.pages")
    return [kind for kind in page_of.registry if kind is not object]


@functools.singledispatch
def page_of(result: object) -> Page:
    """Return what there is to say of a result, from which text and HTML are rendered.

    Raises
    ------
    TypeError
        For what has no page.
    """
    told = _teller(page_of, result)
    if told is None:
        raise TypeError(f"there is no page of a {type(result).__name__}")
    page: Page = told(result)
    return page


@functools.singledispatch
def summary_of(result: object) -> Page:
    """Return the top of a result's page, without what takes longer to calculate."""
    told = _teller(summary_of, result)
    page: Page = page_of(result) if told is None else told(result)
    return page


@functools.singledispatch
def notebook_of(result: object) -> str:
    """Return what a notebook shows of an object, HTML."""
    told = _teller(notebook_of, result)
    html: str = _rendering().summary_html(summary_of(result)) if told is None else told(result)
    return html


def page_text(page: Page, *, whole: bool = False, folder: str = "") -> str:
    """Return a page as the command line prints it, whose files are in a folder."""
    text: str = _rendering().page_text(page, whole=whole, folder=folder)
    return text


def summary_text(page: Page) -> str:
    """Return title, verdict and the few numbers that matter, a line each."""
    text: str = _rendering().summary_text(page)
    return text


def write_page(page: Page, path: Path, *, overwrite: bool = False) -> Path:
    """Write a page as an HTML file, whose folder is made if it does not exist, and return it."""
    written: Path = _rendering().write_page(page, path, overwrite=overwrite)
    return written


def _rendering() -> Any:
    return importlib.import_module("symkin.show.rendering")
