"""Without a terminal a long command says regularly how far it is, and not otherwise."""

from __future__ import annotations

import argparse
import time

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
