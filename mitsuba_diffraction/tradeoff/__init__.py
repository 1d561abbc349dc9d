"""Accuracy against speed and memory, setting by setting; `mitsuba-diffraction tradeoff` prints it.

Contents
--------
settings     what tables are tried
sample       directions where a patch sends light, and the exact answer there
measure      error, colours, time and memory of each setting
wavelengths  steps of sums over the spectrum, and how many wavelengths a ray needs
depth        where Taylor's series breaks down, and the others do not
recommend    the cheapest setting within a budget
plot         the pictures
"""
