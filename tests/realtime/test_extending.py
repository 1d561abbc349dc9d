"""The boundary model of docs/extending.md in every language: one file."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

import mitsuba_diffraction as md
from mitsuba_diffraction.optics.boundary import MODELS, Model
from mitsuba_diffraction.optics.coat import refracted
from mitsuba_diffraction.realtime.glsl.formulas import formulas
from mitsuba_diffraction.realtime.web.export import make_page
from mitsuba_diffraction.shading.pair_power import Coat, pair_power
from tests.support.formulas import COAT, INDICES, check, pairs
from tests.support.languages import emitted, shaded
from tests.support.pages import blocks
from tests.support.variants import use

pytestmark = pytest.mark.thorough  # a browser, Blender, and a table

PAIRS = pairs(64**2)
SOURCE = blocks("docs/extending.md", "python")[0]


@pytest.fixture(scope="module")
def model() -> Iterator[Model]:
    """The page's model. Its file compares Dr.Jit with `md.reference`."""
    use("llvm_ad_spectral")
    before = dict(MODELS)
    exec(SOURCE, {"__name__": "extending"})
    yield MODELS["dulled"]
    MODELS.clear()
    MODELS.update(before)


def exact(model: Model, index: complex, coated: bool = False) -> NDArray[np.float64]:
    """N' of the pairs by NumPy, in double precision."""
    wi, wo, n = tuple(PAIRS.wi.T), tuple(PAIRS.wo.T), COAT
    coat = Coat(n, wi[2], wo[2]) if coated else None
    inner = (refracted(wi, n), refracted(wo, n)) if coated else (wi, wo)
    relative = index / n if coated else index
    heights = PAIRS.kappa, PAIRS.variance
    return np.asarray(pair_power(model.jones, *inner, relative, *heights, coat))


@pytest.mark.parametrize("coated", [False, True], ids=["bare", "coated"])
@pytest.mark.parametrize("kind", INDICES)
def test_glsl(gl: Any, model: Model, kind: str, coated: bool) -> None:
    check(shaded(gl, PAIRS, model, INDICES[kind], coated), exact(model, INDICES[kind], coated))


def test_osl(model: Model, tmp_path: Path) -> None:
    indices = list(INDICES.values())
    for index, found in zip(indices, emitted(tmp_path, PAIRS, model, indices), strict=True):
        check(found, exact(model, index))


def test_page(tab: Any, model: Model, tmp_path: Path) -> None:
    import mitsuba as mi

    grating = md.gratings.sinusoidal(1.6, 0.1, periods=4, rows=8)
    surface = md.bsdf_dict(
        grating, coherence_width=6.4, int_ior=1.5, model=model.name, energy_conserving=False
    )
    scene = {
        "type": "scene",
        "sensor": {"type": "perspective", "film": {"type": "hdrfilm", "width": 48, "height": 32}},
        "sun": {"type": "directional", "direction": [0.1, 0.0, 1.0]},
        "plane": {"type": "rectangle", "bsdf": surface},
    }
    page = make_page(mi.load_dict(scene), methods=["fast"], bounces=False)
    path = tmp_path / "page.html"
    path.write_text(page.text, encoding="utf-8")
    opened = tab((96, 64))
    assert opened.open(path) == "ready"
    assert opened.said == []
    own = formulas({"BOUNDARY": model.name, "SURFACE_KIND": "1"})
    factor = own[own.index("float pair_power") :]
    assert any(factor in text for text in opened.page.evaluate("viewer.drawing.sources"))
