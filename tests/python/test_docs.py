# SPDX-License-Identifier: MIT
"""The code of the documentation runs, and the commands that it names exist."""

import ast
import dataclasses
import importlib
import inspect
import pkgutil
import re
import runpy
import shlex
import sys
import types
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import typer
from matplotlib.figure import Figure

import symkin
import symkin.plot
from symkin.cli import app, main
from symkin.model.poses import quaternions_from_rotation_vectors
from symkin.planning.simulation import disturb

DOCS = Path(__file__).parents[2] / "docs"
PAGES = (
    "getting-started.md",
    "tutorial.md",
    "tutorial-real-data.md",
    "how-to/guided-measuring.md",
    "user-guide/describing.md",
    "user-guide/symmetry.md",
    "user-guide/choosing-poses.md",
    "user-guide/identifying.md",
    "user-guide/fleets.md",
    "user-guide/unknowns.md",
    "user-guide/trusting.md",
    "user-guide/findings.md",
    "user-guide/evaluating.md",
    "user-guide/accepting.md",
    "user-guide/exporting.md",
    "user-guide/studies.md",
    "reproducing.md",
    "api/plots.md",
)


NOTEBOOKS = sorted(
    path.relative_to(DOCS).as_posix()
    for path in DOCS.rglob("*.md")
    if path.read_text(encoding="utf-8").startswith("---\nfile_format: mystnb")
)


def blocks(page: str, language: str) -> list[str]:
    return blocks_of((DOCS / page).read_text(encoding="utf-8"), language)


def blocks_of(text: str, language: str) -> list[str]:
    return re.findall(rf"^```{language}\n(.*?)^```", text, re.MULTILINE | re.DOTALL)


def shortened(code: str) -> str:
    """The same code with small numbers."""
    code = re.sub(r"robots ?= ?\d+", lambda found: re.sub(r"\d+", "2", found[0]), code)
    code = re.sub(r"for count in \(.*\)", "for count in (8, 9)", code)
    code = re.sub(r"for name in \(.*\)", 'for name in ("5bar",)', code)
    return code.replace("folds=5", "folds=2")


def commands() -> list[str]:
    found = []
    for path in sorted(DOCS.rglob("*.md")):
        text = path.read_text(encoding="utf-8").replace("\\\n", " ")
        found += re.findall(r"(?:^\$ |^    |`)(symkin [a-z][^`\n#]*)", text, re.MULTILINE)
    return found


def write_motion_capture(path: Path) -> None:
    """A table like that of the real hexapod, simulated."""
    hexapod = disturb(symkin.load_mechanism("hexapod_jugglebot"), seed=1)
    random = np.random.default_rng(1)
    position = random.uniform((-0.2, -0.2, 0.7), (0.2, 0.2, 0.8), (60, 3))
    turn = quaternions_from_rotation_vectors(random.uniform(-0.3, 0.3, (60, 3)))
    readings = hexapod.inverse_kinematics(np.hstack([position, turn])) / (2 * np.pi)
    names = [
        *(f"leg_length_{leg}" for leg in range(1, 7)),
        *(f"position_{axis}" for axis in "xyz"),
        *(f"orientation_{axis}" for axis in "xyzw"),
    ]
    table = np.hstack([readings, 1000 * position, turn])
    np.savetxt(path, table, delimiter=",", header=",".join(names), comments="")


@pytest.fixture(autouse=True)
def few_candidates(monkeypatch):
    """Sample what the pages call `candidates` in less time."""
    sample = symkin.sample_workspace
    monkeypatch.setattr(
        symkin, "sample_workspace", lambda m, count=None, seed=None: sample(m, count or 3000, seed)
    )


