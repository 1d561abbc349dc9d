"""Rendering on workers, real processes: bit for bit one process, whatever happens to them."""

from __future__ import annotations

import contextlib
import json
import os
import re
import signal
import socket
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import drjit as dr
import numpy as np
import pytest

pytestmark = pytest.mark.thorough

distributed = pytest.importorskip("distributed")

from mitsuba_diffraction import DiffractionError, cluster  # noqa: E402
from mitsuba_diffraction.cluster import frames as frames_module  # noqa: E402
from mitsuba_diffraction.cluster import workers as workers_module  # noqa: E402
from mitsuba_diffraction.cluster.frames import Film, FrameRequest, Kept  # noqa: E402
from mitsuba_diffraction.cluster.tasks import MissingFiles, run_task  # noqa: E402
from mitsuba_diffraction.scene import passes  # noqa: E402
from mitsuba_diffraction.scene.load import load_scene, set_variant  # noqa: E402
from tests.support import ROOT  # noqa: E402
from tests.support.room import SCENE, pixels  # noqa: E402

VARIANT = "llvm_ad_rgb"
SPP = 24


@pytest.fixture(autouse=True)
def small_tasks(monkeypatch):
    """Two samples a pass and one pass a task: 12 tasks."""
    monkeypatch.setattr(passes, "_SAMPLES", {"llvm": 2 * 24 * 16})
    monkeypatch.setattr(passes, "GROUP", 1)


@pytest.fixture(autouse=True)
def own_threads():
    """What a test does to Dr.Jit's threads is undone: with one, Mitsuba's EXR writer waits."""
    before = dr.thread_count()
    yield
    dr.set_thread_count(before)


@pytest.fixture
def scene(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "room.xml").write_text(SCENE)
    return tmp_path / "room.xml"


@pytest.fixture
def expected(scene):
    """The picture of one process with one thread."""
    set_variant(VARIANT)
    before = dr.thread_count()
    dr.set_thread_count(1)
    loaded = load_scene(scene, {})
    result = passes.render_passes(
        loaded, loaded.sensors()[0], spp=SPP, seed=3, variant=VARIANT, stop=passes.Stop(),
        progress=lambda *_: None,
    )  # fmt: skip
    dr.set_thread_count(before)
    return np.array(result.bitmap)


def rendered(client, scene, **more):
    arguments = {"spp": SPP, "seed": 3, "variant": VARIANT, "threads": 1, **more}
    return cluster.render(scene, client=client, **arguments)


def film(client, scene, frames, keep, **more):
    set_variant(VARIANT)
    return Film(client, scene, frames, VARIANT, keep=keep, warn=pytest.fail, threads=1, **more)


def test_workers_give_the_picture_of_one_process(client, scene, expected):
    result = rendered(client, scene)
    assert result.spp == SPP
    np.testing.assert_array_equal(np.array(result.bitmap), expected)


def test_a_killed_worker_and_late_ones_change_nothing(client, scene, expected):
    happened = []

    def disturb(done, total, text):
        if done >= 2 and not happened:
            happened.append(text)
            victim = next(iter(client.cluster.workers.values()))
            os.kill(victim.pid, signal.SIGKILL)
            client.cluster.scale(4)

    result = rendered(client, scene, progress=disturb)
    assert happened
    np.testing.assert_array_equal(np.array(result.bitmap), expected)
    client.wait_for_workers(4, timeout=300)
    np.testing.assert_array_equal(np.array(rendered(client, scene).bitmap), expected)
    client.cluster.scale(2)


def test_a_client_that_was_stopped_goes_on(client, scene, expected, tmp_path):
    keep = tmp_path / "passes"

    def interrupt(done, total, text):
        if done >= 4:
            signal.raise_signal(signal.SIGINT)

    with pytest.raises(DiffractionError, match="interrupted"):
        rendered(client, scene, keep=keep, progress=interrupt)
    there = len(list(keep.iterdir()))
    assert 4 <= there < 12
    again = film(client, scene, [FrameRequest({}, SPP, 3)], keep)
    (result,) = again.render(passes.Stop(), lambda *_: None)
    assert again.report.kept == there
    assert again.report.tasks == 12 - there
    np.testing.assert_array_equal(np.array(result.bitmap), expected)
    again.forget(0)
    assert not keep.exists()


