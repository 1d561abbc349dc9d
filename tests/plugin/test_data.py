"""Heights given as `data` may change, as if loaded with them; who loads a scene chooses tables."""

from __future__ import annotations

import copy
from dataclasses import replace
from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np
import pytest

import mitsuba_diffraction as md
from mitsuba_diffraction.heights import LoadOptions
from mitsuba_diffraction.tables import providing
from mitsuba_diffraction.tables.store import VARIABLE
from tests.support.directions import Array, rough_patch
from tests.support.kinds import KINDS, MIX, THROUGH, lit, made
from tests.support.lanes import interaction, spectra, vectors
from tests.support.layered import PATCH, load
from tests.support.patches import DEFAULTS
from tests.support.patches import PATCH as SCAN
from tests.support.plates import plate, rendered, scene
from tests.support.variants import use

OTHER = rough_patch((40, 44), (0.09, 0.09), 0.2, 0.6, seed=3)
#: As Mitsuba's arrays hold them.
SINGLE = md.HeightField(OTHER.heights.astype(np.float32), OTHER.pixel_size)


def values(bsdf: Any, kind: str) -> Array:
    """f cosθo, densities and draws of 60 pairs of directions."""
    wi, wo, lam = lit(kind, 60)
    si, context = interaction(wi, lam), mi.BSDFContext()
    value, density = bsdf.eval_pdf(context, si, vectors(wo))
    drawn, _ = bsdf.sample(context, si, mi.Float(0.6), mi.Point2f(0.3, 0.7))
    dr.eval(value, density, drawn)
    return np.vstack([spectra(value).T, np.array(density)[None], np.array(drawn.wo)])


def set_heights(bsdf: Any, heights: Array) -> None:
    parameters = mi.traverse(bsdf)
    for name in [name for name, _ in parameters if name.endswith("data") and "scale" not in name]:
        parameters[name] = mi.TensorXf(heights)
    parameters.update()


@pytest.mark.parametrize("kind", [*KINDS, *THROUGH, MIX])
def test_other_heights_are_as_if_loaded(some_variant, kind):
    bsdf, expected = made(kind), values(made(kind, SINGLE), kind)
    before = values(bsdf, kind)
    assert np.abs(before - expected).max() > 0.01 * np.abs(expected).max()
    set_heights(bsdf, OTHER.heights)
    assert values(bsdf, kind) == pytest.approx(expected, rel=1e-5, abs=1e-6)
    set_heights(bsdf, PATCH.heights)
    assert np.array_equal(values(bsdf, kind), before)


def test_changed_heights_leave_no_files(some_variant, tmp_path, monkeypatch):
    """Each step of an optimisation would leave a table in the cache that nobody asks for again."""
    monkeypatch.setenv("MITSUBA_DIFFRACTION_CACHE", str(tmp_path))
    bsdf = load(tolerance=3e-3)  # a table that no other test may have left in memory
    loaded = sorted(tmp_path.rglob("*"))
    set_heights(bsdf, OTHER.heights)
    assert loaded
    assert sorted(tmp_path.rglob("*")) == loaded


@pytest.mark.parametrize("variant", ["llvm_ad_rgb", "scalar_spectral"])
def test_albedo_and_pictures_follow_heights(variant):
    use(variant)

    def picture(bsdf: Any) -> Array:
        return rendered(scene(plate(bsdf), size=2), 4)

    conserving = {"material": "Al", "energy_conserving": True, "tolerance": 1e-3}
    bsdf = load(**conserving)
    picture(bsdf)
    set_heights(bsdf, OTHER.heights)
    assert picture(bsdf) == pytest.approx(picture(load(SINGLE, **conserving)), rel=1e-3)


def test_what_no_table_can_be_made_of_is_refused_and_leaves_all_as_it_was(some_variant):
    bsdf = load()
    before = values(bsdf, "dielectric")
    broken = OTHER.heights.copy()
    broken[3, 4] = np.nan
    for heights, message in (
        (broken, "finite"),
        (OTHER.heights[:20], "20 × 44 heights must be of 40 × 44"),
        (1e3 * OTHER.heights, "."),
    ):
        with pytest.raises(md.DiffractionError, match=message) as caught:
            set_heights(bsdf, heights)
        assert "\n" not in str(caught.value)
        assert np.array_equal(values(bsdf, "dielectric"), before)
        assert np.array(mi.traverse(bsdf)["data"]) == pytest.approx(PATCH.heights, abs=1e-6)


@pytest.mark.parametrize("gap", [np.nan, np.inf])
def test_gaps_are_filled_as_those_of_files(some_variant, gap):
    holed = PATCH.heights.copy()
    holed[3, 4] = gap
    scene = {"type": "diffraction", "data": mi.TensorXf(holed), "pixel_size": "0.09"}
    with pytest.raises(RuntimeError, match="fill=nearest"):
        mi.load_dict(scene)
    filled = np.array(mi.traverse(mi.load_dict({**scene, "fill": "nearest"}))["data"])
    neighbours = PATCH.heights[[2, 4, 3, 3], [4, 4, 3, 5]]
    assert np.abs(neighbours - filled[3, 4]).min() < 1e-6
    known = np.arange(holed.size) != 3 * holed.shape[1] + 4
    assert filled.ravel()[known] == pytest.approx(PATCH.heights.ravel()[known], abs=1e-6)


