"""Tables of numbers in text files. csv_table reads birdstrike's own strictly; loose_table reads other people's."""
