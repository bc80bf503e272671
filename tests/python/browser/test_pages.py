# SPDX-License-Identifier: MIT
"""Pages as a person sees and moves them: in a wide and a narrow window, in light and dark."""

import base64
import itertools
import json
import re

import numpy as np
import pytest

import symkin
from symkin import plot
from symkin.cli import main
from symkin.present import Group, Image, Page, Section, Table
from symkin.show.mechanism import movable
from symkin.show.rendering import page_html

SEEN = list(itertools.product((1200, 400), ("light", "dark")))
RESIDUALS = "document.querySelector('#residuals .plot svg')"


@pytest.fixture(scope="module")
def page(mechanism, tmp_path_factory):
    """A page with a part of every kind, and the result that it tells."""
    result = symkin.run_protocol(mechanism)
    found = result.identification
    columns = ["Parameter", *(f"A column with a long name {number}" for number in range(12))]
    table = Table("A wide table", columns, [Group([["name", *map(str, range(12))]], "Group")])
    images = {
        "residuals": Image("residuals", "Closures", "", lambda: plot.residuals(found)),
        "dependence": Image("dependence", "Closures", "", lambda: plot.dependence(found)),
        "map": Image(
            "map",
            "Errors",
            "",
            lambda: plot.error_map(result.candidates, result.before, result.after),
        ),
    }
    told = Page(
        title="A page",
        headlines=[("Label", "1 mm", "remark")] * 3,
        verdict="doubtful",
        judgement="Doubted",
        doubts=["a doubt " + "about_something_with_a_long_name" * 3],
        notes=["a note"],
        paragraphs=["A paragraph."],
        next_step="measure",
        files=["plan.csv", "two words.json"],
        inputs=[("robot.toml", b"abc")],
        sections=[
            *(Section(name, name, [], [image]) for name, image in images.items()),
            Section("table", "Table", [], [table]),
            Section("folded", "Folded", ["what few want"], [], details=True),
            Section("moved", "Moved", [], movable(mechanism)),
        ],
    )
    path = tmp_path_factory.mktemp("page") / "page.html"
    path.write_text(page_html(told), encoding="utf-8")
    return path, result


@pytest.fixture(scope="module")
def pages_of_commands(tmp_path_factory):
    """The pages that commands write."""
    folder = tmp_path_factory.mktemp("commands")
    small = ("--candidates", "300", "--pose-count", "10")
    assert main(["run", "3RRR", "--out", str(folder / "run"), *small]) == 0
    assert main(["check", "hexapod_jugglebot", "--out", str(folder / "check")]) == 0
    pages = sorted(folder.glob("*/*.html"))
    assert len(pages) == 2
    return pages


def in_function(script):
    """A script whose names are its own, as an expression."""
    return f"(() => {{ {script} }})()"


def assert_sound(browser):
    """No error, nothing loaded, nothing wider than the window."""
    assert not browser.complaints
    loaded = [url for url in browser.requests if not url.startswith(("data:", "file:"))]
    assert not loaded
    assert len([url for url in browser.requests if url.startswith("file:")]) == 1
    assert browser.run("document.documentElement.scrollWidth <= innerWidth")


@pytest.mark.parametrize(("width", "scheme"), SEEN)
def test_a_page_fits_its_window_and_loads_nothing(browser, page, width, scheme):
    browser.open(page[0], width, scheme)
    assert_sound(browser)


@pytest.mark.parametrize(("width", "scheme"), SEEN)
def test_pages_of_the_commands_fit_too(browser, pages_of_commands, width, scheme):
    for path in pages_of_commands:
        browser.open(path, width, scheme)
        assert_sound(browser)
        assert browser.run("document.querySelectorAll('figure.movable svg .leg').length") >= 3
        assert path.stat().st_size < 1_500_000


@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_text_has_contrast(browser, page, scheme):
    """Of 4.5 as the WCAG ask, against what is behind it; of letters in figures too."""
    browser.open(page[0], 1200, scheme)
    found = json.loads(browser.run(in_function(CONTRASTS)))
    assert len(found) > 100
    assert {text: ratio for text, ratio in found if ratio < 4.5} == {}


