"""Workers, clients and schedulers that are killed or stopped; disks, full or with damaged sums."""

from __future__ import annotations

import contextlib
import os
import re
import signal
import socket
import subprocess
import sys
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from mitsuba_diffraction import (
    DiffractionError,
    DiffractionWarning,
    cluster,
)
from mitsuba_diffraction.cluster import calls, groups, workers
from mitsuba_diffraction.cluster.jobs import WorkerCalls
from mitsuba_diffraction.cluster.kept import Kept
from mitsuba_diffraction.cluster.tasks import MissingFiles, SceneFiles, run_task
from mitsuba_diffraction.scene.passes import Span
from tests.cluster.clusters import VARIANT, film, passes_of_picture, picture_of, rendered
from tests.support import ROOT
from tests.support.machine import python
from tests.support.room import SCENE

pytestmark = pytest.mark.thorough


def test_a_killed_worker_and_late_ones_change_nothing(client, scene, expected, three_groups):
    happened = []

    def disturb(done, total, text):
        if done >= 2 and not happened:
            happened.append(text)
            victim = next(iter(client.cluster.workers.values()))
            os.kill(victim.pid, signal.SIGKILL)
            client.cluster.scale(3)

    np.testing.assert_array_equal(rendered(client, scene, progress=disturb), expected)
    assert happened
    client.wait_for_workers(3, timeout=300)
    np.testing.assert_array_equal(rendered(client, scene), expected)
    client.cluster.scale(2)


def test_a_full_disk_is_one_line_and_leaves_nothing(client, scene, expected, tmp_path):
    resource = pytest.importorskip("resource")  # of Unix
    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (4096, before[1]))
    try:
        with pytest.raises(DiffractionError, match=r"cannot write .*File too large"):
            rendered(client, scene, keep=tmp_path / "passes")
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, before)
    assert not list((tmp_path / "passes").iterdir())
    again = rendered(client, scene, keep=tmp_path / "passes")
    np.testing.assert_array_equal(again, expected)


STOPPED = """
import os, signal
from mitsuba_diffraction import cluster
from mitsuba_diffraction.scene import passes

passes.SAMPLES["llvm"] = 2 * 24 * 16

def stop(done, *_):
    if done >= 4:
        os.kill(os.getpid(), signal.{name})

with cluster.connect(scheduler={address!r}) as client:
    cluster.render(
        "room.xml", client=client, spp=24, seed=3, variant={variant!r}, threads=1, keep="passes",
        progress=stop,
    )
"""


@pytest.mark.parametrize("name", ["SIGKILL", "SIGINT"])
def test_a_client_that_was_stopped_goes_on(client, scene, expected, monkeypatch, name):
    ran = python(STOPPED.format(address=client.scheduler.address, variant=VARIANT, name=name))
    assert ran.returncode == -signal.SIGKILL if name == "SIGKILL" else "interrupted" in ran.stderr
    there = len(list(Path("passes").glob("*.sum")))
    assert 4 <= there <= 12
    monkeypatch.setattr(groups, "GROUPS", 4)  # single passes are continued with in fours
    again = film(client, scene, Path("passes"))
    np.testing.assert_array_equal(picture_of(again), expected)
    assert (again.report.kept, again.report.tasks) == (there, 12 - there)
    assert not Path("passes").exists()


CLUSTER = """
import time
from distributed import LocalCluster

LocalCluster(
    n_workers=1, threads_per_worker=1, processes=False, protocol="tcp://", host="127.0.0.1",
    scheduler_port={port}, dashboard_address=None,
)
time.sleep(3600)
"""


@pytest.fixture
def start():
    """`start(port)`: a process that is a scheduler and its worker."""
    running = []

    def call(port):
        path = os.pathsep.join([str(ROOT), os.environ.get("PYTHONPATH", "")])
        running.append(
            subprocess.Popen(
                [sys.executable, "-c", CLUSTER.format(port=port)],
                env={**os.environ, "PYTHONPATH": path}, stderr=subprocess.DEVNULL,
            )
        )  # fmt: skip
        return running[-1]

    yield call
    for process in running:
        process.kill()
        process.wait()


