"""The README's table of methods, in small."""

from __future__ import annotations

from pathlib import Path

from docs.make.figures import markers, methods

README = Path(__file__).parents[2] / "README.md"


def test_the_table_is_made_by_one_command(tmp_path, capsys, some_variant):
    page = tmp_path / "README.md"
    page.write_text("<!-- begin methods -->\n<!-- end methods -->\n", encoding="utf-8")
    code = methods.main(["-o", str(page), "--small", "--resolution", "12"])
    assert code == 0, capsys.readouterr().err
    text = markers.part(page.read_text(encoding="utf-8"), "methods")
    rows = {line.split("|")[1].strip(): line.split("|") for line in text.splitlines()[2:9]}
    assert set(rows) == {
        *(f"`{n}`" for n in methods.NAMES), "nmm, lobes",
    }  # fmt: skip
    assert float(rows["`flss`"][3]) == 1.0


def test_the_readme_has_a_row_for_every_method():
    text = markers.part(README.read_text(encoding="utf-8"), "methods")
    for name in methods.NAMES:
        assert f"| `{name}` |" in text
