#!/usr/bin/env python3
"""Writes the corpus of valid and invalid files beside this script, with nothing but the standard
library, so that no file comes from the writers under test.

DOCUMENT/v1/valid/*      must be read, written and read again without loss
DOCUMENT/v1/invalid/*    must be refused with a message that contains the text of NAME.expect

A case is one call of valid() or invalid() in *_cases.py, or simply a file (and its .expect) put there.
"""

import os
import shutil
import sys

sys.dont_write_bytecode = True

from cases import HERE  # noqa: E402
from capture_cases import captures  # noqa: E402
from document_cases import camera_paths, decompositions, edit_plans, metrics_files, run_records  # noqa: E402
from image_cases import environments, exrs, images, tensor_files  # noqa: E402
from mesh_cases import meshes  # noqa: E402
from ply_cases import gaussians_invalid, gaussians_valid, points, surfaces  # noqa: E402
from splat_cases import compressed, gltf, ksplat, sog, splats, spz  # noqa: E402


def main():
    for name in os.listdir(HERE):
        path = os.path.join(HERE, name)
        if os.path.isdir(path):
            shutil.rmtree(path)
    for part in (gaussians_valid, gaussians_invalid, points, captures, camera_paths, edit_plans,
                 metrics_files, run_records, images, exrs, tensor_files, surfaces, decompositions,
                 environments, splats, compressed, spz, ksplat, sog, gltf, meshes):
        part()


main()
