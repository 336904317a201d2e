"""Runs programs and measures them; finished runs are kept, so that a sweep can go on later.

CPU seconds and wall time are the kernel's (wait4); peak memory is what the program itself read
(VmHWM in its run record), because the kernel's figure includes the parent's before exec.
"""

import json
import os
import signal
import subprocess
import threading
import time


class Failed(Exception):
    """A program that did not end well; the text is for people."""


def measured(command, timeout=None, log=None, allowed=(0,)):
    """Runs a command to its end: dict of cpu_seconds, wall_seconds, peak_rss_bytes, exit_code."""
    command = [str(word) for word in command]
    start = time.monotonic()
    with open(log or os.devnull, "w+", errors="replace") as errors:
        child = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=errors)
        killer = threading.Timer(timeout, os.kill, (child.pid, signal.SIGKILL)) if timeout else None
        if killer:
            killer.start()
        try:
            _, status, usage = os.wait4(child.pid, 0)
        finally:
            if killer:
                killer.cancel()
        child.returncode = os.waitstatus_to_exitcode(status)
        if child.returncode not in allowed:
            errors.seek(0)
            tail = errors.read()[-600:].strip() if log else ""
            raise Failed(f"exit code {child.returncode}: {' '.join(command)}\n{tail}")
    return {"cpu_seconds": usage.ru_utime + usage.ru_stime,
            "wall_seconds": time.monotonic() - start,
            "peak_rss_bytes": usage.ru_maxrss * 1024,
            "exit_code": child.returncode}


def look_up(document, key):
    """`a.b.c` in nested objects; None when a part is missing."""
    for part in key.split("."):
        document = document.get(part) if isinstance(document, dict) else None
    return document


class Cache:
    """One small JSON per finished run, named by a hash of what determines it."""

    def __init__(self, folder):
        self.folder = folder
        folder.mkdir(parents=True, exist_ok=True)

    def get(self, key):
        try:
            return json.loads((self.folder / f"{key}.json").read_text())
        except (OSError, json.JSONDecodeError):
            return None

    def put(self, key, row):
        partial = self.folder / f"{key}.json.partial{threading.get_ident()}"
        partial.write_text(json.dumps(row, indent=1) + "\n")
        os.replace(partial, self.folder / f"{key}.json")


class Budget:
    """Minutes after which nothing new starts; None never ends."""

    def __init__(self, minutes):
        self.seconds = None if minutes is None else 60.0 * minutes
        self.start = time.monotonic()

    def allows(self, wall_seconds):
        """Whether a run that should take this long may start."""
        if self.seconds is None:
            return True
        return time.monotonic() - self.start + wall_seconds <= self.seconds


class Scale:
    """How much slower this machine is than the estimates: learned from finished runs."""

    def __init__(self):
        self.ratios = {}
        self.lock = threading.Lock()

    def learn(self, stage, wall_seconds, estimate):
        with self.lock:
            self.ratios.setdefault(stage, []).append(wall_seconds / max(estimate, 1e-3))

    def wall(self, stage, estimate):
        with self.lock:
            known = sorted(self.ratios.get(stage, []))
        return estimate * (known[len(known) // 2] if known else 1.0)


def side_by_side(tasks, work, jobs, may_start):
    """Calls `work(task)` for tasks in order, `jobs` at a time. Tasks that `may_start` refuses are
    returned; a refused one does not keep a shorter one from starting."""
    queue, refused, errors = list(tasks), [], []
    lock, stop = threading.Lock(), threading.Event()

    def loop():
        while not stop.is_set():
            with lock:
                if not queue:
                    return
                task = queue.pop(0)
                if not may_start(task):
                    refused.append(task)
                    continue
            try:
                work(task)
            except BaseException as error:  # a bug here must end the sweep, not one thread
                errors.append(error)
                stop.set()

    threads = [threading.Thread(target=loop, daemon=True) for _ in range(jobs)]
    for thread in threads:
        thread.start()
    try:
        for thread in threads:
            while thread.is_alive():
                thread.join(0.2)
    except KeyboardInterrupt:
        stop.set()
        raise
    if errors:
        raise errors[0]
    return refused
