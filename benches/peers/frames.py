"""octray beside POV-Ray on whole frames.

`python frames.py OCTRAY OUT SCENE... [--rounds N] [--size WxH] [--no-two] [-L DIR]`

Rounds are interleaved: of each scene a frame by POV-Ray with one thread, by octray in each precision with one thread, and by
`exact` with two, in an order drawn anew each time (from a fixed seed): what runs right after POV-Ray pays for memory that the
machine's host has taken back from it, and no engine shall always be the one. Compared is the time of tracing alone, as each program reports it: POV-Ray's processor seconds of the trace,
octray's wall-clock seconds of its one thread (at least its processor seconds, so octray is never flattered). Figures
are medians over rounds. Writes OUT/frames.csv and OUT/frames.md.

What two threads gain is the ratio to one thread *right before*; before both another run by two threads, which take more memory
than one, has had it from the host. Beside it stands what the machine itself gains: two processes of one thread each at a time, which share nothing. Virtual
processors may be halves of one core; then that is far below 2, and no program can have more.
"""

import argparse
import csv
import json
import random
import re
import statistics
import subprocess
from pathlib import Path


def povray(scene, args):
    width, height = args.size.split("x")
    command = ["povray", f"+I{scene}", f"+W{width}", f"+H{height}", "-F", "-D", "-A", "-V", "+WT1"]
    command += [f"+L{folder}" for folder in [Path(scene).parent, *args.library]]  # octray looks beside the scene anyway
    run = subprocess.run(command, capture_output=True, text=True, errors="replace", check=True)
    trace = run.stderr[run.stderr.index("Trace Time"):]
    return float(re.search(r"using \d+ thread\(s\) with ([\d.]+) CPU", trace)[1])


def octray(scene, precision, threads, args, copies=1):
    """Statistics of a frame; of `copies` that run at the same time, the mean of their seconds."""
    width, height = args.size.split("x")
    command = [args.octray, "render", scene, "-W", width, "-H", height, "-t", threads, "-p", precision]
    command += ["-q", "--allow-missing", "--stats", "-"]
    command += [word for folder in args.library for word in ("-L", folder)]
    started = []
    for copy in range(copies):
        own = [*command, "-o", args.out / f"frame{copy}.ppm"]
        started.append(subprocess.Popen([str(word) for word in own], stdout=subprocess.PIPE, text=True))
    stats = []
    for process in started:
        text, _ = process.communicate()
        if process.returncode != 0:
            raise subprocess.CalledProcessError(process.returncode, process.args)
        stats.append(json.loads(text))
    return {**stats[0], "trace_s": statistics.mean(found["trace_s"] for found in stats)}


def main():
    parse = argparse.ArgumentParser()
    parse.add_argument("octray", type=Path)
    parse.add_argument("out", type=Path)
    parse.add_argument("scenes", type=Path, nargs="+")
    parse.add_argument("--rounds", type=int, default=7)
    parse.add_argument("--size", default="1024x768")
    parse.add_argument("--two", action=argparse.BooleanOptionalAction, default=True, help="see what two threads gain")
    parse.add_argument("-L", "--library", action="append", default=[])
    args = parse.parse_args()
    args.out.mkdir(parents=True, exist_ok=True)
    rows, times, rays, draw = [], {}, {}, random.Random(37)
    for number in range(args.rounds):
        for scene in args.scenes:
            found = {}
            turns = ["povray", "exact", "fast", *["two"] * args.two]
            draw.shuffle(turns)
            for turn in turns:
                match turn:
                    case "povray":
                        found["povray"] = povray(scene, args)
                    case "two":
                        # What is timed comes neither right after POV-Ray nor pays alone for the memory that a second thread takes.
                        octray(scene, "exact", 2, args)
                        found["exact x1 again"] = octray(scene, "exact", 1, args)["trace_s"]
                        found["exact x2"] = octray(scene, "exact", 2, args)["trace_s"]
                        found["two of exact x1"] = octray(scene, "exact", 1, args, copies=2)["trace_s"]
                    case precision:
                        stats = octray(scene, precision, 1, args)
                        found[f"{precision} x1"] = stats["trace_s"]
                        rays[scene.stem] = sum(stats["rays"].values())
            for engine, seconds in found.items():
                times.setdefault((scene.stem, engine), []).append(seconds)
                rows.append([scene.stem, engine, number, seconds])
    for copy in range(2):
        (args.out / f"frame{copy}.ppm").unlink(missing_ok=True)
    with open(args.out / "frames.csv", "w", newline="") as file:
        csv.writer(file).writerows([["scene", "engine", "round", "trace_s"], *rows])
    head = ["scene", "Mrays", "POV-Ray s", "exact s", "POV-Ray / exact", "by rounds", "fast s", "POV-Ray / fast"]
    if args.two:
        head += ["two threads: times as fast as one", "two processes at once: times as much work as one"]
    table = [head, ["---"] * len(head)]
    for scene in args.scenes:
        of = {engine: seconds for (name, engine), seconds in times.items() if name == scene.stem}
        pov, exact, fast = (statistics.median(of[engine]) for engine in ["povray", "exact x1", "fast x1"])
        # Of a host with two speeds the medians of two programs may be of different ones; what ran in one round is mostly of one.
        by_rounds = statistics.median(a / b for a, b in zip(of["povray"], of["exact x1"]))
        row = [
            scene.stem, f"{rays[scene.stem] * 1e-6:.2f}", f"{pov:.2f}", f"{exact:.3f}", f"**{pov / exact:.1f}**",
            f"{by_rounds:.1f}", f"{fast:.3f}", f"{pov / fast:.1f}",
        ]
        if args.two:
            one, two, both = (of[engine] for engine in ["exact x1 again", "exact x2", "two of exact x1"])
            row.append(f"{statistics.median(a / b for a, b in zip(one, two)):.2f}")
            row.append(f"{statistics.median(2 * a / b for a, b in zip(one, both)):.2f}")
        table.append(row)
    (args.out / "frames.md").write_text("".join("| " + " | ".join(row) + " |\n" for row in table))


if __name__ == "__main__":
    main()
