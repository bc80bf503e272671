# SPDX-License-Identifier: MIT
"""Small runs of the protocol and the reports that they give."""

import dataclasses
import re
from html.parser import HTMLParser

import pytest

import symkin
from symkin.model.settings import ProtocolSettings


class Page(HTMLParser):
    """A page's tags with their attributes, its texts, and its tables by caption."""

    def __init__(self, path):
        super().__init__()
        self.folder = path.parent
        self.source = path.read_text(encoding="utf-8")
        self.tags = []
        self.tables = {}
        self._open = []
        self._cell = None
        self._rows = []
        self.feed(self.source)
        self.close()

    def handle_starttag(self, tag, attributes):
        self.tags.append((tag, dict(attributes)))
        if tag == "table":
            self._rows = []
        elif tag == "tr":
            self._rows.append([])
        elif tag in ("caption", "td", "th"):
            self._cell = ""

    def handle_data(self, data):
        if self._cell is not None:
            self._cell += data

    def handle_endtag(self, tag):
        if tag == "caption":
            self.tables[self._cell] = self._rows
            self._cell = None
        elif tag in ("td", "th"):
            self._rows[-1].append(self._cell)
            self._cell = None

    def row(self, caption, heading):
        """The cells of the one row with this heading, which is left out."""
        (found,) = [row[1:] for row in self.tables[caption] if row[:1] == [heading]]
        return found

    def all(self, tag):
        """The attributes of all tags of a kind."""
        return [attributes for name, attributes in self.tags if name == tag]

    @property
    def figures(self):
        """The names of the figures."""
        names = [attributes.get("id", "") for attributes in self.all("figure")]
        return {name.removeprefix("figure-") for name in names if name}

    def assert_self_contained(self):
        """Nothing is loaded from elsewhere."""
        assert not re.search(r"https?:|url\((?!#)|@import", self.source)
        assert not self.all("link")
        assert not [attributes for _, attributes in self.tags if "src" in attributes]
        assert not self.all("img")
        for attributes in self.all("image"):
            assert attributes["href"].startswith("data:image/png;base64,")
        for attributes in self.all("use"):
            assert attributes["href"].startswith("#")


@pytest.fixture(scope="session")
def page_of():
    """Reads a page."""
    return Page


def small(mechanism, candidates=400, pose_count=16):
    settings = ProtocolSettings(pose_count=pose_count, candidates=candidates, seed=3)
    return mechanism.replace(protocol=settings)


@pytest.fixture(scope="session")
def planar_result(paper):
    return symkin.run_protocol(small(paper))


@pytest.fixture(scope="session")
def spatial_result(hexapod):
    return symkin.run_protocol(small(hexapod))


@pytest.fixture(scope="session")
def planar_page(planar_result, tmp_path_factory):
    folder = tmp_path_factory.mktemp("planar") / "new"
    return Page(planar_result.report(folder / "report.html", all_figures=True))


@pytest.fixture(scope="session")
def spatial_page(spatial_result, tmp_path_factory):
    path = tmp_path_factory.mktemp("spatial") / "report.html"
    return Page(spatial_result.report(path, all_figures=True))


@pytest.fixture(scope="session")
def measured(hexapod, hexapod_table):
    """What is identified from the hexapod's measurements, with its cross-validation."""
    measurements = symkin.read_measurements(hexapod_table, hexapod)
    validation = symkin.cross_validate(hexapod, measurements, 5)
    found = symkin.identify(hexapod, measurements, loss="tukey")
    return dataclasses.replace(found, cross_validation=validation)


@pytest.fixture(scope="session")
def measured_page(measured, tmp_path_factory):
    path = tmp_path_factory.mktemp("measured") / "report.html"
    return Page(measured.report(path, all_figures=True))
