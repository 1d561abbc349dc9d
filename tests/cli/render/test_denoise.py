"""`render --denoise`: a picture without noise beside the noisy one."""

from __future__ import annotations

import os
import sys

import numpy as np
import pytest

from tests.support.room import QUICK, SCENE, pixels

__all__ = ["SCENE"]  # read by the fixture `scene`

_RED = """<bsdf type="diffuse"><rgb name="reflectance" value="0.7, 0.2, 0.1"/></bsdf>"""


def test_the_denoised_picture_is_nearer_to_the_truth(run, scene):
    pytest.importorskip("pyoidn")
    assert run("render", scene, *QUICK, "-s", "4", "--denoise", "-o", "a.exr").code == 0
    assert sorted(os.listdir()) == [
        "a.exr", "a.png", "a_denoised.exr", "a_denoised.png", "room.xml"
    ]  # fmt: skip
    assert run("render", scene, *QUICK, "-s", "256", "--seed", "9", "-o", "b.exr").code == 0
    noisy, clean, truth = (pixels(name) for name in ("a.exr", "a_denoised.exr", "b.exr"))
    inside = np.s_[3:-3, 3:-3]  # the truth has another filter, which matters at edges
    errors = [np.abs(image - truth)[inside].mean() for image in (noisy, clean)]
    assert errors[1] < 0.9 * errors[0]


def test_without_the_extra_it_is_refused_at_once(run, scene, monkeypatch):
    monkeypatch.setitem(sys.modules, "pyoidn", None)
    line = run("render", scene, *QUICK, "--denoise").failed_in_one_line()
    assert "pip install 'pyoidn>=" in line
    assert os.listdir() == ["room.xml"]


def test_frames_are_denoised_without_flicker(run, scene):
    pytest.importorskip("pyoidn")
    options = ("--frames", "2", "--turn", "spp", "-D", "spp=4", "-s", "4")
    assert run("render", scene, *QUICK, *options, "--exr", "-o", "noisy").code == 0
    assert run("render", scene, *QUICK, *options, "--exr", "--denoise", "-o", "clean").code == 0
    noisy, clean = (
        [pixels(f"{folder}/frame_000{n}.exr") for n in (0, 1)] for folder in ("noisy", "clean")
    )
    assert np.abs(noisy[0] - noisy[1]).max() > 0.01
    # the same picture has the same noise, of which the denoiser makes the same
    assert np.array_equal(clean[0], clean[1])


def test_wavelengths_of_samples_leave_no_noise_of_colour(run, scene):
    pytest.importorskip("pyoidn")
    with open(scene, encoding="utf-8") as file:
        text = file.read().replace('<bsdf type="diffuse"/>', _RED)
    text = text.replace('"24"', '"80"').replace('"16"', '"60"')
    with open("red.xml", "w", encoding="utf-8") as file:
        file.write(text)
    options = ("-m", "scalar_spectral", "-s", "16", "--denoise")
    for seed in ("1", "2"):
        assert run("render", "red.xml", *options, "--seed", seed, "-o", f"{seed}.exr").code == 0
    noisy, clean = ([pixels(f"{n}{kind}.exr") for n in (1, 2)] for kind in ("", "_denoised"))
    errors = [np.abs(first - second).mean() for first, second in (noisy, clean)]
    # 0.93 with the albedo as it is, which has the noise of wavelengths, too
    assert errors[1] < 0.4 * errors[0]
