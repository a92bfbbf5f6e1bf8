"""Run README's examples, one after the other, as a reader would in one notebook."""

from __future__ import annotations

import os
import re
import subprocess
import sys
import tempfile
from pathlib import Path

root = Path(__file__).resolve().parents[1]
examples = re.findall(r"^```python\n(.*?)^```", (root / "README.md").read_text(), re.S | re.M)
if not examples:
    sys.exit("README.md: no examples found")
with tempfile.TemporaryDirectory() as folder:
    script = Path(folder, "examples.py")
    script.write_text("\n".join(examples))
    Path(folder, "data_samples").symlink_to(root / "data_samples")
    subprocess.run(
        [sys.executable, script], cwd=folder, env=os.environ | {"MPLBACKEND": "Agg"}, check=True
    )
print(f"{len(examples)} examples ran")
