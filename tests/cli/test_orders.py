"""Commands on tables of orders: `info` and `brdf-map`."""

from __future__ import annotations

import json
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest

from tests.support import crossed
from tests.support.orders import listed_grating, thin_grating


def test_info_describes_a_table_of_orders(run, here):
    path = here / "grating.nc"
    thin_grating(0.6, counts=(2, 2, 1)).save(path)
    data = json.loads(run("info", path, "--json").out)
    assert (data["kind"], data["period_um"]) == ("table of orders", 0.6)
    assert "4 bands" in data["grid"]
    assert run("info", path, "--level", "plane").code != 0


def test_maps_show_a_table_of_orders(run, here):
    thin_grating(0.6, counts=(2, 2, 1)).save(here / "grating.nc")
    flags = ("--resolution", 16, "--samples", 1, "--wavelength", 550)
    assert run("brdf-map", "grating.nc", *flags).code == 0
    assert (here / "grating-map.exr").is_file()
    refused = run("brdf-map", "grating.nc", "--material", "Al", *flags)
    assert refused.code != 0
    assert "leave --material out" in refused.err


def test_orders_are_listed_as_import_reads_them(run, here):
    thin_grating(0.6, counts=(2, 2, 1), wavelengths=(500.0, 640.0)).save("grating.nc")
    assert run("orders", "grating.nc", "--theta=-80:80:10", "--step", 70).code == 0
    flags = ("--import", "--period", 0.6, "-o", "back.nc")
    assert run("solve", "grating.csv", *flags).code == 0
    assert "rising" in run("orders", "grating.nc", "--theta", "80:0:10").err
    assert "500 to 640 nm" in run("orders", "grating.nc", "--wavelength", "450").err


def test_spectra_of_a_table_of_orders_end_where_it_ends(run, here):
    thin_grating(0.6, counts=(2, 2, 1), wavelengths=(420.0, 680.0)).save("grating.nc")
    assert run("spectrum", "grating.nc", "--step", 40, "--relative", "none").code == 0
    lines = (here / "grating-spectrum.csv").read_text().split()
    first, last = (float(lines[n].partition(",")[0]) for n in (1, -1))
    assert 420 <= first < last <= 680
    for wanted in ("300:900", "300:400"):
        refused = run("spectrum", "grating.nc", "--wavelength-range", wanted, "--step", 100)
        assert "420 to 680 nm" in refused.failed_in_one_line()


def test_a_brdf_is_written_for_other_programs(run, here):
    thin_grating(0.6, counts=(2, 2, 1)).save("grating.nc")
    grid = ("--theta", "0,40", "--phi", 0, "--wavelength", 550, "--resolution", 8)
    assert run("export-bsdf", "grating.nc", *grid, "--format", "zemax").code == 0
    assert run("export-bsdf", "grating.nc", *grid, "-o", "grating.brdf").code == 0
    assert run("export-bsdf", "grating.nc", *grid, "-o", "grating.csv").code == 0
    assert (here / "grating.csv").read_text().startswith("theta_i_deg,")
    assert (here / "grating.bsdf").read_text("ascii").endswith("DataEnd\n")
    assert json.loads((here / "grating.brdf").read_text())["metadata"]["type"] == "BRDF"
    dark = run("export-bsdf", "grating.nc", *grid[:4], "--wavelength", "550,900", "-o", "dark.csv")
    assert "380 to 780 nm" in dark.err
    assert not (here / "dark.csv").exists()
    refused = run("export-bsdf", "grating.nc", "--format", "bird", "-o", "x.bsdf")
    assert ".json or .brdf" in refused.err
    assert "no heights" in run("evaluate", "grating.nc").err


