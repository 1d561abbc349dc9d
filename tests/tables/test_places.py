"""A window moved to a place on the patch: the table's look-up against the reference."""

from __future__ import annotations

import numpy as np
import pytest

from mitsuba_diffraction import DiffractionError, DiffractionTable, reference
from mitsuba_diffraction.optics.geometry import kirchhoff_factor
from tests.support.directions import lit_pairs
from tests.support.patches import DEFAULTS, PATCH, WIDTH


@pytest.mark.parametrize("basis", ["svd", "taylor"])
def test_a_window_anywhere_is_the_reference_s(basis):
    table = DiffractionTable.build(PATCH, coherence="patch", basis=basis, **DEFAULTS)
    wi, wo, lam, near = lit_pairs(PATCH, table.sigma, 300, seed=4)
    places = np.random.default_rng(0).uniform(-20.0, 20.0, (300, 2))
    light = {"coherence_width": WIDTH, "coherence": "surface", "place": places}
    exact = reference.brdf(PATCH, wi, wo, lam, **light)
    factor = kirchhoff_factor(wi, wo, lam, table.sigma)
    difference = np.abs(table.brdf(wi, wo, lam, place=places) - exact) / factor
    for part in (near, ~near):
        assert difference[part].sum() < table.tolerance * (exact / factor)[part].sum()


def test_the_patch_s_own_window_is_on_its_centre():
    table = DiffractionTable.build(PATCH, coherence="patch", **DEFAULTS)
    wi, wo, lam, _ = lit_pairs(PATCH, table.sigma, 50, seed=5)
    centre = 0.5 * np.array(PATCH.extent)
    # rounding of phases; the patch tiles the plane
    for place in (centre, centre + 3 * np.array(PATCH.extent)):
        assert table.brdf(wi, wo, lam, place=place) == pytest.approx(table.brdf(wi, wo, lam), 1e-9)


def test_a_table_of_powers_has_no_places():
    table = DiffractionTable.build(PATCH, **DEFAULTS)
    with pytest.raises(DiffractionError, match="coherence='patch'"):
        table.window_sum(0.0, 0.0, 1.0, (0.0, 0.0))
