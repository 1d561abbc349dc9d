"""Whether Dr.Jit can work with a library: tried in a child process, once."""

from __future__ import annotations

import os
import shutil
import subprocess
from pathlib import Path

import pytest

from mitsuba_diffraction.plugin import llvm
from mitsuba_diffraction.plugin.llvm import trial
from tests.plugin.llvm.machine import installed


@pytest.mark.usefixtures("no_child")
@pytest.mark.parametrize("version", [14, 15, 16])
def test_old_versions_are_refused_untried(version: int, tmp_path: Path):
    (tmp_path / f"libLLVM-{version}.so.1").touch()
    assert not llvm.usable(tmp_path / f"libLLVM-{version}.so.1")


def test_unnamed_version_is_tried_once_and_remembered(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
):
    copy = tmp_path / "libLLVM.so"
    shutil.copyfile(installed(19), copy)
    assert llvm.usable(copy)
    trial.tried.cache_clear()
    monkeypatch.setattr(trial, "_try", lambda path: pytest.fail("tried again"))
    assert llvm.usable(copy)


def test_unnamed_version_that_ends_the_process_is_refused(tmp_path: Path):
    copy = tmp_path / "libLLVM.so"
    shutil.copyfile(installed(15), copy)
    assert trial.tried(copy) == (15, False)
    assert not llvm.usable(copy)


@pytest.mark.parametrize("content", [b"", b"not a library"])
def test_file_that_is_no_library_is_refused(content: bytes, tmp_path: Path):
    (tmp_path / "libLLVM.so").write_bytes(content)
    assert not llvm.usable(tmp_path / "libLLVM.so")


def test_changed_file_and_broken_memory_are_tried_anew(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
):
    file = tmp_path / "libLLVM.so.21.1"
    file.touch()
    monkeypatch.setattr(trial, "_try", lambda path: (21, False, True))
    assert not llvm.usable(file)

    monkeypatch.setattr(trial, "_try", lambda path: (21, True, True))
    trial.tried.cache_clear()
    assert not llvm.usable(file)  # remembered
    os.utime(file, (1, 1))
    trial.tried.cache_clear()
    assert llvm.usable(file)

    (tmp_path / "cache" / "llvm.json").write_text('{"half')
    monkeypatch.setattr(trial, "_try", lambda path: (21, False, True))
    trial.tried.cache_clear()
    assert not llvm.usable(file)


def test_trial_without_an_answer_is_not_remembered(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    def run(command: list[str], **_: object) -> None:
        raise subprocess.TimeoutExpired(command, 1)

    file = tmp_path / "libLLVM.so.21.1"
    file.touch()
    monkeypatch.setattr(subprocess, "run", run)
    assert not llvm.usable(file)
    assert not (tmp_path / "cache" / "llvm.json").exists()


def test_memory_that_cannot_be_written_costs_a_trial_and_nothing_else(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
):
    (tmp_path / "file").touch()
    monkeypatch.setenv("MITSUBA_DIFFRACTION_CACHE", str(tmp_path / "file" / "cache"))
    monkeypatch.setattr(trial, "_try", lambda path: (21, True, True))
    (tmp_path / "libLLVM.so.21.1").touch()
    assert llvm.usable(tmp_path / "libLLVM.so.21.1")
