"""A stack of layers on the structure: read from a file, tabulated, looked up (Dr.Jit)."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np

from ..arrays import Complex, Real
from ..errors import DiffractionError, check_keys, counted, quoted
from ..files import read_toml
from ..heights.lengths import count_between, number_between
from ..limits import MOST_LAYERS, check_count
from ..optics.colour import linear_srgb, response
from ..optics.materials import PERFECT, TISSUES, material_named
from ..optics.stack import Stacked, mean_powers, nodes, packed, path_of
from .conductors import tabulated_index
from .description import Feature
from .materials import Material
from .memory import read_record, upload
from .types import Float, Interaction, Mask, Number

#: Longest path there and back, 2 Σ n d, nm.
MOST_PATH = 24e3
_KEYS = ("layers", "repeat", "spread")
# Wavelengths that RGB variants sum, nm
_VISIBLE = np.arange(390.0, 711.0, 2.0)


@dataclass(frozen=True)
class Layers:
    """Layers from the material upwards.

    Attributes
    ----------
    materials : index over wavelengths in nm, each with its thickness in nm.
    spread : standard deviation of a factor on all thicknesses, from place to place.
    name : of the file.
    """

    materials: tuple[tuple[Callable[[Real], Complex], float], ...]
    spread: float
    name: str

    @property
    def thicknesses(self) -> Real:
        """Thicknesses, nm."""
        return np.array([thickness for _, thickness in self.materials])

    def indices(self, wavelengths: Real) -> Complex:
        """Return n + ik (layers, n) at wavelengths (n,), nm."""
        return np.stack([index(wavelengths) for index, _ in self.materials])

    @property
    def absorbs(self) -> bool:
        """Whether a layer absorbs light."""
        return bool((self.indices(_VISIBLE).imag > 0.0).any())

    @property
    def path(self) -> float:
        """2 Σ n d in vacuum, nm, of the largest n."""
        return path_of(self.indices(_VISIBLE).real.max(axis=1).tolist(), self.thicknesses.tolist())


def read_layers(path: Path) -> Layers:
    """Read a stack (TOML): `layers`, pairs of a material and a thickness in µm from the material
    upwards; `repeat`, how often they follow each other; `spread` of the thicknesses.

    Raises a DiffractionError if the file cannot be read, or a key or value is not allowed.
    """
    shown = f"layers='{path}'"
    content = read_toml(path)
    check_keys(shown, content, _KEYS)
    pairs = content.get("layers")
    if not (
        isinstance(pairs, list)
        and pairs
        and all(isinstance(pair, list) and len(pair) == 2 for pair in pairs)
    ):
        raise DiffractionError(
            f'{shown}: layers: expected pairs such as [["chitin", 0.09], ["1.33", 0.08]], material '
            f"and µm, got {quoted(pairs)}"
        )
    repeat = count_between(content.get("repeat", 1), f"{shown}: repeat", 1, MOST_LAYERS)
    spread = number_between(content.get("spread", 0.0), f"{shown}: spread", 0.0, 0.3)
    check_count(len(pairs) * repeat, MOST_LAYERS, shown, "layers")
    materials = []
    for number, (material, thickness) in enumerate(pairs, 1):
        where = f"{shown}, layer {number}"
        micrometres = number_between(thickness, f"{where}: thickness", 1e-4, 100.0, " µm")
        materials.append((_index_of(material, where), 1e3 * micrometres))
    layers = Layers(tuple(materials) * repeat, spread, path.name)
    if layers.path > MOST_PATH:
        raise DiffractionError(
            f"{shown}: {counted(len(layers.materials), 'layer')} with 2 Σ n d = "
            f"{1e-3 * layers.path:.3g} µm; at most {1e-3 * MOST_PATH:g} µm interfere"
        )
    return layers


def _index_of(material: object, where: str) -> Callable[[Real], Complex]:
    """Return the index over wavelengths of a material by name or number."""
    if not isinstance(material, str | int | float):
        raise DiffractionError(f"{where}: expected a material, got {quoted(material)}")
    known = material_named(material, f"{where}: material")
    if known == PERFECT:
        raise DiffractionError(f"{where}: a perfect conductor is no layer; give an index")
    if isinstance(known, complex):
        return lambda wavelengths: np.full(len(wavelengths), known)
    if known in TISSUES:
        return TISSUES[known].index
    try:
        places, values = tabulated_index(known)
    except DiffractionError as error:
        raise DiffractionError(f"{where}: {error}") from error
    return lambda wavelengths: np.asarray(np.interp(wavelengths, places, values), np.complex128)


class UnderStack(Material):
    """Material under a stack; its numbers cannot change.

    Parameters
    ----------
    material : the material itself; layers : the stack; medium : index of the medium above.
    wavelength : nm, of mono variants; wavelengths : that the table serves.
    """

    layer = Feature.STACK

    def __init__(
        self,
        material: Material,
        layers: Layers,
        medium: float,
        wavelength: float,
        wavelengths: tuple[float, float],
    ) -> None:
        self.material: Material = material
        self.layers, self._medium = layers, medium
        rows, self._columns = nodes(layers.path, wavelengths)
        if mi.is_rgb:
            table = packed(_of_channels(self._powers(_VISIBLE)))
        elif mi.is_spectral:
            self._first, last = 1.0 / wavelengths[1], 1.0 / wavelengths[0]
            self._rate = (rows - 1) / (last - self._first)
            table = packed(self._powers(1.0 / np.linspace(self._first, last, rows)))
        else:
            table = packed(self._powers(np.array([wavelength])))
        self._rows = len(table)
        records = np.concatenate([table, np.zeros((*table.shape[:2], 1))], axis=-1)
        self._table = upload(mi.Float, records.astype(np.float32))

    def at(self, wavelengths: Real) -> Stacked:
        """Return the stack at wavelengths (n,), nm, for look-ups in NumPy."""
        phase = 2.0 * np.pi * self.layers.path / float(np.min(wavelengths))
        return Stacked(packed(self._powers(wavelengths)), phase)

    def _powers(self, wavelengths: Real) -> Complex:
        indices = np.concatenate(
            [[self.material.at(wavelengths)], self.layers.indices(wavelengths) / self._medium]
        )
        return mean_powers(
            np.linspace(0.0, 1.0, self._columns), wavelengths / self._medium, indices,
            self.layers.thicknesses, self.layers.spread,
        )  # fmt: skip

    def indices(self, si: Interaction, active: Mask) -> list[Any]:
        """Return the stack of each channel."""
        if mi.is_spectral:
            places = [(dr.rcp(w) - self._first) * self._rate for w in si.wavelengths]
        else:
            places = [mi.Float(float(row)) for row in range(self._rows)]
        size = {"columns": self._columns, "rows": self._rows}
        return [_Row(self._table, **size, place=place) for place in places]

    @property
    def absorbs(self) -> bool:  # type: ignore[override]
        """Whether a layer or the material absorbs light."""
        return self.layers.absorbs

    def __str__(self) -> str:
        count, spread = counted(len(self.layers.materials), "layer"), self.layers.spread
        spread_text = f", spread {spread:g}" if spread else ""
        return f"{self.material} under stack[{self.layers.name}, {count}{spread_text}]"


@dataclass(frozen=True, eq=False, kw_only=True)
class _Row(Stacked):
    """Stack at one wavelength in a kernel.

    Attributes
    ----------
    columns : of the table; rows : one or more.
    place : between the rows.
    """

    columns: int
    rows: int
    place: Float

    def amplitudes(self, cosine: Float) -> tuple[Number, Number]:
        """See `Stacked.amplitudes`."""
        across = dr.clip(cosine, 0.0, 1.0) * (self.columns - 1.0)
        column = dr.clip(dr.floor(across), 0.0, self.columns - 2.0)
        place = dr.clip(self.place, 0.0, self.rows - 1.0)
        row = dr.clip(dr.floor(place), 0.0, max(self.rows - 2.0, 0.0))
        index = mi.UInt32(row) * self.columns + mi.UInt32(column)
        values = self._between(index, across - column)
        if self.rows > 1:
            following = self._between(index + self.columns, across - column)
            values = [dr.lerp(a, b, place - row) for a, b in zip(values, following, strict=True)]
        return mi.Complex2f(values[0], 0.0), mi.Complex2f(values[1], values[2])

    def _between(self, index: Any, share: Float) -> list[Float]:
        ends = (read_record(self.table, each, 4) for each in (index, index + 1))
        return [dr.lerp(a, b, share) for a, b in zip(*ends, strict=True)]


def _of_channels(powers: Complex) -> Complex:
    """Sum powers (wavelengths, m, 3) over daylight to red, green and blue, (3, m, 3)."""
    weights = linear_srgb(response(_VISIBLE)).T
    weights /= weights.sum(axis=1, keepdims=True)
    return np.asarray(np.einsum("cw,wmk->cmk", weights, powers))
