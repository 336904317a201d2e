"""Captures that a sweep runs on: imported once, hashed by content, with variants.

all   every 8th photo by name held out
few   the same held-out photos, 8 training photos spread evenly over the rest; start points only
      where two of those 8 see them
"""

import hashlib
import json
import os
import shutil
import subprocess

TEST_EVERY, FEW_VIEWS = 8, 8


def file_hash(path):
    digest = hashlib.sha256()
    with open(path, "rb") as file:
        for block in iter(lambda: file.read(1 << 20), b""):
            digest.update(block)
    return digest.hexdigest()


def text_hash(*parts):
    return hashlib.sha256("\0".join(map(str, parts)).encode()).hexdigest()[:24]


def folder_hash(folder):
    """Names and bytes of everything in a folder, but for run records, which hold times."""
    digest = hashlib.sha256()
    for path in sorted(p for p in folder.rglob("*") if p.is_file()):
        if not path.name.endswith(".run.json"):
            digest.update(f"{path.relative_to(folder)}\0{file_hash(path)}\n".encode())
    return digest.hexdigest()[:24]


class Captures:
    """Imports on first use; later sweeps find them in the work folder."""

    def __init__(self, work, bin_dir, long_side):
        self.folder, self.bin_dir, self.long_side = work / "captures", bin_dir, long_side
        self.hashes = {}

    def get(self, name, source, variant):
        """(capture.json, hash of its content)"""
        stamp = source.stat().st_mtime_ns if source.exists() else 0
        key = text_hash(source.resolve(), stamp, variant, self.long_side,
                        file_hash(self.bin_dir / "import-colmap"))
        folder = self.folder / f"{name}-{variant}-{key}"
        if not (folder / "capture.json").exists():
            self.make(name, source, variant, folder)
        if folder not in self.hashes:
            self.hashes[folder] = folder_hash(folder)
        return folder / "capture.json", self.hashes[folder]

    def make(self, name, source, variant, folder):
        flags = ["--test-every", str(TEST_EVERY)]
        if variant == "few":
            document = json.loads(self.get(name, source, "all")[0].read_text())
            lists = {"train": [], "test": []}
            for view in document["views"]:
                lists[view["split"]].append(view["name"])
            lists["train"] = evenly(lists["train"], FEW_VIEWS)
            flags = ["--points-from-train"]
            for split, names in lists.items():
                path = folder.with_name(f"{folder.name}-{split}.txt")
                path.write_text("\n".join(names) + "\n")
                flags += [f"--{split}-list", str(path)]
        elif variant != "all":
            raise ValueError(f"no such variant of a capture: {variant}")
        self.folder.mkdir(parents=True, exist_ok=True)
        # Import writes beside, so that an interrupted one is not taken for a capture.
        partial = folder.with_name(folder.name + ".partial")
        shutil.rmtree(partial, ignore_errors=True)
        command = [self.bin_dir / "import-colmap", source, "-o", partial, "--max-resolution",
                   self.long_side, *flags, "--quiet", "--overwrite"]
        subprocess.run([str(a) for a in command], check=True)
        os.replace(partial, folder)


def evenly(names, count):
    """`count` of the names, ends included."""
    if len(names) <= count:
        return names
    return [names[round(i * (len(names) - 1) / (count - 1))] for i in range(count)]


def capture_with_images(capture, images, target, split="test"):
    """A copy of a capture whose photos of a split (or all) are the pictures of a folder, all of them
    test views: scores against it are differences between two renders."""
    document = json.loads(capture.read_text())
    document["points"] = None
    document["views"] = [v for v in document["views"] if split in ("all", v["split"])]
    for view in document["views"]:
        stem = view["name"].rsplit(".", 1)[0].replace("/", "__")
        picture = images / f"{stem}.png"
        if not picture.exists():
            picture = images / f"{view['name'].replace('/', '__')}.png"
        view["image"] = os.path.relpath(picture, target.parent)
        view["mask"], view["split"] = None, "test"
    target.write_text(json.dumps(document))
    return target
