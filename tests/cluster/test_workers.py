"""Which workers can serve, how they are found, and who can reach them."""

from __future__ import annotations

import os

import distributed
import psutil
import pytest

from mitsuba_diffraction import DiffractionError, DiffractionWarning, cluster
from mitsuba_diffraction.cluster import workers
from tests.cluster.clusters import VARIANT, Recorder, film, rendered
from tests.support.machine import python
from tests.support.systems import posix

pytestmark = pytest.mark.thorough


@pytest.mark.parametrize("number", range(3))
def test_other_versions_are_refused_by_name(number, client, scene, monkeypatch):
    versions = list(workers.versions())
    versions[number] = "0.1"
    monkeypatch.setattr(workers, "versions", lambda: tuple(versions))
    name = ("mitsuba_diffraction", "mitsuba", "drjit")[number]
    words = rf"worker tcp://\S+ is of no use: it has {name} \S+, and the client 0\.1"
    with pytest.raises(DiffractionError, match=words):
        rendered(client, scene)


def test_a_process_without_llvm_says_so_as_a_worker():
    code = (
        "from mitsuba_diffraction.cluster.tasks import called, versions\n"
        "from mitsuba_diffraction.scene import set_variant\n"
        f"called(versions(), set_variant, {VARIANT!r})"
    )
    ran = python(code, DRJIT_LIBLLVM_PATH="/none/libLLVM.so")
    assert 'DRJIT_LIBLLVM_PATH="/none/libLLVM.so": there is no such file' in ran.stderr


def test_workers_with_several_dask_threads_are_refused():
    with pytest.raises(DiffractionError, match="worker one has 2 Dask threads"):
        workers.check_workers(Recorder(nthreads=2), None)


def test_a_worker_that_has_just_gone_is_no_reason_to_refuse():
    leaving = Recorder()
    leaving.run = lambda *_, **__: {"one": None, "gone": distributed.comm.CommClosedError("closed")}
    assert workers.check_workers(leaving, None) == ["one"]


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
    words = r"worker one may use 0\.1 GB, .* estimated to need 0\.5 GB"
    with pytest.warns(DiffractionWarning, match=words):
        job = film(Recorder(memory_limit=1e8), scene, tmp_path)
    assert job.needed > 5e8


@posix
def test_workers_are_out_of_the_terminal_s_reach(client):
    assert os.getsid(0) not in client.run(os.getsid, 0).values()


def test_pages_of_workers_are_for_this_machine_alone(client):
    for address in (client.scheduler_info()["address"], client.dashboard_link):
        assert "//127.0.0.1:" in address
    assert _listening(os.getpid()) <= {"127.0.0.1"}
    for worker in client.cluster.workers.values():
        assert _listening(worker.pid) <= {"127.0.0.1"}


def _listening(process: int) -> set[str]:
    """Addresses of IPv4 and IPv6 at which a process listens."""
    every = psutil.net_connections("inet")
    return {c.laddr.ip for c in every if c.pid == process and c.status == psutil.CONN_LISTEN}
