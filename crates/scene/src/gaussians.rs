//! The model: a set of anisotropic 3D Gaussians as a struct of arrays.

use motes_math::sh::SH_C0;

/// Values of a PLY column that motes does not interpret, in their stored type.
#[derive(Clone, Debug, PartialEq)]
#[expect(missing_docs, reason = "one variant per PLY scalar type")]
pub enum ColumnValues {
    I8(Vec<i8>),
    U8(Vec<u8>),
    I16(Vec<i16>),
    U16(Vec<u16>),
    I32(Vec<i32>),
    U32(Vec<u32>),
    F32(Vec<f32>),
    F64(Vec<f64>),
}

/// A named per-Gaussian column beyond the standard ones, carried through every stage.
#[derive(Clone, Debug, PartialEq)]
pub struct ExtraColumn {
    /// PLY property name.
    pub name: String,
    /// One value per Gaussian.
    pub values: ColumnValues,
}

macro_rules! for_each_column_type {
    ($values:expr, $v:ident => $body:expr) => {
        match $values {
            ColumnValues::I8($v) => $body,
            ColumnValues::U8($v) => $body,
            ColumnValues::I16($v) => $body,
            ColumnValues::U16($v) => $body,
            ColumnValues::I32($v) => $body,
            ColumnValues::U32($v) => $body,
            ColumnValues::F32($v) => $body,
            ColumnValues::F64($v) => $body,
        }
    };
}

impl ColumnValues {
    /// Number of values.
    pub fn len(&self) -> usize {
        for_each_column_type!(self, v => v.len())
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Moves the values of `more` to the end.
    ///
    /// # Panics
    /// When the types differ.
    pub fn append(&mut self, more: &mut Self) {
        macro_rules! same_type {
            ($($variant:ident),*) => {
                match (self, more) {
                    $((Self::$variant(to), Self::$variant(from)) => to.append(from),)*
                    _ => panic!("columns of different types"),
                }
            };
        }
        same_type!(I8, U8, I16, U16, I32, U32, F32, F64);
    }

    /// Cuts off what is behind the first `n` values, or appends zeros.
    pub fn resize(&mut self, n: usize) {
        for_each_column_type!(self, v => v.resize(n, Default::default()));
    }

    /// As many zeros of the same type.
    #[must_use]
    pub fn zeros(&self, n: usize) -> Self {
        match self {
            Self::I8(_) => Self::I8(vec![0; n]),
            Self::U8(_) => Self::U8(vec![0; n]),
            Self::I16(_) => Self::I16(vec![0; n]),
            Self::U16(_) => Self::U16(vec![0; n]),
            Self::I32(_) => Self::I32(vec![0; n]),
            Self::U32(_) => Self::U32(vec![0; n]),
            Self::F32(_) => Self::F32(vec![0.0; n]),
            Self::F64(_) => Self::F64(vec![0.0; n]),
        }
    }

    /// Keeps the rows of `rows`, in that order; a row may repeat.
    pub fn gather(&mut self, rows: &[u32]) {
        for_each_column_type!(self, v => *v = rows.iter().map(|&r| v[r as usize]).collect());
    }
}

/// Anisotropic 3D Gaussians with view-dependent color, struct of arrays.
///
/// `N` Gaussians, SH degree `d`, `K = (d + 1)^2` coefficients:
///
/// | field | shape | stored value | meaning |
/// |---|---|---|---|
/// | `means` | `[N, 3]` | world units | center |
/// | `rotations` | `[N, 4]` | `w, x, y, z`, any norm > 0 | local axes to world |
/// | `log_scales` | `[N, 3]` | natural logarithm | standard deviation along the local axes |
/// | `opacity_logits` | `[N]` | logit | opacity = sigmoid |
/// | `sh` | `[N, K, 3]` | coefficient-major, RGB fastest | color = 0.5 + SH(direction), sRGB-encoded |
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Gaussians {
    /// Centers in world.
    pub means: Vec<[f32; 3]>,
    /// Quaternions `w, x, y, z`.
    pub rotations: Vec<[f32; 4]>,
    /// Log standard deviations.
    pub log_scales: Vec<[f32; 3]>,
    /// Opacity logits.
    pub opacity_logits: Vec<f32>,
    /// Degree of the spherical harmonics, 0 to 4.
    pub sh_degree: u8,
    /// SH coefficients `[N, (sh_degree + 1)^2, 3]`.
    pub sh: Vec<f32>,
    /// Columns of other programs and of later stages.
    pub extra: Vec<ExtraColumn>,
}

impl Gaussians {
    /// No Gaussians at a degree.
    pub fn empty(sh_degree: u8) -> Self {
        Self { sh_degree, ..Self::default() }
    }

