"""`spectrum`: scans, recipes or tables in, a CSV for pavo and a picture out, or one line."""

from __future__ import annotations

import json
import os

import numpy as np
import pytest

from mitsuba_diffraction.analysis import angular_variables
from mitsuba_diffraction.heights import gratings

pytestmark = pytest.mark.usefixtures("here", "spectral")

PIXEL = ["--pixel-size", str(1.6 / 64)]
QUICK = ["--coherence-width", "6", "--wavelength-range", "400:700", "--step", "50"]


@pytest.fixture
def scans(here):
    """A folder of two scans of one kind of surface."""
    folder = here / "scans"
    folder.mkdir()
    for n in range(2):
        field = gratings.sinusoidal(period=1.6, depth=0.03 + 0.01 * n, periods=5, rows=20)
        np.save(folder / f"scan{n}.npy", field.heights)
    return folder


def read(path):
    return np.genfromtxt(path, delimiter=",", names=True)


def test_a_csv_and_a_picture_are_written_and_named(run, scans, here):
    run("spectrum", scans / "scan0.npy", *PIXEL, *QUICK, "--light", "20", "--detector", "20",
        "0", "--json", "s.json").succeeded()  # fmt: skip
    assert {"scan0-spectrum.csv", "scan0-spectrum.png"} <= set(os.listdir(here))
    rows = read("scan0-spectrum.csv")
    assert rows["wl"].tolist() == [400.0, 450.0, 500.0, 550.0, 600.0, 650.0, 700.0]
    assert rows["light20_detector20"].min() > 100.0  # the mirror's light, in per cent of white
    document = json.loads((here / "s.json").read_text("utf-8"))
    assert document["unit"] == "1"  # and the CSV in per cent
    assert document["spectra"]["light20_detector0"][0] == pytest.approx(
        rows["light20_detector0"][0] / 100.0, rel=1e-4
    )


def test_a_single_wavelength_is_measured_of_heights_too(run, scans):
    run("spectrum", scans / "scan0.npy", *PIXEL, *QUICK[:2], "--wavelength-range", "633:633",
        "-o", "one.csv").succeeded()  # fmt: skip
    assert read("one.csv")["wl"].tolist() == 633.0


def test_a_surface_without_light_has_the_reason_that_suits_its_detectors(run, scans):
    """Its index is the medium's where the mirror direction is dark; else orders may miss it."""
    bare = *PIXEL, *QUICK, "--ext-ior", "1.5", "--int-ior", "1.5"
    assert "--int-ior" in run("spectrum", scans / "scan0.npy", *bare, "-o", "a.csv").err
    away = run("spectrum", scans / "scan0.npy", *bare, "--detector", "75", "-o", "b.csv").err
    assert "--azimuth auto" in away


@pytest.mark.parametrize("asked", [("--height-scale", "2"), ("--coat-ior", "1.6")])
def test_the_table_serves_the_heights_that_are_asked_for(run, scans, asked):
    run("spectrum", scans / "scan0.npy", *PIXEL, *QUICK, *asked, "-o", "scaled.csv").succeeded()
    twice = gratings.sinusoidal(period=1.6, depth=0.06, periods=5, rows=20).heights
    np.save(scans / "twice.npy", twice)
    run("spectrum", scans / "twice.npy", *PIXEL, *QUICK, "-o", "twice.csv")
    agrees = read("scaled.csv")["light30_detector30"] == pytest.approx(
        read("twice.csv")["light30_detector30"], rel=0.01
    )
    assert agrees is (asked[0] == "--height-scale")


@pytest.mark.parametrize("file", ["orders.nc", "t.exr"])
def test_wavelengths_that_a_table_lacks_are_refused_if_they_were_asked_for(run, world, file):
    """Of the default range they are left out, in one line: of both kinds of tables."""
    how = ["--light", "10", "--detector", "0", "--step", "50", "-o", "out.csv"]
    ran = run("spectrum", file, *how).succeeded()
    assert ran.err.count(": other wavelengths are left out") == 1
    (world / "out.csv").unlink()
    line = run("spectrum", file, *how, "--wavelength-range", "310:650").failed_in_one_line()
    assert f"'{file}' has light from " in line
    assert "and the wavelengths are " in line
    assert not (world / "out.csv").exists()


