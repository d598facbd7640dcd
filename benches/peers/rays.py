"""octray beside Embree on the same rays: `python rays.py OCTRAY EMBREE FOLDER OUT [--rounds N] [--repeat N] [--only a,b] [--best]`.

FOLDER holds what `geometry.py` has written; ray sets are made there by octray in double precision (`strict`). Rounds are
interleaved, one process of each engine after the other, each round beginning with another and every second backward; in a process each set is traced
`--repeat` times, of which the middle counts: the first pays for memory that nobody has touched, and three are over within one slow
spell of a shared host. A figure is the median over rounds, in rays per second of processor time of one thread, so that it holds on a
machine others use too. `Embree` is the better of its two flags, as its scenes are without and with `RTC_SCENE_FLAG_ROBUST`.

How many answers differ (hit against miss, or a distance by over 1e-5 of it) is counted twice: from those in double precision, and
those of `fast` from Embree's with and without the robust flag.

`--best` gives each engine the best tree that it builds (octray's `--build best`, Embree's RTC_BUILD_QUALITY_HIGH) in place of the one
that it builds unless told otherwise.

Writes OUT/rays.csv (rates and builds), OUT/answers.csv, and as tables OUT/rays.md, OUT/builds.md and OUT/answers.md.
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


def options(view, keys):
    vector = lambda value: ",".join(map(str, value)) if isinstance(value, list) else str(value)
    return [word for key in keys for word in (f"--{key}", vector(view[key]))]


def write_table(path, head, rows):
    text = [head, ["---"] * len(head), *rows]
    path.write_text("".join("| " + " | ".join(map(str, row)) + " |\n" for row in text))


def write_csv(path, head, rows):
    with open(path, "w", newline="") as file:
        csv.writer(file).writerows([head, *rows])


class Geometry:
    """A file of geometry, its ray sets, and the ways to trace them."""

    def __init__(self, args, name, view, best=False):
        self.name = name
        shape = ["--mesh" if view["file"].endswith(".mesh") else "--spheres", args.folder / view["file"]]
        self.octray, self.embree = [args.octray, "rays", *shape], [args.embree, *shape]
        prefix = args.folder / name
        if best:
            self.octray += ["--build", "best"]
            self.embree.append("--high")
        camera = options(view, ["eye", "look", "fov", "light", "size"])
        lines([*self.octray, *camera, "-p", "strict", "--dump", prefix])
        self.files = [f"{prefix}.{one}.rays" for one in SETS]

    def by_octray(self, precision, suffix="", repeat=1):
        files = [word for file in self.files for word in ("--rays", file + suffix)]
        return lines([*self.octray, "-p", precision, "--repeat", repeat, *files])

    def by_embree(self, *flags, repeat=1):
        """Two lines for each set: with the flag for coherent rays, and with that for others."""
        pairs = lines([*self.embree, *flags, "--repeat", repeat, *self.files])
        return [[one, other] for one, other in zip(pairs[::2], pairs[1::2])]

    def answers(self):
        """Of each set: rays, and how many answers differ, by who is held against whom."""
        embree = self.by_embree("--answers", ".embree")
        robust = self.by_embree("--answers", ".robust", "--robust")
        pairs = {
            "Embree / strict": [pair[1] for pair in embree],
            "Embree robust / strict": [pair[1] for pair in robust],
            "fast / strict": self.by_octray("fast"),
            "exact / strict": self.by_octray("exact"),
            "fast / Embree": self.by_octray("fast", ".embree"),
            "fast / Embree robust": self.by_octray("fast", ".robust"),
            "strict / Embree robust": self.by_octray("strict", ".robust"),
        }
        for suffix in [".embree", ".robust"]:
            for file in self.files:
                Path(file + suffix).unlink()
        return [[self.name, one, line["rays"], *(found[k]["differs"] for found in pairs.values())]
                for k, (one, line) in enumerate(zip(SETS, pairs["fast / strict"]))], list(pairs)

    def round(self, number, repeat):
        """A line of the table of seconds for each engine, flag and set."""
        engines = {
            "embree": lambda: self.by_embree(repeat=repeat),
            "fast": lambda: self.by_octray("fast", repeat=repeat),
            "exact": lambda: self.by_octray("exact", repeat=repeat),
            "robust": lambda: self.by_embree("--robust", repeat=repeat),
        }
        names = list(engines)
        names = names[number % len(names):] + names[:number % len(names)]
        # What ran before says how much of the memory is fresh: so forward and backward in turn.
        for engine in names if number % 2 == 0 else names[::-1]:
            for one, found in zip(SETS, engines[engine]()):
                for line in found if isinstance(found, list) else [found]:
                    mode = {None: "", True: " coherent", False: " incoherent"}[line.get("coherent")]
                    yield [self.name, one, engine + mode, number, line["rays"], line["mrays_cpu_s"],
                           line["primitives"], line["build_cpu_s"], line["bytes"], line.get("sah", "")]


def summed_up(name, rows):
    """Lines of the table: medians over rounds, the median of the rounds' own ratios (of a host with two speeds the medians of two
    engines may be of different ones), and the best of each."""
    rates = {}
    for _, one, engine, _, _, rate, *_ in rows:
        rates.setdefault((one, engine), []).append(rate)

    def better(one, engine, of):
        """The rates with that of its flags of which `of` them is more."""
        return max((rates[one, engine + flag] for flag in (" coherent", " incoherent")), key=of)

    for one in SETS:
        fast, exact = rates[one, "fast"], rates[one, "exact"]
        middle, best = statistics.median(fast), max(fast)
        beside = better(one, "embree", statistics.median)
        embree, robust = statistics.median(beside), statistics.median(better(one, "robust", statistics.median))
        by_rounds = statistics.median(ours / theirs for ours, theirs in zip(fast, beside))
        dearer = statistics.median(double / single for double, single in zip(exact, fast))
        yield [name, one, f"{embree:.2f}", f"{robust:.2f}", f"{middle:.2f}", f"**{middle / embree:.2f}**",
               f"{by_rounds:.2f}", f"{best / max(better(one, 'embree', max)):.2f}", f"{middle / robust:.2f}",
               f"{statistics.median(exact):.2f}", f"{statistics.median(exact) / middle:.2f}", f"{dearer:.2f}"]


def builds(name, rows):
    """A line of the table of builds: medians over rounds, bytes of tree and geometry, octray's SAH cost."""
    rates, held, sah = {}, {}, {}
    for _, _, engine, _, _, _, primitives, build_s, size, cost in rows:
        engine = engine.split()[0]
        rates.setdefault(engine, []).append(primitives * 1e-6 / build_s)
        held[engine], sah[engine] = size / primitives, cost
    middle = {engine: statistics.median(values) for engine, values in rates.items()}
    best = {engine: max(values) for engine, values in rates.items()}
    yield [name, *(f"{middle[engine]:.2f}" for engine in ("embree", "fast", "exact")), f"**{middle['fast'] / middle['embree']:.2f}**",
           f"{best['fast'] / best['embree']:.2f}", *(f"{held[engine]:.0f}" for engine in ("embree", "fast", "exact")), f"{sah['fast']:.1f}"]


