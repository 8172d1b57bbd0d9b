"""The examples of the package, in the folder that is given."""

import os
import pathlib
import runpy
import sys

for example in sorted(pathlib.Path(sys.argv[1]).glob("*.py")):
    # agents.py runs these on a road of their own.
    if example.stem.endswith("_follower"):
        continue
    print(example.name, flush=True)
    sys.argv = [str(example)]
    runpy.run_path(str(example))["main"](os.environ["OMNIBUS_TEST_MAP"])
