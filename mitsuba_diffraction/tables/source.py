"""The table of any source of heights, built once for all that ask; table files, loaded once.

BSDFs, surveys, spectra and maps of one scan share one file in the cache. `providing` lets whoever
loads a scene choose the tables of its BSDFs.
"""

from __future__ import annotations

import os
import weakref
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import asdict, dataclass
from typing import Any

from ..digests import key_of
from ..errors import DiffractionError, warn
from ..files import FileKind
from ..heights import Source
from ..heights.coherence import LOOKUP, SHARPENING, TAPER
from ..heights.source import notes_line
from ..progress import Progress, silent
from ..settings import MAX_HEIGHT_SCALE, TableSettings
from .build.build import build_with
from .build.checks import warnings_of
from .document import from_record, named, to_record
from .layout import LEAST_HALF
from .store import cached, loaded_once
from .table import FORMAT_VERSION, DiffractionTable

#: A table serves heights scaled by up to this times max(1, height_scale).
HEIGHT_SCALE_ROOM = 1.5

_tables: weakref.WeakValueDictionary[str, DiffractionTable] = weakref.WeakValueDictionary()


class TableSource(Source):
    """Source of heights or of a table, and the table itself."""

    def settings_for(self, asked: Mapping[str, Any], height_scale: float = 1.0) -> TableSettings:
        """Return the settings of the table: those asked for, then a recipe's, then defaults.

        height_scale : the largest factor on the heights that the table has to serve.

        Raises a DiffractionError if a setting is not allowed, or `height_scale` is beyond the
        recipe's `height_scale_max`.
        """
        room = min(HEIGHT_SCALE_ROOM * max(1.0, height_scale), MAX_HEIGHT_SCALE)
        settings = TableSettings(**{"height_scale_max": room, **self.settings, **asked})
        if height_scale > settings.height_scale_max:
            raise DiffractionError(
                f"height_scale={height_scale:g} is beyond height_scale_max="
                f"{settings.height_scale_max:g} of the recipe (a coat counts as its index times "
                "the heights); raise it there"
            )
        return settings

    def table(
        self,
        settings: TableSettings,
        *,
        height_scale: float = 1.0,
        stretch: float = 1.0,
        progress: Progress = silent,
    ) -> DiffractionTable:
        """Return the table: of a table file loaded, of heights from the cache or built.

        Parameters
        ----------
        settings : of a table that is built; see `settings_for`.
        height_scale : the largest factor on the heights that is used.
        stretch : factor on lengths in the patch's plane.
        progress : called as progress(done, total, text) while a table is built.

        Raises a DiffractionError if the heights cannot be read, or no table can be made of them.
        """
        if self.kind is FileKind.TABLE:
            return loaded_table(self.files[0])
        return _providers[-1](TableRequest(self, settings, height_scale, stretch, progress))

    def warnings(self, settings: TableSettings) -> list[str]:
        """List the warnings of a table of these heights."""
        return warnings_of(self.fields(), settings)


@dataclass(frozen=True)
class TableRequest:
    """The table of heights that somebody asks for; attributes as of `TableSource.table`."""

    source: TableSource
    settings: TableSettings
    height_scale: float
    stretch: float
    progress: Progress

    @property
    def digest(self) -> str:
        """SHA-256 of the heights as they are stretched."""
        digest = self.source.digest
        return digest if self.stretch == 1.0 else key_of(digest, self.stretch)

    def cached(self, settings: TableSettings) -> DiffractionTable:
        """Return the table with these settings, from the cache or built."""
        parts = self.digest, asdict(settings), TAPER, LOOKUP, SHARPENING, LEAST_HALF
        key = key_of(FORMAT_VERSION, *parts)
        found = cached("table", key, _tables, lambda: self.built(settings), to_record, from_record)
        # the file in the cache has no names: patches of other names may be equal
        return named(found, self.source.names)

    def built(self, settings: TableSettings) -> DiffractionTable:
        """Build the table with these settings; warnings are one line for a file."""
        source = self.source
        heights = [field.stretched(self.stretch) for field in source.fields()]
        table = build_with(heights, settings, self.progress)
        lines = warnings_of(heights, settings)
        if lines and source.path is not None:
            lines = [notes_line(lines, source.path, source.options, settings)]
        for line in lines:
            warn(line)
        return table


#: Gets the table that is asked for.
TableProvider = Callable[[TableRequest], DiffractionTable]
#: Providers of the scenes that are being loaded, the current one last.
_providers: list[TableProvider] = [lambda request: request.cached(request.settings)]


@contextmanager
def providing(provider: TableProvider) -> Iterator[None]:
    """Let a provider choose the tables of all scenes that are loaded inside.

    In all threads: Mitsuba's own, which make the BSDFs of a scene, inherit no context variables.
    """
    _providers.append(provider)
    try:
        yield
    finally:
        _providers.remove(provider)


def loaded_table(path: str | os.PathLike[str]) -> DiffractionTable:
    """Load a table file once for all that use it at the same time."""
    return loaded_once(path, DiffractionTable.load, _tables)
