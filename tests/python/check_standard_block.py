"""Runs the standard block and checks the value at its probe; the time is shown, never judged."""
import re
import subprocess
import sys

EXPECTED = 1.592178e-2  # m: one Newton step from the predicted position, n = 20, after 12 steps
TOLERANCE = 5e-5  # relative: exact against warped tangent in that one Newton step

output = subprocess.run([sys.argv[1], "20", "12"], check=True, capture_output=True, text=True).stdout
print(output, end="")
value = float(re.search(r"uy=(\S+)", output).group(1))
if abs(value / EXPECTED - 1) > TOLERANCE:
    sys.exit(f"probe value {value:.6e}, expected {EXPECTED:.6e} within {TOLERANCE:g}")
