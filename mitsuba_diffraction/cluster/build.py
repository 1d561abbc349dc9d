"""The table of a wide scan, its windows on workers."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from ..errors import DiffractionError
from ..heights.field import HeightField
from ..progress import Progress
from ..settings import TableSettings
from ..tables.build.build import build_with
from ..tables.table import DiffractionTable
from .each import OrderedMap
from .workers import check_workers


def build(
    heights: HeightField | Sequence[HeightField],
    *,
    client: Any,
    progress: Progress | None = None,
    **settings: Any,
) -> DiffractionTable:
    """Build the table of a wide scan on the workers of a Dask cluster.

    Workers are sent some windows at a time, and send sums of their powers back, which the client
    adds up in the order of the windows: the table is, to the last bit, that of
    `DiffractionTable.build` on such a processor, with any number of workers.

    Parameters
    ----------
    heights : one scan or several.
    client : `distributed.Client`; workers have one Dask thread each (`cluster.connect`).
    progress : called as progress(done, total, text).
    settings : of `DiffractionTable.build`, `windows` among them. A scan that is no wider than a
        window is built here.

    Raises
    ------
    DiffractionError
        If there are no `windows`, a worker is of no use, or the table cannot be built.
    """
    return build_on_workers(heights, TableSettings(**settings), client, progress)[0]


def build_on_workers(
    heights: HeightField | Sequence[HeightField],
    settings: TableSettings,
    client: Any,
    progress: Progress | None = None,
) -> tuple[DiffractionTable, OrderedMap]:
    """`build`, with what it cost."""
    if settings.windows is None:
        raise DiffractionError(
            "workers build tables of windows: set windows=auto (--windows auto), or do without "
            "workers"
        )
    check_workers(client, None)
    run = OrderedMap(client)
    return build_with(heights, settings, progress, run), run
