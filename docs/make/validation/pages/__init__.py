"""Writers of the parts of docs/validation.md and of the pages in docs/validation/.

Contents
--------
report         list of the pages, and the function that writes them
measurements   comparisons that the pages share, each computed on first use
front          docs/validation.md: the figures that users decide by
gratings       gratings of dielectrics and metals, by slope, profile and polarisation
surfaces       crossed gratings, cuts of scales and of a CD
layers         gratings under a coat and under a film
transmission   orders that go through, and the sum of reflected and transmitted light
conductor      a perfect conductor
solutions      accuracy of the rigorous solutions
numerics       closed forms and random surfaces
scans          hues of scanned gratings, and crops of a rough surface
plots          pictures
markdown       tables and numbers
"""
