//! Which point of the mesh every texel shows.

use super::unwrap::Atlas;

/// No triangle covers the texel's center.
pub(super) const EMPTY: u32 = u32::MAX;

/// Triangle per texel, row by row; where two touch, the earlier one.
pub(super) fn triangle_of_texel(atlas: &Atlas) -> Vec<u32> {
    let (width, height) = (atlas.width, atlas.height);
    let mut owner = vec![EMPTY; width * height];
    for (t, corners) in atlas.triangles.iter().enumerate() {
        let [a, b, c] = corners.map(|v| texel_space(atlas, v));
        let Some(inverse) = inverse_area(a, b, c) else { continue };
        let low = |k: usize| a[k].min(b[k]).min(c[k]).floor().max(0.0) as usize;
        let high = |k: usize, n: usize| (a[k].max(b[k]).max(c[k]).ceil().max(0.0) as usize).min(n);
        for y in low(1)..high(1, height) {
            for x in low(0)..high(0, width) {
                let p = [x as f64 + 0.5, y as f64 + 0.5];
                let w = weights(a, b, c, inverse, p);
                // The slack closes the gap that rounding leaves between two triangles.
                let slot = &mut owner[y * width + x];
                if *slot == EMPTY && w.iter().all(|w| *w >= -1e-6) {
                    *slot = t as u32;
                }
            }
        }
    }
    owner
}

/// Weights of a triangle's corners at the center of a texel, which sum to 1.
pub(super) fn barycentrics(atlas: &Atlas, triangle: u32, x: usize, y: usize) -> [f32; 3] {
    let [a, b, c] = atlas.triangles[triangle as usize].map(|v| texel_space(atlas, v));
    let inverse = inverse_area(a, b, c).unwrap_or(0.0);
    weights(a, b, c, inverse, [x as f64 + 0.5, y as f64 + 0.5]).map(|w| w as f32)
}

fn texel_space(atlas: &Atlas, vertex: u32) -> [f64; 2] {
    let [u, v] = atlas.uvs[vertex as usize].map(f64::from);
    [u * atlas.width as f64, v * atlas.height as f64]
}

fn cross(o: [f64; 2], a: [f64; 2], b: [f64; 2]) -> f64 {
    (a[0] - o[0]) * (b[1] - o[1]) - (a[1] - o[1]) * (b[0] - o[0])
}

fn inverse_area(a: [f64; 2], b: [f64; 2], c: [f64; 2]) -> Option<f64> {
    let area = cross(a, b, c);
    (area.abs() > 1e-12).then(|| 1.0 / area)
}

fn weights(a: [f64; 2], b: [f64; 2], c: [f64; 2], inverse: f64, p: [f64; 2]) -> [f64; 3] {
    let (v, w) = (cross(a, p, c) * inverse, cross(a, b, p) * inverse);
    [1.0 - v - w, v, w]
}
