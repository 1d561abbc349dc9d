"""Groups of passes on workers: submitted ahead, and their sums stored as they come.

A group is a part of a frame's tree of additions, whose sum the client receives. Workers render its
tasks, which are smaller parts, and add up their sums. How passes are grouped changes no bit.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from functools import partial
from typing import Any

from ..errors import DiffractionError, counted
from ..progress import Progress
from ..scene.passes import Span, Stop
from .calls import Contents, Report, UnderWay, submitted
from .kept import Kept
from .tasks import Failed, Sums, Task, add_sums, run_task

#: Groups of a job, at most, unless it has more frames: a client that is killed loses 1/64 of the
#: work, and 64 sums are little to receive.
GROUPS = 64
#: Tasks of a job for each worker, so that all end within a tenth of the time.
TASKS_A_WORKER = 10
#: Tasks for each worker whose sums have not arrived yet: rendered, waited for, or to be added.
AHEAD = 8
#: Sums that a worker adds at once.
ADDED = 4


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
    report : is added to.
    stop : asked, it ends the wait.
    progress : called as progress(passes done, passes in all, text).
    """

    def __init__(
        self, client: Any, kept: Kept, frames: Sequence[Task], report: Report, stop: Stop,
        progress: Progress,
    ) -> None:  # fmt: skip
        self._client, self._kept, self._frames = client, kept, frames
        self._report, self._stop, self._progress = report, stop, progress
        self.under_way = UnderWay[Task](client, report)
        self._total = sum(frame.span.count for frame in frames)
        size = group_size(self._total, len(frames))
        # whether a group is on disk, by the number of its frame and its passes
        self._stored: dict[tuple[int, Span], bool] = {}
        self._waiting: list[Task] = []
        for frame in reversed(frames):
            stored = kept.spans(frame)
            spans = list(_cut(frame.span, size, stored))
            self._stored |= {(frame.frame, span): span in stored for span in spans}
            self._waiting += [frame.part(span) for span in reversed(spans) if span not in stored]
        report.kept = sum(self._stored.values())

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
        if (number, span) not in self._stored:
            return None
        while True:
            if self._stored[number, span]:
                sums = self._kept.read(frame, span)
                if sums is not None:
                    return sums
                self._stored[number, span] = False
                self._report.kept -= 1
                self._waiting.append(frame.part(span))
            if self._stop.asked:
                raise Stopped
            self._give_out()
            self._take()
            what = f"frame {number + 1} of {len(self._frames)}, " if len(self._frames) > 1 else ""
            text = f"{what}{counted(self.under_way.workers(), 'worker')}"
            done = sum(span.count for (_, span), stored in self._stored.items() if stored)
            self._progress(done, self._total, text)

    def _give_out(self) -> None:
        workers = max(1, self.under_way.workers())
        size = task_size(self._total, len(self._frames), workers)
        while self._waiting and len(self.under_way) < AHEAD * workers:
            group = self._waiting.pop()
            self.under_way.give_out(group, partial(self._submitted, group, size, {}), group.files)

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
        for group, answer in self.under_way.finished():
            if isinstance(answer, Failed):
                raise DiffractionError(f"{group}, {answer}")
            self._kept.write(self._frames[group.frame], group.span, answer)
            self._stored[group.frame, group.span] = True
            self._report.add(answer)


def _cut(span: Span, size: int, stored: set[Span]) -> Iterator[Span]:
    """Cut passes where the tree branches: into stored spans, and others of `size` at most."""
    within = range(span.first, span.first + span.count)
    if span in stored or (span.count <= size and not any(s.first in within for s in stored)):
        yield span
        return
    for half in span.halves():
        yield from _cut(half, size, stored)
