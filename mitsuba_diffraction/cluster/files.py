"""A scene's files by content: used where they lie, or copied to where a worker lacks them."""

from __future__ import annotations

import hashlib
import os
import tempfile
from collections.abc import Mapping
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

from ..atomic import atomic_path
from ..scene.parameters import files_of
from ..tables.store import cache_folder, key_of


@dataclass(frozen=True)
class SceneFiles:
    """A scene, its values, and the files that both name.

    Attributes
    ----------
    scene : absolute path of the XML file, on the client.
    values : parameters by name, sorted.
    files : absolute paths on the client, with the SHA-256 of their contents.
    """

    scene: str
    values: tuple[tuple[str, str], ...]
    files: tuple[tuple[str, str], ...]

    @classmethod
    def of(cls, scene: Path, values: Mapping[str, str]) -> SceneFiles:
        """Those of an XML file, read now."""
        absolute = Path(os.path.abspath(scene))
        found = {os.path.abspath(path) for path in files_of(absolute, values)}
        files = tuple((path, _digest(path, *_stamp(path))) for path in sorted(found))
        return cls(str(absolute), tuple(sorted(values.items())), files)

    @property
    def digest(self) -> str:
        """Changes when the scene, a value or a file does; not with the folder all lie in."""
        root = os.path.dirname(self.scene)
        contents = [(os.path.relpath(path, root), digest) for path, digest in self.files]
        return key_of(os.path.basename(self.scene), self.values, contents)

    def missing(self) -> list[str]:
        """Digests of the files that this machine has neither in place nor copied."""
        return sorted({digest for path, digest in self.files if not self._found(path, digest)})

    def keep(self, contents: Mapping[str, bytes]) -> None:
        """Write the copies that are missing; `contents` by digest."""
        for path, digest in self.files:
            if digest in contents and not self._found(path, digest):
                copy = self._copy(path)
                copy.parent.mkdir(parents=True, exist_ok=True)
                with atomic_path(copy) as temporary:
                    temporary.write_bytes(contents[digest])

    def here(self) -> tuple[Path, dict[str, str]]:
        """The scene and its values on this machine: in place, or copies of all."""
        if all(_has(path, digest) for path, digest in self.files):
            return Path(self.scene), dict(self.values)
        for path, digest in self.files:  # paths are relative to the scene: copies lie together
            if not _has(str(self._copy(path)), digest):
                self.keep({digest: Path(path).read_bytes()})
        absolute = {path: str(self._copy(path)) for path, _ in self.files}
        return self._copy(self.scene), {k: absolute.get(v, v) for k, v in self.values}

    def _found(self, path: str, digest: str) -> bool:
        return _has(path, digest) or _has(str(self._copy(path)), digest)

    def _copy(self, path: str) -> Path:
        folder = cache_folder() or Path(tempfile.gettempdir()) / "mitsuba_diffraction"
        return folder / "scenes" / self.digest[:32] / path.lstrip("/")


def _has(path: str, digest: str) -> bool:
    try:
        return _digest(path, *_stamp(path)) == digest
    except OSError:
        return False


def _stamp(path: str) -> tuple[int, int]:
    status = os.stat(path)
    return status.st_mtime_ns, status.st_size


@lru_cache(4096)
def _digest(path: str, *stamp: int) -> str:
    """SHA-256 of a file, read anew only when its time or size has changed."""
    with open(path, "rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()
