"""A clear coat over the structure: values, limits, and what is refused."""

from __future__ import annotations

from typing import Any

import mitsuba as mi
import numpy as np
import pytest

import mitsuba_diffraction as md
from mitsuba_diffraction.reference.fresnel import reflectance
from tests.support.directions import Array, as_single, polar
from tests.support.lanes import interaction, refusal
from tests.support.layered import FLAT, PATCH, WIDTH, load

pytestmark = pytest.mark.thorough


@pytest.mark.parametrize("theta", [0.0, 45.0])
def test_over_white_it_returns_what_both_mirrors_let_through(some_variant, theta):
    count = 1 << 14
    white = {"type": "diffuse", "reflectance": {"type": "spectrum", "value": 1.0}}
    bsdf = load(FLAT, int_ior=1.6, coat_ior=1.4, ext_ior=1.0, nested=white)
    si = interaction(np.tile(as_single(polar(theta)), (count, 1)), 550.0)
    rng = mi.PCG32(count)
    one, two = rng.next_float32(), mi.Point2f(rng.next_float32(), rng.next_float32())
    weights: Array = np.array(bsdf.sample(mi.BSDFContext(), si, one, two)[1], float)[0]
    cosines = np.sqrt((np.arange(200) + 0.5) / 200)  # equal shares of ∫ cosθ dω
    there, back = (transmittance(c, 1.4, 1.6 / 1.4) for c in (np.cos(np.radians(theta)), cosines))
    expected = 1.0 - there + there * back.mean()
    # a lobe loses a little below the horizon, and the sum over polarisations is not of products
    assert weights.mean() == pytest.approx(expected, abs=0.01)
    assert weights.mean() < 1.0


def transmittance(cosine: Any, coat: float, index: float) -> Any:
    """What a coat and the flat structure of this index beneath it let through, all bounces."""
    inside = np.sqrt(1 - (1 - cosine**2) / coat**2)
    face, structure = reflectance(cosine, coat), reflectance(inside, index)
    return (1 - face) * (1 - structure) / (1 - face * structure)


def test_a_table_that_does_not_reach_is_one_line(some_variant, tmp_path):
    file = tmp_path / "table.exr"
    md.DiffractionTable.build(PATCH, coherence_width=WIDTH).save(file)
    plugin = {"type": "diffraction", "filename": str(file), "material": "Al"}
    mi.load_dict({**plugin, "coat_ior": 1.49, "energy_conserving": False})
    assert "height_scale_max=1.58" in refusal(lambda: mi.load_dict({**plugin, "coat_ior": 1.58}))


@pytest.mark.parametrize(
    ("changed", "line"),
    [
        ({"coat_eta": 0.9}, "coat_eta=0.9"),
        ({"coat_eta": 2.9}, "beyond the table's 2.37"),
        ({"height_scale": 1.6}, "height_scale=1.6 must be above 0"),
    ],
)
def test_a_change_beyond_the_table_is_refused(some_variant, changed, line):
    parameters = mi.traverse(load(eta=0.9, k=6.0, coat_ior=1.58))
    for name, value in changed.items():
        parameters[name] = value
    with pytest.raises(md.DiffractionError, match=line):
        parameters.update()
