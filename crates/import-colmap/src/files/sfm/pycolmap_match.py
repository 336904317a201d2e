#!/usr/bin/env python3
"""Matches pairs of photos with pycolmap, in processes of one thread each.

Threads of one process would be simpler, but pycolmap 4.2.1 then loses matches of a pair now and then, and the same
photos give other poses. Each process has a database of its own, with the photos that its pairs need: COLMAP does not
wait for a database that another process holds, it aborts. The outcome does not depend on the number of processes.

As a script this is one of the processes: pycolmap_match.py DATABASE PAIRS SEED GUIDED
"""

import os
import shutil
import subprocess
import sys
from contextlib import closing

from pycolmap_events import Failure, Watch, end_with_parent, pairs_done


def match_pairs(pycolmap, events, database, pairs, processes, seed, guided=False):
    """Matches and verifies pairs of names of photos whose features are in the database, and puts what is found there."""
    folder = os.path.join(os.path.dirname(database), "matching")
    shutil.rmtree(folder, ignore_errors=True)
    os.makedirs(folder)
    with closing(pycolmap.Database.open(database)) as photos:
        id_of = {image.name: image.image_id for image in photos.read_all_images()}
    pairs = [(id_of[a], id_of[b]) for a, b in pairs]
    count = max(1, min(processes, len(pairs)))
    parts = [pairs[len(pairs) * k // count:len(pairs) * (k + 1) // count] for k in range(count)]
    try:
        databases = [os.path.join(folder, "%d.db" % k) for k in range(count)]
        for path, part in zip(databases, parts):
            take_photos(pycolmap, database, path, {i for pair in part for i in pair})
        run_all(pycolmap, events, databases, parts, seed, guided)
        with closing(pycolmap.Database.open(database)) as target:
            for path in databases:
                bring_matches(pycolmap, path, target)
    finally:
        shutil.rmtree(folder, ignore_errors=True)


def take_photos(pycolmap, source, path, ids):
    """A new database with those photos of another, under the same ids. They are named by these, since COLMAP takes the
    names of a pair apart at spaces."""
    with closing(pycolmap.Database.open(source)) as old, closing(pycolmap.Database.open(path)) as new:
        for camera in old.read_all_cameras():
            new.write_camera(camera, use_camera_id=True)
        for rig in old.read_all_rigs():
            new.write_rig(rig, use_rig_id=True)
        taken = [image for image in old.read_all_images() if image.image_id in ids]
        frames = {image.frame_id for image in taken}
        for frame in old.read_all_frames():
            if frame.frame_id in frames:
                new.write_frame(frame, use_frame_id=True)
        for image in taken:
            image.name = str(image.image_id)
            new.write_image(image, use_image_id=True)
            new.write_keypoints(image.image_id, old.read_keypoints(image.image_id))
            new.write_descriptors(image.image_id, old.read_descriptors(image.image_id))


def bring_matches(pycolmap, path, target):
    with closing(pycolmap.Database.open(path)) as part:
        for pair, matches in zip(*part.read_all_matches()):
            target.write_matches(*pycolmap.pair_id_to_image_pair(pair), matches)
        for pair, geometry in zip(*part.read_two_view_geometries()):
            target.write_two_view_geometry(*pycolmap.pair_id_to_image_pair(pair), geometry)


def run_all(pycolmap, events, databases, parts, seed, guided):
    children = []
    total = sum(len(part) for part in parts)
    try:
        with Watch(pycolmap, events, databases, pairs_done, "matching", total):
            for path, part in zip(databases, parts):
                with open(path + ".txt", "w", encoding="utf-8") as f:
                    f.writelines("%d %d\n" % pair for pair in part)
                command = [sys.executable, os.path.abspath(__file__), path, f.name, str(seed), str(int(guided))]
                children.append(subprocess.Popen(command, stdin=subprocess.PIPE, stdout=sys.stderr))
            for child in children:
                if child.wait() != 0:
                    raise Failure("internal", "pycolmap ended while it matched photos (exit code %d)." % child.returncode,
                                  "Run again with -v to see its log; fewer --threads need less memory.")
    finally:
        for child in children:
            child.kill()
            child.wait()
            child.stdin.close()


def match_part(database, pairs, seed, guided):
    import pycolmap
    pycolmap.set_random_seed(seed)
    matching = pycolmap.FeatureMatchingOptions()
    matching.use_gpu = False
    matching.num_threads = 1
    matching.guided_matching = guided
    verification = pycolmap.TwoViewGeometryOptions()
    verification.ransac.random_seed = seed
    pairing = pycolmap.ImportedPairingOptions()
    pairing.match_list_path = pairs
    pycolmap.logging.alsologtostderr = True
    pycolmap.match_image_pairs(database, matching_options=matching, pairing_options=pairing,
                               verification_options=verification, device=pycolmap.Device.cpu)


if __name__ == "__main__":
    end_with_parent(None)
    match_part(sys.argv[1], sys.argv[2], int(sys.argv[3]), sys.argv[4] == "1")
