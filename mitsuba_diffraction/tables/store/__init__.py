"""The cache: what is made once, found by what it is made of.

Contents
--------
cache        tables and colours
bounds       bounds of the albedo
colour_npz   colour tables as NPZ
"""
