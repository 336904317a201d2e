//! Errors of predictions.

use std::f32::consts::TAU;

use clap::ValueEnum;
use glam::{Quat, Vec2, Vec3};
use motes_math::luminance::luminance;
use motes_math::rng::keyed_rng;
use rand::RngExt;

use super::Seen;

/// Stream of the errors.
const STREAM: u64 = 0x7072_6564;

/// How good a prediction is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Grade {
    /// Normals lean by about 5 degrees, smoothly over the photo; base colors have a scale of their own in each photo
    Good,
    /// Normals lean by about 15 degrees; base colors hold four tenths of the shading, in logarithms
    Mediocre,
    /// Normals lean by 45 degrees to one side of the world; base colors are multiplied by a pattern of the world that goes
    /// from a quarter to four times
    Adversarial,
}

/// What is predicted behind a pixel.
#[derive(Clone, Copy, Debug)]
pub struct Prediction {
    /// Linear, up to a factor of the photo.
    pub base_color: Vec3,
    /// Unit, world.
    pub normal: Vec3,
}

/// Waves over a picture or a scene, -1 to 1 mostly.
struct Waves(Vec<(Vec2, f32)>);

impl Waves {
    fn new(random: &mut impl RngExt) -> Self {
        let mut wave = || {
            let direction = Vec2::from_angle(random.random_range(0.0..TAU));
            (direction * random.random_range(1.0..3.0) * TAU, random.random_range(0.0..TAU))
        };
        Self((0..3).map(|_| wave()).collect())
    }

    fn at(&self, p: Vec2) -> f32 {
        self.0.iter().map(|(frequency, phase)| (frequency.dot(p) + phase).sin()).sum::<f32>() / 1.22
    }
}

impl Grade {
    /// Predictions for a photo (`[h, w, 3]`, linear) of `width` columns, in a scene that reaches `extent` units;
    /// errors follow from the seed and the number of the photo.
    pub fn predict(
        self,
        seen: &[Option<Seen>],
        photo: &[f32],
        width: usize,
        extent: f32,
        (seed, photo_index): (u64, u64),
    ) -> Vec<Option<Prediction>> {
        let mut random = keyed_rng(seed, STREAM, photo_index);
        let waves = [0, 1].map(|_| Waves::new(&mut random));
        let scale = random.random_range(-1.0f32..1.0).exp2();
        let lean_by = |p: Vec2, degrees: f32| {
            let axis = Vec2::new(waves[0].at(p), waves[1].at(p)) * degrees.to_radians();
            Quat::from_scaled_axis(Vec3::new(axis.x, axis.y, 0.0))
        };
        let predict = |(i, seen): (usize, &Option<Seen>)| {
            let Seen { base_color, normal, position } = (*seen)?;
            let pixel = Vec2::new((i % width) as f32, (i / width) as f32) / width as f32;
            Some(match self {
                Self::Good => Prediction {
                    base_color: base_color * scale,
                    normal: lean_by(pixel, 5.0) * normal,
                },
                Self::Mediocre => {
                    let light = [&photo[3 * i..3 * i + 3], &base_color.to_array()]
                        .map(|c| luminance([c[0], c[1], c[2]]).max(1e-3));
                    Prediction {
                        base_color: base_color * scale * (light[0] / light[1]).powf(0.4),
                        normal: lean_by(pixel, 15.0) * normal,
                    }
                }
                Self::Adversarial => {
                    let wave =
                        (position.as_vec3() * TAU / extent).map(f32::sin).element_sum() / 3.0;
                    let tilt = Quat::from_rotation_y(45f32.to_radians());
                    Prediction {
                        base_color: base_color * (4f32.ln() * wave).exp(),
                        normal: tilt * normal,
                    }
                }
            })
        };
        seen.iter().enumerate().map(predict).collect()
    }
}
