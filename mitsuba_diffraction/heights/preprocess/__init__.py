"""Treatments of heights before a table is made of them.

Each takes a `HeightField` and gives a new one, with a line in its `history` that says what changed.

Contents
--------
missing     points without data, filled
levelling   tilt, scan lines and outliers
periodic    opposite edges made to meet
edges       the central region of a patch, and how far its edges are from meeting
"""