#: What derivatives by heights take.
SETTINGS: dict[str, Any] = {
    "periodic": "exact", "basis": "chebyshev", "model": "kirchhoff", "energy_conserving": False,
}  # fmt: skip
#: Own parameters that derivatives by heights do not go with, and what the message asks for.
WITHOUT: list[tuple[dict[str, Any], str]] = [
    ({"periodic": "open"}, "periodic=exact"),
    ({"basis": "svd"}, "basis=chebyshev"),
    ({"coherence": "patch"}, "coherence=ensemble"),
    ({"model": "small_slope"}, "model=kirchhoff"),
    ({"energy_conserving": True}, "energy_conserving=false"),
    ({"nested": {"type": "diffuse"}}, "no BSDF beneath"),
    ({"level": "plane"}, "no crop, level or clip"),
    ({"coherence_width": 0.8}, "a wider window or a smaller patch"),
]


@pytest.mark.parametrize(("own", "asked"), WITHOUT)
def test_derivatives_by_heights_are_refused_where_there_are_none(some_variant, own, asked):
    bsdf = mi.load_dict(md.bsdf_dict(PATCH, **(SETTINGS | own)))
    before, parameters = values(bsdf, "dielectric"), mi.traverse(bsdf)
    assert int(parameters.flags("data")) & int(mi.ParamFlags.NonDifferentiable)
    dr.enable_grad(parameters["data"])
    parameters.set_dirty("data")
    with pytest.raises(md.DiffractionError, match=f"data has derivatives only with .*{asked}"):
        parameters.update()
    assert np.array_equal(values(bsdf, "dielectric"), before)


def test_heights_far_from_zero_have_derivatives(mono):
    high = md.HeightField(1000.0 + PATCH.heights, PATCH.pixel_size)
    parameters = mi.traverse(mi.load_dict(md.bsdf_dict(high, **SETTINGS)))
    assert not int(parameters.flags("data")) & int(mi.ParamFlags.NonDifferentiable)


def test_heights_with_derivatives_have_the_values_of_others(mono):
    bsdf = mi.load_dict(md.bsdf_dict(PATCH, **SETTINGS))
    before, parameters = values(bsdf, "dielectric"), mi.traverse(bsdf)
    for wanted in (True, False):
        heights = mi.TensorXf(PATCH.heights.astype(np.float32))
        parameters["data"] = heights
        if wanted:
            dr.enable_grad(parameters["data"])
        parameters.update()
        # half floats, with and without their factor
        assert values(bsdf, "dielectric") == pytest.approx(before, rel=1e-5, abs=1e-6)


def test_a_dictionary_can_be_copied(some_variant):
    for data in (PATCH, load().table, md.OrderTable.mirror(period=1.6, reflectance=0.9)):
        given = md.bsdf_dict(data)
        again = copy.deepcopy(given)
        assert again["data"] is not given["data"]
        assert str(mi.load_dict(again)) == str(mi.load_dict(given))


def test_files_and_tables_have_no_heights_to_change(some_variant, tmp_path):
    np.save(tmp_path / "scan.npy", PATCH.heights)
    of_file = mi.load_dict(md.bsdf_dict(tmp_path / "scan.npy", pixel_size=0.09))
    of_table = mi.load_dict(md.bsdf_dict(of_file.table))
    for bsdf in (of_file, of_table):
        assert "data" not in dict(mi.traverse(bsdf))


@pytest.mark.parametrize("parallel", [False, True])
def test_a_provider_serves_all_bsdfs_of_a_scene(some_variant, parallel):
    """Mitsuba's threads do not inherit context variables of the one that loads a scene."""
    requests = []

    def wider(request):
        requests.append(request)
        return request.cached(replace(request.settings, height_scale_max=2.5))

    surfaces = {
        f"sphere_{n}": {"type": "sphere", "bsdf": md.bsdf_dict(SCAN, **DEFAULTS, orientation=n)}
        for n in range(4)
    }
    with providing(wider):
        scene = mi.load_dict({"type": "scene", **surfaces}, parallel=parallel)
    outside = mi.load_dict(md.bsdf_dict(SCAN, **DEFAULTS))
    assert len(requests) == len(surfaces)
    assert {shape.bsdf().table.height_scale_max for shape in scene.shapes()} == {2.5}
    assert outside.table.height_scale_max == 1.5


def test_a_provider_serves_no_longer_after_an_error(some_variant):
    def broken(request):
        raise md.DiffractionError("no table")

    with pytest.raises(Exception, match="no table"), providing(broken):
        mi.load_dict(md.bsdf_dict(SCAN, **DEFAULTS))
    mi.load_dict(md.bsdf_dict(SCAN, **DEFAULTS))


def test_a_bsdf_and_a_measurement_of_one_scan_share_a_table(some_variant, tmp_path, monkeypatch):
    monkeypatch.setenv(VARIABLE, str(tmp_path / "cache"))
    scan = tmp_path / "scan.npy"
    np.save(scan, SCAN.heights)
    bsdf = mi.load_dict({"type": "diffraction", "filename": str(scan), "pixel_size": 0.1})
    source = md.TableSource.of(scan, LoadOptions.parse(pixel_size="0.1"))
    assert source.table(source.settings_for({})) is bsdf.table
    array = md.TableSource.of(source.field())
    given = mi.load_dict(md.bsdf_dict(source.field()))
    assert array.table(array.settings_for({})) is given.table
    # one of the file's bytes, one of the array's numbers
    assert len(list((tmp_path / "cache").glob("table-*"))) == 2


def test_a_table_in_memory_is_one_of_a_file(some_variant, tmp_path):
    table = md.DiffractionTable.build(SCAN, coherence_width=5.0, tolerance=1e-2)
    file = tmp_path / "table.exr"
    table.save(file)
    own, loaded = (mi.load_dict(md.bsdf_dict(given, material="Al")) for given in (table, file))
    assert own.table is table
    assert own.table.digest() == loaded.table.digest()
    with pytest.raises(Exception, match="is a table; this needs the heights"):
        own.heights()
