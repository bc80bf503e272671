# SPDX-License-Identifier: MIT
"""A page as text: whole for the command line, in a few lines for a prompt."""

from __future__ import annotations

import dataclasses
import io
import shutil
import sys

from symkin.report.content import Page, Table

_PIPE_WIDTH = 100
_TYPED = str.maketrans({"\N{NO-BREAK SPACE}": " ", "\N{MINUS SIGN}": "-", "\N{EN DASH}": "-"})


def summary_text(page: Page) -> str:
    """Return title, verdict and the few numbers that matter, a line each."""
    lines = [page.title]
    lines += [page.judgement] if page.judgement else []
    lines += [f"  {label}: {value}" for label, value, _ in page.headlines]
    lines += [f"  Doubt: {doubt}" for doubt in page.doubts]
    return _typed("\n".join(lines))


def page_text(page: Page, *, whole: bool = False) -> str:
    """Return what the command line prints: the summary, then the brief tables.

    The `whole` page has all sections, with their paragraphs and tables.
    """
    lines = [page.title, *([page.subtitle] if page.subtitle else [])]
    if page.judgement:
        lines += [page.judgement]
    lines += [f"Doubt: {doubt}" for doubt in page.doubts]
    blocks = ["\n".join(lines)]
    if page.headlines:
        rows = [[label, value, remark] for label, value, remark in page.headlines]
        blocks.append(_grid([], rows, words=3))
    for section in page.sections:
        tables = [part for part in section.parts if isinstance(part, Table)]
        if whole:
            blocks += ["\n".join([section.title.upper(), *section.paragraphs])]
            blocks += [table_text(table) for table in tables]
        else:
            blocks += [table_text(_cut(table)) for table in tables if table.brief]
    blocks += ["\n".join(f"Note: {note}" for note in page.notes)] if page.notes else []
    blocks += [f"Next: {page.next_step}"] if page.next_step else []
    return _typed("\n\n".join(blocks))


def table_text(table: Table) -> str:
    """Return a table as aligned columns under its caption; empty columns are left out."""
    rows: list[list[str]] = []
    for group in table.groups:
        rows += [[group.title]] if group.title else []
        rows += [[str(cell) for cell in row] for row in group.rows]
    words = len(table.columns) if table.wordy else 1
    grid = _grid(list(table.columns), rows, words)
    return f"{table.caption}\n{grid}" if table.caption else grid


def _cut(table: Table) -> Table:
    """The table with the rows that are printed of it."""
    (group, *others), limit = table.groups, table.brief_rows
    left = len(group.rows) - limit
    if others or not 0 < limit < len(group.rows):
        return table
    rows = [*group.rows[:limit], [f"and {left} smaller"]]
    return dataclasses.replace(table, groups=[dataclasses.replace(group, rows=rows)])


def _grid(heading: list[str], rows: list[list[str]], words: int) -> str:
    """Rows as aligned columns: the first `words` to the left, the others to the right."""
    from rich.console import Console
    from rich.table import Table as Grid

    count = max([len(heading), *(len(row) for row in rows)])
    grid = Grid(
        box=None,
        pad_edge=False,
        padding=(0, 2, 0, 0),
        header_style="bold",
        show_header=bool(heading),
    )
    for number in range(count):
        name = heading[number] if number < len(heading) else ""
        grid.add_column(name, justify="left" if number < words else "right", no_wrap=True)
    for row in rows:
        grid.add_row(*row, *[""] * (count - len(row)))
    width = shutil.get_terminal_size().columns if sys.stdout.isatty() else _PIPE_WIDTH
    console = Console(file=io.StringIO(), width=width, markup=False)
    # A table that is too wide is better wrapped by the terminal than cut.
    unbound = console.options.update(max_width=10_000)
    console.width = max(console.width, console.measure(grid, options=unbound).maximum)
    with console.capture() as captured:
        console.print(grid, highlight=False)
    return "\n".join(line.rstrip() for line in captured.get().rstrip("\n").split("\n"))


def _typed(text: str) -> str:
    """With the characters of a keyboard, which can be searched for and pasted."""
    return text.translate(_TYPED)
