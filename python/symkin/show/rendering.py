# SPDX-License-Identifier: MIT
"""A page as text, and as HTML: one file that needs no other."""

from __future__ import annotations

import base64
import hashlib
import io
import json
import os
import re
import shutil
import sys
import textwrap
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from datetime import UTC, datetime
from importlib.util import find_spec
from itertools import zip_longest
from pathlib import Path
from typing import TYPE_CHECKING, Any, cast
from unicodedata import east_asian_width

from markupsafe import Markup, escape

from symkin.present import ErrorLine, Group, Headline, Image, Movable, Page, Table, draws
from symkin.shell import typed_word
from symkin.show.theme import THEME, point_names
from symkin.show.wording import bare, milli, percent, plural, small
from symkin.storage.output_files import OutputFiles
from symkin.storage.templates import templates_of
from symkin.version import version

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_PIPE_WIDTH = 80
_LEAST_REMARK = 24  # characters
_SCREEN = 25  # lines of a first screen
_SHORT = 30  # characters of a caption that heads a column
_SHORT_NOTE = 3  # lines
_LEAST_ROWS = 3  # of a table that is cut
_TYPED = str.maketrans({"\N{NO-BREAK SPACE}": " ", "\N{MINUS SIGN}": "-", "\N{EN DASH}": "-"})


def summary_text(page: Page) -> str:
    """Return title, verdict and the few numbers that matter, a line each."""
    lines = [page.title]
    lines += [page.judgement] if page.judgement else []
    lines += [f"  {label}: {value}" for label, value, _ in headlines_of(page)]
    lines += [f"  Doubt: {doubt}" for doubt in page.doubts]
    return typed("\n".join(lines))


def headlines_of(page: Page) -> list[Headline]:
    """The few numbers of a page, each with its label and a remark."""
    return [*map(_error_headline, page.errors), *page.headlines]


def _error_headline(each: ErrorLine) -> Headline:
    """An error as a headline: before and after, and what may be relied on."""
    after = each.expected if each.after is None else each.after
    told = [milli(value, each.unit) for value in (each.before, after) if value is not None]
    remarks = [
        (f"within {{}} in {percent(each.confidence)} of robots", each.bound),
        ("{} expected", None if each.after is None else each.expected),
        ("{} with frames aligned", each.aligned),
        ("at most {}", each.largest),
        ("the instrument: {}", each.instrument),
    ]
    if each.measured is not None:
        old, new = (milli(value, each.unit) for value in each.measured)
        told = told or [old, new]
        remarks.insert(2, (f"{old} \N{RIGHTWARDS ARROW} {new} as measured", 0.0))
    remark = "; ".join(
        words.format(milli(value, each.unit)) for words, value in remarks if value is not None
    )
    return f"{each.kind.capitalize()} error, rms", " \N{RIGHTWARDS ARROW} ".join(told), remark


def page_text(page: Page, *, whole: bool = False, folder: str = "") -> str:
    """Return what the command line prints: a first screen of at most 25 lines.

    That is the verdict, errors and the few numbers that matter, the brief tables and what to know
    besides as far as there is room, and what to do next. The `whole` page has all of it, with its
    paragraphs and tables. Sentences are filled to the terminal's width; commands stay on one line,
    so that they can be pasted.
    """
    top = [filled(each) for each in (page.title, page.subtitle, page.judgement) if each]
    doubts = [filled(f"Doubt: {doubt}") for doubt in page.doubts]
    notes = [filled(f"Note: {note}") for note in page.notes]
    figures = [each for each in (_errors(page.errors), _headlines(page.headlines)) if each]
    end = _next(page, folder)
    if whole:
        blocks = ["\n".join([*top, *doubts]), *figures]
        for section in page.sections:
            tables = [table_text(part) for part in section.parts if isinstance(part, Table)]
            blocks += ["\n".join([section.title.upper(), *map(filled, section.paragraphs)])]
            blocks += tables
        return _joined([*blocks, "\n".join(notes), end])
    brief = [
        part
        for section in page.sections
        for part in section.parts
        if isinstance(part, Table) and part.brief
    ]
    written = _height(files_text(page.files)) + 1 if page.files else 0
    room = _SCREEN - written - sum(map(_height, [*top, *figures, end]))
    room -= len(figures) + bool(end)  # empty lines
    told, left = _fitting(doubts, room - 2 * bool(brief or notes), least=1)
    room -= sum(map(_height, told))
    blocks, more = ["\n".join([*top, *told]), *figures], [plural(left, "doubt")] * bool(left)
    others = 2 * (len(notes) > 1 or len(brief) > 1 or bool(left))  # of which a line tells
    if notes and _height(notes[0]) <= _SHORT_NOTE:
        others += _height(notes[0]) + 2  # before the last rows of a table
    for at, table in enumerate(brief):
        text = _cut(table, room - 1 - others)
        if not text:
            more.append(plural(len(brief) - at, "table"))
            break
        blocks.append(text)
        room -= _height(text) + 1
    told, left = _fitting(notes, room - 2)
    more += [plural(left, "note")] * bool(left)
    hint = f"--verbose has {' and '.join(more)} more" if more else ""
    return _joined([*blocks, "\n".join([*told, hint] if hint else told), end])


