"""`python -m docs.make.bench` prints and writes every measurement; no test is about speed.

Its baselines compute what they claim to, so that comparing times is fair.
"""

from __future__ import annotations

import contextlib
import io
import json

import numpy as np
import pytest

from docs.make.bench import evaluation, figures, frames, orders, scenes, survey, updates
from docs.make.bench.__main__ import main
from docs.make.bench.figures import Plan
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
