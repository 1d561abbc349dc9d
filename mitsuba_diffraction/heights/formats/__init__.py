"""Readers of height files, by kind.

Contents
--------
images   PNG, BMP, TIFF and EXR
arrays   NPY
text     grids of numbers
afm      instrument files (extra `afm`)
raw      what a reader takes out of a file
"""
