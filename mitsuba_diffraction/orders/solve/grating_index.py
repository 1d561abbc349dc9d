"""Refractive index of a grating's material over wavelength: by name, by number, or of a file.

Files are exports of refractiveindex.info (CSV, YAML), and Zemax's glasses (AGF).

CSV has columns of wavelengths (`wl`; µm if the header has no unit), n and, perhaps, k, in one table
or in one for n and then one for k. YAML has tables, or the formulas of the database's "Dispersion
formulas" (M. N. Polyanskiy, Scientific Data 11, 94, 2024). A catalogue of glasses holds many, one
of which is named behind a colon: `schott.agf:N-BK7`; its formulas are OpticStudio's.
"""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ...arrays import Real
from ...columns import WAVELENGTH_UNITS, parse_columns
from ...errors import DiffractionError, quoted
from ...files import read_bytes
from ...limits import LARGEST_TEXT
from ...optics.materials import PERFECT, material_named
from ...plugin.conductors import tabulated_index

Range = tuple[float, float]
Index = tuple[Range, Callable[[Real], Real]]  #: wavelengths, µm, and a function of them

#: Suffixes of files of an index.
SUFFIXES = (".csv", ".txt", ".yml", ".yaml", ".agf")
# Wavelengths of a formula at which it is tabulated, and a longest one that is µm without a unit
_SAMPLES, _MICRONS = 1001, 100.0


@dataclass(frozen=True, eq=False)
class TabulatedIndex:
    """Complex index n + ik, linear in between, constant beyond.

    Attributes
    ----------
    name : for messages.
    wavelengths : (n,) nm, in vacuum.
    values : (n,) n + ik; None for a perfect conductor.
    """

    name: str
    wavelengths: NDArray[np.float64]
    values: NDArray[np.complex128] | None

    def index(self, wavelength: ArrayLike) -> NDArray[np.complex128] | None:
        """Index at wavelengths in vacuum, nm; None for a perfect conductor."""
        if self.values is None:
            return None
        lam = np.asarray(wavelength, np.float64)
        return np.asarray(np.interp(lam, self.wavelengths, self.values))


def material_of(
    material: str | float | complex | TabulatedIndex, wavelengths: tuple[float, float]
) -> TabulatedIndex:
    """Return a material from a name of `optics.materials`, an index, or "none" (R = 1).

    Raises a DiffractionError if the name is unknown, the index impossible, or its table ends within
    the wavelengths.

    Parameters
    ----------
    material : name such as "Al", number such as 1.5 or 0.6+5.6j, their text, or a file of an index.
    wavelengths : shortest and longest, nm, for which the index must be known.
    """
    if isinstance(material, TabulatedIndex):
        return material
    if is_file(material):
        assert isinstance(material, str)
        return TabulatedIndex(material, *read_index(material, wavelengths))
    number = material_named(material)
    if number == PERFECT:
        return TabulatedIndex("perfect conductor", np.array([0.0]), None)
    if isinstance(number, str):
        nodes, values = tabulated_index(number)
        low, high = wavelengths
        if low < nodes[0] or high > nodes[-1]:
            raise DiffractionError(
                f"material={material!r} is tabulated from {nodes[0]:.0f} to {nodes[-1]:.0f} nm, "
                f"and the wavelengths are {low:g} to {high:g} nm; choose wavelengths within, or "
                "give the index as a number"
            )
        return TabulatedIndex(number, nodes, values)
    return TabulatedIndex(
        f"index {number.real:g}+{number.imag:g}i", np.array([0.0]), np.array([number])
    )


def is_file(material: object) -> bool:
    """Whether a material is the name of a file, or of a glass of a catalogue."""
    if not isinstance(material, str):
        return False
    return _split(material)[0].lower().endswith(SUFFIXES)


