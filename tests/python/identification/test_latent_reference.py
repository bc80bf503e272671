# SPDX-License-Identifier: MIT
"""Maximum likelihood with latent poses against ten cases that were made independently."""

import json

import numpy as np
import pytest

import symkin
from symkin import _core

AXES = "xyz"
RENAMED = {"sensor_cos": "sensor_cosine", "sensor_sin": "sensor_sine"}
# Of a delta whose towers stand upright from z = 0.
DELTA = {"base_angle": "base_azimuth"}
UPRIGHT = {"base_height": 0.0, "guide_elevation": np.pi / 2, "guide_swing": 0.0}


def cases(folder):
    return json.loads((folder / "estimation.json").read_text())["cases"]


def rows(values, columns):
    return np.array(
        [[np.nan] * columns if v is None else [np.nan if x is None else x for x in np.atleast_1d(v)]
         for v in values],
        dtype=float,
    )  # fmt: skip


def observed(values, deviations):
    if values is None:
        return _core.Observed(np.zeros((0, 0)), np.zeros((0, 0)))
    shape = values.shape[0], np.shape(deviations)[-1] if np.ndim(deviations) else values.shape[1]
    return _core.Observed(values, np.ascontiguousarray(np.broadcast_to(deviations, shape)))


def quaternions(matrices):
    # Of a trace well above -1, as all of these are.
    found = []
    for matrix in np.array(matrices):
        w = np.sqrt(1 + np.trace(matrix)) / 2
        skew = matrix - matrix.T
        found.append([*(np.array([skew[2, 1], skew[0, 2], skew[1, 0]]) / (4 * w)), w])
    return np.array(found)


