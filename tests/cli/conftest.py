"""Inputs of commands, and folders that they run in."""

from __future__ import annotations

import shutil
from pathlib import Path

import numpy as np
import pytest

from tests.support.inputs import write_inputs


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
