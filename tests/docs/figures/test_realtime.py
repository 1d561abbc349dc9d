"""The table and picture of the shaders are those that `compare` wrote."""

from __future__ import annotations

import json

import pytest
from PIL import Image

from docs.make.figures import realtime


@pytest.fixture
def compared(tmp_path):
    found = {
        "pixels": 640, "delta_e_mean": 0.4567, "delta_e_percentiles": {"99": 3.21},
        "flip": 0.0213, "relative_rmse": None,
    }  # fmt: skip
    noise = {"delta_e_mean": 0.28, "delta_e_99": 1.5}
    entry = {
        "direct": found, "full": None, "noise": noise, "frame_ms": 250.0, "samples": 2048,
        "fragment_ns": 35.2, "texture_bytes": 2.1e7,
    }  # fmt: skip
    slow = {"texture_bytes": 4.2e7, "direct": {**found, "delta_e_mean": 0.321}, "frame_ms": 500.0}
    document = {
        "scene": "scenes/plate.xml", "size": [64, 40], "driver": "abacus", "noise": noise,
        "frames": 512, "spp": 4096, "clipped": 0.0104,
        "methods": {"fast": entry, "exact": {**entry, **slow}, "flss": entry},
    }  # fmt: skip
    folder = tmp_path / "compared"
    folder.mkdir()
    (folder / "compare.json").write_text(json.dumps(document), "utf-8")
    Image.new("RGB", (320, 80), (10, 20, 30)).save(folder / "fast.png")
    return folder


@pytest.fixture
def page(tmp_path):
    (tmp_path / realtime.SHEET).parent.mkdir(parents=True)
    file = tmp_path / "realtime.md"
    file.write_text("<!-- begin realtime -->\nstale\n<!-- end realtime -->\n", "utf-8")
    return file


def test_table_and_sheet_are_replaced(compared, page):
    assert realtime.main([str(compared), "-o", str(page)]) == 0
    text = page.read_text("utf-8")
    assert "| [plate](../scenes/plate.xml) | 0.46 | 0.32 | 0.28 | 0.28 |" in text
    assert "of the pixels have at most 3.21" in text
    assert "`exact` takes 2.00 times as long" in text
    assert "21.0 MB (`fast`) and 42.0 MB (`exact`)" in text
    assert "stale" not in text
    with Image.open(page.parent / realtime.SHEET) as image:
        assert image.size == (1600, 400)


def test_a_larger_picture_takes_the_sheets_place(compared, page, tmp_path):
    larger = tmp_path / "larger"
    larger.mkdir()
    Image.new("RGB", (320, 160), (10, 20, 30)).save(larger / "fast.png")
    assert realtime.main([str(compared), "--sheet", str(larger), "-o", str(page)]) == 0
    with Image.open(page.parent / realtime.SHEET) as image:
        assert image.size == (1600, 800)
