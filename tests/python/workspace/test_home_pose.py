# SPDX-License-Identifier: MIT
"""A home pose that cannot define the workspace: what is said, and what check still shows."""

import re

import numpy as np
import pytest

import symkin
from symkin.analysis.checks import check_mechanism
from symkin.errors import MechanismFileError
from symkin.model.settings import WorkspaceSettings


@pytest.fixture
def singular_file(tmp_path):
    """The shipped 3-RPR with home where base and platform are alike: all legs meet in a point."""
    shipped = symkin.load_mechanism("3RPR").source
    path = tmp_path / "singular.toml"
    text = re.sub(r"(?m)^home = .*$", 'home = ["0 m", "0 m", "0 deg"]', shipped.read_text())
    path.write_text(text)
    return path


def test_a_singular_home_is_refused_at_its_line_with_a_home_that_would_do(singular_file):
    mechanism = symkin.load_mechanism(singular_file)
    with pytest.raises(MechanismFileError) as caught:
        symkin.sample_workspace(mechanism, 10)
    line = singular_file.read_text()[: singular_file.read_text().index("\nhome =")].count("\n") + 2
    assert (caught.value.line, caught.value.key) == (line, "workspace.home")
    message = str(caught.value)
    assert "(0, 0, 0) is singular" in message
    assert "conditioning_limit is 10" in message
    better = re.search(r"such as \(([^)]*)\) \(m, rad\)", message)
    home = tuple(float(value) for value in better[1].split(", "))
    settings = mechanism.workspace
    moved = mechanism.replace(
        workspace=WorkspaceSettings(
            lower=settings.lower, upper=settings.upper, conditioning_limit=10, home=home
        )
    )
    assert len(symkin.sample_workspace(moved, 10).poses) == 10


def test_a_mechanism_that_was_never_a_file_is_named_instead(singular_file):
    mechanism = symkin.load_mechanism(singular_file).replace(source=None)
    with pytest.raises(symkin.SymkinError, match=r'mechanism "3RPR": the home pose .* is singular'):
        symkin.sample_workspace(mechanism, 10)


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"reach_margin": 0.9}, r"m within the reach of leg \d, and reach_margin is 0.9 m"),
        ({"conditioning_limit": 1.0}, r"condition number [\d.]+, and conditioning_limit is 1;"),
    ],
)
def test_a_home_that_misses_a_limit_is_refused_with_the_figure_and_the_limit(paper, change, said):
    settings = paper.workspace
    asked = WorkspaceSettings(
        lower=settings.lower,
        upper=settings.upper,
        **{"characteristic_length": settings.characteristic_length, **change},
    )
    with pytest.raises(MechanismFileError, match=said) as caught:
        symkin.sample_workspace(paper.replace(workspace=asked), 10)
    assert "none of 2000 poses of the workspace box would do either" in str(caught.value)


def test_check_shows_what_needs_no_workspace_before_it_refuses_the_home(singular_file):
    result = check_mechanism(symkin.load_mechanism(singular_file))
    assert result.comparison.verdict == "exact"
    assert [origin.element for origin in result.origins] == ["r0", "r1", "r2"]
    assert np.isfinite(result.home.readings).all()
    assert (result.sample, result.conditions, result.observability) == (None, None, ())
    assert "is singular" in result.untested
