"""Running the command line in this process, and in a child where the process state matters."""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pytest

from mitsuba_diffraction.cli import main

ROOT = Path(__file__).resolve().parents[2]


class Ran(NamedTuple):
    """What a run gave: exit code, stdout, stderr."""

    code: int
    out: str
    err: str

    def failed_in_one_line(self) -> str:
        """Check that the run failed with one line on stderr and nothing else; the line."""
        assert self.code == 1, self
        assert self.out == ""
        (line,) = self.err.splitlines()
        assert line.startswith("mitsuba-diffraction: error: ")
        return line


@pytest.fixture
def run(capfd: pytest.CaptureFixture[str]) -> Callable[..., Ran]:
    """`run(*arguments)`: main() in this process."""

    def call(*arguments: object) -> Ran:
        code = main([str(a) for a in arguments])
        return Ran(code, *capfd.readouterr())

    return call


@pytest.fixture
def child(tmp_path: Path) -> Callable[..., Ran]:
    """`child(arguments, prelude="", limit=None)`: main() in a child whose folder is `tmp_path`.

    `prelude` is Python code that runs first, with `main` imported; `limit` the largest file that
    the child can write, in bytes: what a full disk is like without one.
    """

    def call(arguments: Sequence[object], prelude: str = "", limit: int | None = None) -> Ran:
        lines = ["import os, resource, signal, sys", "from mitsuba_diffraction.cli import main"]
        if limit is not None:
            lines.append(f"resource.setrlimit(resource.RLIMIT_FSIZE, ({limit}, {limit}))")
        lines += [prelude, "sys.exit(main(sys.argv[1:]))"]
        result = subprocess.run(
            [sys.executable, "-c", "\n".join(lines), *map(str, arguments)],
            cwd=tmp_path,
            # no .pyc: a limit on file sizes would leave half of one
            env={**os.environ, "PYTHONPATH": str(ROOT), "PYTHONDONTWRITEBYTECODE": "1"},
            capture_output=True,
            text=True,
            timeout=120,
        )
        return Ran(result.returncode, result.stdout, result.stderr)

    return call


@pytest.fixture
def here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """An empty folder that is the current one."""
    folder = tmp_path / "here"
    folder.mkdir()
    monkeypatch.chdir(folder)
    return folder


@pytest.fixture
def scene(request: pytest.FixtureRequest, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The module's SCENE as room.xml, in a folder that is the current one."""
    monkeypatch.chdir(tmp_path)
    file = tmp_path / "room.xml"
    file.write_text(request.module.SCENE)
    return file


@pytest.fixture
def heights(tmp_path: Path) -> Path:
    """A gentle grating of 6 µm with pixels of 0.08 µm, as an NPY file in a folder of its own."""
    x = np.arange(75) * 0.08
    file = tmp_path / "in" / "grating.npy"
    file.parent.mkdir()
    np.save(file, np.tile(0.02 * np.sin(2 * np.pi * x / 3.0), (75, 1)))
    return file
