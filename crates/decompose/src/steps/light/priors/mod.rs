//! Priors of the light: a file each, and the list.

mod clear_sky;
mod even_light;
mod expected_sky;
mod light_from_above;
mod prior;
mod smooth_light;
mod typical_base_color;
mod white_light;

use std::fmt;
use std::str::FromStr;

use motes_formats::named_weight::parse_named_weight;
use serde::{Deserialize, Serialize};

pub(super) use prior::Sources;
pub use prior::{CellSum, LightPrior, Lighting, PointSum, Slopes};

/// Every prior, in the order in which they are summed.
pub static LIGHT_PRIORS: &[&dyn LightPrior] = &[
    &typical_base_color::TypicalBaseColor,
    &smooth_light::SmoothLight,
    &white_light::WhiteLight,
    &even_light::EvenLight,
    &light_from_above::LightFromAbove,
    &clear_sky::ClearSky,
    &expected_sky::ExpectedSky,
];

/// A prior without a flag of its own and its weight, as text `NAME=WEIGHT`.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "String", into = "String")]
pub struct WeightedPrior {
    /// Index in [`LIGHT_PRIORS`].
    prior: usize,
    weight: f32,
}

impl WeightedPrior {
    /// The help of `--light-prior`.
    pub fn help() -> String {
        let others = LIGHT_PRIORS.iter().filter(|prior| prior.flag().is_none());
        let others: Vec<String> =
            others.map(|prior| format!("{} ({})", prior.name(), prior.about())).collect();
        format!("Prior of the light beside those with a flag; repeatable: {}", others.join(", "))
    }

    /// The prior.
    pub fn prior(&self) -> &'static dyn LightPrior {
        LIGHT_PRIORS[self.prior]
    }

    /// Its weight.
    pub fn weight(&self) -> f32 {
        self.weight
    }
}

impl FromStr for WeightedPrior {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let (prior, weight) = parse_named_weight(text, "even-light=0.1", |name| {
            let prior = LIGHT_PRIORS.iter().position(|prior| prior.name() == name);
            let prior = prior.ok_or_else(|| {
                let names: Vec<&str> = LIGHT_PRIORS.iter().map(|prior| prior.name()).collect();
                format!("no prior of the light is called {name}; there are {}", names.join(", "))
            })?;
            match LIGHT_PRIORS[prior].flag() {
                Some(flag) => Err(format!("the prior {name} has a flag of its own: {flag}")),
                None => Ok(prior),
            }
        })?;
        Ok(Self { prior, weight })
    }
}

impl TryFrom<String> for WeightedPrior {
    type Error = String;

    fn try_from(text: String) -> Result<Self, String> {
        text.parse()
    }
}

impl fmt::Display for WeightedPrior {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}={}", self.prior().name(), self.weight)
    }
}

impl From<WeightedPrior> for String {
    fn from(prior: WeightedPrior) -> Self {
        prior.to_string()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn priors_are_read_from_text() {
        let prior: WeightedPrior = "even-light=0.25".parse().unwrap();
        assert_eq!(
            (prior.prior().name(), prior.to_string()),
            ("even-light", "even-light=0.25".into())
        );
        let text = serde_json::to_string(&prior).unwrap();
        assert_eq!(serde_json::from_str::<WeightedPrior>(&text).unwrap(), prior);
        for (text, says) in [
            ("even-light", "NAME=WEIGHT"),
            ("red-light=1", "there are typical-base-color"),
            ("white-light=1", "--weight-white-light"),
            ("even-light=NaN", "is not a number"),
            ("even-light=-1", "is not a number"),
        ] {
            let error = text.parse::<WeightedPrior>().unwrap_err();
            assert!(error.contains(says), "{text}: {error}");
        }
    }

    #[test]
    fn the_manual_lists_every_prior() {
        let page = concat!(env!("CARGO_MANIFEST_DIR"), "/../../docs/stages/decompose.md");
        let page = std::fs::read_to_string(page).unwrap();
        for prior in LIGHT_PRIORS {
            let flag = prior.flag().map_or_else(
                || format!("| `--light-prior {}=W` | {} |", prior.name(), prior.about()),
                |flag| format!("| `{flag}` |"),
            );
            assert!(page.contains(&flag), "docs/stages/decompose.md lacks {flag}");
        }
    }
}
