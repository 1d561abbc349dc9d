"""Numbers in text files: spectra, observers, metals, efficiencies, profiles and grids of heights.

All of them follow these rules:

- The text is UTF-8, UTF-16 with a byte order mark, or else Windows-1252. Lines that begin with #
  or %, and the rest of a row behind " #", are comments.
- The first line of numbers decides the separator: semicolon, tab, comma, or white space. Beside a
  semicolon or a tab a comma is a decimal comma; between white space it is one if every number has
  digits on both sides; between commas it is one in quotation marks.
- Lines of words above the numbers are a header. The last one with as many cells names the columns;
  a unit is in brackets behind a name, behind an underscore or slash, or in a line of units alone.
- An empty cell, "nan", "-" and the like are missing numbers, NaN. Separators at the end of every
  line make no column, nor do the names of rows of R and pandas, which have no name of their own.
- A line that begins with ">>>>>" ends the numbers: exports of Ocean Optics have such lines.

Exports of spectrometers (Ocean Optics, SpectraSuite, JAZ, Avantes, StellarNet, ProcSpec's text)
follow them. Their columns of raw counts are left out where a processed one is beside them.

`save_rows` writes the CSV files of the package.
"""

from __future__ import annotations

import csv
import math
import os
import re
from collections.abc import Callable, Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from .arrays import Real
from .atomic import atomic_path
from .errors import DiffractionError, counted, printable, quoted
from .files import readable_file
from .limits import LARGEST_LISTING, bounded_lines

#: nm in one unit of wavelength that a header states.
WAVELENGTH_UNITS = {
    "nm": 1.0, "nanometer": 1.0, "µm": 1e3, "μm": 1e3, "um": 1e3, "micron": 1e3, "micrometer": 1e3,
    "å": 0.1, "a": 0.1, "angstrom": 0.1, "m": 1e9,
}  # fmt: skip
_MISSING = {
    "", "nan", "na", "n/a", "#n/a", "bad", "none", "null", "-", "--", "inf", "-inf", "1.#qnan",
    "-1.#ind", "#div/0!",
}  # fmt: skip
_DECIMAL_COMMA = re.compile(r"[-+]?\d*,\d+([eE][-+]?\d+)?|[-+]?\d+([eE][-+]?\d+)?")
_UNIT = re.compile(r"^(.*?)\s*[\[(]([^\])]*)[\])]\s*$")
_END = ">>>>>"
# Units that a name may end in without brackets.
_LENGTHS = {*WAVELENGTH_UNITS, "pm", "mm"} - {"a", "m"}
# First characters of formulas.
_FORMULAS = ("=", "+", "-", "@", "\t")
# Columns of raw counts in exports of JAZ, Avantes and others.
_RAW = {"w", "d", "r", "s", "dark", "ref", "reference", "sample", "scope", "raw"}


