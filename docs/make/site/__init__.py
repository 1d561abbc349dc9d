"""Hooks of mkdocs.yml: `make site` builds README and docs/ as pages for a browser.

The pages need no network: formulas become MathML when the site is built, and fonts, scripts and the
index of the search are files of the site.

Contents
--------
hooks         functions that MkDocs calls
links         links between pages, and files of the repository that pages link to
formulas      LaTeX to MathML
reference     page of the public names
descriptions  parameters and attributes on that page
"""
