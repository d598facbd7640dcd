#!/usr/bin/env python3
"""Reads scenes with octray and with POV-Ray, by turns, and prints how long each takes.

    cargo build --release && benches/peers/parse.py

octray: processor time of the whole process `octray check`, and the same less that of checking a scene of one sphere.
POV-Ray: the processor time that its own statistics give for parsing, without its start. One thread each; the least
of a few turns. The corpus is what the package povray-examples installs, as far as POV-Ray reads it to the end.
"""

import argparse
import math
import os
import re
import subprocess
import tempfile
from pathlib import Path

HERE = Path(__file__).resolve().parent
CORPUS = Path("/usr/share/doc/povray/examples")


def mesh(path, n=501):
    """A wavy sheet of 2 (n-1)^2 triangles with vertex normals, written out as a mesh2."""
    points, normals, faces = [], [], []
    for j in range(n):
        for i in range(n):
            x, z = 2 * i / (n - 1) - 1, 2 * j / (n - 1) - 1
            dx, dz = math.cos(5 * x) * math.cos(4 * z), -0.8 * math.sin(5 * x) * math.sin(4 * z)
            size = math.sqrt(1 + dx * dx + dz * dz)
            points.append(f"  <{x:.6f}, {0.2 * math.sin(5 * x) * math.cos(4 * z):.6f}, {z:.6f}>")
            normals.append(f"  <{-dx / size:.6f}, {1 / size:.6f}, {-dz / size:.6f}>")
            if i < n - 1 and j < n - 1:
                a = j * n + i
                faces += [f"  <{a}, {a + 1}, {a + n}>", f"  <{a + 1}, {a + n + 1}, {a + n}>"]
    lists = {"vertex_vectors": points, "normal_vectors": normals, "face_indices": faces}
    blocks = [f" {word} {{\n {len(rows)},\n" + ",\n".join(rows) + "\n }" for word, rows in lists.items()]
    head = "#version 3.7;\nglobal_settings { assumed_gamma 1 }\ncamera { location <0, 2, -3> look_at 0 }\n"
    path.write_text(head + "mesh2 {\n" + "\n".join(blocks) + "\n pigment { rgb 0.7 }\n}\n")


def octray(program, scene):
    """Seconds of processor time; None if the scene has errors."""
    process = subprocess.Popen([program, "check", scene.name], cwd=scene.parent,
                               stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    _, status, used = os.wait4(process.pid, 0)
    process.returncode = os.waitstatus_to_exitcode(status)
    return used.ru_utime + used.ru_stime if process.returncode == 0 else None


def povray(scene):
    """Seconds of processor time for parsing; None if POV-Ray gives none."""
    command = ["povray", f"+I{scene.name}", "+W8", "+H8", "-D", "-F", "+WT1"]
    try:
        done = subprocess.run(command, cwd=scene.parent, capture_output=True, text=True, timeout=120,
                              stdin=subprocess.DEVNULL)
    except subprocess.TimeoutExpired:
        return None
    found = re.search(r"Parse Time:.*\n.*with ([0-9.]+) CPU-seconds", done.stderr)
    return float(found[1]) if found and done.returncode == 0 else None


def least(values):
    values = [value for value in values if value is not None]
    return min(values) if values else None


def main():
    arguments = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    arguments.add_argument("--octray", default=str(HERE.parent.parent / "target/release/octray"))
    arguments.add_argument("--turns", type=int, default=3)
    arguments.add_argument("--corpus", action="store_true", help="read the examples too (some minutes)")
    given = arguments.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        sheet, ball = Path(folder, "mesh2.scn"), Path(folder, "ball.scn")
        mesh(sheet)
        ball.write_text("#version 3.7;\nsphere { 0, 1 }\n")
        start = least(octray(given.octray, ball) for _ in range(10))
        print(f"octray's start: {1e3 * start:.1f} ms")
        print(f"{'scene':8} {'POV-Ray s':>10} {'octray s':>9} {'ratio':>6}")
        for scene in [*(HERE.parent / "parse" / f"{name}.scn" for name in ("draw", "loop", "tree")), sheet]:
            turns = [(povray(scene), octray(given.octray, scene)) for _ in range(given.turns)]
            theirs, ours = least(t[0] for t in turns), least(t[1] for t in turns)
            print(f"{scene.stem:8} {theirs:10.3f} {ours:9.3f} {theirs / ours:6.1f}")
    if given.corpus:
        sums, count, ratios = [0.0, 0.0, 0.0], 0, []
        for scene in sorted(CORPUS.rglob("*.pov")):
            theirs = povray(scene)
            ours = least(octray(given.octray, scene) for _ in range(given.turns))
            if theirs is None or ours is None:
                print(f"left out, POV-Ray {theirs}, octray {ours}: {scene}")
                continue
            for slot, value in enumerate((theirs, ours, max(ours - start, 0.0))):
                sums[slot] += value
            ratios.append((theirs / ours, scene))
            count += 1
        print(f"{count} examples: POV-Ray {sums[0]:.2f} s, octray {sums[1]:.2f} s, without its start {sums[2]:.2f} s: "
              f"{sums[0] / sums[1]:.1f} and {sums[0] / sums[2]:.1f} times")
        ratios.sort()
        for ratio, scene in ratios[:10]:
            print(f"slowest: {ratio:.2f} {scene}")


if __name__ == "__main__":
    main()
