"""Files of a BRDF beside the surface: rendered by Mitsuba's `measured`, and read as specified."""

from __future__ import annotations

import itertools
import json
import re

import mitsuba as mi
import numpy as np
import pytest
from scipy.interpolate import RegularGridInterpolator

import mitsuba_diffraction as md
from mitsuba_diffraction.analysis.export import rgl, scatter, zemax
from mitsuba_diffraction.analysis.export.nodes import ExportGrid
from mitsuba_diffraction.columns import read_columns
from mitsuba_diffraction.optics.colour import delta_e
from mitsuba_diffraction.orders import OrderTable
from tests.support.directions import polar
from tests.support.lanes import brdf_values as f
from tests.support.orders import thin_grating

pytestmark = [pytest.mark.thorough, pytest.mark.usefixtures("spectral")]

#: Window, µm, whose lobes are some 15° wide at half of their height.
WIDTH = 2.0
FLAT = md.HeightField(np.zeros((8, 8)), 1.0, periodic=True)


def grating(width=WIDTH, **more):
    field = md.gratings.sinusoidal(period=1.2, depth=0.1, periods=4)
    return md.bsdf_dict(field, coherence_width=width, **more)


def ball(bsdf):
    view = mi.ScalarTransform4f().look_at(origin=[0, -4, 3], target=[0, 0, 0], up=[0, 0, 1])
    film = {"type": "hdrfilm", "width": 32, "height": 32, "rfilter": {"type": "box"}}
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
    surface = grating(1.2, material="Al")
    grid = ExportGrid(
        np.linspace(0, 84, 6), np.linspace(-180, 180, 9), np.arange(380.0, 741, 45), 20
    )
    rgl.save_rgl(mi.load_dict(surface), tmp_path / "grating.bsdf", grid)
    measured = {"type": "measured", "filename": str(tmp_path / "grating.bsdf")}
    pictures = [
        np.array(mi.render(ball(each), spp=128, seed=mi.UInt32(1)))[..., :3]
        for each in (surface, measured)
    ]
    difference = delta_e(*pictures)
    assert np.isfinite(difference).mean() > 0.3
    assert np.nanmean(difference) < 2.0
    assert pictures[1].mean() == pytest.approx(pictures[0].mean(), rel=0.02)


def orders_of(table, theta, phi, wavelength, orientation=0.0):
    """Directions and efficiencies of a table's orders, for light from θ and φ, degrees."""
    turn = np.radians(orientation)
    axis = np.array([np.cos(turn), np.sin(turn)])
    wi = polar(theta, phi)[:2]
    x, y = -wi @ axis, -(wi[1] * axis[0] - wi[0] * axis[1])
    found = []
    for order in range(-6, 7):
        out = x + order * wavelength / (1e3 * table.period), y
        if (square := 1.0 - out[0] ** 2 - out[1] ** 2) > 1e-9:
            tangential = out[0] * axis + out[1] * np.array([-axis[1], axis[0]])
            share = float(table.efficiency(x, y, wavelength, order))
            found.append(([*tangential, np.sqrt(square)], share))
    return (np.array(part) for part in zip(*found, strict=True))


def by_order(directions, power, orders):
    """Power of directions (n, 3), summed over those nearest to each order."""
    nearest = (directions @ orders.T).argmax(axis=1)
    return np.bincount(nearest, power, len(orders))


def rgl_power(path, theta, phi):
    """Directions (n, 3) and power at 550 nm, as Mitsuba reads a file of 48 nodes."""
    measured = mi.load_dict({"type": "measured", "filename": str(path)})
    u, v = ((np.arange(n) + 0.5) / n for n in (47 * 16, 47 * 8))
    u, v = (axis.ravel() for axis in np.meshgrid(u, v, indexing="ij"))
    theta_m = 0.5 * np.pi * u * u
    half, wi = polar(np.degrees(theta_m), 360.0 * v), polar(theta, phi)
    cosine = half @ wi
    wo = 2.0 * cosine[:, None] * half - wi
    solid = 4.0 * cosine * np.sin(theta_m) * np.pi * u * 2.0 * np.pi / len(u)
    lit = (wo[:, 2] > 1e-6) & (cosine > 0.0)
    return wo[lit], f(measured, wi, wo[lit], 550.0) * wo[lit, 2] * solid[lit]


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


def zemax_directions(theta, rotation, azimuth, radial):
    """Directions (…, 3) at angles about the mirror direction, degrees.

    Azimuth 0 leads from the mirror direction to the normal, 90 to the left of this line.
    """
    mirror = polar(theta, rotation)
    to_normal = polar(theta + 90.0, rotation) * -1.0
    left = np.cross(mirror, to_normal)
    azimuth, radial = (np.radians(part)[..., None] for part in (azimuth, radial))
    across = np.cos(azimuth) * to_normal + np.sin(azimuth) * left
    return np.cos(radial) * mirror + np.sin(radial) * across


