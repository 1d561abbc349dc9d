"""The page on the thesis, in small, and the pictures of the documentation."""

from __future__ import annotations

import pytest
from PIL import Image

from docs.make.figures import pages, pictures, thesis
from mitsuba_diffraction.analysis.pictures import colour_field
from mitsuba_diffraction.heights.gratings import cd, elaphe_like
from mitsuba_diffraction.thesis import methods
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


def test_colours_lie_where_the_grating_throws_them():
    """A CD's first orders, 650 nm/1.6 µm and so on, along v."""
    colours = colour_field(cd(32.0, 320, irregularity=0), 201)
    for channel, wavelength in enumerate((0.65, 0.55, 0.45)):
        for order in (-2, -1, 1, 2):
            v = round(100 + 100 * order * wavelength / 1.6)  # a pixel is 0.01, an order 0.02 wide
            between = round(100 + 100 * (order - 0.5) * wavelength / 1.6)
            assert colours[v, 100, channel] > colours[between, 100, channel] + 0.1


@pytest.mark.parametrize("name", ["patches", "maps"])
def test_program_writes_the_figure(tmp_path, monkeypatch, name):
    few = [lambda n=n: elaphe_like(8.0 * n, 64) for n in (1, 2)]
    monkeypatch.setattr(pictures, "LOOKALIKES", few)
    monkeypatch.setattr(pictures, "MAPPED", few)
    assert pictures.main(["-o", str(tmp_path), "--only", name, "--resolution", "16"]) == 0
    with Image.open(tmp_path / f"{name}.png") as image:
        assert image.size[0] > 500
