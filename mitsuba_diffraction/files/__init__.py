"""Everything that touches the disk: height-field loaders, recipes, tables, the cache.

Contents
--------
heights       from any file to a `HeightField`: which reader, which units
images        PNG, BMP, TIFF and EXR
arrays        NPY
text          grids of numbers
afm           instrument files (extra `afm`)
raw           what a reader takes out of a file
options       how a file is to be read and treated
recipes       TOML files that say where heights come from and what is made of them
table_exr     tables as EXR
colour_npz    colour tables as NPZ
cache         tables and colours, found by what they are made of
bound_cache   albedo bounds, likewise
atomic        all of a file or none of it
native        what native libraries print
"""
