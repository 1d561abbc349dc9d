"""Tables of scenes: whoever loads one may choose them, whichever thread makes the BSDFs."""

from __future__ import annotations

from dataclasses import replace

import mitsuba as mi
import numpy as np
import pytest

import mitsuba_diffraction as md
from mitsuba_diffraction.heights import LoadOptions
from mitsuba_diffraction.tables import providing
from mitsuba_diffraction.tables.store import VARIABLE
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
    with providing(wider):
        scene = mi.load_dict({"type": "scene", **surfaces}, parallel=parallel)
    outside = mi.load_dict(md.bsdf_dict(PATCH, **DEFAULTS))
    assert len(requests) == len(surfaces)
    assert {shape.bsdf().table.height_scale_max for shape in scene.shapes()} == {2.5}
    assert outside.table.height_scale_max == 1.5


def test_a_provider_serves_no_longer_after_an_error(some_variant):
    def broken(request):
        raise md.DiffractionError("no table")

    with pytest.raises(Exception, match="no table"), providing(broken):
        mi.load_dict(md.bsdf_dict(PATCH, **DEFAULTS))
    mi.load_dict(md.bsdf_dict(PATCH, **DEFAULTS))


def test_a_bsdf_and_a_measurement_of_one_scan_share_a_table(some_variant, tmp_path, monkeypatch):
    monkeypatch.setenv(VARIABLE, str(tmp_path / "cache"))
    scan = tmp_path / "scan.npy"
    np.save(scan, PATCH.heights)
    bsdf = mi.load_dict({"type": "diffraction", "filename": str(scan), "pixel_size": 0.1})
    source = md.TableSource.of(scan, LoadOptions.parse(pixel_size="0.1"))
    assert source.table(source.settings_for({})) is bsdf.table
    array = md.TableSource.of(source.field())
    given = mi.load_dict(md.bsdf_dict(source.field()))
    assert array.table(array.settings_for({})) is given.table
    # one of the file's bytes, one of the array's numbers
    assert len(list((tmp_path / "cache").glob("table-*"))) == 2


def test_a_table_in_memory_is_one_of_a_file(some_variant, tmp_path):
    table = md.DiffractionTable.build(PATCH, coherence_width=5.0, tolerance=1e-2)
    file = tmp_path / "table.exr"
    table.save(file)
    own, loaded = (mi.load_dict(md.bsdf_dict(given, material="Al")) for given in (table, file))
    assert own.table is table
    assert own.table.digest() == loaded.table.digest()
    with pytest.raises(Exception, match="is a table; this needs the heights"):
        own.heights()
