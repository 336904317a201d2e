//! What a plan works on: the Gaussians that are there now, and where each of them came from.
//!
//! Operations on rows go through [`EditState`], so that the history of every Gaussian stays complete: which [`Source`] and
//! row it came from, which motion brought it where it is, and whether its material was changed. What the light
//! must follow is read off that history by [`EditState::change`].

use std::collections::BTreeMap;
use std::sync::Arc;

use glam::DVec3;
use motes_math::tone_curve::ToneCurve;
use motes_scene::{Gaussians, ImageF32, Selection, Surface};
use motes_shading::brdf::Lobes;
use motes_shading::environment::MapAxes;

use crate::{Fill, Similarity};

/// Number of the source that the plan was started on.
pub const SCENE: u32 = 0;
/// Number of the motion that changes nothing.
pub const AT_REST: u32 = 0;

/// Where Gaussians come from: the edited scene itself (number [`SCENE`]), or something that was inserted.
#[derive(Clone, Debug, Default)]
pub struct Source {
    /// What the user called it: a file, a folder.
    pub name: String,
    /// Its Gaussians before any operation, in its own world. Kept where light has to follow the edit
    /// (decomposed scenes), `None` otherwise.
    pub gaussians: Option<Arc<Gaussians>>,
    /// Its surface before any operation, in its own world, when it has one.
    pub surface: Option<Arc<Surface>>,
}

/// Where one Gaussian comes from.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct Origin {
    /// Index into [`EditState::sources`].
    pub source: u32,
    /// Row of the source; [`Origin::NEW_ROW`] for one that was made (a merged Gaussian).
    pub row: u32,
    /// Index into [`EditState::motions`]: present pose = motion (pose in the source).
    pub motion: u32,
}

impl Origin {
    /// Of a Gaussian that no source has.
    pub const NEW_ROW: u32 = u32::MAX;
}

/// A place that Gaussians left, by a deletion or a move, for what is to be filled.
#[derive(Clone, Debug, PartialEq)]
pub struct Hole {
    /// The Gaussians that went, as they were then.
    pub removed: Vec<Origin>,
    /// With what.
    pub fill: Fill,
}

/// The parts of a decomposed scene beside its Gaussians, as they are now.
#[derive(Clone, Debug)]
pub struct SceneParts {
    /// Environment in photo units.
    pub environment: ImageF32,
    /// Its axes.
    pub axes: MapAxes,
    /// Whether the environment is no longer the one that the colors were made under.
    pub environment_changed: bool,
    /// Lobes of the materials.
    pub lobes: Lobes,
    /// Whether one bounce belongs to the image formation.
    pub indirect: bool,
    /// Tone curve of the camera. Colors of the Gaussians, environment and materials are without it, so light is computed without it,
    /// too; it matters where photos come in or go out.
    pub tone_curve: ToneCurve,
}

/// Gaussians under a plan.
#[derive(Clone, Debug)]
pub struct EditState {
    /// The Gaussians as they are now.
    pub gaussians: Gaussians,
    /// Where each comes from, `[N]`.
    pub origins: Vec<Origin>,
    /// Whether its material is no longer that of its source, `[N]`.
    pub material_changed: Vec<bool>,
    /// What they come from; the first is the scene.
    pub sources: Vec<Source>,
    /// Motions that Gaussians underwent; the first is the identity.
    pub motions: Vec<Similarity>,
    /// Places that were left, in order.
    pub holes: Vec<Hole>,
    /// Rows of the scene that are part of another row of it now: what becomes of that becomes of them.
    pub merged: BTreeMap<u32, u32>,
    /// Named sets, one confidence per present Gaussian.
    pub selections: BTreeMap<String, Selection>,
    /// The last set that was selected.
    pub current: Option<String>,
    /// The other parts of a decomposed scene; `None` for a plain splat.
    pub parts: Option<SceneParts>,
    /// Unit vector away from the ground.
    pub up_in_world: DVec3,
}

/// What light has to follow: the difference between the sources and what is there now.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct SceneChange {
    /// Rows of the scene whose place is empty now, ascending: deleted or moved away. Rows that were merged
    /// with others are not among them.
    pub removed: Vec<u32>,
    /// Present rows that are elsewhere than in the scene, or were not part of it: moved, duplicated, inserted, made.
    pub placed: Vec<u32>,
    /// Present rows whose material changed.
    pub material: Vec<u32>,
    /// Whether the environment was replaced.
    pub environment: bool,
    /// What is to be filled: rows of the scene that a deletion removed.
    pub holes: Vec<(Vec<u32>, Fill)>,
}

impl SceneChange {
    /// Whether the light may stay as it is.
    pub fn is_empty(&self) -> bool {
        *self == Self::default()
    }
}

