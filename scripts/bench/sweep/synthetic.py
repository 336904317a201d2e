"""Made-up scenes of any size: a bumpy ball inside a dome, painted with waves, seen from a ring.

Gaussians lie on the surfaces like those of a fitted scene, and shrink as they become more, so
that about as many cover a pixel at any number. Deterministic: positions come from the golden
ratio, not from a generator.
"""

import array
import json
import math
import subprocess
import sys

GOLDEN = (math.sqrt(5.0) - 1.0) / 2.0
OPACITY_LOGIT = 1.5
SH_C0 = 0.2820947917738781


def gaussians_ply(path, count):
    """Writes `count` Gaussians of SH degree 0; half on the ball, half on the dome."""
    names = ["x", "y", "z", "nx", "ny", "nz", "f_dc_0", "f_dc_1", "f_dc_2", "opacity",
             "scale_0", "scale_1", "scale_2", "rot_0", "rot_1", "rot_2", "rot_3"]
    header = "ply\nformat binary_little_endian 1.0\ncomment motes format motes/gaussians 1.0\n"
    header += f"element vertex {count}\n" + "".join(f"property float {n}\n" for n in names)
    sin, cos, tau = math.sin, math.cos, 2.0 * math.pi
    half = max(count // 2, 1)
    with open(path, "wb") as file:
        file.write((header + "end_header\n").encode())
        rows = array.array("f")
        for i in range(count):
            on_ball = i < half
            j, n = (i, half) if on_ball else (i - half, max(count - half, 1))
            y = 1.0 - 2.0 * (j + 0.5) / n
            r, turn = math.sqrt(1.0 - y * y), tau * ((j * GOLDEN) % 1.0)
            x, z = r * cos(turn), r * sin(turn)
            wave = sin(9.0 * x) * sin(9.0 * y) * sin(9.0 * z)
            radius = 1.0 + 0.1 * wave if on_ball else 6.0
            # Area per Gaussian sets its size.
            scale = math.log(0.6 * radius * math.sqrt(4.0 * math.pi / n))
            color = ((0.5 + 0.4 * sin(14.0 * x + 3.0 * y)) if on_ball else 0.3 + 0.2 * y,
                     0.5 + 0.4 * sin(11.0 * y + 5.0 * z), 0.5 + 0.4 * sin(17.0 * z + 2.0 * x))
            rows.extend((x * radius, y * radius, z * radius, 0.0, 0.0, 0.0,
                         *((c - 0.5) / SH_C0 for c in color), OPACITY_LOGIT,
                         scale, scale, scale, 1.0, 0.0, 0.0, 0.0))
            if len(rows) > 1 << 20:
                rows = flush(rows, file)
        flush(rows, file)


def flush(rows, file):
    if sys.byteorder == "big":
        rows.byteswap()
    rows.tofile(file)
    return array.array("f")


def pose(i, count):
    """Looks at the center from a ring whose height waves: (quaternion w x y z, translation)."""
    turn, height = 2.0 * math.pi * i / count, 0.8 * math.sin(6.0 * math.pi * i / count)
    center = (2.8 * math.cos(turn), height, 2.8 * math.sin(turn))
    length = math.sqrt(sum(c * c for c in center))
    z = [-c / length for c in center]
    down = (0.0, 1.0, 0.0)
    x = cross(down, z)
    norm = math.sqrt(sum(c * c for c in x))
    x = [c / norm for c in x]
    y = cross(z, x)
    rows = (x, y, z)
    translation = [-sum(a * c for a, c in zip(row, center)) for row in rows]
    return quaternion(rows), translation


def cross(a, b):
    return [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]


def quaternion(m):
    """Of a rotation matrix given by rows (Shepperd's method: divide by the largest)."""
    trace = m[0][0] + m[1][1] + m[2][2]
    squares = (trace, m[0][0], m[1][1], m[2][2])
    k = squares.index(max(squares))
    if k == 0:
        q = [1.0 + trace, m[2][1] - m[1][2], m[0][2] - m[2][0], m[1][0] - m[0][1]]
    elif k == 1:
        q = [m[2][1] - m[1][2], 1.0 + 2.0 * m[0][0] - trace, m[0][1] + m[1][0], m[0][2] + m[2][0]]
    elif k == 2:
        q = [m[0][2] - m[2][0], m[0][1] + m[1][0], 1.0 + 2.0 * m[1][1] - trace, m[1][2] + m[2][1]]
    else:
        q = [m[1][0] - m[0][1], m[0][2] + m[2][0], m[1][2] + m[2][1], 1.0 + 2.0 * m[2][2] - trace]
    norm = math.sqrt(sum(c * c for c in q))
    return [c / norm for c in q]


def capture(folder, gaussians, views, width, height, bin_dir):
    """Renders the views with our own program and writes capture.json; the start points are the
    Gaussians' centers. Returns the path of capture.json."""
    (folder / "images").mkdir(parents=True, exist_ok=True)
    f = 0.9 * width
    points = folder / "points.ply"
    if not points.exists():
        points.symlink_to(gaussians.resolve())
    document = {
        "format": "motes/capture", "version": "1.0", "world_origin": [0.0, 0.0, 0.0],
        "points": "points.ply",
        "cameras": [{"model": "PINHOLE", "width": width, "height": height,
                     "params": [f, f, width / 2, height / 2]}],
        "views": []}
    for i in range(views):
        rotation, translation = pose(i, views)
        document["views"].append({
            "name": f"view_{i:04}.png", "camera": 0, "image": f"images/view_{i:04}.png",
            "camera_from_world": {"rotation_wxyz": rotation, "translation": translation},
            "split": "train"})
    path = folder / "capture.json"
    path.write_text(json.dumps(document))
    command = [bin_dir / "render", "--capture", path, "--gaussians", gaussians, "--split", "train",
               "-o", folder / "images", "--overwrite", "--quiet", "--no-provenance"]
    subprocess.run([str(word) for word in command], check=True)
    return path