def read_index(
    material: str, wavelengths: Range
) -> tuple[NDArray[np.float64], NDArray[np.complex128]]:
    """Return wavelengths in vacuum, nm, and n + ik of a file's material, over some wavelengths.

    material : path of a CSV or YAML, or of a catalogue (.agf) with `:` and the glass.
    wavelengths : shortest and longest, nm.

    Raises a DiffractionError if the file cannot be read, has no index or glass of that name, an
    unknown formula, or an index below 0, or ends within the wavelengths.
    """
    path, glass = _split(material)
    shown, text = repr(material), _text(path)
    suffix = Path(path).suffix.lower()
    if suffix == ".agf":
        parts = {"n": _glass(text, glass, shown)}
    else:
        parts = (_yaml if suffix in (".yml", ".yaml") else _csv)(text, shown)
    if "n" not in parts:
        raise DiffractionError(f"{shown} has no column or formula of n")
    low, high = (1e-3 * end for end in wavelengths)
    lam = np.linspace(low, high, _SAMPLES if high > low else 1)
    found = []
    for name in ("n", "k"):
        if name not in parts:
            found.append(0.0 * lam)
            continue
        (first, last), function = parts[name]
        if low < first * (1.0 - 1e-9) or high > last * (1.0 + 1e-9):
            raise DiffractionError(
                f"{shown} has {name} from {1e3 * first:.4g} to {1e3 * last:.4g} nm, and the "
                f"wavelengths are {1e3 * low:g} to {1e3 * high:g} nm; choose wavelengths within"
            )
        found.append(function(lam))
    index = found[0] + 1j * found[1]
    if not (np.isfinite(index).all() and (index.real > 0.0).all() and (index.imag >= 0.0).all()):
        raise DiffractionError(f"{shown}: n must be above 0 and k at least 0")
    return 1e3 * lam, index


def _split(material: str) -> tuple[str, str]:
    """Return path and glass of a material."""
    before, colon, after = material.rpartition(":")
    return (before, after) if colon and before.lower().endswith(".agf") else (material, "")


def _text(path: str) -> str:
    content = read_bytes(path, LARGEST_TEXT)
    if content[:2] in (b"\xff\xfe", b"\xfe\xff"):
        return content.decode("utf-16", "replace")
    try:
        return content.decode("utf-8-sig")
    except UnicodeDecodeError:
        return content.decode("cp1252", "replace")


def _table(lam: Real, values: Real, shown: str) -> Index:
    order = np.argsort(lam)
    lam, values = lam[order], values[order]
    if len(lam) == 0 or not np.isfinite([lam, values]).all() or lam[0] <= 0.0:
        raise DiffractionError(f"{shown}: expected wavelengths above 0 and their index")
    return (float(lam[0]), float(lam[-1])), lambda at: np.interp(at, lam, values)


def _csv(text: str, shown: str) -> dict[str, Index]:
    """Return the tables of a CSV: blocks that begin with a line of names."""
    parts: dict[str, Index] = {}
    for block in re.split(r"(?m)^(?=\s*(?:wl|wave|lambda|λ))", text, flags=re.IGNORECASE):
        if not block.strip():
            continue
        columns = parse_columns(block.splitlines(), shown)
        names = [name.strip().lower() for name in columns.names]
        if not len(columns.numbers) or len(names) < 2:
            continue
        unit = columns.units[0].lower()
        lam = columns.numbers[:, 0]
        to_micron = 1e-3 * WAVELENGTH_UNITS[unit] if unit in WAVELENGTH_UNITS else 1.0
        if not unit and np.nanmax(lam) > _MICRONS:
            to_micron = 1e-3
        for name in ("n", "k"):
            if name in names:
                values = columns.numbers[:, names.index(name)]
                parts[name] = _table(lam * to_micron, values, shown)
    return parts


def _yaml(text: str, shown: str) -> dict[str, Index]:
    """Return the tables and formulas of a file of refractiveindex.info."""
    parts: dict[str, Index] = {}
    for block in re.split(r"(?m)^\s*-\s*type\s*:", text)[1:]:
        kind = block.partition("\n")[0].strip().strip("\"'").lower()
        if kind.startswith("tabulated"):
            lines = block.partition("|")[2].splitlines()
            rows = [line for line in lines if re.match(r"\s*[\d.]", line)]
            numbers = parse_columns(rows, shown).numbers
            for name, column in zip(kind.removeprefix("tabulated").strip(), numbers.T[1:],
                                    strict=False):  # fmt: skip
                parts[name] = _table(numbers[:, 0], column, shown)
            continue
        number = kind.removeprefix("formula").strip()
        if number not in _FORMULAS:
            raise DiffractionError(
                f"{shown}: {quoted(kind)} is not known; known are tables and formulas "
                f"{', '.join(_FORMULAS)}"
            )
        coefficients = _numbers(block, "coefficients", shown)
        low, high = _numbers(block, r"(?:wavelength_)?range", shown)[:2]
        parts["n"] = (low, high), _formula(_FORMULAS[number], coefficients)
    return parts


