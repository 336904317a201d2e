"""Numbers of a record between markers of a Markdown page, so that the page cannot drift.

    <!-- tradeoff:presets benchmarks/2026-01-01-machine-tradeoff.json -->
    (generated)
    <!-- /tradeoff -->

Blocks: plot, presets, front, `dials STAGE`, source; cost of a record of curves. The path is relative to the page.
"""

import json
import re

from . import curves, plot, record as records

BLOCK = re.compile(r"(<!-- tradeoff:(?P<what>[^\n]*?) (?P<file>\S+\.json) -->\n)(?P<body>.*?)"
                   r"(<!-- /tradeoff -->)", re.S)


class PageError(Exception):
    """A page or record that cannot be brought together."""


def update(page, newest=()):
    """The page's text with all blocks made anew; `newest` replaces the records of its kind, which
    the end of a file name tells (-tradeoff, -cost)."""
    text = page.read_text()
    if not BLOCK.search(text):
        raise PageError(f"{page.name} has no block <!-- tradeoff:... -->")

    def fill(match):
        file, what = match["file"], match["what"].split()
        kind = file.rsplit("-", 1)[-1]
        file = next((new for new in newest if new.endswith("-" + kind)), file)
        path = page.parent / file
        if not path.exists():
            raise PageError(f"{page.name} names {file}, which is not there")
        record = json.loads(path.read_text())
        makers = {"plot": block_plot, "presets": block_presets, "front": block_front,
                  "dials": block_dials, "source": block_source, "cost": block_cost}
        if what[0] not in makers:
            raise PageError(f"{page.name}: no such block: {what[0]}; known: {sorted(makers)}")
        body = makers[what[0]](record, file, *what[1:])
        return f"<!-- tradeoff:{match['what']} {file} -->\n{body}\n{match[5]}"

    return BLOCK.sub(fill, text)


def stale(page):
    """What differs between the page, the records it names, and their own pages."""
    problems = []
    if update(page) != page.read_text():
        problems.append(f"{page.name} differs from the record it names")
    for file in sorted({m["file"] for m in BLOCK.finditer(page.read_text())}):
        path = page.parent / file
        record = json.loads(path.read_text())
        for suffix, text in pages(record, path.stem).items():
            beside = path.with_suffix(suffix)
            if not beside.exists() or beside.read_text() != text:
                problems.append(f"{beside.name} differs from {path.name}")
    return problems


def pages(record, stem):
    """The files beside a record that are made from it alone."""
    if record["format"] == "motes/cost":
        return {".md": curves.markdown(record, stem), ".svg": curves.svg(record)}
    return {".md": records.markdown(record, stem),
            ".svg": plot.tradeoff(record, records.panels(record))}


def block_plot(record, file):
    return f"![Quality against cost, {record['date']}]({file[:-5]}.svg)\n"


def block_source(record, file):
    runs = sum(len(r["seeds"]) for r in record["rows"])
    text = (f"From [{file.rsplit('/', 1)[-1]}]({file}): {runs} runs of `{record['command']}` on "
            f"{record['date']}, {record['machine']}, commit {record['commit']}; all numbers with "
            f"their commands: [{file.rsplit('/', 1)[-1][:-5]}.md]({file[:-5]}.md).")
    if record["missing"] or record["failed"]:
        text += (f" Incomplete: {len(record['missing'])} runs were not started, "
                 f"{len(record['failed'])} failed.")
    return text


def block_cost(record, file):
    name = file.rsplit("/", 1)[-1]
    lines = [f"- {sentence}" for sentence in curves.sentences(record)]
    return "\n".join([f"From [{name[:-5]}.md]({file[:-5]}.md), {record['date']}, {record['machine']}, "
                      f"`{record['command']}`:", "", *lines, "", f"![Cost curves]({file[:-5]}.svg)", ""])


def first_stage(record):
    return "train-splat" if "train-splat" in record["stages"] else next(iter(record["stages"]))


