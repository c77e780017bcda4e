"""What a laboratory adds to birdstrike without touching it: its gelatine, its sensor, and an effect of its plates."""
