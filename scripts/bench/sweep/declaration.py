"""Reads dials/<stage>.json: which flags a stage has, which values to try, what they trade.

A setting is a list of `--flag=value` words. Later words replace earlier ones with the same flag,
so a dial changes the base by saying only what differs.
"""

import itertools
import json
import re
import subprocess
from dataclasses import dataclass, field

PLANS = ("smoke", "quick", "full")
STAGE_KEYS = {"stage", "what", "command", "score", "metrics", "quality", "cost", "base", "smoke",
              "seconds", "presets", "grids", "dials", "repeats", "reference", "gaussians"}
DIAL_KEYS = {"name", "flag", "default", "values", "buys", "costs", "when", "plan", "capture",
             "base", "quality"}
VALUE_KEYS = {"value", "flags", "label", "factor", "plan"}
GRID_KEYS = {"name", "axes", "plan", "base"}


class DeclarationError(Exception):
    """A dial file that cannot be used, or a flag that a program does not have."""


@dataclass
class Setting:
    """One point of the sweep; each seed of it is one run."""

    stage: str
    kind: str  # base, preset, dial, grid
    name: str  # of the dial or the grid; the base's and presets' own name
    label: str  # the value as people say it
    flags: list
    variant: str = "all"  # which capture: all training views, or few
    seconds: float = 10.0  # estimate of one run, CPU seconds
    quality: str = ""  # metric that the dial moves
    seeds: list = field(default_factory=lambda: [0])

    @property
    def id(self):
        return f"{self.stage}/{self.name}={self.label}@{self.variant}"


def flag_of(word):
    return word.split("=", 1)[0]


def merge(*lists):
    """Joins lists of flags; the last word about a flag wins, in the place of the first."""
    merged = {}
    for word in itertools.chain(*lists):
        merged[flag_of(word)] = word
    return list(merged.values())


def load(folder):
    """All declarations of a folder, by stage, in the order of names."""
    found, more = {}, []
    for path in sorted(folder.glob("*.json")):
        try:
            declaration = json.loads(path.read_text())
        except json.JSONDecodeError as error:
            raise DeclarationError(f"{path.name} is not JSON: {error}") from None
        if "extends" in declaration:
            more.append((path.name, declaration))
        else:
            check(declaration, path.name)
            found[declaration["stage"]] = declaration
    for file, extension in more:
        found[extension["extends"]] = extended(found.get(extension["extends"]), extension, file)
    if not found:
        raise DeclarationError(f"no dials/*.json in {folder}")
    # Models are made before they are drawn.
    return dict(sorted(found.items(), key=lambda item: "gaussians" in item[1]))


def extended(declaration, extension, file):
    """A stage with the dials of another file, so that each owner of dials has a file."""
    if declaration is None:
        raise DeclarationError(f"{file} extends {extension['extends']}, which no file declares")
    unknown = sorted(extension.keys() - {"extends", "what", "dials", "grids", "reference"})
    if unknown:
        raise DeclarationError(f"{file}: unknown {unknown}")
    joined = {**declaration, "dials": declaration["dials"] + extension.get("dials", []),
              "grids": declaration.get("grids", []) + extension.get("grids", [])}
    if "reference" in extension:
        joined["reference"] = {**declaration.get("reference", {}), **extension["reference"]}
    check(joined, file)
    return joined


def check(declaration, file):
    """Refuses what would be dropped in silence: unknown keys, dials without a rule of thumb."""
    def demand(what, where, needed, known):
        missing, unknown = sorted(needed - what.keys()), sorted(what.keys() - known)
        if missing or unknown:
            raise DeclarationError(f"{file}: {where}: missing {missing}, unknown {unknown}")

    demand(declaration, "the stage", {"stage", "command", "metrics", "quality", "base", "dials"},
           STAGE_KEYS)
    names = [d.get("name") for d in declaration["dials"]]
    if len(set(names)) != len(names):
        raise DeclarationError(f"{file}: two dials share a name: {sorted(map(str, names))}")
    for dial in declaration["dials"]:
        where = f"dial {dial.get('name')}"
        demand(dial, where, {"name", "default", "values", "buys", "costs", "when"}, DIAL_KEYS)
        for value in dial["values"]:
            if isinstance(value, dict):
                demand(value, where, set(), VALUE_KEYS)
            if "flag" not in dial and not (isinstance(value, dict) and value.get("flags")):
                raise DeclarationError(f"{file}: {where}: a value has no flags and the dial no flag")
    for grid in declaration.get("grids", []):
        demand(grid, f"grid {grid.get('name')}", {"name", "axes"}, GRID_KEYS)
    quality = declaration["quality"]
    for name in [quality] + [d["quality"] for d in declaration["dials"] if "quality" in d]:
        if name not in declaration["metrics"]:
            raise DeclarationError(f"{file}: quality {name} is not among the metrics")


