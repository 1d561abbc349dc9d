"""The simulation of a cluster: ideal while workers are few; what limits many of them."""

from __future__ import annotations

from dataclasses import replace

import pytest

from docs.make.figures.cluster_simulation import Costs, Job, Simulation

#: Passes of 2 s.
COSTS = Costs(
    sample=1e-6, spread=0.1, load=0.0, scheduler=0.001, client=1e-9, addition=1e-9, network=1e-8
)
FILM, STILL = Job(100, 1024, 512, 256), Job(1, 1024, 1024, 8192)


@pytest.mark.parametrize("job", [FILM, STILL])
@pytest.mark.parametrize("workers", [1, 4])
def test_few_workers_take_their_share_of_the_work(job, workers):
    seconds = Simulation(job, workers, COSTS).seconds()
    # tasks are a tenth of a worker's work at most, and vary by a tenth
    assert seconds == pytest.approx(job.work(COSTS) / workers, rel=0.06)


def test_every_sum_passes_the_clients_network():
    slow = replace(COSTS, network=1e-6)
    seconds = Simulation(FILM, 1000, slow).seconds()
    assert seconds > FILM.frames * FILM.bytes * slow.network
    assert seconds < 1.2 * FILM.frames * FILM.bytes * slow.network


def test_the_scheduler_takes_one_task_after_the_other():
    slow = replace(COSTS, scheduler=0.5)
    # passes are tasks: 64 in each frame, and additions of four at a time
    assert Simulation(FILM, 1000, slow).seconds() > 100 * (64 + 16 + 4 + 1) * 0.5


def test_additions_wait_for_the_network_of_workers():
    fast, slow = (
        Simulation(STILL, 500, replace(COSTS, network=network)).seconds()
        for network in (1e-12, 1e-7)
    )
    assert slow > fast + STILL.bytes * 1e-7 * 3  # three sums come to the last addition at least