class Columns(NamedTuple):
    """Numbers of a text file.

    Attributes
    ----------
    names, units : one per column, from the header; "" where it has none.
    numbers : (rows, columns); NaN where a number is missing, or where a word is.
    lines : (rows,) line of the file of each row, counted from 1.
    header : lines of comment and header, by their number.
    words : by row and column, cells that are neither numbers nor missing.
    shown : the file's name in messages.
    """

    names: tuple[str, ...]
    units: tuple[str, ...]
    numbers: Real
    lines: NDArray[np.int64]
    header: dict[int, str]
    words: dict[tuple[int, int], str]
    shown: str

    def of(self, wanted: Iterable[str]) -> Real:
        """Return the columns of these names, (rows, n), all numbers finite.

        Raises a DiffractionError if a name is missing or there twice, or a number is missing.
        """
        wanted = tuple(wanted)
        for name in wanted:
            if self.names.count(name) != 1:
                how = "several columns" if name in self.names else "no column"
                raise DiffractionError(
                    f"{self.shown} has {how} {name}; the first line must name {', '.join(wanted)}"
                )
        return self.finite([self.names.index(name) for name in wanted], ", ".join(wanted))

    def finite(self, columns: Sequence[int], what: str) -> Real:
        """Return columns by number, (rows, n); refuse words and missing numbers, with their line.

        what : the numbers expected, for messages.
        """
        chosen = self.with_gaps(columns, what)
        bad = ~np.isfinite(chosen).all(axis=1)
        if bad.any():
            line = int(self.lines[bad.argmax()])
            raise DiffractionError(f"{self.shown}, line {line}: expected numbers: {what}")
        return chosen

    def with_gaps(self, columns: Sequence[int], what: str) -> Real:
        """Return columns by number, (rows, n), NaN where numbers are missing; refuse words."""
        if not len(self.numbers) or max(columns) >= self.numbers.shape[1]:
            raise DiffractionError(f"{self.shown} has no lines of numbers; expected {what}")
        for (row, column), word in self.words.items():
            if column in columns:
                raise DiffractionError(
                    f"{self.shown}, line {self.lines[row]}: {quoted(word)} is not a number; "
                    f"expected {what}"
                )
        return self.numbers[:, list(columns)]

    def order(self, axes: str) -> list[int]:
        """Return the places of columns named by letters, then of the others.

        Names may end with a unit, as "x_nm". Without a column of each letter the order stays.
        """
        letters = [re.split(r"[^a-z]", name.lower())[0] for name in self.names]
        if any(letters.count(axis) != 1 for axis in axes):
            return list(range(len(letters)))
        named = [letters.index(axis) for axis in axes]
        return named + [n for n in range(len(letters)) if n not in named]

    def column(self, name: str) -> int:
        """Return the number of the column of values with a name, or of the only one without.

        The first column has the wavelengths. Columns of raw counts are passed over, unless the file
        has no others. Raises a DiffractionError that lists the names.
        """
        values = range(1, self.numbers.shape[1])
        if name:
            same = [n for n in values if self.names[n] == name]
            same = same or [n for n in values if self.names[n].lower() == name.lower()]
        else:
            raw = [n for n in values if self.names[n].lower() in _RAW or self.units[n] == "counts"]
            same = [n for n in values if n not in raw or len(raw) == len(values)]
        if len(same) == 1:
            return same[0]
        there = ", ".join(self.names[n] or f"(column {n + 1} has no name)" for n in values[:12])
        there += ", …" if len(values) > 12 else ""
        if name:
            how = "several columns" if same else "no column"
            raise DiffractionError(f"{self.shown} has {how} {quoted(name)}; there are: {there}")
        raise DiffractionError(
            f"{self.shown} has {len(values)} columns of values; choose one by its name, "
            f"FILE:NAME; there are: {there}"
        )


def read_columns(path: str | os.PathLike[str], largest: int = LARGEST_LISTING) -> Columns:
    """Read the numbers of a text file by the rules above.

    Raises a DiffractionError if the file cannot be read, is no text, is larger than `largest`
    bytes, or a line below the first numbers has another number of cells.
    """
    file, shown = readable_file(path), repr(os.fspath(path))
    size = file.stat().st_size
    if size > largest:
        raise DiffractionError(
            f"{shown} is too large: {size} bytes, and a text may have {largest}; is it the right "
            "file?"
        )
    try:
        encoding = _encoding(file)
        try:
            with file.open(encoding=encoding) as stream:
                return parse_columns(bounded_lines(stream, shown), shown)
        except UnicodeDecodeError:
            if encoding != "utf-8-sig":
                raise
            with file.open(encoding="cp1252", errors="replace") as stream:
                return parse_columns(bounded_lines(stream, shown), shown)
    except UnicodeError as error:
        raise DiffractionError(
            f"{shown} is not text; export it as text from the program that wrote it"
        ) from error
    except OSError as error:
        raise DiffractionError(f"cannot read {shown}: {error.strerror}") from error


