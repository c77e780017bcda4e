"""From a measured file to a case by questions with defaults.

Enters: answers, given one by one or in a TOML file. Leaves: `Shot`, the text of a commented case, and what its loop
will cost. Nothing is simulated here, and nobody is spoken to: `birdstrike.cli.start` does both. Read `answers` (a
question, where its answer comes from and is kept), `checks` (what may be answered), `shot` (the questions), `case_file`
(the case), `clock` (the record's zero), `cost`.
"""
