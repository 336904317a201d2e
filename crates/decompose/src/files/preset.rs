//! Points on the measured front of time against quality: docs/benchmarks/decompose.md.

use clap::ValueEnum;
use motes_stage as stage;
use serde::{Deserialize, Serialize};

/// A point on the measured front of time against quality.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub(super) enum Preset {
    /// A first look: fewer samples, rounds and rays
    Draft,
    /// The default
    #[default]
    Balanced,
    /// More rays and a longer fit to the photos
    High,
}

/// What the presets set; `balanced` is the defaults of the flags.
pub(super) const PRESETS: &[stage::Preset] = &[
    (
        "draft",
        &[
            ("samples", "4000"),
            ("material-rays", "64"),
            ("pixel-rays", "32"),
            ("shape-from-shading-rounds", "1"),
            ("reflected-light-rounds", "0"),
            ("photo-steps", "200"),
            ("residual-steps", "120"),
        ],
    ),
    ("high", &[("material-rays", "256"), ("pixel-rays", "96"), ("photo-steps", "1200")]),
];

#[cfg(test)]
mod tests {
    use clap::CommandFactory as _;

    use super::*;
    use crate::files::Args;

    #[test]
    fn presets_name_flags_that_exist_and_values_that_parse() {
        for (name, flags) in PRESETS {
            assert!(
                Preset::value_variants().iter().any(|p| {
                    p.to_possible_value().is_some_and(|value| value.get_name() == *name)
                })
            );
            let words = flags.iter().map(|(flag, value)| format!("--{flag}={value}"));
            let line = ["decompose", "--capture=a", "--gaussians=b", "-oc"].map(String::from);
            let line = line.into_iter().chain(words);
            assert!(Args::command().try_get_matches_from(line).is_ok(), "{name}");
        }
    }
}