@pytest.mark.parametrize(
    ("heights", "pixel", "said"),
    [(np.eye(8), 0.05, "is narrower than two wavelengths and has no colours"),
     (1e-6 * np.eye(64), 0.05, "multiply the heights by 1e6 if they are in metres"),
     (0.1 * np.eye(16), 50, "is the pixel size of 50 µm in nm?")],
    ids=["eight pixels", "metres", "nanometres"],
)  # fmt: skip
def test_scans_without_colours_and_in_other_units_are_said_in_full(run, here, heights, pixel, said):
    """Not as one of some notes that `info` prints."""
    np.save(here / "a.npy", heights)
    ran = run("spectrum", "a.npy", "--pixel-size", pixel, "--step", "200").succeeded()
    assert said in ran.err


@pytest.mark.parametrize(("command", "suffix"), [("spectrum", ".csv"), ("survey", "")])
def test_results_of_an_earlier_run_beside_the_scans_are_left_out(
    run, scans, monkeypatch, command, suffix
):
    """As a shell names them for `spectrum *`, and in a folder."""
    monkeypatch.chdir(scans)
    for words in (["scan0.npy", "--observer", "dog"], ["--group", "a=scan?.npy"]):
        assert run("spectrum", *words, *PIXEL, *QUICK[:2], "--step", "50").code == 0
    results = sorted(name for name in os.listdir() if not name.endswith(".npy"))
    assert len(results) == 9, results
    for n, names in enumerate([sorted(os.listdir()), ["."]]):
        ran = run(
            command, *names, *PIXEL, *QUICK[:2], "-o", scans.parent / f"{n}{suffix}"
        ).succeeded()
        assert all(name in ran.err for name in results)
    ran = run(command, *results[:2], *PIXEL, "-o", scans.parent / f"b{suffix}")
    line = ran.failed_in_one_line()
    assert f"'{results[0]}' is a plot or table of results, and no scan" in line


def test_a_folder_and_a_pattern_are_repeated_scans(run, scans, here):
    run("spectrum", scans, *PIXEL, *QUICK, "-o", "folder.csv").succeeded()
    run("spectrum", scans / "*.npy", *PIXEL, *QUICK, "-o", "pattern.csv").succeeded()
    assert (here / "folder.csv").read_bytes() == (here / "pattern.csv").read_bytes()
    assert (read("folder-errors.csv")["light30_detector30"] > 0.0).all()


def test_a_broken_scan_of_a_group_is_said_and_left_out(run, scans, here):
    (scans / "scan2.npy").write_bytes(b"\x93NUMPY, cut short")
    ran = run("spectrum", "--group", f"some={scans}", *PIXEL, *QUICK, "-o", "some.csv")
    assert ran.code == 1
    assert "left out: " in ran.err
    assert "some (2 scans)" in ran.out
    assert (here / "some.csv").exists()
    for n in range(2):
        (scans / f"scan{n}.npy").unlink()
    ran = run("spectrum", "--group", f"some={scans}", *PIXEL, *QUICK, "-o", "none.csv")
    assert "scan2.npy" in ran.failed_in_one_line()
    assert not (here / "none.csv").exists()


def test_groups_have_columns_errors_colours_and_variables_each(run, scans, here, monkeypatch):
    for name in ("LAMPS", "DETECTORS"):
        monkeypatch.setattr(angular_variables, name, getattr(angular_variables, name)[::4])
    (here / "t.toml").write_text(f'["*.npy"]\npixel_size = {PIXEL[1]}\n')
    run("spectrum", "--group", f"a b={scans / 'scan0.npy'}", "--group", f"both={scans}",
        "--treatments", "t.toml", *QUICK, "--detector", "-20:20:20",
        "--iridescence", "-o", "g.csv").succeeded()  # fmt: skip
    names = read("g.csv").dtype.names
    angles = ("m20", "0", "20")
    expected = [f"{name}_light30_detector{a}" for name in ("a_b", "both") for a in angles]
    assert names == ("wl", *expected)
    assert read("g-errors.csv").dtype.names == ("wl", *expected[3:])
    colours = (here / "g-colours.csv").read_text("utf-8").splitlines()
    assert colours[0].startswith("spectrum,srgb,hue,chroma,B1,B2,B3,S8,H1")
    assert [line.split(",")[0] for line in colours[1:]] == expected
    variables = [line.split(",") for line in (here / "g-iridescence.csv").read_text().splitlines()]
    assert variables[0] == ["group", "scan", *angular_variables.VARIABLES]
    assert [row[:2] for row in variables[1:]] == [["a b", "1"], ["both", "1"], ["both", "2"]]
    assert all(float(row[2]) > 0.0 for row in variables[1:])


