# SPDX-License-Identifier: MIT
"""The 3-UPU of the page "Your own leg" as it would stand on a bench, its parts by their names."""

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.colors import LightSource

import symkin

STEEL, ROD, BRASS, PLATE = "#5b6673", "#c3cad2", "#b08d3c", "#8fa7bf"
UP = np.array([0, 0, 1])
BESIDE = np.array([0.14, 0.02, 0])  # m, of a name
LIGHT = LightSource(azdeg=300, altdeg=50)


def square_to(axis):
    first = np.cross(axis, [0.3, 0.9, 0.2])
    first /= np.linalg.norm(first)
    return first, np.cross(axis, first)


def tube(axes, start, end, radius, colour, layer):
    """A cylinder with its two lids."""
    along = (end - start) / np.linalg.norm(end - start)
    across, beside = square_to(along)
    angles, places = np.meshgrid(np.linspace(0, 2 * np.pi, 40), [0, 0, 1, 1])
    radii = np.array([0, radius, radius, 0])[:, None]
    rings = radii[..., None] * (
        np.cos(angles)[..., None] * across + np.sin(angles)[..., None] * beside
    )
    points = start + places[..., None] * (end - start) + rings
    axes.plot_surface(
        *np.moveaxis(points, -1, 0), color=colour, lightsource=LIGHT, linewidth=0,
        antialiased=False, rstride=1, cstride=1, zorder=layer, rasterized=True,
    )  # fmt: skip


def universal_joint(axes, centre, along, layer):
    """Two crossing pins."""
    for pin in square_to(along):
        tube(axes, centre - 0.045 * pin, centre + 0.045 * pin, 0.011, BRASS, layer)


mechanism = symkin.load_mechanism("3UPU")
home = mechanism.home
readings = mechanism.inverse_kinematics(home)
figure = plt.figure(figsize=(6.4, 4.6))
axes = figure.add_subplot(projection="3d", computed_zorder=False)
tube(axes, -0.07 * UP, -0.04 * UP, 0.58, PLATE, 0)
tube(axes, home[:3] + 0.04 * UP, home[:3] + 0.07 * UP, 0.36, PLATE, 9)
for leg in (1, 2, 0):  # from the back
    centres = mechanism.core.joint_centres(leg, home, float(readings[0, leg]))
    lower, upper = centres[0], centres[-1]
    along = (upper - lower) / np.linalg.norm(upper - lower)
    tube(axes, lower - 0.05 * UP, lower, 0.035, STEEL, 1)
    universal_joint(axes, lower, along, 2)
    tube(axes, lower + 0.38 * along, upper - 0.03 * along, 0.014, ROD, 3)
    tube(axes, lower + 0.03 * along, lower + 0.38 * along, 0.03, STEEL, 4)
    tube(axes, upper, upper + 0.05 * UP, 0.035, STEEL, 5)
    universal_joint(axes, upper, along, 6)
text = {"fontsize": 9, "family": "monospace", "zorder": 20}
for name, place in (
    ("lower: U x y", lower),
    ("q: [P] z", lower + 0.3 * along),
    ("upper: U y x", upper),
):
    axes.text(*(place + BESIDE), name, **text)
axes.text(-0.05, -0.52, -0.04, "base", **text)
axes.text(*(home[:3] + 0.07 * UP), "platform", **text, ha="center")
axes.set_box_aspect((1.2, 1.2, 0.85), zoom=1.4)
axes.set(xlim=(-0.6, 0.6), ylim=(-0.6, 0.6), zlim=(-0.1, 0.75))
axes.view_init(elev=22, azim=-50)
axes.set_axis_off()
figure.subplots_adjust(0, 0, 1, 1)
plt.show()
