"""The rooms of the package: who imports whom, read from the sources, functions and all.

That a room imports rooms below it is the contract of pyproject.toml, which `make lint` checks.
"""

import ast
import functools
import graphlib
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

PACKAGE = Path(__file__).parents[2] / "python" / "symkin"
# The front door, which imports what is asked for, and names it for tools that look for types.
FRONT_DOOR = "symkin"
# Where rooms below the pages ask for them, and pages for figures, which take a while to import;
# and where a file is read for a mechanism, as a robot, whose verbs are of the rooms above; and the
# command, which says its version without all that it can do.
SEAMS = {
    "symkin.__main__",
    "symkin.cli.help",
    "symkin.present",
    "symkin.model.given",
    "symkin.show.images",
    "symkin.show.mechanism",
    FRONT_DOOR,
}


class Import(NamedTuple):
    """An import of a module of the package, and whether it is at the top of its file."""

    module: str
    imported: str
    line: int
    at_top: bool


def name_of(path: Path) -> str:
    parts = path.relative_to(PACKAGE.parent).with_suffix("").parts
    return ".".join(parts).removesuffix(".__init__")


MODULES = {name_of(path): path for path in sorted(PACKAGE.rglob("*.py"))}


@functools.cache
def imports_of(module: str) -> tuple[Import, ...]:
    return tuple(_imports_of(module))


def _imports_of(module: str) -> Iterator[Import]:
    tree = ast.parse(MODULES[module].read_text(encoding="utf-8"))
    top = {id(node) for node in tree.body}
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            names = [alias.name for alias in node.names]
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, f"{module} imports relatively"
            whole = [f"{node.module}.{alias.name}" for alias in node.names]
            names = [name if name in MODULES else str(node.module) for name in whole]
        else:
            continue
        for name in names:
            if name in MODULES:
                yield Import(module, name, node.lineno, id(node) in top)


def every_import() -> list[Import]:
    return [each for module in MODULES for each in imports_of(module)]


def test_own_modules_are_imported_at_the_top_of_a_file_alone():
    hidden = [each for each in every_import() if not each.at_top and each.module != FRONT_DOOR]
    assert hidden == []


def test_modules_are_imported_by_name_at_the_seams_alone():
    calling = {
        module
        for module, path in MODULES.items()
        if any(
            isinstance(node, ast.Call) and ast.unparse(node.func).endswith("import_module")
            for node in ast.walk(ast.parse(path.read_text(encoding="utf-8")))
        )
    }
    # The figures' own room imports matplotlib so, with a sentence for who has none.
    assert calling - {"symkin.show.figures"} == SEAMS


def test_no_import_leads_back_to_where_it_began():
    graph = {module: set() for module in MODULES}
    for each in every_import():
        # Any module needs the package it is in, whose front door imports when it is asked.
        if FRONT_DOOR not in (each.module, each.imported):
            graph[each.module].add(each.imported)
    graphlib.TopologicalSorter(graph).prepare()
