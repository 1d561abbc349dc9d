"""What commands print: reports of plain data, how far a long one is, and Mitsuba's warnings."""

from __future__ import annotations

import argparse
import json
import math
import time

import mitsuba as mi
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mitsuba_diffraction.cli import console
from mitsuba_diffraction.cli.report import lines_of, plain
from mitsuba_diffraction.progress import show, showing
from mitsuba_diffraction.scene.load import load_scene

leaves = st.none() | st.booleans() | st.integers() | st.floats() | st.text()
data = st.recursive(
    leaves, lambda inner: st.lists(inner) | st.dictionaries(st.text(), inner), max_leaves=8
)


@settings(max_examples=30)
@given(st.dictionaries(st.text(), data))
def test_any_data_prints_without_stray_line_ends(content):
    for line in lines_of(content):
        assert len(line.splitlines()) <= 1


@settings(max_examples=30)
@given(data)
def test_any_data_is_strict_json(content):
    json.loads(json.dumps(plain(content), allow_nan=False))


def test_numbers_of_arrays_are_plain():
    assert plain(np.arange(2)) == [0, 1]
    assert plain({"a": np.float32(0.5), "b": (np.int64(2), math.inf)}) == {"a": 0.5, "b": [2, None]}


@pytest.mark.parametrize("progress", [None, False])
def test_a_line_says_how_far_the_work_is(monkeypatch, capfd, progress):
    monkeypatch.setattr(console, "EVERY", 0.05)
    begun = time.monotonic()
    with console.Bar(argparse.Namespace(progress=progress), unit=" spp") as bar:
        bar(3, 12, "rendering")
        time.sleep(0.5)  # ten times the interval, for a busy machine
    time.sleep(0.1)
    lines = capfd.readouterr().err.splitlines()
    assert bool(lines) == (progress is None)
    assert all("rendering, 3 of 12 spp (25%), after " in line for line in lines)
    # a busy machine sleeps longer than it was asked to
    assert len(lines) <= 1 + (time.monotonic() - begun) / 0.05


TEXTURED = """<scene version="3.0.0"><shape type="rectangle"><bsdf type="diffraction">
<string name="filename" value="recipe.toml"/><float name="film_ior" value="1.7"/>
<texture name="film_thickness" type="checkerboard"/>
<float name="film_thickness_max" value="100"/><bsdf type="diffuse"/></bsdf></shape></scene>"""


def test_a_scene_that_loads_says_what_its_surfaces_do(world, spectral):
    (world / "film.xml").write_text(TEXTURED)
    states = []
    with showing(lambda *step: states.append(step)):
        load_scene(world / "film.xml", {})
    places = [(done, total) for done, total, text in states if text == "scales of energy"]
    count = places[0][1]
    assert count > 2  # thicknesses at which the scales are tabulated
    assert [done for done, _ in places[:count]] == list(range(count))


def test_a_loading_scene_keeps_the_count_of_an_animation(capfd):
    with console.Bar(argparse.Namespace(progress=True), delay=0) as bar:
        show(3, 47, "scales of energy")
        assert "scales of energy, 3 of 47" in bar._state
        bar(30, 60, "frame 2 of 4")
        show(4, 47, "scales of energy")
        assert bar._bar.n == 30
    show(5, 47, "scales of energy")
    assert "4 of 47" in bar._state


def test_short_work_is_silent(capfd):
    with console.Bar(argparse.Namespace(progress=None)) as bar:
        bar(1, 1, "reading")
    assert capfd.readouterr().err == ""


def test_mitsuba_s_warnings_are_ours_and_said_once(capfd):
    mi.set_variant("scalar_rgb")
    count = mi.logger().appender_count()
    with console.warnings_in_one_line():
        for _ in range(2):
            mi.Log(mi.LogLevel.Warn, "too few\nsamples")
        for value in (-0.1, -0.2):  # of which Mitsuba tells each
            mi.Log(mi.LogLevel.Warn, f"Invalid sample value: [{value}, 0, 0, 1]")
        mi.Log(mi.LogLevel.Info, "of no interest")
    first, second = capfd.readouterr().err.splitlines()
    assert first == "mitsuba-diffraction: warning: too few samples"
    assert second.startswith("mitsuba-diffraction: warning: some samples are below zero")
    assert mi.logger().appender_count() == count
