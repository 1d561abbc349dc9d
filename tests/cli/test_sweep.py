"""`sweep` and `brdf-map --method`: sheets, numbers and refusals."""

from __future__ import annotations

import csv
import os

import pytest
from PIL import Image

from mitsuba_diffraction.thesis.methods import NAMES

QUICK = ["--pixel-size", "0.08", "--coherence-width", "6", "--resolution", "24", "--step", "40"]


pytestmark = pytest.mark.usefixtures("here")


def test_a_sheet_and_its_numbers_are_written(run, heights, here):
    ran = run("sweep", "wavelength-step", heights, *QUICK[:-2], "--values", "10", "50").succeeded()
    assert sorted(os.listdir(here)) == [f"grating-wavelength-step.{s}" for s in ("csv", "png")]
    assert "reference" in ran.out
    with open("grating-wavelength-step.csv", encoding="utf-8") as stream:
        rows = list(csv.DictReader(stream))
    assert [row["value"] for row in rows] == ["10", "50"]
    assert float(rows[0]["delta_e_mean"]) == 0.0
    with Image.open("grating-wavelength-step.png") as image:
        assert image.size[0] > 400


def test_a_sweep_over_methods_states_how_much_faster_the_default_is(run, heights, some_variant):
    ran = run("sweep", "method", heights, *QUICK, "-o", "a.png").succeeded()
    for name in NAMES:
        assert f"\n  {name} " in ran.out
    assert "compiled" in ran.out
    assert ran.out.count("× as fast") == 2


@pytest.mark.parametrize(
    ("method", "options", "said"),
    [
        *((name, ["--step", "40"], f"method {name}") for name in NAMES if name != "rainbow"),
        ("rainbow", [], "method rainbow"),
        ("flss", ["--step", "40", "--relative", "--int-ior", "1.4"], "method flss"),
        ("flss", ["--wavelength", "550"], "550 nm"),
    ],
)
def test_every_method_makes_a_map(run, heights, here, method, options, said):
    ran = run(
        "brdf-map", heights, *QUICK[:-2], *options, "--method", method, "-o", "a.exr"
    ).succeeded()
    assert said in ran.out
    assert sorted(os.listdir(here)) == ["a.exr", "a.png"]
