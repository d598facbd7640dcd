"""Geometry for the ray benches, made from formulas (needs numpy): `python geometry.py FOLDER`.

Writes MESH0001 and SPHR0001 files and `views.json`: a camera and a light for each.
"""

import json
import struct
import sys
from pathlib import Path

import numpy as np


def grid(nu, nv, close_u, close_v):
    """Two triangles for each cell of a grid of vertices, rows of `nv`."""
    u = np.arange(nu if close_u else nu - 1)[:, None]
    v = np.arange(nv if close_v else nv - 1)[None, :]
    u1, v1 = (u + 1) % nu, (v + 1) % nv
    a, b, c, d = (x.ravel() for x in np.broadcast_arrays(u * nv + v, u1 * nv + v, u1 * nv + v1, u * nv + v1))
    return np.stack([np.stack([a, b, c], 1), np.stack([a, c, d], 1)], 1).reshape(-1, 3)


def joined(parts):
    """One mesh of several."""
    first = np.cumsum([0] + [len(vertices) for vertices, _ in parts])
    return np.concatenate([vertices for vertices, _ in parts]), np.concatenate([faces + k for (_, faces), k in zip(parts, first)])


def turned(n):
    return np.arange(n) * 2 * np.pi / n


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


def flake(depth):
    """Spheres on spheres: nine a third as big on each, six around and three above."""
    level = [(np.zeros(3), 1.0, np.array([0.0, 1.0, 0.0]))]
    rows = [[0, 0, 0, 1]]
    for _ in range(depth):
        below = []
        for centre, radius, axis in level:
            side = np.cross(axis, [1.0, 0, 0] if abs(axis[0]) < 0.9 else [0, 0, 1.0])
            side /= np.linalg.norm(side)
            other = np.cross(axis, side)
            for k in range(9):
                turn, lean = (2 * np.pi * k / 6, np.pi / 2) if k < 6 else (2 * np.pi * (k - 6) / 3 + np.pi / 6, np.radians(35))
                out = (side * np.cos(turn) + other * np.sin(turn)) * np.sin(lean) + axis * np.cos(lean)
                small = radius * (1 / 3)
                below.append((centre + out * (radius + small), small, out))
        rows += [[*c, r] for c, r, _ in below]
        level = below
    return np.array(rows)


def ball(around, down):
    """A unit sphere: one vertex at each pole."""
    theta, phi = np.linspace(0, np.pi, down + 1)[1:-1], turned(around)
    t, p = np.meshgrid(theta, phi)
    rings = np.stack([np.sin(t) * np.cos(p), np.cos(t), np.sin(t) * np.sin(p)], -1).reshape(-1, 3)
    per, faces = down - 1, []
    for k in range(around):
        a, b = 1 + k * per, 1 + (k + 1) % around * per
        faces += [[0, b, a], [len(rings) + 1, a + per - 1, b + per - 1]]
        for step in range(per - 1):
            faces += [[a + step, b + step, b + step + 1], [a + step, b + step + 1, a + step + 1]]
    return np.concatenate([[[0, 1, 0]], rings, [[0, -1, 0]]]), np.array(faces)


def tessellated(spheres, around, down):
    vertices, faces = ball(around, down)
    placed = (spheres[:, None, :3] + vertices * spheres[:, None, 3:]).reshape(-1, 3)
    return placed, (faces[None] + np.arange(len(spheres))[:, None, None] * len(vertices)).reshape(-1, 3)


def knot(nu, nv):
    """A tube round a (3, 7) torus knot; eight shallow ribs wax and wane along it. 2 nu nv triangles."""
    t, a = turned(nu), turned(nv)
    reach = 1.2 + 0.5 * np.cos(7 * t)
    middle = np.stack([reach * np.cos(3 * t), 0.5 * np.sin(7 * t), reach * np.sin(3 * t)], 1)
    along = np.roll(middle, -1, 0) - np.roll(middle, 1, 0)
    along /= np.linalg.norm(along, axis=1)[:, None]
    n = np.cross(along, [0, 1, 0])
    n /= np.linalg.norm(n, axis=1)[:, None]
    b = np.cross(along, n)
    ring = n[:, None] * np.cos(a)[None, :, None] + b[:, None] * np.sin(a)[None, :, None]
    radius = 0.16 * (1 + 0.08 * np.sin(8 * a)[None, :] * np.cos(40 * t)[:, None])
    return (middle[:, None] + radius[..., None] * ring).reshape(-1, 3), grid(nu, nv, True, True)


def cuboid(low, high):
    corners = np.array([[x, y, z] for x in (low[0], high[0]) for y in (low[1], high[1]) for z in (low[2], high[2])], float)
    sides = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    return corners, np.array([face for a, b, c, d in sides for face in ((a, b, c), (a, c, d))])