@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_legs_and_lines_of_figures_stand_out(browser, page, scheme):
    """Of 3 as the WCAG ask of what is not text, where a colour may choose its lightness."""
    browser.open(page[0], 1200, scheme)
    colours = [f"--leg{leg}" for leg in (1, 2, 3, 7)]
    ratios = json.loads(
        browser.run(in_function(f"{RATIO} return JSON.stringify({colours}.map(ofVariable));"))
    )
    assert min(ratios) >= 3


@pytest.mark.parametrize("width", [1200, 400])
def test_letters_of_figures_are_legible(browser, page, width):
    browser.open(page[0], width)
    heights = browser.run(
        "[...document.querySelectorAll('.plot text')].map((each) => "
        "parseFloat(getComputedStyle(each).fontSize) * "
        "Math.hypot(each.getScreenCTM().c, each.getScreenCTM().d))"
    )
    assert len(heights) > 50
    assert min(heights) > 6.5  # exponents are smaller than the rest
    assert np.median(heights) > 9


def test_the_foot_says_when_and_from_what(browser, page, monkeypatch):
    browser.open(page[0])
    foot = browser.run("document.querySelector('footer').innerText")
    assert re.search(r"on \d{4}-\d\d-\d\d \(UTC\)", foot)
    assert "robot.toml (SHA-256 ba7816bf8f01" in foot
    links = browser.run("[...document.querySelectorAll('.files a')].map((a) => a.href)")
    assert [link.rsplit("/", 1)[1] for link in links] == ["plan.csv", "two%20words.json"]
    monkeypatch.setenv("SOURCE_DATE_EPOCH", "0")
    assert "1970-01-01" in page_html(Page("old"))


def test_paper_is_white_and_has_no_sliders(browser, page):
    browser.open(page[0], 720, "dark")
    dark = [{"name": "prefers-color-scheme", "value": "dark"}]
    browser.call("Emulation.setEmulatedMedia", media="print", features=dark)
    body = "getComputedStyle(document.body)"
    assert browser.run(f"{body}.backgroundColor") == "rgb(255, 255, 255)"
    assert browser.run(f"{body}.color") == "rgb(34, 34, 34)"
    assert not browser.run("document.querySelector('figure.movable').checkVisibility()")
    assert browser.run("document.querySelector('#residuals svg').checkVisibility()")


def test_a_folded_section_unfolds(browser, page):
    browser.open(page[0])
    shown = "document.querySelector('#folded p').checkVisibility()"
    assert not browser.run(shown)
    browser.run("document.querySelector('#folded summary').click()")
    assert browser.run(shown)


def test_the_pointer_names_the_row_of_a_residual(browser, page):
    path, result = page
    browser.open(path, height=1600)
    fit = result.identification.legs[1]
    numbers = result.simulation.measurements.row_numbers[fit.rows]
    names = browser.run(
        f"[...{RESIDUALS}.querySelectorAll('[data-name]')].map((use) => use.dataset.name)"
    )
    assert len(names) == sum(len(each.rows) for each in result.identification.legs)
    sought = f"row {numbers[3]}, leg 2: {1e3 * fit.residuals[3]:+.3g} mm"
    at = json.loads(
        browser.run(
            f"JSON.stringify({RESIDUALS}.querySelectorAll('[data-name]')[{names.index(sought)}]"
            ".getBoundingClientRect())"
        )
    )
    middle = at["left"] + at["width"] / 2, at["top"] + at["height"] / 2
    tip = "document.getElementById('tip')"
    assert browser.run(f"{tip}.hidden")
    browser.point(middle[0] + 1, middle[1] + 1)
    assert not browser.run(f"{tip}.hidden")
    assert browser.run(f"{tip}.textContent") == sought
    browser.point(5, 5)
    assert browser.run(f"{tip}.hidden")


def moved(browser):
    """Joints of every leg as drawn, on the screen, and what is said of the pose."""
    return json.loads(browser.run(in_function(MOVED)))


def slide(browser, slider, value):
    browser.run(
        in_function(
            f"const input = document.querySelectorAll('figure.movable input')[{slider}];"
            f"input.value = {value}; input.dispatchEvent(new Event('input'));"
        )
    )


