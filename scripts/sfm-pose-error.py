#!/usr/bin/env python3
"""How far the cameras of a COLMAP model are from the truth.

    python3 scripts/sfm-pose-error.py MODEL_DIR transforms.json

MODEL_DIR holds cameras.bin and images.bin; transforms.json is nerfstudio style (camera-to-world, x right, y up,
z backward). Structure from motion knows neither where, nor which way up, nor how large the scene is, so the
model is first laid on the truth by the similarity with the least squared camera-center error (Umeyama 1991).
Center errors are then given in percent of the median distance from the true cameras to the point nearest to
all their optical axes, rotation errors in degrees. Prints one JSON object. Needs numpy only.

--max-center-percent X and --max-rotation-deg X turn it into a check: exit code 1 when the worst camera is
above, or when a camera of the truth is missing from the model.
"""

import argparse
import json
import os
import struct
import sys

import numpy as np

# Number of parameters of each COLMAP camera model id, to step over those that are not looked at.
PARAMETERS = {0: 3, 1: 4, 2: 4, 3: 5, 4: 8, 5: 8, 6: 12, 7: 5, 8: 4, 9: 5, 10: 12, 11: 16, 12: 4, 13: 5, 14: 3, 15: 4,
              16: 6, 17: 2}
ONE_FOCAL = {0, 2, 3, 8, 9, 12, 14}


class Reader:
    def __init__(self, path):
        with open(path, "rb") as f:
            self.data = f.read()
        self.at = 0

    def take(self, layout):
        values = struct.unpack_from("<" + layout, self.data, self.at)
        self.at += struct.calcsize("<" + layout)
        return values

    def name(self):
        end = self.data.index(b"\0", self.at)
        text = self.data[self.at:end].decode("utf-8")
        self.at = end + 1
        return text


def read_cameras(path):
    """Camera id to its focal length in pixels (mean of fx and fy)."""
    r = Reader(path)
    focal = {}
    for _ in range(r.take("Q")[0]):
        camera, model, _, _ = r.take("IiQQ")
        if model not in PARAMETERS:
            raise SystemExit("error: %s: unknown camera model id %d" % (path, model))
        p = r.take("%dd" % PARAMETERS[model])
        focal[camera] = p[0] if model in ONE_FOCAL else (p[0] + p[1]) / 2
    return focal


def quaternion_to_matrix(w, x, y, z):
    n = (w * w + x * x + y * y + z * z) ** 0.5
    w, x, y, z = w / n, x / n, y / n, z / n
    return np.array([[1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
                     [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
                     [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)]])


def read_images(path):
    """Name to (center, camera-to-world rotation with y down and z forward, camera id)."""
    r = Reader(path)
    poses = {}
    for _ in range(r.take("Q")[0]):
        v = r.take("I7dI")
        name = r.name()
        keypoints, = r.take("Q")
        r.at += 24 * keypoints  # two doubles and a point id each
        rotation = quaternion_to_matrix(*v[1:5]).T
        poses[name] = (-rotation @ np.array(v[5:8]), rotation, v[8])
    return poses


def read_truth(path):
    with open(path, encoding="utf-8") as f:
        data = json.load(f)
    poses = {}
    for frame in data["frames"]:
        m = np.array(frame["transform_matrix"], dtype=float)
        focal = frame.get("fl_x", data.get("fl_x"))
        poses[frame["file_path"]] = (m[:3, 3], m[:3, :3] @ np.diag([1.0, -1.0, -1.0]), focal)
    return poses


def pair_up(truth, found):
    """By whole name; failing that by file name, since one side often has an images/ in front."""
    pairs, lost = [], []
    by_file = {}
    for name in found:
        by_file.setdefault(os.path.basename(name), []).append(name)
    for name in sorted(truth):
        same = [name] if name in found else by_file.get(os.path.basename(name), [])
        if len(same) == 1:
            pairs.append((name, same[0]))
        else:
            lost.append(name)
    return pairs, lost


def similarity(source, target):
    """Scale, rotation and shift that bring the source points nearest to the target points."""
    a, b = source.mean(axis=0), target.mean(axis=0)
    x, y = source - a, target - b
    u, d, vt = np.linalg.svd(y.T @ x / len(x))
    s = np.eye(3)
    if np.linalg.det(u) * np.linalg.det(vt) < 0:
        s[2, 2] = -1  # a mirror image would fit better, but no camera rig is a mirror image of itself
    rotation = u @ s @ vt
    scale = np.trace(np.diag(d) @ s) / (x ** 2).sum(axis=1).mean()
    return scale, rotation, b - scale * rotation @ a


def nearest_to_axes(centers, directions):
    a, b = np.zeros((3, 3)), np.zeros(3)
    for c, d in zip(centers, directions):
        p = np.eye(3) - np.outer(d, d)
        a += p
        b += p @ c
    return np.linalg.solve(a, b)


def main():
    p = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    p.add_argument("model")
    p.add_argument("truth")
    p.add_argument("--max-center-percent", type=float)
    p.add_argument("--max-rotation-deg", type=float)
    a = p.parse_args()
    truth = read_truth(a.truth)
    focal = read_cameras(os.path.join(a.model, "cameras.bin"))
    found = read_images(os.path.join(a.model, "images.bin"))
    pairs, lost = pair_up(truth, found)
    if len(pairs) < 3:
        raise SystemExit("error: %d photos are in both the model and the truth; an alignment needs 3" % len(pairs))

    true_centers = np.array([truth[t][0] for t, _ in pairs])
    true_turns = [truth[t][1] for t, _ in pairs]
    scale, rotation, shift = similarity(np.array([found[f][0] for _, f in pairs]), true_centers)
    centers = np.array([scale * rotation @ found[f][0] + shift for _, f in pairs])
    scene = nearest_to_axes(true_centers, [r[:, 2] for r in true_turns])
    distance = float(np.median(np.linalg.norm(true_centers - scene, axis=1)))
    off = 100 * np.linalg.norm(centers - true_centers, axis=1) / distance
    turns = []
    for (_, f), true in zip(pairs, true_turns):
        between = true.T @ rotation @ found[f][1]
        # From the antisymmetric part: the arc cosine of the trace loses all digits near zero.
        twist = between - between.T
        sine = np.linalg.norm([twist[2, 1], twist[0, 2], twist[1, 0]]) / 2
        turns.append(float(np.degrees(np.arctan2(sine, (np.trace(between) - 1) / 2))))
    focal_off = [100 * (focal[found[f][2]] / truth[t][2] - 1) for t, f in pairs if truth[t][2]]
    worst = int(np.argmax(off))
    focal_error = {"max": max(focal_off, key=abs), "mean": float(np.mean(focal_off))} if focal_off else None
    print(json.dumps({
        "cameras": len(pairs), "missing": lost, "scale": float(scale), "median_camera_distance": distance,
        "center_error_percent": {"max": float(off.max()), "mean": float(off.mean()), "worst": pairs[worst][0]},
        "rotation_error_deg": {"max": max(turns), "mean": float(np.mean(turns))},
        "focal_error_percent": focal_error,
    }, indent=1))
    bad = []
    if a.max_center_percent is not None and off.max() > a.max_center_percent:
        bad.append("a camera center is off by %.4f %%" % off.max())
    if a.max_rotation_deg is not None and max(turns) > a.max_rotation_deg:
        bad.append("a camera is turned by %.4f degrees" % max(turns))
    if bad or (lost and (a.max_center_percent is not None or a.max_rotation_deg is not None)):
        print("error: " + "; ".join(bad + ["missing: %s" % n for n in lost]), file=sys.stderr)
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
