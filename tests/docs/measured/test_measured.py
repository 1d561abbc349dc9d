"""Measured gratings: their data, grooves and page."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

from docs.make.figures.pages import part
from docs.make.measured import cases, predict
from docs.make.measured.__main__ import main
from docs.make.measured.grooves import Groove
from docs.make.validation.light import heights_of
from tests.support.pages import PAGES, markers

pytest.importorskip("gratinglab")

DATA = sorted(set((Path(cases.__file__).parent / "data").glob("*.csv")) - {cases.FITTED})


@pytest.mark.parametrize("path", DATA, ids=lambda path: path.stem)
def test_every_measurement_names_its_source(path):
    header = [line for line in path.read_text().splitlines() if line.startswith("#")]
    assert any("Source: " in line for line in header)
    rows = cases.table(path.stem)
    efficiencies = [name for name in rows.dtype.names if "G5" in name or name == "efficiency"]
    assert efficiencies
    assert all(((rows[name] > 0) & (rows[name] < 1)).all() for name in efficiencies)


def test_facets_meet_at_the_apex():
    profile = Groove(20.0, 100.0).profile(2.0)
    x, z = profile.closed
    angles = np.degrees(np.arctan2(np.abs(np.diff(z)), np.diff(x)))
    assert angles[0] == pytest.approx(20.0)
    assert 180.0 - angles.sum() == pytest.approx(100.0)
    assert np.ptp(heights_of(profile).heights) == pytest.approx(profile.depth, rel=0.01)


def test_the_model_is_near_solved_orders_through_gentle_grooves():
    # 5° of glass: the model's slopes are within its range, 0.09 RMS
    profile, lam = Groove(5.0).profile(3.3), np.array([520.0])
    for outwards in (True, False):
        solved = predict.through_solved(1.52, outwards, profile, lam)
        model = predict.through_modelled(1.52, outwards, profile, lam)
        assert model == pytest.approx(solved, abs=0.02)


@pytest.mark.thorough
def test_the_page_is_whole(tmp_path, capsys):
    page = tmp_path / "validation" / "measured.md"
    for path in (page, tmp_path / "images" / "measured_gratings.png"):
        path.parent.mkdir()
    page.write_text(PAGES["docs/validation/measured.md"], encoding="utf-8")
    assert main(["--quick", "-o", str(tmp_path)]) == 0
    text = page.read_text(encoding="utf-8")
    assert not re.search(r"\bnan\b", text)
    assert markers(text) == markers(PAGES["docs/validation/measured.md"])
    # another renderer's maps are kept: their clone was not given
    assert part(text, "pictures") == part(PAGES["docs/validation/measured.md"], "pictures")
    for name in ("agreement-with-measurements", "what-was-fitted"):
        assert part(text, name).count("GMOS B1200") == 1
    assert (tmp_path / "images" / "measured_gratings.png").stat().st_size > 10_000
    assert "solved orders are within" in capsys.readouterr().out
