//! What the page draws: Gaussians after light followed, packed.

use std::collections::HashMap;

use edit::{EditState, Origin};
use export::html::pack::{PackOptions, Packed, pack_at};
use motes_scene::Gaussians;
use serde::Serialize;

/// Pages on the same machine need no small blocks.
const LEVEL: u32 = 1;
/// Bits of a coefficient above degree 0.
const SH_BITS: u8 = 8;
/// Of a row that the state has not.
pub(crate) const NO_ROW: u32 = u32::MAX;

/// How well light followed.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Quality {
    /// With few samples.
    Preview,
    /// As `edit` computes it.
    Standard,
}

/// Gaussians that the page draws.
pub struct Shown {
    /// Grows with every one.
    pub id: u64,
    /// Of which revision.
    pub revision: u64,
    /// How well light followed.
    pub quality: Quality,
    /// The Gaussians, which `edit` writes when the quality is standard.
    pub gaussians: Gaussians,
    /// As the page reads them.
    pub packed: Packed,
    /// The row of the state of each packed Gaussian, [`NO_ROW`] for what only fills.
    pub(crate) rows: Vec<u32>,
    /// What light could not do.
    pub warnings: Vec<String>,
    /// Seconds that light took.
    pub seconds: f64,
}

impl Shown {
    /// Of a state, and of what became of it when light followed.
    pub(crate) fn new(
        state: &EditState,
        lit: &EditState,
        quality: Quality,
        revision: u64,
        id: u64,
    ) -> Self {
        let packed = pack_at(&lit.gaussians, &PackOptions { html_sh_bits: SH_BITS }, LEVEL);
        let rows = rows_of(state, lit, &packed.rows);
        let (warnings, seconds) = (Vec::new(), 0.0);
        let gaussians = lit.gaussians.clone();
        Self { id, revision, quality, gaussians, packed, rows, warnings, seconds }
    }
}

/// Rows of `state` that packed rows of `lit` were. Light keeps the history of rows, fills holes and removes what was hidden.
fn rows_of(state: &EditState, lit: &EditState, packed: &[u32]) -> Vec<u32> {
    if state.origins == lit.origins {
        return packed.to_vec();
    }
    let is_known = |origin: &Origin| origin.row != Origin::NEW_ROW;
    let known = state.origins.iter().enumerate().filter(|(_, origin)| is_known(origin));
    let rows: HashMap<Origin, u32> = known.map(|(row, origin)| (*origin, row as u32)).collect();
    let of = |row: &u32| {
        let origin = &lit.origins[*row as usize];
        is_known(origin).then(|| rows.get(origin).copied()).flatten().unwrap_or(NO_ROW)
    };
    packed.iter().map(of).collect()
}
