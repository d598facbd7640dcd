"""octray beside POV-Ray on POV-Ray's own example scenes: those of the package povray-examples that octray renders.

`python examples.py OCTRAY OUT [--rounds N] [--size WxH]`

No scene is chosen and none left out but those that one of the two refuses. Timed as by `frames.py`: tracing alone, `exact`, one
thread, rounds interleaved, medians. POV-Ray says its seconds to the hundredth, so that a scene of 0.1 s is told to a tenth at
best. Writes OUT/examples.csv and OUT/examples.md: quantiles of the ratios, and the scenes from the least ratio on.
"""

import argparse
import csv
import os
import statistics
import subprocess
import tempfile
from pathlib import Path

from frames import octray, povray
from parse import corpus


def is_rendered(scene, args):
    """True if both make a picture of the scene, octray without leaving anything out (as it does photons, with a note)."""
    picture = ["-W", "8", "-H", "8", "-o", args.out / "frame0.ppm"]
    ours = subprocess.run([args.octray, "render", scene, *picture], capture_output=True, text=True)
    if ours.returncode != 0 or "ignored" in ours.stderr:
        return False
    try:
        povray(scene, argparse.Namespace(size="8x8", library=[]))
    except (subprocess.CalledProcessError, ValueError):
        return False
    return True


def measure(scenes, args):
    """By scene, its POV-Ray and octray seconds round by round."""
    times = {scene: ([], []) for scene in scenes}
    for _ in range(args.rounds):
        for scene, (of_povray, of_octray) in times.items():
            of_povray.append(povray(scene, args))
            # What runs right after POV-Ray pays for memory that the host has taken back: once for nothing.
            octray(scene, "exact", 1, args)
            of_octray.append(octray(scene, "exact", 1, args)["trace_s"])
    return times


def main():
    parse = argparse.ArgumentParser()
    parse.add_argument("octray", type=Path)
    parse.add_argument("out", type=Path)
    parse.add_argument("--rounds", type=int, default=3)
    parse.add_argument("--size", default="640x480")
    args = parse.parse_args()
    args.octray, args.out, args.library = args.octray.resolve(), args.out.resolve(), []
    args.out.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory() as folder:
        every = [Path(folder) / scene for scene in corpus(Path(folder))]
        os.chdir(folder)  # Where scenes may write.
        times = measure([scene for scene in every if is_rendered(scene, args)], args)
        names = {scene: str(scene.relative_to(folder)) for scene in times}
    (args.out / "frame0.ppm").unlink(missing_ok=True)
    with open(args.out / "examples.csv", "w", newline="") as file:
        rows = [
            [names[scene], number, *pair]
            for scene, both in times.items()
            for number, pair in enumerate(zip(*both))
        ]
        csv.writer(file).writerows([["scene", "round", "povray_s", "octray_s"], *rows])
    medians = {scene: [statistics.median(seconds) for seconds in both] for scene, both in times.items()}
    # (Below a hundredth of a second POV-Ray's figure says nothing.)
    ratios = sorted((pov / own, names[scene], pov, own) for scene, (pov, own) in medians.items() if pov >= 0.05)
    values = [ratio for ratio, *_ in ratios]
    tenths = statistics.quantiles(values, n=10)
    least, quarter, half, most = values[0], statistics.quantiles(values)[0], statistics.median(values), values[-1]
    lines = [
        f"{len(values)} of {len(every)} scenes, POV-Ray / exact: median {half:.1f}; least {least:.1f}, a tenth below "
        f"{tenths[0]:.1f}, a quarter below {quarter:.1f}, a tenth above {tenths[-1]:.1f}, most {most:.1f}.",
        "",
        "| scene | POV-Ray s | exact s | POV-Ray / exact |",
        "| --- | --- | --- | --- |",
        *(f"| {name} | {pov:.2f} | {own:.3f} | {ratio:.1f} |" for ratio, name, pov, own in ratios),
    ]
    (args.out / "examples.md").write_text("\n".join(lines) + "\n")


if __name__ == "__main__":
    main()
