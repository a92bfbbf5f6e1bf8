"""Run README's examples as a reader would, in one notebook, then its commands in a shell.

An example or a block of commands needs the extras that the line right before it installs, as
in: With `python -m pip install ".[daq]"`. Without an argument those run that need none; with
`--extras` those that need one, which therefore stand on their own.
"""

from __future__ import annotations

import os
import re
import subprocess
import sys
import tempfile
from pathlib import Path

root = Path(__file__).resolve().parents[1]
extras = sys.argv[1:] == ["--extras"]
if sys.argv[1:] and not extras:
    sys.exit(f"usage: {sys.argv[0]} [--extras]")
examples, commands = [], []
pattern = r"^([^\n]*)\n\n```(python|console)\n(.*?)^```"
for before, language, block in re.findall(pattern, (root / "README.md").read_text(), re.S | re.M):
    if bool(re.search(r'pip install "\.\[\w+\]"', before)) == extras:
        if language == "python":
            examples.append(block)
        else:
            commands += re.findall(r"^\$ (.*)$", block, re.M)
if not commands or not (examples or extras):
    sys.exit("README.md: no examples or no commands found")
environment = os.environ | {"MPLBACKEND": "Agg"}
with tempfile.TemporaryDirectory() as folder:
    Path(folder, "data_samples").symlink_to(root / "data_samples")
    script = Path(folder, "examples.py")
    script.write_text("\n".join(examples))
    subprocess.run([sys.executable, script], cwd=folder, env=environment, check=True)
    for command in commands:
        print("$", command, flush=True)
        subprocess.run(command, shell=True, cwd=folder, env=environment, check=True)
print(f"{len(examples)} examples and {len(commands)} commands ran")
