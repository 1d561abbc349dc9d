"""Tables of orders solved on workers: killed workers, and clients that were killed."""

from __future__ import annotations

import os
import signal

import pytest

pytest.importorskip("gratinglab")

from mitsuba_diffraction import solve_orders
from mitsuba_diffraction.cli import main
from mitsuba_diffraction.cluster.jobs import WorkerCalls
from mitsuba_diffraction.orders import OrderTable
from mitsuba_diffraction.orders.solve import Settings
from mitsuba_diffraction.orders.solve.jobs import Jobs
from mitsuba_diffraction.orders.solve.profiles import sinusoidal
from tests.support.machine import python
from tests.support.orders import digest_in_file

pytestmark = pytest.mark.thorough

# a perfect conductor has no third variable: some hundred solutions of milliseconds
PROFILE = sinusoidal(0.5, 0.05)
SETTINGS = Settings(wavelengths=(520.0, 640.0), tolerance=0.1, resolution=48)
WORDS = [
    "solve", "sinusoidal", "--period", "0.5", "--depth", "0.05", "--material", "none",
    "--wavelength-range", "520:640", "--tolerance", "0.1", "--resolution", "48",
]  # fmt: skip


@pytest.fixture(scope="module")
def table():
    """The table of one process."""
    return solve_orders(PROFILE, "none", settings=SETTINGS)


def test_a_killed_worker_changes_no_bit(client, table, tmp_path):
    killed = []

    def disturb(done, total, text):
        if text == "solving orders" and done >= 3 and not killed:
            killed.append(next(iter(client.cluster.workers.values())).pid)
            os.kill(killed[0], signal.SIGKILL)

    jobs = Jobs(calls=WorkerCalls(client).finished, progress=disturb)
    on_workers = solve_orders(PROFILE, "none", settings=SETTINGS, jobs=jobs)
    assert killed
    assert digest_in_file(on_workers, tmp_path) == digest_in_file(table, tmp_path)
    client.wait_for_workers(2, timeout=300)


CLIENT = """
import os, signal, sys, threading, time
from pathlib import Path
from mitsuba_diffraction.cli import main

def watch():
    while len(list(Path(".groove.solving").glob("*.solved"))) < {count}:
        time.sleep(0.01)
    os.kill(os.getpid(), signal.{signal})

threading.Thread(target=watch, daemon=True).start()
sys.exit(main({words!r}))
"""


def test_a_client_that_was_killed_and_interrupted_goes_on(client, table, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    words = [*WORDS, "-o", "groove.nc", "--scheduler", client.scheduler.address]
    before = 0
    for name, code in (("SIGKILL", -signal.SIGKILL), ("SIGINT", 130)):
        program = CLIENT.format(count=before + 60, signal=name, words=words)
        ran = python(program)
        assert ran.returncode == code
        assert "Traceback" not in ran.stderr
        before = len(list((tmp_path / ".groove.solving").glob("*.solved")))
        assert not (tmp_path / "groove.nc").exists()
    assert main(words) == 0
    assert [path.name for path in tmp_path.iterdir()] == ["groove.nc"]
    assert OrderTable.load("groove.nc").digest() == digest_in_file(table, tmp_path)
