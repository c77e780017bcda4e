"""The command line: one file a command, with the Python verb of the same name where it has no place below.

In: arguments and options. Out: lines on the terminal, files, an exit code, with --json one machine-readable last line.
Read in this order: app.py (the commands), frame.py (how each ends), options.py (what several ask), any command;
campaign_bar.py is the progress bar of those that run campaigns.
"""
