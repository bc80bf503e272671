# SPDX-License-Identifier: MIT
"""Drawings of all shipped mechanisms and of all chains, made when the pages are built."""

import re
from pathlib import Path

import numpy as np
from docutils import nodes
from docutils.parsers.rst import Directive
from matplotlib.figure import Figure

import symkin
from symkin import plot
from symkin.files.template import mechanism_template
from symkin.model.chains import PLATFORMS, legs_in_words
from symkin.show.skeleton import skeleton_of

ROOT = Path(__file__).parent.parent
FOLDER = ROOT / "build" / "gallery"


def draw(mechanism, name):
    """Draw a mechanism at home, without axes, so that many fit on a page; returns the file."""
    figure = Figure(figsize=(3, 3))
    in_space = mechanism.space.in_space
    # matplotlib keeps room for labels around what is in space.
    place = (-0.12, -0.12, 1.24, 1.24) if in_space else (0.04, 0.04, 0.92, 0.92)
    axes = figure.add_axes(place, projection="3d" if in_space else None)
    pose = mechanism.home
    if not np.ptp(skeleton_of(mechanism, pose).points, axis=0).any():
        pose = (pose + mechanism.workspace.upper) / 2  # at home all joints coincide
    plot.mechanism(mechanism, pose, ax=axes)
    axes.get_legend().remove()
    axes.axis("off")
    path = FOLDER / f"{name}.svg"
    figure.savefig(path, transparent=True, metadata={"Date": None})
    return path


def shipped():
    """Name, mechanism and description, the comment at the head of its file."""
    for name in symkin.shipped_mechanisms():
        mechanism = symkin.load_mechanism(name)
        lines = Path(mechanism.source).read_text(encoding="utf-8").splitlines()[2:]
        comment = []
        for line in lines:
            if not line.startswith("# "):
                break
            comment.append(line.removeprefix("# "))
        yield name, mechanism, re.split(r"(?<! al)\.( |$)", " ".join(comment))[0] + "."


def templates():
    """Name, mechanism and description of what `symkin new` prints for every chain."""
    for platform in PLATFORMS:
        for chain in symkin.chains(platform):
            text = mechanism_template(chain, platform=platform)
            name = f"{chain.replace('[', 'actuated-').replace(']', '-')}-{platform}"
            path = FOLDER / f"{name}.toml"
            path.write_text(text, encoding="utf-8")
            option = "" if platform == "rigid" else f" --platform {platform}"
            mechanism = symkin.load_mechanism(path)
            yield (
                f"{chain}, {mechanism.pose_space}",
                mechanism,
                f'symkin new --chain "{chain}"{option}',
            )


class Gallery(Directive):
    """A card for each of the `mechanisms`, or for each of the `chains`."""

    required_arguments = 1

    def run(self):
        FOLDER.mkdir(parents=True, exist_ok=True)
        of_chains = self.arguments[0] == "chains"
        env = self.state.document.settings.env
        env.note_reread()  # a mechanism may be new though the page is not
        up = "../" * env.docname.count("/") + "../"
        cards = nodes.container(classes=["gallery"])
        for number, (name, mechanism, words) in enumerate(templates() if of_chains else shipped()):
            path = draw(mechanism, f"chain{number}" if of_chains else name)
            uri = up + path.relative_to(ROOT).as_posix()
            card = nodes.container(classes=["card"])
            card += nodes.image(uri=uri, alt=f"Drawing of {name} at home.")
            card += nodes.paragraph("", "", nodes.strong("", name))
            if of_chains:
                card += nodes.paragraph("", "", nodes.literal("", words))
            else:
                kind = f"{legs_in_words(mechanism.legs)}, {mechanism.pose_space}"
                card += nodes.paragraph("", "", nodes.literal("", kind))
                card += nodes.paragraph("", words)
            cards += card
        return [cards]


def setup(app):
    """Register the directive."""
    app.add_directive("mechanism-gallery", Gallery)
    return {"parallel_read_safe": True}
