"""What the scripts for pycolmap say on stdout, and how far COLMAP's database has got; pycolmap_driver.py describes the lines."""

import json
import os
import shutil
import threading
from contextlib import closing

INTERVAL_S = 0.5  # between two reports of progress


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


class Watch:
    """Reports progress while a COLMAP call blocks, by counting what is in its databases through connections of its own:
    the calls themselves tell nothing. The databases are in WAL mode, so this reader never holds up a writer.

    The connections must be pycolmap's. Python's sqlite3 is a second copy of SQLite in the same process, and POSIX locks
    do not hold between the two: when one closes the database, it takes itself for the last user and cuts off the shared
    memory that the other has mapped, which ends the process with SIGBUS (https://sqlite.org/howtocorrupt.html, 2.2.1)."""

    def __init__(self, pycolmap, events, databases, count, phase, total):
        self.pycolmap, self.events, self.databases, self.count = pycolmap, events, databases, count
        self.phase, self.total = phase, total
        self.stop = threading.Event()
        self.thread = threading.Thread(target=self.watch, daemon=True)

    def watch(self):
        while not self.stop.wait(INTERVAL_S):
            try:
                done = sum(self.count(connection) for connection in self.connections)
            except Exception:
                continue  # only a progress report is lost
            self.events.progress(self.phase, min(done, self.total), self.total)

    def __enter__(self):
        self.connections = [self.pycolmap.Database.open(path) for path in self.databases]
        self.events.progress(self.phase, 0, self.total)
        self.thread.start()
        return self

    def __exit__(self, kind, value, trace):
        self.stop.set()
        self.thread.join()
        for connection in self.connections:
            connection.close()
        if kind is None:
            self.events.progress(self.phase, self.total, self.total)


def photos_done(database):
    """Photos whose features have been looked for."""
    return sum(database.exists_keypoints(image.image_id) for image in database.read_all_images())


def pairs_done(database):
    """Pairs of photos that have been matched and verified, with whatever outcome."""
    return database.num_verified_image_pairs()


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


def count_features(pycolmap, path):
    """Features of each photo, by name."""
    with closing(pycolmap.Database.open(path)) as database:
        images = database.read_all_images()
        return {image.name: database.num_keypoints_for_image(image.image_id) for image in images}


def count_pairs(pycolmap, path):
    """Pairs of photos that match."""
    with closing(pycolmap.Database.open(path)) as database:
        _, inliers = database.read_two_view_geometry_num_inliers()
        return sum(n > 0 for n in inliers)
