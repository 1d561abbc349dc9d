"""Work of a worker: render and add up passes of one frame; add sums of other workers.

Scene files are identified by content: used in place, or copied to workers that lack them.
"""

from __future__ import annotations

import atexit
import os
import shutil
import tempfile
import time
import warnings
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, lru_cache
from importlib.metadata import version
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..atomic import atomic_path, make_folder
from ..digests import key_of, sha256_of
from ..errors import DiffractionError, counted, one_line
from ..scene.load import load_scene, sensor_of, set_variant
from ..scene.parameters import files_of
from ..scene.passes import Pass, Span, added, integrator_of, render_pass
from ..system import cores, peak_memory, processor
from ..tables.store import cache_folder

_PACKAGES = ("mitsuba_diffraction", "mitsuba", "drjit")


@dataclass(frozen=True)
class Task:
    """Passes of one frame, a part of the frame's tree of additions."""

    files: SceneFiles  # the scene
    # variant, sensor, preview: as in `cluster.render`
    variant: str
    sensor: int
    preview: bool
    film: str  # the client's film, see `film_of`
    frame: int  # number of the frame
    span: Span  # numbers of the passes
    passes: tuple[Pass, ...]  # seeds and samples of the span
    threads: int  # threads of Dr.Jit; 0 for one a core

    def part(self, span: Span) -> Task:
        """Return the task of a part of the passes."""
        start = span.first - self.span.first
        return replace(self, span=span, passes=self.passes[start : start + span.count])

    @cached_property
    def key(self) -> str:
        """Key of the sum: all that decides it, except the threads and processor that add it up."""
        passes = [(render.seed, render.spp) for render in self.passes]
        what = (self.files.digest, self.variant, self.sensor, self.preview, self.film, passes)
        return key_of("sum of passes", *what, versions())

    def __str__(self) -> str:
        return f"frame {self.frame}, {self.span}"


@dataclass(frozen=True)
class Sums:
    """Sum of the films of passes, and its cost."""

    raw: NDArray[np.floating[Any]]  # (ny, nx, channels), the films' raw storage
    where: Sequence[str]  # processors and Dr.Jit threads, which decide the last bits
    workers: Sequence[str]  # addresses
    tasks: int  # number of tasks that were added up
    seconds: float  # time of all their work, loading included
    peak: int  # bytes of a process at most

    def __add__(self, other: Sums) -> Sums:
        """Add the sum of the passes that follow in the tree."""
        return Sums(
            self.raw + other.raw,
            tuple(sorted({*self.where, *other.where})),
            tuple(sorted({*self.workers, *other.workers})),
            self.tasks + other.tasks,
            self.seconds + other.seconds,
            max(self.peak, other.peak),
        )

    def __sizeof__(self) -> int:
        """Return the number of bytes, which Dask weighs when it chooses where to add sums."""
        return self.raw.nbytes


class MissingFiles(Exception):
    """Files that a worker lacks, by their digests."""

    def __init__(self, digests: Sequence[str]) -> None:
        super().__init__(digests)  # Dask pickles exceptions by their arguments
        self.digests = digests


class Failed(Exception):
    """Error of a task in one line, and the worker's address."""

    def __init__(self, text: str, worker: str) -> None:
        super().__init__(text, worker)
        self.text, self.worker = text, worker

    def __str__(self) -> str:
        return f"worker {self.worker}: {self.text}"


def versions() -> tuple[str, ...]:
    """Return the versions of the packages that decide the bits of a picture."""
    return tuple(version(name) for name in _PACKAGES)


def run_task(task: Task, contents: Mapping[str, bytes] | None = None) -> Sums:
    """Render and add up passes in this process.

    contents : content of files that are missing here, by digest; raises `MissingFiles` if more are.
    """
    start = time.perf_counter()
    task.files.require(contents or {})
    threads = task.threads or cores()
    set_variant(task.variant, threads)  # per process and thread: mitsuba3 #1685

    def sum_of(span: Span) -> Any:
        if span.count > 1:
            return None
        return render_pass(scene, sensor, task.passes[span.first - task.span.first])

    # the client has loaded the scene, and said them
    with warnings.catch_warnings(action="ignore"):
        scene, sensor = loaded_scene(task.files, task.variant, task.sensor, task.preview)
        if film_of(scene, sensor) != task.film:
            raise DiffractionError(
                "its film is not that of frame 0; parameters that change the film's size or "
                "format take one process, or a run for each"
            )
        total = added(task.span, sum_of)
    peak = peak_memory()
    where = f"{processor()}, {counted(threads, 'thread')}"
    return Sums(total, (where,), (worker_address(),), 1, time.perf_counter() - start, peak)


def add_sums(sums: Sequence[Sums]) -> Sums:
    """Add sums of spans that follow one another and are of one size, except the last."""
    whole = Span(0, len(sums))
    return added(whole, lambda span: sums[span.first] if span.count == 1 else None)


