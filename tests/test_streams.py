"""Streams are the program's: only our own command line keeps a library's words from them."""

from __future__ import annotations

import os
import threading

import pytest

from mitsuba_diffraction import DiffractionError, DiffractionTable
from mitsuba_diffraction.streams import own_program, without_chatter
from tests.support.directions import rough_patch


@pytest.fixture
def damaged(tmp_path):
    """A table whose pixels cannot be decompressed, of which OpenEXR says so in two streams."""
    file = tmp_path / "table.exr"
    DiffractionTable.build(rough_patch((20, 24), (0.08, 0.09), 0.15), coherence_width=1.8).save(
        file
    )
    file.write_bytes(file.read_bytes()[:-100] + bytes(100))
    return file


def load(file):
    with pytest.raises(DiffractionError):
        DiffractionTable.load(file)


def test_a_library_s_streams_are_left_alone(damaged, capfd):
    before = os.fstat(1), os.fstat(2)
    load(damaged)
    assert all("EXR_ERR" in line for line in capfd.readouterr().err.splitlines())
    with without_chatter():
        assert os.path.samestat(before[1], os.fstat(2))
        print("heard")
    assert capfd.readouterr().out == "heard\n"


def test_a_program_of_ours_says_its_own_line_only_and_keeps_its_streams(damaged, capfd):
    before = os.fstat(1), os.fstat(2)
    with own_program():
        threads = [threading.Thread(target=load, args=[damaged], daemon=True) for _ in range(6)]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join(60)
    assert capfd.readouterr() == ("", "")
    assert all(os.path.samestat(a, os.fstat(n)) for n, a in enumerate(before, start=1))
    print("after")
    os.write(2, b"as well")
    assert capfd.readouterr() == ("after\n", "as well")
