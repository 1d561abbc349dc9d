"""What a scene asks of its diffraction tables: paths through it, and the tables that suffice.

Contents
--------
paths        paths through a scene, and what its BSDFs are asked on them
recording    records of look-ups, and plans that are followed while a scene loads
plan         `Plan`: how much of each table that takes, as a file
make         making one, and trying what it changes in the picture
report       what it found, as plain data, with the time of look-ups and how many fall outside
"""
