"""octray beside Embree on the same rays: `python rays.py OCTRAY EMBREE FOLDER OUT [--rounds N] [--only a,b]`.

FOLDER holds what `geometry.py` has written; ray sets are made there by octray (in double precision, whose hits both
engines are then compared with). Rounds are interleaved, one process of each engine after the other; a figure is the
median over rounds, in rays per second of processor time of one thread, so that it holds on a machine others use too.
Writes OUT/rays.csv and OUT/rays.md.
"""

import argparse
import csv
import json
import statistics
import subprocess
from pathlib import Path

SETS = ["camera", "shadow", "mirror", "diffuse"]


def lines(command):
    run = subprocess.run([str(word) for word in command], capture_output=True, text=True, check=True)
    return [json.loads(line) for line in run.stdout.splitlines()]


def main():
    parse = argparse.ArgumentParser()
    for name in ["octray", "embree", "folder", "out"]:
        parse.add_argument(name, type=Path)
    parse.add_argument("--rounds", type=int, default=7)
    parse.add_argument("--only", default="")
    parse.add_argument("--size", type=int, default=1024)
    args = parse.parse_args()
    args.out.mkdir(parents=True, exist_ok=True)
    views = json.loads((args.folder / "views.json").read_text())
    rows, summary = [], []
    for name, view in views.items():
        if args.only and name not in args.only.split(","):
            continue
        geometry = ["--mesh" if view["file"].endswith(".mesh") else "--spheres", args.folder / view["file"]]
        vector = lambda key: ",".join(map(str, view[key]))
        prefix = args.folder / name
        camera = ["--eye", vector("eye"), "--look", vector("look"), "--fov", view["fov"], "--light", vector("light")]
        lines([args.octray, "rays", *geometry, *camera, "--size", args.size, "-p", "strict", "--dump", prefix])
        files = [f"{prefix}.{one}.rays" for one in SETS]
        engines = {
            "embree": [args.embree, *geometry, *files],
            "fast": [args.octray, "rays", *geometry, "-p", "fast", *(w for f in files for w in ("--rays", f))],
            "exact": [args.octray, "rays", *geometry, "-p", "exact", *(w for f in files for w in ("--rays", f))],
        }
        rates, differs, built = {}, {}, {}
        for number in range(args.rounds):
            for engine, command in engines.items():
                for k, line in enumerate(lines(command)):
                    one = SETS[k // 2] if engine == "embree" else SETS[k]
                    mode = engine if engine != "embree" else "embree-coherent" if line["coherent"] else "embree-incoherent"
                    rates.setdefault((one, mode), []).append(line["mrays_cpu_s"])
                    differs[one, mode] = line["differs"]
                    built.setdefault(engine, []).append(line["primitives"] * 1e-6 / line["build_cpu_s"])
                    rows.append([name, one, mode, number, line["rays"], line["mrays_cpu_s"], line["build_cpu_s"], line["differs"]])
        for one in SETS:
            middle = {mode: statistics.median(rates[one, mode]) for s, mode in rates if s == one}
            best = max(middle["embree-coherent"], middle["embree-incoherent"])
            summary.append([
                name, one, f"{best:.2f}", f"{middle['fast']:.2f}", f"**{middle['fast'] / best:.2f}**",
                f"{middle['exact']:.2f}", f"{middle['exact'] / middle['fast']:.2f}",
                differs[one, "embree-incoherent"], differs[one, "fast"], differs[one, "exact"],
            ])
        rate = {engine: statistics.median(values) for engine, values in built.items()}
        summary.append([name, "build", *(f"{rate[e]:.2f}" for e in ("embree", "fast")), f"**{rate['fast'] / rate['embree']:.2f}**", f"{rate['exact']:.2f}", "", "", "", ""])
        print(name, flush=True)
        with open(args.out / "rays.csv", "w", newline="") as file:
            writer = csv.writer(file)
            writer.writerow(["geometry", "set", "engine", "round", "rays", "mrays_cpu_s", "build_cpu_s", "differs"])
            writer.writerows(rows)
        head = ["geometry", "rays", "Embree", "fast", "fast / Embree", "exact", "exact / fast", "Embree differs", "fast differs", "exact differs"]
        table = [head, ["---"] * len(head), *summary]
        (args.out / "rays.md").write_text("".join("| " + " | ".join(map(str, row)) + " |\n" for row in table))


if __name__ == "__main__":
    main()
