"""Files that loggers, spreadsheets and solvers write in formats of their own, one file a format.

A file enters, a `LooseTable` leaves, as of a text file: columns with names and, where the format has them, units. The
libraries that read them are the optional extras `exports` and `binout` (whose library wants pandas 2). Read registry,
columns, then a format; nodout and rcforc are LS-DYNA's text files.
"""
