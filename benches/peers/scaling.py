"""How cost grows: `python scaling.py OCTRAY FOLDER OUT [--embree EMBREE] [--most 7] [--rounds 3]` writes OUT/scaling.csv and
OUT/scaling.md.

10^3 to 10^7 spheres and triangles are made in FOLDER and removed again; one thread, `fast`. The build is also timed on the
wall with one thread and with two; `peak` is the most memory the process held, with the file and half a million rays in it.
Figures are medians over rounds. Below the table: exponents `k` of n^k, fitted from 10^4 on.

With `--embree`, OUT/beside.csv and OUT/beside.md hold octray and Embree on the same rays by turns, and their ratios: builds in
seconds of processor time, rays in millions a second. Embree's is the better of its flags for coherent and other rays, without that for edges without cracks.
"""

import argparse
import json
import math
import os
import statistics
import subprocess
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path

import geometry
import rays


def run(command):
    """The lines of a report, and the peak of the process in MB."""
    with subprocess.Popen([str(word) for word in command], stdout=subprocess.PIPE, text=True) as process:
        text = process.stdout.read()
        _, status, usage = os.wait4(process.pid, 0)
        process.returncode = os.waitstatus_to_exitcode(status)
    if process.returncode:
        raise SystemExit(f"{command[0]} failed")
    return [json.loads(line) for line in text.splitlines()], usage.ru_maxrss / 1024


def view_of(name):
    """A geometry and the camera that looks at it, as those of `views.json`."""
    eye, look = ([0, 5, 13], [0, -1, 0]) if name.endswith(".mesh") else ([0, 0.6, 3.4], [0, 0, 0])
    return {"file": name, "eye": eye, "look": look, "fov": 45, "light": [5, 9, 7], "size": 512}


COLUMNS = ["build_cpu_s", "build_s", "build_s_two", "peak_mb", "bytes", "sah", *rays.SETS]


def measure(args, name):
    """A row of the columns."""
    kind = "--mesh" if name.endswith(".mesh") else "--spheres"
    view = view_of(name)
    command = [args.octray, "rays", kind, args.folder / name, *rays.options(view, ["eye", "look", "fov", "light"]), "-p", "fast"]
    sets, peak = run([*command, *rays.options(view, ["size"]), "--repeat", "3"])
    [two], _ = run([*command, "--size", "8", "--sets", "camera", "--threads", "2"])
    one = sets[0]
    return one["primitives"], [one["build_cpu_s"], one["build_s"], two["build_s"], peak, one["bytes"], one["sah"],
                               *(line["mrays_cpu_s"] for line in sets)]


def beside(args, name, n):
    """octray and Embree on the same rays: rows of figures, round by round, and lines of the table."""
    peers, kind = rays.Geometry(args, name, view_of(name)), name.split("-")[0]
    figures = {"octray": [], "Embree": []}
    for number in range(args.rounds):
        # Either begins in turn.
        for engine in list(figures)[:: 1 if number % 2 else -1]:
            if engine == "octray":
                sets = peers.by_octray("fast", repeat=3)
            else:
                sets = [max(flags, key=lambda line: line["mrays_cpu_s"]) for flags in peers.by_embree(repeat=3)]
            figures[engine].append([sets[0]["build_cpu_s"], *(line["mrays_cpu_s"] for line in sets), sets[0]["bytes"] / n])
    for file in peers.files:
        Path(file).unlink()
    rows = [[kind, n, number, engine, *row] for engine, of in figures.items() for number, row in enumerate(of)]
    ratios = [[a / b for a, b in zip(*pair)] for pair in zip(figures["octray"], figures["Embree"])]
    lines = [[kind, n, engine, *(f"{statistics.median(column):.3g}" for column in zip(*of))]
             for engine, of in [*figures.items(), ("octray / Embree", ratios)]]
    return rows, lines


def exponent(points):
    """Of n by least squares of logarithms."""
    x, y = [math.log(n) for n, _ in points], [math.log(value) for _, value in points]
    mean_x, mean_y = statistics.mean(x), statistics.mean(y)
    return sum((a - mean_x) * (b - mean_y) for a, b in zip(x, y)) / sum((a - mean_x) ** 2 for a in x)


def main():
    parse = argparse.ArgumentParser()
    for name in ["octray", "folder", "out"]:
        parse.add_argument(name, type=Path)
    parse.add_argument("--embree", type=Path)
    parse.add_argument("--most", type=int, default=7)
    parse.add_argument("--rounds", type=int, default=3)
    args = parse.parse_args()
    args.folder.mkdir(parents=True, exist_ok=True)
    args.out.mkdir(parents=True, exist_ok=True)
    head = ["geometry", "primitives", "build s", "Mprims/s", "wall of one, two threads", "peak MB", "bytes / primitive", "SAH", *rays.SETS]
    table, rows, middles = [], [], {}
    # By a process of its own: what starts another counts into its peak.
    with ProcessPoolExecutor(1) as maker:
        made = maker.submit(geometry.scaling, args.folder, args.most).result()
    both, both_table = [], []
    for name, _ in made:
        measured = []
        for number in range(args.rounds):
            n, row = measure(args, name)
            measured.append(row)
            rows.append([name.split("-")[0], n, number, *row])
        if args.embree:
            found, lines = beside(args, name, n)
            both += found
            both_table += lines
            rays.write_csv(args.out / "beside.csv", ["geometry", "primitives", "round", "engine", "build_cpu_s", *rays.SETS, "bytes_each"], both)
            rays.write_table(args.out / "beside.md", ["geometry", "primitives", "engine", "build s", *rays.SETS, "bytes / primitive"], both_table)
        middle = dict(zip(COLUMNS, (statistics.median(values) for values in zip(*measured))))
        middles.setdefault(name.split("-")[0], []).append((n, middle))
        table.append([
            name.split("-")[0], n, f"{middle['build_cpu_s']:.3f}", f"{n * 1e-6 / middle['build_cpu_s']:.2f}",
            f"{middle['build_s']:.3f}, {middle['build_s_two']:.3f}", f"{middle['peak_mb']:.0f}", f"{middle['bytes'] / n:.0f}",
            f"{middle['sah']:.1f}", *(f"{middle[one]:.2f}" for one in rays.SETS),
        ])
        (args.folder / name).unlink()
        rays.write_table(args.out / "scaling.md", head, table)
        text = ""
        for kind, points in middles.items():
            points = [(n, middle) for n, middle in points if n > 5000]
            if len(points) > 1:
                of = lambda column: exponent([(n, middle[column]) for n, middle in points])
                text += f"\n{kind}: build n^{of('build_cpu_s'):.2f}; a ray's time, " + ", ".join(f"{one} n^{-of(one):.2f}" for one in rays.SETS) + "\n"
        with open(args.out / "scaling.md", "a") as file:
            file.write(text)
        rays.write_csv(args.out / "scaling.csv", ["geometry", "primitives", "round", *COLUMNS], rows)
        print(table[-1], flush=True)


if __name__ == "__main__":
    main()
