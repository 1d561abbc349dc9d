"""Figures with goals: sections of rows, printed as text, kept as plain data."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from typing import Any


@dataclass(frozen=True)
class Goal:
    """What a row is to reach, in words, and whether it does."""

    text: str
    met: bool

    def __str__(self) -> str:
        return f"{self.text}: {'met' if self.met else 'MISSED'}"


@dataclass(frozen=True)
class Row:
    """One thing measured.

    Attributes
    ----------
    name : what it is.
    values : by column; None where a column does not apply.
    goals : of this row.
    raw : all single measurements and whatever else belongs to them, as plain data.
    """

    name: str
    values: dict[str, float | None]
    goals: Sequence[Goal] = ()
    raw: dict[str, Any] = field(default_factory=dict)


@dataclass(frozen=True)
class Section:
    """A table of rows.

    Attributes
    ----------
    title : what was measured, and how.
    columns : heading of each column, with its unit.
    rows : what was measured.
    """

    title: str
    columns: Sequence[str]
    rows: Sequence[Row]

    @property
    def goals(self) -> list[Goal]:
        """All rows' goals."""
        return [goal for row in self.rows for goal in row.goals]

    def lines(self) -> Iterator[str]:
        """Text for people: aligned columns, goals at the end of the lines."""
        head = ["", *self.columns]
        body = [
            [row.name, *(_number(row.values.get(c)) for c in self.columns)] for row in self.rows
        ]
        widths = [max(map(len, column)) for column in zip(head, *body, strict=True)]
        yield self.title
        for cells, row in zip([head, *body], [None, *self.rows], strict=True):
            numbers = (f"{cell:>{w}}" for cell, w in zip(cells[1:], widths[1:], strict=True))
            goals = "; ".join(map(str, row.goals)) if row else ""
            yield "  ".join([f"  {cells[0]:<{widths[0]}}", *numbers, goals]).rstrip()

    def plain(self) -> dict[str, Any]:
        """The same for JSON, single measurements included."""
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