def parse_columns(lines: Iterable[str], shown: str) -> Columns:
    """Read the numbers of lines of text; see `read_columns`."""
    rows: list[Real] = []
    places: list[int] = []
    header: dict[int, str] = {}
    words: dict[tuple[int, int], str] = {}
    split: Callable[[str], list[str]] | None = None
    tail = 1 << 30  # cells at the ends of all rows that are empty
    for place, line in enumerate(lines, 1):
        line = line.rstrip("\r\n")
        if not line.strip():
            continue
        if line.startswith(_END) and rows:
            break
        if line.lstrip()[0] in "#%" or line.startswith(_END):
            header[place] = line
            continue
        row_text = re.split(r"\s#", line, maxsplit=1)[0]
        if split is None:
            split = _first_row(row_text, next(reversed(header.values()), ""))
            if split is None:
                header[place] = line
                continue
        cells = split(row_text)
        if rows and len(cells) != len(rows[0]):
            raise DiffractionError(
                f"{shown}, line {place}: {counted(len(cells), 'number')} where the first row has "
                f"{len(rows[0])}"
            )
        row, strange = _row(cells)
        filled = (n for n, cell in enumerate(reversed(cells)) if cell.strip())
        tail = min(tail, next(filled, len(cells)))
        words.update({(len(rows), n): cells[n].strip() for n in strange})
        rows.append(row)
        places.append(place)
    numbers = np.array(rows, np.float64).reshape(len(rows), len(rows[0]) if rows else 0)
    names, units = _named(header, split or str.split, numbers.shape[1])
    # Leave out names of rows, and cells without a name that are empty at the end of all rows
    start, stop = 0, numbers.shape[1]
    # a name elsewhere and none here: names of rows
    if stop > 2 and any(names) and not names[0]:
        start = 1
    while tail and stop - start > 1 and not names[stop - 1]:
        tail, stop = tail - 1, stop - 1
    kept = {(row, n - start): word for (row, n), word in words.items() if start <= n < stop}
    return Columns(
        tuple(names[start:stop]), tuple(units[start:stop]), numbers[:, start:stop],
        np.array(places, np.int64), header, kept, shown,
    )  # fmt: skip


