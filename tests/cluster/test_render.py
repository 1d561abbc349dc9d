"""Pictures and films from workers, real processes: bit for bit those of one process."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import distributed
import numpy as np
import pytest

from mitsuba_diffraction import DiffractionError, DiffractionWarning
from mitsuba_diffraction.cluster import groups
from mitsuba_diffraction.cluster.frames import FrameRequest
from mitsuba_diffraction.cluster.kept import Kept
from mitsuba_diffraction.cluster.tasks import run_task
from mitsuba_diffraction.scene import Stop
from mitsuba_diffraction.scene.passes import Span
from tests.cluster.clusters import SPP, VARIANT, Recorder, film, picture_of, rendered, silent
from tests.support.room import SCENE, pixels

pytestmark = pytest.mark.thorough


@pytest.mark.parametrize(("count", "at_once", "sums"), [(1, 8, 1), (4, 2, 3)])
def test_sums_that_workers_added_are_the_same(
    client, scene, expected, tmp_path, monkeypatch, count, at_once, sums
):
    monkeypatch.setattr(groups, "GROUPS", count)
    monkeypatch.setattr(groups, "ADDED", at_once)
    job = film(client, scene, tmp_path / "passes")
    np.testing.assert_array_equal(picture_of(job), expected)
    assert (job.report.tasks, job.report.groups) == (12, sums)
    assert len(job.report.workers) == 2


def test_an_error_names_frame_pass_and_worker(client, scene, tmp_path):
    frames = [FrameRequest({}, 2, 0), FrameRequest({"format": "nonsense"}, 2, 1)]
    job = film(client, scene, tmp_path / "passes", frames)
    with pytest.raises(DiffractionError, match=r"^frame 1, pass 0, worker tcp://\S+: cannot load"):
        list(job.render(Stop(), silent))
    assert job.report.retries == 0


def test_processors_that_were_mixed_are_named(scene, tmp_path):
    job = film(Recorder(), scene, tmp_path)
    (frame,) = job.frames
    first = run_task(frame.part(Span(0, 1)))
    for n in range(frame.span.count):
        sums = replace(first, where=[f"processor {n % 2}, 1 threads"])
        Kept(tmp_path).write(frame, Span(n, 1), sums)
    words = "mixed.*: processor 0, 1 threads; processor 1, 1 threads"
    with pytest.warns(DiffractionWarning, match=words):
        picture_of(job)


@pytest.mark.filterwarnings("ignore::pytest.PytestUnraisableExceptionWarning")  # of its processes
def test_jobs_of_a_queue_are_workers(scene, expected):
    jobqueue = pytest.importorskip("dask_jobqueue.local")
    with (
        jobqueue.LocalCluster(
            cores=1,
            processes=1,
            memory="2GB",
            scheduler_options={"dashboard_address": "127.0.0.1:0"},
        ) as queue,
        distributed.Client(queue) as mine,
    ):
        queue.scale(1)
        np.testing.assert_array_equal(rendered(mine, scene), expected)


def test_the_command_renders_on_a_cluster(client, scene, expected, run, tmp_path):
    (tmp_path / "id_rsa").write_text("private")
    key = f'<default name="key" value="{tmp_path / "id_rsa"}"/><default name="spp"'
    scene.write_text(SCENE.replace('<default name="spp"', key))
    address = client.scheduler.address
    ran = run(
        "render", scene, "-m", VARIANT, "-s", SPP, "--seed", 3, "--scheduler", address,
        "--threads", 1, "-o", "a.exr", "--json", "a.json",
    ).succeeded()  # fmt: skip
    assert "12 tasks in 12 sums" in ran.out
    assert "workers at http://" in ran.err  # Dask's dashboard
    assert "GB of memory" in ran.err
    assert "files for workers that lack them: room.xml\n" in ran.err
    np.testing.assert_allclose(pixels("a.exr"), expected, atol=1e-3)
    report = json.loads((tmp_path / "a.json").read_text())["workers"]
    assert report["tasks"] == 12
    assert report["bytes"] == 12 * 24 * 16 * 4 * 4  # pixels of four channels in single precision
    assert report["retries"] == 0
    assert 0.0 < report["seconds"]
    assert len(report["where"]) == 1


def test_the_command_renders_frames_on_a_cluster(client, scene, run, monkeypatch):
    monkeypatch.setenv("DASK_SCHEDULER_ADDRESS", client.scheduler.address)
    z = '<default name="z" value="4"/><default name="spp"'
    scene.write_text(SCENE.replace("0,0,4", "0,0,$z").replace('<default name="spp"', z))
    command = ["render", scene, "-m", VARIANT, "-s", 2, "--frames", 3, "--animate", "z=4:6"]
    ran = run(*command).succeeded()
    assert "3 frames, 3 of them new" in ran.out
    assert sorted(p.name for p in Path("room_frames").iterdir()) == [
        f"frame_000{n}.png" for n in range(3)
    ]
    monkeypatch.delenv("DASK_SCHEDULER_ADDRESS")
    assert "0 of them new" in run(*command).out


def test_asked_to_stop_it_gives_nothing(client, scene, tmp_path):
    stop = Stop()
    job = film(client, scene, tmp_path / "passes")
    stop.asked = True
    assert list(job.render(stop, silent)) == []
