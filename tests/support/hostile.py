"""Files that run or leak something if a program trusts the folder that they lie in."""

from __future__ import annotations

import shutil
import subprocess
from collections.abc import Iterable
from pathlib import Path

import pytest
from PIL import Image

_SOURCE = """
#include <stdio.h>
__attribute__((constructor)) static void run(void) {
    FILE *file = fopen(MARK, "w");
    if (file) fclose(file);
}
"""


def plugins_in(folder: Path, mark: Path, names: Iterable[str]) -> Path:
    """Write plugins/NAME.so that create the file `mark` when they are loaded; return `mark`."""
    built = _library(mark)
    (folder / "plugins").mkdir(exist_ok=True)
    for name in names:
        shutil.copy(built, folder / "plugins" / f"{name}.so")
    return mark


def other_metals(folder: Path) -> None:
    """Write tables of optical constants, those of a vacuum, where Mitsuba looks for them."""
    tables = folder / "data" / "ior"
    tables.mkdir(parents=True)
    for name, value in (("eta", 1.0), ("k", 0.0)):
        for metal in ("Al", "Unobtainium"):
            (tables / f"{metal}.{name}.spd").write_text(f"300 {value}\n900 {value}\n")


def _library(mark: Path) -> Path:
    compiler = shutil.which("cc") or shutil.which("gcc") or shutil.which("clang")
    if compiler is None:
        pytest.skip("no C compiler is installed, to build a library that tells of being loaded")
    source, built = mark.with_suffix(".c"), mark.with_suffix(".so")
    source.write_text(_SOURCE)
    subprocess.run(
        [compiler, "-shared", "-fPIC", f'-DMARK="{mark}"', "-o", built, source], check=True
    )
    return built


def postscript(file: Path) -> Path:
    """Write an image in PostScript (EPS), a program that Ghostscript runs; return the file."""
    Image.new("L", (8, 8)).save(file, format="EPS")
    return file
