//! What photos show of the sky, as a part of the light.

use std::sync::Arc;

use glam::Vec3;
use motes_scene::Switch;

use super::problem::DIM;
use crate::illumination::seen_sky::SeenSky;
use crate::observation::Sample;
use crate::observation::sky::find_sky;
use crate::state::State;

/// Cosine of the angle to up within which a point is ground.
const FACES_UP: f32 = 0.8;

/// What photos show of the sky, where it is one; nothing of several captures.
pub(super) fn seen_sky(state: &State<'_>) -> Arc<SeenSky> {
    let (inputs, views, up) = (state.inputs, &state.observed.views, state.up_in_world);
    if inputs.model.sky == Switch::Off || inputs.light_count() != 1 {
        return Arc::default();
    }
    let sky = find_sky(views, up);
    if !sky.is_kept(inputs.model.sky) {
        return Arc::default();
    }
    let pixels = sky.pixels(views);
    if pixels.is_empty() {
        return Arc::default();
    }
    let ground = ground_radiance(&state.observed.samples, up);
    Arc::new(SeenSky::new(&pixels, ground, &state.orientation()))
}

/// Geometric mean of what points that face up send out, linear, photo units; none where none does.
fn ground_radiance(samples: &[Sample], up: Vec3) -> Option<Vec3> {
    let facing_up = samples.iter().filter(|s| s.normal.dot(up) > FACES_UP);
    let logs = facing_up.filter_map(|s| s.body_radiance(0));
    let logs = logs.map(|l| l.max(Vec3::splat(DIM)).map(f32::ln));
    let (sum, count) = logs.fold((Vec3::ZERO, 0.0f32), |(sum, n), log| (sum + log, n + 1.0));
    (count > 0.0).then(|| (sum / count).map(f32::exp))
}
