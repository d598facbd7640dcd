"""octray beside POV-Ray on whole frames: `python frames.py OCTRAY OUT SCENE... [--rounds N] [--size WxH] [-L DIR]`.

Rounds are interleaved: of each scene a frame by POV-Ray with one thread, then octray in each precision with one thread
and with two. Compared is the time of tracing alone, as each program reports it: POV-Ray's processor seconds of the trace,
octray's wall-clock seconds of its one thread (at least its processor seconds, so octray is never flattered). Figures
are medians over rounds. Writes OUT/frames.csv and OUT/frames.md.
"""

import argparse
import csv
import json
import re
import statistics
import subprocess
from pathlib import Path


def povray(scene, args):
    width, height = args.size.split("x")
    command = ["povray", f"+I{scene}", f"+W{width}", f"+H{height}", "-F", "-D", "-A", "-V", "+WT1"]
    command += [f"+L{folder}" for folder in args.library]
    run = subprocess.run(command, capture_output=True, text=True, errors="replace", check=True)
    trace = run.stderr[run.stderr.index("Trace Time"):]
    return float(re.search(r"using \d+ thread\(s\) with ([\d.]+) CPU", trace)[1])


def octray(scene, precision, threads, args):
    width, height = args.size.split("x")
    command = [args.octray, "render", scene, "-W", width, "-H", height, "-t", threads, "-p", precision]
    command += ["-q", "--allow-missing", "--stats", "-", "-o", args.out / "frame.ppm"]
    command += [word for folder in args.library for word in ("-L", folder)]
    run = subprocess.run([str(word) for word in command], capture_output=True, text=True, check=True)
    return json.loads(run.stdout)


def main():
    parse = argparse.ArgumentParser()
    parse.add_argument("octray", type=Path)
    parse.add_argument("out", type=Path)
    parse.add_argument("scenes", type=Path, nargs="+")
    parse.add_argument("--rounds", type=int, default=7)
    parse.add_argument("--size", default="1024x768")
    parse.add_argument("--threads", default="1,2", help="one thread always, two to see what they gain")
    parse.add_argument("-L", "--library", action="append", default=[])
    args = parse.parse_args()
    args.out.mkdir(parents=True, exist_ok=True)
    rows, times, rays = [], {}, {}
    for number in range(args.rounds):
        for scene in args.scenes:
            found = {"povray": povray(scene, args)}
            for precision in ["exact", "fast"]:
                for threads in args.threads.split(","):
                    stats = octray(scene, precision, threads, args)
                    found[f"{precision} x{threads}"] = stats["trace_s"]
                    rays[scene.stem] = sum(stats["rays"].values())
            for engine, seconds in found.items():
                times.setdefault((scene.stem, engine), []).append(seconds)
                rows.append([scene.stem, engine, number, seconds])
    (args.out / "frame.ppm").unlink(missing_ok=True)
    with open(args.out / "frames.csv", "w", newline="") as file:
        csv.writer(file).writerows([["scene", "engine", "round", "trace_s"], *rows])
    engines = ["povray", "exact x1", "fast x1"]
    head = ["scene", "Mrays", "POV-Ray s", "exact s", "POV-Ray / exact", "fast s", "POV-Ray / fast"]
    if "2" in args.threads.split(","):
        engines.append("exact x2")
        head.append("exact, two threads")
    table = [head, ["---"] * len(head)]
    for scene in args.scenes:
        pov, exact, fast, *two = (statistics.median(times[scene.stem, engine]) for engine in engines)
        table.append([
            scene.stem, f"{rays[scene.stem] * 1e-6:.2f}", f"{pov:.2f}", f"{exact:.3f}", f"**{pov / exact:.1f}**",
            f"{fast:.3f}", f"{pov / fast:.1f}", *(f"{exact / t:.2f} times as fast as one" for t in two),
        ])
    (args.out / "frames.md").write_text("".join("| " + " | ".join(row) + " |\n" for row in table))


if __name__ == "__main__":
    main()
