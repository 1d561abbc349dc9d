"""The notebooks run from the first cell to the last, and keep what they promise."""

from __future__ import annotations

import re
from pathlib import Path

import nbformat
import pytest

from docs.make.figures.notebooks import main
from tests.support.notebooks import (
    NOTEBOOKS,
    SAYS,
    SMALLER,
    kinds,
    read,
    streams,
)

pytestmark = [
    # the kernel's messages pass between two processes of this machine
    pytest.mark.filterwarnings("ignore::DeprecationWarning:(zmq|jupyter_client|nbclient)"),
    pytest.mark.filterwarnings("ignore::RuntimeWarning:(zmq|jupyter_client|nbclient)"),
]


def test_there_are_notebooks():
    assert {path.stem for path in NOTEBOOKS} >= {*SAYS, *SMALLER}


@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda path: path.stem)
def test_it_is_small_and_has_been_run(path):
    assert path.stat().st_size < 500_000
    notebook = read(path)
    nbformat.validate(notebook)
    assert any(kind[0] == "display_data" for cell in kinds(notebook) for kind in cell)
    assert all(kind[0] != "error" for cell in kinds(notebook) for kind in cell)


def written(path: Path, *cells: str) -> Path:
    """A notebook of these cells of code, not run."""
    made = [nbformat.v4.new_code_cell(text) for text in cells]
    nbformat.write(nbformat.v4.new_notebook(cells=made), path)
    return path


def test_what_a_notebook_shows_is_kept_in_its_file(tmp_path, capsys):
    path = written(tmp_path / "sum.ipynb", "print(2 + 3)")
    assert main([str(path)]) == 0
    assert streams(read(path), "stdout") == "5\n"
    assert "execution" not in read(path).cells[0].metadata
    assert re.search(r"sum\.ipynb: \d+\.\d s, \d+ kB", capsys.readouterr().out)


def test_a_cell_that_fails_is_named_and_the_file_stays(tmp_path, capsys):
    path = written(tmp_path / "wrong.ipynb", "x = 1", "assert x == 2, 'one is not two'", "x = 3")
    before = path.read_bytes()
    assert main([str(path)]) == 1
    said = capsys.readouterr().err.strip().splitlines()
    assert said[-1] == (
        f"notebooks: error: '{path}': cell [2] fails: AssertionError: one is not two"
    )
    assert path.read_bytes() == before


def test_what_is_no_notebook_is_one_clear_line(tmp_path, capsys):
    for path in (tmp_path / "absent.ipynb", tmp_path / "text.ipynb"):
        if path.stem == "text":
            path.write_text("no JSON", encoding="utf-8")
        assert main([str(path)]) == 1
        (line,) = capsys.readouterr().err.strip().splitlines()
        assert f"'{path}' is not a notebook that can be read" in line
