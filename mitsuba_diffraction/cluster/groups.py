"""Groups of passes on workers: submitted ahead, and their sums stored as they come.

A group is a part of a frame's tree of additions, whose sum the client receives. Workers render its
tasks, which are smaller parts, and add up their sums. How passes are grouped changes no bit.
"""

from __future__ import annotations

import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from functools import partial
from typing import Any

from ..errors import DiffractionError, counted
from ..progress import Progress
from ..scene.passes import Span, Stop
from .calls import Contents, UnderWay, submitted
from .kept import Kept
from .tasks import Failed, Sums, Task, add_sums, run_task
from .workers import Headcount

#: Groups of a job, at most, unless it has more frames: a client that is killed loses 1/64 of the
#: work, and 64 sums are little to receive.
GROUPS = 64
#: Tasks of a job for each worker, so that all end within a tenth of the time.
TASKS_A_WORKER = 10
#: Tasks for each worker whose sums have not arrived yet: rendered, waited for, or to be added.
AHEAD = 8
#: Sums that a worker adds at once.
ADDED = 4
_POLL = 0.05  # seconds


@dataclass
class Report:
    """Cost of a run on workers."""

    tasks: int = 0  # that workers did
    groups: int = 0  # sums of passes that came from workers
    kept: int = 0  # sums that had been stored by an earlier run
    # groups that were given out again, since the scheduler or a worker's files were lost; tasks of
    # a worker that died are given to others by the scheduler
    retries: int = 0
    lost: int = 0  # workers that were there and are not any more
    seconds: float = 0.0  # wall time of the client
    busy: float = 0.0  # seconds of all workers' work
    bytes: int = 0  # size of the sums that came from workers
    peak: int = 0  # bytes of memory that a worker has taken at most
    # workers, where: addresses, and processors with threads, of what has been added up
    workers: set[str] = field(default_factory=set)
    where: set[str] = field(default_factory=set)

    def summary(self) -> dict[str, Any]:
        """Return plain data, with the time that a task costs besides its work."""
        plain = {k: sorted(v) if isinstance(v, set) else v for k, v in vars(self).items()}
        count = len(self.workers) or 1
        idle = self.seconds * count - self.busy
        return plain | {"overhead_per_task_s": idle / self.tasks if self.tasks else 0.0}

    def add(self, sums: Sums) -> None:
        """Count a sum that came from workers."""
        self.groups += 1
        self.tasks += sums.tasks
        self.busy += sums.seconds
        self.bytes += sums.raw.nbytes
        self.peak = max(self.peak, sums.peak)
        self.workers.update(sums.workers)


class Stopped(Exception):
    """The command was asked to stop."""


