"""Two runs of `bench` side by side."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

from ...errors import DiffractionError


def read_run(path: Path) -> dict[str, Any]:
    """What `bench --json` wrote.

    Raises
    ------
    DiffractionError
        If the file is missing or something else.
    """
    try:
        found = json.loads(path.read_text(encoding="utf-8"))
        if isinstance(found["sections"], list) and isinstance(found["machine"], dict):
            return dict(found)
    except OSError as error:
        raise DiffractionError(f"cannot read '{path}': {error.strerror}") from error
    except (ValueError, KeyError, TypeError):
        pass
    raise DiffractionError(f"'{path}' is not what bench --json writes; give such a file")


def compared(old: Mapping[str, Any], new: Mapping[str, Any]) -> Iterator[str]:
    """Lines for people: every number that both runs have, and by what it changed.

    Times of two runs are not alike even where nothing changed; ratios are, to some per cent.
    """
    before = dict(_numbers(old))
    machines = [f"{run['machine'].get('processor')}" for run in (old, new)]
    if machines[0] != machines[1]:
        yield f"other machines: {machines[0]} then, {machines[1]} now"
    for key, value in _numbers(new):
        was = before.get(key)
        if was and value is not None:
            section, row, column = key
            yield f"  {value / was:6.2f}×  {section}: {row}: {column}: {was:.4g} → {value:.4g}"


def _numbers(run: Mapping[str, Any]) -> Iterator[tuple[tuple[str, str, str], float | None]]:
    for section in run["sections"]:
        name = section["title"].split(":")[0]
        for row in section["rows"]:
            for column, value in row["values"].items():
                yield (name, row["name"], column), value
