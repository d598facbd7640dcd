#!/usr/bin/env python3
"""Make POV-Ray's pictures of the scenes anew, or check the ones that are here.

    tests/truth/make.py                  render every scene, write pictures and table
    tests/truth/make.py sphere box       only these
    tests/truth/make.py --check          render again and compare values; nothing is written

Needs POV-Ray 3.7 (`povray`) and Python's standard library. A scene is every `scenes/feature/*.scn` and
`scenes/show/*.scn`; one whose first comment holds `+UA` is rendered with alpha. The pictures are 16-bit linear PNG
without anti-aliasing; POV-Ray's values are kept as they are, only the compression is chosen again (each of the five
PNG filters is tried). `--check` renders to PPM (`+FP16`), which also shows that the PNG holds the same values.
"""

import argparse
import json
import re
import struct
import subprocess
import sys
import tempfile
import zlib
from pathlib import Path

TRUTH = Path(__file__).resolve().parent
ROOT = TRUTH.parent.parent
SIZES = {"feature": (160, 120), "show": (240, 180)}
SIGNATURE = b"\x89PNG\r\n\x1a\n"


def table():
    """One row per scene, in the order of the files' names."""
    rows = []
    for folder, (width, height) in SIZES.items():
        for path in sorted((ROOT / "scenes" / folder).glob("*.scn")):
            rows.append(
                {
                    "scene": f"scenes/{folder}/{path.name}",
                    "picture": f"tests/truth/{folder}/{path.stem}.png",
                    "width": width,
                    "height": height,
                    "alpha": "+UA" in path.read_text().splitlines()[0],
                }
            )
    return rows


def povray(row, out, kind):
    """Render one row to `out`; `kind` is the letter of the file format."""
    scene = ROOT / row["scene"]
    command = ["povray", f"+I{scene.name}", f"+O{out}", f"+F{kind}16", "File_Gamma=1.0", "-A", "-D", "+WT1"]
    command += [f"+W{row['width']}", f"+H{row['height']}"] + (["+UA"] if row["alpha"] else [])
    run = subprocess.run(command, cwd=scene.parent, capture_output=True, text=True)
    if run.returncode != 0:
        errors = [line for line in run.stderr.splitlines() if "rror" in line]
        sys.exit(f"{row['scene']}: povray failed\n" + "\n".join(errors))


def chunks(data):
    """The chunks of a PNG file: (name, content)."""
    assert data[:8] == SIGNATURE, "not a PNG file"
    at = 8
    while at < len(data):
        (length,) = struct.unpack(">I", data[at : at + 4])
        yield data[at + 4 : at + 8], data[at + 8 : at + 8 + length]
        at += 12 + length


def paeth(a, b, c):
    p = a + b - c
    pa, pb, pc = abs(p - a), abs(p - b), abs(p - c)
    return a if pa <= pb and pa <= pc else b if pb <= pc else c


