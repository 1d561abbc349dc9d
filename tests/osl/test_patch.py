"""Textures and formulas of shaders against the table, and surfaces that cannot be exported."""

from __future__ import annotations

import dataclasses
import functools
import json
import re

import mitsuba as mi
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from PIL import Image
from scipy.ndimage import map_coordinates

import mitsuba_diffraction as md
from mitsuba_diffraction import DiffractionError, OrderTable
from mitsuba_diffraction.optics.boundary import MODELS
from mitsuba_diffraction.osl.export import OSL, pigment_of, shader_of
from mitsuba_diffraction.osl.patch import (
    BANDS,
    energy_texture,
    interpolated,
    patch_constants,
    patch_textures,
)
from mitsuba_diffraction.osl.solved import MOST_BYTES, interpolation_error
from mitsuba_diffraction.osl.spectrum import NODES, drawn_spectrum
from mitsuba_diffraction.plugin.description import Quantity, Surface
from mitsuba_diffraction.shading.orders import pack_orders
from mitsuba_diffraction.tables.directional import FINE, DirectionalTable
from mitsuba_diffraction.tables.powers import powers_at
from tests.support.blender import blender
from tests.support.descriptions import CHANGES, ELSEWHERE, base
from tests.support.formulas import INDICES, check, exact_power, pairs
from tests.support.languages import emitted
from tests.support.orders import thin_grating
from tests.support.patches import DEEP, DEFAULTS, PATCH, SMALL_SCAN


def scale_of(height_scale):
    """A smooth scale of energy, lower for deeper heights and longer waves."""
    theta, phi = np.meshgrid(FINE.theta, FINE.phi, indexing="ij")
    page = 1 - 0.3 * height_scale * theta / 2 * (1 + 0.2 * np.cos(phi))
    lam = np.geomspace(360.0, 830.0, 5)
    return DirectionalTable(lam, (page ** (lam[:, None, None] / 500)).astype(np.float32))


ENERGETIC = Surface(
    md.DiffractionTable.build(PATCH, **DEFAULTS, height_scale_max=1.5), "mirror", 4.5,
    Quantity(0.0), energy_scale=scale_of,
)  # fmt: skip


@functools.cache
def deep():
    """A table of deep heights, and its textures."""
    table = md.DiffractionTable.build(DEEP, **DEFAULTS)
    return table, patch_textures(table)


@settings(deadline=None, max_examples=20)
@given(st.floats(0.0, 1.0))
def test_powers_are_those_of_the_table(share):
    table, textures = deep()
    kappa = share * table.expansion.kappa_max
    exact = powers_at(table, kappa)
    # terms are halves, of 11 digits; factors are off by 0.06²/8 between the ends of a cell
    assert np.abs(interpolated(textures, kappa) - exact).sum() < 5e-4


def test_light_of_a_scan_is_kept_without_orders_of_negative_power():
    table = md.DiffractionTable.build(SMALL_SCAN, tolerance=0.01)
    textures = patch_textures(table)
    constants = patch_constants(table, textures, table.roughness)
    share, kappa = constants["LIKELIHOOD"] / textures.likelihood, 0.6 * table.expansion.kappa_max
    powers = powers_at(table, kappa).astype(float)
    negative = float(-powers[powers < 0.0].sum() / powers.sum())
    assert negative > 5e-3
    # one share for all wavelengths
    kept = interpolated(textures, kappa).sum() * share
    assert kept == pytest.approx(powers.sum(), rel=0.2 * negative)


def test_draws_have_the_probabilities_that_weigh_them():
    table, textures = deep()
    rows, columns = table.grid.shape
    last_x, last_y = table.grid.last
    for cells in textures.draws.reshape(BANDS, rows * columns, 4).astype(float):
        threshold, chance, x, y = cells.T
        other = ((y + last_y) * columns + x + last_x).astype(int)
        drawn = (threshold + np.bincount(other, 1.0 - threshold, len(other))) / len(other)
        assert drawn.sum() == pytest.approx(1.0)
        # halves have 11 digits, fewer below 6e-5 of what the largest is stored as
        assert chance / textures.likelihood == pytest.approx(drawn, rel=5e-4, abs=1e-12)