def _joined(blocks: Iterable[str]) -> str:
    return typed("\n\n".join(each for each in blocks if each))


def _height(text: str) -> int:
    return text.count("\n") + 1 if text else 0


def _fitting(texts: Sequence[str], room: int, *, least: int = 0) -> tuple[list[str], int]:
    """The first texts that there is room for, so many at least; and how many are left."""
    told: list[str] = []
    for text in texts:
        room -= _height(text)
        if room < 0 and len(told) >= least:
            break
        told.append(text)
    return told, len(texts) - len(told)


def _errors(errors: Sequence[ErrorLine]) -> str:
    """Errors as aligned columns, of which those are left out that nothing is known of."""
    if not errors:
        return ""
    arrow = "\N{RIGHTWARDS ARROW}"
    alone = all(each.before is None for each in errors)
    share = percent(errors[0].confidence)
    columns = {
        "before": [bare(each.before, each.unit) for each in errors],
        "after" if not alone else "error": [bare(each.after, each.unit) for each in errors],
        "expected": [bare(each.expected, each.unit) for each in errors],
        f"{share} within": [bare(each.bound, each.unit) for each in errors],
        "aligned": [bare(each.aligned, each.unit) for each in errors],
        "largest": [bare(each.largest, each.unit) for each in errors],
        "as measured": [
            f" {arrow} ".join(bare(value, each.unit) for value in each.measured or ())
            for each in errors
        ],
        "instrument": [bare(each.instrument, each.unit) for each in errors],
    }
    known = {name: cells for name, cells in columns.items() if any(cells)}
    rows = [
        [f"{each.kind.capitalize()}, {small(each.unit)[1]}", *(known[name][at] for name in known)]
        for at, each in enumerate(errors)
    ]
    return _grid(["End effector, rms", *known], rows, 1)


def _headlines(headlines: Sequence[Headline]) -> str:
    """Label, value and remark in columns; a remark that is too long goes on below itself."""
    if not headlines:
        return ""
    first, second = (max(len(each[column]) for each in headlines) for column in (0, 1))
    indent = first + second + 4
    lines = []
    for label, value, remark in headlines:
        width = max(_width() - indent, _LEAST_REMARK)
        folded = textwrap.wrap(remark, width, break_on_hyphens=False) or [""]
        lines.append(f"{label:<{first}}  {value:<{second}}  {folded[0]}".rstrip())
        lines += [" " * indent + more for more in folded[1:]]
    return "\n".join(lines)


def files_text(names: Sequence[str], folder: str = "") -> str:
    """Return what is said of files that were written, the last on a line of its own."""
    *others, last = names
    beside = filled(f"Beside it: {', '.join(others)}") + "\n" if others else ""
    return f"{beside}{Path(folder) / last}"


def command_text(page: Page, folder: str = "") -> str:
    """Return the command that a page proposes, with the folder of its files."""
    return _IN_FOLDER.sub(
        lambda found: typed_word(f"{folder or 'DIR'}{found[1]}"), page.next_command
    )


def _next(page: Page, folder: str) -> str:
    """What to do now: a sentence, and the command to paste."""
    if not page.next_command:
        return filled(f"Next: {page.next_step}") if page.next_step else ""
    command = command_text(page, folder)
    if not page.next_step:
        return f"Next: {command}"
    return f"{filled(f'Next: {page.next_step}')}:\n  {command}"


def _width() -> int:
    return shutil.get_terminal_size().columns if sys.stdout.isatty() else _PIPE_WIDTH


def filled(sentence: str) -> str:
    """A sentence on lines that are not wider than the terminal; only spaces may be broken."""
    return textwrap.fill(
        sentence,
        max(_width(), 40),
        subsequent_indent="  ",
        break_long_words=False,
        break_on_hyphens=False,
    )