impl EditState {
    /// A splat or a scene before the first operation.
    ///
    /// With `parts` the Gaussians are kept as they were, because light has to be traced through both.
    pub fn new(
        name: &str,
        gaussians: Gaussians,
        surface: Option<Surface>,
        parts: Option<SceneParts>,
        up_in_world: DVec3,
    ) -> Self {
        let n = gaussians.len();
        let kept = parts.is_some().then(|| Arc::new(gaussians.clone()));
        let origin = |row| Origin { source: SCENE, row, motion: AT_REST };
        Self {
            origins: (0..n as u32).map(origin).collect(),
            material_changed: vec![false; n],
            sources: vec![Source {
                name: name.to_owned(),
                gaussians: kept,
                surface: surface.map(Arc::new),
            }],
            motions: vec![Similarity::IDENTITY],
            holes: Vec::new(),
            merged: BTreeMap::new(),
            selections: BTreeMap::new(),
            current: None,
            parts,
            up_in_world: up_in_world.try_normalize().unwrap_or(DVec3::Z),
            gaussians,
        }
    }

    /// What a camera shows of the colors of the Gaussians; of a plain splat these are what it showed.
    pub fn tone_curve(&self) -> ToneCurve {
        self.parts.as_ref().map_or(ToneCurve::default(), |parts| parts.tone_curve)
    }

    /// Number of Gaussians.
    pub fn len(&self) -> usize {
        self.gaussians.len()
    }

    /// Whether none is left.
    pub fn is_empty(&self) -> bool {
        self.gaussians.is_empty()
    }

    /// Keeps the Gaussians of `rows`, in that order; a row may repeat. Selections follow.
    pub fn gather(&mut self, rows: &[u32]) {
        fn pick<T: Copy>(values: &mut Vec<T>, rows: &[u32]) {
            *values = rows.iter().map(|&r| values[r as usize]).collect();
        }
        self.gaussians.gather(rows);
        pick(&mut self.origins, rows);
        pick(&mut self.material_changed, rows);
        for selection in self.selections.values_mut() {
            pick(&mut selection.confidence, rows);
        }
    }

    /// Makes a selection of the present Gaussians the current one; without a name it lives until the next, under the empty name.
    pub fn keep_selection(&mut self, name: Option<&str>, selection: Selection) {
        let name = name.unwrap_or_default().to_owned();
        self.selections.insert(name.clone(), selection);
        self.current = Some(name);
    }

    /// Notes that the Gaussians of `rows` leave their place, which is to be filled.
    pub fn vacate(&mut self, rows: &[u32], fill: Fill) {
        let removed = rows.iter().map(|&r| self.origins[r as usize]).collect();
        self.holes.push(Hole { removed, fill });
    }

    /// Removes the Gaussians of `rows` (ascending) and notes that their place is to be filled.
    pub fn remove(&mut self, rows: &[u32], fill: Fill) {
        self.vacate(rows, fill);
        let mut gone = rows.iter().copied().peekable();
        let kept: Vec<u32> =
            (0..self.len() as u32).filter(|row| gone.next_if_eq(row).is_none()).collect();
        self.gather(&kept);
    }

    /// Notes that present row `gone` was merged into present row `kept` and will be gathered away.
    pub fn note_merged(&mut self, gone: u32, kept: u32) {
        let [gone, kept] = [gone, kept].map(|row| self.origins[row as usize]);
        let of_scene = |o: &Origin| o.source == SCENE && o.row != Origin::NEW_ROW;
        if of_scene(&gone) && of_scene(&kept) && gone.row != kept.row {
            self.merged.insert(gone.row, kept.row);
        }
    }

    /// The row of the scene that tells what became of a row: itself, or what it was merged into.
    pub fn survivor_of(&self, mut row: u32, is_present: impl Fn(u32) -> bool) -> u32 {
        // Copies of a row may be merged in either order: no path is longer than the map.
        for _ in 0..self.merged.len() {
            match self.merged.get(&row) {
                Some(next) if !is_present(row) => row = *next,
                _ => break,
            }
        }
        row
    }

    /// Appends Gaussians that have the same SH degree and columns, and their origins. No selection
    /// holds them.
    ///
    /// # Panics
    /// When degree or columns differ, or there is not one origin each.
    pub fn append(&mut self, mut added: Gaussians, origins: Vec<Origin>) {
        let to = &mut self.gaussians;
        assert_eq!(to.sh_degree, added.sh_degree, "one degree");
        assert_eq!(added.len(), origins.len(), "one origin each");
        to.means.append(&mut added.means);
        to.rotations.append(&mut added.rotations);
        to.log_scales.append(&mut added.log_scales);
        to.opacity_logits.append(&mut added.opacity_logits);
        to.sh.append(&mut added.sh);
        assert_eq!(to.extra.len(), added.extra.len(), "the same columns");
        for (column, more) in to.extra.iter_mut().zip(&mut added.extra) {
            assert_eq!(column.name, more.name, "the same columns");
            column.values.append(&mut more.values);
        }
        let n = to.len();
        self.origins.extend(origins);
        self.material_changed.resize(n, false);
        for selection in self.selections.values_mut() {
            selection.confidence.resize(n, 0.0);
        }
    }