@pytest.mark.parametrize(
    "parameters",
    [
        {"film_ior": 1.3, "film_thickness": 0.3}, {"coherence": "patch"},
        {"shadowing": "vcavity"},
        {"beneath": {"type": "plastic"}},
        {"pigment": {"type": "diffuse", "reflectance": {"type": "checkerboard"}}},
        {"plugin": "diffraction_dielectric"},
    ],
    ids=lambda value: next(iter(value)),
)  # fmt: skip
def test_surfaces_that_the_shader_lacks_are_refused(tmp_path, some_variant, parameters):
    parameters = {"energy_conserving": False, **parameters}
    bsdf = mi.load_dict(md.bsdf_dict(PATCH, **DEFAULTS, **parameters))
    with pytest.raises(DiffractionError) as refused:
        md.osl.export(bsdf, tmp_path / "out")
    assert "\n" not in str(refused.value)
    assert not (tmp_path / "out").exists()


def test_a_picture_of_one_colour_almost_everywhere_is_refused(tmp_path, some_variant):
    grey = np.full((16, 16, 3), 120, np.uint8)
    grey[0, 0] = 255
    Image.fromarray(grey).save(tmp_path / "base.png")
    parameters = {"energy_conserving": False, "pigment": str(tmp_path / "base.png")}
    bsdf = mi.load_dict(md.bsdf_dict(PATCH, **DEFAULTS, **parameters))
    with pytest.raises(DiffractionError, match="no single diffuse colour"):
        md.osl.export(bsdf, tmp_path / "out")


@settings(deadline=None, max_examples=50)
@given(
    st.floats(0.0, 0.5 * np.pi), st.floats(-np.pi, np.pi), st.floats(0.0, 1.5),
    st.floats(380.0, 780.0),
)  # fmt: skip
def test_scales_of_energy_are_those_of_the_description(theta, phi, height_scale, wavelength):
    """The look-up of shaders/patch.osl, at the nodes of its height scales and between them."""
    pages = [scale_of(scale).at(theta, phi, wavelength) for scale in (1.0, 1.5)]
    pixels, constants = energy_texture(ENERGETIC)
    row = (1 - np.sqrt(max(1 - 2 / np.pi * theta, 0))) / constants["ENERGY_SHARE"]
    row = min(row, 1.0) * constants["ENERGY_POLAR"]
    column = phi / (2 * np.pi) % 1.0 * constants["ENERGY_AZIMUTHAL"]
    first, last = constants["ENERGY_FIRST"], constants["ENERGY_LAST"]
    page = (np.log(wavelength) - first) / (last - first) * (constants["ENERGY_PAGES"] - 1)
    pixels = pixels.reshape(constants["ENERGY_PAGES"], -1, *pixels.shape[1:])
    place = [[page], [row], [column]]
    nodes = [map_coordinates(pixels[..., n], place, order=1)[0] for n in (0, 1)]
    heights = [0.0, constants["ENERGY_HEIGHT"], constants["ENERGY_MOST"]]
    read = np.interp(height_scale, heights, [1.0, *nodes])
    # single precision of pages and places
    assert read == pytest.approx(np.interp(height_scale, [0.0, 1.0, 1.5], [1.0, *pages]), abs=1e-5)


def test_other_plugins_are_refused(tmp_path, some_variant):
    with pytest.raises(DiffractionError, match="diffraction"):
        md.osl.export(mi.load_dict({"type": "diffuse"}), tmp_path)


def inputs_of(exported):
    """Defaults of an exported material's inputs."""
    document = json.loads(exported.document.read_text(encoding="utf-8"))
    return {item["identifier"]: item["default"] for item in document["inputs"]}


def test_a_small_scan_limits_the_window_of_orders_and_not_the_mirror_s(tmp_path, some_variant):
    for field, width in (
        (SMALL_SCAN, "4.8"),
        (SMALL_SCAN.treated(periodic="exact"), "1000000000.0"),
    ):
        exported = md.osl.export(
            mi.load_dict(md.bsdf_dict(field, energy_conserving=False)), tmp_path
        )
        assert inputs_of(exported)["CoherenceWidth"] == 65.0
        assert f"#define SCAN_WIDTH {width}\n" in exported.shader.read_text(encoding="utf-8")


def test_coat_pigment_and_stretch_are_those_of_the_surface(tmp_path, some_variant):
    colour = [0.3, 0.1, 0.02]
    pigment = {"type": "diffuse", "reflectance": {"type": "rgb", "value": colour}}
    bsdf = md.bsdf_dict(
        PATCH, **DEFAULTS, coat_ior=1.25, pigment=pigment, lateral_scale=0.8, height_scale=0.5
    )
    exported = md.osl.export(mi.load_dict(bsdf), tmp_path, "skin")
    values = inputs_of(exported)
    assert values["Stretch"] == pytest.approx(0.8)
    assert values["HeightScale"] == 0.5
    # spectral variants have upsampled the colour, within a per cent or two
    assert values["Pigment"] == pytest.approx(colour, abs=0.01)
    coat = re.search(r"#define COAT (\S+)", exported.shader.read_text(encoding="utf-8"))
    assert float(coat[1]) == pytest.approx(1.25, abs=1e-3)
    assert {name for name in values if name.endswith("File")} == {"PowersFile", "DrawsFile"}


