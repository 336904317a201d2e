//! What an estimate came to.

use std::fmt;
use std::path::PathBuf;

use motes_protocol::ProviderUse;
use serde::Serialize;

use crate::Summary;
use crate::mirror_ball::Outline;
use crate::place::PlaceReport;

/// What an estimate came to.
#[derive(Clone, Debug, Serialize)]
pub struct Report {
    /// The map.
    pub output: PathBuf,
    /// What it was estimated from: `scene`, `place`, `brackets`, `mirror-ball`, `provider`.
    pub source: &'static str,
    /// Rows; columns are twice as many.
    pub rows: usize,
    /// Axes of the map.
    pub convention: motes_scene::Convention,
    /// Unit vector, world: what the first row shows.
    pub zenith_in_world: [f64; 3],
    /// Share of the sphere that was seen.
    pub coverage: f64,
    /// Share of the sphere that is as bright as the pictures can be.
    pub clipped_share: f64,
    /// By how much that was found to be brighter; 1 without evidence.
    pub clipped_factor: f64,
    /// What the map holds.
    #[serde(flatten)]
    pub summary: Summary,
    /// Where a splat or a scene was looked at.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub at: Option<[f64; 3]>,
    /// What shading told.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub place: Option<PlaceReport>,
    /// The series.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub brackets: Option<BracketReport>,
    /// The outline of the ball.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub ball: Option<BallReport>,
    /// Who answered.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub provider: Option<ProviderUse>,
}

/// An exposure series.
#[derive(Clone, Debug, Serialize)]
pub struct BracketReport {
    /// Name and exposure (log2 of seconds, over square of f-number, at ISO 100) of each picture.
    pub pictures: Vec<(String, f64)>,
    /// The picture whose unit the values have.
    pub reference: String,
    /// `linear` or `found`.
    pub response: &'static str,
    /// Share of the pixels of the other pictures that moved.
    pub ghosts: f64,
}

/// A ball.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct BallReport {
    /// Center, pixels.
    pub center: [f64; 2],
    /// Radius, pixels.
    pub radius: f64,
    /// Whether it was found in the picture.
    pub found: bool,
}

impl BallReport {
    pub(super) fn of(outline: &Outline, found: bool) -> Self {
        Self { center: outline.center, radius: outline.radius, found }
    }
}

impl fmt::Display for Report {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let percent = |share: f64| 100.0 * share;
        writeln!(
            f,
            "{}x{} map from {}: {:.0} % of the sphere seen, {:.2} % clipped, factor {:.1}",
            2 * self.rows,
            self.rows,
            self.source,
            percent(self.coverage),
            percent(self.clipped_share),
            self.clipped_factor
        )?;
        if let Some(ball) = &self.ball {
            let [x, y] = ball.center;
            writeln!(f, "ball: center {x:.1}, {y:.1}, radius {:.1} px", ball.radius)?;
        }
        if let Some(series) = &self.brackets {
            let (n, reference) = (series.pictures.len(), &series.reference);
            let ghosts = percent(series.ghosts);
            writeln!(f, "{n} exposures, in units of {reference}; {ghosts:.1} % moved")?;
        }
        if let Some(PlaceReport { shading_error: Some([before, after]), evidence_points, .. }) =
            &self.place
        {
            writeln!(
                f,
                "{evidence_points} points of surfaces: shading explained within {:.0} % by what is seen, {:.0} % with lights found",
                percent(*before),
                percent(*after)
            )?;
        }
        let [x, y, z] = self.summary.dominant_direction;
        writeln!(
            f,
            "light mostly from {x:.2}, {y:.2}, {z:.2} (directionality {:.2}): {}",
            self.summary.directionality,
            self.output.display()
        )
    }
}