def test_a_block_is_solved_and_other_programs_refuse_it(run, here, monkeypatch):
    # a process takes a second to start
    monkeypatch.setattr("mitsuba_diffraction.orders.solve.jobs.processes", ThreadPoolExecutor)
    monkeypatch.setattr("mitsuba_diffraction.orders.solve.accuracy.SAMPLES", 16)
    grating = ("--period", 0.3, "--depth", 0.01, "--material", 1.5, "--wavelength-range", "540:560")
    settings = ("--tolerance", 0.2, "--resolution", 3, "-o", "block.nc")
    ran = run("solve", "lamellar", *grating, "--block", *settings).succeeded()
    assert "index 1.5" in ran.out
    assert json.loads(run("info", "block.nc", "--json").out)["block_index"] == 1.5
    assert run("orders", "block.nc").code == 0
    assert "light that goes through" in run("export-bsdf", "block.nc").err
    for other in (("--superstrate", 1.3), ("--thin",), ("--layer", "1.46:0.1")):
        assert "leave these out" in run("solve", "lamellar", *grating, "--block", *other).err
    assert "--import" in run("solve", "a.csv", "--import", "--period", 1, "--block").err


def test_crossed_gratings_are_listed_imported_and_measured(run, here):
    crossed.table().save("crossed.nc")
    data = json.loads(run("info", "crossed.nc", "--json").out)
    assert data["periods_um"] == list(crossed.PERIODS)
    light = ("--theta", "0:80:20", "--phi", "0:315:45", "--step", 100)
    listed = run("orders", "crossed.nc", *light)
    assert "orders (-3, -4) to (3, 4)" in listed.out
    periods = ("--period", 0.8, "--period-y", 1.1)
    assert run("solve", "crossed.csv", "--import", *periods, "-o", "back.nc").code == 0
    assert "does not propagate" in run("solve", "crossed.csv", "--import", "--period", 0.5).err
    assert run("orders", "crossed.nc", "--polarised").code == 0
    maps = ("--resolution", 16, "--samples", 1, "--wavelength", 550)
    assert run("brdf-map", "back.nc", *maps).code == 0
    assert run("spectrum", "back.nc", "--step", 100, "--relative", "none").code == 0
    for command in ("export-shader", "export-osl"):
        assert "crossed grating" in run(command, "back.nc").err


def test_a_crossed_grating_is_solved(run, here):
    np.save("flat.npy", np.zeros((4, 4)))
    flags = ("--crossed", "--period", 0.2, "--wavelength-range", "500:500", "--resolution", 3)
    light = ("--theta", "0,60", "--polarised")
    solved = run("solve", "flat.npy", *flags, *light, "-o", "flat.nc")
    assert "1 order, " in solved.out
    run("orders", "flat.nc", "--theta", 60, "--polarised", "-o", "flat.csv")
    s, p = np.loadtxt("flat.csv", delimiter=",", skiprows=1)[-2:].tolist()
    inside = np.sqrt(1.5**2 - 0.75)
    assert s == pytest.approx(((0.5 - inside) / (0.5 + inside)) ** 2, rel=1e-6)  # Fresnel
    assert p == pytest.approx(((1.125 - inside) / (1.125 + inside)) ** 2, rel=1e-6)
    assert run("solve", "flat.npy", "--crossed").err.count("--period") > 0
    assert "not allowed with --crossed" in run("solve", "flat.npy", *flags, "--duty", 0.3).err
    assert "leave out" in run("solve", "flat.npy", *flags, "--thin").err
    assert "one-dimensional" in run("solve", "flat.npy", "--period", 0.2).err


@pytest.mark.parametrize(
    "measured",
    [
        ("brdf-map", "--wavelength", 550, "--resolution", 16, "--samples", 1),
        ("brdf-map", "--resolution", 16, "--samples", 1, "--step", 50),
        ("spectrum", "--step", 50, "--relative", "none"),
        ("export-bsdf", "--phi", 0, "--wavelength", 550, "--resolution", 8),
    ],
    ids=lambda words: " ".join(map(str, words[:2])),
)
def test_light_from_directions_that_were_not_solved_is_warned_of(run, here, measured):
    listed_grating().save("grating.nc")  # of -20, 0 and 20 degrees
    command, *flags = measured
    angle = "--light" if command == "spectrum" else "--theta"
    for theta, lines in ((20, 0), (45, 1)):
        ran = run(command, "grating.nc", angle, theta, *flags, "-o", f"{theta}.csv"
                  if command != "brdf-map" else f"{theta}.png").succeeded()  # fmt: skip
        assert ran.err.count("gets the efficiencies of the nearest, theta 20°, phi") == lines
