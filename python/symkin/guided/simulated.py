# SPDX-License-Identifier: MIT
"""A measuring device that there is not, beside a robot that was made within its tolerances."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterable, Iterator
from typing import Any

import numpy as np

from symkin.analysis.observed import Observable, Observed
from symkin.data.measurements import Measurements
from symkin.data.observables import PAIR
from symkin.data.tries import LINK, ROW
from symkin.guided.device import VERSION
from symkin.guided.session import Ask
from symkin.model.given import MechanismGiven, as_mechanism
from symkin.model.mechanism import Mechanism
from symkin.planning.simulation import disturb


class SimulatedDevice:
    """Measures what a robot would do; a callable that takes an `Ask`.

    Parameters
    ----------
    mechanism : Mechanism
        The nominal one, whose noise it has.
    seed : int
        Of the robot, unless `actual` is given, of the noise, and of what is lost.
    actual : Mechanism, optional
        The robot as made.
    observe : str or sequence of str
        What it measures besides the readings.
    lost : float
        Share of the poses whose target it loses.
    """

    def __init__(
        self,
        mechanism: MechanismGiven,
        seed: int = 1,
        actual: MechanismGiven | None = None,
        *,
        observe: Observable | Iterable[Observable] = "pose",
        lost: float = 0.0,
    ) -> None:
        self.nominal: Mechanism = as_mechanism(mechanism)
        self.actual = disturb(self.nominal, seed) if actual is None else as_mechanism(actual)
        kinds = (observe,) if isinstance(observe, str) else tuple(observe)
        frames = self.nominal.frames
        points = frames.points if frames and "points" in kinds else ()
        anchors = frames.anchors if frames and "distance" in kinds else ()
        self._observed = Observed(kinds, points=points, anchors=anchors).in_frames(frames)
        self._random, self._lost = np.random.default_rng([seed, 8]), lost
        self._before: tuple[Any, Any] | None = None  # where it was, and the readings there

    def __call__(self, ask: Ask) -> dict[str, float] | str:
        """Measure; values by column, or why not."""
        return self.at(ask.readings, second=ask.partner is not None)

    def at(self, readings: Any, *, second: bool = False) -> dict[str, float] | str:
        """The same at commanded readings; of the `second` of a pair with the one before."""
        poses, taken = self.actual.forward_kinematics(np.array([readings]))
        lost = self._random.random() < self._lost
        if not taken[0]:
            return "unreachable"
        if lost:
            return "lost"
        before, self._before = self._before, (poses[0], np.array(readings))
        visited = [before, self._before] if second and before else [self._before]
        exact = Measurements.of(
            np.array([each for each, _ in visited]),
            np.array([each for _, each in visited]),
            reading_unit=self.nominal.reading_unit,
            pose_space=self.nominal.pose_space,
        )
        seed = int(self._random.integers(2**31))
        row = self._observed.measure(exact, self.nominal.noise, seed).columns(self.nominal)
        paired = self._observed.together > 1
        return {
            name: float(np.asarray(values)[-1])
            for name, values in row.items()
            if not paired or (name not in (ROW, LINK) and (second or not name.startswith(PAIR)))
        }

    def serve(self, lines: Iterable[str], say: Callable[[str], object]) -> None:
        """Speak the protocol of devices until there are no more lines."""
        for line in lines:
            for answer in self._answers(json.loads(line)):
                say(json.dumps(answer))

    def _answers(self, said: dict[str, Any]) -> Iterator[dict[str, Any]]:
        if "hello" in said:
            yield {"symkin": VERSION, "device": "simulated", "moves": True, "timeout_s": 60}
        if "measure" not in said:
            return
        asked = said["measure"]
        found = self.at(asked["readings"], second=asked.get("partner") is not None)
        if isinstance(found, str):
            yield {"id": said["id"], "error": found, "retry": False}
            return
        measured = {name: None if np.isnan(value) else value for name, value in found.items()}
        readings = [measured.pop(name) for name in list(measured) if name.startswith("psi_")]
        yield {"id": said["id"], "measured": measured, "readings": readings}
