"""Files written whole or not at all, the run store, the folders of results, and the way down to a value in them.

Enters: what runs and commands give. Leaves: files that are whole or absent. Read files, store, out_folder, tree.
"""