def test_crops_of_a_scan_have_errors_and_auto_turns_the_lamp(run, scans, here):
    ran = run("spectrum", scans / "scan0.npy", "--pixel-size", "0.05", *QUICK, "--azimuth", "auto",
              "--detector", "0", "-o", "c.csv", "--light", "20").succeeded()  # fmt: skip
    assert "azimuth across 1.6 µm along 0°" in ran.err
    field = gratings.sinusoidal(period=1.6, depth=0.03, periods=40, rows=64)
    np.save(here / "wide.npy", np.tile(field.heights[:64, :128], (1, 1)))
    run("spectrum", "wide.npy", *PIXEL, *QUICK, "--crops", "2", "-o", "c.csv").succeeded()
    assert "c-errors.csv" in os.listdir(here)


def test_notes_on_many_scans_are_one_scan_s_and_samples_that_are_averaged_are_said(run, scans):
    for n, name in enumerate(("scan0", "other1")):
        np.save(scans / f"{name}.npy", 2.5 * np.load(scans / f"scan{n}.npy"))
    (scans / "scan1.npy").unlink()
    ran = run("spectrum", scans, *PIXEL, *QUICK).succeeded()
    assert sum("info " in line for line in ran.err.splitlines()) == 1
    for said in ("1 more scan", "2 names", "--group"):
        assert said in ran.err


def test_an_observer_has_catches_of_each_column_and_contrasts_of_each_pair(run, scans, here):
    span = ["--coherence-width", "6", "--wavelength-range", "300:700", "--step", "50"]
    ran = run("spectrum", scans / "scan0.npy", *PIXEL, *span, "--observer", "avian_uv",
              "--detector", "20", "30", "40", "-o", "o.csv").succeeded()  # fmt: skip
    catches = (here / "o-catches.csv").read_text("utf-8").splitlines()
    assert catches[0] == "spectrum,u,s,m,l"
    assert len(catches) == 4
    pairs = (here / "o-contrasts.csv").read_text("utf-8").splitlines()
    assert pairs[0] == "patch1,patch2,dS,dL"
    assert [line.split(",")[1][-2:] for line in pairs[1:]] == ["30", "40", "40"]
    assert "u 1 : s 1.92 : m 2.68 : l 2.7; Weber fraction 0.1 of l; luminance by l" in ran.err
    noise = ["--cone-ratios", "1,1,1,1", "--weber", "0.2", "--weber-luminance", "0.2"]
    ran = run("spectrum", scans / "scan0.npy", *PIXEL, *span, "--observer", "avian_uv", *noise,
              "--detector", "20", "30", "40", "-o", "p.csv")  # fmt: skip
    others = (here / "p-contrasts.csv").read_text("utf-8").splitlines()
    for one, other in zip(pairs[1:], others[1:], strict=True):
        assert float(other.split(",")[3]) == pytest.approx(float(one.split(",")[3]) / 2, rel=1e-4)
    ran = run("spectrum", scans / "scan0.npy", *PIXEL, *QUICK, "--observer", "avian_uv")
    assert (ran.code, "from 305" in ran.err) == (1, True)


def test_a_measured_curve_is_drawn_beside_and_compared(run, scans, here):
    how = (scans / "scan0.npy", *PIXEL, *QUICK, "--detector", "10", "--json", "s.json")
    run("spectrum", *how, "-o", "a.csv").succeeded()
    rows = read("a.csv")
    alone, values = (here / "a.png").read_bytes(), rows["light30_detector10"]
    lines = [f"{w:g},{v + 3.0:g}" for w, v in zip(rows["wl"], values, strict=True) if w < 650]
    (here / "m.csv").write_text("\n".join(["wl,R (%)", *lines]))
    ran = run("spectrum", *how, "--measured", "m.csv", "-o", "a.csv").succeeded()
    assert "m.csv: RMS difference 3 %" in ran.out
    assert "400 to 600 nm" in ran.out
    measured = json.loads((here / "s.json").read_text("utf-8"))["measured"]
    assert measured["rms"] == pytest.approx(0.03, rel=1e-3)
    assert (here / "a.png").read_bytes() != alone
