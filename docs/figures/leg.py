# SPDX-License-Identifier: MIT
"""The parameters of a leg, drawn on a 3-RRR with proportions that show them well."""

import matplotlib.pyplot as plt
import numpy as np

import symkin

POSE = np.array([0.75, 0.95, 0.3])
BASE, PLATFORM, LINK, MUTED = "#1f5a99", "#b4501e", "#222222", "#bbbbbb"


def unit(angle):
    return np.array([np.cos(angle), np.sin(angle)])


def label(axes, text, point, offset=(0, 0), **style):
    axes.annotate(
        text, point, offset, textcoords="offset points", ha="center", va="center", **style
    )


def arc(axes, centre, radius, start, end, colour):
    angles = np.linspace(start, end, 50)
    axes.plot(*(centre[:, None] + radius * unit(angles)), color=colour, lw=0.8)
    return centre + 1.22 * radius * unit((start + end) / 2)


def frame(axes, origin, angle, length, names, colour):
    for name, turn in zip(names, (0, np.pi / 2), strict=True):
        tip = origin + length * unit(angle + turn)
        axes.annotate("", tip, origin, arrowprops={"arrowstyle": "->", "color": colour})
        label(axes, name, tip, 8 * unit(angle + turn), color=colour)


mechanism = symkin.load_mechanism("3RRR")
drawn = dict(zip(mechanism.parameter_names, mechanism.parameters.T.copy(), strict=True))
drawn |= {
    "proximal_length": np.full(3, 1.2),
    "distal_length": np.full(3, 1.9),
    "base_radius": np.full(3, 2.4),
    "platform_radius": np.full(3, 0.75),
}
mechanism = mechanism.with_parameters(np.column_stack(list(drawn.values())))
values = [dict(zip(mechanism.parameter_names, row, strict=True)) for row in mechanism.parameters]
readings = mechanism.inverse_kinematics(POSE)[0]
figure, axes = plt.subplots(figsize=(7.2, 5.6), layout="constrained")
axes.set(aspect="equal")
axes.axis("off")

points = []
for number, (leg, reading) in enumerate(zip(values, readings, strict=True)):
    base = leg["base_radius"] * unit(leg["base_angle"])
    crank = leg["sensor_gain"] * reading + leg["sensor_offset"]
    elbow = base + leg["proximal_length"] * unit(crank)
    b = POSE[:2] + leg["platform_radius"] * unit(POSE[2] + leg["platform_angle"])
    points.append(b)
    colour = LINK if number == 0 else MUTED
    axes.plot(*np.array([base, elbow, b]).T, color=colour, lw=2.5, marker="o", ms=5)
    if number == 0:
        A, C, B, q = base, elbow, b, crank
axes.add_patch(plt.Polygon(points, facecolor="#f3e3da", edgecolor=PLATFORM, lw=1.2, zorder=0))

origin = np.zeros(2)
axes.plot(*np.array([origin, A]).T, color=BASE, ls="--", lw=0.9)
axes.plot(*np.array([POSE[:2], B]).T, color=PLATFORM, ls="--", lw=0.9)
axes.plot(*np.array([A, A + 1.0 * unit(0)]).T, color=MUTED, ls=":", lw=0.9)
frame(axes, origin, 0, 0.6, ("$X$", "$Y$"), BASE)
frame(axes, POSE[:2], POSE[2], 0.5, ("$u$", "$v$"), PLATFORM)

at = arc(axes, origin, 0.25, 0, values[0]["base_angle"], BASE)
label(axes, r"$\beta$", at, (-14, -24), color=BASE)
at = arc(axes, A, 0.55, 0, q, LINK)
label(axes, r"$q = k\psi + \gamma$", at, (30, -14), color=LINK)
at = arc(axes, POSE[:2], 0.2, POSE[2], POSE[2] + values[0]["platform_angle"], PLATFORM)
label(axes, r"$\beta_b$", at, (-4, 6), color=PLATFORM)
label(axes, r"$OA$", (origin + A) / 2, (-2, 11), color=BASE)
label(axes, r"$ob$", (POSE[:2] + B) / 2, (7, -8), color=PLATFORM)
label(axes, "$l$", (A + C) / 2, (-10, 4))
label(axes, "$L$", (C + B) / 2, (0, 10))
for text, point, offset in (
    ("$A$", A, (-10, -8)),
    ("$b$", B, (-10, 8)),
    ("$O$", origin, (6, -10)),
    ("$o$", POSE[:2], (8, -8)),
):
    label(axes, text, point, offset)
plt.show()
