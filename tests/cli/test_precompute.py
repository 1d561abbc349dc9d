"""`precompute`: heights in, a table out, or one line and nothing left behind."""

from __future__ import annotations

import os
import shutil
import signal
from pathlib import Path

import numpy as np
import pytest

from mitsuba_diffraction import DiffractionError, DiffractionTable
from mitsuba_diffraction.cli.console import Bar
from tests.support.room import SCENE

# A table of 6 µm heights with these takes a tenth of a second.
QUICK = ["--pixel-size", "0.08", "--coherence-width", "6"]


@pytest.fixture
def recipe(heights):
    """A recipe in the folder of the heights; its output folder does not exist yet."""
    file = heights.parent / "grating.toml"
    file.write_text(
        'source = "grating.npy"\npixel_size = 0.08\ncoherence_width = 6\n'
        'tolerance = 1e-3\noutput = "tables/grating.exr"\n'
    )
    return file


def test_options_reach_the_table(run, heights, here):
    run(
        "precompute", heights, "-o", "out.exr", *QUICK, "--tolerance", "1e-4",
        "--wavelength-range", "400:700", "--coherence", "patch", "--height-scale-max", "2",
    ).succeeded()  # fmt: skip
    table = DiffractionTable.load("out.exr")
    assert table.coherence_width == 6
    assert table.tolerance == 1e-4
    assert table.wavelength_range == (400, 700)
    assert table.coherence == "patch"
    assert table.height_scale_max == 2


def test_a_retired_setting_is_named_and_changes_nothing(run, recipe, here):
    text = recipe.read_text()
    tables = []
    for line, options in (
        ("", []),
        ("second_order = true", []),
        ("", ["--second-order", "true"]),
    ):
        recipe.write_text(f"{line}\n{text}")
        ran = run("precompute", recipe, "-o", "out.exr", *options).succeeded()
        assert ran.err.count("is no longer a parameter") == bool(line or options)
        tables.append(DiffractionTable.load("out.exr").digest())
    assert len(set(tables)) == 1


def test_recipes_say_where_their_tables_go_or_these_lie_here(run, recipe, here):
    other, silent = (recipe.with_name(f"{name}.toml") for name in ("other", "silent"))
    text = recipe.read_text()
    other.write_text(text.replace("tables/grating", "tables/other"))
    silent.write_text("".join(text.splitlines(True)[:-1]))
    assert run("precompute", recipe, other, silent).code == 0
    assert os.listdir(here) == ["silent.exr"]
    assert sorted(os.listdir(recipe.parent / "tables")) == ["grating.exr", "other.exr"]
    assert DiffractionTable.load("silent.exr").coherence_width == 6
    # options override recipes
    assert run("precompute", recipe, "--coherence-width", "5", "-o", "a.exr").code == 0
    assert DiffractionTable.load("a.exr").coherence_width == 5


def test_tilt_is_said_before_the_work_and_once(run, heights, here, monkeypatch):
    np.save("tilted.npy", np.load(heights) + 0.003 * np.arange(75))
    assert "not levelled" not in run("precompute", "tilted.npy", *QUICK).err
    raw = [*QUICK, "--level", "none"]
    ran = run("precompute", "tilted.npy", *raw).succeeded()
    (line,) = [line for line in ran.err.splitlines() if "not levelled" in line]
    assert "tilted.npy: use --level plane: " in line

    def build(*_, **__):
        raise DiffractionError("none")

    monkeypatch.setattr(DiffractionTable, "build", build)
    assert line in run("precompute", "tilted.npy", *raw).err


def test_a_warning_of_the_heights_is_said_once(run, heights, here):
    ran = run("precompute", heights, "--pixel-size", "0.2", "--coherence-width", "12").succeeded()
    (line,) = [line for line in ran.err.splitlines() if "coarser than a quarter" in line]
    assert line.startswith("mitsuba-diffraction: warning: ")
    # of the heights, not of the table
    assert "coarser than a quarter" in run("info", heights, "--pixel-size", "0.2").out
    assert "coarser than a quarter" not in run("info", "grating.exr").out
    surface = '<bsdf type="diffraction"><string name="filename" value="grating.exr"/></bsdf>'
    Path("a.xml").write_text(SCENE.replace('<bsdf type="diffuse"/>', surface))
    rendered = run("render", "a.xml", "-m", "scalar_rgb", "-s", 1)
    assert rendered.code == 0, rendered
    assert "coarser than a quarter" not in rendered.err


def test_progress_is_shown_where_asked_for(run, heights, here, monkeypatch):
    monkeypatch.setattr(Bar.__init__, "__defaults__", (" steps", 0))
    assert "transforming" in run("precompute", heights, *QUICK, "--progress").err
    assert run("precompute", heights, *QUICK).err == ""


def test_several_files_make_one_table_of_their_mean_power(run, heights, here):
    other = heights.with_name("other.npy")
    np.save(other, 0.5 * np.load(heights))
    ran = run("precompute", heights, other, *QUICK, "-o", "mean.exr").succeeded()
    assert "between patches" in ran.out
    patches = DiffractionTable.load("mean.exr").source["patches"]
    assert [patch["name"] for patch in patches] == ["grating.npy", "other.npy"]


@pytest.mark.parametrize("interrupted", ["Bar.__call__", "OpenEXR.File"])
def test_ctrl_c_leaves_the_folder_as_it_was(run, heights, here, monkeypatch, interrupted):
    def interrupt(*_):
        signal.raise_signal(signal.SIGINT)

    class File:
        def __init__(self, *_):
            pass

        def write(self, path):
            Path(path).write_bytes(b"half a file")
            interrupt()

    if interrupted == "Bar.__call__":
        monkeypatch.setattr(Bar, "__call__", interrupt)
    else:
        monkeypatch.setattr(interrupted, File)
    (here / "out.exr").write_bytes(b"an older table")
    ran = run("precompute", heights, *QUICK, "-o", "out.exr")
    assert ran.code == 130
    assert ran.err == "mitsuba-diffraction: interrupted; no half-written file was left behind\n"
    assert os.listdir(here) == ["out.exr"]
    assert (here / "out.exr").read_bytes() == b"an older table"


def test_an_instrument_file_needs_no_option(run, shared_afm, here):
    shutil.copy(shared_afm / "nanoscope-10um.di", here)
    ran = run("precompute", "nanoscope-10um.di").succeeded()
    assert "channel 'ZSensor'" in ran.out
    assert os.path.exists("nanoscope-10um.exr")


def test_a_wide_scan_s_table_says_how_sure_its_mean_is(run, here):
    x = 0.1 * np.arange(200)
    np.save("wide.npy", 0.03 * np.sin(2 * np.pi * x / 1.6) + 0 * x[:, None])
    ran = run(
        "precompute", "wide.npy", "--pixel-size", 0.1, "--windows", 5,
        "--tolerance", 0.05, "--wavelength-range", "500:600",
    ).succeeded()  # fmt: skip
    assert "mean of 7 windows of 5 x 20 µm; its standard error is" in ran.out
    assert '"number": 7' in run("info", "wide.exr", "--json").out