class Case:
    def __init__(self, case):
        self.case = case
        legs = case["legs"]
        in_space = len(case["start_poses"][0]) == 3 and case["platform"] == "point"
        platform = {"point": "translating" if in_space else "point"}.get(case["platform"], "rigid")
        self.renamed = RENAMED | (DELTA if in_space else {})
        if in_space:
            legs = [
                {self.renamed.get(name, name): value for name, value in leg.items()} | UPRIGHT
                for leg in legs
            ]
        names = symkin.chain_info(case["chain"], platform).parameter_names
        self.mechanism = symkin.Mechanism(
            case["name"],
            [
                symkin.Leg(case["chain"], {n: leg[n] for n in names if n in leg},
                           leg.get("working_mode", -1))
                for leg in legs
            ],
            platform=platform,
        )  # fmt: skip
        self.core = self.mechanism.core
        self.space = self.mechanism.pose_space
        self.dim = self.mechanism.space.size
        self.dof = self.core.dof
        self.setup = _core.Setup(
            self.core,
            np.array([[leg.get(f"sensor_{t}", 0) for t in ("quadratic", "cos", "sin")]
                      for leg in case["legs"]]),
            self.frame("base"),
            self.frame("target"),
            self.points(),
            np.zeros((0, 3)),
            np.array(case.get("plane", [0, 0, 0]), dtype=float),
        )  # fmt: skip

    def frame(self, which):
        frame = self.case["frames"].get(which)
        position, rotation = np.zeros(3), np.eye(3)
        if frame:
            position[: self.dim] = frame["position"]
            if self.dim == 3:
                rotation = np.array(frame["rotation_matrix"])
            else:
                c, s = np.cos(frame["angle"]), np.sin(frame["angle"])
                rotation[:2, :2] = [[c, -s], [s, c]]
        return _core.Frame(position, rotation)

    def points(self):
        values = np.reshape(self.case.get("points", []), (-1, self.dim))
        points = np.zeros((len(values), 3))
        points[:, : self.dim] = values
        return points

    def scalar(self, name):
        """The name in symkin of a scalar of the file."""
        if name.startswith("points_"):
            number = int(name.split("_")[1])
            return f"point{number // self.dim + 1}.{AXES[number % self.dim]}"
        if name.startswith("plane_"):
            return f"plane.c{name.split('_')[1]}"
        for frame in ("base", "target"):
            if name.startswith(f"{frame}_frame_"):
                return f"{frame}.{name.split('_')[-1]}"
        parameter, leg = name.rsplit("_", 1)
        return f"leg{leg}.{self.renamed.get(parameter, parameter)}"

    def layout(self, held=()):
        names = _core.unknown_names(self.core, self.setup)
        members = {shared["name"]: shared["members"] for shared in self.case["shared"]}
        order = [name for name in self.case["parameter_order"] if name not in held]
        column = [-1] * len(names)
        for number, name in enumerate(order):
            for member in members.get(name, [name]):
                column[names.index(self.scalar(member))] = number
        prior = np.full(len(order), np.inf)
        for each in self.case["priors"]:
            prior[order.index(each["parameter"])] = each["sd"]
        return order, column, prior

    def observations(self):
        data = self.case["measurements"]
        readings = rows(data["readings"], len(self.case["legs"]))
        count = len(readings)
        poses = deviations = None
        if "position" in data:
            poses = np.full((count, self.mechanism.space.coordinates), np.nan)
            deviations = np.full(self.dof, np.nan)
            poses[:, : self.dim] = rows(data["position"], self.dim)
            deviations[: self.dim] = [np.nan if d is None else d for d in data["position_sd"]]
            if "angle" in data:
                poses[:, 2] = rows(data["angle"], 1)[:, 0]
                deviations[2] = data["angle_sd"]
            if "rotation_matrix" in data:
                poses[:, 3:] = quaternions(data["rotation_matrix"])
                deviations[3:] = data["rotation_sd"]
        points = heights = None
        if "points" in data:
            points = np.array(
                [[[np.nan] * self.dim if p is None else p for p in pose]
                 for pose in data["points"]],
                dtype=float,
            ).reshape(count, -1)  # fmt: skip
        if "plane_height" in data:
            heights = rows(data["plane_height"], 1)
        return _core.Observations(
            observed(readings, data["reading_sd"]),
            observed(poses, deviations),
            observed(None, None),
            observed(points, data.get("points_sd")),
            observed(None, None),
            observed(heights, data.get("plane_height_sd")),
        )

    def start(self):
        poses = self.case["start_poses"]
        if self.space != "spatial":
            return np.array(poses)
        return np.array(
            [[*p["position"], *q] for p, q in
             zip(poses, quaternions([p["rotation_matrix"] for p in poses]), strict=True)]
        )  # fmt: skip

    def fit(self, held=(), nearest=False):
        order, column, prior = self.layout(held)
        loss = self.case["expected"].get("loss")
        return order, _core.fit_jointly(
            self.core,
            self.setup,
            self.observations(),
            column,
            prior,
            loss["kind"] if loss else "none",
            loss["scale"] if loss else 0.0,
            1.0,
            100,
            nearest,
            np.array([0.0 if "frame" in name else 1e-3 for name in order]),
            self.start(),
        )

    def values(self, order, change):
        members = {shared["name"]: shared["members"] for shared in self.case["shared"]}
        start = dict(self.nominal())
        return np.array(
            [start[members.get(name, [name])[0]] + c for name, c in zip(order, change, strict=True)]
        )

    def nominal(self):
        for number, leg in enumerate(self.case["legs"], 1):
            for name, value in leg.items():
                yield f"{name}_{number}", value
        for which, frame in self.case["frames"].items():
            for axis, value in zip(AXES, frame["position"], strict=False):
                yield f"{which}_frame_{axis}", value
            yield f"{which}_frame_phi", frame.get("angle", 0.0)
            for axis in AXES:
                yield f"{which}_frame_r{axis}", np.nan  # counted from the estimate
        for kind in ("plane", "points"):
            for number, value in enumerate(self.case.get(kind, [])):
                yield f"{kind}_{number}", value


@pytest.fixture(params=range(10))
def case(request, shared_reference):
    return Case(cases(shared_reference)[request.param])


def test_estimates_deviations_and_chi_square_equal_the_reference(case):
    gauge = "gauge" in case.case["expected"]
    order, fit = case.fit(nearest=gauge)
    expected = case.case["expected"]
    assert fit.converged, fit.failure
    deviations = np.array(expected["sd"])
    estimate = case.values(order, fit.change)
    counted = np.isfinite(estimate)
    np.testing.assert_allclose(
        estimate[counted], np.array(expected["estimate"])[counted], rtol=0, atol=1e-9
    )
    if "loss" in expected:
        # The reference's deviations are of the weights alone.
        np.testing.assert_allclose(fit.loss_weights, expected["weights"], atol=1e-9)
    else:
        np.testing.assert_allclose(np.sqrt(np.diag(fit.covariance)), deviations, rtol=1e-9)
    total = fit.chi_square_data + fit.chi_square_prior
    assert total == pytest.approx(expected["chi_square"], rel=1e-9)
    assert sum(fit.conditions) == expected["conditions"]
    priors = len(case.case["priors"])
    assert sum(fit.conditions) + priors - fit.rank == expected["degrees_of_freedom"]
    assert fit.data_rank == expected.get("rank_of_data", expected["rank"])
    for frame in ("base", "target"):
        rotation = expected.get(f"{frame}_rotation_matrix")
        if rotation is not None:
            np.testing.assert_allclose(getattr(fit.setup, frame).rotation, rotation, atol=1e-10)