def free_port():
    """A port that stays free while a scheduler starts: none that the system gives to others."""
    for port in range(20_000 + os.getpid() % 10_000, 32_000):
        with socket.socket() as free, contextlib.suppress(OSError):
            free.bind(("127.0.0.1", port))
            return port
    raise AssertionError("all ports are taken")


def test_a_scheduler_that_is_killed_and_started_again_changes_nothing(
    scene, expected, start, tmp_path, monkeypatch
):
    monkeypatch.setattr(calls, "COUNT_EVERY", 0.0)  # or a quick restart would not be seen
    monkeypatch.setattr(workers, "PATIENCE", 300.0)  # of a busy machine
    port = free_port()
    first, killed = start(port), []

    def disturb(done, total, text):
        if done >= 4 and not killed:
            first.kill()
            first.wait()
            killed.extend((tmp_path / "passes").iterdir())
            start(port)

    with cluster.connect(scheduler=f"tcp://127.0.0.1:{port}", patience=300) as mine:
        job = film(mine, scene, tmp_path / "passes")
        np.testing.assert_array_equal(picture_of(job, disturb), expected)
    assert len(killed) >= 4
    # none of those that were kept a second time; whether one was under way is chance
    assert job.report.tasks == 12
    assert job.report.lost == 1


def test_files_that_a_worker_lacks_come_by_content(
    client, scene, expected, monkeypatch, three_groups
):
    def without_files(task, contents=None):
        if not contents:
            raise MissingFiles([task.files.files[0][1]])
        return run_task(task)

    monkeypatch.setattr(groups, "run_task", without_files)
    job = film(client, scene, scene.parent / "passes")
    np.testing.assert_array_equal(picture_of(job), expected)
    assert job.report.tasks == 12


def test_calls_get_the_files_that_a_worker_lacks(client, scene):
    def read(argument, contents=None):
        ((_, digest),) = argument.files.files
        if not contents:
            raise MissingFiles([digest])
        return contents[digest]

    calls, argument = WorkerCalls(client), SimpleNamespace(files=SceneFiles.from_scene(scene, {}))
    assert list(calls(read, [argument, argument])) == [scene.read_bytes()] * 2
    assert (calls.report.tasks, calls.report.retries) == (2, 2)


def test_a_copy_of_a_scene_is_the_scene(scene, expected, monkeypatch, tmp_path):
    (tmp_path / "part.xml").write_text('<scene version="3.0.0"/>')
    scene.write_text(SCENE.replace("</scene>", '<include filename="part.xml"/></scene>'))
    task = passes_of_picture(scene).part(Span(0, 1))
    contents = {digest: Path(path).read_bytes() for path, digest in task.files.files}
    assert len(contents) == 2
    scene.rename(tmp_path / "elsewhere.xml")
    (tmp_path / "part.xml").unlink()
    with pytest.raises(MissingFiles) as missing:
        run_task(task)
    assert missing.value.digests == sorted(contents)
    assert run_task(task, contents).raw.shape[:2] == expected.shape[:2]


FIRST, SECOND = Span(0, 1), Span(1, 1)


@pytest.mark.parametrize(
    "damage",
    [
        lambda content: content[:-100],
        lambda content: content[:-4096] + (50 * np.frombuffer(content[-4096:])).tobytes(),
        lambda content: content[:-4096] + np.full(512, np.nan).tobytes(),
    ],
    ids=["cut", "times 50", "not a number"],
)
def test_damaged_sums_are_rendered_again(scene, tmp_path, damage):
    frame = passes_of_picture(scene)
    kept, sums = Kept(tmp_path / "passes"), run_task(frame.part(FIRST))
    kept.write(frame, FIRST, sums)
    assert kept.spans(frame) == {FIRST}
    assert np.array_equal(kept.read(frame, FIRST).raw, sums.raw)
    (file,) = (tmp_path / "passes").iterdir()
    file.write_bytes(damage(file.read_bytes()))
    with pytest.warns(DiffractionWarning, match=f"'{re.escape(str(file))}' is damaged"):
        assert kept.read(frame, FIRST) is None
    assert kept.spans(frame) == set()
    kept.write(frame, FIRST, sums)
    file.rename(file.with_name(file.name.replace("-0-1", "-1-1")))
    assert kept.spans(frame) == {SECOND}
    with pytest.warns(DiffractionWarning, match="its key is another's"):
        assert kept.read(frame, SECOND) is None
