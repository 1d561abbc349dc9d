"""`brdf-map`: heights or a table in, an EXR and a picture out, or one line."""

from __future__ import annotations

import json
import os

import numpy as np
import OpenEXR
import pytest
from PIL import Image

pytestmark = pytest.mark.usefixtures("here", "spectral")

# A map of the grating of `heights` that takes half a second.
QUICK = ["--pixel-size", "0.08", "--coherence-width", "6", "--resolution", "32", "--step", "47"]


def channels_of(file):
    """Channels of an EXR by name, and its description."""
    exr = OpenEXR.File(str(file), separate_channels=True)
    return {n: c.pixels for n, c in exr.channels().items()}, json.loads(exr.header()["brdf_map"])


def test_an_exr_and_a_picture_are_written_and_named(run, heights, here):
    ran = run("brdf-map", heights, *QUICK).succeeded()
    assert sorted(os.listdir(here)) == ["grating-map.exr", "grating-map.png"]
    for part in ("grating-map.exr and grating-map.png: 32 x 32 pixels", "360–830 nm", " stops, "):
        assert part in ran.out
    channels, document = channels_of("grating-map.exr")
    assert set(channels) == set("RGBA")
    assert channels["G"].shape == (32, 32)
    assert document["source"] == str(heights)
    with Image.open("grating-map.png") as image:
        assert image.size[0] > 400  # room for axes


def test_options_reach_the_map(run, heights):
    ran = run(
        "brdf-map", heights, *QUICK, "-o", "a.exr", "--theta", "30", "--phi", "90", "--samples",
        "2", "--cosine", "--spectral", "--illuminant", "E", "--wavelength-range", "400:700",
        "--step", "100", "--exposure", "1.5", "--height-scale", "0.5", "--orientation", "90",
        "--material", "none",
    ).succeeded()  # fmt: skip
    assert "exposure +1.5 stops" in ran.out
    channels, document = channels_of("a.exr")
    assert set(channels) == {*"RGBA", "T.450nm", "T.550nm", "T.650nm"}
    expected = {
        "quantity": "f cosθo", "theta": 30.0, "phi": 90.0, "samples": 2, "illuminant": "E",
        "wavelength_range": [400.0, 700.0], "step": 100.0,
    }  # fmt: skip
    assert {key: document[key] for key in expected} == expected
    assert document["surface"] == (
        "R = 1; ensemble, coherence width 6 µm; heights × 0.5; turned by 90°"
    )


def test_a_scan_narrower_than_the_coherence_width_is_marked(run, heights):
    wide = [word.replace("6", "12") if word == "6" else word for word in QUICK]
    for options, width in ((QUICK, "6 µm"), (wide, "12 µm, of orders 6 µm")):
        assert run("brdf-map", heights, *options, "-o", "a.exr").code == 0
        assert channels_of("a.exr")[1]["surface"].endswith(f"coherence width {width}")


def test_notes_on_heights_are_printed_with_a_table_from_the_cache_too(run, heights):
    steep = [*QUICK, "--height-unit", "nm", "--crop", "4"]
    np.save("steep.npy", 400.0 * np.random.default_rng(0).random((64, 64)))
    first, second = (run("brdf-map", "steep.npy", *steep) for _ in range(2))
    for ran in (first, second):
        assert ran.code == 0, ran.err
        assert ran.err.count("on 'steep.npy'") == 1


def test_one_wavelength_is_one_channel_and_a_picture_in_false_colours(run, heights):
    ran = run("brdf-map", heights, *QUICK[:-2], "-o", "a.exr", "--wavelength", "550").succeeded()
    assert set(channels_of("a.exr")[0]) == {"Y", "A"}
    assert "550 nm" in ran.out
    assert "exposure" not in ran.out


def test_tables_and_heights_give_the_same_map(run, heights):
    assert run("precompute", heights, *QUICK[:4], "-o", "table.exr").code == 0
    assert run("brdf-map", heights, *QUICK, "-o", "a.exr").code == 0
    assert run("brdf-map", "table.exr", *QUICK[4:], "-o", "b.exr").code == 0
    a, b = (channels_of(name)[0]["G"] for name in ("a.exr", "b.exr"))
    np.testing.assert_allclose(a, b, rtol=1e-6)


def test_a_preset_stands_in_for_the_source(run, here):
    run(
        "brdf-map", "--preset", "dvd", "--resolution", "8", "--step", "235", "--json", "a.json"
    ).succeeded()
    assert sorted(os.listdir(here)) == ["a.json", "dvd-map.exr", "dvd-map.png"]
