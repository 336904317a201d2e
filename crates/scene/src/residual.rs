//! What the model of a decomposed scene leaves unexplained, as columns that travel with the Gaussians.

use motes_math::sh::{MAX_SH_DEGREE, sh_coefficients};

use crate::{ColumnValues, ExtraColumn, Gaussians};

/// Residual of `N` Gaussians: the logarithm of the photos over the model under the scene's own light.
///
/// | field | shape | value |
/// |---|---|---|
/// | `degree` | | of the spherical harmonics, 0 to 4; `K = (degree + 1)^2` |
/// | `log_ratio_sh` | `[N, K, 3]` | coefficient-major, RGB fastest; log ratio = SH(direction), natural, blended like a color |
///
/// Columns of the file: `residual_0 .. residual_(3K-1)`, in that order.
#[derive(Clone, Debug, Default, PartialEq)]
#[expect(missing_docs, reason = "the table above")]
pub struct Residual {
    pub degree: u8,
    pub log_ratio_sh: Vec<f32>,
}

/// Log ratios beyond this are cut off: a factor of 4.
pub const LARGEST_LOG_RATIO: f32 = 2.0 * std::f32::consts::LN_2;

const PREFIX: &str = "residual_";

/// Place of a column among the columns of a residual.
fn place(name: &str) -> Option<usize> {
    let digits = name.strip_prefix(PREFIX)?;
    let place: usize = digits.parse().ok()?;
    (place.to_string() == digits).then_some(place)
}

impl Residual {
    /// Whether a column of this name belongs to a residual.
    pub fn is_column(name: &str) -> bool {
        place(name).is_some()
    }

    /// Puts the columns on `gaussians`, in the places of older ones.
    ///
    /// # Panics
    /// When the number of values is not that of the Gaussians.
    pub fn attach(&self, gaussians: &mut Gaussians) {
        let values = 3 * sh_coefficients(self.degree);
        assert_eq!(self.log_ratio_sh.len(), values * gaussians.len(), "one residual per Gaussian");
        gaussians.extra.retain(|column| place(&column.name).is_none_or(|k| k < values));
        for k in 0..values {
            let column = self.log_ratio_sh.iter().skip(k).step_by(values).copied().collect();
            let (name, values) = (format!("{PREFIX}{k}"), ColumnValues::F32(column));
            match gaussians.extra.iter_mut().find(|column| column.name == name) {
                Some(column) => column.values = values,
                None => gaussians.extra.push(ExtraColumn { name, values }),
            }
        }
    }

    /// The residual that `gaussians` carry; none without columns. Values that are not finite become 0.
    ///
    /// # Errors
    /// The name of the column that is missing or has another type.
    pub fn of(gaussians: &Gaussians) -> Result<Option<Self>, String> {
        let count = gaussians.extra.iter().filter(|c| place(&c.name).is_some()).count();
        if count == 0 {
            return Ok(None);
        }
        let mut columns = Vec::with_capacity(count);
        for k in 0..count {
            let name = format!("{PREFIX}{k}");
            match gaussians.extra.iter().find(|c| c.name == name).map(|c| &c.values) {
                Some(ColumnValues::F32(values)) => columns.push(values),
                _ => return Err(name),
            }
        }
        let degree = (0..=MAX_SH_DEGREE).find(|d| 3 * sh_coefficients(*d) >= count);
        let Some(degree) = degree.filter(|d| 3 * sh_coefficients(*d) == count) else {
            return Err(format!("{PREFIX}{count}"));
        };
        let finite = |v: f32| if v.is_finite() { v } else { 0.0 };
        let log_ratio_sh = (0..gaussians.len())
            .flat_map(|i| columns.iter().map(move |column| finite(column[i])))
            .collect();
        Ok(Some(Self { degree, log_ratio_sh }))
    }

    /// The values of the Gaussians of `rows` times a factor.
    pub fn scale(&mut self, rows: impl IntoIterator<Item = usize>, factor: f32) {
        let values = 3 * sh_coefficients(self.degree);
        for i in rows {
            self.log_ratio_sh[i * values..(i + 1) * values].iter_mut().for_each(|v| *v *= factor);
        }
    }

    /// Of a drawn color per log ratio.
    pub const fn drawn_share() -> f32 {
        0.5 / LARGEST_LOG_RATIO
    }

