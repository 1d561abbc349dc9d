"""Recipes of solved orders: TOML files with `method = "solved"`.

    method = "solved"
    profile = "lamellar"            # blazed, sinusoidal; or the path of a line, CSV of x, z in µm
    material = "Al"                 # a name, an index such as "1.5" or "0.65+5.6i", or "none"
    superstrate = 1.58              # index of the clear medium above; default 1
    layers = [["1.46", 0.1]]        # films on it, from the material upwards, µm; default none
    beneath = "stack.toml"          # layers and slices beneath it, `films.read_layers`; or a list
    substrate = "SiO2"              # below them; default: the material
    thin = true                     # light goes through: a sheet of a clear material; default false
    block = true                    # the upper face of a clear solid, on both sides; default false
    wavelengths = [380, 730]        # nm
    tolerance = 0.01
    polarised = true                # with Mueller matrices; default false
    output = "tables/cd.nc"

    [arguments]                     # of the profile
    period = 1.6                    # µm
    depth = 0.12                    # µm

Paths are relative to the recipe. Without a profile, the surface above `beneath` is flat.
"""

from __future__ import annotations

import inspect
import os
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from ...errors import DiffractionError, check_keys, quoted
from ...files import path_beside, read_toml
from ...heights import HeightField
from ...heights.lengths import number_between
from ...heights.recipes import SOLVED
from ..table import WAVELENGTHS
from .films import Layers, checked_layers, read_layers
from .profiles import GENERATORS, Profile, read_profile
from .settings import Settings

_KEYS = (
    "method", "profile", "material", "superstrate", "layers", "beneath", "substrate", "thin",
    "block", "wavelengths", "tolerance", "solver", "resolution", "polarised", "output", "arguments",
)  # fmt: skip


@dataclass(frozen=True)
class SolvedRecipe:
    """Checked content of a recipe of solved orders.

    Attributes
    ----------
    output : path of the table; other attributes are arguments of `solve_orders`.
    """

    profile: Profile | HeightField
    output: Path
    material: str = "Al"
    superstrate: float = 1.0
    thin: bool = False
    block: bool = False
    layers: Layers = ()
    beneath: Layers = ()
    substrate: str | None = None
    settings: Settings = field(default_factory=Settings)

    def arguments(self) -> dict[str, Any]:
        """Return the arguments of `solve_orders`."""
        return {name: value for name, value in vars(self).items() if name != "output"}

    @classmethod
    def load(cls, path: str | os.PathLike[str]) -> SolvedRecipe:
        """Read and check a recipe.

        Raises a DiffractionError if the file cannot be read, is not TOML, or has a key or value
        that is not allowed.
        """
        file, shown = Path(path), repr(os.fspath(path))
        content = read_toml(file)
        if content.get("method") != SOLVED:
            raise DiffractionError(
                f'{shown} has no line method = "{SOLVED}": it is a recipe of heights, for '
                "the command 'precompute'"
            )
        check_keys(shown, content, _KEYS)
        output, arguments = content.get("output", f"{file.stem}.nc"), content.get("arguments", {})
        try:
            if not (isinstance(output, str) and output.endswith(".nc")):
                raise DiffractionError(
                    f"output: expected the name of a table (.nc), got {quoted(output)}"
                )
            if not isinstance(arguments, dict):
                raise DiffractionError(f"arguments: expected a section, got {quoted(arguments)}")
            layers, beneath = (_layers(content, key, file.parent) for key in ("layers", "beneath"))
            substrate = content.get("substrate")
            if beneath and "profile" not in content:
                flat = profile_of("lamellar", {**arguments, "depth": 0.0})
                profile = replace(flat, name=f"slices over {flat.period:g} µm")
            else:
                profile = profile_of(content.get("profile"), arguments, file.parent)
            return cls(
                profile,
                path_beside(file, output, output=True),
                str(content.get("material", "Al")),
                number_between(content.get("superstrate", 1.0), "superstrate", 1, 5),
                _flag(content, "thin"),
                _flag(content, "block"),
                layers,
                beneath,
                None if substrate is None else str(substrate),
                _settings(content),
            )
        except DiffractionError as error:
            raise DiffractionError(f"{shown}: {error}") from error


def profile_of(name: Any, arguments: Mapping[str, Any], folder: Path = Path()) -> Profile:
    """Return the profile of a generator, or of a file (CSV) whose `arguments` hold the period.

    Raises a DiffractionError if the generator or file is unknown, or an argument is missing,
    unknown or out of range.
    """
    if not isinstance(name, str) or (name not in GENERATORS and "." not in name):
        raise DiffractionError(
            f"profile: expected one of {', '.join(GENERATORS)}, or a file (.csv), got "
            f"{quoted(name)}"
        )
    make = GENERATORS.get(name)
    known = inspect.signature(make).parameters if make else {"period": None}
    for key in arguments:
        if key not in known:
            raise DiffractionError(f"profile {name!r} has no {key!r}; it has {', '.join(known)}")
    if "period" not in arguments:
        raise DiffractionError(f"profile {name!r} needs its period in µm")
    number_between(arguments["period"], f"profile {name!r}: period", 0.01, 1e3, " µm")
    if make is None:
        return read_profile(folder / name, arguments["period"])
    if "depth" not in arguments:
        raise DiffractionError(f"profile {name!r} needs its depth in µm")
    return make(**arguments)


def _layers(content: Mapping[str, Any], key: str, folder: Path) -> Layers:
    """Return the layers that a recipe has under a key: in a list, or in a file."""
    value = content.get(key, [])
    if isinstance(value, str):
        return read_layers(folder / value)
    return checked_layers(value, key)


def _flag(content: Mapping[str, Any], name: str) -> bool:
    """Return a key that is true or false; false without it."""
    value = content.get(name, False)
    if not isinstance(value, bool):
        raise DiffractionError(f"{name} = {quoted(value)}: must be true or false")
    return value


def _settings(content: Mapping[str, Any]) -> Settings:
    default = Settings()
    wavelengths = content.get("wavelengths", default.wavelengths)
    if not isinstance(wavelengths, list | tuple) or len(wavelengths) != 2:
        raise DiffractionError(
            f"wavelengths: expected two numbers, nm, such as [380, 730], got {quoted(wavelengths)}"
        )
    low, high = (number_between(value, "wavelengths", *WAVELENGTHS, " nm") for value in wavelengths)
    return Settings(
        (low, high),
        content.get("tolerance", default.tolerance),
        str(content.get("solver", default.method)),
        content.get("resolution", default.resolution),
        _flag(content, "polarised"),
    )