def page_of(mechanism, folder):
    path = folder / "moved.html"
    section = Section("moved", "Moved", [], movable(mechanism))
    path.write_text(page_html(Page(mechanism.name, sections=[section])), encoding="utf-8")
    return path


def in_metres(drawn, base):
    """Drawn points in the plane, by the scale that the base joints of the first two legs give."""
    first, second = (np.array(leg[0]) for leg in drawn[:2])
    scale = np.linalg.norm(second - first) / np.linalg.norm(base[1] - base[0])
    flip = np.array([1, -1])
    return [base[0] + flip * (np.array(leg) - first) / scale for leg in drawn], 1 / scale


@pytest.mark.parametrize("name", ["3RRR", "3PRR", "3RPR_end_joint", "5bar", "6RRR"])
def test_legs_follow_the_sliders_as_the_core_says(browser, tmp_path, name):
    mechanism = symkin.load_mechanism(name)
    part = movable(mechanism)[0].data()
    browser.open(page_of(mechanism, tmp_path))
    random = np.random.default_rng(1)
    drawn_poses = 0
    for _ in range(30):
        steps = [int(random.integers(len(axis["values"]))) for axis in part["axes"]]
        for slider, step in enumerate(steps):
            slide(browser, slider, step)
        pose = np.array(
            [axis["values"][step] for axis, step in zip(part["axes"], steps, strict=True)]
        )
        readings = mechanism.inverse_kinematics(pose)[0]
        seen = moved(browser)
        unreached = np.flatnonzero(~np.isfinite(readings)) + 1
        if unreached.size:
            assert seen["state"] == "reach"
            assert re.findall(r"\d+", seen["text"].split(".")[0]) == [str(leg) for leg in unreached]
            assert len(seen["legs"]) == len(readings) - unreached.size
            continue
        drawn_poses += 1
        exact = [
            mechanism.core.joint_centres(leg, pose, reading) for leg, reading in enumerate(readings)
        ]
        points, pixel = in_metres(seen["legs"], [centres[0] for centres in exact])
        for leg, centres in zip(points, exact, strict=True):
            np.testing.assert_allclose(leg, centres, atol=pixel)
        condition = mechanism.singularity_measures(pose)[2][0]
        said = float(re.search(r"Condition number (?:over )?([\d.]+)\.", seen["text"])[1])
        assert said == pytest.approx(min(condition, 1e4), rel=0.01)
    assert drawn_poses >= 5
    assert not browser.complaints


def test_the_platform_follows_the_pointer(browser, tmp_path, mechanism):
    browser.open(page_of(mechanism, tmp_path))
    grip = "document.querySelector('.grip').getBoundingClientRect()"
    box = json.loads(browser.run(f"JSON.stringify({grip})"))
    x, y = box["left"] + box["width"] / 2, box["top"] + box["height"] / 2
    before = moved(browser)["legs"]
    browser.point(x, y, "mousePressed", button="left", buttons=1, clickCount=1)
    browser.point(x + 30, y - 20, buttons=1)
    browser.point(x + 30, y - 20, "mouseReleased", button="left", clickCount=1)
    after = json.loads(browser.run(f"JSON.stringify({grip})"))
    assert after["left"] - box["left"] == pytest.approx(30, abs=10)
    assert after["top"] - box["top"] == pytest.approx(-20, abs=10)
    assert moved(browser)["legs"] != before
    browser.run("document.querySelector('figure.movable button').click()")
    assert moved(browser)["legs"] == before


