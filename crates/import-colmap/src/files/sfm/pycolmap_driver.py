#!/usr/bin/env python3
"""Camera poses from photos, with pycolmap, as a child process of motes.

stdout carries one JSON object per line and nothing else:

  {"event":"progress","phase":"features|matching|mapping","done":i,"total":n}
  {"event":"warning","code":...,"message":...,"photo":NAME or absent}
  {"event":"result", ...}                                   last line, exit code 0
  {"event":"error","code":...,"message":...,"remedy":...}   last line, exit code 1

All other talk (COLMAP's log, Python warnings) goes to stderr.

Error codes: bad_usage, no_pycolmap, no_photos, too_few_photos, bad_photo, bad_mask, too_few_features,
too_few_matches, no_model, internal.
Warning codes: bad_photo (left out), truncated_photo, exif_orientation, no_exif_focal, mixed_sizes,
mixed_focals, focal_moved, not_all_registered, several_models, mask_missing.

Files written under WORKSPACE: database.db, sparse/0, sparse/1, ... (COLMAP binary models, the one with the
most photos first) and, if masks are given, masks/. Those are replaced when they exist.

Reproducibility: a run is a function of the photos, the options and --seed. Ids are given here in name order
(COLMAP's own reader threads give them in order of completion), every random generator is seeded, and the
mapper runs on one thread, because a parallel bundle adjustment adds floating-point numbers in any order.
Feature extraction treats each photo by itself, so it may use all threads; matching is in pycolmap_match.py.

EXIF orientation: COLMAP does not apply it. It works on the pixels as stored, and so do the keypoints and poses
that come out. Hand over upright copies if the rest of the program turns photos upright; a warning names the
photos that carry an orientation other than 1.

Pillow must not be imported here: its wheel and pycolmap's carry different zlibs whose symbols clash (writing a
PNG with Pillow after importing pycolmap 4.2.1 aborts the process).
"""

import argparse
import math
import os
import shutil
import statistics
import sys
import time

from pycolmap_contradicted import leave_out_contradicted
from pycolmap_events import Events, Failure, Watch, count_features, count_pairs, end_with_parent, photos_done
from pycolmap_match import match_pairs
from pycolmap_photos import group_photos, list_photos, make_database, read_photos, stage_masks

EXHAUSTIVE_UP_TO = 60  # pairs grow with the square of the photos: 60 are 1770 pairs, minutes on two cores
# Sequential matching, as COLMAP does it: with the photos at these distances in name order.
NEIGHBOR_STEPS = [1 << k for k in range(10)]
FOCAL_MOVED = 0.15     # EXIF focal lengths are rounded to whole millimeters, so a few percent off is normal
MIN_FEATURES = 50      # a photo with fewer cannot be placed reliably (the mapper wants 30 inliers)


class Arguments(argparse.ArgumentParser):
    def error(self, message):
        raise Failure("bad_usage", message, "Run with --help to see the options.")