def table_text(table: Table, width: int | None = None) -> str:
    """Return a table as aligned columns under its caption, which may head the first of them.

    Of a width it has the first columns that fit, and names the others; longer lines are cut.
    """
    rows: list[list[str]] = []
    for group in table.groups:
        rows += [[group.title]] if group.title else []
        rows += [[str(cell) for cell in row] for row in group.rows]
    heading, caption = list(table.columns), table.caption
    if width and heading and not heading[0] and len(caption) <= _SHORT:
        heading[0], caption = caption, ""
    words = len(heading) if table.wordy else 1
    kept, gap = len(heading), 2
    grid = _grid(heading, rows, words)
    while width and max(map(len, grid.split("\n"))) > width and (gap > 1 or kept > 2):
        kept, gap = (kept, 1) if gap > 1 else (kept - 1, 1)
        grid = _grid(heading[:kept], [row[:kept] for row in rows], words, gap)
    if width:
        grid = "\n".join(_shortened(line, width) for line in grid.split("\n"))
    if kept < len(heading):
        grid += f"\n--verbose has {', '.join(heading[kept:])}"
    return f"{caption}\n{grid}" if caption else grid


def _shortened(line: str, width: int) -> str:
    return line if len(line) <= width else f"{line[: width - 3].rstrip()}..."


def _cut(table: Table, room: int) -> str:
    """The table with the rows and columns that there is room for; empty without a few."""
    rows: list[Sequence[str]] = []
    for group in table.groups:
        rows += [[group.title]] * bool(group.title) + list(group.rows)
    limit = min(table.brief_rows or len(rows), len(rows), room)  # a row takes a line
    while limit >= min(len(rows), _LEAST_ROWS):
        told = table
        if limit < len(rows):
            at: Sequence[int] = range(limit - 1)
            if table.about is not None:
                at = _spread(len(rows), limit - 1, table.about)
            left = sum(len(row) > 1 for row in rows) - sum(len(rows[each]) > 1 for each in at)
            cut = [*(rows[each] for each in at), [f"and {left} {table.others}"]]
            told = replace(table, groups=[Group(cut)])
        text = table_text(told, _width())
        if _height(text) <= room:
            return text
        limit -= 1
    return ""


def _spread(count: int, room: int, about: int) -> Sequence[int]:
    """So many of `count` places, evenly, `about` among them."""
    even = [round(each * (count - 1) / (room - 1)) for each in range(room)]
    nearest = min(range(room), key=lambda each: abs(even[each] - about))
    even[nearest] = about
    return even


def _grid(heading: list[str], rows: list[list[str]], words: int, gap: int = 2) -> str:
    """Rows as aligned columns: the first `words` to the left, the others to the right."""
    every = [heading, *rows] if heading else rows
    columns = [*zip_longest(*every, fillvalue="")]
    widths = [max(map(_cells, column)) for column in columns]
    lines = []
    for row in zip(*columns, strict=True):
        rooms = [" " * (width - _cells(cell)) for cell, width in zip(row, widths, strict=True)]
        told = (f"{cell}{room}" for cell, room in zip(row[:words], rooms, strict=False))
        numbers = (f"{room}{cell}" for cell, room in zip(row[words:], rooms[words:], strict=True))
        lines.append((" " * gap).join([*told, *numbers]).rstrip())
    return "\n".join(lines)


def _cells(text: str) -> int:
    """How many columns of a terminal a text takes."""
    return len(text) + sum(east_asian_width(each) in "WF" for each in text if each > "\u1100")


def typed(text: str) -> str:
    """With the characters of a keyboard, which can be searched for and pasted."""
    return text.translate(_TYPED)


_TEMPLATES = Path(__file__).parent / "templates"
_NO_FIGURES = 'this page has no figures, which need matplotlib: pip install "symkin[figures]"'
_DOTS_PER_INCH = 85  # of clouds of points, which are pixels within the drawing
_PIXELS_PER_INCH = 100  # on the page; so the smallest letters have 12 pixels
_LEAST_PIXELS_PER_INCH = 80  # on a narrow one, where wide figures are scrolled
_DIGITS = 12  # of the SHA-256
_IN_FOLDER = re.compile(r"\{folder\}(\S*)")
_PIXELS = re.compile(r"data:image/png;base64,\s*([A-Za-z0-9+/=\s]+)")
_PLACES = re.compile(r' (?:d|x|y)="[^"]*"')
_UNTURNED = re.compile(r' transform="rotate\(-?0 [^"]*"')
_BARE = re.compile(r"<g>\s*((?:(?!</?g\b).)*?)\s*</g>", re.DOTALL)
_NESTED = 3
_ALIKE = re.compile(r'<use [^>]* style="([^"]*)"/>(?:\s*<use [^>]* style="\1"/>)+')
_COLOURS = 48  # of a cloud of points


