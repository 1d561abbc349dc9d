"""Where heights come from: a file, a recipe, several files, or an array; the kind is asked once.

`load` and `treated` are the methods of `HeightField`.
"""

from __future__ import annotations

import dataclasses
import os
import shlex
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Any, Self

from ..atomic import atomic_path
from ..digests import key_of, sha256_of
from ..errors import DiffractionError, counted
from ..files import FileKind, kind_of, readable_file
from ..settings import TableSettings
from . import gratings
from .field import HeightField
from .lengths import Crop, Height, PixelSize
from .read import LoadOptions, read_heights, treat
from .recipes import read_recipe, recipe_text
from .validity import stands_in_full

#: Name of a file.
Name = str | os.PathLike[str]


@dataclass(frozen=True, eq=False)
class Source:
    """Source of heights; make one with `of`.

    Attributes
    ----------
    kind : kind of the file; None of several files, and of heights in memory.
    path : the file, or the first of several; None of heights in memory.
    files : the files of heights, of a recipe those that it names; () with a generator.
    options : how files are read and all patches treated: as asked, and then as a recipe says.
    generator : name of a function of `heights.gratings`, or None.
    arguments : keyword arguments of the generator, one mapping per patch.
    settings : fields of `TableSettings` that a recipe sets, checked.
    output : path of the table; by default the file's name with .exr in the current folder.
    patches : heights in memory, or () if they have to be read.
    """

    kind: FileKind | None
    path: Path | None
    files: tuple[Path, ...]
    options: LoadOptions
    generator: str | None = None
    arguments: tuple[Mapping[str, Any], ...] = ()
    settings: Mapping[str, Any] = dataclasses.field(default_factory=dict)
    output: Path = Path("table.exr")
    patches: tuple[HeightField, ...] = ()

    @classmethod
    def of(
        cls,
        value: Name | HeightField | Sequence[Name] | Sequence[HeightField],
        options: LoadOptions | None = None,
    ) -> Self:
        """Return the source that a value names; heights are not read yet.

        Parameters
        ----------
        value : file of heights, recipe or table; several files of heights; or one or several
            height fields.
        options : how heights are read, and height fields treated.

        Raises a DiffractionError if a file cannot be read, or as `recipes.read_recipe` does.
        """
        how = options or LoadOptions()
        several = [value] if isinstance(value, str | os.PathLike | HeightField) else list(value)
        files = tuple(readable_file(v) for v in several if not isinstance(v, HeightField))
        if not files:
            fields = tuple(treat(v, how) for v in several if isinstance(v, HeightField))
            return cls(None, None, (), how, patches=fields)
        kinds = [kind_of(file) for file in files]
        if len(files) > 1 and FileKind.RECIPE in kinds:
            shown = files[kinds.index(FileKind.RECIPE)]
            raise DiffractionError(f"'{shown}' is a recipe; name it alone, or files of heights")
        if kinds[0] is FileKind.RECIPE:
            return cls(kinds[0], **read_recipe(files[0], how))
        kind, output = kinds[0] if len(files) == 1 else None, Path(f"{files[0].stem}.exr")
        return cls(kind, files[0], files, how, output=output)

    @cached_property
    def digest(self) -> str:
        """SHA-256 of all that the heights are made of.

        Of files and recipes the bytes of the files, the options, and the generators with their
        arguments; of height fields their numbers.
        """
        if self.path is None:
            first, *others = [patch.digest() for patch in self.patches]
            return key_of(first, *others) if others else first
        files = [readable_file(file) for file in self.files]
        if self.generator is not None:
            files = sorted(Path(gratings.__file__).parent.glob("*.py"))
        arguments = [dict(values) for values in self.arguments]
        return key_of(self.options.specified(), self.generator, arguments, *map(sha256_of, files))

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the patches."""
        if self.patches:
            return tuple(patch.name for patch in self.patches)
        files = tuple(file.name for file in self.files)
        return files or (str(self.generator),) * len(self.arguments)

    def fields(self) -> list[HeightField]:
        """Read or generate the heights of all patches.

        Raises a DiffractionError if a file cannot be read as heights, holds none, or a recipe's
        generator refuses an argument.
        """
        if self.patches:
            return list(self.patches)
        if self.kind is FileKind.TABLE:
            raise DiffractionError(
                f"'{self.path}' is a table; this needs the heights it was made of, or their recipe"
            )
        if self.kind is FileKind.ORDERS:
            raise DiffractionError(
                f"'{self.path}' has solved orders, which leave where the grating equation says, "
                "and no heights; 'mitsuba-diffraction orders', 'spectrum' and 'brdf-map' show it"
            )
        if self.generator is None:
            kind = None if self.kind is FileKind.RECIPE else self.kind
            return [read_heights(file, self.options, kind) for file in self.files]
        generate: Callable[..., HeightField] = getattr(gratings, self.generator)
        try:
            generated = [generate(**values) for values in self.arguments]
        except DiffractionError as error:
            raise DiffractionError(f"{str(self.path)!r}: [arguments]: {error}") from error
        return [treat(patch, self.options) for patch in generated]

    def field(self) -> HeightField:
        """Read or generate the heights of the only patch.

        Raises a DiffractionError as `fields` does, and if there are several patches.
        """
        if (count := len(self.names)) > 1:
            raise DiffractionError(
                f"{str(self.path)!r} describes {count} patches, where one is needed; precompute "
                "its table and use that"
            )
        return self.fields()[0]

    def read(self) -> Self:
        """Return this source with its heights in memory; the digest stays."""
        return replace(self, patches=tuple(self.fields()))

    def save(self, path: Path, comment: str) -> None:
        """Write a recipe of files or a generator, with paths relative to the recipe.

        comment : stands above it.

        Raises a DiffractionError if the file cannot be written.
        """
        content: dict[str, Any] = {}
        arguments = [dict(values) for values in self.arguments]
        if self.generator is None:
            files = [os.path.relpath(file, path.parent) for file in self.files]
            content["source"] = files[0] if len(files) == 1 else files
        else:
            content["generator"] = self.generator
            if len(arguments) > 1:  # which differ by their seeds alone
                content["seeds"] = [values.pop("seed") for values in arguments]
        content |= {**self.options.specified(), **self.settings, "output": f"{path.stem}.exr"}
        if arguments and arguments[0]:
            content["arguments"] = arguments[0]
        with atomic_path(path) as temporary:
            temporary.write_text(recipe_text(content, comment), encoding="utf-8")


def load(
    path: Name,
    *,
    pixel_size: PixelSize | None = None,
    max_height: Height | None = None,
    height_unit: str | None = None,
    channel: str | int | None = None,
    crop: Crop | None = None,
    fill: str | None = None,
    level: str | None = None,
    clip: float | str | None = None,
    periodic: str | None = None,
) -> HeightField:
    """Read a height field from an image, an array, text, an instrument file or a recipe.

    Raises a DiffractionError if the file cannot be read as heights, a length is missing or
    contradicts the file, or an option has no valid value.

    Parameters
    ----------
    path
        PNG, BMP or TIFF (grey, 8 or 16 bits, or 32-bit float in µm), EXR (one channel, µm),
        NPY (µm), TXT or CSV (a grid of heights in µm), TOML (a recipe), or an instrument
        file, which needs the extra `afm`.
    pixel_size
        µm, one number, a pair (dx, dy), or a string of either. `None` and "auto" leave it to
        the file; otherwise it overrides what the file states, and a warning and `history` say so.
    max_height
        Full scale of an integer image in µm: black is 0, white is `max_height`. Other heights are
        scaled so that they span it from lowest to highest, whatever unit the file states.
    height_unit
        Unit of the numbers in the file, "nm" for instance, whatever the file states; not for
        integer images.
    channel
        Name or index of the channel of an instrument file (name for an EXR); by default the
        one that holds heights.
    crop
        Crop to a central region (µm): one number for a square, a pair (width, height); or to one
        elsewhere, (width, height, x, y) with its lower left corner; or a string of these.
    fill
        Method to fill points without data: "nearest" or "harmonic" (see
        `preprocess.fill_missing`); by default they are refused.
    level
        "plane" subtracts the best plane, "lines" aligns the scan lines first; "none". By default
        "plane" where a tilt shows once the patch is tiled (`validity.tilted`).
    clip
        Clip heights to this many robust standard deviations; default not at all.
    periodic
        "exact" states that the patch is whole periods of a surface that repeats, "open" that it is
        a part of a larger surface, which is seen through windows (`tables.build.screens`). Files
        are open, unless they say otherwise. The treatments are applied in the order crop, fill,
        level, clip, and each leaves a line in `history`.
    """
    options = LoadOptions.parse(
        pixel_size=pixel_size, max_height=max_height, height_unit=height_unit, channel=channel,
        crop=crop, fill=fill, level=level, clip=clip, periodic=periodic,
    )  # fmt: skip
    return Source.of(path, options).field()


def notes_line(
    lines: Sequence[str],
    path: Name,
    options: LoadOptions,
    settings: TableSettings,
) -> str:
    """Return the number of notes on a file, and the command that prints them, in one line.

    Warnings that `validity.stands_in_full` names stand there in full.

    Parameters
    ----------
    lines : the notes; without any the line is empty.
    path, options, settings : the file, and how its heights are read and its table is built.
    """
    if not lines:
        return ""
    values = options.specified()
    if settings.coherence_width != "auto":
        values["coherence_width"] = settings.coherence_width
    words = ["mitsuba-diffraction", "info", os.fspath(path)]
    if settings.wavelength_range != TableSettings.wavelength_range:
        words += ["--wavelength-range", "{:g}:{:g}".format(*settings.wavelength_range)]
    for name, value in values.items():
        numbers = value if isinstance(value, tuple) else (value,)
        text = ",".join(n if isinstance(n, str) else f"{n:.9g}" for n in numbers)
        words += [f"--{name.replace('_', '-')}", text]
    number = counted(len(lines), "note")
    grave = "".join(f"{line}; " for line in lines if stands_in_full(line))
    return f"{grave}{number} on '{Path(path).name}': {shlex.join(words)}"


def treated(
    field: HeightField,
    *,
    crop: Crop | None = None,
    level: str | None = None,
    clip: float | str | None = None,
    periodic: str | None = None,
) -> HeightField:
    """Return the patch with its heights treated; parameters and order as in `load`.

    Points without data are filled while loading, since a HeightField has none.

    Raises a DiffractionError if an option has no valid value, or `clip` finds more than half of the
    heights equal.
    """
    return treat(field, LoadOptions.parse(crop=crop, level=level, clip=clip, periodic=periodic))
