//! Which frames of a video become photos: sharp ones, at equal steps of image motion.
//!
//! ```text
//! s_k   variance of the Laplacian of frame k                             (Pech-Pacheco et al. 2000)
//! m_k   median displacement of patches from frame k - 1 to k, in image widths
//! M_k   = m_1 + ... + m_k
//! bin   frames whose M_k lies in [j, j + 1) M_n / N; the sharpest of each bin is taken
//! ```
//!
//! Equal steps of motion give neighbors the same overlap, however unevenly the camera moved; where it stood still one frame is
//! enough.

mod choose;
mod motion;
mod sharpness;

pub(crate) use choose::choose;
pub(crate) use motion::image_motion;
pub(crate) use sharpness::sharpness;

/// A small gray frame, row by row.
#[derive(Clone, Debug)]
pub(crate) struct Gray {
    pub(crate) width: usize,
    pub(crate) height: usize,
    pub(crate) data: Vec<u8>,
}

impl Gray {
    fn at(&self, x: usize, y: usize) -> i32 {
        i32::from(self.data[y * self.width + x])
    }

    /// Half the size; the mean of each 2 x 2 pixels.
    fn halved(&self) -> Self {
        let (width, height) = (self.width / 2, self.height / 2);
        let mean = |i: usize| {
            let (x, y) = (2 * (i % width), 2 * (i / width));
            let sum = self.at(x, y) + self.at(x + 1, y) + self.at(x, y + 1) + self.at(x + 1, y + 1);
            ((sum + 2) / 4) as u8
        };
        Self { width, height, data: (0..width * height).map(mean).collect() }
    }
}

#[cfg(test)]
pub(crate) mod tests {
    use super::Gray;

    /// A smooth random texture, seen `(x, y)` pixels further.
    pub(crate) fn texture(width: usize, height: usize, x: f64, y: f64) -> Gray {
        let value = |i: usize| {
            let (u, v) = ((i % width) as f64 + x, (i / width) as f64 + y);
            let waves =
                [(0.31, 0.17, 0.3), (-0.12, 0.41, 1.1), (0.53, -0.29, 2.0), (0.07, 0.09, 4.0)];
            let sum: f64 = waves.iter().map(|(a, b, c)| (a * u + b * v + c).sin()).sum();
            (128.0 + 28.0 * sum) as u8
        };
        Gray { width, height, data: (0..width * height).map(value).collect() }
    }
}