def zemax_power(axes, values, theta, rotation):
    """Directions (n, 3) and power of f, linear between nodes, at the middles of fine parts."""
    azimuth, radial = axes["ScatterAzimuth"], axes["ScatterRadial"]
    fine = np.arange(0.25, 360.0, 0.5), np.arange(0.05, radial[-1], 0.1)
    a, r = np.meshgrid(*fine, indexing="ij")
    wo = zemax_directions(theta, rotation, a, r)
    between = RegularGridInterpolator((azimuth, radial), values)((a, r))
    solid = np.sin(np.radians(r)) * np.radians(0.5) * np.radians(0.1)
    power = between * np.maximum(wo[..., 2], 0.0) * solid
    return wo.reshape(-1, 3), power.ravel()


def csv_power(path, theta, phi):
    """Directions (n, 3) and power of f, read by NumPy, linear between the nodes of one light."""
    lines = np.genfromtxt(path, delimiter=",", names=True)
    lines = lines[(lines["theta_i_deg"] == theta) & (lines["phi_i_deg"] == phi)]
    azimuth, tilt = (np.unique(lines[name]) for name in ("phi_o_deg", "theta_o_deg"))
    values = np.zeros((len(azimuth) + 1, len(tilt)))
    place = (
        np.searchsorted(azimuth, lines["phi_o_deg"]),
        np.searchsorted(tilt, lines["theta_o_deg"]),
    )
    values[place] = lines["f_per_sr"]
    values[-1] = values[0]
    a, t = np.meshgrid(np.arange(0.125, 360.0, 0.25), np.arange(0.05, 90.0, 0.1), indexing="ij")
    axes = np.append(azimuth, 360.0), tilt
    between = RegularGridInterpolator(axes, values)((a, np.clip(t, tilt[0], tilt[-1])))
    wo = polar(t, a)
    solid = np.sin(np.radians(t)) * np.radians(0.25) * np.radians(0.1)
    return wo.reshape(-1, 3), (between * wo[..., 2] * solid).ravel()


#: Light at nodes of the files; orders are apart by more than two nodes of either.
LIGHTS = ((0.0, 0.0), (30.0, 60.0), (60.0, 240.0))


def written(name, bsdf, file, lights):
    """Write a file that has these lights; yield directions (n, 3), power, and all power of each."""
    theta, phi = (np.unique(angles) for angles in zip(*lights, strict=True))
    if name == "rgl":
        phi = np.arange(-180.0, 181, 60 if len(phi) > 1 else 180)
        rgl.save_rgl(bsdf, file, ExportGrid(np.linspace(0, 60, 3), phi, np.array([550.0, 551]), 48))
    elif name == "zemax":  # which turns the sample under the light from φ = 180°
        phi = np.unique((phi - 180.0) % 360.0)
        zemax.save_zemax(bsdf, file, ExportGrid(theta, phi, np.array([550.0]), 86))
        _, axes, tis, values = read_zemax(file)
    else:
        scatter.save_csv(bsdf, file, ExportGrid(theta, phi, np.array([550.0]), 18))
    for light in lights:
        if name == "zemax":
            place = (
                np.searchsorted(phi, (light[1] - 180.0) % 360.0),
                np.searchsorted(theta, light[0]),
            )
            wo, power = zemax_power(axes, values[place], light[0], phi[place[0]])
            yield wo, power, tis[place]
        else:
            wo, power = (rgl_power if name == "rgl" else csv_power)(file, *light)
            yield wo, power, power.sum()


FORMATS = pytest.mark.parametrize("name", ["rgl", "zemax", "csv"])


@FORMATS
def test_each_order_of_a_file_has_the_table_s_light(tmp_path, name):
    """Within 1 %, of a turned grating: orders 0.2° wide, cells of some degrees."""
    table = thin_grating(1.2, counts=(6, 5, 2), wavelengths=(500.0, 600.0))
    bsdf = mi.load_dict(md.bsdf_dict(table, orientation=30.0))
    files = written(name, bsdf, tmp_path / "m.bsdf", LIGHTS)
    for light, (wo, power, whole) in zip(LIGHTS, files, strict=True):
        directions, expected = orders_of(table, *light, 550.0, 30.0)
        # Zemax's file states the sum with five digits
        assert whole == pytest.approx(expected.sum(), rel=1e-3 if name == "zemax" else 0.01)
        assert power.sum() == pytest.approx(expected.sum(), rel=0.01)
        np.testing.assert_allclose(by_order(wo, power, directions), expected, rtol=0.01)


