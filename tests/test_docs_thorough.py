"""What README, docs and notebooks show runs: examples in Python, and commands in their order.

Commands run on small patches and pictures. Not run: the gallery's commands, whose scenes
test_scenes.py renders; `make`, `pip` and `apt`, which set up what runs these tests;
`view`, which opens a window; `tradeoff`, `compare`, `plan` and `solve --crossed`, which take long
at their smallest, and are run smaller still by their own tests. `render --denoise` runs without it.
test_docs.py checks what these would be given.
"""

from __future__ import annotations

import importlib.util
import re
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from mitsuba_diffraction.optics import boundary
from mitsuba_diffraction.orders.solve import jobs
from tests.support.commands import commands, run_page, small_clone, small_tree
from tests.support.pages import PAGES, blocks

pytestmark = [pytest.mark.thorough, pytest.mark.usefixtures("some_variant")]

DENOISER = importlib.util.find_spec("pyoidn") is not None


@pytest.fixture(scope="module")
def inputs(tmp_path_factory) -> Path:
    """A folder with the files that examples name."""
    folder = small_clone(tmp_path_factory.mktemp("inputs"))
    x = np.arange(32)
    rows = np.tile(np.uint8(127 + 127 * np.sin(2 * np.pi * x / 32)), (32, 1))
    Image.fromarray(rows).save(folder / "scale.png")
    return folder


@pytest.mark.parametrize("page", [p for p in PAGES if p != "README.md" and blocks(p, "python")])
def test_the_python_blocks_of_a_page_run(page, inputs, monkeypatch):
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


@pytest.fixture(scope="module")
def tree(tmp_path_factory):
    return small_tree(tmp_path_factory.mktemp("clone"))


@pytest.mark.parametrize("page", [p for p in PAGES if p != "docs/gallery.md" and commands(p)])
def test_the_commands_of_a_page_run(page, tree, monkeypatch):
    run_page(page, tree, monkeypatch)