@pytest.mark.parametrize("page", PAGES)
def test_the_python_code_of_a_page_runs_from_top_to_bottom(page, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    write_motion_capture(tmp_path / "108_calibration_poses.csv")
    code = blocks(page, "python")
    assert code
    names: dict[str, object] = {}
    for block in code:
        exec(compile(shortened(block), page, "exec"), names)
    assert not re.search(r"\bnan\b", capsys.readouterr().out)


@pytest.mark.parametrize("page", NOTEBOOKS)
def test_the_cells_of_a_notebook_run_and_show_what_they_end_with(page, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    names: dict[str, object] = {}
    for cell in blocks(page, "{code-cell} ipython3"):
        tree = ast.parse(shortened(cell))
        shown = ast.unparse(tree.body.pop()) if isinstance(tree.body[-1], ast.Expr) else "None"
        exec(compile(tree, page, "exec"), names)
        value = eval(shown, names)
        if hasattr(value, "page"):
            assert value._repr_html_().strip().startswith('<div class="symkin">')
    assert names


def test_the_papers_robot_takes_ten_cells():
    assert len(blocks("notebooks/paper.md", "{code-cell} ipython3")) == 10


def test_every_figure_is_drawn_on_its_page(monkeypatch):
    text = (DOCS / "api/plots.md").read_text(encoding="utf-8")
    lines = re.findall(r"^   (?!:)(\S.*)$", text, re.MULTILINE)
    names: dict[str, object] = {}
    monkeypatch.setitem(sys.modules, "matplotlib.pyplot", types.SimpleNamespace(figure=Figure))
    exec(compile(shortened("\n".join(lines)), "plots.md", "exec"), names)
    drawn = re.findall(r"^plot\.(\w+)\(", "\n".join(lines), re.MULTILINE)
    assert set(drawn) == {name for name in symkin.plot.__all__ if name.islower()}


def test_the_five_bar_of_the_user_guide_is_a_mechanism(tmp_path):
    five_bar = tmp_path / "plotter.toml"
    five_bar.write_text(blocks("user-guide/describing.md", "toml")[0], encoding="utf-8")
    mechanism = symkin.load_mechanism(five_bar)
    assert mechanism.working_modes == (-1, 1)
    assert np.isfinite(mechanism.inverse_kinematics(mechanism.home)).all()


def whole_mechanism_files() -> list[str]:
    pages = sorted(DOCS.rglob("*.md"))
    found = [block for page in pages for block in blocks(str(page), "toml")]
    return [block for block in found if re.search("^schema", block, re.MULTILINE)]


@pytest.mark.parametrize("text", whole_mechanism_files())
def test_a_mechanism_file_of_the_documentation_is_checked_and_run(text, tmp_path):
    file = tmp_path / "robot.toml"
    file.write_text(text, encoding="utf-8")
    assert main(["check", str(file)]) == 0
    if "[workspace]" in text:  # without one there is nothing to draw poses from
        small = ["--pose-count", "12", "--candidates", "600", "--no-report"]
        assert main(["run", str(file), "--out", str(tmp_path / "out"), *small]) == 0


def first_robots() -> list[tuple[str, list[str]]]:
    """File and commands of each section."""
    page = (DOCS / "first-robots.md").read_text(encoding="utf-8")
    return [
        (blocks_of(section, "toml")[0], blocks_of(section, "console")[0].splitlines())
        for section in page.split("\n## ")[1:]
    ]


@pytest.mark.parametrize(
    ("file", "lines"), first_robots(), ids=[lines[0].split()[-1] for _, lines in first_robots()]
)
def test_a_first_robot_is_planned_and_reported_by_twenty_lines(file, lines, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert len(file.splitlines()) <= 20
    Path(shlex.split(lines[0])[-1]).write_text(file, encoding="utf-8")
    for line in lines:
        assert main(shlex.split(line)[2:]) == 0
    plan, report = sorted(tmp_path.glob("*/plan.csv")), list(tmp_path.glob("*/report.html"))
    assert len(plan) == 2
    assert len(report) == 1


@pytest.mark.parametrize("command", commands())
def test_a_command_of_the_documentation_exists_with_its_options(command):
    name, *arguments = shlex.split(command)[1:]
    known = typer.main.get_command(app).commands
    assert name in known
    options = {
        option
        for parameter in known[name].params
        for option in (*parameter.opts, *parameter.secondary_opts)
    }
    used = {argument for argument in arguments if argument.startswith("--")} - {"--help"}
    assert used <= options


def reference() -> set[str]:
    pages = "\n".join(path.read_text(encoding="utf-8") for path in (DOCS / "api").glob("*.md"))
    return set(re.findall(r"^\.\. (?:auto|py:)\w+:: symkin\.([\w.]+)", pages, re.MULTILINE))


UNDOCUMENTED = (
    "__main__", "_core", "cli", "cluster", "files", "present", "results", "show", "storage",
    "values",
)  # fmt: skip
# Handed out by what is public, to whoever passes it on unseen.
INTERNAL = {"CellLists", "CurveSettings", "Kept", "Sizes"}
PUBLIC = (
    "acceptance", "analysis.alignment", "analysis.checks", "analysis.conditions",
    "analysis.evaluation", "analysis.observability", "analysis.observed", "analysis.workspace",
    "data.measurements", "errors", "estimate", "exports", "guided", "model.kinematics",
    "model.mechanism", "model.poses", "model.settings", "model.symmetry", "pipeline", "planning",
    "planning.simulation", "plot", "robot", "study",
)  # fmt: skip


def classes_of_modules() -> dict[str, type]:
    """Public classes of the modules, less those of the command line, files and pages."""
    modules = [m.name for m in pkgutil.walk_packages(symkin.__path__, "symkin.")]
    found: dict[str, type] = {}
    for name in modules:
        if name.split(".")[1] not in UNDOCUMENTED:
            module = importlib.import_module(name)
            found |= {
                each: value
                for each, value in inspect.getmembers(module, inspect.isclass)
                if value.__module__ == name and each not in INTERNAL and each[0] != "_"
            }
    return found


def handed_out(each: Any) -> str:
    """Annotations of what a function returns, or of what is in an object of a class."""
    if not inspect.isclass(each):
        return str(inspect.signature(each).return_annotation)
    said = [str(f.type) for f in dataclasses.fields(each)] if dataclasses.is_dataclass(each) else []
    for name, member in inspect.getmembers(each):
        if not name.startswith("_"):
            function = member.fget if isinstance(member, property) else member
            if inspect.isroutine(function) and hasattr(function, "__annotations__"):
                said.append(str(function.__annotations__.get("return")))
    return " ".join(said)


def test_every_public_name_and_what_it_hands_out_is_in_the_reference():
    documented = reference()
    assert set(symkin.__all__) <= documented
    classes, seen = classes_of_modules(), set()
    todo = {name: getattr(symkin, name) for name in symkin.__all__}
    while todo:
        name, each = todo.popitem()
        seen.add(name)
        words = set(re.findall(r"\w+", handed_out(each))) & set(classes)
        todo |= {word: classes[word] for word in words - seen}
    assert len(seen) > 60
    assert seen - {name.rpartition(".")[2] for name in documented} == set()


def test_every_name_of_a_public_module_is_in_the_reference():
    documented = {name.rpartition(".")[2] for name in reference()}
    for module in PUBLIC:
        names = importlib.import_module(f"symkin.{module}").__all__
        assert set(names) - documented == set(), module


def test_the_groups_of_shipped_mechanisms_are_those_of_the_page():
    table = runpy.run_path(str(DOCS / "figures" / "groups.py"))["table"]
    assert (DOCS / "figures" / "groups.md").read_text(encoding="utf-8") == table()


def test_the_check_of_the_site_finds_broken_links_and_what_is_loaded_from_elsewhere(tmp_path):
    check = runpy.run_path(str(DOCS.parent / "scripts" / "check_site.py"))["complaints"]
    (tmp_path / "b.html").write_text('<h1 id="here">b</h1><a href="a.html#x">a</a>')
    good = '<p id="x"><a href="b.html#here">b</a><a href="https://elsewhere.org">c</a>'
    (tmp_path / "a.html").write_text(good)
    assert check(tmp_path) == []
    bad = '<a href="b.html#there"><a href="c.html"><script src="https://elsewhere.org/d.js">'
    (tmp_path / "a.html").write_text(good + bad)
    assert check(tmp_path) == [
        "a.html loads https://elsewhere.org/d.js",
        "a.html links to b.html#there, which has no such place",
        "a.html links to c.html, which does not exist",
    ]
