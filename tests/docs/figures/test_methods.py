"""The table of methods, in small."""

from __future__ import annotations

from docs.make.figures import methods, pages
from mitsuba_diffraction.cli.options import METHODS


def test_the_table_is_made_by_one_command(tmp_path, capsys, some_variant):
    page = tmp_path / "README.md"
    page.write_text("<!-- begin methods -->\n<!-- end methods -->\n", encoding="utf-8")
    code = methods.main(["-o", str(page), "--small", "--resolution", "12"])
    assert code == 0, capsys.readouterr().err
    text = pages.part(page.read_text(encoding="utf-8"), "methods")
    rows = {line.split("|")[1].strip(): line.split("|") for line in text.splitlines()[2:9]}
    assert set(rows) == {
        *(f"`{n}`" for n in METHODS), "nmm, lobes",
    }  # fmt: skip
    assert float(rows["`flss`"][3]) == 1.0