def parse_arguments(argv):
    def yes_no(text):
        if text not in ("true", "false"):
            raise argparse.ArgumentTypeError("use true or false, not '%s'" % text)
        return text == "true"

    def at_least(low):
        def check(text):
            try:
                value = int(text)
            except ValueError:
                raise argparse.ArgumentTypeError("'%s' is not a whole number" % text)
            if value < low:
                raise argparse.ArgumentTypeError("%d is below %d" % (value, low))
            return value
        return check

    def positive(what):
        def check(text):
            try:
                value = float(text)
            except ValueError:
                value = math.nan
            if not (math.isfinite(value) and value > 0):
                raise argparse.ArgumentTypeError("'%s' is not %s" % (text, what))
            return value
        return check

    p = Arguments(description="camera poses from photos with pycolmap; JSON lines on stdout")
    p.add_argument("--photos", required=True, metavar="DIR", help="folder of photos, subfolders included")
    p.add_argument("--workspace", required=True, metavar="DIR", help="where database.db and sparse/ go")
    p.add_argument("--end-with-parent", action="store_true",
                   help="end when the program that holds standard input open does")
    p.add_argument("--scratch", metavar="DIR", help="a folder to remove then")
    p.add_argument("--seed", type=at_least(0), default=0, metavar="N")
    prior = p.add_mutually_exclusive_group()
    prior.add_argument("--focal-px", type=positive("a focal length in pixels"), metavar="F",
                       help="focal length prior for every photo, in pixels of the photos as given")
    prior.add_argument("--focal-from-exif", action="store_true",
                       help="focal length prior from EXIF; without a prior the start is 1.2 x the long side")
    p.add_argument("--refine-focal", type=yes_no, default=True, metavar="true|false",
                   help="false holds the focal length at its prior: for a few photos, whose geometry hardly fixes it")
    p.add_argument("--camera-model", default="SIMPLE_RADIAL", metavar="NAME", help="COLMAP camera model")
    p.add_argument("--single-camera", type=yes_no, default=None, metavar="true|false",
                   help="true: one camera per photo size; false: one per photo; "
                        "left out: one per size, EXIF camera and EXIF focal length")
    p.add_argument("--masks", metavar="DIR",
                   help="PHOTO.png or PHOTO.jpg.png for each photo; black pixels give no features")
    p.add_argument("--matcher", choices=("auto", "exhaustive", "sequential"), default="auto",
                   help="auto: exhaustive up to %d photos, then neighbors in name order" % EXHAUSTIVE_UP_TO)
    p.add_argument("--max-image-size", type=at_least(64), metavar="N",
                   help="long side in pixels for feature detection; positions stay in full-size pixels")
    p.add_argument("--threads", type=at_least(1), metavar="N", help="for features and matching; default all")
    p.add_argument("--peak-threshold", type=positive("a threshold"), metavar="T",
                   help="least contrast of a feature in the difference of Gaussians, 0 to 1; default COLMAP's, 0.0067")
    p.add_argument("--guided-matching", type=yes_no, default=False, metavar="true|false",
                   help="match once more along the epipolar lines of the first matches, and leave out photos whose matches "
                        "contradict the model")
    p.add_argument("--max-features", type=at_least(64), default=8192, metavar="N", help="per photo")
    return p.parse_args(argv)

def triangulation_angles(numpy, model):
    """For every point the widest angle, in degrees, between two of the rays that see it."""
    centers = {i: image.projection_center() for i, image in model.images.items() if image.has_pose}
    angles = []
    for point in model.points3D.values():
        seen_from = sorted({e.image_id for e in point.track.elements})
        rays = numpy.array([centers[i] for i in seen_from]) - point.xyz
        rays /= numpy.maximum(numpy.linalg.norm(rays, axis=1, keepdims=True), 1e-300)
        cosine = numpy.clip((rays @ rays.T).min(), -1.0, 1.0)
        angles.append(math.degrees(math.acos(cosine)))
    return angles


def describe_model(numpy, model, path, groups):
    of_camera = {g.camera_id: g for g in groups}
    photos_of = {}
    for image in model.images.values():
        if image.has_pose:
            photos_of[image.camera_id] = photos_of.get(image.camera_id, 0) + 1
    angles = triangulation_angles(numpy, model)
    cameras = []
    for camera_id in sorted(photos_of):
        camera, group = model.cameras[camera_id], of_camera[camera_id]
        cameras.append({
            "id": camera_id, "model": camera.model_name, "width": camera.width, "height": camera.height,
            "params": [float(v) for v in camera.params], "focal_px": float(camera.mean_focal_length()),
            "focal_prior_px": group.prior, "focal_prior_source": group.source, "photos": photos_of[camera_id],
        })
    points = model.num_points3D()
    return {
        "path": path,
        "registered": model.num_reg_images(),
        "points": points,
        "mean_reprojection_error_px": float(model.compute_mean_reprojection_error()) if points else None,
        "mean_track_length": float(model.compute_mean_track_length()) if points else None,
        "median_triangulation_angle_deg": statistics.median(angles) if angles else None,
        "cameras": cameras,
    }


