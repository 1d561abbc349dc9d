"""Tables of orders: look-up between nodes, energy, reciprocity, files, and refusals."""

from __future__ import annotations

import numpy as np
import pytest

from mitsuba_diffraction import DiffractionError, DiffractionWarning
from mitsuba_diffraction.orders import OrderTable, cells
from mitsuba_diffraction.orders.cells import Counts
from mitsuba_diffraction.orders.rows import Kind, rows, wavelength_of
from mitsuba_diffraction.orders.table import MARGIN
from mitsuba_diffraction.reference.fresnel import reflectance
from tests.orders.kinds import KINDS, light, orders_of, sides_of
from tests.support.orders import thin_grating

GRATING = thin_grating()
#: Differences of light that goes back from what came, where linear interpolation has most.
APART = {"crossed": 0.02, "crossed, clear": 0.02}


@pytest.mark.parametrize(("superstrate", "w_node"), [(1.0, 1), (1.58, 0)])
def test_values_at_nodes_are_the_tables(superstrate, w_node):
    """Also of the shortest wavelength under a coat, which is trapped there."""
    table, k = thin_grating(superstrate=superstrate), 3
    tau, rho, w = table.response.nodes(k)
    big_k, optical = k + cells.sine_squared(rho[2]), table.optical_period
    wavelength = cells.wavelength_of(big_k, w[w_node], table.wavelengths, optical)
    at = cells.from_cell(k, cells.A, 1, tau[4], rho[2], wavelength, optical)
    assert superstrate == 1.0 or abs(at.y) > 1.0 / superstrate
    for q in range(k + 1):
        found = table.efficiency(at.x, at.y, at.wavelength, 1 - q)
        # even cells follow the polynomials through the nodes: curvature over 32 x 24 x 6 cells
        assert found == pytest.approx(table.bands[k].a[4, 2, w_node, 1, q, 0], abs=2e-3)


@pytest.mark.parametrize("kind", KINDS)
def test_orders_that_propagate_share_the_light_and_go_back_as_they_came(kind):
    table = KINDS[kind]()
    index, total = table.block or 1.0, {}
    m, n = orders_of(table)
    for sides in sides_of(table):
        from_below, transmitted = sides.values()
        came, left = (index if below else 1.0 for below in (from_below, from_below != transmitted))
        x, y, lam = light(300, 0.97 * came, table.wavelengths)
        there = table.efficiency(x, y, lam, m, n, **sides)
        step_x, step_y = (1e-3 * lam / (table.superstrate * d) for d in table.periods)
        out = x + m * step_x, y + n * step_y
        assert there.min() >= 0.0
        assert np.all(there[np.hypot(*out) > left] == 0.0)
        total[from_below] = total.get(from_below, 0.0) + there.sum(axis=0)
        back = table.efficiency(
            -out[0], -out[1], lam, m, n, from_below=from_below != transmitted,
            transmitted=transmitted,
        )  # fmt: skip
        if kind != "listed":  # light of other directions has that of the nearest
            lit = (there > 0.0) & (np.hypot(*out) < 0.97 * left)
            # clamping of sums is not reciprocal; directions of lists are some degrees apart
            assert back[lit] == pytest.approx(there[lit], abs=APART.get(kind, 1e-4))
    for share in total.values():
        assert share.max() <= 1.0 + 1e-9
    assert kind in ("listed", *APART) or table.reciprocity < 1e-5  # single precision


def test_a_coat_over_a_mirror_reflects_as_a_pair_of_mirrors():
    mirror = OrderTable.mirror(1.6, 0.8, superstrate=1.5)
    grid = rows(mirror, Kind(6, cells.A, 7), Counts(4, 4, 4))
    big_k = 6 + cells.sine_squared(0.5)
    at = cells.from_cell(
        6, cells.A, 3, 0.5, 0.5, wavelength_of(mirror, big_k, 0.75), mirror.optical_period
    )
    face = reflectance(np.sqrt(1.0 - 1.5**2 * (at.x**2 + at.y**2)), 1.5)
    # geometric series of R ρ; tables hold what is between both passages of the face
    expected, passage = 0.8 / (1.0 - 0.8 * face), np.sqrt(1.0 - 0.8 * face)
    assert grid.within[2, 2, 3, 3, 3] == pytest.approx(expected * passage**2, rel=1e-3)
    assert grid.through[2, 2, 3, 3, 3] == pytest.approx(expected * (1.0 - face) * passage, rel=1e-3)


@pytest.mark.parametrize("kind", KINDS)
def test_files_keep_tables(kind, tmp_path):
    table, path = KINDS[kind](), tmp_path / "grating.nc"
    table.save(path)
    loaded = OrderTable.load(path)
    for name in ("periods", "wavelengths", "superstrate", "thin", "block", "polarised"):
        assert getattr(loaded, name) == getattr(table, name)
    assert dict(loaded.header) == dict(table.header)
    assert loaded.digest() == table.digest()
    again = tmp_path / "again.nc"
    loaded.save(again)
    assert again.read_bytes() == path.read_bytes()


def test_a_header_that_is_no_object_is_refused(tmp_path, monkeypatch):
    file = tmp_path / "list.nc"
    monkeypatch.setattr("json.dumps", lambda *_, **__: "[1, 2]")  # with a checksum that is right
    GRATING.save(file)
    with pytest.raises(DiffractionError, match="header does not fit"):
        OrderTable.load(file)


def test_a_file_of_another_version_is_refused(tmp_path, monkeypatch):
    GRATING.save(tmp_path / "grating.nc")
    monkeypatch.setattr("mitsuba_diffraction.orders.file.FORMAT_VERSION", 99)
    with pytest.raises(DiffractionError, match="this program reads 99"):
        OrderTable.load(tmp_path / "grating.nc")


@pytest.mark.parametrize("kind", KINDS)
def test_light_a_little_beyond_the_wavelengths_is_that_of_the_nearest_and_more_is_dark(kind):
    table = KINDS[kind]()
    ends = np.array(table.wavelengths)
    near, far = (ends * 2.0 ** (share * MARGIN * np.array([-1.0, 1.0])) for share in (0.9, 1.1))
    # an order of longer waves leaves elsewhere, but not the mirror's
    found = table.efficiency(0.0, 0.0, near, 0)
    assert found == pytest.approx(table.efficiency(0.0, 0.0, ends, 0), rel=0.2)
    assert np.all(found > 0.0)
    with pytest.warns(DiffractionWarning, match="nm is outside the table of orders"):
        assert np.all(table.efficiency(0.0, 0.0, far, 0) == 0.0)
