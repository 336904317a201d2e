//! How sharp a frame is.

use super::Gray;

/// Variance of the Laplacian, gray levels squared; 0 below 3 x 3 pixels. Only frames of the same content compare.
pub(crate) fn sharpness(frame: &Gray) -> f64 {
    if frame.width < 3 || frame.height < 3 {
        return 0.0;
    }
    let (mut sum, mut squares, mut count) = (0.0, 0.0, 0.0);
    for y in 1..frame.height - 1 {
        for x in 1..frame.width - 1 {
            let around =
                frame.at(x - 1, y) + frame.at(x + 1, y) + frame.at(x, y - 1) + frame.at(x, y + 1);
            let laplacian = f64::from(around - 4 * frame.at(x, y));
            sum += laplacian;
            squares += laplacian * laplacian;
            count += 1.0;
        }
    }
    let mean = sum / count;
    (squares / count - mean * mean).max(0.0)
}

#[cfg(test)]
mod tests {
    use super::super::tests::texture;
    use super::*;

    /// The mean of a frame and its copies moved along x: motion blur.
    fn blurred(length: usize) -> Gray {
        let copies: Vec<Gray> = (0..length).map(|d| texture(120, 80, d as f64, 0.0)).collect();
        let mean = |i: usize| {
            (copies.iter().map(|c| u32::from(c.data[i])).sum::<u32>() / length as u32) as u8
        };
        Gray { width: 120, height: 80, data: (0..120 * 80).map(mean).collect() }
    }

    #[test]
    fn motion_blur_is_less_sharp_the_longer_it_is() {
        let values = [1, 5, 9].map(|length| sharpness(&blurred(length)));
        assert!(values[0] > 1.2 * values[1] && values[1] > 1.2 * values[2], "{values:?}");
        assert_eq!(sharpness(&Gray { width: 2, height: 9, data: vec![7; 18] }), 0.0);
        assert_eq!(sharpness(&Gray { width: 9, height: 9, data: vec![255; 81] }), 0.0);
    }
}
