"""Lines on stderr: how far a long command is, and Mitsuba's warnings."""

from __future__ import annotations

import argparse
import time

import mitsuba as mi
import pytest

from mitsuba_diffraction.cli import console


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


def test_short_work_is_silent(capfd):
    with console.Bar(argparse.Namespace(progress=None)) as bar:
        bar(1, 1, "reading")
    assert capfd.readouterr().err == ""


def test_mitsuba_s_warnings_are_ours_and_said_once(capfd):
    mi.set_variant("scalar_rgb")
    count = mi.logger().appender_count()
    with console.mitsuba_warnings():
        for _ in range(2):
            mi.Log(mi.LogLevel.Warn, "too few\nsamples")
        mi.Log(mi.LogLevel.Info, "of no interest")
    assert capfd.readouterr().err.splitlines() == ["mitsuba-diffraction: warning: too few samples"]
    assert mi.logger().appender_count() == count
