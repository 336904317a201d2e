"""What the scripts for pycolmap say on stdout, and how far COLMAP's database has got; pycolmap_driver.py describes the lines."""

import json
import os
import shutil
import sqlite3
import threading


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
