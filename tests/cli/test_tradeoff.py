"""`tradeoff`: every row is options that can be typed, and the command recommends one."""

from __future__ import annotations

import json

import numpy as np
import pytest

from docs.make.figures import tables
from mitsuba_diffraction import tradeoff
from mitsuba_diffraction.analysis.tradeoff import TradeoffSetting
from mitsuba_diffraction.cli import build_parser
from mitsuba_diffraction.cli import tradeoff as command
from mitsuba_diffraction.cli.options import table_options
from tests.support.directions import rough_patch

pytestmark = pytest.mark.thorough


@pytest.mark.parametrize("quick", [False, True])
def test_every_row_is_options_that_can_be_typed(quick):
    """All that build a table take them: here the command that does nothing else."""
    parser, names = build_parser(), []
    for setting in tradeoff.settings(quick):
        typed = [] if setting.name == "the defaults" else setting.name.split()
        args = parser.parse_args(["precompute", "scale.npy", "-o", "table.exr", *typed])
        assert table_options(args) == setting.arguments
        names.append(setting.name)
    assert len(set(names)) == len(names)


def test_the_command_measures_and_recommends(tmp_path, monkeypatch, run, capfd):
    np.save(tmp_path / "heights.npy", rough_patch((48, 48), (0.1, 0.1), 0.25).heights)
    # errors of 16 pairs of directions scatter by half
    monkeypatch.setattr(command, "QUICK", (48, 100, 256, 1, 1))
    coarse = "--tolerance 1e-02"
    few = TradeoffSetting("default"), TradeoffSetting("tolerance", {"tolerance": 1e-2})
    monkeypatch.setattr(command, "settings", lambda quick: iter(few))
    out = tmp_path / "out"
    ran = run("tradeoff", tmp_path / "heights.npy", "--pixel-size", "0.1", "--quick",
              "--coherence-width", "4.5", "-o", out).succeeded()  # fmt: skip
    assert "recommended (tolerance 0.001): " in ran.out
    document = json.loads((out / "tradeoff.json").read_text("utf-8"))
    assert [record["setting"] for record in document["settings"]] == ["the defaults", coarse]
    assert all(0.0 < record["error"] <= 1e-2 for record in document["settings"])
    assert (out / "tradeoff.csv").read_text("utf-8").startswith("group,setting,")
    page, images = tmp_path / "page.md", tmp_path / "images"
    parts = (f"<!-- begin {n} -->\nstale\n<!-- end {n} -->\n" for n in ("settings", "spectral"))
    page.write_text("".join(parts), "utf-8")
    images.mkdir()
    assert tables.main(["tradeoff", str(out), "-o", str(page), "--images", str(images)]) == 0
    assert f"| {coarse} | {document['settings'][1]['error']:.1e} |" in page.read_text("utf-8")
    for name in ("tradeoff.png", "depth.png"):
        assert (images / name).read_bytes() == (out / name).read_bytes()
    assert tables.main(["tradeoff", str(images), "-o", str(page)]) == 1
    assert "is not what tradeoff writes" in capfd.readouterr().err
