//! Gaussian and difference-of-Gaussian images of a photo (Lowe 2004).

/// Levels per octave at which extrema are looked for.
pub(super) const LEVELS: usize = 3;
/// Standard deviation of the first level, pixels of its octave. Finer than Lowe's 1.6: small photos
/// have most of their corners there.
pub(super) const BASE_SIGMA: f32 = 1.2;
/// Standard deviation that a photo is taken to have by itself.
const PHOTO_SIGMA: f32 = 0.5;
/// Octaves; the last is an eighth of the size.
const OCTAVES: usize = 4;
/// Octaves shorter than this hold nothing.
const SHORTEST_SIDE: usize = 24;

/// One channel.
#[derive(Clone, Debug)]
pub(super) struct Gray {
    pub(super) width: usize,
    pub(super) height: usize,
    pub(super) data: Vec<f32>,
}

impl Gray {
    #[inline]
    pub(super) fn at(&self, x: usize, y: usize) -> f32 {
        self.data[y * self.width + x]
    }

    fn blurred(&self, sigma: f32) -> Self {
        let radius = (3.0 * sigma).ceil() as usize;
        let weight = |i: usize| (-0.5 * (i as f32 / sigma).powi(2)).exp();
        let sum = 1.0 + 2.0 * (1..=radius).map(weight).sum::<f32>();
        let kernel: Vec<f32> = (0..=radius).map(|i| weight(i) / sum).collect();
        let (w, h) = (self.width, self.height);
        let mut rows = vec![0.0; w * h];
        let mut padded = vec![0.0; w + 2 * radius];
        for y in 0..h {
            let row = &self.data[y * w..(y + 1) * w];
            padded[..radius].fill(row[0]);
            padded[radius..radius + w].copy_from_slice(row);
            padded[radius + w..].fill(row[w - 1]);
            let out = &mut rows[y * w..(y + 1) * w];
            add_scaled(out, &padded[radius..radius + w], kernel[0]);
            for (i, &k) in kernel.iter().enumerate().skip(1) {
                add_scaled(out, &padded[radius - i..radius - i + w], k);
                add_scaled(out, &padded[radius + i..radius + i + w], k);
            }
        }
        let mut data = vec![0.0; w * h];
        for y in 0..h {
            let out = &mut data[y * w..(y + 1) * w];
            let row = |y: usize| &rows[y * w..(y + 1) * w];
            add_scaled(out, row(y), kernel[0]);
            for (i, &k) in kernel.iter().enumerate().skip(1) {
                add_scaled(out, row(y.saturating_sub(i)), k);
                add_scaled(out, row((y + i).min(h - 1)), k);
            }
        }
        Self { width: w, height: h, data }
    }

    /// Every second pixel of every second row.
    fn halved(&self) -> Self {
        let (width, height) = (self.width.div_ceil(2), self.height.div_ceil(2));
        let row = |y: usize| self.data[2 * y * self.width..(2 * y + 1) * self.width].iter();
        let data = (0..height).flat_map(|y| row(y).step_by(2).copied()).collect();
        Self { width, height, data }
    }
}

fn add_scaled(out: &mut [f32], values: &[f32], factor: f32) {
    for (out, value) in out.iter_mut().zip(values) {
        *out += factor * value;
    }
}

/// One octave: levels of rising blur, and their differences.
pub(super) struct Octave {
    /// Pixels of the photo per pixel of the octave.
    pub(super) step: f32,
    pub(super) levels: Vec<Gray>,
    pub(super) differences: Vec<Gray>,
}

/// Standard deviation of a level, pixels of its octave.
pub(super) fn sigma_of(level: f32) -> f32 {
    BASE_SIGMA * (level / LEVELS as f32).exp2()
}

/// The octaves of a photo, fine to coarse.
pub(super) fn octaves(photo: &Gray) -> Vec<Octave> {
    let first = (BASE_SIGMA * BASE_SIGMA - PHOTO_SIGMA * PHOTO_SIGMA).sqrt();
    let mut base = photo.blurred(first);
    let mut octaves = Vec::new();
    for octave in 0..OCTAVES {
        if base.width.min(base.height) < SHORTEST_SIDE {
            break;
        }
        let mut levels = vec![base];
        for level in 1..LEVELS + 3 {
            let (before, after) = (sigma_of(level as f32 - 1.0), sigma_of(level as f32));
            let more = (after * after - before * before).sqrt();
            let next = levels[level - 1].blurred(more);
            levels.push(next);
        }
        let differences = levels
            .windows(2)
            .map(|pair| Gray {
                data: pair[1].data.iter().zip(&pair[0].data).map(|(a, b)| a - b).collect(),
                ..pair[0]
            })
            .collect();
        base = levels[LEVELS].halved();
        octaves.push(Octave { step: (octave as f32).exp2(), levels, differences });
    }
    octaves
}
