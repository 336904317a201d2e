"""One run of one setting: its inputs made ready, its command measured, its result scored.

Words of a declaration may hold {capture}, {out}, {seed}, {threads}, {gaussians} (a model that
another stage made first) and {reference} (a capture whose photos are this stage's own pictures
at its most exact setting).
"""

import json
import shutil
from dataclasses import dataclass
from pathlib import Path

from . import captures, declaration, runner


@dataclass
class Run:
    """A setting with a seed on a capture."""

    setting: declaration.Setting
    seed: int
    data: str
    key: str = ""
    places: dict = None


class Lab:
    def __init__(self, bin_dir, work, declarations, data, threads, long_side, plan):
        self.bin_dir, self.work, self.threads = bin_dir, work, threads
        self.declarations, self.data, self.plan = declarations, data, plan
        self.captures = captures.Captures(work, bin_dir, long_side)
        self.cache = runner.Cache(work / "runs")
        self.programs = {}

    def program_hash(self, name):
        if name not in self.programs:
            self.programs[name] = captures.file_hash(self.bin_dir / name)[:24]
        return self.programs[name]

    def prepare(self, run):
        """Fills in the key and the places of a run; makes what it needs, once."""
        stage = self.declarations[run.setting.stage]
        capture, capture_hash = self.captures.get(run.data, self.data[run.data],
                                                  run.setting.variant)
        places = {"capture": capture, "seed": run.seed, "threads": self.threads}
        inputs = [capture_hash]
        if "gaussians" in stage:
            folder, key = self.product(run, stage["gaussians"]["stage"],
                                       stage["gaussians"]["flags"], places, inputs)
            places["gaussians"] = folder / stage["gaussians"]["file"]
            inputs.append(key)
        if "reference" in stage:
            folder, key = self.product(run, stage["stage"], stage["reference"]["flags"], places,
                                       inputs)
            target = folder / "reference.json"
            if not target.exists():
                captures.capture_with_images(capture, folder / stage["reference"]["images"],
                                             target, stage["reference"]["split"])
            places["reference"] = target
            inputs.append(key)
        run.places = places
        run.key = self.key(stage, run.setting.flags, run.seed, inputs)

    def key(self, stage, flags, seed, inputs):
        programs = [stage["stage"]] + [command[0] for command in stage.get("score", [])]
        hashes = [self.program_hash(name) for name in programs]
        return captures.text_hash(*hashes, repr(stage["command"]), repr(stage.get("score")),
                                  *flags, "seed", seed, "threads", self.threads, *inputs)

    def product(self, run, stage_name, flags, places, inputs):
        """Folder and key of a result that runs need as input; kept between sweeps."""
        stage = self.declarations[stage_name]
        if self.plan == "smoke":
            flags = declaration.merge(flags, stage.get("smoke", []))
        key = self.key(stage, flags, 0, inputs)
        folder = self.work / "products" / key
        if not folder.exists():
            partial = folder.with_name(key + ".partial")
            shutil.rmtree(partial, ignore_errors=True)
            partial.mkdir(parents=True)
            self.call(stage, flags, {**places, "seed": 0, "out": partial}, partial)
            partial.rename(folder)
        return folder, key

    def call(self, stage, flags, places, log_folder, timeout=None):
        words = [word.format(**places) for word in stage["command"]]
        return runner.measured([self.bin_dir / stage["stage"], *words, *flags], timeout,
                               log_folder / "stderr.txt")

    def execute(self, run):
        """Runs, scores, and stores one run. A failure is a row too, but is not stored, so that
        the next sweep tries again."""
        stage, setting = self.declarations[run.setting.stage], run.setting
        out = self.work / "scratch" / run.key
        shutil.rmtree(out, ignore_errors=True)
        out.mkdir(parents=True)
        places = {**run.places, "out": out}
        row = {"key": run.key, "setting": setting.id, "data": run.data, "seed": run.seed,
               "flags": setting.flags}
        try:
            timeout = max(600.0, 30.0 * setting.seconds)
            cost = self.call(stage, setting.flags, places, out, timeout)
            for command in stage.get("score", []):
                words = [word.format(**places) for word in command[1:]]
                runner.measured([self.bin_dir / command[0], *words], timeout, out / "stderr.txt")
            row["metrics"] = {"cpu_seconds": cost["cpu_seconds"],
                              "wall_seconds": cost["wall_seconds"],
                              **gather(stage["metrics"], places)}
            self.cache.put(run.key, row)
        except (runner.Failed, OSError, ValueError, KeyError) as error:
            row["failed"] = f"{type(error).__name__}: {error}".replace(str(self.work), "WORK")
        finally:
            shutil.rmtree(out, ignore_errors=True)
        return row


def gather(metrics, places):
    """Values of the declared metrics: a key of a JSON file, the size of a file, or a difference."""
    values, documents = {}, {}
    for name, how in metrics.items():
        if "size" in how:
            value = Path(how["size"].format(**places)).stat().st_size
        elif "file" in how:
            path = how["file"].format(**places)
            if path not in documents:
                with open(path) as file:
                    documents[path] = json.load(file)
            value = runner.look_up(documents[path], how["key"])
        elif "minus" in how:
            a, b = (values.get(n) for n in how["minus"])
            value = None if a is None or b is None else a - b
        else:
            continue  # cpu_seconds and wall_seconds are measured, and declared for their titles
        values[name] = None if value is None else value * how.get("scale", 1)
    return values
