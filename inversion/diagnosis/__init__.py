"""Diagnosis: is the miss of a calibrated model real, and which effect that the model lacks explains it?"""