def main():
    parse = argparse.ArgumentParser()
    for name in ["octray", "embree", "folder", "out"]:
        parse.add_argument(name, type=Path)
    parse.add_argument("--rounds", type=int, default=7)
    parse.add_argument("--repeat", type=int, default=9)
    parse.add_argument("--only", default="")
    parse.add_argument("--best", action="store_true")
    args = parse.parse_args()
    args.out.mkdir(parents=True, exist_ok=True)
    rows, table, built, differing = [], [], [], []
    for name, view in json.loads((args.folder / "views.json").read_text()).items():
        if args.only and name not in args.only.split(","):
            continue
        geometry = Geometry(args, name, view, args.best)
        found, pairs = geometry.answers()
        differing += found
        own = [row for number in range(args.rounds) for row in geometry.round(number, args.repeat)]
        rows += own
        table += summed_up(name, own)
        built += builds(name, own)
        print(name, flush=True)
        write_csv(args.out / "rays.csv", ["geometry", "set", "engine", "round", "rays", "mrays_cpu_s", "primitives", "build_cpu_s", "bytes", "sah"], rows)
        write_table(args.out / "rays.md", ["geometry", "rays", "Embree", "robust", "fast", "fast / Embree", "by rounds", "best / best", "fast / robust", "exact", "exact / fast", "exact / fast by rounds"], table)
        write_table(args.out / "builds.md", ["geometry", "Embree Mprims/s", "fast", "exact", "fast / Embree", "best / best", "Embree bytes a primitive", "fast", "exact", "SAH"], built)
        head = ["geometry", "set", "rays", *pairs]
        write_csv(args.out / "answers.csv", head, differing)
        write_table(args.out / "answers.md", head, differing)


if __name__ == "__main__":
    main()
