"""Simulation of a job on many workers, with the groups, tasks and additions of `cluster.groups`.

The scheduler and the client do one thing at a time, a worker one task or addition. A free worker
takes the next task of all; additions go first. An addition runs where one of its sums lies, on the
worker that is free first, after the other sums have come through its network.
"""

from __future__ import annotations

import heapq
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from mitsuba_diffraction.cluster.groups import AHEAD, group_size, task_size, terms_of
from mitsuba_diffraction.scene.passes import Span, samples_per_pass


@dataclass(frozen=True)
class Costs:
    """Seconds of what is done for a job."""

    sample: float  # of a worker, for a sample of a pixel
    spread: float  # relative standard deviation of a task
    load: float  # of a worker, for the scene of a frame that is not the one before
    scheduler: float  # of the scheduler, for a task or an addition
    client: float  # of the client, to write, read and add a byte of a sum
    addition: float  # of a worker, to add a byte of a sum to another
    network: float  # of a connection, for a byte


@dataclass(frozen=True)
class Job:
    """Frames of equal size."""

    frames: int
    width: int
    height: int
    spp: int

    @property
    def bytes(self) -> int:
        """Size of a sum: four channels in single precision."""
        return 16 * self.width * self.height

    @property
    def pass_spp(self) -> int:
        """Samples per pixel of a pass."""
        return samples_per_pass(self.spp, self.width * self.height, "llvm")

    @property
    def passes(self) -> int:
        """Passes of a frame."""
        return -(-self.spp // self.pass_spp)

    def work(self, costs: Costs) -> float:
        """Return the seconds of one worker that only renders."""
        return self.frames * self.width * self.height * self.spp * costs.sample


@dataclass
class _Sum:
    """Sum of passes: of a task, or added from others."""

    frame: int
    span: Span
    parent: _Sum | None
    tasks: int = 0  # of a group
    missing: int = 0
    holders: list[int] = field(default_factory=list)


class Simulation:
    """A job on a cluster; `seconds()` runs it."""

    def __init__(self, job: Job, workers: int, costs: Costs) -> None:
        self.job, self.costs = job, costs
        self._random = np.random.default_rng(0)
        self._events: list[tuple[float, int, Callable[..., None], tuple[Any, ...]]] = []
        self._number = 0
        passes = job.frames * job.passes
        group = group_size(passes, job.frames)
        self._size = task_size(passes, job.frames, workers)
        self._waiting = deque(
            (frame, span)
            for frame in range(job.frames)
            for span in Span(0, job.passes).pieces(group)
        )
        self._most, self._under_way = AHEAD * workers, 0
        self._scheduler = self._client = 0.0
        self._tasks: deque[_Sum] = deque()
        self._additions: list[deque[_Sum]] = [deque() for _ in range(workers)]
        self._idle = dict.fromkeys(range(workers))
        self._ends, self._loaded = [0.0] * workers, [-1] * workers
        self._network = [0.0] * workers

    def seconds(self) -> float:
        """Return when the client has added the last sum."""
        self._give_out(0.0)
        while self._events:
            now, _, call, arguments = heapq.heappop(self._events)
            call(now, *arguments)
        return self._client

    def _at(self, time: float, call: Callable[..., None], *arguments: Any) -> None:
        self._number += 1
        heapq.heappush(self._events, (time, self._number, call, arguments))

    def _scheduled(self, now: float) -> float:
        self._scheduler = max(self._scheduler, now) + self.costs.scheduler
        return self._scheduler

    def _give_out(self, now: float) -> None:
        while self._waiting and self._under_way < self._most:
            frame, span = self._waiting.popleft()
            tasks = self._tree(frame, span, None)
            group = tasks[0]
            while group.parent is not None:
                group = group.parent
            group.tasks = len(tasks)
            self._under_way += len(tasks)
            for task in tasks:
                self._at(self._scheduled(now), self._task_comes, task)

    def _tree(self, frame: int, span: Span, parent: _Sum | None) -> list[_Sum]:
        """Return the tasks below a sum."""
        node = _Sum(frame, span, parent)
        if span.count <= self._size:
            return [node]
        parts = terms_of(span, self._size)
        node.missing = len(parts)
        return [task for part in parts for task in self._tree(frame, part, node)]

    def _task_comes(self, now: float, task: _Sum) -> None:
        self._tasks.append(task)
        if self._idle:
            self._next(now, self._idle.popitem()[0])

    def _next(self, now: float, worker: int) -> None:
        """Start what a free worker does next."""
        if self._additions[worker]:
            node = self._additions[worker].popleft()
            seconds = (len(node.holders) - 1) * self.costs.addition * self.job.bytes
        elif self._tasks:
            node = self._tasks.popleft()
            samples = node.span.count * self.job.pass_spp * self.job.width * self.job.height
            seconds = samples * self.costs.sample
            seconds *= max(0.1, self._random.normal(1.0, self.costs.spread))
            if self._loaded[worker] != node.frame:
                self._loaded[worker] = node.frame
                seconds += self.costs.load
        else:
            self._idle[worker] = None
            return
        self._ends[worker] = now + seconds
        self._at(now + seconds, self._finished, worker, node)

    def _finished(self, now: float, worker: int, node: _Sum) -> None:
        size = self.job.bytes
        if node.parent is None:
            seconds = size * max(self.costs.client, self.costs.network)
            self._client = max(self._client, now) + seconds
            self._at(self._client, self._received, node)
        else:
            addition = node.parent
            addition.holders.append(worker)
            addition.missing -= 1
            if addition.missing == 0:
                where = min(addition.holders, key=self._ends.__getitem__)
                start = max(self._scheduled(now), self._network[where])
                others = len([holder for holder in addition.holders if holder != where])
                self._network[where] = start + others * size * self.costs.network
                self._at(self._network[where], self._addition_comes, where, addition)
        self._next(now, worker)

    def _addition_comes(self, now: float, worker: int, node: _Sum) -> None:
        self._additions[worker].append(node)
        if worker in self._idle:
            del self._idle[worker]
            self._next(now, worker)

    def _received(self, now: float, group: _Sum) -> None:
        self._under_way -= group.tasks
        self._give_out(now)
