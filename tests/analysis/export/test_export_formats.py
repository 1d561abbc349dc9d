"""Files of a BRDF beside the surface: rendered by Mitsuba's `measured`, and read as specified."""

from __future__ import annotations

import json
import re

import drjit as dr
import mitsuba as mi
import numpy as np
import pytest

import mitsuba_diffraction as md
from mitsuba_diffraction import DiffractionError
from mitsuba_diffraction.analysis.export import bird, rgl, zemax
from mitsuba_diffraction.analysis.export.cells import ExportGrid
from mitsuba_diffraction.optics.colour import delta_e
from mitsuba_diffraction.orders import OrderTable
from tests.support.orders import thin_grating
from tests.support.variants import obstacle

pytestmark = pytest.mark.thorough

#: Window, µm, whose lobes are some 15° wide at half of their height.
WIDTH = 2.0
FLAT = md.HeightField(np.zeros((8, 8)), 1.0, periodic=True)


@pytest.fixture(autouse=True)
def variant():
    if reason := obstacle("llvm_ad_spectral"):
        pytest.skip(reason)
    mi.set_variant("llvm_ad_spectral")


def grating(**more):
    field = md.gratings.sinusoidal(period=1.2, depth=0.1, periods=4)
    return md.bsdf_dict(field, coherence_width=WIDTH, **more)


def f(bsdf, wi, wo, wavelength):
    """f in 1/sr of unit vectors (n, 3), at one wavelength."""
    si = dr.zeros(mi.SurfaceInteraction3f, len(wo))
    si.wi, out = (mi.Vector3f(np.float32(np.atleast_2d(each)).T) for each in (wi, wo))
    si.wavelengths = mi.Spectrum(wavelength)
    return np.array(bsdf.eval(mi.BSDFContext(), si, out)[0]) / wo[:, 2]


def polar(theta, phi):
    theta, phi = np.radians(theta), np.radians(phi)
    return np.stack(
        [np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi), np.cos(theta)], axis=-1
    )


def ball(bsdf):
    view = mi.ScalarTransform4f().look_at(origin=[0, -4, 3], target=[0, 0, 0], up=[0, 0, 1])
    film = {"type": "hdrfilm", "width": 48, "height": 48, "rfilter": {"type": "box"}}
    sun = {"type": "directional", "direction": [0.4, 1, -2], "irradiance": 4.0}
    return mi.load_dict(
        {
            "type": "scene", "integrator": {"type": "direct", "bsdf_samples": 0}, "sun": sun,
            "sensor": {"type": "perspective", "fov": 24, "to_world": view, "film": film},
            "ball": {"type": "sphere", "bsdf": bsdf}, "sky": {"type": "constant"},
        }
    )  # fmt: skip


def test_mitsuba_renders_the_tensors_as_the_surface(tmp_path):
    """ΔE2000 below 2 in the mean, an eye's threshold: lobes cover four cells of half vectors."""
    surface = grating(material="Al")
    grid = ExportGrid(
        np.linspace(0, 84, 8), np.linspace(-180, 180, 13), np.arange(380.0, 741, 30), 40
    )
    rgl.save_rgl(mi.load_dict(surface), tmp_path / "grating.bsdf", grid)
    measured = {"type": "measured", "filename": str(tmp_path / "grating.bsdf")}
    pictures = [
        np.array(mi.render(ball(each), spp=64, seed=mi.UInt32(1)))[..., :3]
        for each in (surface, measured)
    ]
    difference = delta_e(*pictures)
    assert np.isfinite(difference).mean() > 0.3
    assert np.nanmean(difference) < 2.0
    assert pictures[1].mean() == pytest.approx(pictures[0].mean(), rel=0.02)


def test_narrow_orders_keep_their_power_in_tensors(tmp_path):
    """Order 0 of a mirror, 0.3° wide, as a lobe as wide as the cell: 60 % of white light."""
    mirror = OrderTable.mirror(0.6, 0.6)
    grid = ExportGrid(
        np.linspace(0, 60, 3), np.linspace(-180, 180, 9), np.array([500.0, 540, 580]), 24
    )
    rgl.save_rgl(mi.load_dict(md.bsdf_dict(mirror)), tmp_path / "m.bsdf", grid)
    measured = mi.load_dict({"type": "measured", "filename": str(tmp_path / "m.bsdf")})
    random = mi.PCG32(1 << 16)
    for theta in (0.0, 30.0):
        si = dr.zeros(mi.SurfaceInteraction3f, 1 << 16)
        si.wi, si.wavelengths = mi.Vector3f(polar(theta, 20.0).tolist()), mi.Spectrum(540.0)
        pair = mi.Point2f(random.next_float32(), random.next_float32())
        weight = measured.sample(mi.BSDFContext(), si, 0.5, pair)[1]
        # 64 samples of the lobe in a cell; light is drawn in proportion
        assert np.mean(np.array(weight[0])) == pytest.approx(0.6, rel=0.05)


