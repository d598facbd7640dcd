"""The two meshes of the whole-frame scenes as POV-Ray's `mesh2` (needs numpy): `python meshes.py FOLDER`.

Writes `terrain.inc` (524,288 triangles) and `knot.inc` (256,000), which `frames/mesh_terrain.pov` and `frames/mesh_knot.pov`
include: 30 MB.
"""

import sys
from pathlib import Path

import numpy as np

from geometry import grid, knot

# Multipliers of a hash by multiplication and shift: any odd numbers would do, but others make other hills.
ACROSS, ALONG, OCTAVE, MIX = 374761393, 668265263, 974634777, 1274126177
BITS = 0xFFFFFFFF


def lattice(x, z, octave):
    """A random number in [0, 1) at each whole point."""
    n = (x * ACROSS + z * ALONG + octave * OCTAVE) & BITS
    n = ((n ^ (n >> 13)) * MIX) & BITS
    return ((n ^ (n >> 16)) & 0xFFFFFF) / float(1 << 24)


def value_noise(x, z, octave):
    """Between whole points by a polynomial of degree 5 (Perlin 2002, Improving noise)."""
    left, low = np.floor(x).astype(np.int64), np.floor(z).astype(np.int64)
    s, t = (w * w * w * (w * (w * 6 - 15) + 10) for w in (x - left, z - low))
    a, b, c, d = (lattice(left + k % 2, low + k // 2, octave) for k in range(4))
    return (a * (1 - s) + b * s) * (1 - t) + (c * (1 - s) + d * s) * t


def terrain(n):
    """Ridges: noise folded at its middle, eight octaves. 2 n^2 triangles."""
    x, z = np.meshgrid(np.linspace(-10, 10, n + 1), np.linspace(-10, 10, n + 1), indexing="ij")
    y, height, frequency = np.zeros_like(x), 2.2, 0.35
    for octave in range(8):
        y += height * (1 - np.abs(2 * value_noise(x * frequency + 100, z * frequency + 100, octave) - 1))
        height, frequency = height * 0.48, frequency * 2.03
    return np.stack([x, y - y.mean(), z], -1).reshape(-1, 3), grid(n + 1, n + 1, False, False)


def ribbed_knot(nu, nv):
    """Eight shallow ribs that wax and wane along it."""
    along, around = (np.arange(n) * 2 * np.pi / n for n in (nu, nv))
    return knot(nu, nv, 0.16 * (1 + 0.08 * np.sin(8 * around)[None, :] * np.cos(40 * along)[:, None]))


def write(path, vertices, faces):
    rows = [",\n".join(form % tuple(row) for row in table.tolist()) for form, table in
            [("<%.7g,%.7g,%.7g>", vertices), ("<%d,%d,%d>", faces)]]
    path.write_text(f"mesh2 {{\n vertex_vectors {{ {len(vertices)},\n{rows[0]} }}\n"
                    f" face_indices {{ {len(faces)},\n{rows[1]} }}\n}}\n")


def main():
    folder = Path(sys.argv[1])
    folder.mkdir(parents=True, exist_ok=True)
    write(folder / "terrain.inc", *terrain(512))
    write(folder / "knot.inc", *ribbed_knot(2000, 64))


if __name__ == "__main__":
    main()
