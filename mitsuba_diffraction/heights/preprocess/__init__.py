"""Treatments of heights before a table is made of them.

Contents
--------
cropping    the middle of a patch
missing     points without data, filled
levelling   tilt, scan lines and outliers
periodic    opposite edges made to meet
edges       how far they are from meeting
treatment   what a treatment reports
"""