    /// The Gaussians with colors that stand for the residual: `0.5 + log ratio / (2 LARGEST_LOG_RATIO)`.
    pub fn drawn(&self, gaussians: &Gaussians) -> Gaussians {
        let share = Self::drawn_share();
        Gaussians {
            means: gaussians.means.clone(),
            rotations: gaussians.rotations.clone(),
            log_scales: gaussians.log_scales.clone(),
            opacity_logits: gaussians.opacity_logits.clone(),
            sh_degree: self.degree,
            sh: self.log_ratio_sh.iter().map(|v| v * share).collect(),
            extra: Vec::new(),
        }
    }

    /// The residual that such Gaussians stand for.
    pub fn from_drawn(drawn: &Gaussians) -> Self {
        let log_ratio_sh = drawn.sh.iter().map(|v| v * 2.0 * LARGEST_LOG_RATIO).collect();
        Self { degree: drawn.sh_degree, log_ratio_sh }
    }

    /// Log ratio of a pixel from the color that was drawn over black there, and its alpha: what is not covered has none.
    pub fn log_ratio(drawn: f32, alpha: f32) -> f32 {
        let log_ratio = 2.0 * LARGEST_LOG_RATIO * (drawn - 0.5 * alpha);
        // `max` first: it turns NaN into a number.
        log_ratio.max(-LARGEST_LOG_RATIO).clamp(-LARGEST_LOG_RATIO, LARGEST_LOG_RATIO)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn some() -> (Gaussians, Residual) {
        let gaussians = Gaussians {
            means: vec![[0.0; 3]; 2],
            rotations: vec![[1.0, 0.0, 0.0, 0.0]; 2],
            log_scales: vec![[0.0; 3]; 2],
            opacity_logits: vec![0.0; 2],
            sh_degree: 0,
            sh: vec![0.0; 6],
            extra: vec![ExtraColumn {
                name: "residual_of_mine".into(),
                values: ColumnValues::U8(vec![1, 2]),
            }],
        };
        let log_ratio_sh = (0..24).map(|v| v as f32 * 0.125).collect();
        (gaussians, Residual { degree: 1, log_ratio_sh })
    }

    #[test]
    fn columns_come_back_and_replace_older_ones() {
        let (mut gaussians, residual) = some();
        assert_eq!(Residual::of(&gaussians), Ok(None), "a column of another name");
        residual.attach(&mut gaussians);
        residual.attach(&mut gaussians);
        assert_eq!(gaussians.extra.len(), 1 + 12);
        assert_eq!(gaussians.extra[2].values, ColumnValues::F32(vec![0.125, 1.625]));
        assert_eq!(Residual::of(&gaussians), Ok(Some(residual.clone())));
        gaussians.extra.retain(|c| c.name != "residual_4");
        assert_eq!(Residual::of(&gaussians), Err("residual_4".into()));
        gaussians.extra.retain(|c| c.name.len() < 11);
        assert_eq!(Residual::of(&gaussians), Err("residual_4".into()));
        gaussians.extra.retain(|c| ["residual_0", "residual_1"].contains(&c.name.as_str()));
        assert_eq!(Residual::of(&gaussians), Err("residual_2".into()), "no degree has two columns");
        residual.attach(&mut gaussians);
        assert_eq!(Residual::of(&gaussians), Ok(Some(residual)));
    }

    #[test]
    fn what_is_drawn_is_what_was_stored() {
        let (gaussians, residual) = some();
        let drawn = residual.drawn(&gaussians);
        for (a, b) in Residual::from_drawn(&drawn).log_ratio_sh.iter().zip(&residual.log_ratio_sh) {
            assert!((a - b).abs() < 1e-6);
        }
        assert_eq!(Residual::log_ratio(0.5, 1.0), 0.0);
        assert_eq!(Residual::log_ratio(0.0, 0.0), 0.0, "nothing is covered");
        assert_eq!(Residual::log_ratio(9.0, 1.0), LARGEST_LOG_RATIO);
        assert!(Residual::log_ratio(f32::NAN, 1.0).is_finite());
        let mut half = residual.clone();
        half.scale([1], 0.5);
        assert_eq!(half.log_ratio_sh[..12], residual.log_ratio_sh[..12]);
        assert_eq!(half.log_ratio_sh[13], 0.5 * residual.log_ratio_sh[13]);
    }
}
