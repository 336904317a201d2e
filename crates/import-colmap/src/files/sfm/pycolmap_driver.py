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
Feature extraction and matching treat each photo or pair by itself, so they may use all threads.

EXIF orientation: COLMAP does not apply it. It works on the pixels as stored, and so do the keypoints and poses
that come out. Hand over upright copies if the rest of the program turns photos upright; a warning names the
photos that carry an orientation other than 1.

Pillow must not be imported here: its wheel and pycolmap's carry different zlibs whose symbols clash (writing a
PNG with Pillow after importing pycolmap 4.2.1 aborts the process).
"""

import argparse
import json
import math
import os
import shutil
import sqlite3
import sys
import threading
import time

PHOTO_SUFFIXES = (".jpg", ".jpeg", ".png", ".tif", ".tiff", ".bmp")
EXHAUSTIVE_UP_TO = 60  # pairs grow with the square of the photos: 60 are 1770 pairs, minutes on two cores
FOCAL_GUESS = 1.2      # focal length / long side when nothing is known; COLMAP's own default factor
FOCAL_MOVED = 0.15     # EXIF focal lengths are rounded to whole millimeters, so a few percent off is normal
MIN_FEATURES = 50      # a photo with fewer cannot be placed reliably (the mapper wants 30 inliers)


class Failure(Exception):
    def __init__(self, code, message, remedy):
        super().__init__(message)
        self.code, self.message, self.remedy = code, message, remedy


class Events:
    """Writes the JSON lines to the real stdout and points file descriptor 1 at stderr, so that no
    library, C++ ones included, can put a stray line among them."""

    def __init__(self):
        self.out = os.fdopen(os.dup(1), "w", encoding="utf-8", newline="\n")
        os.dup2(2, 1)
        self.lock = threading.Lock()
        self.last = None

    def emit(self, **fields):
        line = json.dumps(fields, ensure_ascii=False, allow_nan=False)
        with self.lock:
            self.out.write(line + "\n")
            self.out.flush()

    def progress(self, phase, done, total):
        now = (phase, done, total)
        if now != self.last:
            self.last = now
            self.emit(event="progress", phase=phase, done=done, total=total)

    def warning(self, code, message, photo=None):
        extra = {} if photo is None else {"photo": photo}
        self.emit(event="warning", code=code, message=message, **extra)


class CountRows:
    """Reports progress while a COLMAP call blocks, by counting rows in its database from a second,
    read-only connection: the calls themselves tell nothing. The database is in WAL mode, so this
    reader never holds up the writer."""

    def __init__(self, events, database, table, phase, total):
        self.events, self.database, self.table = events, database, table
        self.phase, self.total = phase, total
        self.stop = threading.Event()
        self.thread = threading.Thread(target=self.watch, daemon=True)

    def watch(self):
        while not self.stop.wait(0.5):
            try:
                db = sqlite3.connect(self.database, timeout=0.2)
                try:
                    db.execute("PRAGMA query_only=1")
                    rows = db.execute("SELECT COUNT(*) FROM " + self.table).fetchone()[0]
                finally:
                    db.close()
            except sqlite3.Error:
                continue  # only a progress report is lost
            self.events.progress(self.phase, min(rows, self.total), self.total)

    def __enter__(self):
        self.events.progress(self.phase, 0, self.total)
        self.thread.start()
        return self

    def __exit__(self, kind, value, trace):
        self.stop.set()
        self.thread.join()
        if kind is None:
            self.events.progress(self.phase, self.total, self.total)


def end_with_parent(scratch):
    """motes holds our standard input open as long as it lives, and never writes: the end of it is the end of motes,
    also of one that was killed. Nobody would hear us then, so end too, and take the scratch folder along."""

    def watch():
        # Not sys.stdin: a thread that waits there holds its lock, and the interpreter aborts at its end for want of it.
        while os.read(0, 4096):
            pass
        if scratch:
            for _ in range(3):  # other threads may still write into it
                shutil.rmtree(scratch, ignore_errors=True)
        os._exit(1)

    threading.Thread(target=watch, daemon=True).start()


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

    def focal(text):
        try:
            value = float(text)
        except ValueError:
            value = math.nan
        if not (math.isfinite(value) and value > 0):
            raise argparse.ArgumentTypeError("'%s' is not a focal length in pixels" % text)
        return value

    p = Arguments(description="camera poses from photos with pycolmap; JSON lines on stdout")
    p.add_argument("--photos", required=True, metavar="DIR", help="folder of photos, subfolders included")
    p.add_argument("--workspace", required=True, metavar="DIR", help="where database.db and sparse/ go")
    p.add_argument("--end-with-parent", action="store_true",
                   help="end when the program that holds standard input open does")
    p.add_argument("--scratch", metavar="DIR", help="a folder to remove then")
    p.add_argument("--seed", type=at_least(0), default=0, metavar="N")
    prior = p.add_mutually_exclusive_group()
    prior.add_argument("--focal-px", type=focal, metavar="F",
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
    p.add_argument("--max-features", type=at_least(64), default=8192, metavar="N", help="per photo")
    return p.parse_args(argv)


def list_photos(folder):
    """Names relative to the folder with '/' between parts, in an order that every machine agrees on."""
    if not os.path.isdir(folder):
        raise Failure("no_photos", "There is no folder '%s'." % folder, "Give the folder that holds the photos.")
    names = []
    for here, folders, files in os.walk(folder):
        folders[:] = [f for f in folders if not f.startswith(".")]
        for name in files:
            if name.lower().endswith(PHOTO_SUFFIXES) and not name.startswith("."):
                names.append(os.path.relpath(os.path.join(here, name), folder).replace(os.sep, "/"))
    names.sort()
    if not names:
        raise Failure("no_photos", "No photos in '%s'." % folder,
                      "Put JPEG, PNG or TIFF photos there; convert other formats (HEIC, WebP, raw) first.")
    if len(names) == 1:
        raise Failure("too_few_photos", "Only one photo in '%s'." % folder,
                      "Take at least 3 photos, better 20, from different places around the subject.")
    return names


def jpeg_is_cut_off(path):
    """The decoder fills a cut-off JPEG with gray and says nothing. Entropy-coded data cannot hold the bytes
    FF D9 (end of image), so a whole file has them after its last start of scan."""
    with open(path, "rb") as f:
        data = f.read()
    if data[:2] != b"\xff\xd8":
        return False
    return data.rfind(b"\xff\xd9") < data.rfind(b"\xff\xda")


class Photo:
    def __init__(self, name, bitmap):
        self.name = name
        self.width, self.height = bitmap.width, bitmap.height
        self.orientation = bitmap.exif_orientation() or 1
        self.model = bitmap.exif_camera_model() or ""
        focal = bitmap.exif_focal_length()
        self.exif_focal = focal if focal and math.isfinite(focal) and focal > 0 else None


def read_photos(pycolmap, folder, names, events):
    """Decodes every photo once, so that a broken one is named here and not met half-way through."""
    photos, failed = [], []
    for name in names:
        path = os.path.join(folder, *name.split("/"))
        try:
            bitmap = pycolmap.Bitmap.read(path, False)
        except Exception as e:  # the binding's exception types are not documented
            print("%s: %s" % (name, e), file=sys.stderr)
            bitmap = None
        if bitmap is None or bitmap.is_empty:
            failed.append(name)
            events.warning("bad_photo", "'%s' cannot be decoded and was left out." % name, name)
            continue
        photo = Photo(name, bitmap)
        if jpeg_is_cut_off(path):
            events.warning("truncated_photo", "'%s' ends in the middle; its lower part may be gray." % name, name)
        if photo.orientation != 1:
            events.warning("exif_orientation", "'%s' has EXIF orientation %d, which is not applied: its pose is for "
                           "the pixels as stored." % (name, photo.orientation), name)
        photos.append(photo)
    if len(photos) < 2:
        named = ", ".join("'%s'" % n for n in failed[:3])
        raise Failure("bad_photo", "%d of %d photos cannot be decoded (%s); fewer than two are left."
                      % (len(failed), len(names), named), "Open them in an image viewer and export them again as JPEG.")
    return photos, failed


def median(values):
    values = sorted(values)
    n = len(values)
    return (values[(n - 1) // 2] + values[n // 2]) / 2


class Group:
    """Photos that share one camera."""

    def __init__(self, photos, arguments):
        self.photos = photos
        self.width, self.height = photos[0].width, photos[0].height
        known = [p.exif_focal for p in photos if p.exif_focal]
        if arguments.focal_px:
            self.prior, self.source = arguments.focal_px, "flag"
        elif arguments.focal_from_exif and known:
            self.prior, self.source = median(known), "exif"
        else:
            self.prior, self.source = None, "none"
        self.focals = sorted(set(round(f, 1) for f in known))


def group_photos(photos, arguments, events):
    def key(photo):
        size = (photo.width, photo.height)
        if arguments.single_camera is True:
            return size
        if arguments.single_camera is False:
            return photo.name
        return size + (photo.model, photo.exif_focal)

    groups = {}
    for photo in photos:
        groups.setdefault(key(photo), []).append(photo)
    groups = [Group(members, arguments) for members in groups.values()]
    if arguments.single_camera is True:
        if len(groups) > 1:
            events.warning("mixed_sizes", "The photos have %d sizes; one camera is used for each size." % len(groups))
        for g in groups:
            if len(g.focals) > 1:
                events.warning("mixed_focals", "Photos that are to share one camera were taken at %d focal lengths "
                               "(%g to %g px): was the zoom used?" % (len(g.focals), g.focals[0], g.focals[-1]))
    if arguments.focal_from_exif:
        without = sum(len(g.photos) for g in groups if g.source == "none")
        if without:
            events.warning("no_exif_focal", "%d of %d photos carry no EXIF focal length, without which a wrong one can go "
                           "unseen at a low reprojection error; if you know it, give --focal" % (without, len(photos)))
    return groups


def make_database(pycolmap, path, groups, model):
    """Fills in cameras and photos before COLMAP sees them: this fixes the ids in name order and puts the focal
    length prior (value and flag) on the camera."""
    try:
        db = pycolmap.Database.open(path)
    except Exception as e:
        raise Failure("internal", "The database '%s' cannot be made: %s" % (path, e),
                      "Choose a workspace on a disk with free space where files can be written.")
    try:
        camera_of = {}
        for group in groups:
            focal = group.prior or FOCAL_GUESS * max(group.width, group.height)
            camera = pycolmap.Camera.create_from_model_name(0, model, focal, group.width, group.height)
            camera.has_prior_focal_length = group.prior is not None
            group.camera_id = db.write_camera(camera)
            camera = db.read_camera(group.camera_id)
            rig = pycolmap.Rig()
            rig.add_ref_sensor(camera.sensor_id)
            rig_id = db.write_rig(rig)
            for photo in group.photos:
                camera_of[photo.name] = (group.camera_id, rig_id)
        for name in sorted(camera_of):
            camera_id, rig_id = camera_of[name]
            image_id = db.write_image(pycolmap.Image(name=name, camera_id=camera_id))
            frame = pycolmap.Frame()
            frame.rig_id = rig_id
            frame.add_data_id(db.read_image(image_id).data_id)
            db.write_frame(frame)
    finally:
        db.close()


def stage_masks(pycolmap, folder, photos, target, events):
    """COLMAP wants MASKS/PHOTO_NAME.png; people also have a mask named after the photo without its suffix.
    Masks are copied under COLMAP's name so that both work and a wrong size is found before the run.
    Returns the names of the photos that have one."""
    if not os.path.isdir(folder):
        raise Failure("bad_mask", "There is no folder '%s'." % folder, "Give the folder that holds the masks.")
    masked = []
    for photo in photos:
        for candidate in (photo.name + ".png", os.path.splitext(photo.name)[0] + ".png"):
            source = os.path.join(folder, *candidate.split("/"))
            if os.path.isfile(source):
                break
        else:
            events.warning("mask_missing", "'%s' has no mask; all of it is used." % photo.name, photo.name)
            continue
        bitmap = pycolmap.Bitmap.read(source, False)
        if bitmap is None:
            raise Failure("bad_mask", "The mask '%s' cannot be decoded." % candidate, "Save it again as an 8-bit PNG.")
        if (bitmap.width, bitmap.height) != (photo.width, photo.height):
            raise Failure("bad_mask", "The mask '%s' is %dx%d but its photo is %dx%d." % (
                candidate, bitmap.width, bitmap.height, photo.width, photo.height),
                "Make the masks at the size of the photos.")
        place = os.path.join(target, *(photo.name + ".png").split("/"))
        os.makedirs(os.path.dirname(place), exist_ok=True)
        shutil.copyfile(source, place)
        masked.append(photo.name)
    if not masked:
        raise Failure("bad_mask", "No mask in '%s' is named after a photo." % folder,
                      "Name the mask of IMG_1.jpg IMG_1.png or IMG_1.jpg.png, in the same subfolder.")
    return masked


def count_features(path):
    db = sqlite3.connect(path)
    try:
        return dict(db.execute("SELECT images.name, COALESCE(keypoints.rows, 0) FROM images "
                               "LEFT JOIN keypoints USING (image_id)"))
    finally:
        db.close()


def count_pairs(path):
    db = sqlite3.connect(path)
    try:
        return db.execute("SELECT COUNT(*) FROM two_view_geometries WHERE rows > 0").fetchone()[0]
    finally:
        db.close()


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
        "median_triangulation_angle_deg": median(angles) if angles else None,
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
    if arguments.max_image_size:
        extraction.max_image_size = arguments.max_image_size
    with CountRows(events, database, "keypoints", "features", len(names)):
        for batch, mask_folder in batches:
            if not batch:
                continue
            reader = pycolmap.ImageReaderOptions()
            reader.camera_model = model_name
            if mask_folder:
                reader.mask_path = mask_folder
            pycolmap.extract_features(database, arguments.photos, image_names=batch, reader_options=reader,
                                      extraction_options=extraction, device=pycolmap.Device.cpu)
    features = count_features(database)
    poor = [n for n in names if features.get(n, 0) < MIN_FEATURES]
    if len(names) - len(poor) < 2:
        raise Failure("too_few_features", "Almost nothing to hold on to in the photos: %d of %d have fewer than %d "
                      "features." % (len(poor), len(names), MIN_FEATURES),
                      "Use sharp, well-lit photos of a textured subject; put a printed pattern or newspaper under a "
                      "plain one.")

    matching = pycolmap.FeatureMatchingOptions()
    matching.use_gpu = False
    matching.num_threads = threads
    verification = pycolmap.TwoViewGeometryOptions()
    verification.ransac.random_seed = seed
    n = len(names)
    exhaustive = arguments.matcher == "exhaustive" or (arguments.matcher == "auto" and n <= EXHAUSTIVE_UP_TO)
    if exhaustive:
        total, match, pairing = n * (n - 1) // 2, pycolmap.match_exhaustive, pycolmap.ExhaustivePairingOptions()
    else:
        match, pairing = pycolmap.match_sequential, pycolmap.SequentialPairingOptions()
        pairing.num_threads = threads
        # What the pairing will visit: the next `overlap` photos and those at distances 2^k up to 2^(overlap-1).
        steps = set(range(1, pairing.overlap + 1))
        if pairing.quadratic_overlap:
            steps |= {1 << k for k in range(pairing.overlap)}
        total = sum(max(0, n - s) for s in steps)
    with CountRows(events, database, "two_view_geometries", "matching", total):
        match(database, matching_options=matching, pairing_options=pairing, verification_options=verification,
              device=pycolmap.Device.cpu)
    pairs = count_pairs(database)
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
    models.sort(key=lambda m: (-m.num_reg_images(), -m.num_points3D()))
    models = [m for m in models if m.num_reg_images() >= 2 and m.num_points3D() > 0]
    if not models:
        raise Failure("no_model", "%d photo pairs match, but no camera positions could be worked out from them."
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
    times = os.times()
    events.emit(event="result", models=described, photos=n + len(failed), failed=sorted(failed + lost),
                focal_prior_px=main["focal_prior_px"], focal_prior_source=main["focal_prior_source"],
                focal_px=main["focal_px"], matcher="exhaustive" if exhaustive else "sequential",
                verified_pairs=pairs, features=sum(features.values()), pycolmap=pycolmap.__version__, seed=seed,
                seconds=round(time.monotonic() - started, 2), cpu_seconds=round(times.user + times.system, 2))


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
