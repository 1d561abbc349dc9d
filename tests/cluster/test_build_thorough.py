"""Windows of a wide scan on workers of which one is killed: the same table, to the last bit."""

from __future__ import annotations

import os
import signal

import pytest

pytestmark = pytest.mark.thorough

pytest.importorskip("distributed")

from mitsuba_diffraction import DiffractionTable, HeightField  # noqa: E402
from mitsuba_diffraction.cluster.jobs import build_on_workers  # noqa: E402
from mitsuba_diffraction.settings import TableSettings  # noqa: E402
from tests.support.scans import PIXEL, SETTINGS, rough  # noqa: E402


def test_two_workers_of_which_one_is_killed_build_the_same_table(client):
    scan, wanted = HeightField(rough(300), PIXEL, name="scan", cut_out=True), SETTINGS
    killed = []

    def disturb(done, total, text):
        if done >= 10 and not killed:
            killed.append(next(iter(client.cluster.workers.values())).pid)
            os.kill(killed[0], signal.SIGKILL)

    table, work = build_on_workers(scan, TableSettings(**wanted), client, disturb)
    assert killed
    alone = DiffractionTable.build(scan, **wanted)
    assert table.digest() == alone.digest()
    assert table.error == alone.error
    assert table.source == alone.source
    assert work.tasks > 10
    client.wait_for_workers(2, timeout=300)
