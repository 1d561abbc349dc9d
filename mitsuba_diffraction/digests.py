"""Digests of files, and keys of stored results, made of several parts."""

from __future__ import annotations

import hashlib
import json
import os
from typing import Any


def key_of(*parts: Any) -> str:
    """Return a key: the SHA-256 of its parts as JSON."""
    return hashlib.sha256(json.dumps(parts, sort_keys=True, default=str).encode()).hexdigest()


def sha256_of(path: str | os.PathLike[str]) -> str:
    """Return the SHA-256 of a file.

    Raises an OSError if it cannot be read.
    """
    with open(path, "rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()
