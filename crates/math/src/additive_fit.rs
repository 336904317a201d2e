//! A table of numbers as a row's effect plus a column's: `value_rc = row_r + column_c`, robustly.

/// Share of the bound of residuals below which a row has not moved.
const SETTLED: f64 = 1e-4;

/// One entry of a table that may be sparse.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Entry {
    /// Index of the row.
    pub row: u32,
    /// Index of the column.
    pub column: u32,
    /// Its value.
    pub value: f64,
}

/// The effects of rows and columns; both up to one constant that moves between the two.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct AdditiveFit {
    /// Per row; 0 where there is no entry.
    pub rows: Vec<f64>,
    /// Per column; 0 where there is no entry.
    pub columns: Vec<f64>,
}

impl AdditiveFit {
    /// What minimizes the sum of Huber losses of `value - row - column`, whose residuals beyond `huber` count linearly: what
    /// contradicts the others, as a shadow or a highlight does, pulls little.
    ///
    /// Rows and columns take turns. Each turn is a mean with the weights of iteratively reweighted least squares, so the sum never
    /// rises, and since it is convex and smooth the turns end at its least. `center` is called for the rows after each of their turns,
    /// to settle the constant. Ends after `rounds`, or once no row moves any more.
    pub fn solve(
        entries: &[Entry],
        [rows, columns]: [usize; 2],
        huber: f64,
        rounds: usize,
        mut center: impl FnMut(&mut [f64]),
    ) -> Self {
        let mut fit = Self { rows: vec![0.0; rows], columns: vec![0.0; columns] };
        // Plain means to start from.
        turn(&mut fit.columns, entries, f64::INFINITY, |e| (e.column, e.value));
        for _ in 0..rounds {
            let at = |e: &Entry| (e.row, e.value - fit.columns[e.column as usize]);
            let before = fit.rows.clone();
            turn(&mut fit.rows, entries, huber, at);
            center(&mut fit.rows);
            let at = |e: &Entry| (e.column, e.value - fit.rows[e.row as usize]);
            turn(&mut fit.columns, entries, huber, at);
            let moved = fit.rows.iter().zip(&before).map(|(a, b)| (a - b).abs());
            if moved.fold(0.0, f64::max) < SETTLED * huber {
                break;
            }
        }
        fit
    }
}

/// Weighted means of what is left for each effect.
fn turn(effects: &mut [f64], entries: &[Entry], huber: f64, of: impl Fn(&Entry) -> (u32, f64)) {
    let (mut sums, mut weights) = (vec![0.0; effects.len()], vec![0.0; effects.len()]);
    for entry in entries {
        let (i, value) = of(entry);
        let i = i as usize;
        let weight =
            if huber.is_finite() { huber / (value - effects[i]).abs().max(huber) } else { 1.0 };
        sums[i] += weight * value;
        weights[i] += weight;
    }
    for ((effect, sum), weight) in effects.iter_mut().zip(sums).zip(weights) {
        if weight > 0.0 {
            *effect = sum / weight;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// 12 rows, 400 columns, two of three entries, noise of a few hundredths, one of nine far off.
    fn table(rows: &[f64]) -> Vec<Entry> {
        let mut entries = Vec::new();
        for column in 0..400u32 {
            for (row, effect) in rows.iter().enumerate() {
                let k = column as usize * 31 + row * 17;
                if k.is_multiple_of(3) {
                    continue;
                }
                let noise = 0.03 * (k as f64 * 1.7).sin() + if k % 9 == 1 { 1.5 } else { 0.0 };
                let value = effect + f64::from(column % 50) * 0.05 + noise;
                entries.push(Entry { row: row as u32, column, value });
            }
        }
        entries
    }

    fn centered(rows: &mut [f64]) {
        let mean = rows.iter().sum::<f64>() / rows.len() as f64;
        rows.iter_mut().for_each(|r| *r -= mean);
    }

    #[test]
    fn effects_are_found_through_noise_and_outliers() {
        let mut rows: Vec<f64> = (0..12).map(|r| 0.3 * f64::from(r * r).cos()).collect();
        centered(&mut rows);
        let fit = AdditiveFit::solve(&table(&rows), [12, 400], 0.05, 200, centered);
        for (found, truth) in fit.rows.iter().zip(&rows) {
            assert!((found - truth).abs() < 0.01, "{found} for {truth}");
        }
    }

    #[test]
    fn nothing_is_no_trouble() {
        let fit = AdditiveFit::solve(&[], [2, 3], 0.05, 10, centered);
        assert_eq!(fit, AdditiveFit { rows: vec![0.0; 2], columns: vec![0.0; 3] });
    }
}