    /// Number of Gaussians.
    pub fn len(&self) -> usize {
        self.means.len()
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.means.is_empty()
    }

    /// SH coefficients per Gaussian and channel, `(sh_degree + 1)^2`.
    pub fn sh_coefficients(&self) -> usize {
        (self.sh_degree as usize + 1).pow(2)
    }

    /// SH values of one Gaussian, `[K, 3]`.
    pub fn sh_of(&self, i: usize) -> &[f32] {
        let stride = 3 * self.sh_coefficients();
        &self.sh[i * stride..(i + 1) * stride]
    }

    /// sRGB-encoded color of one Gaussian as a mean over directions, not bounded.
    pub fn mean_color(&self, i: usize) -> [f32; 3] {
        let sh = self.sh_of(i);
        [0, 1, 2].map(|c| 0.5 + SH_C0 as f32 * sh[c])
    }

    /// Keeps the Gaussians of `rows`, in that order; a row may repeat.
    pub fn gather(&mut self, rows: &[u32]) {
        fn pick<T: Copy>(values: &[T], rows: &[u32]) -> Vec<T> {
            rows.iter().map(|&r| values[r as usize]).collect()
        }
        let stride = 3 * self.sh_coefficients();
        self.sh = rows
            .iter()
            .flat_map(|&r| self.sh[r as usize * stride..(r as usize + 1) * stride].iter().copied())
            .collect();
        self.means = pick(&self.means, rows);
        self.rotations = pick(&self.rotations, rows);
        self.log_scales = pick(&self.log_scales, rows);
        self.opacity_logits = pick(&self.opacity_logits, rows);
        for column in &mut self.extra {
            column.values.gather(rows);
        }
    }

    /// The same Gaussians with one color each, toward every viewer and without other columns: sRGB-encoded as a picture shows it,
    /// or any other number to be drawn. Values are clamped to 0 to 1, NaN to 0.
    pub fn colored(&self, color: impl Fn(usize) -> [f32; 3]) -> Self {
        let coefficient = |v: f32| (v.max(0.0).clamp(0.0, 1.0) - 0.5) / SH_C0 as f32;
        Self {
            means: self.means.clone(),
            rotations: self.rotations.clone(),
            log_scales: self.log_scales.clone(),
            opacity_logits: self.opacity_logits.clone(),
            sh_degree: 0,
            sh: (0..self.len()).flat_map(|i| color(i).map(coefficient)).collect(),
            extra: Vec::new(),
        }
    }

    /// The same Gaussians with what they show, sRGB-encoded, mapped by `shown_as(i, channel, value)`: the mean color `m` of each
    /// becomes that of `m`, and the bands above it are scaled by the slope there, within a tenth and four: near black such
    /// maps are steep.
    pub fn with_colors_mapped(&self, shown_as: impl Fn(usize, usize, f32) -> f32) -> Self {
        const STEP: f32 = 1e-3;
        const SLOPES: [f32; 2] = [0.1, 4.0];
        let mut out = self.clone();
        let stride = 3 * out.sh_coefficients();
        for (i, sh) in out.sh.chunks_exact_mut(stride).enumerate() {
            for c in 0..3 {
                let mean = 0.5 + SH_C0 as f32 * sh[c];
                let [below, at, above] =
                    [mean - STEP, mean, mean + STEP].map(|v| (v, shown_as(i, c, v)));
                if [below, at, above].iter().all(|(v, shown)| v == shown) {
                    continue;
                }
                let slope = (above.1 - below.1) / (2.0 * STEP);
                sh[c] = (at.1 - 0.5) / SH_C0 as f32;
                for value in sh.iter_mut().skip(3 + c).step_by(3) {
                    *value *= slope.clamp(SLOPES[0], SLOPES[1]);
                }
            }
        }
        out
    }