def called(wanted: tuple[str, ...], work: Callable[..., Any], *given: Any) -> Any:
    """Call a function on a worker, late ones included, which nobody has checked.

    wanted : `versions` of the client.

    Raises
    ------
    MissingFiles
        If the call does.
    Failed
        After any other error, in one line.
    """
    try:
        for name, here, there in zip(_PACKAGES, versions(), wanted, strict=True):
            if here != there:
                raise DiffractionError(
                    f"it has {name} {here}, and the client {there}: pictures of both need not "
                    "agree; install the same version on both"
                )
        return work(*given)
    except MissingFiles:
        raise
    except DiffractionError as error:
        raise Failed(str(error), worker_address()) from None
    except Exception as error:
        text = f"unexpected {type(error).__name__}: {one_line(str(error))}"
        raise Failed(text, worker_address()) from None


@lru_cache(1)
def loaded_scene(files: SceneFiles, variant: str, number: int, preview: bool) -> tuple[Any, Any]:
    """Load the scene of a task; the one before stays loaded meanwhile, for what both need."""
    path, values = files.here()
    scene = load_scene(path, values)
    return scene, sensor_of(scene, number, preview)


def film_of(scene: Any, sensor: Any) -> str:
    """Describe all that the sum of passes depends on as text: size, crop, filter, channels."""
    film = sensor.film()
    offset, size = film.crop_offset(), film.crop_size()
    return f"{film} {offset} {size} {integrator_of(scene).aov_names()}"


def worker_address() -> str:
    """Return the address of this process in Dask."""
    from distributed import get_worker

    try:
        return str(get_worker().address)
    except ValueError:
        return "this process"


@dataclass(frozen=True)
class SceneFiles:
    """A scene, its values, and the files that both name."""

    scene: str  # absolute path of the XML file, on the client
    values: tuple[tuple[str, str], ...]  # parameters by name, sorted
    files: tuple[tuple[str, str], ...]  # absolute paths on the client, SHA-256 of their contents

    @classmethod
    def from_scene(cls, scene: Path, values: Mapping[str, str]) -> SceneFiles:
        """Read the digests of the files of an XML scene."""
        absolute = Path(os.path.abspath(scene))
        paths = {os.path.abspath(path) for path in files_of(absolute, values)}
        files = tuple((path, _digest(path)) for path in sorted(paths))
        return cls(str(absolute), tuple(sorted(values.items())), files)

    @property
    def digest(self) -> str:
        """Digest of the scene, its values and its files, independent of the folders they lie in."""
        root = os.path.dirname(self.scene)
        contents = [(os.path.relpath(path, root), digest) for path, digest in self.files]
        return key_of(os.path.basename(self.scene), self.values, contents)

    def require(self, contents: Mapping[str, bytes]) -> None:
        """Write copies of missing files, and check that none is missing. contents: by digest.

        Raises `MissingFiles`, or a DiffractionError if a content has another digest.
        """
        missing = [
            (self._copy(path), digest)
            for path, digest in self.files
            if not (_has(path, digest) or _has(self._copy(path), digest))
        ]
        for copy, digest in missing:
            if digest in contents:
                _write(copy, contents[digest])
                if not _has(copy, digest):
                    raise DiffractionError(
                        "its files changed since the command began; run it again"
                    )
        if lacking := {digest for _, digest in missing} - {*contents}:
            raise MissingFiles(sorted(lacking))

    def here(self) -> tuple[Path, dict[str, str]]:
        """Return the scene and its values on this machine: in place, or copies of all."""
        if all(_has(path, digest) for path, digest in self.files):
            return Path(self.scene), dict(self.values)
        for path, digest in self.files:  # paths are relative to the scene: copies lie together
            if not _has(self._copy(path), digest):
                _write(self._copy(path), Path(path).read_bytes())
        absolute = {path: str(self._copy(path)) for path, _ in self.files}
        return self._copy(self.scene), {k: absolute.get(v, v) for k, v in self.values}

    def _copy(self, path: str) -> Path:
        folder = cache_folder() or _own_temporary()
        return folder / "scenes" / self.digest[:32] / Path(path).relative_to(Path(path).anchor)


def _write(copy: Path, content: bytes) -> None:
    make_folder(copy.parent)
    with atomic_path(copy) as temporary:
        temporary.write_bytes(content)


@lru_cache(1)
def _own_temporary() -> Path:
    """Return a new folder for this process's task files, for machines without a cache.

    A folder of a known name in the folder that all users share might be somebody else's.
    """
    folder = tempfile.mkdtemp(prefix="mitsuba_diffraction-")
    atexit.register(shutil.rmtree, folder, ignore_errors=True)
    return Path(folder)


def _has(path: str | Path, digest: str) -> bool:
    try:
        return _digest(path) == digest
    except OSError:
        return False


def _digest(path: str | Path) -> str:
    """Return the SHA-256 of a file, read again only when its time or size has changed."""
    status = os.stat(path)
    return _digest_at(path, status.st_mtime_ns, status.st_size)


@lru_cache(4096)
def _digest_at(path: str | Path, *stamp: int) -> str:
    return sha256_of(path)
