//! Choosing among n things in proportion to weights, in constant time.
//!
//! Walker 1977, built in linear time by Vose's method (1991).

/// A discrete distribution.
#[derive(Clone, Debug)]
pub(crate) struct AliasTable {
    /// Keep the column below this fraction of it (of 2³²), else take the alias.
    columns: Vec<(u32, u32)>,
}

impl AliasTable {
    /// Of weights that are finite and not negative; `None` when they add up to 0.
    pub(crate) fn new(weights: &[f32]) -> Option<Self> {
        let n = weights.len();
        assert!(u32::try_from(n).is_ok(), "{n} weights");
        let total: f64 = weights.iter().map(|&w| f64::from(w)).sum();
        if !(total > 0.0) {
            return None;
        }
        let scale = n as f64 / total;
        // f64 rests: a pixel of 1e6 among millions gives thousands of columns away.
        let mut rest: Vec<f64> = weights.iter().map(|&w| f64::from(w) * scale).collect();
        let (mut small, mut large): (Vec<u32>, Vec<u32>) =
            (0..n as u32).partition(|&i| rest[i as usize] < 1.0);
        let mut columns: Vec<(u32, u32)> = (0..n as u32).map(|i| (u32::MAX, i)).collect();
        while let (Some(&s), Some(&l)) = (small.last(), large.last()) {
            small.pop();
            let keep = rest[s as usize];
            columns[s as usize] = ((keep * 4_294_967_295.0) as u32, l);
            rest[l as usize] -= 1.0 - keep;
            if rest[l as usize] < 1.0 {
                large.pop();
                small.push(l);
            }
        }
        // What rounding left over keeps its own column; but nothing keeps that has no weight.
        let heaviest = (0..n).max_by(|&a, &b| weights[a].total_cmp(&weights[b])).unwrap_or(0);
        for i in small {
            if weights[i as usize] == 0.0 {
                columns[i as usize] = (0, heaviest as u32);
            }
        }
        Some(Self { columns })
    }

    /// The item at `u / 2³²` of the distribution.
    #[inline]
    pub(crate) fn pick(&self, u: u32) -> usize {
        let wide = u64::from(u) * self.columns.len() as u64;
        let (column, within) = ((wide >> 32) as usize, wide as u32);
        let (keep, alias) = self.columns[column];
        if within < keep { column } else { alias as usize }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shares_are_exact() {
        let weights = [0.0, 3.0, 1.0, 0.5, 0.0, 1e6, 2.5];
        let table = AliasTable::new(&weights).unwrap();
        let mut mass = [0.0; 7];
        for (i, &(keep, alias)) in table.columns.iter().enumerate() {
            let keep = f64::from(keep) / 4_294_967_296.0;
            mass[i] += keep / 7.0;
            mass[alias as usize] += (1.0 - keep) / 7.0;
        }
        let total: f64 = weights.iter().map(|&w| f64::from(w)).sum();
        for (m, w) in mass.iter().zip(weights) {
            assert!((m - f64::from(w) / total).abs() < 1e-8, "{m} {w}");
        }
    }

    #[test]
    fn what_weighs_nothing_is_never_picked() {
        let table = AliasTable::new(&[0.0, 1.0, 0.0, 2.0]).unwrap();
        for i in 0..100_000u32 {
            let item = table.pick(i.wrapping_mul(42_949));
            assert!(item == 1 || item == 3);
        }
        assert!(AliasTable::new(&[0.0; 4]).is_none() && AliasTable::new(&[]).is_none());
    }
}