def run(arguments, events):
    started = time.monotonic()
    if arguments.end_with_parent:
        end_with_parent(arguments.scratch)
    names = list_photos(arguments.photos)
    try:
        import numpy
        import pycolmap
    except ImportError as e:
        raise Failure("no_pycolmap", "This Python cannot import pycolmap: %s" % e,
                      "Install what requirements.txt lists: %s -m pip install -r requirements.txt" % sys.executable)
    pycolmap.logging.alsologtostderr = True
    model_name = arguments.camera_model.upper()
    if model_name not in pycolmap.CameraModelId.__members__ or model_name in ("INVALID", "EQUIRECTANGULAR"):
        raise Failure("bad_usage", "'%s' is not a camera model with a focal length." % arguments.camera_model,
                      "Use SIMPLE_RADIAL (phones, cameras), OPENCV (wide lenses), OPENCV_FISHEYE, or PINHOLE "
                      "(photos without distortion).")

    photos, failed = read_photos(pycolmap, arguments.photos, names, events)
    names = [p.name for p in photos]
    groups = group_photos(photos, arguments, events)

    workspace = os.path.abspath(arguments.workspace)
    database, sparse = os.path.join(workspace, "database.db"), os.path.join(workspace, "sparse")
    masks, drafts = os.path.join(workspace, "masks"), os.path.join(workspace, "sparse.partial")
    os.makedirs(workspace, exist_ok=True)
    for suffix in ("", "-wal", "-shm"):
        if os.path.exists(database + suffix):
            os.remove(database + suffix)
    for folder in (sparse, masks, drafts):
        shutil.rmtree(folder, ignore_errors=True)
    make_database(pycolmap, database, groups, model_name)

    seed, threads = arguments.seed, arguments.threads or os.cpu_count() or 1
    pycolmap.set_random_seed(seed)

    # COLMAP skips a photo that has no mask in the mask folder, so photos with and without are read apart.
    masked = stage_masks(pycolmap, arguments.masks, photos, masks, events) if arguments.masks else []
    batches = [(masked, masks), ([name for name in names if name not in set(masked)], None)]
    extraction = pycolmap.FeatureExtractionOptions()
    extraction.use_gpu = False
    extraction.num_threads = threads
    extraction.sift.max_num_features = arguments.max_features
    if arguments.peak_threshold:
        extraction.sift.peak_threshold = arguments.peak_threshold
    if arguments.max_image_size:
        extraction.max_image_size = arguments.max_image_size
    with Watch(pycolmap, events, [database], photos_done, "features", len(names)):
        for batch, mask_folder in batches:
            if not batch:
                continue
            reader = pycolmap.ImageReaderOptions()
            reader.camera_model = model_name
            if mask_folder:
                reader.mask_path = mask_folder
            pycolmap.extract_features(database, arguments.photos, image_names=batch, reader_options=reader,
                                      extraction_options=extraction, device=pycolmap.Device.cpu)
    features = count_features(pycolmap, database)
    poor = [n for n in names if features.get(n, 0) < MIN_FEATURES]
    if len(names) - len(poor) < 2:
        raise Failure("too_few_features", "Almost nothing to hold on to in the photos: %d of %d have fewer than %d "
                      "features." % (len(poor), len(names), MIN_FEATURES),
                      "Use sharp, well-lit photos of a textured subject; put a printed pattern or newspaper under a "
                      "plain one.")

    n = len(names)
    exhaustive = arguments.matcher == "exhaustive" or (arguments.matcher == "auto" and n <= EXHAUSTIVE_UP_TO)
    reach = range(1, n) if exhaustive else NEIGHBOR_STEPS
    tried = [(names[i], names[i + step]) for i in range(n) for step in reach if i + step < n]
    match_pairs(pycolmap, events, database, tried, threads, seed, arguments.guided_matching)
    pairs = count_pairs(pycolmap, database)
    if pairs == 0:
        raise Failure("too_few_matches", "No two of the %d photos show the same thing from nearby places." % n,
                      "Take photos that overlap: move about 15 degrees around the subject between shots and keep it "
                      "in view.")

    mapping = pycolmap.IncrementalPipelineOptions()
    mapping.num_threads = 1
    mapping.random_seed = seed
    mapping.mapper.random_seed = seed
    mapping.mapper.num_threads = 1
    mapping.ba_refine_focal_length = arguments.refine_focal
    mapping.mapper.abs_pose_refine_focal_length = arguments.refine_focal
    mapping.triangulation.random_seed = seed
    # COLMAP drops second models with fewer than 10 photos; a small capture should still show its pieces.
    mapping.min_model_size = max(3, min(mapping.min_model_size, n // 2))
    placed = [0]

    def reset():
        placed[0] = 2
        events.progress("mapping", 2, n)

    def advance():
        placed[0] += 1
        events.progress("mapping", min(placed[0], n), n)

    events.progress("mapping", 0, n)
    os.makedirs(drafts)
    models = pycolmap.incremental_mapping(database, arguments.photos, drafts, options=mapping,
                                          initial_image_pair_callback=reset, next_image_callback=advance)
    models = [m for _, m in sorted(models.items())]
    contradicted = 0
    if arguments.guided_matching:
        # Matches along epipolar lines of a chance pair agree with each other, and place a photo where it was not.
        adjustment = mapping.get_global_bundle_adjustment()
        contradicted = sum(leave_out_contradicted(pycolmap, numpy, m, database, adjustment) for m in models)
    models.sort(key=lambda m: (-m.num_reg_images(), -m.num_points3D()))
    models = [m for m in models if m.num_reg_images() >= 2 and m.num_points3D() > 0]
    if not models:
        raise Failure("no_model", "Photo pairs that match: %d, but no camera positions could be worked out from them."
                      % pairs, "Take more photos from more places: step sideways rather than turning on the spot, and "
                      "avoid blank, shiny or moving subjects.")
    described = []
    for index, model in enumerate(models):
        path = os.path.join(sparse, str(index))
        os.makedirs(path)
        model.write_binary(path)
        described.append(describe_model(numpy, model, path, groups))
    shutil.rmtree(drafts, ignore_errors=True)
    events.progress("mapping", n, n)

    best = models[0]
    registered = {image.name for image in best.images.values() if image.has_pose}
    lost = [name for name in names if name not in registered]
    if lost:
        events.warning("not_all_registered", "%d of %d photos have no pose in the largest model." % (len(lost), n))
    if len(models) > 1:
        events.warning("several_models", "The photos fall into %d groups that do not join; photos between the groups "
                       "would link them." % len(models))
    for camera in described[0]["cameras"]:
        prior, focal = camera["focal_prior_px"], camera["focal_px"]
        if prior and abs(focal / prior - 1) > FOCAL_MOVED:
            events.warning("focal_moved", "Camera %d ended at a focal length of %.0f px, %+.0f %% from its prior of "
                           "%.0f px: one of the two is wrong. --refine-focal false holds it."
                           % (camera["id"], focal, 100 * (focal / prior - 1), prior))
    main = max(described[0]["cameras"], key=lambda c: (c["photos"], -c["id"]))
    without = sum(len(g.photos) for g in groups if g.source == "none")
    # Where the camera of most photos has no prior either, motes says so itself.
    if main["focal_prior_source"] == "exif" and without:
        events.warning("no_exif_focal", "%d of %d photos carry no EXIF focal length, without which a wrong one can go "
                       "unseen at a low reprojection error; if you know it, give --focal" % (without, len(photos)))
    times = os.times()
    events.emit(event="result", models=described, photos=n + len(failed), failed=sorted(failed + lost),
                focal_prior_px=main["focal_prior_px"], focal_prior_source=main["focal_prior_source"],
                focal_px=main["focal_px"], matcher="exhaustive" if exhaustive else "sequential",
                contradicted=contradicted, verified_pairs=pairs, features=sum(features.values()),
                pycolmap=pycolmap.__version__, seed=seed,
                seconds=round(time.monotonic() - started, 2), cpu_seconds=round(sum(times[:4]), 2))  # children included


def main(argv):
    events = Events()
    try:
        run(parse_arguments(argv), events)
        return 0
    except Failure as e:
        failure = e
    except Exception as e:  # a child process owes its parent one readable line whatever goes wrong
        if os.environ.get("MOTES_SFM_TRACE"):
            raise
        failure = Failure("internal", "%s: %s" % (type(e).__name__, " ".join(str(e).split())),
                          "Run again with MOTES_SFM_TRACE=1 in the environment to see where it happened.")
    print("error: %s %s" % (failure.message, failure.remedy), file=sys.stderr)
    events.emit(event="error", code=failure.code, message=failure.message, remedy=failure.remedy)
    return 1


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
