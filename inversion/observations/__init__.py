"""What is used of a measured record: one reader for calibration and diagnosis.

A `Measured` file and what its case or campaign says of it enter; channels with cut points, noise and remarks leave.
Read expected, reader, before_contact, noise, autocorrelation, high_frequency, baseline, outliers; then observations (a
record as a calibration uses it), filters and filtered_records, plausibility and prior_predictive (can the campaign's
model produce the record at all?), and raw (a record by itself).
"""
