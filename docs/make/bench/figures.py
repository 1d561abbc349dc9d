"""Sizes of a run; rows with goals as text and data; two runs compared."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any


@dataclass(frozen=True)
class Plan:
    """Sizes and repetitions."""

    pixels: int = 1332  # a side of the patch that `eval` is measured on
    # sides of further patches whose tables are built, with the same size of pixels
    more_pixels: tuple[int, ...] = (4096, 8192)
    other_tables: bool = True  # build `patch` and Taylor tables too
    scans: int = 62  # of a survey
    lanes: int = 1 << 20  # calls at once
    slow_lanes: int = 1 << 17  # likewise, for the thesis' configuration
    rounds: int = 15  # timed calls of each contender
    # resolution, spp: of the rendered pictures
    resolution: int = 256
    spp: int = 16
    reference_spp: int = 2048  # of pictures that are to have converged
    map_resolution: int = 256  # directions of view along each axis, to compare colours at
    frame: tuple[int, int] = (1920, 1080)  # pixels of the shaders' frames


FULL = Plan()
QUICK = Plan(
    more_pixels=(),
    other_tables=False,
    scans=6,
    lanes=1 << 18,
    slow_lanes=1 << 15,
    rounds=5,
    resolution=128,
    spp=4,
    reference_spp=256,
    map_resolution=96,
    frame=(96, 54),
)


@dataclass(frozen=True)
class Goal:
    """Goal of a row, in words, and whether the row meets it."""

    text: str
    met: bool

    def __str__(self) -> str:
        return f"{self.text}: {'met' if self.met else 'MISSED'}"


@dataclass(frozen=True)
class Row:
    """Measurements of one contender or case."""

    name: str  # what it is
    values: dict[str, float | None]  # by column with its unit; None where it does not apply
    goals: Sequence[Goal] = ()  # of this row
    # all single measurements and whatever else belongs to them, as plain data
    raw: dict[str, Any] = field(default_factory=dict)


@dataclass(frozen=True)
class Section:
    """A table of rows."""

    title: str  # what was measured, and how
    rows: Sequence[Row]  # what was measured, all with the same columns

    @property
    def goals(self) -> list[Goal]:
        """All rows' goals."""
        return [goal for row in self.rows for goal in row.goals]

    def lines(self) -> Iterator[str]:
        """Text for people: aligned columns, goals at the end of the lines."""
        head = ["", *self.rows[0].values]
        body = [[row.name, *map(_number, row.values.values())] for row in self.rows]
        widths = [max(map(len, column)) for column in zip(head, *body, strict=True)]
        yield self.title
        for cells, row in zip([head, *body], [None, *self.rows], strict=True):
            numbers = (f"{cell:>{w}}" for cell, w in zip(cells[1:], widths[1:], strict=True))
            goals = "; ".join(map(str, row.goals)) if row else ""
            yield "  ".join([f"  {cells[0]:<{widths[0]}}", *numbers, goals]).rstrip()

    def plain(self) -> dict[str, Any]:
        """Return the section as plain data for JSON, single measurements included."""
        rows = [
            {
                "name": row.name,
                "values": row.values,
                "goals": [{"goal": goal.text, "met": goal.met} for goal in row.goals],
                **row.raw,
            }
            for row in self.rows
        ]
        return {"title": self.title, "rows": rows}


def _number(value: float | None) -> str:
    if value is None:
        return ""
    if abs(value) >= 1000:
        return f"{value:.0f}"
    return f"{value:.3g}" if abs(value) < 1 else f"{value:#.3g}".rstrip(".")


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
