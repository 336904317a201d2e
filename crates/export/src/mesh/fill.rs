//! Colors for texels that show nothing, so that filtering and mip maps do not bleed: pull-push
//! (Gortler et al. 1996).

use motes_scene::ImageU8;

/// Fills texels that are not `known` with averages of the nearest ones that are.
pub(super) fn fill_unknown(image: &mut ImageU8, known: &[bool]) {
    let channels = image.channels;
    let values: Vec<f32> = image.data.iter().map(|v| f32::from(*v)).collect();
    let weights: Vec<f32> = known.iter().map(|k| f32::from(u8::from(*k))).collect();
    if !known.contains(&true) {
        return;
    }
    let filled = filled(image.width, image.height, channels, values, weights);
    for (i, known) in known.iter().enumerate() {
        if !known {
            for c in 0..channels {
                image.data[channels * i + c] = filled[channels * i + c].round() as u8;
            }
        }
    }
}

/// Values where the weight is 0 come from a picture of half the size, itself filled.
fn filled(
    width: usize,
    height: usize,
    channels: usize,
    mut values: Vec<f32>,
    weights: Vec<f32>,
) -> Vec<f32> {
    if weights.iter().all(|w| *w > 0.0) {
        return values;
    }
    let (half_width, half_height) = (width.div_ceil(2), height.div_ceil(2));
    let mut half = vec![0.0; half_width * half_height * channels];
    let mut half_weights = vec![0.0f32; half_width * half_height];
    for y in 0..height {
        for x in 0..width {
            let (i, h) = (y * width + x, (y / 2) * half_width + x / 2);
            if weights[i] > 0.0 {
                half_weights[h] += 1.0;
                for c in 0..channels {
                    half[channels * h + c] += values[channels * i + c];
                }
            }
        }
    }
    for (h, weight) in half_weights.iter().enumerate() {
        for c in 0..channels {
            half[channels * h + c] /= weight.max(1.0);
        }
    }
    let half = filled(half_width, half_height, channels, half, half_weights);
    for y in 0..height {
        for x in 0..width {
            let (i, h) = (y * width + x, (y / 2) * half_width + x / 2);
            if !(weights[i] > 0.0) {
                for c in 0..channels {
                    values[channels * i + c] = half[channels * h + c];
                }
            }
        }
    }
    values
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn unknown_texels_take_the_nearest_colors_and_known_ones_stay() {
        let mut image = ImageU8::filled(9, 5, 3, 0);
        let mut known = vec![false; 45];
        for (i, color) in [(0, [200, 0, 10]), (44, [0, 100, 30])] {
            image.data[3 * i..3 * i + 3].copy_from_slice(&color);
            known[i] = true;
        }
        fill_unknown(&mut image, &known);
        assert_eq!(image.pixel(0, 0), [200, 0, 10]);
        assert_eq!(image.pixel(1, 1), [200, 0, 10]);
        assert_eq!(image.pixel(8, 4), [0, 100, 30]);
        assert!(image.data.chunks(3).all(|p| p != [0, 0, 0]));
        let mut nothing = ImageU8::filled(4, 4, 1, 7);
        fill_unknown(&mut nothing, &[false; 16]);
        assert!(nothing.data.iter().all(|v| *v == 7));
    }
}
