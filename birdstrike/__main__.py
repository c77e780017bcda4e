"""`python -m birdstrike` is `birdstrike`."""

from birdstrike.cli.app import main

if __name__ == "__main__":
    main()
