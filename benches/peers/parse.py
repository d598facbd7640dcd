#!/usr/bin/env python3
"""Reads scenes with octray and with POV-Ray, by turns, and prints how long each takes.

    cargo build --release && benches/peers/parse.py

octray: processor time of reading and evaluating, as `octray check --times` says, and that of the whole process with its
start, the statistics it prints, and its end. POV-Ray: the processor time that its own statistics give for parsing, without
its start. One thread each, both with a picture of 8 by 8; the least of a few turns. The corpus is what the package
povray-examples installs, as far as POV-Ray reads it to the end. `--csv` keeps every figure.
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
    """Seconds of processor time, for reading and in all; None if the scene has errors."""
    process = subprocess.Popen([program, "check", "--times", "-W", "8", "-H", "8", scene.name], cwd=scene.parent,
                               stdout=subprocess.PIPE, stderr=subprocess.DEVNULL)
    said = process.stdout.read().decode(errors="replace")
    _, status, used = os.wait4(process.pid, 0)
    process.returncode = os.waitstatus_to_exitcode(status)
    found = re.search(r"read and evaluated in ([0-9.]+) s", said)
    return (float(found[1]), used.ru_utime + used.ru_stime) if found and process.returncode == 0 else None


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


def measured(program, scene, turns):
    """By turns: POV-Ray's seconds, octray's for reading, octray's in all; None if either does not read the scene."""
    theirs, ours = [], []
    for _ in range(turns):
        theirs.append(povray(scene))
        ours.append(octray(program, scene))
        if theirs[-1] is None or ours[-1] is None:
            return None
    return min(theirs), min(read for read, _ in ours), min(whole for _, whole in ours)


def main():
    arguments = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    arguments.add_argument("--octray", default=str(HERE.parent.parent / "target/release/octray"))
    arguments.add_argument("--turns", type=int, default=3)
    arguments.add_argument("--corpus", action="store_true", help="read the examples too (some minutes)")
    arguments.add_argument("--csv", type=Path)
    given = arguments.parse_args()
    lines = ["scene,povray_parse_s,octray_read_s,octray_process_s"]
    with tempfile.TemporaryDirectory() as folder:
        sheet, ball = Path(folder, "mesh2.scn"), Path(folder, "ball.scn")
        mesh(sheet)
        ball.write_text("#version 3.7;\nsphere { 0, 1 }\n")
        start = min(octray(given.octray, ball)[1] for _ in range(10))
        print(f"octray's start and end: {1e3 * start:.1f} ms\n")
        print("| scene | POV-Ray's parse, s | octray's, s | ratio | octray's process, s | ratio |")
        print("|---|---|---|---|---|---|")
        for scene in [*(HERE.parent / "parse" / f"{name}.scn" for name in ("draw", "loop", "tree")), sheet]:
            theirs, ours, whole = measured(given.octray, scene, given.turns)
            print(f"| {scene.stem} | {theirs:.3f} | {ours:.3f} | {theirs / ours:.1f} | {whole:.3f} | {theirs / whole:.1f} |")
            lines.append(f"{scene.stem},{theirs},{ours},{whole}")
    if given.corpus:
        all_of_them = []
        for scene in sorted(CORPUS.rglob("*.pov")):
            figures = measured(given.octray, scene, 1)
            if figures is None:
                print(f"left out: {scene}")
                continue
            all_of_them.append(figures)
            lines.append(f"{scene.relative_to(CORPUS)},{figures[0]},{figures[1]},{figures[2]}")
        theirs, ours, whole = (sum(column) for column in zip(*all_of_them))
        print(f"| {len(all_of_them)} examples | {theirs:.2f} | {ours:.2f} | {theirs / ours:.1f} | {whole:.2f} | {theirs / whole:.1f} |")
    if given.csv:
        given.csv.write_text("\n".join(lines) + "\n")


if __name__ == "__main__":
    main()
