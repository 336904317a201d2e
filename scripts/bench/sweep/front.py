"""Means and spreads over seeds, the Pareto front, slopes on log-log axes."""

import math


def mean(values):
    return sum(values) / len(values)


def spread(values):
    """Sample standard deviation (n - 1); None for fewer than two values."""
    if len(values) < 2:
        return None
    middle = mean(values)
    return math.sqrt(sum((v - middle) ** 2 for v in values) / (len(values) - 1))


def pareto(points):
    """Indices of the points that no other point beats, by cost from low to high.

    `points` are (cost, quality): low cost and high quality are better. A point is beaten by one
    that is at least as good in both and better in one; of equal points the first stays. Points
    that are not finite are never on the front.
    """
    finite = [i for i, p in enumerate(points) if all(math.isfinite(v) for v in p)]
    order = sorted(finite, key=lambda i: (points[i][0], -points[i][1], i))
    front, best = [], -math.inf
    for i in order:
        if points[i][1] > best:
            front.append(i)
            best = points[i][1]
    return front


def slope(xs, ys):
    """Least-squares slope and intercept of ys over xs."""
    mx, my = mean(xs), mean(ys)
    weight = sum((x - mx) ** 2 for x in xs)
    if not weight > 0.0:
        return math.nan, math.nan
    m = sum((x - mx) * (y - my) for x, y in zip(xs, ys)) / weight
    return m, my - m * mx


def exponents(xs, ys):
    """Growth of ys with xs as powers: (over all points, the largest between neighbors).

    A fixed cost makes the first too small; the second cannot hide a steep end.
    """
    logs = [(math.log(x), math.log(y)) for x, y in sorted(zip(xs, ys)) if x > 0.0 and y > 0.0]
    if len(logs) < 2:
        return math.nan, math.nan
    steps = [(b[1] - a[1]) / (b[0] - a[0]) for a, b in zip(logs, logs[1:]) if b[0] > a[0]]
    return slope([l[0] for l in logs], [l[1] for l in logs])[0], max(steps, default=math.nan)
