//! How far the picture moved from one frame to the next.

use super::Gray;

/// Side of a patch, pixels of the halved frame.
const PATCH: usize = 8;
/// Distance of patches, pixels of the halved frame.
const SPACING: usize = 10;
/// Search range, pixels of the halved frame.
const RANGE: i32 = 14;
/// Mean absolute difference from its mean, gray levels, that a patch needs to be told from its neighbors.
const LEAST_CONTRAST: i32 = 4;
/// A patch counts as found where its difference is at most this share of what lies beside it on average.
const LEAST_DISTINCT: f64 = 0.4;

/// Median displacement of patches from `before` to `after`, in shares of the longer side; none where no patch is found again.
pub(crate) fn image_motion(before: &Gray, after: &Gray) -> Option<f64> {
    if (before.width, before.height) != (after.width, after.height) {
        return None;
    }
    let (small_before, small_after) = (before.halved(), after.halved());
    let (width, height) = (small_before.width, small_before.height);
    let mut found: Vec<f64> = Vec::new();
    for y in (0..height.saturating_sub(PATCH)).step_by(SPACING) {
        for x in (0..width.saturating_sub(PATCH)).step_by(SPACING) {
            if contrast(&small_before, x, y) < LEAST_CONTRAST {
                continue;
            }
            if let Some([dx, dy]) = displacement(&small_before, &small_after, x, y) {
                found.push(2.0 * f64::from(dx).hypot(f64::from(dy)));
            }
        }
    }
    let longer = before.width.max(before.height) as f64;
    motes_math::median::median(found).map(|pixels| pixels / longer)
}

/// Mean absolute difference of a patch from its mean.
fn contrast(frame: &Gray, x: usize, y: usize) -> i32 {
    let area = (PATCH * PATCH) as i32;
    let values = || (0..PATCH * PATCH).map(|i| frame.at(x + i % PATCH, y + i / PATCH));
    let mean = values().sum::<i32>() / area;
    values().map(|v| (v - mean).abs()).sum::<i32>() / area
}

/// Where a patch went: exhaustive search for the least sum of squared differences, with the parabola through the least and its
/// neighbors for the part below a pixel.
fn displacement(before: &Gray, after: &Gray, x: usize, y: usize) -> Option<[f32; 2]> {
    let span = |at: usize, size: usize| {
        let low = -(at as i32).min(RANGE);
        let high = ((size - PATCH - at) as i32).min(RANGE);
        low..=high
    };
    let cost = |dx: i32, dy: i32| -> i32 {
        let (to_x, to_y) = ((x as i32 + dx) as usize, (y as i32 + dy) as usize);
        (0..PATCH * PATCH)
            .map(|i| {
                let (u, v) = (i % PATCH, i / PATCH);
                (after.at(to_x + u, to_y + v) - before.at(x + u, y + v)).pow(2)
            })
            .sum()
    };
    let (columns, rows) = (span(x, before.width), span(y, before.height));
    let (mut best, mut sum, mut count) = ((i32::MAX, 0, 0), 0.0, 0.0);
    for dy in rows.clone() {
        for dx in columns.clone() {
            let c = cost(dx, dy);
            sum += f64::from(c);
            count += 1.0;
            // Of equal ones the nearest, so that a flat patch stays where it is.
            let nearer = dx * dx + dy * dy < best.1 * best.1 + best.2 * best.2;
            if c < best.0 || c == best.0 && nearer {
                best = (c, dx, dy);
            }
        }
    }
    let (least, dx, dy) = best;
    if f64::from(least) > LEAST_DISTINCT * sum / count {
        return None;
    }
    let below_pixel = |low: Option<i32>, high: Option<i32>| match (low, high) {
        (Some(low), Some(high)) if low + high > 2 * least => {
            0.5 * (low - high) as f32 / (low + high - 2 * least) as f32
        }
        _ => 0.0,
    };
    let along_x = |d: i32| columns.contains(&d).then(|| cost(d, dy));
    let along_y = |d: i32| rows.contains(&d).then(|| cost(dx, d));
    Some([
        dx as f32 + below_pixel(along_x(dx - 1), along_x(dx + 1)),
        dy as f32 + below_pixel(along_y(dy - 1), along_y(dy + 1)),
    ])
}

#[cfg(test)]
mod tests {
    use super::super::tests::texture;
    use super::*;

    #[test]
    fn a_moved_picture_moves_by_so_much() {
        let at = |x: f64, y: f64| texture(240, 136, x, y);
        for (x, y) in [(0.0f64, 0.0f64), (6.0, 0.0), (-4.0, 10.0), (17.0, -3.0), (2.6, 1.2)] {
            let motion = image_motion(&at(0.0, 0.0), &at(x, y)).unwrap();
            let expected = x.hypot(y) / 240.0;
            assert!((motion - expected).abs() < 0.6 / 240.0, "{x} {y}: {motion} {expected}");
        }
    }

    #[test]
    fn nothing_is_found_in_flat_other_and_tiny_pictures() {
        let flat = Gray { width: 240, height: 136, data: vec![90; 240 * 136] };
        assert_eq!(image_motion(&flat, &flat), None);
        assert_eq!(image_motion(&flat, &texture(120, 80, 0.0, 0.0)), None);
        for (width, height) in [(1, 1), (16, 16), (17, 300)] {
            let tiny = texture(width, height, 0.0, 0.0);
            assert!(image_motion(&tiny, &tiny).unwrap_or(0.0) < 1e-6);
        }
    }
}
