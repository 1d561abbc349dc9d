"""Formats of scans: those that are read, and what to export in place of the others.

`info --formats` prints these tables, docs/formats.md has them, and messages name what to export.
"""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from typing import NamedTuple


class Format(NamedTuple):
    """A format of scans.

    Attributes
    ----------
    name, suffixes : the format, and usual suffixes; the content of a file decides.
    makers : instruments and programs that write it.
    last : options for lengths that a file does not state, "" if it states all lengths; of a format
        that no reader reads, the remedy.
    begins : first bytes that identify a format that no reader reads; () if none do.
    """

    name: str
    suffixes: tuple[str, ...]
    makers: str
    last: str = ""
    begins: tuple[bytes, ...] = ()


_GREY, _PIXEL = "--pixel-size, --max-height", "--pixel-size"
_UNITS = "--pixel-size, --height-unit"

#: Formats that need no extra.
OWN = (
    Format("grey image", (".png", ".bmp", ".tif", ".tiff"), "any program; 1, 8 or 16 bits", _GREY),
    Format("image of floats, µm", (".tif", ".tiff", ".exr"), "any program", _PIXEL),
    Format("NumPy array, µm", (".npy",), "Python", _PIXEL),
    Format("text: a grid of heights, or x, y and height", (".txt", ".csv", ".tsv", ".xyz"),
           "Gwyddion, spreadsheets, R; units and order as the header says (`# units: nm`, "
           "`Height [nm]`), else µm",
           "--pixel-size, unless it has x and y or a header of Gwyddion"),
)  # fmt: skip

#: Formats of the extra `afm`, of scanning-probe instruments and of optical profilometers.
PROBES = (
    Format("NanoScope", (".spm", ".001", ".di"), "Bruker, Veeco, Digital Instruments, from 4.3 on"),
    Format("Gwyddion", (".gwy",), "Gwyddion, which opens nearly all others"),
    Format("Igor binary wave", (".ibw",), "Asylum Research, Oxford Instruments"),
    Format("Park Systems TIFF", (".tiff", ".tif"), "Park Systems"),
    Format("JPK image", (".jpk",), "JPK, Bruker NanoWizard"),
    Format("NID, EZD", (".nid", ".ezd"), "Nanosurf"),
    Format("MDT", (".mdt",), "NT-MDT"),
    Format("MI", (".mi",), "Agilent, Keysight, Molecular Imaging"),
    Format("WSxM", (".top", ".stp", ".tom", ".cur"), "Nanotec, WSxM"),
    Format("BCR-STM", (".bcr", ".bcrf"), "Image Metrology SPIP"),
)  # fmt: skip
OPTICAL = (
    Format("X3P", (".x3p",),
           "ISO 25178-72: confocal and white-light instruments; first row on top"),
    Format("SDF", (".sdf",), "ISO 25178-71; first profile on top"),
    Format("SUR, MNT", (".sur", ".mnt"), "Digital Surf, Mountains"),
    Format("PLU, PLUX", (".plu", ".plux"), "Sensofar"),
    Format("OPD, OPDx", (".opd", ".opdx"), "Wyko, Bruker"),
    Format("DAT, DATX", (".dat", ".datx"), "Zygo MetroPro, Mx"),
    Format("LEXT, OIR, POIR", (".lext", ".oir", ".poir"), "Olympus"),
    Format("VK, ZON", (".vk3", ".vk4", ".vk6", ".vk7", ".zon"), "Keyence"),
    Format("AL3D", (".al3d",), "Alicona"),
    Format("ZMG", (".zmg",), "KLA Zeta"),
    Format("NMS", (".nms",), "NanoFocus", "--pixel-size, where a file lacks it"),
    Format("TMD, FRT, QEP, OS3D", (".tmd", ".frt", ".qep", ".os3d"),
           "TrueMap, FRT, Mahr, OmniSurf3D"),
)  # fmt: skip
ARRAYS = (
    Format("HDF5", (".h5",), "any program", _UNITS),
    Format("MATLAB", (".mat",), "MATLAB, Octave", _UNITS),
    Format("NetCDF", (".nc",), "SurfaceTopography"),
    Format("NPZ", (".npz",), "Python", _UNITS),
)  # fmt: skip

_GWYDDION = "save as .gwy in Gwyddion"

#: Formats that are not read.
UNREAD = (
    Format("Nanonis scan", (".sxm",), "Nanonis, SPECS", _GWYDDION, (b":NANONIS_VERSION:",)),
    Format("Createc scan", (".dat",), "Createc", _GWYDDION, (b"[Paramet",)),
    Format("Matrix scan", (".mtrx",), "Omicron", _GWYDDION, (b"ONTMATRX0101",)),
    Format("SM4 scan", (".sm4",), "RHK", _GWYDDION, (b"S\0T\0i\0M\0a\0g\0e\0",)),
    Format("JPK force or QI map",
           (".jpk-force", ".jpk-force-map", ".jpk-qi-data", ".jpk-qi-image"), "JPK, Bruker",
           "save the height image as .jpk in JPK Data Processing"),
    Format("PeakForce capture", (".pfc",), "Bruker",
           "save the height channel as .spm in NanoScope Analysis"),
    Format("LIF, LSM or CZI image", (".lif", ".lsm", ".czi"), "Leica, Zeiss",
           "export the map of heights as .x3p or text"),
    Format("JPEG", (".jpg", ".jpeg"), "any program",
           "its compression changes heights; export PNG, TIFF or numbers", (b"\xff\xd8\xff",)),
)  # fmt: skip


def way_out(path: Path, begins: bytes) -> str:
    """Return what a file that is not read is and what to export, or "" for unknown files."""
    named = [u for u in UNREAD if path.suffix.lower() in u.suffixes and not u.begins]
    for unread in [*(u for u in UNREAD if u.begins and begins.startswith(u.begins)), *named]:
        return f"is a {unread.name}, which is not read as heights: {unread.last}"
    return ""


def sections() -> dict[str, list[dict[str, str]]]:
    """Return the tables by title: rows of texts, by column."""
    lengths = "lengths to give"
    return {
        "read": _rows(OWN, lengths),
        "read with the extra afm: probe microscopes": _rows(PROBES, lengths),
        "read with the extra afm: optical profilometers": _rows(OPTICAL, lengths),
        "read with the extra afm: arrays": _rows(ARRAYS, lengths),
        "not read": _rows(UNREAD, "instead"),
    }


def _rows(formats: Iterable[Format], last: str) -> list[dict[str, str]]:
    columns = "format", "suffixes", "from", last
    return [
        dict(zip(columns, (f.name, " ".join(f.suffixes), f.makers, f.last or "none"), strict=True))
        for f in formats
    ]
