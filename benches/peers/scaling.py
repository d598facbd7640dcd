"""How cost grows: `python scaling.py OCTRAY FOLDER OUT [--embree EMBREE] [--most 7] [--rounds 3]` writes OUT/scaling.csv and
OUT/scaling.md.

10^3 to 10^7 spheres and triangles are made in FOLDER and removed again; one thread, `fast`. The build is also timed on the
wall with one thread and with two; `peak` is the most memory the process held, with the file and half a million rays in it.
Figures are medians over rounds. Below the table: exponents `k` of n^k, fitted from 10^4 on.

With `--embree`, OUT/beside.csv and OUT/beside.md hold octray and Embree on the same rays by turns, and their ratios: builds in
seconds of processor time, rays in millions a second. Embree's is the better of its flags for coherent and other rays, without that for edges without cracks.
"""

import argparse
import csv
import json
import math
import os
import statistics
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


def view_of(name):
    """Options of the camera that looks at a geometry."""
    eye = ["--eye", "0,5,13", "--look", "0,-1,0"] if name.endswith(".mesh") else ["--eye", "0,0.6,3.4"]
    return [*eye, "--light", "5,9,7"]


COLUMNS = ["build_cpu_s", "build_s", "build_s_two", "peak_mb", "bytes", "sah", "camera", "shadow", "mirror", "diffuse"]


def measure(args, name):
    """A row of the columns."""
    kind = "--mesh" if name.endswith(".mesh") else "--spheres"
    command = [args.octray, "rays", kind, args.folder / name, *view_of(name), "-p", "fast"]
    sets, peak = run([*command, "--size", "512", "--repeat", "3"])
    [two], _ = run([*command, "--size", "8", "--sets", "camera", "--threads", "2"])
    one = sets[0]
    return one["primitives"], [one["build_cpu_s"], one["build_s"], two["build_s"], peak, one["bytes"], one["sah"],
                               *(line["mrays_cpu_s"] for line in sets)]


class Beside:
    """octray and Embree on the same rays, if that is asked for."""

    COLUMNS = ["build_cpu_s", "camera", "shadow", "mirror", "diffuse"]

    def __init__(self, args):
        self.args, self.rows = args, []
        head = ["geometry", "primitives", "engine", "build s", *self.COLUMNS[1:], "bytes / primitive"]
        self.table = [head, ["---"] * len(head)]

    def begin(self, name):
        """Makes the rays of a geometry."""
        if self.args.embree:
            self.name, self.measured = name, []
            self.shape = ["--mesh" if name.endswith(".mesh") else "--spheres", self.args.folder / name]
            prefix = self.args.folder / name
            run([self.args.octray, "rays", *self.shape, *view_of(name), "--size", "512", "-p", "strict", "--dump", prefix])
            self.files = [Path(f"{prefix}.{one}.rays") for one in self.COLUMNS[1:]]

    def measure(self, n, number):
        """Traces them by one engine and the other, beginning with either in turn."""
        if not self.args.embree:
            return
        given = [word for file in self.files for word in ("--rays", file)]
        row = {}
        for engine in ["octray", "Embree"][:: 1 if number % 2 else -1]:
            if engine == "octray":
                sets, _ = run([self.args.octray, "rays", *self.shape, "-p", "fast", "--repeat", "3", *given])
            else:
                # Two lines for each set: with the flag for coherent rays, and with that for others.
                pairs, _ = run([self.args.embree, *self.shape, "--repeat", "3", *self.files])
                sets = [max(pair, key=lambda line: line["mrays_cpu_s"]) for pair in zip(pairs[::2], pairs[1::2])]
            row[engine] = [sets[0]["build_cpu_s"], *(line["mrays_cpu_s"] for line in sets), sets[0]["bytes"] / n]
            self.rows.append([self.name.split("-")[0], n, number, engine, *row[engine]])
        self.measured.append(row)
        self.n = n

    def end(self):
        """Removes the rays and writes what is known."""
        if not self.args.embree:
            return
        for file in self.files:
            file.unlink()
        middle = {
            engine: [statistics.median(values) for values in zip(*(row[engine] for row in self.measured))]
            for engine in ["octray", "Embree"]
        }
        times = [statistics.median(row["octray"][k] / row["Embree"][k] for row in self.measured) for k in range(6)]
        kind = self.name.split("-")[0]
        for engine, values in [*middle.items(), ("octray / Embree", times)]:
            self.table.append([kind, self.n, engine, *(f"{value:.3g}" for value in values)])
        text = "".join("| " + " | ".join(map(str, row)) + " |\n" for row in self.table)
        (self.args.out / "beside.md").write_text(text)
        with open(self.args.out / "beside.csv", "w", newline="") as file:
            csv.writer(file).writerows([["geometry", "primitives", "round", "engine", *self.COLUMNS, "bytes_each"], *self.rows])


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
    head = ["geometry", "primitives", "build s", "Mprims/s", "wall of one, two threads", "peak MB", "bytes / primitive", "SAH", "camera", "shadow", "mirror", "diffuse"]
    table, rows, middles = [head, ["---"] * len(head)], [], {}
    # By a process of its own: what starts another counts into its peak.
    with ProcessPoolExecutor(1) as maker:
        made = maker.submit(geometry.scaling, args.folder, args.most).result()
    peers = Beside(args)
    for name, _ in made:
        measured = []
        peers.begin(name)
        for number in range(args.rounds):
            n, row = measure(args, name)
            measured.append(row)
            rows.append([name.split("-")[0], n, number, *row])
            peers.measure(n, number)
        peers.end()
        middle = dict(zip(COLUMNS, (statistics.median(values) for values in zip(*measured))))
        middles.setdefault(name.split("-")[0], []).append((n, middle))
        table.append([
            name.split("-")[0], n, f"{middle['build_cpu_s']:.3f}", f"{n * 1e-6 / middle['build_cpu_s']:.2f}",
            f"{middle['build_s']:.3f}, {middle['build_s_two']:.3f}", f"{middle['peak_mb']:.0f}", f"{middle['bytes'] / n:.0f}",
            f"{middle['sah']:.1f}", *(f"{middle[one]:.2f}" for one in COLUMNS[-4:]),
        ])
        (args.folder / name).unlink()
        text = "".join("| " + " | ".join(map(str, row)) + " |\n" for row in table)
        for kind, points in middles.items():
            points = [(n, middle) for n, middle in points if n > 5000]
            if len(points) > 1:
                of = lambda column: exponent([(n, middle[column]) for n, middle in points])
                text += f"\n{kind}: build n^{of('build_cpu_s'):.2f}; a ray's time, " + ", ".join(f"{one} n^{-of(one):.2f}" for one in COLUMNS[-4:]) + "\n"
        (args.out / "scaling.md").write_text(text)
        with open(args.out / "scaling.csv", "w", newline="") as file:
            csv.writer(file).writerows([["geometry", "primitives", "round", *COLUMNS], *rows])
        print(table[-1], flush=True)


if __name__ == "__main__":
    main()
