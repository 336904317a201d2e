//! `statistics.json`: what the columns of Gaussians look like.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::documents::Document;

/// Statistics of the columns of a set of Gaussians, as they would be stored in a PLY.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[schemars(title = "motes statistics")]
pub struct StatisticsDocument {
    /// `motes/statistics`.
    pub format: String,
    /// `MAJOR.MINOR`.
    pub version: String,
    /// Number of Gaussians.
    pub gaussians: u64,
    /// Degree of their spherical harmonics.
    pub sh_degree: u8,
    /// Every column, in the order of a PLY.
    pub columns: Vec<ColumnStatistics>,
}

/// Statistics of one column; over its finite values, null when there are none.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct ColumnStatistics {
    /// Name of the PLY property.
    pub name: String,
    /// Least value.
    pub min: Option<f64>,
    /// Greatest value.
    pub max: Option<f64>,
    /// Middle value, the mean of the two middle ones of an even number.
    pub median: Option<f64>,
    /// Arithmetic mean.
    pub mean: Option<f64>,
    /// Standard deviation of the population.
    pub std_dev: Option<f64>,
    /// Values that are NaN.
    pub nan_count: u64,
    /// Values that are infinite.
    pub inf_count: u64,
}

impl Document for StatisticsDocument {
    const FORMAT: &'static str = "motes/statistics";
    const MAJOR: u32 = 1;
    const MINOR: u32 = 0;
}