def _numbers(block: str, key: str, shown: str) -> list[float]:
    found = re.search(rf"(?m)^\s*{key}\s*:\s*([-+.\deE ]+)", block)
    if found is None or len(found[1].split()) < 2:
        raise DiffractionError(f"{shown} has a formula without {key.rpartition(')')[2]}")
    return [float(number) for number in found[1].split()]


def _formula(of: Callable[[Real, list[float]], Real], numbers: list[float]) -> Callable[..., Real]:
    return lambda lam: np.asarray(of(lam, numbers))


def _pairs(numbers: list[float]) -> list[tuple[float, float]]:
    return list(zip(numbers[0::2], numbers[1::2], strict=False))


def _sellmeier(lam: Real, pairs: list[tuple[float, float]], first: float, power: int = 1) -> Real:
    """Return √(1 + c + Σ a λ²/(λ² − bᵖ))."""
    square = sum(a * lam**2 / (lam**2 - b**power) for a, b in pairs)
    return np.asarray(np.sqrt(1.0 + first + square))


def _powers(lam: Real, c: list[float]) -> Real:
    return np.asarray(c[0] + sum(a * lam**b for a, b in _pairs(c[1:])))


def _formula_4(lam: Real, c: list[float]) -> Real:
    c = c + [0.0] * max(9 - len(c), 0)
    square = c[0] + sum(
        a * lam**b / (lam**2 - d**e) if a else 0.0 * lam for a, b, d, e in (c[1:5], c[5:9])
    )
    return np.asarray(np.sqrt(square + sum(a * lam**b for a, b in _pairs(c[9:]))))


def _gas(lam: Real, c: list[float]) -> Real:
    return np.asarray(1.0 + c[0] + sum(a / (b - lam**-2) for a, b in _pairs(c[1:])))


# Formulas of refractiveindex.info by number, of λ in µm
_FORMULAS: dict[str, Callable[[Real, list[float]], Real]] = {
    "1": lambda lam, c: _sellmeier(lam, _pairs(c[1:]), c[0], 2),
    "2": lambda lam, c: _sellmeier(lam, _pairs(c[1:]), c[0]),
    "3": lambda lam, c: np.sqrt(_powers(lam, c)),
    "4": _formula_4,
    "5": _powers,
    "6": _gas,
}
# Formulas of OpticStudio's catalogues
_GLASSES: dict[int, Callable[[Real, list[float]], Real]] = {
    1: lambda lam, c: np.sqrt(sum(a * lam**p for a, p in zip(c, (0, 2, -2, -4, -6, -8),
                                                             strict=False))),  # Schott
    2: lambda lam, c: _sellmeier(lam, _pairs(c[:6]), 0.0),
    5: lambda lam, c: c[0] + c[1] / lam + c[2] / lam**3.5,  # Conrady
    6: lambda lam, c: _sellmeier(lam, _pairs(c[:8]), 0.0),
    11: lambda lam, c: _sellmeier(lam, _pairs(c[:10]), 0.0),
}  # fmt: skip


def _glass(text: str, name: str, shown: str) -> Index:
    """Return n of a glass of a catalogue; NM names it, CD has coefficients, LD the wavelengths."""
    names = re.findall(r"(?m)^NM\s+(\S+)", text)
    block = re.search(rf"(?mis)^NM\s+{re.escape(name)}\s(.*?)(?=^NM\s|\Z)", text) if name else None
    if block is None:
        listed = ", ".join(names[:5]) + (" …" if len(names) > 5 else "")
        raise DiffractionError(
            f"{shown}: write catalogue:glass, with one of {len(names)} glasses: {listed or 'none'}"
        )
    lines = {
        line[:2]: line.split()[1:] for line in block[1].splitlines() if line[:2] in ("CD", "LD")
    }
    try:
        formula = int(float(block[1].split()[0]))
        coefficients = [float(number) for number in lines["CD"]]
        low, high = (float(number) for number in lines["LD"][:2])
    except (KeyError, ValueError, IndexError) as error:
        raise DiffractionError(f"{shown} lacks its formula, coefficients or wavelengths") from error
    if formula not in _GLASSES:
        raise DiffractionError(
            f"{shown} has dispersion formula {formula}; known are {', '.join(map(str, _GLASSES))}"
        )
    coefficients += [0.0] * (10 - len(coefficients))
    return (low, high), _formula(_GLASSES[formula], coefficients)
