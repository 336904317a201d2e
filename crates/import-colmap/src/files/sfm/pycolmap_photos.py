"""Photos, the cameras that they share and their masks, as COLMAP's database takes them. Only pycolmap decodes photos here: see
pycolmap_driver.py."""

import math
import os
import shutil
import statistics
import sys

from pycolmap_events import Failure

PHOTO_SUFFIXES = (".jpg", ".jpeg", ".png", ".tif", ".tiff", ".bmp")
FOCAL_GUESS = 1.2      # focal length / long side when nothing is known; COLMAP's own default factor


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

class Group:
    """Photos that share one camera."""

    def __init__(self, photos, arguments):
        self.photos = photos
        self.width, self.height = photos[0].width, photos[0].height
        known = [p.exif_focal for p in photos if p.exif_focal]
        if arguments.focal_px:
            self.prior, self.source = arguments.focal_px, "flag"
        elif arguments.focal_from_exif and known:
            self.prior, self.source = statistics.median(known), "exif"
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
