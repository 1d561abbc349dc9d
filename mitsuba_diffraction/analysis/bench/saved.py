"""BSDFs of saved tables, in the current variant: as everybody has them, and as the documents did.

No warning tells how far the model holds for the patch: here it is there to be looked up.
"""

from __future__ import annotations

import os
import warnings
from typing import Any

import mitsuba as mi

from ...errors import DiffractionWarning
from .thesis_lookup import TermImages


def saved_bsdf(table: str | os.PathLike[str], **parameters: Any) -> Any:
    """The plugin with a table.

    Parameters
    ----------
    table : the file.
    parameters : any other parameter of the plugin.

    Raises
    ------
    DiffractionError
        If the file is no table.
    """
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", DiffractionWarning)
        return mi.load_dict({"type": "diffraction", "table": str(table), **parameters})


def documents_bsdf(table: str | os.PathLike[str], **parameters: Any) -> Any:
    """The same, looked up by `documents.TermImages`; the table is a coherent Taylor series."""
    bsdf = saved_bsdf(table, **parameters)
    bsdf.power.device = TermImages(bsdf.table)
    return bsdf
