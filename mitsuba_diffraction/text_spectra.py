"""Spectra in text files: measured reflectances, sensitivities of receptors, lights.

A file may be followed by the name of a column and by a unit: "feathers.csv:male:percent".
"""

from __future__ import annotations

import os
import re
from pathlib import Path
from typing import NamedTuple

import numpy as np

from .arrays import Real
from .columns import WAVELENGTH_UNITS, Columns, read_columns
from .errors import DiffractionError, counted, warn

#: Suffixes of spectra: text, and what software of spectrometers names its text.
SPECTRA = (
    ".csv", ".txt", ".tsv", ".dat", ".ttt", ".trt", ".jaz", ".ssm", ".epr",
    ".transmission", ".reflectance",
)  # fmt: skip
#: Words that name the unit of shares: `fraction` of 1, or `percent`.
SHARE_UNITS = {"fraction": 1.0, "percent": 0.01, "%": 0.01}

_PERCENT = re.compile(r"%|per\s?cent", re.IGNORECASE)
# Wavelengths, nm, of spectra that anybody measures here.
_LIGHT = (100.0, 30_000.0)
# Shares above it, without a unit, are in per cent; from 1 to it the unit has to be named.
_SURELY_PERCENT = 2.0
# Share below 0 that is noise of a spectrometer.
_NOISE = 0.02


class Choice(NamedTuple):
    """A file, and the column and the unit in which it is to be read; "" for the file's own."""

    path: str
    column: str = ""
    unit: str = ""


def choice_of(text: str) -> Choice:
    """Take FILE, FILE:COLUMN, FILE:UNIT or FILE:COLUMN:UNIT apart; units as in `SHARE_UNITS`."""
    endings = "|".join(re.escape(suffix) for suffix in SPECTRA)
    match = re.fullmatch(rf"(.+?(?:{endings})):(.+)", text, re.IGNORECASE)
    if match is None or Path(text).is_file():
        return Choice(text)
    column, _, unit = match[2].rpartition(":")
    if unit not in SHARE_UNITS:
        column, unit = match[2], ""
    return Choice(match[1], column, unit)


def read_spectra(
    choice: Choice | str | os.PathLike[str], what: str, every: bool = False
) -> tuple[Real, Columns]:
    """Read spectra: a column of wavelengths and one of values, or several.

    choice : the file, and perhaps the name of the column.
    what : names the values in messages.
    every : whether all columns of values are wanted.

    Returns
    -------
    Wavelengths (n,) in nm, ascending, and the columns of values.

    Raises a DiffractionError as `read_columns` does, or if there are fewer than two wavelengths,
    one is there twice, or it is open which column is meant.
    """
    choice = choice if isinstance(choice, Choice) else Choice(os.fspath(choice))
    table = read_columns(choice.path)
    wanted = f"wavelengths in nm, each once, and {what}"
    if len(table.numbers) < 2 or table.numbers.shape[1] < 2:
        raise DiffractionError(f"{table.shown} is not a spectrum: give {wanted}")
    values = range(1, table.numbers.shape[1]) if every else [table.column(choice.column)]
    numbers = table.with_gaps([0, *values], wanted)
    complete = np.isfinite(numbers).all(axis=1)
    if not complete.all():
        line = table.lines[complete.argmin()]
        if every:
            raise DiffractionError(f"{table.shown}, line {line}: expected numbers: {wanted}")
        warn(
            f"{table.shown}: {counted(int(np.sum(~complete)), 'line')} without a number left "
            f"out, the first is line {line}"
        )
    numbers, lines = numbers[complete], table.lines[complete]
    order = np.argsort(numbers[:, 0])
    lam = _in_nm(numbers[order, 0], table.units[0], table.shown)
    if len(lam) < 2 or not (np.diff(lam) > 0.0).all():
        raise DiffractionError(f"{table.shown} is not a spectrum: give {wanted}")
    return lam, table._replace(
        names=tuple(table.names[n] for n in values), units=tuple(table.units[n] for n in values),
        numbers=numbers[order, 1:], lines=lines[order],
    )  # fmt: skip