def stadium():
    """Rings of seats 200 m across, and masts, of large triangles; in their middle a pot of 0.25 m of 171,600 small ones."""
    parts = [cuboid((-150, -1, -150), (150, 0, 150))]
    a, n = turned(96), 96
    for row in range(40):
        inner, y = 60 + 2.0 * row, 1.0 * row
        rings = [np.stack([r * np.cos(a), np.full(n, h), r * np.sin(a)], 1) for r, h in [(inner, y), (inner, y + 1), (inner + 2, y + 1)]]
        i, j = np.arange(n), (np.arange(n) + 1) % n
        faces = [np.stack(face, 1) for k in (0, n) for face in ((i + k, j + k, j + k + n), (i + k, j + k + n, i + k + n))]
        parts.append((np.concatenate(rings), np.concatenate(faces)))
    for turn in (2 * np.pi * k / 16 for k in range(16)):
        x, z = 140 * np.cos(turn), 140 * np.sin(turn)
        parts.append(cuboid((x - 0.5, 0, z - 0.5), (x + 0.5, 60, z + 0.5)))
    around, down = 400, 180
    t, a = np.linspace(0, 1, down), turned(around)[:, None]
    radius, y = 0.12 * np.sin(np.pi * np.clip(0.08 + 0.9 * t, 0, 1)) ** 0.6, 0.02 + 0.2 * t
    body = np.stack([np.cos(a) * radius, np.broadcast_to(y, (around, down)), np.sin(a) * radius], -1)
    parts.append((body.reshape(-1, 3), grid(around, down, True, False)))
    along, around = 240, 60
    p, b = np.linspace(-np.pi / 2, np.pi / 2, along)[:, None], turned(around)
    radius, z = 0.06 + 0.012 * np.cos(b), np.broadcast_to(0.012 * np.sin(b), (along, around))
    handle = np.stack([0.1 + radius * np.cos(p), 0.12 + radius * np.sin(p), z], -1)
    parts.append((handle.reshape(-1, 3), grid(along, around, False, True)))
    return joined(parts)


def soup(n):
    """Long thin triangles every way."""
    random = np.random.default_rng(7)
    middle, along = random.uniform(-1, 1, (n, 3)), random.normal(size=(n, 3))
    along /= np.linalg.norm(along, axis=1)[:, None]
    across = random.normal(size=(n, 3))
    across -= along * (along * across).sum(1)[:, None]
    across /= np.linalg.norm(across, axis=1)[:, None]
    length = 0.15 * random.uniform(0.3, 2.0, (n, 1))
    width = length * random.uniform(0.005, 0.05, (n, 1))
    corners = np.stack([middle - along * length, middle + along * length, middle + across * width], 1)
    return corners.reshape(-1, 3), np.arange(3 * n).reshape(-1, 3)


def balls(n, radius):
    random = np.random.default_rng(3)
    return np.concatenate([random.uniform(-1, 1, (n, 3)), random.uniform(0.25 * radius, radius, (n, 1))], 1)


def write(folder, name, data, eye, look, fov, light):
    if isinstance(data, tuple):
        vertices, faces = data[0].astype("<f4"), data[1].astype("<u4")
        path = folder / f"{name}.mesh"
        path.write_bytes(b"MESH0001" + struct.pack("<II", len(vertices), len(faces)) + vertices.tobytes() + faces.tobytes())
    else:
        path = folder / f"{name}.sph"
        path.write_bytes(b"SPHR0001" + struct.pack("<II", len(data), 0) + data.astype("<f4").tobytes())
    return {"file": path.name, "eye": eye, "look": look, "fov": fov, "light": light, "size": 1024}


def main():
    folder = Path(sys.argv[1])
    folder.mkdir(parents=True, exist_ok=True)
    views = {}
    for name, data, *view in [
        ("terrain", terrain(512), [0, 4.5, 13], [0, -1, 0], 45, [12, 14, 6]),
        ("flake-mesh", tessellated(flake(3), 20, 16), [2, 1.8, 3.6], [0, 0.15, 0], 42, [6, 9, 5]),
        ("knot", knot(2000, 64), [0.6, 2.6, 3.2], [0, 0, 0], 50, [4, 6, 5]),
        ("stadium", stadium(), [0.45, 0.32, 0.55], [0, 0.13, 0], 55, [40, 90, 50]),
        ("soup", soup(100_000), [0, 0.4, 3.4], [0, 0, 0], 45, [5, 6, 7]),
        ("flake-66k", flake(5), [2, 1.8, 3.6], [0, 0.15, 0], 42, [6, 9, 5]),
        ("balls-100k", balls(100_000, 0.012), [0, 0.6, 3.4], [0, 0, 0], 45, [5, 6, 7]),
    ]:
        views[name] = write(folder, name, data, *view)
    views["soup"]["size"] = 512  # A thirtieth of the others' rays a second.
    (folder / "views.json").write_text(json.dumps(views, indent=1))


def scaling(folder, most):
    """10^3 to 10^`most` spheres and triangles, for the table of growth."""
    names = []
    for k in range(3, most + 1):
        n = 10**k
        view = ([0, 0.6, 3.4], [0, 0, 0], 45, [5, 6, 7])
        write(folder, f"spheres-1e{k}", balls(n, 0.6 * n ** (-1 / 3)), *view)
        write(folder, f"triangles-1e{k}", terrain(round((n / 2) ** 0.5)), *view)
        names += [(f"spheres-1e{k}.sph", n), (f"triangles-1e{k}.mesh", n)]
    return names


if __name__ == "__main__":
    main()
