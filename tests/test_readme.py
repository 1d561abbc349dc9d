"""What the README shows works: its examples run, and it is short."""

from __future__ import annotations

from pathlib import Path

import mitsuba as mi
import numpy as np
import pytest
from PIL import Image

from mitsuba_diffraction.heights import GENTLE_SLOPE, STEEP_SLOPE
from tests.support.pages import PAGES, blocks

README = PAGES["README.md"]


@pytest.fixture(autouse=True)
def elsewhere(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Examples write into the current folder."""
    monkeypatch.chdir(tmp_path)


def test_python_example_makes_a_picture():
    # Mitsuba writes in the background and only waits for it at exit
    exec(blocks("README.md", "python")[0].replace("spp=32)", "spp=1), write_async=False"), {})
    with Image.open("ball.png") as picture:
        assert np.ptp(np.asarray(picture.convert("L"))) > 0


def test_xml_example_loads():
    mi.set_variant("llvm_ad_spectral")
    x = np.arange(64)
    rows = np.tile(np.uint8(127 + 127 * np.sin(2 * np.pi * x / 32)), (64, 1))
    Image.fromarray(rows).save("scale.png")
    (xml,) = blocks("README.md", "xml")
    Path("scene.xml").write_text(f'<scene version="3.0.0">{xml}</scene>', encoding="utf-8")
    scene = mi.load_file("scene.xml")
    assert "Diffraction" in str(scene.shapes()[0].bsdf())


@pytest.mark.parametrize(
    ("stated", "page", "measured"),
    [
        (f"less than 5 % in the mean up to an RMS slope of {GENTLE_SLOPE:g}", "validation",
         ("less than 5 %", f"{GENTLE_SLOPE:g}")),
        (f"less than 20 % up to {STEEP_SLOPE:g}", "validation",
         ("less than 20 %", f"{STEEP_SLOPE:g}")),
        ("7.3 %", "validation", ("keratin, cuts of scales, slope 0.2 ", "| 7.3 %,")),
        ("22 to 73 % in the mean", "validation",
         ("keratin, walls, depth/period above 0.08 ", "| 22 %")),
        ("22 to 73 % in the mean", "validation",
         ("aluminium, walls, depth/period above 0.08 ", "| 73 %,")),
        ("0.8 %", "orders", ("within 0.8 %",)),
    ],
)  # fmt: skip
def test_its_figures_are_on_the_page_that_measures_them(stated, page, measured):
    assert stated in " ".join(README.split())
    text = PAGES[f"docs/{page}.md"]
    found = [*text.splitlines(), *(" ".join(block.split()) for block in text.split("\n\n"))]
    assert any(all(words in line for words in measured) for line in found)
