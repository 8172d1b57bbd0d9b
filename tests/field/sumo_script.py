"""Runs a script that was written for traci 1.8, which imported sumolib as a part of itself."""

import os
import runpy
import sys

import sumolib
import sumolib.net
import traci

traci.sumolib = sumolib
sys.argv = sys.argv[1:]
sys.path.insert(0, os.path.dirname(os.path.abspath(sys.argv[0])))
runpy.run_path(sys.argv[0], run_name="__main__")
