"""The command line with the stand-in for the solver, as a process that tests can kill: DIARY SECONDS ARGUMENTS..."""

from __future__ import annotations

import sys
from functools import partial
from pathlib import Path

import birdstrike.solver.simulate
import birdstrike.solver.version
from birdstrike.__main__ import main
from tests.doe.stand_in import VERSION, strike

if __name__ == "__main__":
    diary, seconds, *arguments = sys.argv[1:]
    birdstrike.solver.simulate.simulate = partial(strike, diary=Path(diary), seconds=float(seconds))  # type: ignore[assignment]
    birdstrike.solver.version.SOLVER_VERSION = (
        VERSION  # the stand-in's runs are not the solver's, whatever its sources are
    )
    sys.argv[1:] = arguments
    main()
