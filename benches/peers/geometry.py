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
    return np.concatenate([np.stack([a, b, c], 1), np.stack([a, c, d], 1)])


def terrain(n):
    """Hills: sines of rising frequency, turned against each other. 2 n^2 triangles."""
    x, z = np.meshgrid(np.linspace(-10, 10, n + 1), np.linspace(-10, 10, n + 1), indexing="ij")
    y = np.zeros_like(x)
    for k in range(9):
        turn, f = 2.4 * k, 0.45 * 1.9**k
        y += 1.1 * 0.55**k * np.abs(np.sin(f * (x * np.cos(turn) + z * np.sin(turn)) + k)) - 0.3 * 0.55**k
    return np.stack([x, y, z], -1).reshape(-1, 3), grid(n + 1, n + 1, False, False)


def flake(depth):
    """Spheres on spheres: nine a third as big on each."""
    level = [(np.zeros(3), 1.0, np.array([0.0, 1.0, 0.0]))]
    rows = [[0, 0, 0, 1]]
    for _ in range(depth):
        below = []
        for centre, radius, axis in level:
            side = np.cross(axis, [1, 0, 0] if abs(axis[0]) < 0.8 else [0, 0, 1])
            side /= np.linalg.norm(side)
            other = np.cross(axis, side)
            for k in range(9):
                turn, lean = (k * np.pi / 3, np.pi / 2) if k < 6 else ((k - 6) * 2 * np.pi / 3 + 0.5, 0.6)
                out = (side * np.cos(turn) + other * np.sin(turn)) * np.sin(lean) + axis * np.cos(lean)
                below.append((centre + out * radius * 4 / 3, radius / 3, out))
        rows += [[*c, r] for c, r, _ in below]
        level = below
    return np.array(rows)


def tessellated(spheres, n):
    """Each sphere as n by 2n cells."""
    theta, phi = np.linspace(1e-3, np.pi - 1e-3, n + 1), np.arange(2 * n) * np.pi / n
    t, p = np.meshgrid(theta, phi, indexing="ij")
    ball = np.stack([np.sin(t) * np.cos(p), np.cos(t), np.sin(t) * np.sin(p)], -1).reshape(-1, 3)
    faces = grid(n + 1, 2 * n, False, True)
    vertices = (spheres[:, None, :3] + spheres[:, None, 3:] * ball).reshape(-1, 3)
    return vertices, (faces[None] + np.arange(len(spheres))[:, None, None] * len(ball)).reshape(-1, 3)


def knot(nu, nv, radius=0.17):
    """A tube round a (3, 7) torus knot; its radius is one number, or one for each vertex, `nu` along by `nv` around. 2 nu nv triangles."""
    t = np.arange(nu) * 2 * np.pi / nu
    reach = 1.2 + 0.5 * np.cos(7 * t)
    middle = np.stack([reach * np.cos(3 * t), 0.5 * np.sin(7 * t), reach * np.sin(3 * t)], 1)
    along = np.roll(middle, -1, 0) - np.roll(middle, 1, 0)
    along /= np.linalg.norm(along, axis=1)[:, None]
    n = np.cross(along, [0, 1, 0])
    n /= np.linalg.norm(n, axis=1)[:, None]
    b = np.cross(along, n)
    a = np.arange(nv) * 2 * np.pi / nv
    ring = n[:, None] * np.cos(a)[None, :, None] + b[:, None] * np.sin(a)[None, :, None]
    tube = np.broadcast_to(radius, (nu, nv))[..., None] * ring
    return (middle[:, None] + tube).reshape(-1, 3), grid(nu, nv, True, True)


def stadium():
    """A bowl of large triangles, 200 m across, round a vase of 0.25 m with 144,000 small ones."""
    turn = np.arange(96) * 2 * np.pi / 96
    steps = np.repeat(np.arange(41), 2)
    r, y = 60 + 2.0 * ((np.arange(82) + 1) // 2), 1.0 * (steps)
    bowl = np.stack([r[:, None] * np.cos(turn), np.broadcast_to(y[:, None], (82, 96)), r[:, None] * np.sin(turn)], -1)
    ground = np.array([[-150, 0, -150], [150, 0, -150], [150, 0, 150], [-150, 0, 150]], float)
    s, a = np.linspace(0, 1, 180), np.arange(400) * 2 * np.pi / 400
    profile = 0.05 + 0.07 * np.sin(1 + 5 * s) ** 2
    vase = np.stack([profile[:, None] * np.cos(a), np.broadcast_to(0.01 + 0.25 * s[:, None], (180, 400)), profile[:, None] * np.sin(a)], -1)
    parts = [(bowl.reshape(-1, 3), grid(82, 96, False, True)), (ground, np.array([[0, 1, 2], [0, 2, 3]])), (vase.reshape(-1, 3), grid(180, 400, False, True))]
    vertices, faces, base = [], [], 0
    for v, f in parts:
        vertices.append(v)
        faces.append(f + base)
        base += len(v)
    return np.concatenate(vertices), np.concatenate(faces)


def soup(n):
    """Long thin triangles every way."""
    random = np.random.default_rng(11)
    along, across = random.normal(size=(2, n, 3))
    along /= np.linalg.norm(along, axis=1)[:, None]
    across /= np.linalg.norm(across, axis=1)[:, None]
    middle, length = random.uniform(-1, 1, (n, 3)), random.uniform(0.05, 0.3, (n, 1))
    width = length * random.uniform(0.005, 0.05, (n, 1))
    corners = np.stack([middle - along * length, middle + along * length, middle + across * width], 1)
    return corners.reshape(-1, 3), np.arange(3 * n).reshape(-1, 3)


def balls(n, radius):
    random = np.random.default_rng(5)
    return np.concatenate([random.uniform(-1, 1, (n, 3)), random.uniform(0.3 * radius, radius, (n, 1))], 1)


def write(folder, name, data, eye, look, fov, light):
    if isinstance(data, tuple):
        vertices, faces = data[0].astype("<f4"), data[1].astype("<u4")
        path = folder / f"{name}.mesh"
        path.write_bytes(b"MESH0001" + struct.pack("<II", len(vertices), len(faces)) + vertices.tobytes() + faces.tobytes())
    else:
        path = folder / f"{name}.sph"
        path.write_bytes(b"SPHR0001" + struct.pack("<II", len(data), 0) + data.astype("<f4").tobytes())
    return {"file": path.name, "eye": eye, "look": look, "fov": fov, "light": light}


def main():
    folder = Path(sys.argv[1])
    folder.mkdir(parents=True, exist_ok=True)
    views = {}
    for name, data, *view in [
        ("terrain", terrain(512), [0, 5, 13], [0, -1, 0], 45, [12, 14, 6]),
        ("flake-mesh", tessellated(flake(3), 12), [2, 1.8, 3.6], [0, 0.15, 0], 42, [6, 9, 5]),
        ("knot", knot(2000, 64), [0.6, 2.6, 3.2], [0, 0, 0], 50, [4, 6, 5]),
        ("stadium", stadium(), [0.45, 0.32, 0.55], [0, 0.13, 0], 55, [40, 90, 50]),
        ("soup", soup(100_000), [0, 0.4, 3.4], [0, 0, 0], 45, [5, 6, 7]),
        ("flake-66k", flake(5), [2, 1.8, 3.6], [0, 0.15, 0], 42, [6, 9, 5]),
        ("balls-100k", balls(100_000, 0.012), [0, 0.6, 3.4], [0, 0, 0], 45, [5, 6, 7]),
    ]:
        views[name] = write(folder, name, data, *view)
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
