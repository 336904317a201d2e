//! Terms of the image loss beside the fused default, chosen by `--loss-term NAME=WEIGHT`: a file each, and the list.

mod edge;
mod huber;
mod term;

use std::fmt;
use std::str::FromStr;

use motes_formats::named_weight::parse_named_weight;
use motes_raster::Planes;
use serde::{Deserialize, Serialize};

use super::{ColorTransform, LossValue};
use crate::target::Target;
pub use term::{LossTerm, Picture};

/// Every term.
pub static LOSS_TERMS: &[&dyn LossTerm] = &[&edge::Edge, &huber::Huber];

/// A term and its weight, as text `NAME=WEIGHT`.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "String", into = "String")]
pub struct WeightedTerm {
    /// Index in [`LOSS_TERMS`].
    term: usize,
    weight: f32,
}

impl WeightedTerm {
    /// The help of `--loss-term`.
    pub fn help() -> String {
        let terms = LOSS_TERMS.iter().map(|term| format!("{} ({})", term.name(), term.about()));
        let terms: Vec<String> = terms.collect();
        format!(
            "Term of the image loss beside the absolute difference and SSIM; repeatable: {}",
            terms.join(", ")
        )
    }

    /// The term.
    pub fn term(&self) -> &'static dyn LossTerm {
        LOSS_TERMS[self.term]
    }
}

impl FromStr for WeightedTerm {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let (term, weight) = parse_named_weight(text, "edge=0.1", |name| {
            LOSS_TERMS.iter().position(|term| term.name() == name).ok_or_else(|| {
                let names: Vec<&str> = LOSS_TERMS.iter().map(|term| term.name()).collect();
                format!("no term of the loss is called {name}; there are {}", names.join(", "))
            })
        })?;
        Ok(Self { term, weight })
    }
}

impl TryFrom<String> for WeightedTerm {
    type Error = String;

    fn try_from(text: String) -> Result<Self, String> {
        text.parse()
    }
}

impl fmt::Display for WeightedTerm {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}={}", self.term().name(), self.weight)
    }
}

impl From<WeightedTerm> for String {
    fn from(term: WeightedTerm) -> Self {
        term.to_string()
    }
}

/// Adds the terms to the value of the loss, and their gradients by the color of `render` to `gradient`: after
/// [`super::PhotometricLoss::evaluate`], with the same arguments.
pub(crate) fn add_terms(
    terms: &[WeightedTerm],
    render: &Planes,
    target: &Target,
    background: [f32; 3],
    transform: ColorTransform,
    value: &mut LossValue,
    gradient: &mut Planes,
) {
    if terms.is_empty() {
        return;
    }
    let picture = Picture::new(render, target, background, transform);
    let pixels = picture.width * picture.height;
    let mut by_rendering: [Vec<f32>; 3] = std::array::from_fn(|_| vec![0.0; pixels]);
    for term in terms {
        let own = term.term().evaluate(&picture, term.weight, &mut by_rendering);
        value.loss += f64::from(term.weight) * own;
    }
    for (c, by_rendering) in by_rendering.iter().enumerate() {
        for y in 0..picture.height {
            let row = gradient.row_mut(c, y);
            for (x, (g, raw)) in row.iter_mut().zip(render.row(c, y)).enumerate() {
                let i = y * picture.width + x;
                if picture.counts(i) {
                    *g += transform.gain[c] * by_rendering[i];
                    value.d_gain[c] += f64::from(by_rendering[i] * raw);
                    value.d_offset[c] += f64::from(by_rendering[i]);
                }
            }
        }
    }
}

#[cfg(test)]
mod tests;
