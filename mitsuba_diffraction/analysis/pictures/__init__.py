"""Pictures of patches and tables, as `info --picture` draws them.

Contents
--------
patches   heights, their distribution and spectrum, the light that they throw
albedo    how much light a table's surface reflects
"""
