"""`evaluate`: heights in, a picture and numbers out, or one line."""

from __future__ import annotations

import csv
import os

import numpy as np
import pytest
from PIL import Image

from mitsuba_diffraction.thesis.methods import NAMES

QUICK = [
    "--pixel-size", "0.08", "--coherence-width", "12", "--step", "40", "--angle-step", "0.5",
    "--positions", "2",
]  # fmt: skip
# Two periods of the grating of `heights` are known to repeat only if the command says so.
EXACT = ["--periodic", "exact"]

pytestmark = [pytest.mark.thorough, pytest.mark.usefixtures("here")]


def test_picture_and_numbers_are_written_and_the_period_is_found(run, heights, here):
    ran = run("evaluate", heights, *EXACT, *QUICK).succeeded()
    assert sorted(os.listdir(here)) == [f"grating-evaluation.{s}" for s in ("csv", "npz", "png")]
    for part in ("fitted", "residual", "2 of 2 window positions", "by its procedure"):
        assert part in ran.out
    with np.load("grating-evaluation.npz") as saved:
        assert saved["scatter"].shape == (saved["wavelengths"].size, saved["angles"].size)
        # the grating of `heights` has a period of 3 µm; a window of 4 periods moves its maxima
        assert float(saved["fitted_period"]) == pytest.approx(3.0, rel=0.02)
        # the window of four periods moves the maximum by less than the error says
        assert abs(float(saved["fitted_period"]) - 3.0) < 2 * float(saved["fit_error"])
        # and the error is smaller than half of the lobe's standard deviation, 11 % of the period
        assert 0.0 < float(saved["fit_error"]) < 0.5 * 0.11 * 3.0
    assert "to publish (fit" in ran.out.splitlines()[-1]
    with open("grating-evaluation.csv", encoding="utf-8") as stream:
        rows = list(csv.DictReader(stream))
    assert [float(r["wavelength_nm"]) for r in rows] == [*np.arange(360.0, 821.0, 40.0), 830.0]
    assert abs(float(rows[3]["difference_deg"])) < 0.5
    with Image.open("grating-evaluation.png") as image:
        assert image.size[0] > 500


@pytest.mark.parametrize(("period", "repeats", "blaze", "phase"), [
    (1.6, 4.0, 10.0, 0.02), (1.6, 4.0, 10.0, 0.3), (1.0, 4.0, -8.0, 0.5), (3.0, 4.3, 10.0, 0.02),
    (3.0, 4.3, 5.0, 0.3),
])  # fmt: skip
def test_few_periods_of_a_blazed_grating_are_within_their_error(
    run, here, period, repeats, blaze, phase
):
    """The jumps at a scan's edges move the maxima, by up to 3 % of the period."""
    pixel = period / 32
    x = np.arange(round(repeats * 32)) / 32 + phase
    facets = (x % 1.0 - 0.5) * period * np.tan(np.radians(blaze))
    noise = np.random.default_rng(0).normal(0.0, 0.001, (x.size, x.size))
    np.save("blazed.npy", facets + noise)
    asked = ("--pixel-size", f"{pixel}", "--step", "25", "--angle-step", "0.2", "--positions", "2")
    ran = run("evaluate", "blazed.npy", *asked).succeeded()
    with np.load("blazed-evaluation.npz") as saved:
        fitted, error = float(saved["fitted_period"]), float(saved["fit_error"])
    # two standard errors
    assert abs(fitted - period) < 2.0 * error
    assert error < 0.1 * period
    line = next(line for line in ran.out.splitlines() if "window positions" in line)
    mean, spread = line.split(": ")[1].split(" nm")[0].split(" ± ")
    assert abs(float(mean) - 1e3 * period) < 2.0 * float(spread)


@pytest.mark.parametrize("medium", ["1.05", "water"])
def test_in_a_medium_the_period_is_the_surface_s_own(run, heights, medium):
    # periods are longer in units of the waves, and the window is not
    run(
        "evaluate", heights, *EXACT, *QUICK, "--coherence-width", "24", "--ext-ior", medium
    ).succeeded()
    with np.load("grating-evaluation.npz") as saved:
        # as in air: a window of 4 periods moves the maxima, of single positions more
        assert float(saved["fitted_period"]) == pytest.approx(3.0, rel=0.02)
        assert saved["window_periods"] == pytest.approx(3.0, rel=0.05)
        assert np.nanmax(np.abs(saved["grating"] - saved["ridge"])) < 1.0


@pytest.mark.parametrize("method", NAMES[1:])
def test_every_method_can_be_evaluated(run, heights, method):
    ran = run(
        "evaluate", heights, *EXACT, *QUICK[:-1], "0", "--method", method, "-o", "a.png"
    ).succeeded()
    assert f"method {method}" in ran.out


def test_a_strip_too_long_for_single_windows_is_fitted_all_the_same(run, tmp_path):
    x, noise = 0.1 * np.arange(4096), np.random.default_rng(3).normal(0.0, 0.005, (64, 4096))
    np.save(tmp_path / "strip.npy", 0.05 * np.sin(2.0 * np.pi * x / 1.6) + noise)
    ran = run(
        "evaluate", tmp_path / "strip.npy", "--pixel-size", "0.1", "--step", "100"
    ).succeeded()
    assert "fitted    1" in ran.out
    assert "windows   cannot build the table" in ran.out


def test_the_light_comes_across_the_grooves_and_steep_slopes_are_counted(run, tmp_path):
    y, x = np.mgrid[:240, :240] * 0.08
    turn = np.radians(30.0)
    waves = 0.1 * np.cos(2 * np.pi * (x * np.cos(turn) + y * np.sin(turn)) / 1.5)
    np.save(tmp_path / "turned.npy", waves)
    ran = run("evaluate", tmp_path / "turned.npy", *QUICK).succeeded()
    assert "on 'turned.npy': mitsuba-diffraction info" in ran.err
    assert "φ = 30°" in ran.out
    assert "spectrum  1.5 µm along 30°" in ran.out
    with np.load("turned-evaluation.npz") as saved:
        assert float(saved["fitted_period"]) == pytest.approx(1.5, rel=0.02)
        assert saved["angles"].min() > 0.0  # sin = sin 75° − 1.25·0.83/1.5
    ran = run("evaluate", tmp_path / "turned.npy", *QUICK, "--phi", "120", "-o", "along.png")
    assert "φ = 120°" in ran.out
    assert "fitted    none: the light on this side follows no grating equation" in ran.out
    with np.load("along.npz") as saved:
        assert np.isnan(saved["fitted_period"])
        assert np.isnan(saved["ridge"]).all()
