"""Tables of scenes: whoever loads one may choose them, whichever thread makes the BSDFs."""

from __future__ import annotations

from dataclasses import replace

import mitsuba as mi
import pytest

import mitsuba_diffraction as md
from mitsuba_diffraction.plugin.sources import tables_by
from tests.support.patches import DEFAULTS, PATCH


@pytest.mark.parametrize("parallel", [False, True])
def test_a_provider_serves_all_bsdfs_of_a_scene(some_variant, parallel):
    """Mitsuba's threads do not inherit context variables of the one that loads a scene."""
    requests = []

    def wider(request):
        requests.append(request)
        return request.cached(replace(request.settings, height_scale_max=2.5))

    surfaces = {
        f"sphere_{n}": {"type": "sphere", "bsdf": md.bsdf_dict(PATCH, **DEFAULTS, orientation=n)}
        for n in range(4)
    }
    with tables_by(wider):
        scene = mi.load_dict({"type": "scene", **surfaces}, parallel=parallel)
    outside = mi.load_dict(md.bsdf_dict(PATCH, **DEFAULTS))
    assert len(requests) == len(surfaces)
    assert {shape.bsdf().table.height_scale_max for shape in scene.shapes()} == {2.5}
    assert outside.table.height_scale_max == 1.5


def test_a_provider_serves_no_longer_after_an_error(some_variant):
    def broken(request):
        raise md.DiffractionError("no table")

    with pytest.raises(Exception, match="no table"), tables_by(broken):
        mi.load_dict(md.bsdf_dict(PATCH, **DEFAULTS))
    mi.load_dict(md.bsdf_dict(PATCH, **DEFAULTS))