def in_plan(entry, plan):
    """Entries without a plan belong to all; `"plan": "full"` keeps one out of quick."""
    wanted = entry.get("plan", "quick") if isinstance(entry, dict) else "quick"
    # Smoke tries everything, on data so small that it costs nothing.
    return plan in ("smoke", "full") or wanted == "quick"


def values_of(dial):
    """(label, flags, factor, entry) of each value of a dial."""
    for entry in dial["values"]:
        if isinstance(entry, dict):
            value = entry.get("value")
            flags = entry.get("flags") or [f"{dial['flag']}={value}"]
            yield str(entry.get("label", value)), flags, entry.get("factor", 1.0), entry
        else:
            yield str(entry), [f"{dial['flag']}={entry}"], 1.0, entry


def settings(declaration, plan, wanted=lambda stage, name: True):
    """All settings of a stage under a plan: base, presets, grids, then dials one at a time."""
    stage, seconds = declaration["stage"], declaration.get("seconds", 10.0)
    small = declaration.get("smoke", []) if plan == "smoke" else []
    # In a smoke test the few steps win even over the dials that ask for many.
    base = merge(declaration["base"], small)
    found = []

    def add(kind, name, label, flags, factor=1.0, variant="all", quality=None):
        found.append(Setting(stage, kind, name, label, flags, variant, seconds * factor,
                             quality or declaration["quality"]))

    dials = [d for d in declaration["dials"] if in_plan(d, plan) and wanted(stage, d["name"])]
    # A dial with a base or a capture of its own is compared with that base there.
    bases = {("all", tuple(base)): "base"} if wanted(stage, "base") or dials else {}
    for dial in dials:
        own = merge(base, dial.get("base", []))
        bases.setdefault((dial.get("capture", "all"), tuple(own)),
                         "base" if own == base else f"base of {dial['name']}")
    presets = {tuple(merge(p["flags"], small)): p for p in declaration.get("presets", [])}
    for (variant, flags), name in bases.items():
        # A preset may be the base; it is one setting, not two.
        same = presets.pop(flags, None) if variant == "all" else None
        add("preset" if same else "base", name, same["label"] if same else "base", list(flags),
            variant=variant)
    for flags, preset in presets.items():
        if wanted(stage, "presets"):
            add("preset", "presets", preset["label"], list(flags), preset.get("factor", 1.0))
    for grid in declaration.get("grids", []):
        if in_plan(grid, plan) and wanted(stage, grid["name"]):
            for label, flags, factor in corners(grid):
                add("grid", grid["name"], label, merge(base, grid.get("base", []), flags, small),
                    factor)
    for dial in dials:
        own = merge(base, dial.get("base", []))
        for label, flags, factor, entry in values_of(dial):
            if in_plan(entry, plan):
                add("dial", dial["name"], label, merge(own, flags, small), factor,
                    dial.get("capture", "all"), dial.get("quality"))
    return found


def corners(grid):
    """Every combination of the axes of a grid: (label, flags, factor)."""
    axes = []
    for flag, values in grid["axes"].items():
        dial = {"flag": flag, "values": values}
        axes.append([(label, flags, factor) for label, flags, factor, _ in values_of(dial)])
    for point in itertools.product(*axes):
        factor = 1.0
        for _, _, f in point:
            factor *= f
        yield ", ".join(p[0] for p in point), merge(*(p[1] for p in point)), factor


def base_of(setting, all_settings):
    """The base that a setting is compared with: on the same capture, its dial's own if it has one."""
    bases = [s for s in all_settings if is_base(s) and (s.stage, s.variant) ==
             (setting.stage, setting.variant)]
    own = next((s for s in bases if s.name == f"base of {setting.name}"), None)
    return own or next(iter(bases), None)


def is_base(setting):
    return setting.name == "base" or setting.name.startswith("base of ")


def known_flags(program):
    """Flags that a program's --help lists, aliases included."""
    try:
        done = subprocess.run([str(program), "--help"], capture_output=True, text=True, check=True)
    except (OSError, subprocess.CalledProcessError) as error:
        raise DeclarationError(f"cannot ask {program} for its flags: {error}\n"
                               "help: build first (make), or name the folder with --bin") from None
    flags = set()
    for line in done.stdout.splitlines():
        defined = re.match(r"\s*(?:-\w, )?(--[a-z0-9][a-z0-9-]*)", line)
        if defined:
            flags.add(defined[1])
        elif re.search(r"\[alias(?:es)?: ", line):
            flags.update(re.findall(r"--[a-z0-9][a-z0-9-]*", line))
    return flags


def unknown_flags(wanted_settings, known):
    """(dial, flag) for each flag that its program does not know."""
    return sorted({(f"{s.stage}/{s.name}", flag_of(word)) for s in wanted_settings
                   for word in s.flags if flag_of(word) not in known[s.stage]})
