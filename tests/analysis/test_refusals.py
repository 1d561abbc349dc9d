"""What the room of measurements refuses, in one line that says what is wrong: a row each."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import mitsuba as mi
import numpy as np
import pytest

import mitsuba_diffraction as md
from mitsuba_diffraction import DiffractionTable, HeightField, OrderTable, design
from mitsuba_diffraction.analysis.angular_variables import angular_variables
from mitsuba_diffraction.analysis.export import rgl, zemax
from mitsuba_diffraction.analysis.iridescence import diffracted_light
from mitsuba_diffraction.analysis.maps import LightDirection, brdf_map
from mitsuba_diffraction.analysis.observers import eye_of, illuminant_of, quantum_catches
from mitsuba_diffraction.analysis.spectra import check_wavelengths, spectrum
from mitsuba_diffraction.analysis.tradeoff import lit_pairs
from mitsuba_diffraction.analysis.tradeoff.measuring import MeasuredSetting, TradeoffSetting
from mitsuba_diffraction.analysis.tradeoff.report import Budget, recommended
from mitsuba_diffraction.analysis.treatments import load_treatments
from tests.analysis.perfect import perfect
from tests.support.directions import polar, rough_patch
from tests.support.orders import load, thin_grating
from tests.support.refusals import file, refused
from tests.support.variants import use

FLAT = HeightField(np.zeros((8, 8)), 1.0, periodic=True)
ROUGH = rough_patch((12, 15), (0.13, 0.15), 0.3)
LIGHT = polar(10), np.stack([polar(30), polar(50)]), 550.0
RELIEF = {
    "wi": polar(0), "wo": np.stack([polar(30), polar(30, 180)]), "colours": np.eye(2, 3),
    "pixels": 48, "pixel_size": 0.2, "coherence_width": 7.0, "wavelengths": range(400, 701, 25),
}  # fmt: skip


def relief(**change: Any) -> object:
    return design.relief(**RELIEF | change)


def recovered(brdf: Any = (1.0, 1.0), start: HeightField = ROUGH, **change: Any) -> object:
    views = design.Views(ROUGH, *LIGHT, coherence_width=2.0)
    return design.recover(views, np.array(brdf), start, **change)


def eye(content: str) -> object:
    return eye_of(str(file("eye.csv", content)))


def light(content: str) -> object:
    return illuminant_of(str(file("light.csv", content)))


def mapped(surface: Any = FLAT, **asked: Any) -> object:
    return brdf_map(
        load(surface, coherence_width=8.0) if surface is FLAT else load(surface), **asked
    )


def mapped_by(variant: str, **asked: Any) -> object:
    use(variant)
    return brdf_map(mi.load_dict({"type": "diffuse"}), resolution=8, **asked)


def measured(surface: Any = FLAT, **asked: Any) -> object:
    more = {"coherence_width": 10.0} if surface is FLAT else {}
    material = {"material": asked.pop("material")} if "material" in asked else {}
    return spectrum(load(surface, **more, **material), **asked)


def written(save: Callable[..., object], surface: Any, grid: Any, **more: Any) -> None:
    """Save a file of a surface; nothing is left where that is refused."""
    try:
        save(load(surface, **more), Path("a.bsdf"), grid)
    finally:
        assert not list(Path().iterdir())


def variables(*wavelengths: float) -> object:
    unused: Any = None
    return angular_variables(unused, wavelengths)


def iridescence(*ends: float) -> object:
    table = DiffractionTable.build(
        md.gratings.sinusoidal(1.6, 0.1, rows=2), tolerance=0.01, wavelength_range=ends
    )
    light = LightDirection(30.0, 0.0)
    return diffracted_light(table, light, perfect(light))


def treatments(text: str) -> object:
    return load_treatments(file("treatments.toml", text))


_MIRROR = OrderTable.mirror(0.6)
RESULT = MeasuredSetting(TradeoffSetting("default"), error=1e-2, relative=2.0, megabytes=4.0)
_ONE = zemax.DEFAULT._replace(theta=np.zeros(1), phi=np.zeros(1))
#: What is asked for, and words of the line.
REFUSED: list[tuple[Callable[[], object], str]] = [
    # designs of reliefs
    (lambda: relief(colours=[[1.0, 0.0, 0.0]]), r"colours have shape \(1, 3\)"),
    (lambda: relief(colours=np.zeros((2, 3))), "not all 0"),
    (lambda: relief(pixels=1), "pixels=1 must be a whole number of at least 2"),
    (lambda: relief(pixel_size=-1.0), "pixel_size"),
    (lambda: relief(max_height=0.0), "max_height=0.0 must be positive"),
    (lambda: relief(max_slope=np.nan), "max_slope=nan must be positive"),
    (lambda: relief(coherence_width=0.0), "coherence_width=0 must be"),
    (lambda: relief(wavelengths=[400, 500, 700]), "evenly spaced"),
    (lambda: relief(wavelengths=500.0), "at least 3"),
    (lambda: relief(wo=[0.0, 1.0]), "wo"),
    (lambda: relief(seed=-1), "seed=-1"),
    (lambda: relief(iterations=0), "iterations=0"),
    (lambda: recovered(np.ones(3)), "must be 2 finite values"),
    (lambda: recovered(np.full(2, np.nan)), "must be 2 finite values"),
    (lambda: recovered(start=HeightField(np.eye(15)[:12], 0.1)), "start has"),
    (lambda: recovered(start=HeightField(np.eye(4), ROUGH.pixel_size)), r"start has \(4, 4\) pix"),
    (lambda: recovered(start=HeightField(np.zeros((12, 15)), ROUGH.pixel_size)), "start is flat"),
    (lambda: recovered(smoothing=-1.0), "smoothing=-1.0 must be"),
    (lambda: recovered(iterations=1.5), "iterations=1.5 must be a whole number"),
    # observers and lights
    (lambda: eye(""), "is empty"),
    (lambda: eye("wl,a,b\n300,1\n"), "a column for each receptor"),
    (lambda: eye("wl,a,b\n500,1,1\n600,1,1\n"), "400"),
    (lambda: eye("wl,a,b\n300,1,-1\n700,1,1\n"), "0 or more"),
    (lambda: eye("wl,a\n300,1\n700,1\n"), "two receptors"),
    (lambda: eye("wl,a,b\n300,1,nan\n700,1,1\n"), "line 2"),
    (lambda: eye("wl,a,b\n300,1,0\n700,1,0\n"), "receptor b is 0"),
    (lambda: eye("wl,l,l\n300,1,1\n700,1,1\n"), "'l' cannot name a receptor"),
    (lambda: eye("wl,a,\n300,1,1\n700,1,1\n"), "cannot name a receptor"),
    (lambda: eye_of("dragon"), "avian_uv"),
    (lambda: replace(eye_of("avian_v"), density=(1.0, 2.0)), "expected .* numbers above 0"),
    (lambda: replace(eye_of("avian_v"), weber=(0.1, -1.0, 1.0, 1.0)), "numbers above 0"),
    (lambda: quantum_catches(eye_of("avian_uv"), [400.0, 700.0], [[1.0], [1.0]]), "must cover"),
    (lambda: light("wl,photons\n400,1\n700,1\n"), "is not a spectrum"),
    (lambda: light("wl,photons\n300,0\n700,0\n"), "is not a spectrum"),
    (lambda: illuminant_of("moon"), "choose one of ideal, d55"),
    # spectra and variables of them
    *(
        (lambda wrong=wrong: check_wavelengths(wrong), "wavelengths")
        for wrong in ([], [[500.0]], [500.0, 400.0], [-5.0], [np.nan])
    ),
    (lambda: measured(material="Al", wavelengths=[800.0, 900.0]), r"298\.8 to 885\.6"),
    (lambda: measured(wavelengths=[320.0, 400.0]), "320 nm: the table has 360 to 830"),
    (lambda: measured(_MIRROR, wavelengths=[600.0, 900.0]), "900 nm: the table has 380 to 780"),
    (lambda: measured(relative="grey"), "relative"),
    (lambda: variables(550.0), "two wavelengths"),
    (lambda: variables(550.2, 550.4), "two wavelengths"),
    (lambda: variables(720.0, 800.0), "two wavelengths"),
    (lambda: iridescence(500.0, 600.0), "380"),
    # maps
    (lambda: mapped(theta=90.0), "theta=90 must be at least 0 and below 90"),
    (lambda: mapped(theta=-1.0), "theta=-1"),
    (lambda: mapped(theta=np.nan), "theta=nan"),
    (lambda: mapped(phi=361.0), "phi=361 must be from -360 to 360"),
    (lambda: mapped(wavelength_range=(700.0, 400.0)), "700 to 400 nm is empty"),
    (lambda: mapped(wavelength_range=(0.0, 400.0)), "0 to 400 nm is empty"),
    (lambda: mapped(wavelength=np.inf), "inf to inf nm is empty"),
    (lambda: mapped(wavelength_range=(300.0, 830.0)), "300 nm: the table has 360 to 830 nm"),
    (lambda: mapped(step=471.0), "step=471 nm does not fit the range of 360 to 830 nm"),
    (lambda: mapped(step=0.0), "step=0 nm"),
    (lambda: mapped(step=np.nan), "step=nan nm"),
    (lambda: mapped(resolution=7), "resolution=7 must be from 8 to 4096"),
    (lambda: mapped(resolution=10**9), "resolution=1000000000 must be"),
    (lambda: mapped(samples=0), "samples=0 must be from 1 to 1024"),
    (lambda: mapped(illuminant="A"), "illuminant='A' is unknown"),
    (lambda: mapped(resolution=4096, spectral=True), "requires 6 GB"),
    (lambda: mapped(_MIRROR, resolution=8, wavelength=900.0), "the table has 380 to 780 nm"),
    (lambda: mapped(_MIRROR, resolution=8, spectral=True, wavelength_range=(300, 830)),
     r"wavelength \d+ nm: the table has 380 to 780 nm"),
    (lambda: mapped_by("scalar_rgb"), "variant 'scalar_rgb' does not support maps"),
    (lambda: mapped_by("llvm_ad_rgb", wavelength=550.0), "whole spectrum in daylight"),
    (lambda: mapped_by("llvm_ad_rgb", wavelength_range=(400, 700)), "whole spectrum in daylight"),
    (lambda: mapped_by("llvm_ad_rgb", spectral=True), "whole spectrum in daylight"),
    (lambda: mapped_by("llvm_ad_rgb", illuminant="E"), "whole spectrum in daylight"),
    # files for other programs
    (lambda: written(zemax.save_zemax, FLAT, _ONE, coherence_width=500.0), "narrower"),
    (lambda: written(zemax.save_zemax, FLAT, _ONE._replace(wavelengths=np.array([500.0, 600.0]))),
     "expected one"),
    (lambda: written(zemax.save_zemax, FLAT, _ONE._replace(wavelengths=np.array([300.0]))),
     r"wavelength 300 nm: .* to \d+ nm"),
    (lambda: written(zemax.save_zemax, _MIRROR, _ONE._replace(wavelengths=np.array([900.0]))),
     r"wavelength 900 nm: .* to \d+ nm"),
    (lambda: written(rgl.save_rgl, thin_grating(0.6, counts=(2, 2, 1), thin=True), rgl.DEFAULT),
     "light that goes through"),
    (lambda: written(rgl.save_rgl, _MIRROR, rgl.DEFAULT._replace(resolution=1000)),
     "lower the resolution"),
    (lambda: written(rgl.save_rgl, _MIRROR, rgl.DEFAULT._replace(theta=np.array([95.0]))),
     "theta: expected rising"),
    # surveys and the trade of settings
    *(
        (lambda text=text: treatments(text), r"treatments\.toml")
        for text in ("level = 1", '["*"]\nheight = 2', '["*"]\nlevel = "sea"', "[")
    ),
    (lambda: lit_pairs(HeightField(np.zeros((60, 60)), 0.1), 2.0, 40, seed=0), "flat"),
    (lambda: recommended([RESULT], Budget(tolerance=1e-5)), "no setting stays within this budget"),
]  # fmt: skip


#: Words of the rows that take seconds.
SLOW = {"narrower": pytest.mark.thorough}


@pytest.mark.parametrize(
    ("ask", "words"),
    [pytest.param(ask, words, id=words, marks=SLOW.get(words, ())) for ask, words in REFUSED],
)
def test_what_does_not_fit_is_refused(spectral, tmp_path, monkeypatch, ask, words):
    monkeypatch.chdir(tmp_path)
    refused(ask, words)
