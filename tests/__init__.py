"""Tests of the package; a package of their own, since some libraries install one of this name."""
