# SPDX-License-Identifier: MIT
"""How edits of a table are looked for where frames are unknown."""

from __future__ import annotations

import dataclasses

import numpy as np

import symkin
from symkin.estimate.evidence.trial import Correction


def test_where_an_edit_explains_all_nothing_is_set_free_to_look_for_a_cause(paper, monkeypatch):
    plan = symkin.make_plan(paper, symkin.sample_workspace(paper, 300, seed=1), 40, seed=1)
    sound = symkin.simulate(paper, plan, seed=3).measurements.for_all_legs()
    late = dataclasses.replace(sound, readings=np.roll(sound.readings, 1, axis=0))
    late = late.subset(np.arange(1, len(late)))
    freed = []
    fit = Correction.fit

    def counted(self, *given, **options):
        freed.append(self.wide)
        return fit(self, *given, **options)

    monkeypatch.setattr(Correction, "fit", counted)
    found = symkin.identify(paper, late, frames=["base", "target"])
    assert "rows-shifted" in {each.code for each in found.doubts}
    assert freed
    assert not any(freed)
