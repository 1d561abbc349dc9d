"""Files are written whole or not at all, and what a killed process left is removed."""

from __future__ import annotations

import errno
import os
import subprocess
import sys

import pytest

from mitsuba_diffraction.atomic import atomic_path, make_folder, remove_temporaries
from mitsuba_diffraction.errors import DiffractionError
from tests.support.systems import posix

KILLED = """
import os, sys
from mitsuba_diffraction.atomic import atomic_path
with atomic_path(sys.argv[1]) as path:
    path.write_text("half")
    os._exit(9)  # nothing is unwound
"""


def test_a_file_is_there_when_all_of_it_is(tmp_path):
    target = tmp_path / "a.txt"
    with atomic_path(target) as path:
        path.write_text("whole")
        assert path.suffix == ".txt"
        assert not target.exists()
    assert target.read_text() == "whole"
    assert os.listdir(tmp_path) == ["a.txt"]


def test_an_error_leaves_what_was_there(tmp_path):
    (tmp_path / "a.txt").write_text("before")
    with pytest.raises(ZeroDivisionError), atomic_path(tmp_path / "a.txt") as path:  # noqa: PT012
        path.write_text("half")
        _ = 1 / 0
    assert os.listdir(tmp_path) == ["a.txt"]
    assert (tmp_path / "a.txt").read_text() == "before"


def test_the_next_run_removes_what_a_killed_one_left(tmp_path):
    target = tmp_path / "table.exr"
    subprocess.run([sys.executable, "-c", KILLED, str(target)], check=False)
    assert len(os.listdir(tmp_path)) == 1
    (tmp_path / ".other.exr").write_text("not ours")
    with atomic_path(target) as path:
        path.write_text("whole")
    assert sorted(os.listdir(tmp_path)) == [".other.exr", "table.exr"]


def test_files_of_living_processes_stay(tmp_path):
    target = tmp_path / "a.txt"
    with atomic_path(target) as first, atomic_path(target) as second:
        assert first != second
        assert first.exists()


def test_temporaries_can_be_removed_before_an_exit_without_unwinding(tmp_path):
    with pytest.raises(DiffractionError), atomic_path(tmp_path / "a.txt"):  # noqa: PT012
        remove_temporaries()
        assert os.listdir(tmp_path) == []


def test_a_long_name_leaves_room_for_the_temporary_one(tmp_path):
    target = tmp_path / f"{'a' * 250}.txt"
    with atomic_path(target) as path:
        path.write_text("whole")
    assert target.read_text() == "whole"


@pytest.mark.parametrize(
    ("refusing", "error", "said"),
    [
        # Windows does not replace an open file
        (
            "replace",
            PermissionError(13, "Access is denied"),
            "Access is denied; close",
        ),
        # network file systems and some local ones tell of a full disk when the file is flushed
        ("fsync", OSError(errno.ENOSPC, "No space left"), "No space left"),
    ],
)
def test_what_is_refused_late_is_one_line_and_leaves_what_was_there(
    tmp_path, monkeypatch, refusing, error, said
):
    target = tmp_path / "a.txt"
    target.write_text("before")

    def refuse(*_: object) -> None:
        raise error

    monkeypatch.setattr(os, refusing, refuse)
    with pytest.raises(DiffractionError, match=said), atomic_path(target) as path:
        path.write_text("after")
    assert target.read_text() == "before"
    assert os.listdir(tmp_path) == ["a.txt"]


@posix
def test_permissions_follow_the_umask_which_no_thread_sees_changed(tmp_path, monkeypatch):
    before = os.umask(0o027)
    change = os.umask
    try:
        monkeypatch.setattr(os, "umask", lambda _: pytest.fail("all threads' files would change"))
        with atomic_path(tmp_path / "a.txt") as path:
            path.write_text("whole")
    finally:
        change(before)
    assert (tmp_path / "a.txt").stat().st_mode & 0o777 == 0o640


def test_a_folder_that_cannot_be_made_is_one_line(tmp_path):
    make_folder(tmp_path / "a" / "b")
    make_folder(tmp_path / "a" / "b")  # it may be there
    (tmp_path / "file").touch()
    with pytest.raises(DiffractionError, match=r"^cannot make the folder '.*c': Not a directory"):
        make_folder(tmp_path / "file" / "c")
