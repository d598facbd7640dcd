"""How cost grows: `python scaling.py OCTRAY FOLDER OUT [--most 7]` writes OUT/scaling.md.

10^3 to 10^7 spheres and triangles are made in FOLDER and removed again; one thread, `fast`, camera and shadow rays.
"""

import argparse
import json
import subprocess
from pathlib import Path

import geometry


def main():
    parse = argparse.ArgumentParser()
    for name in ["octray", "folder", "out"]:
        parse.add_argument(name, type=Path)
    parse.add_argument("--most", type=int, default=7)
    args = parse.parse_args()
    args.folder.mkdir(parents=True, exist_ok=True)
    args.out.mkdir(parents=True, exist_ok=True)
    head = ["geometry", "primitives", "build s", "Mprims/s", "bytes / primitive", "SAH", "camera", "shadow", "mirror", "diffuse"]
    table = [head, ["---"] * len(head)]
    for name, _ in geometry.scaling(args.folder, args.most):
        kind = "--mesh" if name.endswith(".mesh") else "--spheres"
        eye = ["--eye", "0,5,13", "--look", "0,-1,0"] if kind == "--mesh" else ["--eye", "0,0.6,3.4"]
        command = [args.octray, "rays", kind, args.folder / name, *eye, "--light", "5,9,7", "-p", "fast", "--size", "512"]
        run = subprocess.run([str(word) for word in command], capture_output=True, text=True, check=True)
        sets = [json.loads(line) for line in run.stdout.splitlines()]
        one = sets[0]
        n = one["primitives"]
        table.append([
            name.split("-")[0], n, f"{one['build_cpu_s']:.3f}", f"{n * 1e-6 / one['build_cpu_s']:.2f}", f"{one['bytes'] / n:.0f}",
            f"{one['sah']:.1f}", *(f"{s['mrays_cpu_s']:.2f}" for s in sets),
        ])
        (args.folder / name).unlink()
        (args.out / "scaling.md").write_text("".join("| " + " | ".join(map(str, row)) + " |\n" for row in table))
        print(table[-1], flush=True)


if __name__ == "__main__":
    main()
