"""Scenes are tried through the command line, too."""

from tests.cli.conftest import run, scene

__all__ = ["run", "scene"]