@pytest.mark.parametrize("name", ["hexapod_jugglebot", "3RPS"])
def test_straight_legs_move_freely_and_say_how_well_they_know_the_condition(
    browser, tmp_path, name
):
    robot = symkin.load_mechanism(name)
    part = movable(robot)[0].data()
    nodes = [len(axis["values"]) for axis in part["axes"]]
    browser.open(page_of(robot, tmp_path))
    slide(browser, len(nodes), -90)
    slide(browser, len(nodes) + 1, 90)  # from above, x to the right
    random = np.random.default_rng(2)
    for _ in range(10):
        places = [random.integers(1, 20 * (count - 1)) / 20 for count in nodes]
        for slider, place in enumerate(places):
            slide(browser, slider, place)
        values = [
            np.interp(place, range(len(axis["values"])), axis["values"])
            for axis, place in zip(part["axes"], places, strict=True)
        ]
        coordinates = np.zeros(robot.space.dof)
        coordinates[list(part["free"])] = values
        pose = robot.poses_at(coordinates)
        readings = robot.inverse_kinematics(pose)[0]
        exact = [
            robot.core.joint_centres(leg, pose, reading)[:, :2]
            for leg, reading in enumerate(readings)
        ]
        seen = moved(browser)
        points, pixel = in_metres(seen["legs"], [centres[0] for centres in exact])
        for leg, centres in zip(points, exact, strict=True):
            np.testing.assert_allclose(leg[[0, -1]], centres, atol=pixel)
            np.testing.assert_allclose(leg[1], centres.mean(axis=0), atol=pixel)
        condition = robot.singularity_measures(pose)[2][0]
        said, within = re.search(
            r"number ([\d.]+) \(interpolated, within ([\d.]+)%\)", seen["text"]
        ).groups()
        assert float(said) == pytest.approx(
            condition,
            rel=1.5 * float(within) / 100 + 0.005,  # three digits
        )
        assert float(within) < 5
    assert not browser.complaints


MOVED = """
const figure = document.querySelector("figure.movable");
const said = figure.querySelector("[role=status]");
const pair = (text) => text.split(",").map(Number);
const points = (line) => line.getAttribute("points").split(" ").map(pair);
const legs = [...figure.querySelectorAll(".leg polyline")].map(points);
return JSON.stringify({ legs, state: said.dataset.state, text: said.textContent });
"""

RATIO = """
const channel = (value) => (value <= 0.03928 ? value / 12.92 : ((value + 0.055) / 1.055) ** 2.4);
const numbers = (colour) => colour.match(/[\\d.]+/g).map(Number);
const light = ([r, g, b]) => [r, g, b].map((each) => channel(each / 255))
  .reduce((sum, each, k) => sum + each * [0.2126, 0.7152, 0.0722][k], 0);
const ratioOf = (one, other) => {
  const [low, high] = [light(numbers(one)), light(numbers(other))].sort((a, b) => a - b);
  return (high + 0.05) / (low + 0.05);
};
const behind = (element) => {
  for (let each = element; each; each = each.parentElement) {
    const colour = getComputedStyle(each).backgroundColor;
    if (!(numbers(colour).length > 3 && numbers(colour)[3] === 0)) return colour;
  }
  return "rgb(255, 255, 255)";
};
const ofVariable = (name) => {
  const probe = document.createElement("i");
  probe.style.color = `var(${name})`;
  document.body.append(probe);
  return ratioOf(getComputedStyle(probe).color, behind(probe));
};
"""

CONTRASTS = (
    RATIO
    + """
const found = [];
const words = "h1, h2, p, li, dt, dd, a, th, td, caption, figcaption, output, label, button";
for (const element of document.querySelectorAll(`${words}, .plot text`)) {
  const text = element.textContent.trim();
  if (!text || !element.checkVisibility()) continue;
  const style = getComputedStyle(element);
  const colour = element.namespaceURI.endsWith("svg") ? style.fill : style.color;
  found.push([text.slice(0, 40), ratioOf(colour, behind(element))]);
}
return JSON.stringify(found);
"""
)


def test_a_certificate_is_one_sheet_of_paper(browser, tmp_path):
    """Of the largest: six coordinates, both tolerances, notes and doubts."""
    robot = symkin.load("hexapod_jugglebot")
    poses = symkin.sample_workspace(robot, 30, 5).poses
    readings = robot.inverse_kinematics(poses)
    table = symkin.Measurements.of(
        poses, readings, reading_unit=robot.reading_unit, pose_space=robot.pose_space
    )
    found = symkin.accept(robot, table, 1e-4, 1e-4, judge="largest")
    assert found.verdict == "undecided"
    browser.open(found.report(tmp_path / "certificate.html"))
    browser.call("Emulation.setEmulatedMedia", media="print")
    printed = browser.call("Page.printToPDF", preferCSSPageSize=True)["data"]
    assert len(re.findall(rb"/Type\s*/Page\b", base64.b64decode(printed))) == 1