def _encoding(file: Path) -> str:
    """Return the encoding of a text; raise UnicodeError for binary content."""
    with file.open("rb") as stream:
        beginning = stream.read(1 << 16)
    encoding = "utf-8-sig"
    if beginning.startswith((b"\xff\xfe", b"\xfe\xff")):
        encoding, beginning = "utf-16", beginning[: len(beginning) // 2 * 2]
    text = beginning.decode(encoding, "replace")
    # Avantes pads the name of a spectrometer with NUL
    if sum(" " <= c <= "~" or c in "\t\r\n" for c in text) < 0.7 * len(text):
        raise UnicodeError
    return encoding


def _first_row(line: str, above: str) -> Callable[[str], list[str]] | None:
    """Return how a line of cells is split if it is the first row of numbers, else None.

    Words may be in it if it is separated as the line of names above it.
    """
    split = _splitter(line)
    cells = split(line)
    numbers = [_number(cell) for cell in cells]
    finite = any(number is not None and math.isfinite(number) for number in numbers)
    gaps = len(cells) > 1 and all(cell.strip() for cell in cells)
    if None not in numbers:
        return split if finite or gaps else None
    if not finite:
        return None
    names = split(above)
    same = split is not str.split and len(names) == len(numbers)
    return split if same and all(_number(name) is None for name in names if name.strip()) else None


def _splitter(line: str) -> Callable[[str], list[str]]:
    """Return the function that splits lines with the separators of a line into cells."""
    for mark in ";\t":
        if mark in line.strip(" "):
            return lambda text: text.strip(" ").replace(",", ".").split(mark)
    words = line.split()
    if "," in line and len(words) > 1 and all(_DECIMAL_COMMA.fullmatch(word) for word in words):
        return lambda text: text.replace(",", ".").split()
    if "," in line:
        return _of_csv
    return str.split


def _of_csv(text: str) -> list[str]:
    cells = next(csv.reader([text.replace("\0", "")], skipinitialspace=True), [""])
    return [c.replace(",", ".") if _DECIMAL_COMMA.fullmatch(c.strip()) else c for c in cells]


def _row(cells: list[str]) -> tuple[Real, list[int]]:
    """Return the numbers of a row, NaN for words and gaps, and the places of words."""
    try:
        row = np.array(list(map(float, cells)))
    except ValueError:
        numbers = [_number(cell) for cell in cells]
        row = np.array([math.nan if number is None else number for number in numbers])
        return row, [n for n, number in enumerate(numbers) if number is None]
    row[~np.isfinite(row)] = math.nan
    return row, []


def _number(cell: str) -> float | None:
    """Convert a cell; NaN for a missing number, None for a word."""
    word = cell.strip().strip('"').strip()
    if word.lower() in _MISSING:
        return math.nan
    try:
        number = float(word)
    except ValueError:
        return None
    return number if math.isfinite(number) else math.nan


def _named(
    header: dict[int, str], split: Callable[[str], list[str]], count: int
) -> tuple[list[str], list[str]]:
    """Find the names and units of so many columns in the last lines of the header."""
    names, units = [""] * count, [""] * count
    for line in reversed(header.values()):
        if line.startswith(_END):
            continue
        text = line.lstrip("#% ")
        if split is str.split:  # a unit belongs to the name before it: "x [nm] y [nm]"
            text = re.sub(r"(?<=[^\s\])])\s+(?=[\[(])", "", text)
        cells = [cell.strip().strip('"').strip() for cell in split(text)]
        if len(cells) == count - 1 and split is str.split and line.lstrip()[0] not in "#%":
            cells = ["", *cells]  # R's write.table does not name the names of rows
        if len(cells) != count or not any(cells) or any(map(_is_number, cells)):
            continue
        if all(not cell or re.fullmatch(r"\[[^\]]*\]", cell) for cell in cells):
            units = [cell.strip("[]").strip() for cell in cells]
            continue
        for n, cell in enumerate(cells):
            name, unit = cell, ""
            if match := _UNIT.match(cell):
                name, unit = match[1], match[2].strip()
            elif (end := re.split("[_/ ]", cell)[-1].strip()).lower().rstrip("s") in _LENGTHS:
                unit = end
            names[n], units[n] = name or cell, units[n] or unit
        break
    return names, units


def _is_number(cell: str) -> bool:
    number = _number(cell)
    return number is not None and math.isfinite(number)


def save_rows(
    path: Path,
    names: Sequence[str],
    rows: Iterable[Mapping[str, Any]] | Real,
    digits: int | Sequence[int] = 17,
) -> None:
    """Write rows as CSV with these columns; values that a row lacks, and NaN, are empty.

    rows : values by the names of columns; or numbers (n, columns).
    digits : of numbers, of all columns or of each.

    Raises a DiffractionError if the file cannot be written.
    """
    each = [digits] * len(names) if isinstance(digits, int) else digits
    with atomic_path(path) as temporary, temporary.open("w", encoding="utf-8", newline="") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(names)
        for row in rows:
            cells = [row.get(n, "") for n in names] if isinstance(row, Mapping) else row
            writer.writerow(_cell(*cell) for cell in zip(cells, each, strict=True))


def _cell(value: Any, digits: int) -> Any:
    """Return a cell; a text that a spreadsheet would take for a formula begins with an apostrophe.

    Names of files come from anywhere, and programs of spreadsheets run what formulas say.
    """
    if isinstance(value, float):
        return "" if not math.isfinite(value) else f"{value:.{digits}g}" if digits < 17 else value
    if not isinstance(value, str):
        return value
    text = printable(value)  # the line end of a name is not the row's
    return f"'{text}" if text.startswith(_FORMULAS) else text
