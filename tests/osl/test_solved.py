"""Textures of solved orders against the table, and surfaces that cannot be exported."""

from __future__ import annotations

import functools
import json

import mitsuba as mi
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import mitsuba_diffraction as md
from mitsuba_diffraction import DiffractionError, OrderTable
from mitsuba_diffraction.orders import cells
from mitsuba_diffraction.osl.solved import interpolation_error, order_constants, order_texture
from mitsuba_diffraction.osl.spectrum import NODES, drawn_spectrum
from tests.support.orders import thin_grating

TABLE = thin_grating()
TEXTURE = order_texture(TABLE)


@functools.cache
def constants():
    """Constants of the shader, whose error takes seconds to measure."""
    return order_constants(TABLE, TEXTURE)


def looked_up(x, y, wavelength, order):
    """Efficiency by the steps of shaders/orders.osl."""
    cell = cells.to_cell(x, y, wavelength, TABLE.optical_period)
    w = cells.w_of(cell.k_continuous, wavelength, TABLE.wavelengths, TABLE.optical_period)
    band, kind, j = int(cell.band), int(cell.kind), int(cell.channel)
    q = j - order
    if not 0 <= q < band + 1 - kind:
        return 0.0
    packs = (band + 1 - kind + 3) // 4
    first = TEXTURE.starts[2 * band + kind] + j * packs + q // 4
    size = constants()
    tau, rho = float(cell.tau) * size["TAU"], float(cell.rho) * size["RHO"]
    place = float(w) * size["W"]
    slices = [min(int(place), size["W"]), min(int(place) + 1, size["W"])]
    values = [pixel(first * (size["W"] + 1) + n, tau, rho)[q % 4] for n in slices]
    return np.interp(place - int(place), [0, 1], values)


def pixel(tile, tau, rho):
    across, width, height = TEXTURE.tiles_across, constants()["TAU"] + 1, constants()["RHO"] + 1
    row, column = tile // across * height, tile % across * width
    a, b = min(int(tau), width - 2), min(int(rho), height - 2)
    four = TEXTURE.pixels[row + b : row + b + 2, column + a : column + a + 2].astype(float)
    weights = np.outer([1 - rho + b, rho - b], [1 - tau + a, tau - a])
    return np.einsum("ba,bac->c", weights, four)


@settings(deadline=None, max_examples=60)
@given(st.floats(0.0, 0.99), st.floats(0.0, 2 * np.pi), st.floats(380.0, 780.0), st.integers(-6, 6))
def test_texture_has_the_efficiencies_of_the_table(sine, phi, wavelength, order):
    x, y = sine * np.cos(phi), sine * np.sin(phi)
    exact = TABLE.efficiency(x, y, wavelength, order)
    # cells of the texture: 1/16 of a kind along τ, so that curves of the thin grating, whose
    # efficiencies vary by up to 1 across a kind, are off by (1/16)²/8 times their curvature
    assert looked_up(x, y, wavelength, order) == pytest.approx(exact, abs=0.01)


def test_error_of_the_textures_is_measured():
    mean, worst = interpolation_error(TABLE, TEXTURE).values()
    assert 0.0 < mean < worst < 0.01


def test_mean_of_the_spectrum_is_white():
    spectrum = drawn_spectrum()
    u = np.linspace(0.0, 1.0, NODES)
    for colours in spectrum.colours.values():
        assert colours.mean(axis=1).min() > 0.0  # Cycles draws by it
        # linear between nodes, as the shader interpolates
        assert np.trapezoid(colours, u, axis=0) == pytest.approx(1.0, abs=1e-6)
    assert np.all(np.diff(spectrum.wavelengths) > 0)


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
    "name", ["", "1cd", "a b", "../cd", "if", "while", "md_lobe", "PERIOD", "mix", "Starts"]
)
def test_name_must_be_that_of_a_shader(tmp_path, some_variant, name):
    with pytest.raises(DiffractionError, match="name="):
        md.osl.export(mi.load_dict(md.bsdf_dict(OrderTable.mirror(1.0))), tmp_path, name)


def test_folder_that_is_a_file_is_refused(tmp_path, some_variant):
    (tmp_path / "taken").write_text("")
    with pytest.raises(DiffractionError, match="taken"):
        md.osl.export(mi.load_dict(md.bsdf_dict(OrderTable.mirror(1.0))), tmp_path / "taken")
