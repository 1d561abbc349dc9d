"""The cache: what is made once, found by what it is made of.

Contents
--------
store    the files: key, checksum, locks, how large they may grow
cache    tables and colours
energy   what conserves energy
"""
