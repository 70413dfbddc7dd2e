"""Every reader can distinguish the colours of a report from each other and from the paper, in both themes."""

import re
from importlib.resources import files
from itertools import combinations

import numpy as np
import pytest

CSS = files("camcomp.report").joinpath("assets", "page.css").read_text()
# Machado, Oliveira, Fernandes 2009, full loss of one kind of cone, for linear RGB.
SIGHT = {
    "all cones": np.eye(3),
    "no red cones": np.array(
        [[0.152286, 1.052583, -0.204868], [0.114503, 0.786281, 0.099216], [-0.003882, -0.048116, 1.051998]]
    ),
    "no green cones": np.array(
        [[0.367322, 0.860646, -0.227968], [0.280085, 0.672501, 0.047413], [-0.011820, 0.042940, 0.968881]]
    ),
    "no blue cones": np.array(
        [[1.255528, -0.076749, -0.178779], [-0.078411, 0.930809, 0.147602], [0.004733, 0.691367, 0.303900]]
    ),
}
CURVES = ["ink", "c1", "c2", "c3", "c4", "c5"]


def theme(name):
    block = re.search(
        re.escape(':root[data-theme="dark"] {' if name == "dark" else ":root {") + r"(.*?)\}", CSS, re.DOTALL
    )[1]
    return dict(re.findall(r"--([\w-]+):\s*(#[0-9a-f]{6})", block))


def linear(colour):
    value = np.array([int(colour[i : i + 2], 16) for i in (1, 3, 5)]) / 255
    return np.where(value <= 0.04045, value / 12.92, ((value + 0.055) / 1.055) ** 2.4)


def contrast(a, b):
    """Contrast ratio of WCAG 2."""
    low, high = sorted(float(linear(c) @ [0.2126, 0.7152, 0.0722]) + 0.05 for c in (a, b))
    return high / low


def lab(rgb):
    xyz = np.array([[0.4124, 0.3576, 0.1805], [0.2126, 0.7152, 0.0722], [0.0193, 0.1192, 0.9505]]) @ rgb.clip(0, 1)
    f = np.cbrt(xyz / [0.9505, 1.0, 1.089])
    return np.array([116 * f[1] - 16, 500 * (f[0] - f[1]), 200 * (f[1] - f[2])])


@pytest.mark.parametrize("name", ["light", "dark"])
def test_text_and_curves_stand_out_from_the_paper(name):
    colours = theme(name)
    for text in ("ink", "soft", "link"):
        assert contrast(colours[text], colours["paper"]) >= 4.5, text
        assert contrast(colours[text], colours["card"]) >= 4.5, text
    for ground in ("good-bg", "bad-bg"):
        assert contrast(colours["ink"], colours[ground]) >= 4.5
    for graphic in (*CURVES, "m0", "m1", "m2"):
        assert contrast(colours[graphic], colours["paper"]) >= 3.0, graphic


@pytest.mark.parametrize("name", ["light", "dark"])
@pytest.mark.parametrize("sight", SIGHT)
def test_curves_are_told_apart(name, sight):
    colours = theme(name)
    seen = {each: lab(SIGHT[sight] @ linear(colours[each])) for each in CURVES}
    close = {(a, b): np.linalg.norm(seen[a] - seen[b]) for a, b in combinations(CURVES, 2)}
    assert min(close.values()) >= 25, min(close, key=close.get)


@pytest.mark.parametrize("name", ["light", "dark"])
@pytest.mark.parametrize("sight", SIGHT)
def test_the_scale_rises_in_lightness(name, sight):
    colours = theme(name)
    lightness = [lab(SIGHT[sight] @ linear(colours[each]))[0] for each in ("m0", "m1", "m2")]
    assert np.diff(lightness).min() >= 10, lightness