def test_f_times_the_weights_of_a_csv_is_the_reflected_light(tmp_path):
    """Sums of f cosθ sinθ at the nodes miss some per cent of narrow lobes."""
    table = thin_grating(1.2, counts=(6, 5, 2), wavelengths=(500.0, 600.0))
    bsdf = mi.load_dict(md.bsdf_dict(table))
    grid = ExportGrid(np.array([0.0, 50.0]), np.array([20.0]), np.array([550.0]), 18)
    scatter.save_csv(bsdf, tmp_path / "a.csv", grid)
    theta, _, _, _, _, f, weight = read_columns(tmp_path / "a.csv").of(scatter.CSV_COLUMNS).T
    for light in grid.theta:
        chosen = theta == light
        assert weight[chosen].sum() == pytest.approx(np.pi, rel=1e-3)  # of a white surface, f = 1/π
        _, expected = orders_of(table, light, 20.0, 550.0, 0.0)
        # as each order of a file
        assert (f * weight)[chosen].sum() == pytest.approx(expected.sum(), rel=0.01)


def mirrors():
    """Flat mirrors: of a table, and of heights under windows of 65 µm and more."""
    yield mi.load_dict(md.bsdf_dict(OrderTable.mirror(0.6, 0.6)))
    for width in (65.0, 130.0):
        yield mi.load_dict(md.bsdf_dict(FLAT, material="none", coherence_width=width))


def lobe_power(bsdf, theta):
    """Power within 12° of the mirror direction of light from φ = 180°, by fine sums."""
    azimuth, radial = np.meshgrid(np.arange(0.0, 360, 3), np.arange(0.005, 12, 0.01), indexing="ij")
    wo = zemax_directions(theta, 0.0, azimuth, radial).reshape(-1, 3)
    values = f(bsdf, polar(theta, 180.0), wo, 550.0)
    solid = np.sin(np.radians(radial.ravel())) * np.radians(3.0) * np.radians(0.01)
    return float((values * wo[:, 2] * solid).sum())


def near(wo, power, theta):
    """Power within 12° of the mirror direction."""
    return power[wo @ polar(theta, 0.0) > np.cos(np.radians(12.0))].sum()


@FORMATS
def test_mirrors_and_narrow_lobes_keep_their_light_in_a_file(tmp_path, name):
    """At the normal as well, where azimuths of a CSV's nodes meet in the lobe."""
    lights = (0.0, 180.0), (30.0, 180.0)
    # the narrowest lobe takes long to lay onto tensors
    count = 2 if name == "rgl" else 3
    for bsdf, reflectance in zip(itertools.islice(mirrors(), count), (0.6, 1.0, 1.0), strict=False):
        files = written(name, bsdf, tmp_path / "m.bsdf", lights)
        for (theta, _), (wo, power, whole) in zip(lights, files, strict=True):
            expected = lobe_power(bsdf, theta)
            assert expected == pytest.approx(reflectance, rel=0.01)
            assert near(wo, power, theta) == pytest.approx(expected, rel=0.01)
            if name == "zemax":
                assert whole == pytest.approx(expected, rel=0.01)


def test_a_csv_has_the_scatter_of_each_pair(tmp_path):
    """The same numbers as the JSON, with the columns that its first line names."""
    bsdf = mi.load_dict(grating(material="Al"))
    grid = ExportGrid(np.array([0.0, 40]), np.array([30.0]), np.array([500.0, 600]), 16)
    scatter.save_csv(bsdf, tmp_path / "s.csv", grid)
    scatter.save_bird(bsdf, tmp_path / "s.json", grid)
    columns = read_columns(tmp_path / "s.csv").of(scatter.CSV_COLUMNS)
    data = json.loads((tmp_path / "s.json").read_text("utf-8"))["data"]
    for column, values in zip(columns.T[:-1], data.values(), strict=True):
        np.testing.assert_allclose(column, values["values"], rtol=1e-5)


@pytest.mark.parametrize("solved", [False, True], ids=["heights", "orders"])
def test_each_wavelength_has_a_band_of_its_own(tmp_path, solved):
    """Bands differ in width, and none reaches beyond the table."""
    surface = grating(material="Al")
    if solved:
        thin_grating(1.2, counts=(4, 4, 2)).save(tmp_path / "table.nc")
        surface = md.bsdf_dict(tmp_path / "table.nc", coherence_width=60.0)
    bsdf, values = mi.load_dict(surface), []
    for wavelengths in ([420.0, 690.0, 700.0], [690.0, 700.0]):
        grid = ExportGrid(np.array([20.0]), np.array([0.0]), np.array(wavelengths), 12)
        scatter.save_csv(bsdf, tmp_path / "a.csv", grid)
        rows = read_columns(tmp_path / "a.csv").numbers
        values.append(rows[rows[:, 4] == 700.0, 5])
    assert values[0].max() > 0.0
    np.testing.assert_allclose(values[0], values[1], rtol=1e-4, atol=1e-5 * values[0].max())