def write_page(page: Page, path: Path, *, overwrite: bool = False) -> Path:
    """Write a page as an HTML file, whose folder is made if it does not exist, and return it."""
    with OutputFiles(overwrite=overwrite) as outputs:
        folder = outputs.folder(path.parent, path.name)  # refused before anything is drawn
        (folder / path.name).write_text(page_html(page), encoding="utf-8", newline="\n")
    return path


def page_html(page: Page) -> str:
    """Return a page with everything in it: style, script, figures, symbols.

    Without matplotlib it has no figures, and a note that says so. Its foot names those for details
    that it leaves out.
    The same results on the same day (UTC, or that of SOURCE_DATE_EPOCH) give the same bytes.
    """
    parts = [part for section in page.sections for part in section.parts]
    images = [part for part in parts if isinstance(part, Image)]
    if _can_draw():
        gone = [image for image in images if not draws(page, image)]
        names = [image.name for image in gone]
    else:
        gone, names = images, []
        page = replace(page, notes=[*page.notes, *[_NO_FIGURES] * bool(images)])
    return rendered("report.html", page=_without(page, gone), left_out=names, shown=())


def summary_html(page: Page, shown: Sequence[Table | Image] = ()) -> str:
    """Return title, verdict and the few numbers that matter, for a notebook; and these parts."""
    if not _can_draw():
        shown = [part for part in shown if not isinstance(part, Image)]
    return rendered("notebook.html", page=page, shown=shown)


def _can_draw() -> bool:
    return find_spec("matplotlib") is not None


def _without(page: Page, images: Sequence[Image]) -> Page:
    """The same page without some figures, and without sections of nothing else."""
    sections = []
    for section in page.sections:
        parts = [part for part in section.parts if part not in images]
        if parts or section.paragraphs:
            sections.append(replace(section, parts=parts))
    return replace(page, sections=sections)


def rendered(template: str, **values: Any) -> str:
    """Return a template with these values in it."""
    environment = templates_of(_TEMPLATES)
    environment.tests["table"] = lambda part: isinstance(part, Table)
    environment.tests["movable"] = lambda part: isinstance(part, Movable)
    environment.filters |= {
        "symbols": _symbols,
        "headlines": headlines_of,
        "command": command_text,
        "drawn": _drawn,
        "data": _data,
        "digest": _digest,
    }
    foot = {"version": version(), "day": _day()}
    text = environment.get_template(template).render(**values, **foot)
    # A file's name may have bytes that are no character.
    return text.encode("utf-8", "backslashreplace").decode("utf-8")


def _symbols(text: str) -> Markup:
    """Set the subscripts of symbols such as ``G_M``; names such as ``base_radius`` stay."""
    return Markup(re.sub(r"\b([A-Zs])_(\w+)", r"\1<sub>\2</sub>", str(escape(text))))


def _drawn(image: Image) -> Markup:
    """The figure as an element that follows the page's colours, and scales with its width."""
    figure = cast("Figure", image.draw().figure)
    names = point_names(figure)
    drawing = _themed(_svg(figure, image.name))
    drawing = _gathered(_named(_apart(drawing, image.name, names), image.name, names))
    inches = figure.get_figwidth()
    sizes = (round(pixels * inches) for pixels in (_PIXELS_PER_INCH, _LEAST_PIXELS_PER_INCH))
    style = "width: {}px; min-width: {}px".format(*sizes)
    head = f'<svg role="img" aria-label="{escape(image.alternative)}" style="{style}"'
    opening = re.compile(r'<svg [^>]*?(viewBox="[^"]*")[^>]*>')
    return Markup(opening.sub(lambda found: f"{head} {found[1]}>", drawing, count=1))


