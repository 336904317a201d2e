"""Records as SVG: readable on light and dark paper, told apart without color, labeled directly.

Shapes carry the meaning too: line and filled discs are the front, diamonds presets, open rings
the other settings.
"""

import math
from html import escape

from .record import name_of

WIDTH, PANEL, LEFT, RIGHT, TOP, BOTTOM = 860, 430, 66, 24, 46, 52
STYLE = """<style>
text{font:12px system-ui,-apple-system,"Segoe UI",sans-serif;fill:#1b1f24}
.paper{fill:#ffffff}.title{font-size:15px;font-weight:600}.tick{stroke:#dfe3e8;stroke-width:1}
.axis{stroke:#5c656f;stroke-width:1;fill:none}.other{stroke:#7b8591;stroke-width:1.2;fill:none}
.front{stroke:#0b72b0;stroke-width:2.2;fill:none;stroke-linejoin:round}.dot{fill:#0b72b0}
.preset{fill:#d9730d;stroke:#ffffff;stroke-width:1}.presetname{font-weight:700}
.spread{stroke:#d9730d;stroke-width:1.5}.leader{stroke:#7b8591;stroke-width:.8}.small{font-size:11px}
.c0{stroke:#0b72b0}.c1{stroke:#d9730d}.c2{stroke:#1f9d72}.c3{stroke:#b8478a}
.f0{fill:#0b72b0}.f1{fill:#d9730d}.f2{fill:#1f9d72}.f3{fill:#b8478a}
.curve{fill:none;stroke-width:2}.ideal{stroke:#7b8591;stroke-width:1;stroke-dasharray:4 4;fill:none}
@media (prefers-color-scheme:dark){text{fill:#e6e9ed}.paper{fill:#16191d}.tick{stroke:#2c3239}
.axis{stroke:#9aa3ad}.front{stroke:#4fb3ee}.dot{fill:#4fb3ee}.preset{fill:#f0934a;stroke:#16191d}
.spread{stroke:#f0934a}.c0{stroke:#4fb3ee}.c1{stroke:#f0934a}.c2{stroke:#45c797}.c3{stroke:#e07db7}
.f0{fill:#4fb3ee}.f1{fill:#f0934a}.f2{fill:#45c797}.f3{fill:#e07db7}}
</style>"""


class Axis:
    """Values to pixels; logarithmic when the values span more than a factor of 8."""

    def __init__(self, low, high, start, end, log=None):
        self.log = (low > 0.0 and high / low > 8.0) if log is None else log
        if self.log:
            self.low, self.high = math.log10(low) - 0.04, math.log10(high) + 0.06
        else:
            pad = 0.04 * (high - low) or max(abs(high), 1.0) * 0.01
            self.low, self.high = low - pad, high + 1.5 * pad
        self.start, self.end = start, end

    def at(self, value):
        value = math.log10(value) if self.log else value
        return self.start + (self.end - self.start) * (value - self.low) / (self.high - self.low)

    def ticks(self):
        if self.log:
            decades = self.high - self.low
            steps = (1, 2, 5) if decades < 3.5 else (1,)
            found = [m * 10.0 ** e for e in range(math.floor(self.low), math.ceil(self.high) + 1)
                     for m in steps]
            return [v for v in found if self.low <= math.log10(v) <= self.high]
        raw = (self.high - self.low) / 7
        unit = 10.0 ** math.floor(math.log10(raw))
        step = next(s * unit for s in (1, 2, 5, 10) if s * unit >= raw)
        first, last = math.ceil(self.low / step), math.floor(self.high / step)
        return [i * step for i in range(first, last + 1)]


def short(value):
    """A tick in few characters: 200, 2M, 0.05."""
    for size, letter in ((1e9, "G"), (1e6, "M"), (1e4, "k")):
        if abs(value) >= size:
            divisor = 1e3 if letter == "k" else size
            return f"{value / divisor:g}{letter}"
    return f"{value:.6g}"


def frame(x, y, top, title, x_title, y_title, right=WIDTH - RIGHT):
    """Axes, ticks and titles of one panel."""
    bottom = top + PANEL - BOTTOM
    out = [f'<text class="title" x="{LEFT}" y="{top + 22}">{escape(title)}</text>']
    for value in x.ticks():
        at = x.at(value)
        out.append(f'<path class="tick" d="M{at:.1f} {top + TOP}V{bottom}"/>'
                   f'<text x="{at:.1f}" y="{bottom + 17}" text-anchor="middle">{short(value)}</text>')
    for value in y.ticks():
        at = y.at(value)
        out.append(f'<path class="tick" d="M{LEFT} {at:.1f}H{right}"/>'
                   f'<text x="{LEFT - 7}" y="{at + 4:.1f}" text-anchor="end">{short(value)}</text>')
    middle = top + (TOP + PANEL - BOTTOM) / 2
    out.append(f'<path class="axis" d="M{LEFT} {top + TOP}V{bottom}H{right}"/>'
               f'<text x="{(LEFT + right) / 2}" y="{bottom + 38}" text-anchor="middle">'
               f'{escape(x_title)}</text><text x="16" y="{middle}" text-anchor="middle" '
               f'transform="rotate(-90 16 {middle})">{escape(y_title)}</text>')
    return out


