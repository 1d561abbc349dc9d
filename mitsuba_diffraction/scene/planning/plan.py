"""A plan: which part of each table a scene needs, as a small file to render with again."""

from __future__ import annotations

import json
import math
import os
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

from ...atomic import atomic_path
from ...errors import DiffractionError, quoted
from .domain import Domain

#: Raised whenever an older file would mean something else.
VERSION = 2
_KIND = "mitsuba-diffraction plan"


@dataclass(frozen=True)
class PlannedTable:
    """One table of the scene."""

    surfaces: list[str]  # ids of the BSDFs that look it up
    name: str  # of the heights
    digest: str  # of the heights
    domain: Domain | None  # what of it is needed, or None for all of it
    memory: tuple[int, int]  # bytes of the whole table and of the planned one


@dataclass(frozen=True)
class Plan:
    """What a scene needs of its tables."""

    scene: str  # name of the file, for people
    tolerance: float  # relative error of the picture that it was made for
    paths: int  # that were traced
    # by the key of the whole table (`tables.store.table_key`): heights and parameters
    tables: Mapping[str, PlannedTable] = field(default_factory=dict)

    def limits(self) -> dict[str, dict[str, Any]]:
        """What `session.Session` follows."""
        return {
            key: table.domain.arguments()
            for key, table in self.tables.items()
            if table.domain is not None
        }

    def save(self, path: Path) -> None:
        """Write it as JSON."""
        document = {"kind": _KIND, "version": VERSION, **asdict(self)}
        with atomic_path(path) as temporary:
            temporary.write_text(
                json.dumps(document, indent=1, ensure_ascii=False) + "\n", encoding="utf-8"
            )

    @classmethod
    def load(cls, path: str | os.PathLike[str]) -> Plan:
        """Read what `save` wrote.

        Raises
        ------
        DiffractionError
            If the file is missing, no plan, damaged, or of another version.
        """
        try:
            document = json.loads(Path(path).read_text(encoding="utf-8"))
        except OSError as error:
            raise DiffractionError(f"cannot read '{path}': {error.strerror}") from error
        except (ValueError, RecursionError) as error:
            raise DiffractionError(f"'{path}' is no plan: it is no JSON; {_REMEDY}") from error
        if not isinstance(document, dict) or document.get("kind") != _KIND:
            raise DiffractionError(f"'{path}' is JSON but no plan; {_REMEDY}")
        if document.get("version") != VERSION:
            raise DiffractionError(
                f"'{path}' is a plan of version {quoted(document.get('version'))}, this program "
                f"reads version {VERSION}; {_REMEDY}"
            )
        try:
            return cls(
                scene=str(document["scene"]),
                tolerance=float(document["tolerance"]),
                paths=int(document["paths"]),
                tables={str(k): _table(v) for k, v in document["tables"].items()},
            )
        except (LookupError, TypeError, ValueError, OverflowError, AttributeError) as error:
            raise DiffractionError(f"'{path}' is a damaged plan ({error!r}); {_REMEDY}") from error


_REMEDY = "make one with 'mitsuba-diffraction plan SCENE -o plan.json'"


def _table(document: dict[str, Any]) -> PlannedTable:
    domain = document["domain"]
    if domain is not None:
        x, y = (float(value) for value in domain.pop("crop"))
        domain = Domain(crop=(x, y), **{name: float(value) for name, value in domain.items()})
        numbers = (x, y, domain.kappa_max, domain.tolerance)
        if not all(0.0 < number < math.inf for number in numbers):
            raise ValueError(f"domain {domain}")
    whole, planned = document["memory"]
    return PlannedTable(
        surfaces=[str(name) for name in document["surfaces"]],
        name=str(document["name"]),
        digest=str(document["digest"]),
        domain=domain,
        memory=(int(whole), int(planned)),
    )
