"""Windows of a wide scan on workers: the same table, to the last bit, whatever happens to them.

Files of tasks on a worker without a cache lie where no other user can put theirs.
"""

from __future__ import annotations

import hashlib
import json
import stat
from concurrent.futures import CancelledError

import numpy as np
import pytest

from mitsuba_diffraction import DiffractionError, DiffractionTable, HeightField, cluster
from mitsuba_diffraction.cluster import calls, tasks
from mitsuba_diffraction.cluster.jobs import WorkerCalls
from tests.cluster.clusters import Recorder
from tests.support.scans import PIXEL, SETTINGS, rough
from tests.support.systems import posix


@pytest.fixture(scope="module")
def scan():
    return HeightField(rough(300), PIXEL, name="scan", cut_out=True)


@pytest.fixture(scope="module")
def alone(scan):
    """The table that this process builds by itself."""
    return DiffractionTable.build(scan, **SETTINGS)


def test_few_tasks_are_under_way_however_many_there_are():
    client = Recorder(3)
    assert list(WorkerCalls(client)(abs, range(-50, 0))) == list(range(50, 0, -1))
    assert client.most == 6


class Losing(Recorder):
    """Workers that are lost with every third call."""

    def submit(self, work, *call, **how):
        lost = (self.given + 1) % 3 == 0
        return super().submit(_lost if lost else work, *call, **how)


def _lost(*_):
    raise CancelledError


def test_calls_that_were_lost_are_given_out_again():
    calls = WorkerCalls(Losing(2))
    assert sorted(calls.finished(abs, [-1, -2, -3, -4])) == [(0, 1), (1, 2), (2, 3), (3, 4)]
    assert (calls.report.tasks, calls.report.retries) == (4, 1)


def test_an_error_on_a_worker_is_one_line_with_its_name():
    with pytest.raises(DiffractionError, match=r"^worker this process: unexpected TypeError: bad"):
        list(WorkerCalls(Recorder(1))(abs, ["no number"]))


def test_a_late_worker_with_another_version_is_named(monkeypatch):
    monkeypatch.setattr(calls, "versions", lambda: ("0.1", "0.1", "0.1"))
    with pytest.raises(DiffractionError, match=r"^worker this process: it has .* the client 0\.1"):
        list(WorkerCalls(Recorder(1))(abs, [1]))


def test_without_windows_there_is_nothing_for_workers(scan, run, tmp_path):
    with pytest.raises(DiffractionError, match="periodic=open"):
        cluster.build(HeightField(scan.heights, PIXEL), client=Recorder(1), **SETTINGS)


def test_the_command_builds_the_same_table_on_one_worker(scan, alone, run, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    np.save("scan.npy", scan.heights)
    ran = run(
        "precompute", "scan.npy", "--pixel-size", PIXEL, "--coherence-width", 6, "--tolerance",
        0.02, "--wavelength-range", "500:600", "--workers", 1,
        "--json", "out.json",
    ).succeeded()  # fmt: skip
    assert "tasks of windows" in ran.out
    assert DiffractionTable.load("scan.exr").digest() == alone.digest()
    assert json.loads((tmp_path / "out.json").read_text())["workers"]["tasks"] > 10


@posix
def test_without_a_cache_the_folder_is_new_and_private(tmp_path, monkeypatch):
    (tmp_path / "mitsuba_diffraction").mkdir()  # somebody else's
    monkeypatch.setattr(tasks.tempfile, "tempdir", str(tmp_path))
    monkeypatch.setattr(tasks, "cache_folder", lambda: None)
    tasks._own_temporary.cache_clear()
    digest = hashlib.sha256(b"<scene/>").hexdigest()
    files = tasks.SceneFiles("/a/scene.xml", (), (("/a/scene.xml", digest),))
    files.require({digest: b"<scene/>"})
    (made,) = (folder for folder in tmp_path.iterdir() if folder.name != "mitsuba_diffraction")
    assert stat.S_IMODE(made.stat().st_mode) == 0o700
    assert [*(tmp_path / "mitsuba_diffraction").iterdir()] == []
    tasks._own_temporary.cache_clear()
