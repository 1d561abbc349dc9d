"""Passes of `render`: their mean is the picture, and Ctrl-C keeps what there is of it."""

from __future__ import annotations

import os
import signal

import drjit as dr
import mitsuba as mi
import numpy as np
import pytest

from mitsuba_diffraction.progress import silent
from mitsuba_diffraction.scene.passes import (
    Pass,
    Stop,
    render_pass,
    render_passes,
)
from tests.support.room import QUICK, SCENE, pixels


def passes(scene, *, spp, size, stop=None, progress=silent):
    """render_passes with passes of `size`, as seed 5 gives them."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("mitsuba_diffraction.scene.passes.samples_per_pass", lambda *_: size)
        return render_passes(
            scene, scene.sensors()[0], spp=spp, seed=5,
            stop=stop or Stop(), progress=progress,
        )  # fmt: skip


LAMP = '<emitter type="point"><point name="position" x="2" y="2" z="3"/></emitter>'


@pytest.mark.parametrize("integrator", ["path", "ptracer"])
@pytest.mark.parametrize("variant", ["scalar_rgb", "llvm_ad_rgb"])
def test_passes_average_to_the_mean_weighted_by_samples(scene, variant, integrator):
    # a box filter gives every sample to one pixel: there the average of pictures is exact, too
    scene.write_text(
        SCENE.replace("</film>", '<rfilter type="box"/></film>')
        .replace('"path"', f'"{integrator}"')
        .replace("  <shape", LAMP + "  <shape")
    )
    mi.set_variant(variant)
    loaded = mi.load_file(str(scene))
    result = passes(loaded, spp=7, size=3)
    assert result.spp == 7
    expected = 0.0
    for sequence, spp in zip(np.random.SeedSequence(5).spawn(3), (3, 3, 1), strict=True):
        seed = int(sequence.generate_state(1)[0])
        expected = expected + spp / 7 * np.array(mi.render(loaded, spp=spp, seed=seed))
    assert np.array(result.bitmap) == pytest.approx(expected, rel=1e-5, abs=1e-6)  # single


@pytest.fixture
def own_threads():
    """What a test does to Dr.Jit's threads is undone."""
    before = dr.thread_count()
    yield
    dr.set_thread_count(before)


def test_one_thread_gives_the_same_bits_again_and_several_almost(scene, own_threads):
    scene.write_text(SCENE.replace('"24"', '"96"').replace('"16"', '"64"'))
    mi.set_variant("llvm_ad_rgb")
    loaded = mi.load_file(str(scene))

    def films(threads):
        dr.set_thread_count(threads)
        return [render_pass(loaded, loaded.sensors()[0], Pass(3, 16)) for _ in range(4)]

    first, *again = films(1)
    for other in again:
        np.testing.assert_array_equal(other, first)
    # single precision: some 250 samples add to a pixel, each rounded by 6e-8 of the sum
    for other in films(2):
        np.testing.assert_allclose(other, first, rtol=0, atol=1e-6 * first.max())


def test_asked_to_stop_it_keeps_the_passes_so_far(scene):
    mi.set_variant("llvm_ad_rgb")
    stop = Stop()

    def progress(done, total, text):
        stop.asked = done >= 4

    result = passes(mi.load_file(str(scene)), spp=100, size=2, stop=stop, progress=progress)
    assert result.interrupted
    assert result.spp == 4
    assert np.array(result.bitmap)[0, 0] == pytest.approx(0.5, rel=1e-3)


def test_ctrl_c_keeps_the_picture_so_far(run, scene, monkeypatch):
    def interrupt(self, done, total, text):
        if done == 2:
            signal.raise_signal(signal.SIGINT)

    monkeypatch.setattr("mitsuba_diffraction.cli.Bar.__call__", interrupt)
    ran = run("render", scene, *QUICK, "-s", "50", "-o", "a.exr")
    assert ran.code == 130
    assert ran.err.splitlines() == [
        "mitsuba-diffraction: interrupted; the picture has 2 of 50 samples per pixel"
    ]
    assert pixels("a.exr")[0, 0] == pytest.approx(0.5, rel=1e-3)
    assert signal.getsignal(signal.SIGINT) is signal.default_int_handler


@pytest.mark.parametrize("doing", ["loading", "compiling"])
def test_ctrl_c_before_the_first_samples_writes_nothing(run, scene, monkeypatch, doing):
    def interrupt(self, done, total, text):
        if text == doing:
            signal.raise_signal(signal.SIGINT)

    monkeypatch.setattr("mitsuba_diffraction.cli.Bar.__call__", interrupt)
    ran = run("render", scene, *QUICK, "-o", "a.exr")
    assert ran.code == 130
    assert "no half-written" in ran.err
    assert os.listdir() == ["room.xml"]
