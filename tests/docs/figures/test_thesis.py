"""The page on the thesis, in small."""

from __future__ import annotations

import pytest
from PIL import Image

from docs.make.figures import pages, thesis
from mitsuba_diffraction.thesis import methods
from mitsuba_diffraction.thesis.sweeps import SWEEPS
from tests.support import ROOT

pytestmark = pytest.mark.thorough

DOCS = ROOT / "docs"


def test_the_table_of_methods_is_made_by_one_command(tmp_path, capsys, some_variant):
    page = tmp_path / "README.md"
    page.write_text("<!-- begin methods -->\n<!-- end methods -->\n", encoding="utf-8")
    code = thesis.main(["methods", "-o", str(page), "--small", "--resolution", "12"])
    assert code == 0, capsys.readouterr().err
    text = pages.part(page.read_text(encoding="utf-8"), "methods")
    rows = {line.split("|")[1].strip(): line.split("|") for line in text.splitlines()[2:9]}
    assert set(rows) == {*(f"`{n}`" for n in methods.NAMES), "nmm, lobes"}
    assert float(rows["`flss`"][3]) == 1.0


def test_the_page_of_sweeps_is_made_by_one_command(tmp_path, capsys):
    page = tmp_path / "thesis.md"
    page.write_text((DOCS / "thesis.md").read_text(encoding="utf-8"), encoding="utf-8")
    (tmp_path / "images").mkdir()
    assert thesis.main(["sweeps", "-o", str(page), "--small", "--resolution", "8"]) == 0, (
        capsys.readouterr()
    )
    text = page.read_text(encoding="utf-8")
    kinds = [kind for kind in SWEEPS if kind in pages.markers(page)]
    assert kinds
    for kind in kinds:
        parameter = SWEEPS[kind]
        rows = pages.part(text, kind).splitlines()[2:]
        assert len(rows) == len(parameter.values)
        assert ("reference" in pages.part(text, kind)) == (parameter.reference is not None)
        with Image.open(tmp_path / "images" / f"sweep-{kind}.png") as image:
            assert image.size[0] > 400


def test_the_periods_are_made_by_one_command(tmp_path, capsys):
    page = tmp_path / "thesis.md"
    page.write_text((DOCS / "thesis.md").read_text(encoding="utf-8"), encoding="utf-8")
    (tmp_path / "images").mkdir()
    words = ["--small", "--windows", "2", "--angle-step", "0.1"]
    code = thesis.main(["evaluation", "-o", str(page), *words])
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