def group_size(passes: int, frames: int) -> int:
    """Return the passes of a group, a power of two; frames may have fewer."""
    return 1 << (-(-passes // max(GROUPS, frames)) - 1).bit_length()


def task_size(passes: int, frames: int, workers: int) -> int:
    """Return the number of passes of a task, a power of two, for a job on these workers."""
    size = max(1, passes // (TASKS_A_WORKER * workers))
    return min(group_size(passes, frames), 1 << size.bit_length() - 1)


def terms_of(span: Span, size: int) -> list[Span]:
    """Cut passes into spans whose sums a worker adds at once, of `size` passes or more."""
    while size * ADDED < span.count:
        size *= ADDED
    return span.pieces(size)


def sums_in_worker(passes: int, frames: int) -> int:
    """Return how many sums a worker holds: of its tree, that it adds, and that are waited for."""
    return group_size(passes, frames).bit_length() + 2 + ADDED + AHEAD


class Groups:
    """Groups of all frames, with workers or stored.

    Parameters
    ----------
    client : `distributed.Client`.
    kept : sums on disk.
    frames : in the order in which their sums are waited for.
    headcount : of the workers.
    report : is added to.
    stop : asked, it ends the wait.
    progress : called as progress(passes done, passes in all, text).
    """

    def __init__(
        self, client: Any, kept: Kept, frames: Sequence[Task], headcount: Headcount,
        report: Report, stop: Stop, progress: Progress,
    ) -> None:  # fmt: skip
        self._client, self._kept, self._frames = client, kept, frames
        self._headcount, self._report, self._stop = headcount, report, stop
        self._progress = progress
        self._under_way = UnderWay[Task](client, report, stop)
        # of each frame: the groups that it is added from, and those that are on disk
        self._spans: list[set[Span]] = []
        self._stored = [kept.spans(frame) for frame in frames]
        self._waiting: list[Task] = []
        self._total = sum(frame.span.count for frame in frames)
        size = group_size(self._total, len(frames))
        for frame, stored in zip(frames, self._stored, strict=True):
            spans = list(_cut(frame.span, size, stored))
            self._spans.append(set(spans))
            self._waiting += [frame.part(span) for span in spans if span not in stored]
            report.kept += len(stored)
        self._waiting.reverse()
        self._left = sum(task.span.count for task in self._waiting)

    def sum_of(self, frame: Task, span: Span) -> Sums | None:
        """Wait for the sum of a group; None for single passes.

        Raises
        ------
        Stopped
            Once asked to.
        DiffractionError
            Naming frame, passes and worker, if a task fails.
        """
        number = frame.frame
        if span not in self._spans[number]:
            return None
        while True:
            if span in self._stored[number]:
                sums = self._kept.read(frame, span)
                if sums is not None:
                    return sums
                self._stored[number].remove(span)
                self._report.kept -= 1
                self._left += span.count
                self._waiting.append(frame.part(span))
            if self._stop.asked:
                raise Stopped
            self._give_out()
            self._take()
            what = f"frame {number + 1} of {len(self._frames)}, " if len(self._frames) > 1 else ""
            text = f"{what}{counted(self._headcount.now(), 'worker')}"
            self._progress(self._total - self._left, self._total, text)
            time.sleep(_POLL)

    def cancel(self) -> None:
        """Cancel tasks whose results nobody waits for."""
        self._under_way.cancel()

    def _give_out(self) -> None:
        workers = max(1, self._headcount.now())
        size = task_size(self._total, len(self._frames), workers)
        while self._waiting and len(self._under_way) < AHEAD * workers:
            group = self._waiting.pop()
            self._under_way.give_out(group, partial(self._submitted, group, size, {}), group.files)

    def _submitted(
        self, group: Task, size: int, tasks: dict[Span, Any], contents: Contents
    ) -> list[Any]:
        """Submit the additions of a group, and the tasks that no worker has or has done.

        tasks : futures of tasks, held until the sum is here: where a worker dies, only what it had
            rendered is rendered again.
        """

        def sum_of(span: Span) -> Any:
            if span.count > size:
                parts = [sum_of(part) for part in terms_of(span, size)]
                # before other tasks: it takes sums out of the workers' memory
                return submitted(self._client, add_sums, parts, priority=1)
            future = tasks.get(span)
            if future is None or future.status not in ("pending", "finished"):
                future = tasks[span] = submitted(
                    self._client, run_task, group.part(span), contents, priority=-group.frame
                )
            return future

        total = sum_of(group.span)
        return [*(future for future in tasks.values() if future is not total), total]

    def _take(self) -> None:
        for group, answer in self._under_way.finished():
            if isinstance(answer, Failed):
                raise DiffractionError(f"{group}, {answer}")
            self._kept.write(self._frames[group.frame], group.span, answer)
            self._stored[group.frame].add(group.span)
            self._left -= group.span.count
            self._report.add(answer)


def _cut(span: Span, size: int, stored: set[Span]) -> Iterator[Span]:
    """Cut passes where the tree branches: into stored spans, and others of `size` at most."""
    within = range(span.first, span.first + span.count)
    if span in stored or (span.count <= size and not any(s.first in within for s in stored)):
        yield span
        return
    for half in span.halves():
        yield from _cut(half, size, stored)
