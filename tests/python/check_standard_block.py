"""Runs the standard block and checks the value at its probe; the time is shown, never judged."""
import json
import subprocess
import sys

EXPECTED = 1.592178e-2  # m: one Newton step from the predicted position, n = 20, after 12 steps
TOLERANCE = 5e-5  # relative: exact against warped tangent in that one Newton step

run = subprocess.run([sys.argv[1], "bench", "--set", "quick", "--only", "block", "-j", "2"], check=True, capture_output=True, text=True)
print(run.stderr, end="")
block = json.loads(run.stdout)["block"][0]
if (block["n"], block["steps"]) != (20, 12):
    sys.exit(f"ran n = {block['n']}, {block['steps']} steps, expected 20 and 12")
if abs(block["probe_m"] / EXPECTED - 1) > TOLERANCE:
    sys.exit(f"probe value {block['probe_m']:.6e}, expected {EXPECTED:.6e} within {TOLERANCE:g}")