class Labels:
    """Puts text beside points where nothing is yet; a thin line leads to a text further away."""

    def __init__(self, left, top, right, bottom):
        self.limits, self.taken = (left, top, right, bottom), []

    def block(self, x, y, r=5.0):
        self.taken.append((x - r, y - r, x + r, y + r))

    def free(self, box):
        left, top, right, bottom = self.limits
        if box[0] < left or box[1] < top or box[2] > right or box[3] > bottom:
            return False
        return all(box[2] < t[0] or t[2] < box[0] or box[3] < t[1] or t[3] < box[1]
                   for t in self.taken)

    def put(self, x, y, text, css):
        wide = (7.6 if "presetname" in css else 6.2) * len(text)
        for away in (9, 20, 34, 50, 70, 95):
            # Above left first: the front runs from bottom left to top right.
            for dx, dy in ((-1, -.7), (0, -1), (1, .7), (0, 1), (1, 0), (-1, 0), (1, -.7), (-1, .7),
                           (1, 1.4), (-1, -1.4), (1, -1.4)):
                cx, cy = x + dx * away, y + dy * away
                left = cx - wide if dx < 0 else cx if dx > 0 else cx - wide / 2
                box = (left, cy - 7, left + wide, cy + 7)
                if self.free(box):
                    self.taken.append(box)
                    near = min(max(x, box[0]), box[2])
                    line = (f'<path class="leader" d="M{x:.1f} {y:.1f}L{near:.1f} {cy:.1f}"/>'
                            if away > 20 else "")
                    return (f'{line}<text class="{css}" x="{left:.1f}" y="{cy + 4:.1f}">'
                            f'{escape(text)}</text>')
        return ""  # the table has it


def pareto_panel(panel, top):
    """Settings of a stage on a capture: quality over cost."""
    points = panel["points"]
    shown = [p for p in points if p["row"]["front"] or p["row"]["kind"] == "preset"]
    highest = max(p["quality"] for p in points)
    # Settings far below everything of interest would flatten the rest.
    lowest = min(p["quality"] for p in shown)
    lowest -= 0.12 * max(highest - lowest, 1e-3)
    inside = [p for p in points if p["quality"] >= lowest]
    x = Axis(min(p["cost"] for p in inside), max(p["cost"] for p in inside), LEFT, WIDTH - RIGHT)
    bottom = top + PANEL - BOTTOM
    highest = max(highest, *(p["quality"] + (p["spread"] or 0.0) for p in shown), lowest)
    y = Axis(min(p["quality"] for p in inside), highest, bottom, top + TOP, log=False)
    y_title = panel["y"] if "dB" not in panel["y"] else panel["y"].replace("dB", "PSNR, dB")
    out = frame(x, y, top, f"{panel['stage']} on {panel['data']}",
                panel["x"] + (", logarithmic" if x.log else ""), y_title)
    left_out = len(points) - len(inside)
    note = "line and discs: Pareto front; diamonds: presets; rings: other settings"
    if left_out:
        note += f"; {left_out} below the axis"
    out.append(f'<text class="small" x="{WIDTH - RIGHT}" y="{top + 22}" text-anchor="end">'
               f'{escape(note)}</text>')
    labels = Labels(LEFT + 2, top + TOP - 16, WIDTH - 2, bottom - 1)
    for p in inside:
        labels.block(x.at(p["cost"]), y.at(p["quality"]))
    front = sorted((p for p in inside if p["row"]["front"]), key=lambda p: p["cost"])
    if front:
        path = f"M{x.at(front[0]['cost']):.1f} {y.at(front[0]['quality']):.1f}"
        for p in front[1:]:
            path += f"H{x.at(p['cost']):.1f}V{y.at(p['quality']):.1f}"
        for a, b in zip(front, front[1:]):
            left, right = x.at(a["cost"]), x.at(b["cost"])
            low, high = y.at(a["quality"]), y.at(b["quality"])
            labels.taken += [(left, low - 1, right, low + 1), (right - 1, high, right + 1, low)]
        out.append(f'<path class="front" d="{path}"/>')
    for p in sorted(inside, key=lambda p: (p["row"]["kind"] == "preset", p["row"]["front"])):
        px, py, row = x.at(p["cost"]), y.at(p["quality"]), p["row"]
        tip = f"<title>{escape(name_of(row))}: {p['cost']:.3g}, {p['quality']:.3f}</title>"
        if p["spread"] and row["kind"] in ("preset", "base"):
            a, b = y.at(p["quality"] - p["spread"]), y.at(p["quality"] + p["spread"])
            out.append(f'<path class="spread" d="M{px:.1f} {a:.1f}V{b:.1f}"/>')
        if row["kind"] == "preset":
            out.append(f'<path class="preset" d="M{px:.1f} {py - 7:.1f}l7 7l-7 7l-7 -7z">{tip}</path>')
        elif row["front"]:
            out.append(f'<circle class="dot" cx="{px:.1f}" cy="{py:.1f}" r="4.2">{tip}</circle>')
        else:
            out.append(f'<circle class="other" cx="{px:.1f}" cy="{py:.1f}" r="3">{tip}</circle>')
    for p in sorted(shown, key=lambda p: (p["row"]["kind"] != "preset", p["cost"])):
        preset = p["row"]["kind"] == "preset"
        css = "presetname" if preset else "small"
        out.append(labels.put(x.at(p["cost"]), y.at(p["quality"]), name_of(p["row"]), css))
    return out


def document(title, panels):
    """The whole picture; `panels` are functions of the top edge."""
    height = PANEL * len(panels) + 8
    body = [line for i, panel in enumerate(panels) for line in panel(i * PANEL)]
    return (f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {WIDTH} {height}" width="{WIDTH}" '
            f'height="{height}" role="img" aria-label="{escape(title)}"><title>{escape(title)}</title>'
            f'{STYLE}<rect class="paper" width="{WIDTH}" height="{height}"/>\n'
            + "\n".join(line for line in body if line) + "\n</svg>\n")


def tradeoff(record, panels):
    return document(f"Quality against cost of each setting, {record['date']}",
                    [lambda top, p=p: pareto_panel(p, top) for p in panels])
