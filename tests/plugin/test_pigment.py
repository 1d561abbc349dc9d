"""Pigment and other BSDFs beneath a structure, and every named material as a surface."""

from __future__ import annotations

import drjit as dr
import mitsuba as mi
import numpy as np
import pytest
from PIL import Image

import mitsuba_diffraction as md
from mitsuba_diffraction import DiffractionError
from mitsuba_diffraction.optics.materials import TISSUES
from mitsuba_diffraction.plugin.pigment import pigment_bsdf, pigment_range
from mitsuba_diffraction.reference import fresnel
from mitsuba_diffraction.tables.directional import DirectionalTable
from mitsuba_diffraction.tables.energy.conservation import Energy
from mitsuba_diffraction.tables.energy.conserved import Reflector
from tests.support.gentle import load, pairs
from tests.support.lanes import evaluated, interaction, spectra, vectors

FLAT = md.HeightField(np.zeros((8, 8)), 1.0, periodic=True)


@pytest.mark.parametrize("name", TISSUES)
def test_a_flat_tissue_reflects_by_its_index(spectral, name):
    lam = [400.0, 550.0, 700.0]
    surface = mi.load_dict(md.bsdf_dict(FLAT, material=name, coherence_width=20.0))
    found = md.spectrum(surface, 0.0, [0.0], acceptance=20.0, relative="none", wavelengths=lam)
    n = TISSUES[name].index(lam)
    # single precision, and the lobe is within 1e-3 of the cone
    assert found.value[:, 0] == pytest.approx(np.abs((n - 1) / (n + 1)) ** 2, rel=4e-3)


def write_gltf(file, materials):
    """Write a square for each of these materials of trimesh."""
    trimesh = pytest.importorskip("trimesh")
    corners = [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]]
    scene = trimesh.Scene()
    for material in materials:
        visual = trimesh.visual.TextureVisuals(uv=np.array(corners)[:, :2], material=material)
        scene.add_geometry(
            trimesh.Trimesh(corners, [[0, 1, 2], [0, 2, 3]], visual=visual, process=False)
        )
    scene.export(file)


def test_base_colour_of_gltf_is_its_picture_times_its_factor(spectral, tmp_path):
    pbr = pytest.importorskip("trimesh").visual.material.PBRMaterial
    random = np.random.default_rng(5)
    picture = Image.fromarray(random.integers(0, 256, (4, 8, 3), np.uint8))
    picture.save(tmp_path / "base.png")
    files = {name: tmp_path / f"{name}.glb" for name in ("plain", "dimmed", "flat", "several")}
    write_gltf(files["plain"], [pbr(baseColorTexture=picture)])
    write_gltf(
        files["dimmed"], [pbr(baseColorTexture=picture, baseColorFactor=[0.4, 0.4, 0.4, 1.0])]
    )
    write_gltf(files["flat"], [pbr(baseColorFactor=[0.2, 0.2, 0.2, 1.0])])
    write_gltf(files["several"], [pbr(baseColorFactor=[g, 0.1, 0.1, 1.0]) for g in (0.2, 0.6)])

    def seen(name):
        """Reflectances at the middles of the picture's texels."""
        u, v = np.meshgrid((np.arange(8) + 0.5) / 8, (np.arange(4) + 0.5) / 4)
        si = dr.zeros(mi.SurfaceInteraction3f, u.size)
        si.uv = mi.Point2f(u.ravel(), v.ravel())
        si.wavelengths = mi.Spectrum(450.0, 520.0, 590.0, 650.0)
        si.wi = mi.Vector3f(0, 0, 1)
        return np.array(pigment_bsdf(str(tmp_path / name)).eval_diffuse_reflectance(si))

    truth = seen("base.png")
    assert np.ptp(truth) > 0.5
    # textures of half precision
    assert seen("plain.glb") == pytest.approx(truth, abs=2e-3)
    # Mitsuba's spectrum of a colour is smooth, and of one that is dimmed not quite proportional
    assert seen("dimmed.glb").mean() == pytest.approx(0.4 * truth.mean(), rel=0.05)
    assert seen("flat.glb") == pytest.approx(0.2, abs=1e-3)
    with pytest.raises(DiffractionError, match="2 materials"):
        pigment_bsdf(str(files["several"]))
    for name in ("base.png", "flat.glb"):
        with pytest.raises(DiffractionError, match="varies over a mesh"):
            pigment_range(str(tmp_path / name))
    files["flat"].write_bytes(b"glTF")
    with pytest.raises(DiffractionError, match="cannot be read as glTF"):
        pigment_bsdf(str(files["flat"]))


