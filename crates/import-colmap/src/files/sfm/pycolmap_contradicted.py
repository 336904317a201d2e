"""Photos that a model places against what their matches say."""

LEAST_AGREEING = 0.3  # right poses have 0.35 and more, wrong ones up to 0.2, and their neighbors' fall with theirs


def matches_of(numpy, model, database):
    """Of every two photos with poses: how many matches they share, and how many of them are one point of the model."""
    posed = {i: image for i, image in model.images.items() if image.has_pose}
    # One past the last point stands for keypoints that belong to none.
    none = max(model.points3D, default=0) + 1
    point_of = {}
    for i, image in posed.items():
        points = [p.point3D_id if p.has_point3D() else none for p in image.points2D]
        point_of[i] = numpy.array(points, dtype=numpy.int64)
    counts = {}
    for i in sorted(posed):
        for k in sorted(k for k in posed if k > i):
            if not database.exists_two_view_geometry(i, k):
                continue
            inliers = numpy.asarray(database.read_two_view_geometry(i, k).inlier_matches, dtype=numpy.int64)
            if len(inliers):
                a, b = point_of[i][inliers[:, 0]], point_of[k][inliers[:, 1]]
                counts[i, k] = (len(inliers), int(((a == b) & (a != none)).sum()))
    return counts


def contradicted(counts, least=LEAST_AGREEING):
    """Photos that a model is better without, worst first: those of whose matches less than `least` agree with it. A wrong
    photo contradicts right ones as well, so they go one at a time."""
    left, gone = {i for pair in counts for i in pair}, []
    while len(left) > 2:
        sums = {i: [0, 0] for i in left}
        for (i, k), (matches, agreeing) in counts.items():
            if i in left and k in left:
                for photo in (i, k):
                    sums[photo][0] += matches
                    sums[photo][1] += agreeing
        share, worst = min((agreeing / max(matches, 1), i) for i, (matches, agreeing) in sums.items())
        if share >= least:
            break
        left.remove(worst)
        gone.append(worst)
    return gone


def leave_out_contradicted(pycolmap, numpy, model, database_path, adjustment):
    """Takes the poses of contradicted photos from a model, and adjusts the rest without them. How many there were."""
    database = pycolmap.Database.open(database_path)
    try:
        gone = contradicted(matches_of(numpy, model, database))
    finally:
        database.close()
    if gone:
        for i in gone:
            model.deregister_frame(model.images[i].frame_id)
        # Sums of several threads come in any order.
        adjustment.ceres.solver_options.num_threads = 1
        pycolmap.bundle_adjustment(model, adjustment)
        model.update_point_3d_errors()
    return len(gone)