def block_presets(record, _file):
    stage_name = first_stage(record)
    stage, lines = record["stages"][stage_name], []
    for data in record["captures"]:
        rows = [r for r in record["rows"] if r["kind"] == "preset" and r["stage"] == stage_name
                and r["data"] == data and r["capture"] == "all"]
        lines += [f"On {data}:", ""] + records.table(stage, rows, "preset") + [""]
        on = [r["label"] for r in rows if r["front"]]
        off = [r["label"] for r in rows if not r["front"]]
        lines += [f"On the front: {', '.join(on) or 'none'}."
                  + (f" Beaten by another setting: {', '.join(map(beaten(record, data), off))}."
                     if off else ""), ""]
    return "\n".join(lines).rstrip()


def beaten(record, data):
    """Names a preset together with the best setting that costs no more."""
    stage_name = first_stage(record)
    stage = record["stages"][stage_name]
    cost, quality = stage["cost"], stage["quality"]

    def say(label):
        rows = [r for r in record["rows"] if (r["stage"], r["data"], r["capture"]) ==
                (stage_name, data, "all") and cost in r["metrics"] and quality in r["metrics"]]
        own = next(r for r in rows if r["kind"] == "preset" and r["label"] == label)
        limit = own["metrics"][cost]["mean"]
        best = max((r for r in rows if r["metrics"][cost]["mean"] <= limit),
                   key=lambda r: r["metrics"][quality]["mean"])
        gain = best["metrics"][quality]["mean"] - own["metrics"][quality]["mean"]
        return f"{label} (by {records.name_of(best)}, {gain:+.2f} dB)"
    return say


def block_front(record, _file):
    stage_name, lines = first_stage(record), []
    stage = record["stages"][stage_name]
    for data in record["captures"]:
        rows = [r for r in record["rows"] if r["front"] and r["stage"] == stage_name
                and r["data"] == data]
        rows.sort(key=lambda r: r["metrics"][stage["cost"]]["mean"])
        lines += [f"On {data}:", ""] + records.table(stage, rows, "setting") + [""]
    return "\n".join(lines).rstrip()


def block_dials(record, _file, stage_name):
    stage = record["stages"].get(stage_name)
    if stage is None:
        raise PageError(f"the record has no stage {stage_name}")
    lines = []
    for data in record["captures"]:
        dials = [(d, [r for r in record["rows"] if (r["stage"], r["name"], r["data"]) ==
                      (stage_name, d["name"], data)]) for d in stage["dials"]]
        dials = [(d, rows) for d, rows in dials if rows]
        if not dials:
            continue
        lines += [f"On {data}, against the base `{base_flags(record, stage_name)}`:", "",
                  "| dial | default | tried: difference, cost | buys | costs | touch it when |",
                  "|---|---|---|---|---|---|"]
        for dial, rows in dials:
            flag = f"`{dial['flag']}`" if dial["flag"] else dial["name"]
            few = ", 8 views" if dial["capture"] == "few" else ""
            tried = "; ".join(effect(row, stage) for row in rows)
            lines.append(f"| {flag}{few} | {dial['default']} | {tried} | {dial['buys']} "
                         f"| {dial['costs']} | {dial['when']} |")
        lines.append("")
    return "\n".join(lines).rstrip() or "No dial of this stage was measured."


def base_flags(record, stage_name):
    base = next((r for r in record["rows"] if r["stage"] == stage_name and r["name"] == "base"),
                None)
    return " ".join([stage_name] + (base["flags"] if base else []))


def effect(row, stage):
    """One value of a dial in a few words; ~ where seeds alone could have made the difference."""
    digits = stage["metrics"][row["quality"]]["digits"]
    if row["quality"] == stage["quality"] == "psnr_exact":
        # Against the exact pictures the value itself says more than its difference.
        change = f"{row['metrics']['psnr_exact']['mean']:.{digits}f} dB"
    elif "difference" in row:
        unsure = row["noise"] is not None and abs(row["difference"]) < row["noise"]
        change = f"{'~' if unsure else ''}{row['difference']:+.{digits}f} dB"
    else:
        change = "not comparable"
    factor = f", ×{row['cost_factor']:.2f}" if "cost_factor" in row else ""
    return f"`{row['label']}` {change}{factor}"
