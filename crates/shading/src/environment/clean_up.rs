//! Values that no light has, and what becomes of them.

/// What a map's values were before they were used.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct CleanUp {
    /// Values below 0 (ringing of filters, out-of-gamut colors): taken as 0.
    pub negative: usize,
    /// NaN: taken as 0.
    pub nan: usize,
    /// Infinite (a sun past the range of half floats): taken as the largest finite value of the
    /// map, but at least 65504, the largest half float.
    pub infinite: usize,
}

impl CleanUp {
    /// Whether anything was changed.
    pub fn any(&self) -> bool {
        *self != Self::default()
    }

    /// Repairs `values` in place and counts.
    pub(super) fn run(values: &mut [f32]) -> Self {
        let mut counts = Self::default();
        let largest = values.iter().copied().filter(|v| v.is_finite()).fold(65504.0, f32::max);
        for v in values {
            if v.is_nan() {
                counts.nan += 1;
                *v = 0.0;
            } else if *v < 0.0 {
                counts.negative += 1;
                *v = 0.0;
            } else if v.is_infinite() {
                counts.infinite += 1;
                *v = largest;
            }
        }
        counts
    }
}
