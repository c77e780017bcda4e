"""Effects that a model may lack: for each, the tables of a case that it changes at a magnitude.

A case as declared and a magnitude enter, tables written as in a case file leave; `case.effects` puts them in place.
Read effect, fault (of an instrument), then a family (plate, bird, impact, instrument), then registry.
"""
