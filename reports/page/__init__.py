"""Whole pages: the report of a loop, of a diagnosis, of an audit.

Enters: a folder. Leaves: one HTML file that loads nothing from outside. Read `page` (which sections, in which order:
the tuple SECTIONS), `render` (the template), then `diagnosis` and `audit`; the two scripts run in the reader's browser.
"""
