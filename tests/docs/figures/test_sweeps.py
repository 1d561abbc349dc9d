"""The page of sweeps, in small."""

from __future__ import annotations

from pathlib import Path

from PIL import Image

from docs.make.figures import pages, sweeps
from mitsuba_diffraction.thesis.sweeps import SWEEPS

DOCS = Path(__file__).parents[3] / "docs"


def test_the_page_is_made_by_one_command(tmp_path, capsys):
    page = tmp_path / "sweeps.md"
    page.write_text((DOCS / "sweeps.md").read_text(encoding="utf-8"), encoding="utf-8")
    (tmp_path / "images").mkdir()
    assert sweeps.main(["-o", str(page), "--small", "--resolution", "8"]) == 0, capsys.readouterr()
    text = page.read_text(encoding="utf-8")
    for kind, parameter in SWEEPS.items():
        rows = pages.part(text, kind).splitlines()[2:]
        assert len(rows) == len(parameter.values)
        assert ("reference" in pages.part(text, kind)) == (parameter.reference is not None)
        with Image.open(tmp_path / "images" / f"sweep-{kind}.png") as image:
            assert image.size[0] > 400
