"""`bench`: what it prints and writes; never how fast anything is."""

from __future__ import annotations

import contextlib
import io
import json

import numpy as np
import pytest

from mitsuba_diffraction.analysis.bench import evaluation, figures, scenes
from mitsuba_diffraction.analysis.bench.contenders import ratio, rounds_of
from mitsuba_diffraction.analysis.bench.figures import Goal, Plan, Row, Section
from mitsuba_diffraction.cli import main
from tests.support import ROOT
from tests.support.directions import rough_patch

# 96 pixels are 4.7 µm, 1/14 of the coherence window: wide taps, but no time to speak of
TINY = Plan(
    pixels=96,
    more_pixels=(),
    other_tables=False,
    lanes=64,
    slow_lanes=32,
    rounds=2,
    resolution=12,
    spp=2,
    reference_spp=2,
    map_resolution=8,
)
SCENES = ROOT / "scenes"


@pytest.fixture(scope="module", autouse=True)
def tiny(coarse):
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(figures, "QUICK", TINY)
        # as many as the other pictures have: another number is another kernel
        patch.setattr(scenes, "_FIREFLY_SPP", TINY.spp)
        patch.setattr(evaluation, "MATERIALS", {"none": evaluation.MATERIALS["none"]})
        yield


@pytest.fixture(scope="module")
def measured(tiny, tmp_path_factory):
    """The file of one run of all parts, and what it printed."""
    file = tmp_path_factory.mktemp("bench") / "bench.json"
    printed = io.StringIO()
    with contextlib.redirect_stdout(printed):
        assert main(["bench", "--quick", "--json", str(file), "--scenes", str(SCENES)]) == 0
    return file, printed.getvalue()


def test_everything_is_measured_and_written(measured):
    file, printed = measured
    parts = (
        "build",
        "eval",
        "sample",
        "eval_pdf",
        "pdf",
        "snake",
        "noise",
        "efficiency",
        "colours",
    )
    for part in ("processor", "llvm 1", "gathers", *(f"{part}:" for part in parts)):
        assert part in printed
    data = json.loads(file.read_text(encoding="utf-8"))
    assert data["machine"]["cores"] >= 1
    build, evaluation = data["sections"][:2]
    for row in build["rows"]:
        assert row["peak_bytes"] > row["imported_bytes"] > 0
        assert max(row["table"]["measured_error"].values()) <= row["table"]["tolerance"]
    for row in evaluation["rows"]:
        assert len(row["ns"]) == TINY.rounds
        assert min(row["ns"]) > 0
    goals = {goal["goal"] for row in evaluation["rows"] for goal in row["goals"]}
    assert goals == {
        "at most 4× roughconductor",
        "within 1.5× of bare gathers",
        "at most 1.15× kirchhoff",
        "at most 1.25× kirchhoff",
        "at most 3× roughconductor",
        "at most 1.5× patch",
        "at least 30× the defaults",
    }


def test_a_part_alone_is_compared_number_by_number(run, measured):
    file, _ = measured
    ran = run("bench", "--quick", "--only", "build", "--against", file)
    assert ran.code == 0, ran.err
    assert f"now / {file}" in ran.out
    # the same heights: the same error
    assert "1.00×  build: 96² pixels, the defaults: error/tolerance:" in ran.out
    assert "eval" not in ran.out.split("now /")[0]


def test_a_run_that_is_none_is_refused_before_measuring(run, tmp_path):
    file = tmp_path / "bench.json"
    file.write_text("{}", encoding="utf-8")
    ran = run("bench", "--quick", "--only", "build", "--against", file)
    assert "is not what bench --json writes" in ran.failed_in_one_line()


def test_a_patch_of_one_s_own(run, tmp_path):
    file = tmp_path / "mine.npy"
    np.save(file, rough_patch((40, 48), (0.1, 0.1), 0.2).heights)
    ran = run("bench", file, "--pixel-size", "0.1", "--quick", "--only", "noise")
    assert ran.code == 0, ran.err
    assert "75°" in ran.out


def test_options_without_a_patch_are_refused(run):
    ran = run("bench", "--quick", "--pixel-size", "0.1")
    assert ran.code == 2
    assert "--pixel-size needs a file of heights" in ran.err


def test_missing_scenes_are_named(run, tmp_path):
    ran = run("bench", "--quick", "--only", "snake", "--scenes", tmp_path)
    assert "--scenes" in ran.failed_in_one_line()


def test_an_unwritable_file_is_refused_before_measuring(run, tmp_path):
    ran = run("bench", "--quick", "--json", tmp_path / "missing" / "bench.json")
    assert "missing" in ran.failed_in_one_line()


def test_every_round_goes_through_all_calls():
    order = []
    calls = {name: lambda name=name: order.append(name) or float(len(order)) for name in "abc"}
    seconds = rounds_of(calls, 3, lambda done, total: None)
    assert order == list("abc") * (len(order) // 3)
    assert [len(taken) for taken in seconds.values()] == [3, 3, 3]


def test_ratios_do_not_mind_a_slow_round():
    # the machine was ten times slower in the second round, for both
    assert ratio([2.0, 20.0, 2.0], [1.0, 10.0, 1.0]) == 2.0


def test_a_missed_goal_is_said():
    rows = [Row("a", {"s": 5.0}, [Goal("at most 4 s", False)]), Row("b", {"s": None})]
    lines = list(Section("title", ["s"], rows).lines())
    assert lines[2].split() == ["a", "5.00", "at", "most", "4", "s:", "MISSED"]
    assert lines[3].strip() == "b"
