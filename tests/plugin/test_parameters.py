"""The plugin's parameters: what they default to, and that every misfit is one clear line."""

from __future__ import annotations

import warnings
from pathlib import Path

import mitsuba as mi
import numpy as np
import pytest

import mitsuba_diffraction as md
from mitsuba_diffraction.retired import REPLACED
from mitsuba_diffraction.settings import SCENE_SETTINGS
from mitsuba_diffraction.tables.store import VARIABLE
from tests.support.directions import polar, rough_patch
from tests.support.lanes import evaluated, refusal
from tests.support.scenes import searched

#: 2.56 × 2.4 µm and gentle, so that nothing warns of it.
PATCH = rough_patch((30, 32), (0.08, 0.08), 0.03)
SMALL = {"coherence_width": 2.4}


def load(field=PATCH, **parameters):
    """The plugin with these parameters."""
    return mi.load_dict(md.bsdf_dict(field, **(SMALL | parameters)))


@pytest.fixture
def png(tmp_path):
    """An 8-bit image of heights, which knows neither its pixel size nor its height."""
    from PIL import Image

    levels = np.round(PATCH.heights / PATCH.range * 255).astype(np.uint8)
    Image.fromarray(levels[::-1]).save(tmp_path / "patch.png")  # the top row is the largest y
    return tmp_path / "patch.png"


@pytest.fixture
def table_file(tmp_path):
    """A table on disk."""
    file = tmp_path / "table.exr"
    md.DiffractionTable.build(PATCH, **SMALL).save(file)
    return file


def tensor(heights):
    """Heights as scenes hold them."""
    return mi.TensorXf(np.asarray(heights, np.float32))


def loads(**parameters):
    """The plugin from exactly these."""
    return lambda: mi.load_dict({"type": "diffraction", **parameters})


def test_an_image_an_array_a_recipe_and_a_table_are_one_surface(some_variant, png, table_file):
    # files are seen through windows, fields tile the plane as they are
    whole = SMALL | {"periodic": "exact"}
    lengths = {"pixel_size": 0.08, "max_height": PATCH.range}
    np.save(png.parent / "patch.npy", PATCH.heights)
    recipe = png.parent / "patch.toml"
    recipe.write_text(
        'source = "patch.npy"\npixel_size = 0.08\nperiodic = "exact"\n'
        'coherence_width = 2.4\noutput = "patch.exr"\n'
    )
    surfaces = {
        "image": loads(filename=str(png), **lengths, **whole)(),
        "strings": loads(
            filename=str(png), pixel_size="0.08", max_height=repr(PATCH.range), **whole
        )(),
        "npy": loads(filename=str(png.parent / "patch.npy"), pixel_size="0.08", **whole)(),
        "recipe": loads(filename=str(recipe))(),
        "recipe, auto": loads(filename=str(recipe), pixel_size="auto", max_height="auto")(),
        "table": loads(filename=str(table_file), pixel_size="auto")(),
        "channel": loads(data=tensor(PATCH.heights[..., None]), pixel_size=0.08, **SMALL)(),
        # 3 µm with float32's rounding of 1e-7 of it: 6e-6 rad
        "lifted": loads(data=tensor(PATCH.heights + 3.0), pixel_size=0.08, **SMALL)(),
        "data": load(),
    }
    wo = [polar(25, phi) for phi in range(0, 360, 30)]
    values = {name: evaluated(bsdf, polar(10), wo, 500.0) for name, bsdf in surfaces.items()}
    for name, value in values.items():
        # 8 bits of 0.03 µm are steps of 1e-4 µm, 0.03 rad of phase: some per cent of dim orders
        tolerance = {"image": 0.1, "strings": 0.1, "lifted": 1e-3, "channel": 1e-3}.get(name, 1e-5)
        least = 0.1 * tolerance
        expected = pytest.approx(values["data"], rel=tolerance, abs=least * value.max())
        assert value == expected, name


def test_files_are_found_by_mitsuba_s_resolver(some_variant, table_file):
    with searched(table_file.parent):
        assert "Diffraction[" in str(loads(filename="table.exr")())


def test_none_is_as_not_given(some_variant):
    names = ("material", "pigment", "orientation", "height_scale", "pixel_size", "terms")
    given = md.bsdf_dict(PATCH, **(SMALL | dict.fromkeys(names)))
    assert given.keys() == md.bsdf_dict(PATCH, **SMALL).keys()
    assert str(mi.load_dict(given)) == str(load())


def test_a_patch_in_memory_keeps_its_history(some_variant):
    field = md.HeightField(PATCH.heights, PATCH.pixel_size, history=("levelled",))
    bsdf = load(field)
    assert (bsdf.heights().digest(), bsdf.heights().history) == (field.digest(), field.history)
    assert bsdf.table.source["digest"] == field.digest()


