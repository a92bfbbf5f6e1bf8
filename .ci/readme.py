"""Run README's examples as a reader would, in one notebook, then its commands in a shell."""

from __future__ import annotations

import os
import re
import subprocess
import sys
import tempfile
from pathlib import Path

root = Path(__file__).resolve().parents[1]
readme = (root / "README.md").read_text()
examples = re.findall(r"^```python\n(.*?)^```", readme, re.S | re.M)
commands = re.findall(r"^\$ (.*)$", readme, re.M)
if not examples or not commands:
    sys.exit("README.md: no examples or no commands found")
environment = os.environ | {"MPLBACKEND": "Agg"}
with tempfile.TemporaryDirectory() as folder:
    script = Path(folder, "examples.py")
    script.write_text("\n".join(examples))
    Path(folder, "data_samples").symlink_to(root / "data_samples")
    subprocess.run([sys.executable, script], cwd=folder, env=environment, check=True)
    for command in commands:
        print("$", command, flush=True)
        subprocess.run(command, shell=True, cwd=folder, env=environment, check=True)
print(f"{len(examples)} examples and {len(commands)} commands ran")
