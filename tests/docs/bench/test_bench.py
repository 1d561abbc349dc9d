"""`python -m docs.make.bench` prints and writes every measurement; no test is about speed.

Its baselines compute what they claim to, so that comparing times is fair.
"""

from __future__ import annotations

import contextlib
import io
import json

import drjit as dr
import mitsuba as mi
import numpy as np
import pytest

import mitsuba_diffraction as md
from docs.make.bench import evaluation, figures, frames, orders, scenes, survey, updates
from docs.make.bench.__main__ import main
from docs.make.bench.contenders import (
    DEFAULT,
    bare_gathers,
    bsdf_factories,
    build_tables,
)
from docs.make.bench.figures import Plan
from docs.make.bench.scenes import draws_by_cosine
from mitsuba_diffraction.analysis.timing import Queries
from mitsuba_diffraction.optics.geometry import wavenumber
from mitsuba_diffraction.tables.window import base_bin, first_tap
from tests.support.commands import small_clone
from tests.support.directions import rough_patch

pytestmark = pytest.mark.thorough

# 96 pixels are 4.7 µm, 1/14 of the coherence window: wide taps, but no time to speak of
TINY = Plan(
    pixels=96, more_pixels=(), other_tables=False, scans=1, lanes=64, slow_lanes=32, rounds=2,
    resolution=12, spp=2, reference_spp=2, map_resolution=8, frame=(12, 8),
)  # fmt: skip


@pytest.fixture(scope="module", autouse=True)
def tiny():
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(figures, "QUICK", TINY)
        # as many as the other pictures have: another number is another kernel
        patch.setattr(scenes, "FIREFLY_SPP", TINY.spp)
        patch.setattr(evaluation, "MATERIALS", {"none": evaluation.MATERIALS["none"]})
        patch.setattr(frames, "_SHORTEST", 1e-4)
        patch.setattr(updates, "CASES", updates.CASES[:1])
        patch.setattr(orders, "_TABLES", {"blazed grating, Al": "blazed.nc"})
        patch.setattr(survey, "_PIXELS", 64)
        yield


@pytest.fixture(scope="module")
def measured(tiny, tmp_path_factory):
    """The file of one run of all parts, and its output."""
    file = tmp_path_factory.mktemp("bench") / "bench.json"
    scenes, printed = small_clone(tmp_path_factory.mktemp("clone")) / "scenes", io.StringIO()
    with contextlib.redirect_stdout(printed):
        assert main(["--quick", "--json", str(file), "--scenes", str(scenes)]) == 0
    return file, printed.getvalue()


def test_everything_is_measured_and_written(measured):
    file, printed = measured
    parts = (
        "build", "survey", "eval", "sample", "eval_pdf", "pdf", "snake", "noise", "efficiency",
        "update", "colours", "frames",
    )  # fmt: skip
    for part in ("processor", "gathers", *(f"{part}:" for part in parts)):
        assert part in printed
    data = json.loads(file.read_text(encoding="utf-8"))
    assert data["machine"]["cores"] >= 1
    build = data["sections"][0]
    evaluation = next(part for part in data["sections"] if "ns" in part["rows"][0])
    for row in build["rows"]:
        assert row["peak_bytes"] > row["imported_bytes"] > 0
        assert max(row["table"]["measured_error"].values()) <= row["table"]["tolerance"]
    for row in evaluation["rows"]:
        assert len(row["ns"]) == TINY.rounds
        assert min(row["ns"]) > 0
        assert len(row["cpu_ns"]) == TINY.rounds


def test_a_part_alone_is_compared_number_by_number(measured, capsys):
    file, _ = measured
    assert main(["--quick", "--only", "build", "--against", str(file)]) == 0
    out = capsys.readouterr().out
    # the same heights: the same error
    assert "1.00×  build: 96² pixels, the defaults: error/tolerance:" in out
    assert "eval" not in out.split("now /")[0]


def test_a_measured_patch_replaces_the_default(tmp_path, capsys):
    file = tmp_path / "mine.npy"
    np.save(file, rough_patch((40, 48), (0.1, 0.1), 0.2).heights)
    arguments = ["--measured", str(file), "--pixel-size", "0.1", "--quick", "--only", "noise"]
    assert main(arguments) == 0
    assert "75°" in capsys.readouterr().out


@pytest.fixture(scope="module")
def factories(tmp_path_factory):
    folder = tmp_path_factory.mktemp("tables")
    tables = build_tables(Plan(pixels=160), folder, lambda done, total, text: None)
    return bsdf_factories(tables)


@pytest.fixture
def queries(variant):
    return Queries.random(500)


def test_bare_gathers_read_what_a_look_up_reads(factories, queries):
    bsdf = factories[DEFAULT]()
    table = bsdf.table
    total = np.array(queries.si.wi + queries.wo, np.float32).astype(float)
    expected = np.zeros(total.shape[1], np.int32)
    for wavelength in np.array(queries.si.wavelengths, float):
        k = wavenumber(wavelength)
        interval = table.expansion.interval(k * total[2])
        first = [
            base_bin(k * total[axis] / table.spacing[axis], taps) + first_tap(taps)
            for axis, taps in enumerate(table.grid.taps)
        ]
        column, row = (f.astype(int) + n for f, n in zip(first, table.grid.last, strict=True))
        for j, columns in enumerate(table.grid.tapped()):
            for i in columns:
                halves = table.coefficients[interval, row + j, column + i]
                bits = halves.reshape(len(halves), 2, -1).view(np.uint16).astype(np.uint32)
                words = bits[:, 0] | (bits[:, 1] << 16)
                expected += words.sum(axis=1, dtype=np.uint32).view(np.int32)
    gathered = np.array(bare_gathers(bsdf, queries)())
    # in single precision a few of the 4 × 500 look-ups fall into the neighbouring bin
    assert (gathered != expected).mean() < 0.01


def test_the_measured_surface_reflects_what_its_file_says(factories, queries):
    values = np.array(factories["measured"]().eval(mi.BSDFContext(), queries.si, queries.wo))
    np.testing.assert_allclose(values, 1.0, rtol=1e-6)  # single precision


def drawn(bsdf, count=1 << 14):
    """Cosines of the directions drawn, their densities, and the weights at 550 nm."""
    si = dr.zeros(mi.SurfaceInteraction3f, count)
    si.wi = mi.Vector3f(0.6, 0.0, 0.8)
    si.wavelengths = mi.Spectrum(550.0)
    random = mi.PCG32(size=count, initstate=3)
    numbers = [random.next_float32() for _ in range(3)]
    sample, weight = bsdf.sample(mi.BSDFContext(), si, numbers[0], mi.Point2f(*numbers[1:]))
    return np.array(sample.wo.z), np.array(sample.pdf), np.array(weight[0])


def test_directions_are_drawn_by_the_cosine_and_the_albedo_is_the_same(some_variant):
    grating = md.gratings.sinusoidal(period=1.6, depth=0.08, periods=4)
    parameters = md.bsdf_dict(grating, coherence_width=8.0, material="none")
    ours = drawn(mi.load_dict(parameters))[2]
    cosines, density, weights = drawn(draws_by_cosine(mi.load_dict(parameters)))
    assert np.allclose(density, 0.97 * cosines / np.pi + 0.03 / (2 * np.pi), rtol=1e-4)
    assert weights.std() > 3 * ours.std()
    # four standard errors
    error = np.hypot(weights.std(), ours.std()) / np.sqrt(len(ours))
    assert abs(weights.mean() - ours.mean()) < 4 * error
