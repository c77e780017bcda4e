"""Tables of numbers in text files: csv_table reads birdstrike's own strictly, loose_table other people's.

Of the latter clock finds the column of the times, and import_line says how they are imported.
"""