@pytest.fixture
def start():
    """`start(command, *arguments)`: a scheduler or worker as a user starts it, of its own."""
    running = []

    def call(command, *arguments):
        path = os.pathsep.join([str(ROOT), os.environ.get("PYTHONPATH", "")])
        running.append(
            subprocess.Popen(
                [sys.executable, "-m", f"distributed.cli.dask_{command}", *arguments],
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
    monkeypatch.setattr(frames_module, "_COUNTED", 0.0)  # or a quick restart would not be seen
    monkeypatch.setattr(workers_module, "_PATIENCE", 300.0)  # of a busy machine
    port = free_port()
    address = f"tcp://127.0.0.1:{port}"

    def start_all():
        scheduler = start("scheduler", "--host", "127.0.0.1", "--port", str(port), "--no-dashboard")
        worker = start("worker", address, "--nthreads", "1", "--no-nanny", "--no-dashboard")
        return scheduler, worker

    first = start_all()
    killed = []

    def disturb(done, total, text):
        if done >= 4 and not killed:
            for process in first:
                process.kill()
                process.wait()
            killed.extend((tmp_path / "passes").iterdir())
            start_all()

    with cluster.connect(scheduler=address, patience=300) as mine:
        job = film(mine, scene, [FrameRequest({}, SPP, 3)], tmp_path / "passes")
        (result,) = job.render(passes.Stop(), disturb)
    np.testing.assert_array_equal(np.array(result.bitmap), expected)
    assert len(killed) >= 4
    # none of those that were kept a second time; whether one was under way is chance
    assert job.report.tasks == 12
    assert job.report.lost == 1


def test_files_that_a_worker_lacks_come_by_content(client, scene, expected, monkeypatch):
    def without_files(task, contents=None):
        return run_task(task) if contents else MissingFiles((task.files.files[0][1],))

    monkeypatch.setattr(frames_module, "run_task", without_files)
    job = film(client, scene, [FrameRequest({}, SPP, 3)], scene.parent / "passes")
    (result,) = job.render(passes.Stop(), lambda *_: None)
    np.testing.assert_array_equal(np.array(result.bitmap), expected)
    assert job.report.tasks == job.report.retries == 12


def test_a_copy_of_a_scene_is_the_scene(scene, expected, monkeypatch, tmp_path):
    (tmp_path / "part.xml").write_text('<scene version="3.0.0"/>')
    scene.write_text(SCENE.replace("</scene>", '<include filename="part.xml"/></scene>'))
    task = _Recorder.first_task(scene)
    contents = {digest: Path(path).read_bytes() for path, digest in task.files.files}
    assert len(contents) == 2
    scene.rename(tmp_path / "elsewhere.xml")
    (tmp_path / "part.xml").unlink()
    assert run_task(task) == MissingFiles(tuple(sorted(contents)))
    found = run_task(task, contents)
    assert found.raw.shape[:2] == expected.shape[:2]


class _Recorder:
    """A client of one worker that is given nothing."""

    status = "running"

    def __init__(self, **about):
        self.about = {"nthreads": 1, **about}

    def wait_for_workers(self, *_, **__):
        pass

    def run(self, *_, **__):
        return {"one": None}

    def scheduler_info(self, **_):
        return {"workers": {"one": self.about}}

    @classmethod
    def first_task(cls, scene):
        return film(cls(), scene, [FrameRequest({}, SPP, 3)], scene.parent)._frames[0][0]


def test_an_error_names_frame_pass_and_worker(client, scene, tmp_path):
    frames = [FrameRequest({}, 2, 0), FrameRequest({"format": "nonsense"}, 2, 1)]
    job = film(client, scene, frames, tmp_path / "passes")
    with pytest.raises(DiffractionError, match=r"^frame 1, pass 0, worker tcp://\S+: cannot load"):
        list(job.render(passes.Stop(), lambda *_: None))
    assert job.report.retries == 0


@pytest.mark.parametrize("number", range(3))
def test_other_versions_are_refused_by_name(number, client, scene, monkeypatch):
    versions = list(workers_module.versions())
    versions[number] = "0.1"
    monkeypatch.setattr(workers_module, "versions", lambda: tuple(versions))
    name = ("mitsuba_diffraction", "mitsuba", "drjit")[number]
    words = rf"worker tcp://\S+ is of no use: it has {name} \S+, and the client 0\.1"
    with pytest.raises(DiffractionError, match=words):
        rendered(client, scene)


def test_a_process_without_llvm_says_so_as_a_worker():
    code = (
        "from mitsuba_diffraction.cluster.workers import _trouble, versions\n"
        f"print(_trouble(versions(), {VARIANT!r}))"
    )
    variables = {**os.environ, "PYTHONPATH": str(ROOT), "DRJIT_LIBLLVM_PATH": "/none/libLLVM.so"}
    ran = subprocess.run(
        [sys.executable, "-c", code], env=variables, capture_output=True, text=True, check=True
    )
    assert ran.stdout.startswith('DRJIT_LIBLLVM_PATH="/none/libLLVM.so": there is no such file')


def test_workers_with_several_dask_threads_are_refused(scene):
    with (
        distributed.LocalCluster(
            n_workers=1,
            threads_per_worker=2,
            processes=False,
            dashboard_address="127.0.0.1:0",
            protocol="tcp://",
            host="127.0.0.1",
        ) as local,
        distributed.Client(local) as mine,
        pytest.raises(DiffractionError, match="has 2 Dask threads"),
    ):
        rendered(mine, scene)


def test_a_worker_that_has_just_gone_is_no_reason_to_refuse():
    leaving = _Recorder()
    leaving.run = lambda *_, **__: {"one": None, "gone": distributed.comm.CommClosedError("closed")}
    assert workers_module.check_workers(leaving, None) == ["one"]


def test_no_scheduler_is_one_line():
    with (
        pytest.raises(DiffractionError, match=r"no scheduler answers at 'tcp://127\.0\.0\.1:1'"),
        cluster.connect(scheduler="tcp://127.0.0.1:1", patience=1),
    ):
        pass


def test_a_scheduler_file_stands_for_the_address(client, tmp_path):
    client.write_scheduler_file(str(tmp_path / "scheduler.json"))
    with cluster.connect(scheduler=str(tmp_path / "scheduler.json")) as mine:
        assert mine.scheduler.address == client.scheduler.address


def test_workers_with_too_little_memory_are_named(scene, tmp_path):
    lines = []
    small = _Recorder(memory_limit=1e8)
    set_variant(VARIANT)
    job = Film(small, scene, [FrameRequest({}, SPP, 3)], VARIANT, keep=tmp_path, warn=lines.append)
    assert job.needed > 5e8
    (line,) = lines
    assert re.search(r"worker one may use 0\.1 GB, .* estimated to need 0\.5 GB", line)


def test_processors_that_were_mixed_are_named(scene, tmp_path):
    lines = []
    set_variant(VARIANT)
    job = Film(
        _Recorder(), scene, [FrameRequest({}, SPP, 3)], VARIANT, keep=tmp_path, warn=lines.append
    )
    first = run_task(job._frames[0][0])
    for n, task in enumerate(job._frames[0]):
        Kept(tmp_path).write(task, replace(first, where=f"processor {n % 2}, 1 threads"))
    (result,) = job.render(passes.Stop(), lambda *_: None)
    assert result.spp == SPP
    (line,) = lines
    assert "mixed" in line
    assert "processor 0, 1 threads; processor 1, 1 threads" in line


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
        np.testing.assert_array_equal(np.array(rendered(mine, scene).bitmap), expected)


def cut(content: bytes) -> bytes:
    return content[:-100]


def times_50(content: bytes) -> bytes:
    return content[:-4096] + (50 * np.frombuffer(content[-4096:], np.float64)).tobytes()


def not_a_number(content: bytes) -> bytes:
    return content[:-4096] + np.full(512, np.nan).tobytes()


@pytest.mark.parametrize("damage", [cut, times_50, not_a_number])
def test_damaged_sums_are_rendered_again(scene, tmp_path, damage):
    task, said = _Recorder.first_task(scene), []
    kept, sums = Kept(tmp_path / "passes", said.append), run_task(task)
    assert kept.write(task, sums)
    assert np.array_equal(kept.read(task).raw, sums.raw)
    (file,) = (tmp_path / "passes").iterdir()
    file.write_bytes(damage(file.read_bytes()))
    assert kept.read(task) is None
    assert task not in kept
    (line,) = said
    assert str(file) in line


def test_sums_under_the_name_of_others_are_rendered_again(scene, tmp_path):
    first, second = film(_Recorder(), scene, [FrameRequest({}, SPP, 3)], tmp_path)._frames[0][:2]
    kept = Kept(tmp_path / "passes", lambda _: None)
    kept.write(first, run_task(first))
    (file,) = (tmp_path / "passes").iterdir()
    file.rename(file.with_name(f"{second.key[:32]}{file.suffix}"))
    assert kept.read(second) is None


def test_sums_that_are_not_finite_are_not_kept(scene, tmp_path):
    task = _Recorder.first_task(scene)
    sums = run_task(task)
    raw = np.where(np.arange(sums.raw.size).reshape(sums.raw.shape) == 7, np.inf, sums.raw)
    kept = Kept(tmp_path / "passes")
    assert not kept.write(task, replace(sums, raw=raw))
    assert task not in kept


def test_pages_of_workers_are_for_this_machine_alone(client):
    for address in (client.scheduler_info()["address"], client.dashboard_link):
        assert "//127.0.0.1:" in address
    assert _listening(os.getpid()) <= {"0100007F"}  # in hexadecimal: 127.0.0.1
    for worker in client.cluster.workers.values():
        assert _listening(worker.pid) <= {"0100007F"}


def _listening(process: int) -> set[str]:
    """Addresses of IPv4 and IPv6 at which a process listens, as /proc has them."""
    sockets = set()
    for link in Path(f"/proc/{process}/fd").iterdir():
        with contextlib.suppress(OSError):
            sockets.add(os.readlink(link))
    found = set()
    for table in ("tcp", "tcp6"):
        for line in Path(f"/proc/{process}/net/{table}").read_text().splitlines()[1:]:
            fields = line.split()
            if fields[3] == "0A" and f"socket:[{fields[9]}]" in sockets:
                found.add(fields[1].partition(":")[0])
    return found


def test_the_command_renders_on_a_cluster(client, scene, expected, run, tmp_path):
    address = client.scheduler.address
    ran = run(
        "render", scene, "-m", VARIANT, "-s", SPP, "--seed", 3, "--scheduler", address,
        "--threads", 1, "-o", "a.exr", "--json", "a.json",
    )  # fmt: skip
    assert ran.code == 0, ran
    assert "12 tasks" in ran.out
    assert "workers at http://" in ran.err  # Dask's dashboard
    assert "GB of memory" in ran.err
    np.testing.assert_allclose(pixels("a.exr"), expected, atol=1e-3)
    report = json.loads((tmp_path / "a.json").read_text())["workers"]
    assert report["tasks"] == 12
    assert report["bytes"] == 12 * 24 * 16 * 4 * 8  # pixels of four channels in double precision
    assert report["retries"] == 0
    assert 0.0 < report["seconds"]
    assert len(report["where"]) == 1


def test_the_command_renders_frames_on_a_cluster(client, scene, run, monkeypatch):
    monkeypatch.setenv("DASK_SCHEDULER_ADDRESS", client.scheduler.address)
    z = '<default name="z" value="4"/><default name="spp"'
    scene.write_text(SCENE.replace("0,0,4", "0,0,$z").replace('<default name="spp"', z))
    command = ["render", scene, "-m", VARIANT, "-s", 2, "--frames", 3, "--animate", "z=4:6"]
    ran = run(*command)
    assert ran.code == 0, ran
    assert "3 frames, 3 of them new" in ran.out
    assert sorted(p.name for p in Path("room_frames").iterdir()) == [
        f"frame_000{n}.png" for n in range(3)
    ]
    monkeypatch.delenv("DASK_SCHEDULER_ADDRESS")
    assert "0 of them new" in run(*command).out


def test_asked_to_stop_it_gives_nothing(client, scene, tmp_path):
    stop = passes.Stop()
    job = film(client, scene, [FrameRequest({}, SPP, 3)], tmp_path / "passes")
    stop.asked = True
    assert list(job.render(stop, lambda *_: None)) == []
