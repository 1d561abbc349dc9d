"""The examples in Python that the pages show run."""

from __future__ import annotations

import importlib.util
import re
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from mitsuba_diffraction.optics import boundary
from mitsuba_diffraction.orders.solve import jobs
from tests.support.clone import small_clone
from tests.support.pages import PAGES, blocks

pytestmark = pytest.mark.thorough

DENOISER = importlib.util.find_spec("pyoidn") is not None


@pytest.fixture(scope="module")
def inputs(tmp_path_factory) -> Path:
    """A folder with the files that examples name."""
    folder = small_clone(tmp_path_factory.mktemp("inputs"))
    x = np.arange(32)
    rows = np.tile(np.uint8(127 + 127 * np.sin(2 * np.pi * x / 32)), (32, 1))
    Image.fromarray(rows).save(folder / "scale.png")
    return folder


# the example's smooth heights are far from what its pixel size would resolve
@pytest.mark.filterwarnings("ignore::mitsuba_diffraction.DiffractionWarning")
@pytest.mark.parametrize("page", [p for p in PAGES if p != "README.md" and blocks(p, "python")])
def test_the_python_blocks_of_a_page_run(page, inputs, monkeypatch, some_variant):
    monkeypatch.chdir(inputs)
    monkeypatch.setitem(boundary.MODELS, "dulled", None)  # extending.md enters a model
    monkeypatch.delitem(boundary.MODELS, "dulled")
    for entered in (jobs.METHODS, jobs.MOST_RESOLUTION):  # and a solver
        monkeypatch.setitem(entered, "phase_screen", None)
        monkeypatch.delitem(entered, "phase_screen")
    here = [text for text in blocks(page, "python") if DENOISER or "import pyoidn" not in text]
    for text in here:  # one after the other: they read what those before have written
        exec(re.sub(r"\.advance\(\d+\)", ".advance(2)", text), {})  # of many frames two
    if len(here) < len(blocks(page, "python")):
        pytest.skip("a denoiser needs the extra denoise; the other blocks ran")
