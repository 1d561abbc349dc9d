"""Files of orders, read by the library of NetCDF itself."""

from __future__ import annotations

import math

import numpy as np
import pytest

from mitsuba_diffraction.orders.listing import JONES, list_orders
from tests.support import crossed
from tests.support.orders import shallow_grating, thin_grating

netCDF4 = pytest.importorskip("netCDF4", reason="the extra `test` has netCDF4")


@pytest.fixture
def opened(tmp_path):
    """`opened(table)`: the file that a table or a list is saved as."""
    files = []

    def call(table):
        path = tmp_path / f"{len(files)}.nc"
        table.save(path)
        files.append(netCDF4.Dataset(path))
        files[-1].set_auto_mask(False)
        return files[-1]

    yield call
    for file in files:
        file.close()


@pytest.mark.parametrize(
    "table",
    [
        thin_grating(0.8, counts=(3, 2, 2), superstrate=1.58),
        thin_grating(0.8, counts=(3, 2, 2), thin=True),
        shallow_grating(1.2 + 6j, counts=(3, 2, 2)),
    ],
    ids=["grooves", "sheet", "polarised"],
)
def test_tables_over_cells_have_their_numbers_names_and_units(table, opened):
    file = opened(table)
    assert file.data_model == "NETCDF3_CLASSIC"
    assert (file.period, file.period_units) == (table.period, "um")
    assert (tuple(file.wavelengths), file.wavelengths_units) == (table.wavelengths, "nm")
    assert file.superstrate == table.superstrate
    assert getattr(file, "thin", 0) == table.thin
    for band in table.bands:
        for kind, values in zip("ab", band.kinds, strict=False):
            variable = file[f"kind_{kind}_{band.k}"]
            assert variable.dimensions[:3] == tuple(f"{x}_{band.k}" for x in ("tau", "rho", "w"))
            assert variable.units == "1"
            np.testing.assert_array_equal(variable[:], values)


def test_crossed_tables_have_light_of_two_periods_and_their_index(opened):
    table = crossed.clear_table()
    file = opened(table)
    assert (file.period, file.period_y) == crossed.PERIODS
    assert file.index == crossed.INDEX
    units = [file[name].units for name in ("wavelength", "theta", "phi")]
    assert units == ["nm", "degree", "degree"]
    values = file["efficiency"]
    assert values.dimensions == ("wavelength", "theta", "phi", "side", "port", "element")
    lam, theta, phi = (file[name][:] for name in ("wavelength", "theta", "phi"))
    assert values.shape[-2] == len(file["order_x"][:]) == len(file["order_y"][:])
    a, b, c = 1, 3, 5
    sine, turn = math.sin(math.radians(theta[b])), math.radians(phi[c])
    light = -sine * math.cos(turn), -sine * math.sin(turn), lam[a]
    for n, order in enumerate(zip(file["order_x"][:], file["order_y"][:], strict=True)):
        share = crossed.clear_efficiency(*light, *order)
        if np.isfinite(share):
            assert values[a, b, c, 0, n, 0] == pytest.approx(share, rel=1e-6)


def test_lists_have_the_lines_of_the_csv(opened, tmp_path):
    table, light = shallow_grating(0.97 + 6.4j, 0.1), ([520.0, 560.0], [0.0, 40.0], [0.0, 60.0])
    for options, names in (({"polarised": True}, ("R_s", "R_p")), ({"jones": True}, JONES)):
        listing = list_orders(table, *light, **options)
        listing.save(tmp_path / "list.csv")
        lines = np.genfromtxt(tmp_path / "list.csv", delimiter=",", names=True)
        file = opened(listing)
        axes = {"wavelength": "nm", "theta": "degrees", "phi": "degrees", "order": "1"}
        assert {name: file[name].units for name in axes} == axes
        columns = ("wavelength_nm", "theta_deg", "phi_deg", "order")
        places = tuple(
            np.searchsorted(file[axis][:], lines[column])
            for axis, column in zip(axes, columns, strict=True)
        )
        for name in names:
            assert file[name].units == "1"
            np.testing.assert_allclose(file[name][:][places], lines[name], rtol=1e-6, atol=1e-12)
            assert np.isfinite(file[name][:]).sum() == len(lines)
