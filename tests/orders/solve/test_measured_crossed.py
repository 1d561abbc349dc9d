"""Imports of crossed gratings, and their export."""

from __future__ import annotations

import warnings

import numpy as np
import pytest

import mitsuba_diffraction as md
from mitsuba_diffraction import DiffractionError, DiffractionWarning
from mitsuba_diffraction.orders.listing import list_orders
from tests.support import crossed

THETA, PHI = np.arange(0.0, 81.0, 20.0), np.arange(0.0, 360.0, 45.0)
WAVES = np.array([500.0, 600.0])


@pytest.fixture
def grid():
    return crossed.listed(THETA, PHI, WAVES)


def imported(grid, folder, periods=crossed.PERIODS):
    crossed.save_csv(grid, folder / "crossed.csv")
    return md.read_orders(folder / "crossed.csv", periods)


def test_exported_orders_come_back(tmp_path):
    table = crossed.table()
    listing = list_orders(
        table, np.arange(450, 651, 20.0), np.arange(0, 86, 5.0), np.arange(0, 360, 15.0)
    )
    listing.save(tmp_path / "out.csv")
    back = md.read_orders(tmp_path / "out.csv", crossed.PERIODS)
    # the same lights: seven digits of the list
    there, here = back.response.values, table.response.values
    assert np.abs(there - here).sum() < 1e-4 * here.sum()
    assert back.header["error_mean"] < 1e-5
    assert back.header["reciprocity_error"] < 0.05


def test_lines_without_the_ratio_of_cosines_are_warned_of(grid, tmp_path):
    lam, theta, phi = np.meshgrid(WAVES, np.radians(THETA), np.radians(PHI), indexing="ij")
    x, y = -np.sin(theta) * np.cos(phi), -np.sin(theta) * np.sin(phi)
    m, n = grid.orders.T
    out = x[..., None] + m * lam[..., None] / 800.0, y[..., None] + n * lam[..., None] / 1100.0
    square = np.maximum(1.0 - out[0] ** 2 - out[1] ** 2, 0.03)
    ratio = 0.2 * np.cos(theta)[..., None] / np.sqrt(square)
    wrong = grid._replace(values=grid.values * ratio[..., None])
    with pytest.warns(DiffractionWarning, match="ratio of cosines"):
        imported(wrong, tmp_path)


def test_a_lack_of_azimuths_is_warned_of(tmp_path):
    with pytest.warns(DiffractionWarning, match="phi from 0 to 345"):
        imported(crossed.listed(THETA, np.array([0.0, 90.0]), WAVES), tmp_path)


def test_one_wavelength_makes_a_table(tmp_path):
    table = imported(crossed.listed(THETA, PHI, WAVES[:1]), tmp_path)
    light = 0.0, 0.0, WAVES[0], 1, 0
    assert table.efficiency(*light) == pytest.approx(crossed.efficiency(*light), rel=1e-3)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda text: text.replace("order_y", "order_z", 1), "no column order_y"),
        (lambda text: text.replace(",R_s,R_p", ",R_s,R_p,T_s,T_p", 1), "no column R_s"),
        (lambda text: text.replace("500,0,0,1,0,", "500,0,0,1.5,0,"), "whole number"),
        (lambda text: text.replace("500,0,0,1,0,", "500,0,0,2,0,"), r"\(2, 0\) does not"),
        (lambda text: "".join(line for line in text.splitlines(True)
                              if not line.startswith("500,0,0,1,0,")), r"\(1, 0\) propagates"),
        (lambda text: text + "500,0,0,1,0,0.1,0.1\n", "listed twice"),
    ],
)  # fmt: skip
def test_a_wrong_file_is_refused(grid, tmp_path, change, message):
    crossed.save_csv(grid, tmp_path / "crossed.csv")
    (tmp_path / "crossed.csv").write_text(change((tmp_path / "crossed.csv").read_text()))
    with pytest.raises(DiffractionError, match=message):
        md.read_orders(tmp_path / "crossed.csv", crossed.PERIODS)


def test_wrong_periods_are_refused(grid, tmp_path):
    with pytest.raises(DiffractionError, match="check the periods"):
        imported(grid, tmp_path, (0.5, 1.1))
    crossed.save_csv(grid, tmp_path / "crossed.csv")
    with pytest.raises(DiffractionError, match="superstrate"):
        md.read_orders(tmp_path / "crossed.csv", crossed.PERIODS, superstrate=1.5)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", DiffractionWarning)
        (tmp_path / "grooves.csv").write_text(
            "wavelength_nm,theta_deg,order,R_s,R_p\n500,0,0,0.5,0.5\n"
        )
        with pytest.raises(DiffractionError, match="order_x and order_y"):
            md.read_orders(tmp_path / "grooves.csv", (0.4, 0.4))