def test_pigment_under_keratin_reflects_its_spectrum(spectral, tmp_path):
    file = tmp_path / "brown.csv"
    file.write_text("wl,brown\n300,10\n500,10\n600,40\n800,40\n")
    assert pigment_range(str(file)) == (300.0, 800.0)
    bare, pigmented = (
        mi.load_dict(md.bsdf_dict(FLAT, material="keratin", **pigment))
        for pigment in ({}, {"pigment": str(file)})
    )
    lam = [450.0, 700.0]
    away = [md.spectrum(b, 10.0, [-40.0], wavelengths=lam).value[:, 0] for b in (bare, pigmented)]
    n = TISSUES["keratin"].index(lam).real
    through = 1.0 - fresnel.reflectance(np.cos(np.radians([[10.0], [40.0]])), n)
    expected = np.array([0.1, 0.4]) * through.prod(axis=0)
    # T of the flat interface is a quotient of tables in half precision
    assert away[1] - away[0] == pytest.approx(expected, rel=2e-3)


def test_beyond_its_ends_a_spectrum_is_constant(some_variant, tmp_path):
    file = tmp_path / "brown.csv"
    file.write_text("wl,brown\n350,0.1\n360,0.2\n790,0.3\n800,0.4\n")
    si = dr.zeros(mi.SurfaceInteraction3f)
    si.wi, si.wavelengths = mi.Vector3f(0, 0, 1), mi.UnpolarizedSpectrum(300.0, 350.0, 800.0, 850.0)
    found = np.ravel(pigment_bsdf(str(file)).eval_diffuse_reflectance(si))
    assert found == pytest.approx([0.1, 0.1, 0.4, 0.4])


@pytest.mark.parametrize(
    ("content", "named"),
    [
        ("wl,r\n500,0.1\n600,0.2\n", "500 to 600 nm"),
        ("300,-5\n800,3\n", "-5 to 3"),
    ],
)
def test_spectra_that_are_none_are_one_line(some_variant, tmp_path, content, named):
    file = tmp_path / "wrong.csv"
    file.write_text(content)
    with pytest.raises(md.DiffractionError, match=named) as caught:
        pigment_bsdf(str(file))
    assert "\n" not in str(caught.value)


def test_colours_are_greys_numbers_and_names(some_variant):
    assert "0.25" in str(pigment_bsdf(0.25))
    for text in ("0.3,0.2,0.1", "#804020", "sienna"):
        assert pigment_bsdf(text) is not None


@pytest.mark.parametrize("named", ["brown.csv", "brown.csv:dark"])
def test_a_scenes_pigment_lies_beside_it(some_variant, tmp_path, monkeypatch, named):
    (tmp_path / "brown.csv").write_text("wl,dark\n350,0.1\n800,0.4\n")
    np.save(tmp_path / "flat.npy", FLAT.heights)
    scene = tmp_path / "scene.xml"
    scene.write_text(
        "<scene version='3.0.0'><bsdf type='diffraction'><string name='filename' value='flat.npy'/>"
        "<float name='pixel_size' value='1'/><string name='material' value='keratin'/>"
        f"<string name='pigment' value='{named}'/></bsdf></scene>"
    )
    (tmp_path / "elsewhere").mkdir()
    monkeypatch.chdir(tmp_path / "elsewhere")
    assert mi.load_file(str(scene)) is not None


def test_what_is_not_reflected_reaches_the_nested_bsdf(variant):
    pigment = {"type": "diffuse", "reflectance": {"type": "uniform", "value": 0.5}}
    bare, coated = load(int_ior=1.5), load(int_ior=1.5, pigment=pigment)
    wi, wo, lam = pairs()
    context, si = mi.BSDFContext(), interaction(wi, lam[:, None])
    eta = 1.5 / 1.000277
    table = bare.table
    glass = Reflector("small_slope", lambda w: np.full(len(w), 1.5 + 0j))
    albedo = Energy(table, glass, table.wavelength_range).at(1.0).albedo
    flat = fresnel.reflectance(np.cos(albedo.grid.theta), 1.5)[:, None]
    excess = DirectionalTable(albedo.wavelengths, (albedo.values - flat).astype(np.float32))

    def transmittance(directions):
        theta, phi = np.arccos(directions[:, 2]), np.arctan2(directions[:, 1], directions[:, 0])
        more = [excess.at(*one) for one in zip(theta, phi, lam, strict=True)]
        return 1 - np.array(more) - fresnel.reflectance(directions[:, 2], eta)

    t = transmittance(wi) * transmittance(wo)
    beneath = spectra(mi.load_dict(pigment).eval(context, si, vectors(wo)))
    expected = evaluated(bare, wi, wo, lam[:, None]) + t[:, None] * beneath
    # an angle in single precision, on a grid of directions
    assert evaluated(coated, wi, wo, lam[:, None]) == pytest.approx(expected, rel=1e-4)
    # and it is not the flat interface's
    assert np.abs(excess.values / flat).max() > 0.02
