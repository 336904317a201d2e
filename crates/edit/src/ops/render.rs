//! A picture of the state.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::operation::{Flag, Operation, Short};
use crate::EditState;
use crate::run::{
    EditError, Fault, Outcome, Preview, Run, applied, extent_of, finite, orbit_camera, picture,
    range, rows_of, whole_extent,
};

/// Write a picture of how it looks now, into the folder of thumbnails.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct RenderOp {
    /// Name of the picture, a PNG.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub file: Option<String>,
    /// A view of the capture. Default: from the side, see `azimuth_deg`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub view: Option<String>,
    /// What the camera looks at when there is no `view`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub target: Option<String>,
    /// Where the camera stands around the target, degrees about up.
    #[serde(default)]
    pub azimuth_deg: f64,
    /// How high it stands, degrees above the horizon, -89 to 89.
    #[serde(default = "thirty")]
    #[schemars(range(min = -89.0, max = 89.0))]
    pub elevation_deg: f64,
    /// Longer side, pixels.
    #[serde(default = "preview_side")]
    #[schemars(range(min = 16, max = 8192))]
    pub size: u32,
}

impl Operation for RenderOp {
    const FLAGS: &'static [Flag] = &[Flag::of(
        "preview",
        Short::Text("file"),
        "NAME.png",
        "Render an image into the folder of --thumbnails",
    )
    .or_alone()];

    fn check(&self) -> Result<(), Fault> {
        finite("/azimuth_deg", &[self.azimuth_deg])?;
        range("/elevation_deg", self.elevation_deg, -89.0, 89.0)?;
        range("/size", f64::from(self.size), 16.0, 8192.0)
    }

    fn refers_to(&self) -> Option<(&'static str, &str)> {
        self.target.as_deref().map(|target| ("target", target))
    }

    fn apply(
        &self,
        run: &mut Run<'_>,
        state: &mut EditState,
        at: &str,
    ) -> Result<Outcome, EditError> {
        let size = self.size as usize;
        let camera = match (&self.view, run.resources.capture) {
            (Some(_), None) => {
                let cause = "a view of a capture needs a capture";
                return Err(EditError::plan(format!("{at}/view"), cause).remedy("give --capture"));
            }
            (Some(name), Some((capture, _))) => {
                let (full, pose) = run.camera_of(capture, name, &format!("{at}/view"))?;
                let factor = size as f64 / full.width.max(full.height) as f64;
                let side = |n: usize| ((n as f64 * factor).round() as usize).max(1);
                (full.resized(side(full.width), side(full.height)), pose)
            }
            (None, _) => {
                let extent = match (&self.target, &state.current) {
                    (None, None) => whole_extent(&state.gaussians, state.up_in_world),
                    (target, _) => {
                        let rows = rows_of(state, target.as_deref(), at)?;
                        Some(extent_of(state, &rows, at)?)
                    }
                };
                extent
                    .and_then(|e| orbit_camera(&e, self.azimuth_deg, self.elevation_deg, size))
                    .ok_or_else(|| EditError::plan(at, "there is nothing to look at"))?
            }
        };
        let image = picture(state, run.resources.antialias, &camera.0, &camera.1);
        let number = run.previews.len();
        let file = self.file.clone().unwrap_or_else(|| format!("preview-{number:03}.png"));
        let plain = !file.contains(['/', '\\']) && file.to_ascii_lowercase().ends_with(".png");
        if !plain || run.previews.iter().any(|p| p.file == file) {
            let cause = format!("\"{file}\" is not the name of a new PNG file without folders");
            return Err(EditError::plan(format!("{at}/file"), cause));
        }
        run.previews.push(Preview { file, image });
        applied(state.len())
    }
}

fn thirty() -> f64 {
    30.0
}

fn preview_side() -> u32 {
    480
}
