"""Logos: areas of colour without colours of their edges, and the gratings that show them."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from mitsuba_diffraction import DiffractionError
from mitsuba_diffraction.scene.logo import PURPLE, WHITE, areas, logo, wavelengths_of
from tests.support.logos import COLOURS, drawn


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


def test_pictures_without_enough_colours_are_refused(tmp_path: Path) -> None:
    file = tmp_path / "bad.png"
    for picture, said in (
        (Image.new("RGB", (9, 9), "red"), "no colour beside its ground"),
        (Image.new("RGBA", (9, 9), (0, 0, 0, 255)), "no colour beside its ground"),
        (Image.new("RGBA", (9, 9), (255, 0, 0, 0)), "transparent everywhere"),
    ):
        picture.save(file)
        with pytest.raises(DiffractionError, match=said):
            areas(file)
    file.write_bytes(b"no picture")
    with pytest.raises(DiffractionError, match="cannot be read as a picture"):
        areas(file)
