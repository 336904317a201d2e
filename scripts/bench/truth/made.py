"""The scenes of truth-scene, made when they are asked for."""

import os
import re
import shutil
import subprocess

from sweep import captures, runner


def names(program):
    """The scenes that the program says it has."""
    shown = subprocess.run([program, "-h"], capture_output=True, text=True, check=True).stdout
    found = re.search(r"<SCENE>.*?possible values: ([^\]]*)\]", shown, re.DOTALL)
    if not found:
        raise runner.Failed(f"{program} -h names no scenes")
    return re.split(r",\s*", found[1])


def scenes(wanted, bin_dir, work, threads, say):
    """Pairs of name and folder, kept in the cache by what made them; `all` stands for every scene."""
    if not wanted:
        return
    program = bin_dir / "truth-scene"
    key = captures.text_hash(captures.file_hash(program))
    for name in names(program) if "all" in wanted else wanted:
        folder = work / "truths" / f"{name}-{key}"
        if not (folder / "scene.json").exists():
            say(f"making {name}")
            partial = folder.with_name(folder.name + ".partial")
            shutil.rmtree(partial, ignore_errors=True)
            partial.parent.mkdir(parents=True, exist_ok=True)
            runner.measured([program, name, "-o", partial, "--threads", threads],
                            timeout=7200, log=folder.with_name(f"{name}.txt"))
            os.replace(partial, folder)
        yield name, folder
