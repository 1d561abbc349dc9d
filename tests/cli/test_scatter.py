"""`scatter`: spectrum, scatter and ABg model of a rough mirror."""

from __future__ import annotations

import json

import numpy as np
import pytest

from mitsuba_diffraction.columns import read_columns
from tests.support.directions import rough_patch

pytestmark = pytest.mark.thorough

RECIPE = """generator = "rough"
[arguments]
extent = 40.0
pixels = 192
rms = 0.003
slope = 1.0
"""


def test_a_rough_mirror_s_spectrum_and_scatter_are_written(run, here):
    (here / "mirror.toml").write_text(RECIPE)
    ran = run(
        "scatter", "mirror.toml", "--wavelength", "500,632.8", "--json", "figures.json"
    ).succeeded()
    assert "Rayleigh-Rice" in ran.out
    columns = read_columns("mirror-scatter.csv").of(("frequency_per_um", "psd_um4"))
    assert (np.diff(columns[:, 0]) > 0).all()
    assert (here / "mirror-scatter.png").stat().st_size > 1000
    figures = json.loads((here / "figures.json").read_text())
    assert figures["rms_um"] == pytest.approx(0.003, rel=0.05)
    for row in figures["wavelengths"]:
        # the theory is of the first power of (4πσ/λ)² = 0.006, and its window is another one
        assert row["tis_table"] == pytest.approx(row["tis_rayleigh_rice"], rel=0.02)
        assert row["g"] == pytest.approx(2.0, abs=0.3)


def test_a_spectrum_that_no_model_fits_has_none_and_a_wrong_wavelength_is_named(run, here):
    waves = 0.003 * np.sin(np.arange(192) * 2 * np.pi / 8)
    np.save("waves.npy", np.tile(waves, (192, 1)))
    asked = ("scatter", "waves.npy", "--pixel-size", "0.2", "--periodic", "exact")
    ran = run(*asked, "--json", "figures.json").succeeded()
    assert "no ABg model fits" in ran.out
    row = json.loads((here / "figures.json").read_text())["wavelengths"][0]
    assert row["a"] is row["error"] is None
    for wrong in ("0.5", "200000"):
        ran = run(*asked, "--wavelength", wrong)
        assert ran.code == 2
        assert "argument --wavelength: " in ran.err


def test_grooves_finer_than_the_wavelength_scatter_no_light(run, here):
    """(4πσ/λ)² of all heights is 0.0016, and every order but the mirror's is evanescent."""
    np.save("fine.npy", np.tile(0.0028 * np.cos(np.arange(400) * 2 * np.pi / 10), (400, 1)))
    asked = ("scatter", "fine.npy", "--pixel-size", "0.04", "--periodic", "exact")
    run(*asked, "--json", "figures.json").succeeded()
    row = json.loads((here / "figures.json").read_text())["wavelengths"][0]
    assert row["tis_table"] < 1e-9


@pytest.mark.parametrize(("slope", "said"), [(0.012, False), (0.1, True)])
def test_the_tilt_of_a_mirror_is_levelled_or_said(run, here, slope, said):
    smooth = rough_patch((64, 64), (0.3, 0.3), 0.0005).heights
    np.save("mirror.npy", smooth + slope * 0.3 * np.arange(64))
    asked = ("scatter", "mirror.npy", "--pixel-size", "0.3", "--json", "figures.json")
    ran = run(*asked).succeeded()
    assert ("--level plane" in ran.err) is said, ran.err
    row = json.loads((here / "figures.json").read_text())["wavelengths"][0]
    assert (row["tis_table"] < 1e-3) is not said
