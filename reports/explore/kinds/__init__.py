"""Folders that the page can be made of: one file a kind, with `KIND`, and one line in `registry`.

A kind says whether a folder is one of its own, and reads it into views. Read `campaign` (the smallest) first.
"""
