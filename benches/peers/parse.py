#!/usr/bin/env python3
"""Reads scenes with octray and with POV-Ray, by turns, and prints how long each takes.

    cargo build --release && benches/peers/parse.py --corpus --run benches/runs/<date>-<machine>-parse

Four times of processor (user and system), the least of a few turns, one thread each:

- POV-Ray's parsing, as its own statistics say it, to the millisecond, without its start;
- octray's reading, as `octray check --times` says it: files, text, evaluation;
- POV-Ray's whole process up to the end of parsing: the scene is included by one whose next line is `#error`, so that no
  picture is begun;
- octray's whole process, `octray check`: start, reading, statistics, end.

The corpus is what the package povray-examples installs, as far as POV-Ray reads it to the end. Each program has a fresh copy
of it and may write there, as some scenes do. Scenes of an animation that POV-Ray does not read by themselves are given
`frame_number=1`, which octray has anyway.

`--run` writes parse.csv (every scene) and README.md (machine, commit, tables) to a folder.
"""

import argparse
import math
import os
import re
import shutil
import statistics
import subprocess
import tempfile
from datetime import date
from pathlib import Path

HERE = Path(__file__).resolve().parent
PACKAGE = "povray-examples"
CORPUS = Path("/usr/share/doc/povray/examples")
SIZE = ["-W", "8", "-H", "8"]
END = "the end of the scene has been reached"
COLUMNS = ["povray_parse_s", "octray_read_s", "povray_process_s", "octray_process_s"]


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


def corpus(folder):
    """A copy of the package's examples, and of nothing that has been written beside them since."""
    listed = subprocess.run(["dpkg", "-L", PACKAGE], capture_output=True, text=True).stdout.split("\n")
    listed = [Path(name) for name in listed] or list(CORPUS.rglob("*"))
    for path in listed:
        if path.is_relative_to(CORPUS) and path.is_file():
            copy = folder / path.relative_to(CORPUS)
            copy.parent.mkdir(parents=True, exist_ok=True)
            shutil.copyfile(path, copy)
    return sorted(path.relative_to(folder) for path in folder.rglob("*.pov"))


def run(command, folder):
    """Processor seconds of a process, its exit code, and what it printed."""
    with tempfile.TemporaryFile() as out:
        process = subprocess.Popen(command, cwd=folder, stdin=subprocess.DEVNULL, stdout=out, stderr=subprocess.STDOUT)
        _, status, used = os.wait4(process.pid, 0)
        process.returncode = os.waitstatus_to_exitcode(status)
        out.seek(0)
        said = out.read().decode(errors="replace")
    return used.ru_utime + used.ru_stime, process.returncode, said


def octray(program, scene):
    """Seconds for reading and of the whole process; None if the scene has errors."""
    whole, code, said = run([program, "check", "--times", "--allow-write", ".", *SIZE, scene.name], scene.parent)
    found = re.search(r"read and evaluated in ([0-9.]+) s", said)
    return (float(found[1]), whole) if found and code == 0 else None


def povray(scene, options):
    """Seconds for parsing, and of the whole process if it ends there; None if POV-Ray does not read the scene."""
    common = ["povray", "+W8", "+H8", "-D", "-F", "+WT1", *options]
    _, code, said = run(["timeout", "120", *common, f"+I{scene.name}"], scene.parent)
    found = re.search(r"Parse Time:.*\n.*with ([0-9.]+) CPU-seconds", said)
    if not found or code != 0:
        return None
    wrapper = scene.with_name("octray_parse_wrapper.pov")
    wrapper.write_text(f'#include "{scene.name}"\n#error "{END}"\n')
    whole, _, said = run([*common, f"+I{wrapper.name}"], scene.parent)
    wrapper.unlink()
    return float(found[1]), whole if END in " ".join(said.split()) else math.nan


def measured(program, ours, theirs, turns):
    """The least of each of COLUMNS over the turns; None if either program does not read the scene."""
    options, figures = [], []
    for turn in range(turns):
        pov, oct = povray(theirs, options), octray(program, ours)
        if pov is None and turn == 0:
            options = ["Declare=frame_number=1"]
            pov = povray(theirs, options)
        if pov is None or oct is None:
            return None
        figures.append([pov[0], oct[0], pov[1], oct[1]])
    return [min(column) for column in zip(*figures)]


def row(name, figures, digits=3):
    """A line of a table: four times, and the two ratios."""
    cells = [f"{seconds:.{digits}f}" for seconds in figures]
    ratios = [f"**{figures[0] / figures[1]:.1f}**", f"{figures[2] / figures[3]:.1f}"]
    return f"| {name} | {cells[0]} | {cells[1]} | {ratios[0]} | {cells[2]} | {cells[3]} | {ratios[1]} |"


