"""The command `mitsuba-diffraction`: one file per sub-command, `main` around them all."""

from .main import main

__all__ = ["main"]
