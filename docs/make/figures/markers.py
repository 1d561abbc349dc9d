"""Generated parts of Markdown files: what stands between `<!-- begin NAME -->` and its end."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from pathlib import Path

from mitsuba_diffraction.atomic import atomic_path
from mitsuba_diffraction.errors import DiffractionError


def replaced(text: str, name: str, content: str) -> str:
    """The text with the part of that name replaced; the markers stay.

    Raises
    ------
    DiffractionError
        If the markers are missing, twice there, or the wrong way round.
    """
    begin, end = f"<!-- begin {name} -->", f"<!-- end {name} -->"
    if text.count(begin) != 1 or text.count(end) != 1 or text.index(begin) > text.index(end):
        raise DiffractionError(f"expected '{begin}' and then '{end}', once each")
    head, rest = text.split(begin)
    tail = rest.split(end)[1]
    return f"{head}{begin}\n{content.strip()}\n{end}{tail}"


def part(text: str, name: str) -> str:
    """What stands between the markers of that name.

    Raises
    ------
    DiffractionError
        If they are missing.
    """
    begin, end = f"<!-- begin {name} -->", f"<!-- end {name} -->"
    if begin not in text or end not in text:
        raise DiffractionError(f"expected '{begin}' and '{end}'")
    return text.split(begin)[1].split(end)[0].strip()


def update(path: str | os.PathLike[str], parts: Mapping[str, str]) -> None:
    """Replace parts of a file by name.

    Raises
    ------
    DiffractionError
        If the file or a marker is missing, or it cannot be written.
    """
    file = Path(path)
    text = _read(file)
    for name, content in parts.items():
        try:
            text = replaced(text, name, content)
        except DiffractionError as error:
            raise DiffractionError(f"'{file}': {error}") from error
    with atomic_path(file) as temporary:
        temporary.write_text(text, encoding="utf-8")


def update_present(path: str | os.PathLike[str], parts: Mapping[str, str]) -> None:
    """Replace those parts that a file has markers for.

    Raises
    ------
    DiffractionError
        If it has none, or as in `update`.
    """
    text = _read(Path(path))
    present = {name: part for name, part in parts.items() if f"<!-- begin {name} -->" in text}
    if not present:
        raise DiffractionError(
            f"'{path}' has none of the markers {', '.join(f'<!-- begin {n} -->' for n in parts)}"
        )
    update(path, present)


def _read(file: Path) -> str:
    try:
        return file.read_text(encoding="utf-8")
    except OSError as error:
        raise DiffractionError(f"cannot read '{file}': {error.strerror}") from error


def table(header: tuple[str, ...], rows: Sequence[tuple[str, ...]]) -> str:
    """A Markdown table."""
    lines = ["| " + " | ".join(header) + " |", "|" + "---|" * len(header)]
    return "\n".join([*lines, *("| " + " | ".join(row) + " |" for row in rows)])
