"""`scatter`: spectrum, scatter and ABg model of a rough mirror."""

from __future__ import annotations

import json

import numpy as np
import pytest

from mitsuba_diffraction.columns import read_columns
from mitsuba_diffraction.heights import gratings
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


def test_grooves_finer_than_the_wavelength_scatter_no_light(run, here):
    """(4πσ/λ)² of all heights is 0.0016, and every order but the mirror's is evanescent."""
    np.save("fine.npy", np.tile(0.0028 * np.cos(np.arange(400) * 2 * np.pi / 10), (400, 1)))
    asked = ("scatter", "fine.npy", "--pixel-size", "0.04", "--periodic", "exact")
    run(*asked, "--json", "figures.json").succeeded()
    row = json.loads((here / "figures.json").read_text())["wavelengths"][0]
    assert row["tis_table"] < 1e-9


@pytest.mark.parametrize("form", ["tilt", "facet", "bow"])
def test_the_form_of_a_mirror_is_named_and_no_roughness(run, here, form):
    smooth = rough_patch((64, 64), (0.3, 0.3), 0.0005).heights
    x = 0.3 * np.arange(64)
    forms = {"tilt": 0.012 * x, "facet": 0.1 * x, "bow": 0.001 * (x - 9.6) ** 2}
    rows = []
    for heights in smooth, smooth + forms[form]:
        np.save("mirror.npy", heights)
        asked = ("scatter", "mirror.npy", "--pixel-size", "0.3", "--json", "figures.json")
        ran = run(*asked).succeeded()
        rows.append(json.loads((here / "figures.json").read_text())["wavelengths"][0])
    assert "removed: it " in ran.out
    for name in ("rms_um", "tis_rayleigh_rice", "tis_table"):
        # of heights in which the form has been rounded
        assert rows[1][name] == pytest.approx(rows[0][name], rel=1e-3)


@pytest.mark.parametrize("bow", [0.0, 0.04])
@pytest.mark.parametrize("shape", [(60, 600), (400, 400)])
def test_scatter_by_theory_and_table_is_of_one_band(run, here, shape, bow):
    """Each octave of a spectrum f⁻² scatters alike, also what no window tells from the form."""
    noise = gratings.rough(160.0, 1600, rms=0.02, correlation=1e4, slope=2.0).heights
    (ny, nx), y = shape, np.linspace(-0.5, 0.5, shape[0])[:, None]
    np.save("scan.npy", noise[:ny, :nx] + bow * y**2)
    asked = ("scatter", "scan.npy", "--pixel-size", "0.1", "--json", "figures.json")
    run(*asked).succeeded()
    row = json.loads((here / "figures.json").read_text())["wavelengths"][0]
    # the table's windows weigh places of the scan otherwise than the one of the spectrum: 1 to 12 %
    # of eight such scans
    assert row["tis_table"] == pytest.approx(row["tis_rayleigh_rice"], rel=0.15)
    # cosθ lessens the scatter by a few per cent
    whole = (4 * np.pi * row["rms_um"] / 0.6328) ** 2
    assert 0.8 * whole < row["tis_rayleigh_rice"] < whole


@pytest.mark.parametrize(("heights", "why"), [
    (np.zeros((40, 40)), "flat"), (rough_patch((16, 16), (0.1, 0.1), 0.003).heights, "ring"),
])  # fmt: skip
def test_scatter_without_an_abg_model_is_told(run, here, heights, why):
    np.save("scan.npy", heights)
    asked = ("scatter", "scan.npy", "--pixel-size", "0.1", "--json", "figures.json")
    ran = run(*asked).succeeded()
    assert not ran.err
    assert "no ABg model: " in ran.out
    assert why in ran.out
    row = json.loads((here / "figures.json").read_text())["wavelengths"][0]
    assert row["a"] is None
    assert (row["tis_table"] > 0.0) is (row["tis_rayleigh_rice"] > 0.0) is bool(heights.any())


def test_a_scan_too_small_to_tell_scatter_from_form_is_refused(run, here):
    np.save("scan.npy", rough_patch((12, 12), (0.1, 0.1), 0.003).heights)
    ran = run("scatter", "scan.npy", "--pixel-size", "0.1")
    assert ran.code == 1
    assert "more than 1.1 times as wide, or a shorter wavelength" in ran.err
    run("scatter", "scan.npy", "--pixel-size", "0.1", "--wavelength", "500").succeeded()
