"""The installation: one build, and the quick start of docs/python.md as it stands there."""

import importlib.metadata
import pathlib
import re
import subprocess
import sys

import omnibus
from omnibus import simulator

MANUAL = pathlib.Path(sys.argv[1])

program = simulator.find_program()
assert program.parent == pathlib.Path(sys.executable).parent, program
asked = subprocess.run([program, "--version"], capture_output=True, text=True, check=True)
assert asked.stdout.strip() == f"omnibus {omnibus.__build__}", asked.stdout
assert omnibus.__build__.startswith(f"{omnibus.__version__} (build "), omnibus.__build__
assert importlib.metadata.version("omnibus-sim") == omnibus.__version__
assert pathlib.Path(sys.prefix) in pathlib.Path(omnibus.__file__).parents

blocks = re.findall(r"^```python\n(.*?)^```", MANUAL.read_text(), re.MULTILINE | re.DOTALL)
exec(compile(blocks[0], str(MANUAL), "exec"), {"__name__": "quick_start"})
