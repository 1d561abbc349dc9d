"""`sweep` and `brdf-map --method`: sheets, numbers and refusals."""

from __future__ import annotations

import csv
import os

import numpy as np
import pytest
from PIL import Image

from mitsuba_diffraction.cli import sweep
from mitsuba_diffraction.cli.options import METHODS
from mitsuba_diffraction.thesis.methods import NAMES
from mitsuba_diffraction.thesis.sweeps import SWEEPS

QUICK = ["--pixel-size", "0.08", "--coherence-width", "6", "--resolution", "24", "--step", "40"]


pytestmark = pytest.mark.usefixtures("here")


def test_choices_are_the_library_s():
    assert tuple(SWEEPS) == sweep.KINDS
    assert METHODS == NAMES


def test_a_sheet_and_its_numbers_are_written(run, heights, here):
    ran = run("sweep", "wavelength-step", heights, *QUICK[:-2], "--values", "10", "50")
    assert ran.code == 0, ran.err
    assert sorted(os.listdir(here)) == [f"grating-wavelength-step.{s}" for s in ("csv", "png")]
    assert "reference" in ran.out
    with open("grating-wavelength-step.csv", encoding="utf-8") as stream:
        rows = list(csv.DictReader(stream))
    assert [row["value"] for row in rows] == ["10", "50"]
    assert float(rows[0]["delta_e_mean"]) == 0.0
    with Image.open("grating-wavelength-step.png") as image:
        assert image.size[0] > 400


def test_a_sweep_over_methods_states_how_much_faster_the_default_is(run, heights, some_variant):
    ran = run("sweep", "method", heights, *QUICK, "-o", "a.png")
    assert ran.code == 0, ran.err
    for name in METHODS:
        assert f"\n  {name} " in ran.out
    assert "compiled" in ran.out
    assert ran.out.count("× as fast") == 2


@pytest.mark.parametrize("method", METHODS)
def test_every_method_makes_a_map(run, heights, here, method):
    ran = run("brdf-map", heights, *QUICK, "--method", method, "-o", "a.exr")
    assert ran.code == 0, ran.err
    assert f"method {method}" in ran.out
    assert sorted(os.listdir(here)) == ["a.exr", "a.png"]


def test_relative_reflectance_can_be_mapped(run, heights):
    arguments = [heights, *QUICK, "--method", "flss", "--relative", "-o", "a.png"]
    assert run("brdf-map", *arguments, "--int-ior", "1.4").code == 0


def test_one_wavelength_by_a_method(run, heights):
    ran = run(
        "brdf-map", heights, *QUICK[:-2], "--wavelength", "550", "--method", "flss", "-o", "a.png"
    )
    assert ran.code == 0, ran.err
    assert "550 nm" in ran.out


@pytest.mark.parametrize(
    ("command", "options", "text"),
    [
        ("brdf-map", ["--method", "flss", "--material", "Al"], "--material: not allowed with"),
        ("brdf-map", ["--method", "flss", "--spectral"], "--spectral: not allowed with"),
        ("brdf-map", ["--method", "flss", "--illuminant", "E"], "under --illuminant D65 only"),
        ("brdf-map", ["--method", "flss", "--int-ior", "1.5"], "only for --relative"),
        ("brdf-map", ["--relative"], "--relative: only with argument --method"),
        ("brdf-map", ["--method", "ray"], "--method: invalid choice"),
    ],
)
def test_contradictions_are_usage_errors(run, heights, here, command, options, text):
    ran = run(command, heights, *QUICK, *options)
    assert ran.code == 2
    assert text in ran.err
    assert os.listdir(here) == []


@pytest.mark.parametrize(
    ("arguments", "text"),
    [
        (["sweep", "terms", "--coherence-width", "1e300"], "coherence_width"),
        (["sweep", "terms", "--values", "a"], "--values: expected numbers, got 'a'"),
        (["sweep", "terms", "--method", "nmm"], "needs method 'flss'"),
        (["sweep", "light-angle", "--values", "95"], "theta=95 must be"),
        (["brdf-map", "--method", "rainbow", "--relative"], "no relative reflectance"),
        (["brdf-map", "--method", "flss", "--relative", "--int-ior", "glass"], "takes a number"),
    ],
)
def test_what_does_not_fit_is_one_line(run, heights, here, arguments, text):
    command = arguments[: 2 if arguments[0] == "sweep" else 1]
    rest = arguments[len(command) :]
    assert text in run(*command, heights, *QUICK, *rest).failed_in_one_line()
    assert os.listdir(here) == []


def test_a_patch_without_a_period_is_refused_with_the_confidence(run, tmp_path):
    np.save(tmp_path / "n.npy", np.random.default_rng(1).normal(0.0, 0.02, (64, 64)))
    ran = run("brdf-map", tmp_path / "n.npy", *QUICK, "--method", "rainbow")
    assert "needs a period" in ran.failed_in_one_line()
