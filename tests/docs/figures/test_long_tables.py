"""Long tables are files beside a page, short ones stay on it."""

from __future__ import annotations

import csv

from docs.make.figures.long_tables import LONG, write_page


def page_of(rows):
    lines = "".join(f"| `case {n}` | {n} % | \\|a\\| |\n" for n in range(rows))
    return f"# Page\n\n## By depth\n\n| case | error | a |\n|---|---:|---|\n{lines}\nEnd.\n"


def test_a_long_table_is_a_file_with_the_same_cells(tmp_path):
    (tmp_path / "page-old.csv").write_text("of an earlier page")
    written = write_page(tmp_path / "page.md", page_of(LONG))
    assert [path.name for path in written] == ["page.md", "page-by-depth.csv"]
    text = (tmp_path / "page.md").read_text(encoding="utf-8")
    assert f"[Table of {LONG} rows](page-by-depth.csv): case, error, a." in text
    assert text.endswith("\nEnd.\n")
    with (tmp_path / "page-by-depth.csv").open(encoding="utf-8") as stream:
        rows = list(csv.reader(stream))
    assert rows[0] == ["case", "error", "a"]
    assert rows[1:] == [[f"case {n}", f"{n} %", "|a|"] for n in range(LONG)]
    assert not (tmp_path / "page-old.csv").exists()


def test_a_short_table_stays(tmp_path):
    text = page_of(LONG - 1)
    assert write_page(tmp_path / "page.md", text) == [tmp_path / "page.md"]
    assert (tmp_path / "page.md").read_text(encoding="utf-8") == text


def test_a_table_outside_of_the_generated_parts_stays(tmp_path):
    by_hand, made = page_of(LONG), page_of(LONG).replace("case", "row")
    text = f"{by_hand}<!-- begin figures -->\n{made}<!-- end figures -->\n{by_hand}"
    assert len(write_page(tmp_path / "page.md", text)) == 2
    shown = (tmp_path / "page.md").read_text(encoding="utf-8")
    assert shown.count(by_hand) == 2
    assert "Table of" in shown
    assert "| `row 0`" not in shown
