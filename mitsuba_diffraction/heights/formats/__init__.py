"""Readers of height files, by kind.

Contents
--------
images       PNG, BMP, TIFF and EXR
arrays       NPY
text         grids of numbers
instruments  their files (extra `afm`)
raw          what a reader takes out of a file
"""