@pytest.fixture
def empty_cache(tmp_path, monkeypatch):
    """A cache in which no table is found."""
    monkeypatch.setenv(VARIABLE, str(tmp_path / "cache"))


def test_a_table_is_warned_of_where_it_is_built_and_not_where_it_is_found(
    some_variant, tmp_path, empty_cache
):
    coarse = md.HeightField(PATCH.heights, 0.15, name="coarse")  # pixels above λ/4, and 4.5 µm
    with pytest.warns(md.DiffractionWarning) as caught:
        bsdf = load(coarse, coherence_width=10.0)
    lines = [str(w.message) for w in caught]
    assert len(lines) == 2
    assert sum("coherence_width=4.5," in line for line in lines) == 1
    assert sum("pixels of 0.15 µm" in line for line in lines) == 1
    bsdf.table.save(tmp_path / "coarse.exr")
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        load(coarse, coherence_width=10.0)
        loads(filename=str(tmp_path / "coarse.exr"))()


def test_tilt_of_a_file_is_said_and_can_be_treated_in_the_scene(
    some_variant, tmp_path, empty_cache
):
    tilted = PATCH.heights + 0.004 * np.arange(PATCH.shape[1])
    np.save(tmp_path / "tilted.npy", tilted)
    given = {"filename": str(tmp_path / "tilted.npy"), "pixel_size": 0.08, **SMALL}
    raw = {"level": "none"}
    counted = r"^\d notes? on 'tilted\.npy': mitsuba-diffraction info .* --pixel-size 0.08,0.08"
    with pytest.warns(md.DiffractionWarning, match=counted) as caught:
        loads(**given, **raw)()
    assert len(caught) == 1
    said = r"^tilted\.npy: use level=plane: "
    field = md.HeightField.load(tmp_path / "tilted.npy", pixel_size=0.08, **raw)
    with pytest.warns(md.DiffractionWarning, match=said):
        load(field)  # as an array, too
    level = loads(**given, level="plane")()  # nothing to warn of
    again = load(field, level="plane")
    wo = [polar(25, phi) for phi in range(0, 360, 30)]
    values = [evaluated(bsdf, polar(10), wo, 500.0) for bsdf in (level, again)]
    # single precision of the array's heights
    assert values[0] == pytest.approx(values[1], rel=1e-3, abs=1e-4 * values[0].max())


@pytest.mark.parametrize(
    ("given", "said"),
    [
        ({}, "give exactly one of filename, data; got none"),
        ({"data": np.zeros((4, 4))}, "data needs pixel_size"),
        ({"data": np.zeros(4), "pixel_size": 0.1}, "data: heights"),
        ({"data": np.zeros((4, 4, 3)), "pixel_size": 0.1}, "data: heights"),
        ({"data": np.zeros((1, 1)), "pixel_size": 0.1}, "at least 2 x 2"),
        ({"data": np.full((4, 4), np.nan), "pixel_size": 0.1}, "no height is a finite number"),
        ({"filename": 1.0}, "filename=1.0 must be the name of a file"),
        ({"filename": ""}, "filename is empty; name a file"),
        ({"filename": "none.exr"}, "'none.exr' does not exist; looked for it in '"),
        ({"filename": "{}/empty.png", "pixel_size": 0.1}, "empty.png"),
        ({"filename": "{}", "pixel_size": 0.1}, "is a folder"),
        *(({"filename": f"{{}}/no.{kind}", "pixel_size": 0.1}, f"no.{kind}' does not exist")
          for kind in ("png", "npy", "toml")),
    ],
)  # fmt: skip
def test_what_has_no_heights_is_refused(some_variant, tmp_path, given, said):
    (tmp_path / "empty.png").touch()
    if "data" in given:
        given = given | {"data": tensor(given["data"])}
    named = {n: v.format(tmp_path) for n, v in given.items() if isinstance(v, str)}
    text = refusal(loads(**given | named))
    assert said in text
    assert "looked" not in text or repr(str(Path.cwd())) in text


def test_a_dictionary_is_of_heights_and_a_plugin():
    with pytest.raises(md.DiffractionError, match="expected a HeightField, a table or the path"):
        md.bsdf_dict(PATCH.heights)
    with pytest.raises(md.DiffractionError, match="plugin='glass' is unknown"):
        md.bsdf_dict(PATCH, plugin="glass")