    /// The same Gaussians at another SH degree: higher bands are dropped or start at zero.
    pub fn with_sh_degree(&self, degree: u8) -> Self {
        let (old, new) = (self.sh_coefficients(), (degree as usize + 1).pow(2));
        let mut sh = vec![0.0; self.len() * new * 3];
        let kept = 3 * old.min(new);
        if kept > 0 {
            for (to, from) in sh.chunks_exact_mut(3 * new).zip(self.sh.chunks_exact(3 * old)) {
                to[..kept].copy_from_slice(&from[..kept]);
            }
        }
        Self { sh, sh_degree: degree, ..self.clone() }
    }

    /// Whether every array has the length that [`Self::len`] and the degree imply.
    pub fn is_consistent(&self) -> bool {
        let n = self.len();
        self.sh_degree <= 4
            && self.rotations.len() == n
            && self.log_scales.len() == n
            && self.opacity_logits.len() == n
            && self.sh.len() == n * self.sh_coefficients() * 3
            && self.extra.iter().all(|column| column.values.len() == n)
    }

    /// Indices of Gaussians with a non-finite value in any standard column or a rotation without
    /// direction. Infinite opacity logits and scales of minus infinity are legal limits
    /// (opacity 1 or 0, a flat Gaussian) and do not count.
    pub fn invalid_rows(&self) -> Vec<u32> {
        let stride = 3 * self.sh_coefficients();
        (0..self.len())
            .filter(|&i| {
                let norm2: f32 = self.rotations[i].iter().map(|q| q * q).sum();
                let ok = self.means[i].iter().all(|v| v.is_finite())
                    && norm2 > 0.0
                    && norm2.is_finite()
                    && self.log_scales[i].iter().all(|s| !s.is_nan() && *s < f32::INFINITY)
                    && !self.opacity_logits[i].is_nan()
                    && self.sh[i * stride..(i + 1) * stride].iter().all(|v| v.is_finite());
                !ok
            })
            .map(|i| i as u32)
            .collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn two() -> Gaussians {
        Gaussians {
            means: vec![[0.0; 3], [1.0; 3]],
            rotations: vec![[1.0, 0.0, 0.0, 0.0]; 2],
            log_scales: vec![[0.0; 3]; 2],
            opacity_logits: vec![0.0, 1.0],
            sh_degree: 1,
            sh: (0..24).map(|v| v as f32).collect(),
            extra: vec![ExtraColumn { name: "label".into(), values: ColumnValues::U8(vec![7, 9]) }],
        }
    }

    #[test]
    fn gather_keeps_rows_together() {
        let mut g = two();
        g.gather(&[1, 1, 0]);
        assert!(g.is_consistent());
        assert_eq!(g.opacity_logits, [1.0, 1.0, 0.0]);
        assert_eq!(g.sh_of(0)[0], 12.0);
        assert_eq!(g.extra[0].values, ColumnValues::U8(vec![9, 9, 7]));
    }

    #[test]
    fn changing_the_degree_keeps_the_low_bands() {
        let up = two().with_sh_degree(2);
        assert!(up.is_consistent());
        assert_eq!(up.sh_of(1)[..12], two().sh_of(1)[..]);
        assert!(up.sh_of(1)[12..].iter().all(|&v| v == 0.0));
        assert_eq!(up.with_sh_degree(1), two());
    }

    #[test]
    fn invalid_rows_are_found() {
        let mut g = two();
        assert!(g.invalid_rows().is_empty());
        g.rotations[0] = [0.0; 4];
        g.opacity_logits[1] = f32::INFINITY;
        assert_eq!(g.invalid_rows(), [0]);
        g.means[1][2] = f32::NAN;
        assert_eq!(g.invalid_rows(), [0, 1]);
    }
}
