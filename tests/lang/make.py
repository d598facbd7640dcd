#!/usr/bin/env python3
"""Records what POV-Ray's #debug writes for each scene here, as NAME.out beside NAME.scn.

The tests compare octray with these files and need no POV-Ray. To make them anew where `povray` 3.7 is installed:

    python3 tests/lang/make.py [NAME...]

Recorded with POV-Ray 3.7.0.10 (Debian), command: povray +INAME.scn +W4 +H4 -D +Oout.png +GDNAME.out
"""

import pathlib
import subprocess
import sys
import tempfile

here = pathlib.Path(__file__).parent
names = sys.argv[1:] or sorted(path.stem for path in here.glob("*.scn"))
for name in names:
    with tempfile.TemporaryDirectory() as folder:
        command = ["povray", f"+I{here / (name + '.scn')}", "+W4", "+H4", "-D", "+Oout.png", "+GDout.txt", f"+L{here}"]
        done = subprocess.run(command, cwd=folder, capture_output=True, text=True, errors="replace")
        text = pathlib.Path(folder, "out.txt")
        if done.returncode != 0:
            print(f"{name}: povray says", [line for line in done.stderr.splitlines() if "rror" in line][:3])
        (here / f"{name}.out").write_bytes(text.read_bytes() if text.exists() else b"")
