"""Formats of scans: those that are read, and what to export in place of the others.

`info --formats` prints these tables, docs/formats.md has them, and messages name what to export.
"""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from typing import NamedTuple


class Known(NamedTuple):
    """A format that is read.

    Attributes
    ----------
    name, suffixes : the format, and usual suffixes; the content of a file decides.
    makers : instruments and programs that write it.
    lengths : what a file does not say about lengths, as options; "" if it says all.
    """

    name: str
    suffixes: tuple[str, ...]
    makers: str
    lengths: str = ""


class Unread(NamedTuple):
    """A format that is not read.

    Attributes
    ----------
    name, suffixes, makers : as of `Known`.
    begins : first bytes of a file; () if they do not tell it.
    export : what to do instead.
    """

    name: str
    suffixes: tuple[str, ...]
    makers: str
    begins: tuple[bytes, ...]
    export: str


_GREY, _PIXEL = "--pixel-size, --max-height", "--pixel-size"
_UNITS = "--pixel-size, --height-unit"

#: Formats that need no extra.
OWN = (
    Known("grey image", (".png", ".bmp", ".tif", ".tiff"), "any program; 1, 8 or 16 bits", _GREY),
    Known("image of floats, µm", (".tif", ".tiff", ".exr"), "any program", _PIXEL),
    Known("NumPy array, µm", (".npy",), "Python", _PIXEL),
    Known("text: a grid of heights, or x, y and height", (".txt", ".csv", ".tsv", ".xyz"),
           "Gwyddion, spreadsheets, R; units and order as the header says (`# units: nm`, "
           "`Height [nm]`), else µm",
           "--pixel-size, unless it has x and y or a header of Gwyddion"),
)  # fmt: skip

#: Formats of the extra `afm`, of scanning-probe instruments and of optical profilometers.
PROBES = (
    Known("NanoScope", (".spm", ".001", ".di"), "Bruker, Veeco, Digital Instruments, from 4.3 on"),
    Known("Gwyddion", (".gwy",), "Gwyddion, which opens nearly all others"),
    Known("Igor binary wave", (".ibw",), "Asylum Research, Oxford Instruments"),
    Known("Park Systems TIFF", (".tiff", ".tif"), "Park Systems"),
    Known("JPK image", (".jpk",), "JPK, Bruker NanoWizard"),
    Known("NID, EZD", (".nid", ".ezd"), "Nanosurf"),
    Known("MDT", (".mdt",), "NT-MDT"),
    Known("MI", (".mi",), "Agilent, Keysight, Molecular Imaging"),
    Known("WSxM", (".top", ".stp", ".tom", ".cur"), "Nanotec, WSxM"),
    Known("BCR-STM", (".bcr", ".bcrf"), "Image Metrology SPIP"),
)  # fmt: skip
OPTICAL = (
    Known("X3P", (".x3p",), "ISO 25178-72: confocal and white-light instruments; first row on top"),
    Known("SDF", (".sdf",), "ISO 25178-71; first profile on top"),
    Known("SUR, MNT", (".sur", ".mnt"), "Digital Surf, Mountains"),
    Known("PLU, PLUX", (".plu", ".plux"), "Sensofar"),
    Known("OPD, OPDx", (".opd", ".opdx"), "Wyko, Bruker"),
    Known("DAT, DATX", (".dat", ".datx"), "Zygo MetroPro, Mx"),
    Known("LEXT, OIR, POIR", (".lext", ".oir", ".poir"), "Olympus"),
    Known("VK, ZON", (".vk3", ".vk4", ".vk6", ".vk7", ".zon"), "Keyence"),
    Known("AL3D", (".al3d",), "Alicona"),
    Known("ZMG", (".zmg",), "KLA Zeta"),
    Known("NMS", (".nms",), "NanoFocus", "--pixel-size, where a file lacks it"),
    Known("TMD, FRT, QEP, OS3D", (".tmd", ".frt", ".qep", ".os3d"),
           "TrueMap, FRT, Mahr, OmniSurf3D"),
)  # fmt: skip
ARRAYS = (
    Known("HDF5", (".h5",), "any program", _UNITS),
    Known("MATLAB", (".mat",), "MATLAB, Octave", _UNITS),
    Known("NetCDF", (".nc",), "SurfaceTopography"),
    Known("NPZ", (".npz",), "Python", _UNITS),
)  # fmt: skip

_GWYDDION = "save as .gwy in Gwyddion"

#: Formats that are not read.
UNREAD = (
    Unread("Nanonis scan", (".sxm",), "Nanonis, SPECS", (b":NANONIS_VERSION:",), _GWYDDION),
    Unread("Createc scan", (".dat",), "Createc", (b"[Paramet",), _GWYDDION),
    Unread("Matrix scan", (".mtrx",), "Omicron", (b"ONTMATRX0101",), _GWYDDION),
    Unread("SM4 scan", (".sm4",), "RHK", (b"S\0T\0i\0M\0a\0g\0e\0",), _GWYDDION),
    Unread("JPK force or QI map", (".jpk-force", ".jpk-force-map", ".jpk-qi-data", ".jpk-qi-image"),
           "JPK, Bruker", (), "save the height image as .jpk in JPK Data Processing"),
    Unread("PeakForce capture", (".pfc",), "Bruker", (),
           "save the height channel as .spm in NanoScope Analysis"),
    Unread("LIF, LSM or CZI image", (".lif", ".lsm", ".czi"), "Leica, Zeiss", (),
           "export the map of heights as .x3p or text"),
    Unread("JPEG", (".jpg", ".jpeg"), "any program", (b"\xff\xd8\xff",),
           "its compression changes heights; export PNG, TIFF or numbers"),
)  # fmt: skip


def way_out(path: Path, begins: bytes) -> str:
    """Return what a file that is not read is and what to export, or "" for unknown files."""
    named = [u for u in UNREAD if path.suffix.lower() in u.suffixes and not u.begins]
    for unread in [*(u for u in UNREAD if u.begins and begins.startswith(u.begins)), *named]:
        return f"is a {unread.name}, which is not read as heights: {unread.export}"
    return ""


def sections() -> dict[str, list[dict[str, str]]]:
    """Return the tables by title: rows of texts, by column."""
    return {
        "read": _rows(OWN),
        "read with the extra afm: probe microscopes": _rows(PROBES),
        "read with the extra afm: optical profilometers": _rows(OPTICAL),
        "read with the extra afm: arrays": _rows(ARRAYS),
        "not read": [{**_named(unread), "instead": unread.export} for unread in UNREAD],
    }


def _rows(formats: Iterable[Known]) -> list[dict[str, str]]:
    return [{**_named(f), "lengths to give": f.lengths or "none"} for f in formats]


def _named(entry: Known | Unread) -> dict[str, str]:
    return {"format": entry.name, "suffixes": " ".join(entry.suffixes), "from": entry.makers}
