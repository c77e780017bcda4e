"""Sections of a page, one a file: a function `section` from the results to headings, words, tables and pictures.

A new section is a file here and a line in SECTIONS of `page.page`; it returns None where it has nothing to say. Two
files are parts of a section: `models_tables` of `models`, `animation` of `pictures`. `parts` holds those of a page
about a campaign or an inversion by itself.
"""
