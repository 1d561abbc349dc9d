"""Lists of efficiencies: round trip, s and p, and refusals."""

from __future__ import annotations

import warnings

import numpy as np
import pytest

import mitsuba_diffraction as md
from mitsuba_diffraction import DiffractionError
from mitsuba_diffraction.orders.listing import list_orders
from mitsuba_diffraction.orders.solve.orders import solve_orders
from mitsuba_diffraction.orders.solve.profiles import sinusoidal
from mitsuba_diffraction.orders.solve.settings import Settings
from mitsuba_diffraction.reference.fresnel import amplitudes as fresnel
from tests.orders.kinds import light
from tests.support.orders import listed_grating, shallow_grating, thin_grating


@pytest.mark.parametrize("thin", [False, True])
def test_a_list_is_imported_as_the_table_that_it_came_from(thin, tmp_path):
    table = thin_grating(0.8, counts=(8, 8, 4), wavelengths=(500.0, 640.0), thin=thin)
    listing = list_orders(
        table, np.linspace(500, 640, 8), np.linspace(0, 85, 18), np.arange(0, 181, 15)
    )
    listing.save(tmp_path / "list.csv")
    back = md.read_orders(tmp_path / "list.csv", 0.8)  # without a warning
    for error in ("error_mean", "reciprocity_error"):
        assert back.header[error] < 0.05
    at = light(60, 0.8, table.wavelengths)
    for m in (-1, 0, 1):
        for through in (False, True)[: table.sides]:
            there, here = (t.efficiency(*at, m, transmitted=through) for t in (back, table))
            # linear interpolation over 5°, 15° and 20 nm, as the import's header says
            assert np.abs(there - here).mean() < max(0.01, back.header["error_mean"])


def test_s_and_p_need_matrices_but_in_planes_of_symmetry():
    table = thin_grating(0.8, counts=(2, 2, 1), wavelengths=(500.0, 640.0))
    for phi in (0.0, 90.0):
        assert len(list_orders(table, 550.0, 30.0, phi, polarised=True).rows)


def test_imported_tables_keep_s_and_p(tmp_path):
    path = tmp_path / "list.csv"
    lines = [f"550,{t},{p},0,0.8,0.6\n" for t in (0, 20, 40) for p in range(0, 181, 15)]
    path.write_text("wavelength_nm,theta_deg,phi_deg,order,R_s,R_p\n" + "".join(lines))
    table = md.read_orders(path, 0.25)
    table.save(tmp_path / "table.nc")
    loaded = md.OrderTable.load(tmp_path / "table.nc")
    listed = -np.sin(np.radians(20)) * np.array([np.cos(np.radians(60)), np.sin(np.radians(60))])
    np.testing.assert_allclose(loaded.polarised_efficiency(*listed, 550, 0), [0.8, 0.6], atol=1e-6)
    # axes turn by 33° between listed azimuths: linear interpolation loses 1 − cos 16.5° of 0.1
    between = loaded.polarised_efficiency(0.3, 0.4, 550, 0)
    np.testing.assert_allclose(between, [0.8, 0.6], atol=4.2e-3)
    with pytest.raises(DiffractionError, match="imported"):
        loaded.groove_efficiency(0.3, 0.4, 550, 0)


def test_jones_matrices_of_order_0_are_fresnel_s():
    """Amplitudes of a flat metal about s and p (Born and Wolf, section 1.5.2), at any azimuth."""
    index = 0.97 + 6.4j
    theta, phi = np.radians([20.0, 50.0, 70.0]), np.radians([0.0, 35.0, 130.0])
    x, y = np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi)
    jones = shallow_grating(index).jones(x, y, 550.0, 0)
    r_s, r_p = fresnel(np.cos(theta), index)
    np.testing.assert_allclose(jones[:, 0, 0], np.abs(r_s), rtol=2e-3)
    np.testing.assert_allclose(jones[:, 1, 1] / jones[:, 0, 0], r_p / r_s, rtol=3e-3)
    assert np.abs(jones[:, [0, 1], [1, 0]]).max() < 2e-3


def test_jones_matrices_have_the_efficiencies_of_s_and_p():
    table = shallow_grating(0.97 + 6.4j, 0.1)
    asked = ([520.0, 560.0], [0.0, 40.0], [0.0, 60.0])
    listing = list_orders(table, *asked, jones=True)
    shares = list_orders(table, *asked, polarised=True).rows[:, 4:]
    power = (listing.rows[:, 4:12] ** 2).reshape(-1, 2, 2, 2).sum(axis=(1, 3))
    np.testing.assert_allclose(power, shares, atol=2e-4)
    # light comes from (θ, φ): the mirror image has J_sp and J_ps of the other sign
    lam, theta, phi, m = listing.rows[listing.rows[:, 1] > 0.0].T[:4]
    sine, turn = np.sin(np.radians(theta)), np.radians(phi)
    crossing = table.jones(-sine * np.cos(turn), -sine * np.sin(turn), lam, m)[:, 0, 1]
    listed = listing.rows[listing.rows[:, 1] > 0.0, listing.columns.index("J_sp_re")]
    assert np.abs(listed).max() > 1e-3
    np.testing.assert_allclose(listed, crossing.real, atol=1e-9)


@pytest.mark.parametrize(
    ("theta", "phi", "nearest"),
    [
        (45.0, 0.0, "theta 20°, phi 0°"), (-45.0, 0.0, "theta 20°, phi 180°"),
        (20.0, 30.0, "theta 20°, phi 0°"), (-20.0, 360.0, None), (20.0, 180.0, None),
        (0.0, 0.0, None), (10.0, 0.0, "theta 10° is between"), (-10.0, 0.0, "20° apart"),
    ],
)  # fmt: skip
def test_light_outside_and_far_between_the_directions_of_a_list_is_warned_of(theta, phi, nearest):
    table = listed_grating()  # warns of its directions itself
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        list_orders(table, 580.0, theta, phi)
    assert [nearest in str(each.message) for each in caught] == [True] * (nearest is not None)


def test_the_mean_albedo_is_that_of_the_listed_lights_and_of_orders_that_propagate():
    table = solve_orders(
        sinusoidal(0.6, 0.1), "Al", theta=[-10.0, 30.0], step=25.0,
        settings=Settings((500.0, 600.0), resolution=12),
    )  # fmt: skip
    rows = [list_orders(table, np.arange(500.0, 601.0, 25.0), t).rows for t in (-10.0, 30.0)]
    listed = np.mean([part[:, 4].sum() / 5.0 for part in rows])
    assert table.albedo == pytest.approx(listed, abs=1e-6)
    assert listed < 0.95  # the orders that do not propagate would add their neighbours' light
