"""Textures of holograms and logos: each dot has the grating of its label, brightness or colour.

Areas of a logo have no colours of their edges.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import mitsuba as mi
import numpy as np
import pytest
from PIL import Image

import mitsuba_diffraction as md
from mitsuba_diffraction.scene.logo import PURPLE, WHITE, areas, logo, wavelengths_of
from scenes.make.sticker import LONGEST, sticker
from tests.support import ROOT
from tests.support.directions import polar
from tests.support.lanes import interaction, lanes, spectra, vectors
from tests.support.logos import COLOURS, drawn

LABELS = np.array([[0, 1, 2], [2, 1, 7]], np.uint8)
PERIODS, TURNS = {1: 0.8, 2: 1.2}, {1: 30.0, 2: -90.0, 7: 0.0}


def degrees(hologram: Any) -> np.ndarray:
    """Angles of the orientation texture."""
    x, y, z = np.moveaxis(hologram.orientation, -1, 0)
    assert not z.any()
    return np.degrees(np.arctan2(y, x))


@pytest.mark.parametrize("as_file", [False, True])
def test_each_label_has_its_grating(tmp_path: Path, as_file: bool) -> None:
    image: Any = LABELS
    if as_file:
        picture = Image.fromarray(LABELS).convert("P")
        picture.putdata(LABELS.ravel().tolist())
        picture.save(image := tmp_path / "labels.png")
    hologram = md.hologram(image, periods=PERIODS, orientations=TURNS)
    assert hologram.period == 1.2
    # label 0 has nothing, label 7 no period
    assert hologram.weight.tolist() == [[0, 1, 1], [1, 1, 0]]
    lit = hologram.weight > 0
    assert (hologram.lateral_scale * 1.2)[lit] == pytest.approx([0.8, 1.2, 1.2, 0.8])
    assert degrees(hologram)[lit] == pytest.approx([30.0, -90.0, -90.0, 30.0], abs=1e-4)
    # factors are positive everywhere, as the plugin wants them
    assert hologram.lateral_scale.min() > 0.0


@pytest.mark.parametrize("kind", [np.uint8, np.uint16, np.float32])
def test_brightness_goes_from_black_to_white(kind: Any) -> None:
    white = np.iinfo(kind).max if np.issubdtype(kind, np.integer) else 1.0
    image = np.array([[0, white / 3, white]]).astype(kind)
    hologram = md.hologram(image, periods=(0.6, 1.2), orientations=45.0, period=1.0)
    assert hologram.weight.tolist() == [[0, 1, 1]]
    assert hologram.lateral_scale[0, 1:] == pytest.approx([0.8, 1.2], rel=1e-4)
    assert degrees(hologram)[0, 1:] == pytest.approx([45.0, 45.0], abs=1e-4)


def test_large_dots_are_round() -> None:
    hologram = md.hologram(LABELS, periods=PERIODS, orientations=0.0, dot=40)
    assert hologram.weight.shape == hologram.lateral_scale.shape == (80, 120)
    dot = hologram.weight[:40, 40:80]
    assert dot.mean() == pytest.approx(np.pi / 4, rel=0.01)  # a disc in its square
    assert not dot[0, 0]
    assert not hologram.weight[:40, :40].any()


@pytest.mark.usefixtures("variant")
def test_order_1_of_each_dot_is_where_its_grating_sends_it() -> None:
    hologram = md.hologram(LABELS, periods=PERIODS, orientations=TURNS)
    field = md.gratings.sinusoidal(hologram.period, 0.05, periods=2, rows=2)
    raw = {"material": "none", "energy_conserving": False, "coherence_width": 12.0}
    grating = md.bsdf_dict(field, **raw, **hologram.parameters())
    bsdf = mi.load_dict(hologram.mix(grating, {"type": "diffuse", "reflectance": 0.0}))
    for label in (1, 2):
        si = interaction(np.tile(polar(0.0), (LABELS.size, 1)), 550.0)
        rows, columns = np.indices(LABELS.shape).reshape(2, -1)
        si.uv = mi.Point2f(lanes((columns + 0.5) / 3), lanes((rows + 0.5) / 2))
        wo = polar(np.degrees(np.arcsin(0.55 / PERIODS[label])), TURNS[label])
        values = spectra(bsdf.eval(mi.BSDFContext(), si, vectors(np.tile(wo, (LABELS.size, 1)))))
        assert ((values[:, 0] > 0.1) == (LABELS.ravel() == label)).all()


@pytest.mark.usefixtures("variant")
def test_the_scene_s_textures_are_those_of_its_maker() -> None:
    made, folder = sticker(), ROOT / "scenes" / "textures"
    assert made.period == LONGEST
    scale = np.array(mi.Bitmap(str(folder / "hologram_lateral_scale.exr")), float)
    assert scale.squeeze() == pytest.approx(made.lateral_scale, abs=1e-3)
    weight = np.array(mi.Bitmap(str(folder / "hologram_weight.png")))
    assert np.array_equal(weight.squeeze(), made.weight * 255)


def test_edges_get_the_colour_of_one_of_their_sides(tmp_path: Path) -> None:
    sharp, smooth = tmp_path / "sharp.png", tmp_path / "smooth.png"
    drawn(128, 1).save(sharp)
    drawn(128, 8).save(smooth)
    expected, found = (areas(file, dots=128) for file in (sharp, smooth))
    # 8 bits of blended means
    assert np.abs(found.colours - np.array(COLOURS)).max() <= 8.0
    assert found.colours.shape == expected.colours.shape
    # pixels on edges may fall to either side
    assert (found.labels != expected.labels).mean() < 0.02
    assert set(np.unique(found.labels)) == {0, 1, 2, 3}


def test_the_ground_of_an_opaque_picture_is_blank_unless_it_is_kept(tmp_path: Path) -> None:
    file = tmp_path / "opaque.png"
    picture = Image.new("RGB", (64, 48), "white")
    picture.paste(drawn(64, 8), (0, 0), drawn(64, 8))
    picture.save(file)
    assert areas(file, dots=64).labels[0, 0] == 0
    kept = areas(file, dots=64, keep_ground=True)
    assert kept.colours[kept.labels[0, 0] - 1] == pytest.approx([255] * 3)


def test_at_most_so_many_colours(tmp_path: Path) -> None:
    file = tmp_path / "noise.png"
    rng = np.random.default_rng(1)
    Image.fromarray(rng.integers(0, 256, (40, 40, 3), np.uint8)).save(file)
    assert len(areas(file, colours=3, dots=40).colours) == 3


@pytest.mark.parametrize(
    ("colour", "low", "high"),
    [((255, 0, 0), 600, 620), ((255, 255, 0), 565, 575), ((0, 255, 0), 540, 555),
     ((0, 0, 255), 460, 470)],
)  # fmt: skip
def test_a_hue_has_its_dominant_wavelength(
    colour: tuple[int, ...], low: float, high: float
) -> None:
    # of sRGB's primaries: 611.4, 549.1 and 464.3 nm (their chromaticities in IEC 61966-2-1)
    (found,) = wavelengths_of(np.array(colour, float))
    assert low < found < high


def test_white_and_purple_are_mixtures() -> None:
    assert wavelengths_of(np.array([200.0, 205.0, 200.0])) == WHITE
    assert wavelengths_of(np.array([255.0, 0.0, 255.0])) == PURPLE


def test_periods_send_the_wavelengths_to_the_camera(tmp_path: Path) -> None:
    drawn(64, 8).save(tmp_path / "logo.png")
    parts = areas(tmp_path / "logo.png", dots=64)
    foil = logo(parts, tangential=np.array([0.4, 0.6]), orientation=90.0, period=1.3)
    inside = np.s_[1:-1, 1:-1]
    rows = 0.6 - 0.2 * (np.arange(48) + 0.5) / 48
    shown = foil.lateral_scale[inside] * 1.3e3 * rows[:, None]  # λ = Λ L, nm
    for number, colour in enumerate(parts.colours, 1):
        here = parts.labels == number
        # halves of single precision
        assert set(np.round(shown[here])) <= set(np.round(wavelengths_of(colour)))
        assert foil.weight[inside][here] == pytest.approx(colour.max() / 255.0)
    edges = np.ones(foil.weight.shape, bool)
    edges[inside] = False
    assert not foil.weight[edges].any()
    assert not foil.weight[inside][parts.labels == 0].any()