def predict(kind, left, up, corner):
    """What PNG filter `kind` expects at a byte, from its three neighbours."""
    return (0, left, up, (left + up) // 2, paeth(left, up, corner))[kind]


def read_png(path):
    """Width, height, channels, gamma and the rows of big-endian samples of a 16-bit PNG."""
    header = gamma = None
    packed = b""
    for name, content in chunks(path.read_bytes()):
        if name == b"IHDR":
            header = struct.unpack(">IIBBBBB", content)
        elif name == b"gAMA":
            (gamma,) = struct.unpack(">I", content)
        elif name == b"IDAT":
            packed += content
    width, height, depth, color, _, _, interlace = header
    assert depth == 16 and color in (2, 6) and interlace == 0, f"{path}: not 16-bit RGB or RGBA"
    channels = 3 if color == 2 else 4
    step = 2 * channels
    stride = width * step
    data = zlib.decompress(packed)
    rows = []
    above = bytes(stride)
    for y in range(height):
        at = y * (stride + 1)
        kind, row = data[at], bytearray(data[at + 1 : at + 1 + stride])
        for i in range(stride):
            left = row[i - step] if i >= step else 0
            corner = above[i - step] if i >= step else 0
            row[i] = (row[i] + predict(kind, left, above[i], corner)) & 255
        rows.append(bytes(row))
        above = rows[-1]
    return width, height, channels, gamma, rows


def filtered(kind, row, above, step):
    out = bytearray([kind])
    for i, value in enumerate(row):
        left = row[i - step] if i >= step else 0
        corner = above[i - step] if i >= step else 0
        out.append((value - predict(kind, left, above[i], corner)) & 255)
    return bytes(out)


def write_png(path, width, height, channels, gamma, rows):
    """Write the smallest of: one filter for all rows, or for each row the one with the smallest residual."""
    blank = bytes(len(rows[0]))
    pairs = list(zip(rows, [blank] + rows[:-1]))
    by_kind = [[filtered(kind, row, above, 2 * channels) for row, above in pairs] for kind in range(5)]
    mixed = [min(five, key=lambda f: sum(min(b, 256 - b) for b in f[1:])) for five in zip(*by_kind)]
    packed = min((zlib.compress(b"".join(lines), 9) for lines in [*by_kind, mixed]), key=len)
    color = 2 if channels == 3 else 6
    parts = [
        (b"IHDR", struct.pack(">IIBBBBB", width, height, 16, color, 0, 0, 0)),
        (b"gAMA", struct.pack(">I", gamma)),
        (b"IDAT", packed),
        (b"IEND", b""),
    ]
    data = SIGNATURE
    for name, content in parts:
        data += struct.pack(">I", len(content)) + name + content + struct.pack(">I", zlib.crc32(name + content))
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_bytes(data)


def read_ppm(path):
    """The samples of a 16-bit binary PPM, as one run of big-endian bytes."""
    data = path.read_bytes()
    head = re.match(rb"P6\s(?:#.*\n)*\s*(\d+)\s+(\d+)\s+(\d+)\s", data)
    assert head and head[3] == b"65535", f"{path}: not a 16-bit PPM"
    return data[head.end() :]


def make(row, scratch):
    raw = scratch / "picture.png"
    povray(row, raw, "N")
    width, height, channels, gamma, rows = read_png(raw)
    assert gamma == 100000, f"{row['scene']}: gAMA is {gamma}, not 1.0"
    assert (width, height, channels) == (row["width"], row["height"], 4 if row["alpha"] else 3)
    write_png(ROOT / row["picture"], width, height, channels, gamma, rows)
    assert read_png(ROOT / row["picture"])[4] == rows, f"{row['picture']}: does not read back"


def check(row, scratch):
    """Compare the stored picture with a new one; true if every value is the same."""
    _, _, _, gamma, rows = read_png(ROOT / row["picture"])
    if row["alpha"]:
        povray(row, scratch / "picture.png", "N")
        new = b"".join(read_png(scratch / "picture.png")[4])
    else:
        povray(row, scratch / "picture.ppm", "P")
        new = read_ppm(scratch / "picture.ppm")
    old = b"".join(rows)
    if gamma != 100000 or len(old) != len(new):
        print(f"{row['scene']}: gamma or size differ")
        return False
    form = f">{len(old) // 2}H"
    apart = [abs(a - b) for a, b in zip(struct.unpack(form, old), struct.unpack(form, new)) if a != b]
    if apart:
        print(f"{row['scene']}: {len(apart)} samples differ, by up to {max(apart)}/65535")
    return not apart


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("names", nargs="*", help="scenes to render, without folder and ending; all if none is given")
    parser.add_argument("--check", action="store_true", help="compare with the pictures that are here, write nothing")
    options = parser.parse_args()
    rows = table()
    known = {Path(row["scene"]).stem for row in rows}
    if unknown := set(options.names) - known:
        sys.exit(f"no such scene: {', '.join(sorted(unknown))}")
    chosen = [row for row in rows if not options.names or Path(row["scene"]).stem in options.names]
    with tempfile.TemporaryDirectory() as scratch:
        if options.check:
            same = sum(check(row, Path(scratch)) for row in chosen)
            print(f"{same} of {len(chosen)} pictures are the same")
            sys.exit(same != len(chosen))
        for row in chosen:
            make(row, Path(scratch))
    lines = ",\n".join("  " + json.dumps(row) for row in rows)
    (TRUTH / "scenes.json").write_text(f"[\n{lines}\n]\n")
    print(f"{len(chosen)} pictures made, {len(rows)} scenes in the table")


if __name__ == "__main__":
    main()
