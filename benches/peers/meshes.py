"""The two meshes of the whole-frame scenes as POV-Ray's `mesh2` (needs numpy): `python meshes.py FOLDER`.

Writes `terrain.inc` (524,288 triangles) and `knot.inc` (256,000), which `frames/mesh_terrain.pov` and `frames/mesh_knot.pov`
include: 30 MB.
"""

import sys
from pathlib import Path

from geometry import knot, terrain


def write(path, vertices, faces):
    rows = [",\n".join(form % tuple(row) for row in table.tolist()) for form, table in
            [("<%.7g,%.7g,%.7g>", vertices), ("<%d,%d,%d>", faces)]]
    path.write_text(f"mesh2 {{\n vertex_vectors {{ {len(vertices)},\n{rows[0]} }}\n"
                    f" face_indices {{ {len(faces)},\n{rows[1]} }}\n}}\n")


def main():
    folder = Path(sys.argv[1])
    folder.mkdir(parents=True, exist_ok=True)
    write(folder / "terrain.inc", *terrain(512))
    write(folder / "knot.inc", *knot(2000, 64))


if __name__ == "__main__":
    main()
