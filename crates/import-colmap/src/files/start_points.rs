//! The points of a capture: those of its source, or triangulated where it has none.

use std::path::Path;

use glam::DVec3;
use motes_scene::{Capture, SparsePoints, Split, Switch, UnitWorld};

use crate::error::{IngestError, Result};
use crate::files::sfm::{self, SfmOptions};
use crate::gathered::{Gathered, Point};
use crate::options::ImportOptions;
use crate::progress::Progress;

pub(crate) fn start_points(
    gathered: &Gathered,
    splits: &[Option<Split>],
    options: &ImportOptions,
    origin: DVec3,
    unit: &UnitWorld,
) -> (SparsePoints, usize) {
    let seen_in_training = |point: &&Point| {
        let training = point.track.iter().filter(|&&photo| splits[photo] == Some(Split::Train));
        !options.points_from_train || training.count() >= 2
    };
    let (mut points, mut too_far) = (SparsePoints::default(), 0);
    for point in gathered.points.iter().filter(seen_in_training) {
        // On the grid of the fit while all digits are there: after single precision, points of
        // the same scene in another unit would not snap to the same places.
        let position = unit.point_in_world(unit.point(point.position));
        let position = (position - origin).as_vec3();
        if position.is_finite() {
            points.positions.push(position.to_array());
            points.colors.push(point.color);
        } else {
            too_far += 1;
        }
    }
    (points, too_far)
}

/// Triangulates start points for a capture that has none, as far as the options say.
pub(crate) fn find_points(
    capture: &mut Capture,
    output: &Path,
    options: &ImportOptions,
    sfm_options: &SfmOptions,
    gathered: &mut Gathered,
    progress: &dyn Progress,
) -> Result<()> {
    const WITHOUT: &str = "there are no start points: train-splat finds its own in the photos";
    if sfm_options.triangulate == Switch::Off {
        gathered.notes.push(WITHOUT.into());
        return Ok(());
    }
    let (folder, train_only) = (output.join("images"), options.points_from_train);
    let found = sfm::triangulate(capture, &folder, train_only, sfm_options, progress);
    match (found, sfm_options.triangulate) {
        (Ok(Some(found)), _) => {
            capture.points = found.points;
            gathered.notes.push(found.note);
        }
        (Ok(None), Switch::On) => {
            return Err(IngestError::Failed {
                cause: "--triangulate on: no Python with pycolmap was found".into(),
                remedy: "make setup installs it; or name one with --python".into(),
            });
        }
        (Ok(None), _) => gathered.notes.push(format!(
            "{WITHOUT} (with pycolmap, which make setup installs, they are triangulated here)"
        )),
        (Err(IngestError::Interrupted), _) => return Err(IngestError::Interrupted),
        (Err(error), Switch::On) => return Err(error),
        (Err(error), _) => {
            gathered
                .warnings
                .push(format!("no start points were triangulated ({error}); {WITHOUT}"));
        }
    }
    Ok(())
}
