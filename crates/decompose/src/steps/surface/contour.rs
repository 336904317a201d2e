//! A region of a grid as triangles with a smooth outline (marching squares, after Lorensen & Cline 1987).

use std::collections::BTreeMap;

/// Binomial averages of the cells: an oblique outline runs through some cells per step of the grid.
const AVERAGES: usize = 2;
/// Crossings keep this share of an edge away from its ends, so that no triangle is a sliver.
const LEAST_SHARE: f32 = 0.01;

/// A vertex: a corner of the grid, or a crossing on the edge from a corner to the right or up.
type Key = (usize, u8);

/// Points in cells and counterclockwise triangles (x right, y up) of the marked cells, `[rows, columns]`, of a grid of
/// `[columns, rows]` cells. Straight outlines stay where they are, corners are rounded by about a cell; lines thinner than two cells
/// are lost.
pub(super) fn filled(
    [columns, rows]: [usize; 2],
    marked: &[bool],
) -> (Vec<[f32; 2]>, Vec<[u32; 3]>) {
    let inside = corner_values(columns, rows, marked);
    let corners = columns + 1;
    let mut points: Vec<[f32; 2]> = Vec::new();
    let mut triangles = Vec::new();
    let mut known: BTreeMap<Key, u32> = BTreeMap::new();
    let mut vertex = |key: Key, at: [f32; 2]| {
        *known.entry(key).or_insert_with(|| {
            points.push(at);
            points.len() as u32 - 1
        })
    };
    let mut polygon: Vec<u32> = Vec::with_capacity(8);
    for y in 0..rows {
        for x in 0..columns {
            let around = [(x, y), (x + 1, y), (x + 1, y + 1), (x, y + 1)];
            polygon.clear();
            for k in 0..4 {
                let (here, next) = (around[k], around[(k + 1) % 4]);
                let value = |(x, y): (usize, usize)| inside[y * corners + x];
                let (a, b) = (value(here), value(next));
                if a > 0.0 {
                    let at = [here.0 as f32, here.1 as f32];
                    polygon.push(vertex((here.1 * corners + here.0, 0), at));
                }
                if (a > 0.0) != (b > 0.0) {
                    // From the lower corner, so that both cells of an edge find the same point.
                    let (low, high) = if here < next { (here, next) } else { (next, here) };
                    let (a, b) = (value(low), value(high));
                    let t = (a / (a - b)).clamp(LEAST_SHARE, 1.0 - LEAST_SHARE);
                    let along = [(high.0 - low.0) as f32 * t, (high.1 - low.1) as f32 * t];
                    let at = [low.0 as f32 + along[0], low.1 as f32 + along[1]];
                    let direction = if high.0 > low.0 { 1 } else { 2 };
                    polygon.push(vertex((low.1 * corners + low.0, direction), at));
                }
            }
            triangles.extend((2..polygon.len()).map(|k| [polygon[0], polygon[k - 1], polygon[k]]));
        }
    }
    (points, triangles)
}

/// `[rows + 1, columns + 1]`: how far a corner lies in the region, over 1/2.
fn corner_values(columns: usize, rows: usize, marked: &[bool]) -> Vec<f32> {
    let mut share: Vec<f32> = marked.iter().map(|&m| f32::from(u8::from(m))).collect();
    for _ in 0..AVERAGES {
        for (step, count) in [(1, columns), (columns, rows)] {
            let before = share.clone();
            for (k, value) in share.iter_mut().enumerate() {
                let at = k / step % count;
                let low = if at > 0 { before[k - step] } else { 0.0 };
                let high = if at + 1 < count { before[k + step] } else { 0.0 };
                *value = 0.25 * low + 0.5 * before[k] + 0.25 * high;
            }
        }
    }
    let cell = |x: usize, y: usize| {
        let inside = (1..=columns).contains(&x) && (1..=rows).contains(&y);
        if inside { share[(y - 1) * columns + x - 1] } else { 0.0 }
    };
    let corner = |k: usize| {
        let (x, y) = (k % (columns + 1), k / (columns + 1));
        0.25 * (cell(x, y) + cell(x + 1, y) + cell(x, y + 1) + cell(x + 1, y + 1)) - 0.5
    };
    (0..(columns + 1) * (rows + 1)).map(corner).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn area(points: &[[f32; 2]], triangles: &[[u32; 3]]) -> f32 {
        let of = |t: &[u32; 3]| {
            let [a, b, c] = t.map(|i| points[i as usize]);
            0.5 * ((b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]))
        };
        assert!(triangles.iter().all(|t| of(t) > 0.0), "a triangle is clockwise or has no area");
        triangles.iter().map(of).sum()
    }

    #[test]
    fn a_disk_has_a_round_outline() {
        let (side, radius) = (60usize, 20.3f32);
        let off = |p: [f32; 2]| (p[0] - 30.0).hypot(p[1] - 30.0);
        let marked: Vec<bool> = (0..side * side)
            .map(|k| off([(k % side) as f32 + 0.5, (k / side) as f32 + 0.5]) < radius)
            .collect();
        let (points, triangles) = filled([side, side], &marked);
        let share = area(&points, &triangles) / (std::f32::consts::PI * radius * radius);
        assert!((share - 1.0).abs() < 0.02, "{share}");
        let farthest = points.iter().map(|p| off(*p)).fold(0.0, f32::max);
        assert!(farthest < radius + 0.35, "{farthest}: cells reach 0.7 farther");
        // Outline points, those that one triangle's edge alone holds, are all near the circle.
        let mut edges: BTreeMap<(u32, u32), usize> = BTreeMap::new();
        for t in &triangles {
            for k in 0..3 {
                let (a, b) = (t[k], t[(k + 1) % 3]);
                *edges.entry((a.min(b), a.max(b))).or_default() += 1;
            }
        }
        assert!(edges.values().all(|&count| count <= 2), "an edge has three triangles");
        let rim = edges.iter().filter(|(_, count)| **count == 1);
        let worst = rim
            .flat_map(|((a, b), _)| [*a, *b])
            .map(|i| (off(points[i as usize]) - radius).abs())
            .fold(0.0, f32::max);
        assert!(worst < 0.5, "{worst}");
    }

    #[test]
    fn a_rectangle_keeps_its_sides_and_nothing_gives_nothing() {
        let marked: Vec<bool> = (0..30 * 20)
            .map(|k| (5..25).contains(&(k % 30)) && (4..14).contains(&(k / 30)))
            .collect();
        let (points, triangles) = filled([30, 20], &marked);
        let bound = |axis: usize, most: bool| {
            let along = points.iter().map(|p| p[axis]);
            if most { along.fold(0.0, f32::max) } else { along.fold(99.0, f32::min) }
        };
        let box_ = [bound(0, false), bound(0, true), bound(1, false), bound(1, true)];
        for (found, wanted) in box_.into_iter().zip([5.0, 25.0, 4.0, 14.0]) {
            assert!((found - wanted).abs() < 0.02, "{box_:?}");
        }
        let share = area(&points, &triangles) / 200.0;
        assert!(share > 0.97 && share <= 1.0, "{share}");
        assert_eq!(filled([4, 4], &[false; 16]), (Vec::new(), Vec::new()));
        assert_eq!(filled([0, 0], &[]).1.len(), 0);
    }
}
