"""Limits on input files, each once, and the checks against them.

A small file may ask for more memory or time than there is: a count in a header, a compressed block
of zeros, a list that repeats itself. Readers check the request before they follow it. SECURITY.md
lists all limits; tests/test_limits.py compares its table with this module.
"""

from __future__ import annotations

import contextlib
import graphlib
import math
import sys
import threading
import zipfile
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import IO

import psutil

from .errors import DiffractionError, unreadable

#: Bytes of a file that is read whole.
LARGEST_FILE = 1 << 32
#: Bytes of a text that is read whole: recipes, layers, spectra and plans are far smaller.
LARGEST_TEXT = 1_000_000
#: Bytes of a CSV of efficiencies: two million lines.
LARGEST_LISTING = 100_000_000
#: Characters of a line in a text of heights.
LONGEST_LINE = 1_000_000
#: Bytes that every file may unpack to. A larger content needs a file of more than one byte for each
#: `MOST_COMPRESSED` bytes: deflate packs zeros 1000 to 1, and measurements less than 10 to 1.
SMALL_CONTENT, MOST_COMPRESSED = 1 << 29, 200
#: Bytes of a text (XML, JSON) within an archive: its tree needs some thirty times as much.
LARGEST_MEMBER_TEXT = 1 << 25
#: Pixels of heights: 16384², 2 GiB.
MOST_PIXELS = 1 << 28
#: Parts of a dotted key in a TOML file; Python's reader takes the square of it in steps.
MOST_KEY_PARTS = 32
#: Patches of a recipe: its sources, or seeds.
MOST_PATCHES = 1000
#: Layers of a stack, repetitions included.
MOST_LAYERS = 1000
#: Numbers in a file of efficiencies, or a table of orders.
MOST_EFFICIENCIES = 1 << 27
#: Elements of a scene within each other: Mitsuba's parser calls itself for each.
DEEPEST_ELEMENT = 100
#: Included files of a scene within each other, as in Mitsuba, and of a scene in all.
DEEPEST_INCLUDE, MOST_INCLUDES = 15, 1000
#: BSDFs and textures that a shape shows, where one that is used twice counts twice.
MOST_NESTED = 1000
#: Placed copies of meshes in a glTF or USD file.
MOST_PLACED = 100_000

# The limit is of the process: readers in several threads take turns
_one_reader = threading.RLock()
# Suffixes of texts within archives
_TEXTS = (".xml", ".json", ".dsc", ".rels", ".txt")


def check_content(claimed: float, size: int, shown: str) -> None:
    """Refuse a file of `size` bytes whose content would take `claimed` bytes.

    shown : the file in the message.

    Raises a DiffractionError if the content is large, and larger than compression explains.
    """
    if not claimed <= max(SMALL_CONTENT, MOST_COMPRESSED * size):  # NaN neither
        raise DiffractionError(
            f"{shown}: {size} bytes claim to hold {claimed:.3g}; a file may hold {SMALL_CONTENT} "
            f"bytes, or {MOST_COMPRESSED} times its size; damaged?"
        )


def check_count(count: float, most: int, shown: str, what: str) -> None:
    """Refuse more than `most` things of a file.

    Raises a DiffractionError with both numbers.
    """
    if not count <= most:
        raise DiffractionError(f"{shown}: {count:.10g} {what}; at most {most} are supported")


def check_archive(path: Path, shown: str) -> None:
    """Refuse a ZIP archive that unpacks to too much; do nothing for other files.

    Readers of ZIP archives stop at the sizes that the archive's directory states.

    Raises a DiffractionError if all members, or a text among them, are too large, or the directory
    is damaged.
    """
    if not zipfile.is_zipfile(path):
        return
    with unreadable(f"{shown} is a damaged ZIP archive"), zipfile.ZipFile(path) as archive:
        members = archive.infolist()
    size = path.stat().st_size
    check_content(sum(member.file_size for member in members), size, shown)
    for member in members:
        if member.filename.lower().endswith(_TEXTS):
            check_count(
                member.file_size, LARGEST_MEMBER_TEXT, shown, f"bytes in {member.filename[:80]!r}"
            )


def bounded_lines(stream: IO[str], shown: str) -> Iterator[str]:
    """Yield the lines of a text.

    Raises a DiffractionError at a line of more than `LONGEST_LINE` characters.
    """
    number = 0
    while line := stream.readline(LONGEST_LINE + 1):
        number += 1
        check_count(len(line), LONGEST_LINE, f"{shown}, line {number}", "characters or more")
        yield line


@contextlib.contextmanager
def bounded_memory(size: int, shown: str) -> Iterator[None]:
    """Let a reader of another package allocate 1 GiB, and 50 times the `size` of its file in bytes.

    This is the net beneath the checks above, for formats that only the package understands. Linux
    alone counts the memory of a process so; elsewhere nothing is bounded.

    Raises a DiffractionError in place of a MemoryError.
    """
    try:
        with _one_reader, _address_space(2 * SMALL_CONTENT + 50 * size):
            yield
    except MemoryError as error:
        raise DiffractionError(
            f"{shown}: {size} bytes claim to hold more than memory; damaged?"
        ) from error


@contextlib.contextmanager
def _address_space(more: int) -> Iterator[None]:
    """Limit the memory that the process maps inside: the present amount, and `more` bytes."""
    if not sys.platform.startswith("linux"):
        yield
        return
    process = psutil.Process()
    before = process.rlimit(psutil.RLIMIT_AS)
    wanted = process.memory_info().vms + more
    # a program's own limit stays
    if before[0] != psutil.RLIM_INFINITY:
        wanted = min(wanted, before[0])
    process.rlimit(psutil.RLIMIT_AS, (wanted, before[1]))
    try:
        yield
    finally:
        process.rlimit(psutil.RLIMIT_AS, before)


def tree_sizes(inner: Sequence[Sequence[int]]) -> list[float]:
    """Return the number of nodes in the tree below each node of a graph, itself included.

    A node that is reached on two ways counts twice. All are infinite in a graph with a circle.

    inner : numbers of the nodes to which each node refers.
    """
    sizes = [math.inf] * len(inner)
    with contextlib.suppress(graphlib.CycleError):
        # those that a node refers to come first
        for number in [*graphlib.TopologicalSorter(dict(enumerate(inner))).static_order()]:
            sizes[number] = 1.0 + sum(sizes[other] for other in inner[number])
    return sizes
