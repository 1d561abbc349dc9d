"""Patches that tables are built of, and how far a table is from the reference."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from mitsuba_diffraction import HeightField, reference
from mitsuba_diffraction.optics.geometry import kirchhoff_factor
from tests.support.directions import lit_pairs, rough_patch

#: 5.04 × 4.8 µm; WIDTH is nearly that wide.
PATCH = rough_patch((64, 63), (0.08, 0.075), 0.25)
WIDTH = 4.5
#: Several wavelengths deep.
DEEP = rough_patch((64, 64), (0.08, 0.08), 1.2)
DEFAULTS = {"coherence_width": WIDTH}
#: Arguments of a small table of one window, whose colours are summed in a second.
SPECKLE = {
    "heights": rough_patch((24, 26), (0.15, 0.15), 0.15), "coherence_width": 3.0,
    "coherence": "patch",
}  # fmt: skip
#: Part of a larger surface: it limits the window of all orders but 0.
SMALL_SCAN = HeightField(PATCH.heights, PATCH.pixel_size, name="small scan", cut_out=True)


def relative_error(table, *fields, n=400, height_scale=1.0):
    """Σ|table − mean of references| / Σ mean of ⟨|P|²⟩, near order 0 and elsewhere."""
    fields = [replace(field, heights=height_scale * field.heights) for field in fields]
    wi, wo, lam, near = lit_pairs(fields[0], table.sigma, n, 1)
    factor = kirchhoff_factor(wi, wo, lam, table.sigma)
    given = {"coherence_width": table.coherence_width, "coherence": table.coherence}
    exact = np.mean([reference.brdf(field, wi, wo, lam, **given) for field in fields], axis=0)
    difference = np.abs(table.brdf(wi, wo, lam, height_scale=height_scale) - exact) / factor
    return [difference[m].sum() / (exact / factor)[m].sum() for m in (near, ~near)]
