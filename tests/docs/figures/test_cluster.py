"""The simulation of a cluster: ideal while workers are few, as fast as the client when many."""

from __future__ import annotations

import pytest

from docs.make.figures import cluster, pages
from tests.support import ROOT

COSTS = cluster.Costs(work=10.0, spread=1.0, scheduler=0.001, client=0.1, transfer=0.05)


def test_few_workers_take_their_share_of_the_work():
    for workers in (1, 4):
        found = cluster.simulate(workers, 400, COSTS)
        assert found == pytest.approx(400 * 10.0 / workers, rel=0.03)


def test_many_workers_wait_for_the_client():
    found = cluster.simulate(1000, 4000, COSTS)
    # all that the client takes in one after the other, and the first task before it
    assert 400.0 < found < 400.0 + 20.0


def test_a_slow_scheduler_is_what_breaks_first_then():
    slow = cluster.Costs(work=10.0, spread=1.0, scheduler=0.5, client=0.1, transfer=0.05)
    assert cluster.simulate(1000, 1000, slow) > 500.0


def test_the_page_has_the_places_for_the_figures():
    page = (ROOT / "docs" / "cluster.md").read_text("utf-8")
    for name in ("film", "times", "scaling"):
        assert pages.part(page, name)