    /// Notes that the Gaussians of `rows` were moved by `motion`, on top of earlier motions.
    pub fn note_motion(&mut self, rows: &[u32], motion: &Similarity) {
        let mut composed: BTreeMap<u32, u32> = BTreeMap::new();
        // Neighbors mostly went the same way.
        let mut last = None;
        for &row in rows {
            let origin = &mut self.origins[row as usize];
            let earlier = origin.motion;
            origin.motion = match last {
                Some((from, to)) if from == earlier => to,
                _ => *composed.entry(earlier).or_insert_with(|| {
                    self.motions.push(motion.after(&self.motions[earlier as usize]));
                    self.motions.len() as u32 - 1
                }),
            };
            last = Some((earlier, origin.motion));
        }
    }

    /// What differs from the scene that the plan was started on.
    pub fn change(&self) -> SceneChange {
        let rows_of_scene = self
            .sources
            .first()
            .and_then(|s| s.gaussians.as_ref())
            .map_or(0, |gaussians| gaussians.len());
        let (mut at_home, mut left) = (vec![false; rows_of_scene], vec![false; rows_of_scene]);
        let row_of_scene = |origin: &Origin| {
            (origin.source == SCENE && (origin.row as usize) < rows_of_scene)
                .then_some(origin.row as usize)
        };
        let mut change = SceneChange::default();
        for (i, origin) in self.origins.iter().enumerate() {
            let moved = !self.motions[origin.motion as usize].is_identity();
            match row_of_scene(origin) {
                Some(row) if !moved => at_home[row] = true,
                row => {
                    change.placed.push(i as u32);
                    row.into_iter().for_each(|row| left[row] = true);
                }
            }
            if self.material_changed[i] {
                change.material.push(i as u32);
            }
        }
        for hole in &self.holes {
            hole.removed.iter().filter_map(row_of_scene).for_each(|row| left[row] = true);
        }
        let empty = |r: &u32| left[*r as usize] && !at_home[*r as usize];
        change.removed = (0..rows_of_scene as u32).filter(empty).collect();
        change.environment = self.parts.as_ref().is_some_and(|parts| parts.environment_changed);
        for hole in self.holes.iter().filter(|hole| hole.fill != Fill::None) {
            let rows: Vec<u32> = hole
                .removed
                .iter()
                .filter_map(row_of_scene)
                .map(|row| row as u32)
                .filter(empty)
                .collect();
            if !rows.is_empty() {
                change.holes.push((rows, hole.fill));
            }
        }
        change
    }
}

#[cfg(test)]
mod tests {
    use motes_shading::environment::Convention;

    use super::*;

    fn parts() -> SceneParts {
        SceneParts {
            environment: ImageF32::filled(2, 1, 3, 0.5),
            axes: MapAxes::of_world(Convention::OpenExr),
            environment_changed: false,
            lobes: Lobes::Lambert,
            indirect: false,
            tone_curve: ToneCurve::default(),
        }
    }

    fn state() -> EditState {
        let gaussians = motes_testkit::random_gaussians(1, 6, 1);
        EditState::new("test", gaussians, None, Some(parts()), DVec3::Z)
    }

    #[test]
    fn history_survives_moves_and_removals() {
        let mut state = state();
        assert!(state.change().is_empty());
        let set = Selection::where_true(6, |i| i >= 4);
        state.selections.insert("s".into(), set);
        let step = Similarity::translation(DVec3::X);
        state.note_motion(&[4, 5], &step);
        state.note_motion(&[5], &step);
        // Merged away, not removed: its place is not empty.
        state.gather(&[0, 2, 3, 4, 5]);
        assert!(state.change().removed.iter().all(|r| *r != 1));
        state.remove(&[0, 3], Fill::Plane);
        assert_eq!(state.selections["s"].rows(), [2], "row 5 moved up");
        let change = state.change();
        assert_eq!(change.removed, [0, 4, 5]);
        assert_eq!(change.placed, [2]);
        assert_eq!(change.holes, [(vec![0, 4], Fill::Plane)]);
        let motion = state.motions[state.origins[2].motion as usize];
        assert_eq!(motion.translation, DVec3::X * 2.0);
    }

    #[test]
    fn a_merged_row_shares_the_fate_of_what_it_is_part_of() {
        let mut state = state();
        state.note_merged(1, 2);
        state.note_merged(2, 3);
        state.gather(&[0, 3, 4, 5]);
        assert_eq!(state.survivor_of(1, |_| false), 3);
        assert_eq!(state.survivor_of(1, |row| row == 2), 2);
        assert_eq!(state.survivor_of(4, |_| false), 4);
    }

    #[test]
    fn a_motion_and_its_inverse_leave_nothing_to_follow() {
        let mut state = state();
        let there = Similarity::translation(DVec3::new(0.5, 0.0, 2.0));
        state.note_motion(&[1], &there);
        assert_eq!(state.change().placed, [1]);
        state.note_motion(&[1], &there.inverse());
        assert!(state.change().is_empty());
    }
}