def test_a_pigment_is_grey_in_a_mono_variant():
    mi.set_variant("llvm_ad_mono")
    nested = mi.load_dict({"type": "diffuse", "reflectance": 0.25})
    assert pigment_of(dataclasses.replace(ENERGETIC, nested=nested)) == (0.25, 0.25, 0.25)


def exported_of(described: Surface) -> object:
    if described.nested is not None:
        described = dataclasses.replace(described, nested=mi.load_dict({"type": "diffuse"}))
    shader = shader_of(described)
    arrays = {name: pixels.tobytes() for name, pixels in shader.textures.items()}
    return shader.formulas, shader.constants, list(shader.arrays), shader.sockets, arrays


def test_every_feature_that_is_shown_changes_what_is_exported(some_variant):
    plain = exported_of(base())
    for feature in OSL.shows - ELSEWHERE:
        assert exported_of(dataclasses.replace(base(), **CHANGES[feature])) != plain, feature


TABLE = thin_grating()


def test_error_of_the_textures_is_measured():
    mean, worst = interpolation_error(TABLE, pack_orders(TABLE, MOST_BYTES)).values()
    assert 0.0 < mean < worst < 0.01


def test_mean_of_the_spectrum_is_white():
    wavelengths, by_space = drawn_spectrum()
    u = np.linspace(0.0, 1.0, NODES)
    for colours in by_space.values():
        assert colours.mean(axis=1).min() > 0.0  # Cycles draws by it
        # linear between nodes, as the shader interpolates
        assert np.trapezoid(colours, u, axis=0) == pytest.approx(1.0, abs=1e-6)
    assert np.all(np.diff(wavelengths) > 0)


def test_document_names_files_and_sockets(tmp_path, some_variant):
    bsdf = mi.load_dict(md.bsdf_dict(TABLE, coherence_width=30, orientation=20))
    exported = md.osl.export(bsdf, tmp_path / "new" / "folder", "cd")
    document = json.loads(exported.document.read_text(encoding="utf-8"))
    values = {item["identifier"]: item["default"] for item in document["inputs"]}
    assert (values["CoherenceWidth"], values["Rotation"]) == (30.0, 20.0)
    source = exported.shader.read_text(encoding="utf-8")
    assert all(f" {name} = " in source for name in values)
    for name in (document["shader"], *document["textures"].values()):
        assert (exported.document.parent / name).is_file()
    assert not [path for path in exported.document.parent.iterdir() if path.name.startswith(".")]


def test_folder_is_no_part_of_what_is_written(tmp_path, some_variant):
    folder = tmp_path / 'z", float Evil = 1, string Q = "'
    exported = md.osl.export(mi.load_dict(md.bsdf_dict(OrderTable.mirror(1.0))), folder, "cd")
    for file in (exported.shader, exported.document):
        text = file.read_text(encoding="utf-8")
        assert "Evil" not in text
        assert str(tmp_path) not in text
    assert 'string OrdersFile = "cd_orders.exr"' in exported.shader.read_text(encoding="utf-8")


@pytest.mark.parametrize(
    "name", ["", "1cd", "a b", "../cd", "if", "while", "md_lobe", "PERIOD", "mix", "Wavelengths"]
)
def test_name_must_be_that_of_a_shader(tmp_path, some_variant, name):
    with pytest.raises(DiffractionError, match="name="):
        md.osl.export(mi.load_dict(md.bsdf_dict(OrderTable.mirror(1.0))), tmp_path, name)


def test_folder_that_is_a_file_is_refused(tmp_path, some_variant):
    (tmp_path / "taken").write_text("")
    with pytest.raises(DiffractionError, match="taken"):
        md.osl.export(mi.load_dict(md.bsdf_dict(OrderTable.mirror(1.0))), tmp_path / "taken")


PAIRS = pairs(64**2)


def test_boundary_is_that_of_the_reference(tmp_path):
    blender()
    indices, model = list(INDICES.values()), MODELS["small_slope"]
    for index, found in zip(indices, emitted(tmp_path, PAIRS, model, indices), strict=True):
        check(found, exact_power(PAIRS, index))
