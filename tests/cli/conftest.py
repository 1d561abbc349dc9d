"""Running the command line in this process, and in a child where the process state matters."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np
import pytest

from tests.support import ROOT
from tests.support.command_line import Ran
from tests.support.inputs import write_inputs


@pytest.fixture
def child(tmp_path: Path) -> Callable[..., Ran]:
    """`child(arguments, prelude="", limit=None)`: main() in a child whose folder is `tmp_path`.

    `prelude` is Python code that runs first, with `main` imported; `limit` the largest file that
    the child can write, in bytes: what a full disk is like without one.
    """

    def call(arguments: Sequence[object], prelude: str = "", limit: int | None = None) -> Ran:
        lines = ["import os, signal, sys", "from mitsuba_diffraction.cli import main"]
        if limit is not None:
            lines.append("from resource import RLIMIT_FSIZE, setrlimit")
            lines.append(f"setrlimit(RLIMIT_FSIZE, ({limit}, {limit}))")
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
def heights(tmp_path: Path) -> Path:
    """A gentle grating of 6 µm with pixels of 0.08 µm, as an NPY file in a folder of its own."""
    x = np.arange(75) * 0.08
    file = tmp_path / "in" / "grating.npy"
    file.parent.mkdir()
    np.save(file, np.tile(0.02 * np.sin(2 * np.pi * x / 3.0), (75, 1)))
    return file


@pytest.fixture(scope="session")
def original(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder of small inputs of every kind."""
    folder = tmp_path_factory.mktemp("original")
    write_inputs(folder)
    return folder


@pytest.fixture
def world(original: Path, here: Path) -> Path:
    """A copy of the small inputs, which is the current folder."""
    shutil.copytree(original, here, dirs_exist_ok=True)
    return here
