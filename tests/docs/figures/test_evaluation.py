"""The page on the grating equation, in small, and generated parts of pages."""

from __future__ import annotations

import pytest
from PIL import Image

from docs.make.figures import evaluation, pages
from mitsuba_diffraction import DiffractionError
from tests.support import ROOT

pytestmark = pytest.mark.thorough

DOCS = ROOT / "docs"


def test_the_page_is_made_by_one_command(tmp_path, capsys):
    page = tmp_path / "thesis.md"
    page.write_text((DOCS / "thesis.md").read_text(encoding="utf-8"), encoding="utf-8")
    (tmp_path / "images").mkdir()
    code = evaluation.main(["-o", str(page), "--small", "--windows", "2", "--angle-step", "0.1"])
    assert code == 0, capsys.readouterr().err
    text = page.read_text(encoding="utf-8")
    periods = pages.part(text, "periods").splitlines()
    assert len(periods) == 4  # head, rule, blazed, sinusoidal
    for line, made in zip(periods[2:], (2500.0, 1600.0), strict=True):
        cells = [cell.strip() for cell in line.strip("|").split("|")]
        *exact, nmm = (float(cells[n]) for n in (2, 3, 5, 6, 4))
        assert exact == pytest.approx([made] * 4, rel=1e-3)
        # knows its wavelengths to half a step of 5 nm, 0.7 %
        assert nmm == pytest.approx(made, rel=7e-3)
        assert float(cells[7].split("±")[0]) == pytest.approx(made, rel=1e-3)
    with Image.open(tmp_path / "images" / "evaluation.png") as image:
        assert min(image.size) > 300


def test_a_part_is_replaced_and_all_else_stays():
    text = "a\n<!-- begin t -->\nold\n<!-- end t -->\nb\n"
    new = pages.replaced(text, "t", "new\n")
    assert new == "a\n<!-- begin t -->\nnew\n<!-- end t -->\nb\n"
    assert pages.part(new, "t") == "new"
    with pytest.raises(DiffractionError):
        pages.replaced(text + text, "t", "new")
