"""What another code computed for a deck that birdstrike wrote.

sensors: the file beside the deck that says which nodes, contacts and elements stand for the case's sensors; results:
that file and the code's own result files enter, histories of the sensors leave.
"""
