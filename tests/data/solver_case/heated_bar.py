"""A solver for tests: a bar of five nodes whose temperature is power · x / length, and ways to fail where told to.

Its input file says power (W), length (mm) and what is to go wrong, by the power at which it does.
"""

import json
import os
import subprocess
import sys
import time

import numpy as np

case = sys.argv[1]
with open(f"{case}.in", encoding="utf-8") as file:
    said = json.load(file)
power, length = said["power in mW"] / 1000, said["length in mm"]
fault = next((name for name, low, high in said["faults"] if low <= power < high), "")
sys.stdout.write(f"heated bar: power {power:g} W\n")
sys.stdout.flush()  # a program that is killed keeps what it has not written out
if log := said.get("log"):
    with open(log, "a", encoding="utf-8") as file:
        file.write(f"begin {case}\n")
time.sleep(said.get("seconds", 0.0))
if fault == "hangs":
    subprocess.Popen([sys.executable, "-c", "import time; time.sleep(600)"])
    with open("processes.txt", "w", encoding="utf-8") as file:
        file.write(str(os.getpid()))
    time.sleep(600)
if fault == "exits":
    sys.stderr.write("ERROR: the matrix is singular\n")
    sys.exit(1)
if fault == "silent":
    sys.exit(0)
if fault == "says":
    sys.stdout.write(" *ERROR in nonlingeo: increment size too small\n")
count = 7 if fault == "remeshed" else 5
x = np.linspace(0.0, 1.0, count)
temperature = power * x[None, :]
if fault == "nan":
    temperature[0, 2] = np.nan
points = np.stack([length * x, 0 * x, 0 * x], axis=1)
arrays = {"points": points, "temperature": temperature, "heat": np.array([power])}
with open(f"{case}.npz", "wb") as file:
    np.savez(file, **arrays)
if fault == "half":
    size = os.path.getsize(f"{case}.npz")
    os.truncate(f"{case}.npz", size // 2)
if log:
    with open(log, "a", encoding="utf-8") as file:
        file.write(f"end {case}\n")
