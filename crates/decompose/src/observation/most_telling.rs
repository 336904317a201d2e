//! Which of the photos of a point are looked at, where there are many.

use super::samples::Observation;

/// At most `most` of the observations of a point, 0 for all, in their order: the one that faces it best, then always the one whose
/// weight times angle to the nearest of those chosen is largest (farthest points, Gonzalez 1985). A highlight is told by sides that
/// differ, a base color by weight; photos under another light are never near.
pub(super) fn most_telling(observations: Vec<Observation>, most: usize) -> Vec<Observation> {
    if most == 0 || observations.len() <= most {
        return observations;
    }
    let mut gain: Vec<f32> = observations.iter().map(|o| ANOTHER_LIGHT * o.weight).collect();
    let mut is_chosen = vec![false; observations.len()];
    for _ in 0..most {
        let open = (0..observations.len()).filter(|&k| !is_chosen[k]);
        // The first of equals.
        let Some(next) = open.reduce(|a, b| if gain[b] > gain[a] { b } else { a }) else { break };
        is_chosen[next] = true;
        let chosen = observations[next];
        for (gain, o) in gain.iter_mut().zip(&observations) {
            if o.light == chosen.light {
                *gain = gain.min(o.weight * (o.to_viewer - chosen.to_viewer).length());
            }
        }
    }
    let chosen = observations.into_iter().zip(is_chosen);
    chosen.filter(|(_, is_chosen)| *is_chosen).map(|(o, _)| o).collect()
}

/// Distance of two photos under different light: more than that of opposite sides.
const ANOTHER_LIGHT: f32 = 4.0;

#[cfg(test)]
mod tests {
    use glam::Vec3;

    use super::*;

    fn seen(photo: u32, light: u32, angle: f32, weight: f32) -> Observation {
        let to_viewer = Vec3::new(angle.sin(), 0.0, angle.cos());
        Observation { photo, light, to_viewer, radiance: Vec3::ONE, weight }
    }

    #[test]
    fn sides_that_differ_are_kept_and_few_are_left_alone() {
        // A burst of ten from one side, and three from elsewhere.
        let mut all: Vec<_> = (0..10).map(|k| seen(k, 0, 1e-3 * k as f32, 1.0)).collect();
        all.extend([seen(10, 0, 0.5, 1.0), seen(11, 0, -0.6, 1.0), seen(12, 0, 1.1, 0.6)]);
        let photos = |most| -> Vec<u32> {
            most_telling(all.clone(), most).iter().map(|o| o.photo).collect()
        };
        assert_eq!(photos(4), [0, 10, 11, 12]);
        assert_eq!(photos(0).len(), 13);
        assert_eq!(photos(13).len(), 13);
        assert_eq!(photos(20).len(), 13);
        assert_eq!(photos(6)[..1], [0]);
        assert_eq!(photos(6).len(), 6);
    }

    #[test]
    fn every_light_keeps_some() {
        let mut all: Vec<_> = (0..30).map(|k| seen(k, 0, 0.03 * k as f32, 1.0)).collect();
        all.push(seen(30, 1, 0.3, 0.3));
        assert!(most_telling(all, 3).iter().any(|o| o.light == 1));
    }

    #[test]
    fn what_faces_away_or_is_equal_is_no_trouble() {
        let all = vec![seen(0, 0, 0.2, 0.0); 9];
        assert_eq!(most_telling(all, 4).len(), 4);
    }
}