def read_shares(text: str, needed: tuple[float, float]) -> tuple[Real, Real]:
    """Read a spectrum of reflectances.

    Per cent or fraction is what the text says, else the header, else a guess by the values, which a
    warning names. Noise a little below 0 is 0. Noise out of range beyond the needed wavelengths
    ends the spectrum.

    text : FILE, FILE:COLUMN, FILE:UNIT or FILE:COLUMN:UNIT.
    needed : wavelengths, nm, between which every value has to be a share.

    Returns
    -------
    Wavelengths (n,) in nm and values (n,) from 0 to 1.

    Raises a DiffractionError as `read_spectra` does, or if the values are no shares.
    """
    choice = choice_of(text)
    lam, table = read_spectra(choice, "reflectances from 0 to 1 or in per cent")
    raw = table.numbers[:, 0]
    inside = (needed[0] <= lam) & (lam <= needed[1])
    inside = inside if inside.any() else np.ones_like(inside)
    value = raw * _share_unit(choice, table, raw[inside])
    least, most = -_NOISE, 1.0 + 1e-9
    good = (value >= least) & (value <= most)
    if not good[inside].all():
        raise DiffractionError(
            f"{table.shown}: reflectances are {raw[inside].min():g} to {raw[inside].max():g}; "
            "expected 0 to 1, or 0 to 100 per cent. Divide larger values by the reflectance of "
            f"the white standard; say what the file has by {choice.path}:fraction or :percent"
        )
    bad = np.flatnonzero(~good)
    first, last = np.flatnonzero(inside)[[0, -1]]
    start = int(bad[bad < first].max(initial=-1)) + 1
    stop = int(bad[bad > last].min(initial=len(lam)))
    if stop - start < len(lam):
        warn(
            f"{table.shown}: reflectances beyond {lam[start]:g} to {lam[stop - 1]:g} nm are not "
            "from 0 to 1 and are left out"
        )
    lam, value = lam[start:stop], value[start:stop]
    if (value < 0.0).any():
        warn(f"{table.shown}: reflectances down to {value.min():.3g} are noise and are read as 0")
    return lam, np.clip(value, 0.0, 1.0)


def _share_unit(choice: Choice, table: Columns, inside: Real) -> float:
    """Return the share that 1 in the file means."""
    if choice.unit:
        return SHARE_UNITS[choice.unit]
    if _PERCENT.search(f"{table.names[0]} {table.units[0]}"):
        return 0.01
    if inside.max() <= 1.0:
        return 1.0
    if inside.max() <= _SURELY_PERCENT:
        raise DiffractionError(
            f"{table.shown}: reflectances up to {inside.max():g} may be fractions or per cent; say "
            f"which: {choice.path}:fraction or {choice.path}:percent, or behind the name of a "
            "column"
        )
    warn(
        f"{table.shown}: reflectances up to {inside.max():g} are read as per cent; "
        f"{choice.path}:percent says so"
    )
    return 0.01


def _in_nm(values: Real, unit: str, shown: str) -> Real:
    """Return wavelengths in nm; a unit that makes no light of them is overruled aloud."""
    stated = WAVELENGTH_UNITS.get(unit.lower(), WAVELENGTH_UNITS.get(unit.lower().rstrip("s")))
    for name, factor in ((unit, stated), ("nm", 1.0), ("µm", 1e3)):
        if factor is None:
            continue
        lam = values * factor
        if not (_LIGHT[0] <= lam.min() and lam.max() <= _LIGHT[1]):
            continue
        if factor != (stated or 1.0):
            says = f"its header says {unit}" if stated else "its header has no unit"
            warn(
                f"{shown}: wavelengths {values.min():g} to {values.max():g} are read as {name}; "
                f"{says}"
            )
        return lam
    raise DiffractionError(
        f"{shown}: wavelengths are {f'{values.min():g} to {values.max():g} {unit}'.strip()}; "
        "expected nm, or µm or Å if the header says so"
    )