def read_zemax(path):
    """Return the axes, TIS (rotations, θ) and f (rotations, θ, azimuths, radials) of a file."""
    lines = [line for line in path.read_text("ascii").splitlines() if not line.startswith("#")]
    head, axes = {}, {}
    rows = iter(lines)
    for row in rows:
        if row == "DataBegin":
            break
        name, _, value = row.partition("  ")
        if re.fullmatch(r"\d+", value):
            axes[name] = np.array(next(rows).split(), float)
            assert len(axes[name]) == int(value)
        else:
            head[name] = value
    counts = [len(axis) for axis in axes.values()]
    tis, values = np.zeros(counts[:2]), np.zeros(counts)
    for r, t in np.ndindex(*counts[:2]):
        word, number = next(rows).split()
        assert word == "TIS"
        tis[r, t] = float(number)
        values[r, t] = [[float(x) for x in next(rows).split()] for _ in range(counts[2])]
    assert next(rows) == "DataEnd"
    return head, axes, tis, values


def test_zemax_s_file_has_f_about_the_mirror_direction(tmp_path):
    bsdf, file = mi.load_dict(grating(material="Al")), tmp_path / "grating.bsdf"
    grid = ExportGrid(np.array([0.0, 40]), np.array([0.0, 30]), np.array([550.0]), 171)
    zemax.save_zemax(bsdf, file, grid, "Al")
    head, axes, tis, values = read_zemax(file)
    assert (head["ScatterType"], head["Symmetry"]) == ("BRDF", "ASymmetrical4D")
    assert list(axes) == ["SampleRotation", "AngleOfIncidence", "ScatterAzimuth", "ScatterRadial"]
    # azimuth 0 leads from the mirror direction to the normal, 90 to the left of it
    mirror = polar(40.0, 30.0)
    to_normal = np.array([0, 0, 1]) - mirror * mirror[2]
    to_normal /= np.linalg.norm(to_normal)
    left = np.cross(mirror, to_normal)
    for azimuth, way in ((0.0, to_normal), (90.0, left), (270.0, -left)):
        k = np.flatnonzero(axes["ScatterAzimuth"] == azimuth)[0]
        angle = np.radians(axes["ScatterRadial"][2:30])
        wo = np.cos(angle)[:, None] * mirror + np.sin(angle)[:, None] * way
        wi = np.tile(mirror * [-1, -1, 1], (len(wo), 1))
        expected = f(bsdf, wi, wo, 550.0)
        # means over cells of 5° x 1°, and five digits
        np.testing.assert_allclose(values[1, 1, k, 2:30], expected, atol=0.02 * expected.max())
    assert 0.7 < tis.min() < tis.max() < 1.0  # of aluminium, 0.91 at the normal


def test_narrow_orders_keep_their_power_in_zemax_s_file(tmp_path):
    mirror = mi.load_dict(md.bsdf_dict(OrderTable.mirror(0.6, 0.6)))
    grid = ExportGrid(np.array([0.0, 30]), np.array([0.0]), np.array([550.0]), 86)
    zemax.save_zemax(mirror, tmp_path / "m.bsdf", grid)
    tis, values = read_zemax(tmp_path / "m.bsdf")[2:]
    assert tis == pytest.approx(0.6, rel=0.05)  # 64 samples of the lobe
    assert values[0, 0, 0, 0] > 100
    with pytest.raises(DiffractionError, match="expected one"):
        zemax.save_zemax(mirror, tmp_path / "m.bsdf", bird.DEFAULT)


def test_bird_s_json_has_f_of_each_pair(tmp_path):
    bsdf, file = mi.load_dict(grating(material="Al")), tmp_path / "grating.brdf"
    grid = ExportGrid(np.array([0.0, 40]), np.array([0.0, 30]), np.array([500.0, 600]), 16)
    bird.save_bird(bsdf, file, grid, "Al grating")
    content = json.loads(file.read_text("utf-8"))
    meta, data = content["metadata"], content["data"]
    assert (meta["type"], meta["method"], meta["sample"]["name"]) == (
        "BRDF", "simulation", "Al grating",
    )  # fmt: skip
    columns = {name: np.array(each["values"]) for name, each in data.items()}
    assert {len(column) for column in columns.values()} == {2 * 2 * 2 * 16 * 64}
    assert data["BRDF"]["unit"] == "sr^-1"
    assert columns["theta_r"].max() < 90
    assert columns["phi_r"].max() < 360
    for wavelength in (500.0, 600.0):
        row = columns["wavelength_i"] == wavelength
        wi, wo = (polar(columns[f"theta_{end}"][row], columns[f"phi_{end}"][row]) for end in "ir")
        expected = f(bsdf, wi, wo, wavelength)
        # bands of 100 nm, over which lobes move by a third of their width, and cells of 6°
        assert np.corrcoef(columns["BRDF"][row], expected)[0, 1] > 0.98


def test_surfaces_that_transmit_and_too_large_files_are_refused(tmp_path):
    sheet = mi.load_dict(md.bsdf_dict(thin_grating(0.6, counts=(2, 2, 1), thin=True)))
    with pytest.raises(DiffractionError, match="light that goes through"):
        rgl.save_rgl(sheet, tmp_path / "x.bsdf")
    mirror = mi.load_dict(md.bsdf_dict(OrderTable.mirror(0.6)))
    with pytest.raises(DiffractionError, match="lower the resolution"):
        rgl.save_rgl(mirror, tmp_path / "x.bsdf", rgl.DEFAULT._replace(resolution=1000))
    with pytest.raises(DiffractionError, match="theta: expected rising"):
        rgl.save_rgl(mirror, tmp_path / "x.bsdf", rgl.DEFAULT._replace(theta=np.array([95.0])))
    assert not list(tmp_path.iterdir())
