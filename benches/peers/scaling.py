"""How cost grows: `python scaling.py OCTRAY FOLDER OUT [--most 7]` writes OUT/scaling.md.

10^3 to 10^7 spheres and triangles are made in FOLDER and removed again; one thread, `fast`. The build is also timed on the
wall with one thread and with two; `peak` is the most memory the process held, with the file and half a million rays in it.
"""

import argparse
import json
import os
import subprocess
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path

import geometry


def run(command):
    """The lines of a report, and the peak of the process in MB."""
    with subprocess.Popen([str(word) for word in command], stdout=subprocess.PIPE, text=True) as process:
        text = process.stdout.read()
        _, status, usage = os.wait4(process.pid, 0)
        process.returncode = os.waitstatus_to_exitcode(status)
    if process.returncode:
        raise SystemExit(f"{command[0]} failed")
    return [json.loads(line) for line in text.splitlines()], usage.ru_maxrss / 1024


def main():
    parse = argparse.ArgumentParser()
    for name in ["octray", "folder", "out"]:
        parse.add_argument(name, type=Path)
    parse.add_argument("--most", type=int, default=7)
    args = parse.parse_args()
    args.folder.mkdir(parents=True, exist_ok=True)
    args.out.mkdir(parents=True, exist_ok=True)
    head = ["geometry", "primitives", "build s", "Mprims/s", "wall of one, two threads", "peak MB", "bytes / primitive", "SAH", "camera", "shadow", "mirror", "diffuse"]
    table = [head, ["---"] * len(head)]
    # By a process of its own: what starts another counts into its peak.
    with ProcessPoolExecutor(1) as maker:
        made = maker.submit(geometry.scaling, args.folder, args.most).result()
    for name, _ in made:
        kind = "--mesh" if name.endswith(".mesh") else "--spheres"
        eye = ["--eye", "0,5,13", "--look", "0,-1,0"] if kind == "--mesh" else ["--eye", "0,0.6,3.4"]
        command = [args.octray, "rays", kind, args.folder / name, *eye, "--light", "5,9,7", "-p", "fast"]
        sets, peak = run([*command, "--size", "512"])
        [two], _ = run([*command, "--size", "8", "--sets", "camera", "--threads", "2"])
        one = sets[0]
        n = one["primitives"]
        table.append([
            name.split("-")[0], n, f"{one['build_cpu_s']:.3f}", f"{n * 1e-6 / one['build_cpu_s']:.2f}",
            f"{one['build_s']:.3f}, {two['build_s']:.3f}", f"{peak:.0f}", f"{one['bytes'] / n:.0f}",
            f"{one['sah']:.1f}", *(f"{s['mrays_cpu_s']:.2f}" for s in sets),
        ])
        (args.folder / name).unlink()
        (args.out / "scaling.md").write_text("".join("| " + " | ".join(map(str, row)) + " |\n" for row in table))
        print(table[-1], flush=True)


if __name__ == "__main__":
    main()
