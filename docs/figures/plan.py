# SPDX-License-Identifier: MIT
"""The poses chosen for leg 1 of the 3-RRR, and where its symmetry carries them."""

import matplotlib.pyplot as plt

import symkin

mechanism = symkin.load_mechanism("3RRR")
candidates = symkin.sample_workspace(mechanism).poses
plan = symkin.make_plan(mechanism, candidates)
figure, panels = plt.subplots(
    1, 3, figsize=(9, 3.4), sharex=True, sharey=True, layout="constrained"
)
for leg, axes in enumerate(panels):
    poses = plan.poses[plan.rows_of(leg)]
    axes.plot(candidates[::10, 0], candidates[::10, 1], ".", ms=1, color="#cccccc")
    points = axes.scatter(
        poses[:, 0], poses[:, 1], c=poses[:, 2], s=30, edgecolor="#222222", lw=0.5
    )
    axes.set(aspect="equal", title=f"leg {leg + 1}", xlabel="x, m")
panels[0].set_ylabel("y, m")
figure.colorbar(points, ax=panels, label="phi, rad", shrink=0.8)
plt.show()