def first_line(command):
    """What a command says first."""
    return subprocess.run(command, capture_output=True, text=True).stdout.split("\n")[0].strip()


def main():
    arguments = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    arguments.add_argument("--octray", default=str(HERE.parent.parent / "target/release/octray"))
    arguments.add_argument("--turns", type=int, default=3)
    arguments.add_argument("--corpus", action="store_true", help="read the examples too (some minutes)")
    arguments.add_argument("--run", type=Path, metavar="FOLDER")
    given = arguments.parse_args()
    program = str(Path(given.octray).resolve())
    table = ["| scene | POV-Ray's parsing, s | octray's reading, s | ratio | POV-Ray's process to there, s | octray's process, s | ratio |",
             "|---|---|---|---|---|---|---|"]
    print("\n".join(table), flush=True)
    lines = [",".join(["scene", *COLUMNS])]

    def tell(name, figures, **how):
        table.append(row(name, figures, **how))
        print(table[-1], flush=True)

    with tempfile.TemporaryDirectory() as folder:
        folder = Path(folder)
        sheet, empty = folder / "mesh2.scn", folder / "empty.scn"
        mesh(sheet)
        empty.write_text("#version 3.7;\nsphere { 0, 1 }\n")
        for scene in [*(HERE.parent / "parse" / f"{name}.scn" for name in ("loop", "draw", "tree")), sheet, empty]:
            copy = folder / scene.name
            if copy != scene:
                shutil.copyfile(scene, copy)
            figures = measured(program, copy, copy, given.turns)
            lines.append(",".join([scene.stem, *map(str, figures)]))
            if scene == empty:
                starts = f"One sphere: POV-Ray's process takes {1e3 * figures[2]:.1f} ms up to the end of parsing, octray's {1e3 * figures[3]:.1f} ms, of which reading {1e3 * figures[1]:.2f} ms."
            else:
                tell(scene.stem, figures)
        ratios = ""
        if given.corpus:
            scenes, left_out, all_of_them = corpus(folder / "povray"), [], []
            corpus(folder / "octray")
            for scene in scenes:
                figures = measured(program, folder / "octray" / scene, folder / "povray" / scene, given.turns)
                if figures is None:
                    left_out.append(str(scene))
                    continue
                all_of_them.append(figures)
                lines.append(",".join([str(scene), *map(str, figures)]))
            whole = [figures for figures in all_of_them if not math.isnan(figures[2])]
            sums = [*(sum(column) for column in list(zip(*all_of_them))[:2]), *(sum(column) for column in list(zip(*whole))[2:])]
            tell(f"{len(all_of_them)} examples, sum", sums, digits=2)
            median = statistics.median(figures[2] / figures[3] for figures in whole)
            long = [figures[0] / figures[1] for figures in all_of_them if figures[0] >= 0.02]
            ratios = (f"Median ratio of whole processes over the examples: {median:.1f}. POV-Ray gives its parse time in milliseconds, and takes "
                      f"under 20 of them for all but {len(long)} examples; over those {len(long)} the median ratio of parsing to reading is "
                      f"{statistics.median(long):.1f}.\n\nLeft out, as one of the two does not read them to the end: {', '.join(left_out) or 'none'}.")
        print("\n" + starts + "\n\n" + ratios)
    if given.run:
        given.run.mkdir(parents=True, exist_ok=True)
        (given.run / "parse.csv").write_text("\n".join(lines) + "\n")
        cpu = re.search(r"model name\s*: (.*)\n(?:.*\n)*?cpu cores", Path("/proc/cpuinfo").read_text())
        commit = first_line(["git", "-C", str(HERE), "rev-parse", "--short", "HEAD"])
        load = Path("/proc/loadavg").read_text().split()[0]
        head = (f"# Reading scenes beside POV-Ray\n\n`benches/peers/parse.py{' --corpus' * given.corpus} --turns {given.turns} --run ...`, {date.today()}, commit {commit}, "
                f"{first_line(['rustc', '--version'])}, release profile, RUSTFLAGS {os.environ.get('RUSTFLAGS') or 'as `.cargo/config.toml` has them'}; {cpu[1] if cpu else 'CPU unknown'}, "
                f"{os.cpu_count()} processors, load {load} at the end; POV-Ray 3.7. Seconds of processor time, one thread each, the least of {given.turns} interleaved turns.\n"
                "What each column is stands at the top of `benches/peers/parse.py`.\n\n")
        (given.run / "README.md").write_text(head + "\n".join(table) + "\n\n" + starts + "\n\n" + ratios + "\n")


if __name__ == "__main__":
    main()
