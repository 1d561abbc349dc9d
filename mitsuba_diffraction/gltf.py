"""glTF files: buffers and pictures come from the file's own folder."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any
from urllib.parse import unquote

from .errors import DiffractionError
from .extras import optional
from .files import path_beside, refuse_pipe
from .images import without_programs


class _Folder:
    """Resolver of names for `trimesh`, which by itself opens pipes, and before 5.0 any file."""

    def __init__(self, file: Path) -> None:
        self._file = file
        self.refused: DiffractionError | None = None  # `trimesh` ignores errors of pictures

    def get(self, name: str) -> bytes:
        """Return the content of a file beside the glTF file."""
        try:
            path = path_beside(self._file, unquote(name))
            refuse_pipe(path)
        except DiffractionError as error:
            self.refused = error
            raise
        return path.read_bytes()

    __getitem__ = get

    def keys(self) -> Iterator[str]:
        """Yield no names: glTF files name all that they need."""
        return iter(())


def load_gltf(file: Path, wanted_by: str) -> Any:
    """Return a glTF file as a scene of `trimesh`; its pictures are not decoded yet.

    wanted_by : option or parameter that names the file, for the message if `trimesh` is missing.

    Raises
    ------
    DiffractionError
        If `trimesh` is not installed, or a name is a pipe or leads out of the file's folder.
    Exception
        Whatever `trimesh` makes of damaged files.
    """
    trimesh = optional("trimesh", wanted_by)
    folder = _Folder(file)
    with without_programs():
        try:
            scene = trimesh.load_scene(file, process=False, resolver=folder)
        finally:
            if folder.refused is not None:
                raise folder.refused
    return scene
