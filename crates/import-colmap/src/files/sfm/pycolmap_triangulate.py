#!/usr/bin/env python3
"""Points for photos whose poses are known, with pycolmap, as a child process of motes.

Features, matching of the pairs that the request names, triangulation; poses and intrinsics stay as they are. The
request is JSON: {"photos":[{"name","width","height","params":[fx,fy,cx,cy],"rotation_wxyz","translation"}, ...],
"pairs":[[NAME,NAME], ...]}; photos without lens distortion, poses as camera_from_world. What is said on stdout is
described in pycolmap_driver.py; the last line is {"event":"result","points":n,...} and the model lies in
WORKSPACE/sparse/0.
"""

import argparse
import json
import os
import shutil
import sys
import time

from pycolmap_events import Events, Failure, Watch, count_pairs, photos_done
from pycolmap_match import match_pairs


def posed_model(pycolmap, database, photos):
    """Cameras, photos and poses, in the database and as a model without points. Ids count from 1 in the order of
    the request in both."""
    model = pycolmap.Reconstruction()
    db = pycolmap.Database.open(database)
    try:
        camera_of = {}
        for photo in photos:
            key = (photo["width"], photo["height"], tuple(photo["params"]))
            if key not in camera_of:
                camera = pycolmap.Camera(model="PINHOLE", width=key[0], height=key[1], params=list(key[2]))
                camera.has_prior_focal_length = True
                camera.camera_id = db.write_camera(camera)
                rig = pycolmap.Rig()
                rig.add_ref_sensor(camera.sensor_id)
                rig.rig_id = db.write_rig(rig)
                model.add_camera_with_trivial_rig(camera)
                camera_of[key] = (camera, rig.rig_id)
        for photo in photos:
            camera, rig_id = camera_of[(photo["width"], photo["height"], tuple(photo["params"]))]
            image = pycolmap.Image(name=photo["name"], camera_id=camera.camera_id)
            image.image_id = db.write_image(image)
            frame = pycolmap.Frame()
            frame.rig_id = rig_id
            frame.add_data_id(db.read_image(image.image_id).data_id)
            db.write_frame(frame)
            w, x, y, z = photo["rotation_wxyz"]
            pose = pycolmap.Rigid3d(pycolmap.Rotation3d([x, y, z, w]), photo["translation"])
            model.add_image_with_trivial_frame(image, pose)
    finally:
        db.close()
    return model


# Pixels of all photos from which features are not looked for in photos of twice the size: a quarter of the features of
# many photos is enough, and takes a quarter of the time.
MANY_PIXELS = 25_000_000


def match(pycolmap, arguments, events, database, request):
    photos, pairs = request["photos"], request["pairs"]
    names = [photo["name"] for photo in photos]
    extraction = pycolmap.FeatureExtractionOptions()
    if sum(photo["width"] * photo["height"] for photo in photos) > MANY_PIXELS:
        extraction.sift.first_octave = 0
    extraction.use_gpu = False
    extraction.num_threads = arguments.threads
    with Watch(pycolmap, events, [database], photos_done, "features", len(names)):
        pycolmap.extract_features(database, arguments.photos, image_names=names, extraction_options=extraction,
                                  device=pycolmap.Device.cpu)
    match_pairs(pycolmap, events, database, pairs, arguments.threads, arguments.seed)
    if count_pairs(pycolmap, database) == 0:
        raise Failure("too_few_matches", "No two of the %d photos show the same thing." % len(names),
                      "Check that every photo has its own pose.")


def run(arguments, events):
    started = time.monotonic()
    try:
        import pycolmap
    except ImportError as e:
        raise Failure("no_pycolmap", "This Python cannot import pycolmap: %s" % e,
                      "Install what requirements.txt lists: %s -m pip install -r requirements.txt" % sys.executable)
    pycolmap.logging.alsologtostderr = True
    with open(arguments.request, encoding="utf-8") as f:
        request = json.load(f)
    workspace = os.path.abspath(arguments.workspace)
    database, path = os.path.join(workspace, "database.db"), os.path.join(workspace, "sparse", "0")
    for suffix in ("", "-wal", "-shm"):
        if os.path.exists(database + suffix):
            os.remove(database + suffix)
    shutil.rmtree(path, ignore_errors=True)
    os.makedirs(path)
    model = posed_model(pycolmap, database, request["photos"])
    pycolmap.set_random_seed(arguments.seed)
    match(pycolmap, arguments, events, database, request)
    options = pycolmap.IncrementalPipelineOptions()
    options.num_threads = 1
    options.random_seed = arguments.seed
    options.triangulation.random_seed = arguments.seed
    events.progress("triangulating", 0, 1)
    model = pycolmap.triangulate_points(model, database, arguments.photos, path, clear_points=True, options=options,
                                        refine_intrinsics=False)
    model.write_binary(path)
    events.progress("triangulating", 1, 1)
    points = model.num_points3D()
    events.emit(event="result", points=points, pycolmap=pycolmap.__version__,
                mean_reprojection_error_px=float(model.compute_mean_reprojection_error()) if points else None,
                seconds=round(time.monotonic() - started, 2))


def main(argv):
    p = argparse.ArgumentParser(description="points for photos with known poses; JSON lines on stdout")
    p.add_argument("--photos", required=True, metavar="DIR")
    p.add_argument("--workspace", required=True, metavar="DIR")
    p.add_argument("--request", required=True, metavar="FILE")
    p.add_argument("--threads", type=int, default=1, metavar="N")
    p.add_argument("--seed", type=int, default=0, metavar="N")
    arguments = p.parse_args(argv)
    events = Events()
    try:
        run(arguments, events)
        return 0
    except Failure as e:
        failure = e
    except Exception as e:  # a child process owes its parent one readable line whatever goes wrong
        failure = Failure("internal", "%s: %s" % (type(e).__name__, " ".join(str(e).split())),
                          "Leave it out with --triangulate off: train-splat finds start points itself.")
    print("error: %s %s" % (failure.message, failure.remedy), file=sys.stderr)
    events.emit(event="error", code=failure.code, message=failure.message, remedy=failure.remedy)
    return 1


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
