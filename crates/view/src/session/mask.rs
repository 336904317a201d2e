//! A selection as the page reads it.

use motes_scene::Selection;

use super::shown::{NO_ROW, Shown};
use super::{Inner, Session};

/// A bit per packed Gaussian, the first one in the lowest bit of the first byte.
pub fn bits(shown: &Shown, selection: &Selection) -> Vec<u8> {
    let mut bits = vec![0u8; shown.rows.len().div_ceil(8)];
    let belongs = |row: u32| {
        row != NO_ROW && selection.confidence.get(row as usize).is_some_and(|c| *c >= 0.5)
    };
    for (i, &row) in shown.rows.iter().enumerate() {
        bits[i / 8] |= u8::from(belongs(row)) << (i % 8);
    }
    bits
}

impl Inner {
    /// What is selected of what is drawn; none while what is drawn is older than the selection.
    pub(crate) fn mask(&self) -> Option<Vec<u8>> {
        let (selection, _) = self.selection()?;
        let fits = selection.len() == self.history.state().len();
        (fits && self.shown.revision == self.revision).then(|| bits(&self.shown, selection))
    }
}

impl Session<'_> {
    /// What is selected of what is drawn with this number.
    pub fn mask(&self, id: u64) -> Option<Vec<u8>> {
        let inner = self.lock();
        inner.mask().filter(|_| inner.shown.id == id)
    }
}
