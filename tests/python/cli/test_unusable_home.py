# SPDX-License-Identifier: MIT
"""A workspace that cannot be sampled, on the command line."""

import re
from pathlib import Path

MECHANISMS = Path(__file__).parents[3] / "mechanisms"


def test_check_shows_what_it_can_and_ends_with_the_one_sentence(symkin, tmp_path):
    text = (MECHANISMS / "3RPR.toml").read_text()
    path = tmp_path / "singular.toml"
    path.write_text(re.sub(r"(?m)^home = .*$", 'home = ["0 m", "0 m", "0 deg"]', text))
    told = symkin("check", path, "--verbose", "--out", tmp_path / "page")
    assert told.code == 2
    assert "The legs have the declared symmetry D_6 (D_3)." in told.out
    assert "conditions and identifiability are not tested" in told.out
    assert told.err.count("Error:") == 1
    assert f"{path}:" in told.err
    assert "workspace.home" in told.err
    assert "is singular" in (tmp_path / "page" / "check.html").read_text()
    assert symkin("check", path, "--json").json["conditions"] is None
