//! Error heat maps: where a render differs from its photo, and by how much.

use motes_scene::ImageU8;

use crate::colormap::colormap;

/// Mean absolute difference over RGB that maps to the brightest color, in 8-bit steps: larger
/// errors are clipped. One fixed scale makes maps comparable across views, runs and programs.
pub const ERROR_FULL_SCALE: f64 = 64.0;

/// The mean absolute difference of each pixel through the color map, 3 channels.
///
/// `photo` and `render` have the same size and 3 or 4 channels; only RGB counts. Pixels whose
/// `counted` entry is false (masked out) are mid-gray.
///
/// # Panics
/// When the sizes differ.
pub fn error_map(photo: &ImageU8, render: &ImageU8, counted: Option<&[bool]>) -> ImageU8 {
    assert_eq!((photo.width, photo.height), (render.width, render.height), "images of one size");
    let palette: Vec<[u8; 3]> = (0..256).map(|i| colormap(f64::from(i) / 255.0)).collect();
    let pixels = photo
        .data
        .chunks_exact(photo.channels)
        .zip(render.data.chunks_exact(render.channels))
        .enumerate()
        .flat_map(|(i, (p, r))| {
            if counted.is_some_and(|counted| !counted[i]) {
                return [128; 3];
            }
            let sum: u32 = p.iter().zip(r).take(3).map(|(p, r)| u32::from(p.abs_diff(*r))).sum();
            let level = f64::from(sum) / 3.0 / ERROR_FULL_SCALE * 255.0;
            palette[level.round().min(255.0) as usize]
        });
    ImageU8::from_data(photo.width, photo.height, 3, pixels.collect())
}

/// A horizontal bar of the color map from 0 (left) to full scale, 3 channels.
pub fn scale_bar(width: usize, height: usize) -> ImageU8 {
    let mut bar = ImageU8::filled(width, height, 3, 0);
    let last = width.saturating_sub(1).max(1) as f64;
    for y in 0..height {
        for x in 0..width {
            bar.pixel_mut(x, y).copy_from_slice(&colormap(x as f64 / last));
        }
    }
    bar
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn larger_errors_are_brighter_and_masked_ones_gray() {
        let photo = ImageU8::filled(4, 1, 3, 100);
        let mut render = ImageU8::filled(4, 1, 4, 100);
        render.pixel_mut(1, 0)[0] = 140;
        render.pixel_mut(2, 0)[..3].fill(255);
        let map = error_map(&photo, &render, Some(&[true, true, true, false]));
        assert_eq!(map.pixel(0, 0), colormap(0.0));
        assert_eq!(map.pixel(2, 0), colormap(1.0));
        assert_eq!(map.pixel(3, 0), [128; 3]);
        let sum = |x: usize| map.pixel(x, 0).iter().map(|&v| u32::from(v)).sum::<u32>();
        assert!(sum(0) < sum(1) && sum(1) < sum(2));
    }

    #[test]
    fn the_bar_spans_the_map() {
        let bar = scale_bar(50, 2);
        assert_eq!(bar.pixel(0, 1), colormap(0.0));
        assert_eq!(bar.pixel(49, 0), colormap(1.0));
    }
}
