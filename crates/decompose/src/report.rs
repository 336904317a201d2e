//! What a step tells about a term of the model.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

/// A term of the image formation: whether the model has it, and why.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Term {
    /// Name, such as `specular`.
    pub name: String,
    /// Whether it is part of the result.
    pub kept: bool,
    /// Why, in a sentence.
    pub evidence: String,
    /// What was measured, by name; none where there is no number.
    pub numbers: BTreeMap<String, Option<f64>>,
}

/// Numbers by name; those that are not finite become none.
pub(crate) fn numbers<const N: usize>(
    pairs: [(&str, Option<f64>); N],
) -> BTreeMap<String, Option<f64>> {
    pairs.into_iter().map(|(k, v)| (k.to_owned(), v.filter(|v| v.is_finite()))).collect()
}