@pytest.mark.parametrize(
    ("parameters", "message"),
    [
        ({"coherence_width": 3.0}, "coherence_width=3.0 contradicts the table"),
        ({"coherence": "patch"}, "coherence=patch contradicts the table"),
        ({"basis": "taylor"}, "basis=taylor contradicts the table"),
        ({"tolerance": 1e-4}, "tolerance=0.0001 contradicts the table"),
        ({"terms": 20}, "terms=20 contradicts the table"),
        ({"pixel_size": 0.1}, "pixel_size=(0.1, 0.1) is for height fields, but"),
        ({"max_height": 0.1}, "max_height=0.1 is for height fields, but"),
        ({"height_scale": 1.6}, "height_scale=1.6 is beyond the table's 1.5"),
        ({"lateral_scale": 1.1}, "give the height field instead of the table"),
        ({"material": "Al", "coat_ior": 1.58}, "height_scale_max=1.58"),
        ({"coherence": "surface", "uv_scale": 10.0}, "build another table with coherence=patch"),
    ],
)
def test_what_contradicts_a_table_is_refused(some_variant, table_file, parameters, message):
    text = refusal(loads(filename=str(table_file), **parameters))
    assert message in text
    name, value = next(iter(parameters.items()))
    if name in SCENE_SETTINGS and value != "surface":
        assert "; leave it out, or " in text
        assert f"build another table with {name}={value} (" in text
        assert ("say coherence_width=auto" in text) == (name == "coherence_width")


@pytest.mark.parametrize("width", [2.4, "2.4", "auto"])
def test_what_agrees_with_a_table_is_fine(some_variant, table_file, width):
    loads(
        filename=str(table_file),
        coherence_width=width,
        coherence="ensemble",
        basis="auto",
        tolerance=1e-3,
        height_scale=1.5,
        pixel_size="auto",
    )()


def test_an_automatic_coherence_width_is_the_recipe_s(some_variant, png, tmp_path):
    recipe = tmp_path / "narrow.toml"
    lengths = "pixel_size = 0.08\nmax_height = 0.02\n"
    recipe.write_text(f'source = "{png}"\n{lengths}coherence_width = 2.0\n')
    assert loads(filename=str(recipe), coherence_width="auto")().table.coherence_width == 2.0


def test_a_table_for_fewer_wavelengths_than_mitsuba_s_is_refused(some_variant, tmp_path):
    file = tmp_path / "table.exr"
    md.DiffractionTable.build(PATCH, wavelength_range=(450.0, 700.0), **SMALL).save(file)
    text = refusal(loads(filename=str(file)))
    assert "starts at 450 nm, but Mitsuba renders from 360 nm on" in text


@pytest.mark.parametrize("nm", [300.0, 549.45, 1064.0])
def test_a_table_of_a_laser_s_wavelength_serves_mono_variants_alone(tmp_path, nm):
    file = tmp_path / "laser.exr"
    md.DiffractionTable.build(PATCH, wavelength_range=(nm, nm + 1.1), **SMALL).save(file)
    mi.set_variant("llvm_ad_mono")
    bsdf = loads(filename=str(file), wavelength=nm + 0.5, int_ior=1.5)()
    assert np.all(evaluated(bsdf, polar(10), [polar(25, phi) for phi in (0, 60)], nm) > 0)
    # by default 550 nm
    for asked in ({"wavelength": nm - 1.0}, {} if nm > 1000.0 else {"wavelength": nm + 2.0}):
        line = refusal(loads(filename=str(file), int_ior=1.5, **asked))
        assert f"outside the table's {nm:g} to" in line
    for name in ("scalar_spectral", "llvm_ad_rgb", "llvm_ad_spectral"):
        mi.set_variant(name)
        if nm < 360.0:  # where others begin to render, whatever mono variants do
            loads(filename=str(file))()
    if nm > 360.0:
        assert "360" in refusal(loads(filename=str(file)))


@pytest.mark.parametrize("earlier", ["heightfield", "table"])
def test_an_earlier_name_is_the_current_one_with_a_line(some_variant, table_file, earlier):
    load = loads(**{earlier: str(table_file)})
    with pytest.warns(md.DiffractionWarning, match=f"{earlier} is now filename"):
        assert "Diffraction[" in str(load())
    assert "both are given" in refusal(loads(**{earlier: "a.exr", "filename": "b.exr"}))


@pytest.mark.parametrize("plugin", ["diffraction", "diffraction_dielectric"])
@pytest.mark.parametrize(
    ("name", "value"), [("second_order", True), ("layering", "thesis"), ("diffuse_weight", 0.3)]
)
def test_a_retired_parameter_changes_nothing_but_is_named(some_variant, plugin, name, value):
    plain = md.bsdf_dict(PATCH, plugin, **SMALL)
    with pytest.warns(md.DiffractionWarning) as heard:
        bsdf = mi.load_dict(plain | {name: value})
    assert sum(REPLACED[name] in str(warning.message) for warning in heard) == 1
    assert str(bsdf) == str(mi.load_dict(plain))
