"""The scripts that import-colmap gives to pycolmap, run with pycolmap itself: make poses-ci."""

import os
import shutil
import sqlite3
import subprocess
import sys
import tempfile
import unittest
from contextlib import closing

HERE = os.path.dirname(os.path.abspath(__file__))
SCRIPTS = os.path.join(HERE, "..", "..", "src", "files", "sfm")
PHOTOS = os.path.join(HERE, "..", "..", "..", "..", "testdata", "lab", "photos")

# The driver with a report of progress every half millisecond, which is where a reader of the database would do harm.
IMPATIENT = "import sys; sys.path.insert(0, %r); import pycolmap_events, pycolmap_driver; " \
            "pycolmap_events.INTERVAL_S = 0.0005; sys.exit(pycolmap_driver.main(sys.argv[1:]))" % SCRIPTS


class Sfm(unittest.TestCase):
    def setUp(self):
        self.folder = tempfile.TemporaryDirectory()
        self.photos = os.path.join(self.folder.name, "photos of a plush")
        os.makedirs(self.photos)
        for name in sorted(os.listdir(PHOTOS))[:8]:
            shutil.copyfile(os.path.join(PHOTOS, name), os.path.join(self.photos, "IMG " + name))

    def tearDown(self):
        self.folder.cleanup()

    def poses(self, threads, *options):
        workspace = os.path.join(self.folder.name, str(threads))
        command = [sys.executable, "-c", IMPATIENT, "--photos", self.photos, "--workspace", workspace,
                   "--threads", str(threads), "--max-features", "512", *options]
        run = subprocess.run(command, stdin=subprocess.DEVNULL, capture_output=True, text=True)
        self.assertEqual(run.returncode, 0, run.stdout[-500:] + run.stderr[-2000:])
        self.assertEqual(sorted(os.listdir(workspace)), ["database.db", "sparse"])
        with closing(sqlite3.connect(os.path.join(workspace, "database.db"))) as database:
            matches = database.execute("SELECT pair_id, data FROM matches ORDER BY pair_id").fetchall()
        model = {}
        for name in sorted(os.listdir(os.path.join(workspace, "sparse", "0"))):
            with open(os.path.join(workspace, "sparse", "0", name), "rb") as f:
                model[name] = f.read()
        return run.stdout, matches, model

    def test_any_number_of_threads_gives_the_same_bytes(self):
        said, matches, model = self.poses(1)
        self.assertIn('"phase": "matching", "done": 1,', said)
        self.assertIn('"photos": 8, "failed": []', said)
        for threads in (2, 3):
            _, same_matches, same_model = self.poses(threads)
            self.assertEqual(matches, same_matches)
            self.assertEqual(model, same_model)

    def test_neighbors_in_name_order(self):
        _, matches, _ = self.poses(2, "--matcher", "sequential")
        pairs = {(pair // (2**31 - 1), pair % (2**31 - 1)) for pair, data in matches if data}
        self.assertLessEqual({b - a for a, b in pairs}, {1, 2, 4})
        self.assertLessEqual({(i, i + 1) for i in range(1, 8)}, pairs)


if __name__ == "__main__":
    unittest.main()