def _svg(figure: Figure, name: str) -> str:
    """The figure's bare element, the same bytes for the same figure."""
    import matplotlib as mpl
    from matplotlib.backends.backend_svg import FigureCanvasSVG

    # As `savefig` does with transparent=True, which draws everything twice.
    for patch in (figure.patch, *(axes.patch for axes in figure.axes)):
        patch.set(facecolor="none", edgecolor="none")
    figure.set_dpi(_DOTS_PER_INCH)
    buffer = io.StringIO()
    with mpl.rc_context({"svg.fonttype": "none", "svg.hashsalt": name}):
        FigureCanvasSVG(figure).print_svg(buffer)  # type: ignore[no-untyped-call]
    drawing = buffer.getvalue()
    drawing = drawing[drawing.index("<svg") :]
    # Its style would hold for the whole page, and has its place in the page's.
    drawing = re.sub(
        r"<metadata>.*?</metadata>|<style .*?</style>|<!--.*?-->", "", drawing, flags=re.S
    )
    drawing = _PIXELS.sub(_with_few_colours, drawing.replace("xlink:href", "href"))
    drawing = _lighter(drawing)
    return re.sub(r"\n\s*", "\n", drawing)


def _lighter(drawing: str) -> str:
    """The same drawing in fewer characters: to tenths of a pixel, and with the page's font."""
    drawing = re.sub(r"font-family: [^;\"]*;? ?", "", _UNTURNED.sub("", drawing))
    return _PLACES.sub(lambda found: re.sub(r"(\.\d)\d+", r"\1", found[0]), drawing)


def _gathered(drawing: str) -> str:
    """Without groups that say nothing, and with the style of markers in a row said once."""
    for _ in range(_NESTED):
        drawing = _BARE.sub(r"\1", drawing)

    def once(found: re.Match[str]) -> str:
        style = f' style="{found[1]}"'
        return f"<g{style}>{found[0].replace(style, '')}</g>"

    return _ALIKE.sub(once, drawing)


def _with_few_colours(pixels: re.Match[str]) -> str:
    """The pixels of a cloud in a palette: a fifth of the bytes, which nobody sees."""
    from PIL import Image as Pixels

    picture = Pixels.open(io.BytesIO(base64.b64decode(pixels[1])))
    smaller = io.BytesIO()
    kept = picture.quantize(_COLOURS, Pixels.Quantize.FASTOCTREE, dither=Pixels.Dither.NONE)
    kept.save(smaller, "png", optimize=True)
    return f"data:image/png;base64,{base64.b64encode(smaller.getvalue()).decode()}"


def _themed(drawing: str) -> str:
    """With the page's colours in place of those that it has its own values for."""
    names = {colour.lower(): f"var(--{name})" for colour, name in THEME.items()}
    return re.sub(
        r"(?<=: )#[0-9a-fA-F]{6}\b", lambda found: names.get(found[0].lower(), found[0]), drawing
    )


def _apart(drawing: str, name: str, kept: Iterable[str]) -> str:
    """With identifiers that no other figure of the page has, and only those that are used."""
    used = {*re.findall(r'(?:href="|url\()#([^")]+)', drawing), *kept}
    short = {each: each if each in kept else str(i) for i, each in enumerate(sorted(used))}
    drawing = re.sub(
        r' id="([^"]+)"',
        lambda found: f' id="{name}-{short[found[1]]}"' if found[1] in used else "",
        drawing,
    )
    return re.sub(
        r'(href="|url\()#([^")]+)', lambda found: f"{found[1]}#{name}-{short[found[2]]}", drawing
    )


def _named(drawing: str, prefix: str, names: Mapping[str, Sequence[str]]) -> str:
    """With the names of its points, where the page's script finds them."""
    for identifier, of_points in names.items():
        before, mark, after = drawing.partition(f'id="{prefix}-{identifier}"')
        start, *points = after.split("<use ", len(of_points))
        named = (
            f'<use data-name="{escape(name)}" {point}'
            for name, point in zip(of_points, points, strict=True)
        )
        drawing = "".join([before, mark, start, *named])
    return drawing


def _data(part: Movable) -> Markup:
    """As the text of a script element, which must not end it."""
    text = json.dumps(part.data(), separators=(",", ":"), allow_nan=False)
    return Markup(text.replace("<", "\\u003c"))


def _digest(source: Path | bytes) -> str:
    """The beginning of the SHA-256 of a file, or of bytes; empty if it is not there any more."""
    try:
        content = source if isinstance(source, bytes) else source.read_bytes()
    except OSError:
        return ""
    return hashlib.sha256(content).hexdigest()[:_DIGITS]


def _day() -> str:
    epoch = os.environ.get("SOURCE_DATE_EPOCH")
    now = datetime.fromtimestamp(int(epoch), UTC) if epoch else datetime.now(UTC)
    return now.date().isoformat()
