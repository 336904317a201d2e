//! Light that is not at infinity: what a place receives over what the light at infinity gives it.
//!
//! A lamp beside a wall, a window that lights one half of a room: their irradiance falls off over the room, which no environment map
//! can say. It is kept as a smooth factor that varies with place and normal,
//!
//! ```text
//! log f(x, n) = Σ_j w_j l_j / Σ_j w_j,   w_j = exp(-d_j² / 2),   d_j² = |x - x_j|² / reach² + |n - n_j|² / 0.4²
//! ```
//!
//! over the eight nearest of its anchors `j`.

use std::num::NonZero;
use std::sync::Arc;

use glam::Vec3;
use kiddo::{ImmutableKdTree, SquaredEuclidean};

/// Anchors that a place listens to.
pub(crate) const NEAR: usize = 8;
/// Difference of unit normals over which the factor changes: the sides of a fold face two lamps.
pub(crate) const NORMAL_REACH: f32 = 0.4;

/// A place with a normal, and the logarithm of the factor there, per channel.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LightAnchor {
    /// World.
    pub position: Vec3,
    /// Unit.
    pub normal: Vec3,
    /// Natural logarithm of the factor on the irradiance, linear RGB.
    pub log_factor: Vec3,
}

/// A factor on the irradiance that varies smoothly over the scene.
#[derive(Debug)]
pub struct LocalLight {
    anchors: Vec<LightAnchor>,
    reach: f32,
    tree: Arc<ImmutableKdTree<f32, 6>>,
}

/// A place with its normal, in units of what they reach.
pub(crate) fn feature(position: Vec3, normal: Vec3, reach: f32) -> [f32; 6] {
    let (p, n) = (position / reach, normal / NORMAL_REACH);
    [p.x, p.y, p.z, n.x, n.y, n.z]
}

impl LocalLight {
    /// Of these anchors; none without any, or where `reach` (world units) or an anchor is not finite.
    pub fn new(anchors: Vec<LightAnchor>, reach: f32) -> Option<Self> {
        let features: Vec<[f32; 6]> =
            anchors.iter().map(|a| feature(a.position, a.normal, reach)).collect();
        let is_finite = features.iter().flatten().all(|v| v.is_finite())
            && anchors.iter().all(|a| a.log_factor.is_finite());
        if anchors.is_empty() || !(reach > 0.0 && is_finite) {
            return None;
        }
        let tree = ImmutableKdTree::new_from_slice(&features).ok()?;
        Some(Self { anchors, reach, tree: Arc::new(tree) })
    }

    /// The anchors.
    pub fn anchors(&self) -> &[LightAnchor] {
        &self.anchors
    }

    /// Distance over which the factor changes, world units.
    pub fn reach(&self) -> f32 {
        self.reach
    }

    /// Other factors at the same anchors.
    #[must_use]
    pub(crate) fn with(&self, log_factors: &[Vec3]) -> Self {
        let anchors = self.anchors.iter().zip(log_factors);
        let anchors = anchors.map(|(a, l)| LightAnchor { log_factor: *l, ..*a }).collect();
        Self { anchors, reach: self.reach, tree: Arc::clone(&self.tree) }
    }

    /// The anchors that a place listens to, with weights of sum 1.
    pub(crate) fn weights(&self, position: Vec3, normal: Vec3) -> Vec<(usize, f32)> {
        let Some(near) = NonZero::new(NEAR) else { return Vec::new() };
        let at = feature(position, normal, self.reach);
        if !at.iter().all(|v| v.is_finite()) {
            return Vec::new();
        }
        let found = self.tree.query(&at).nearest_n::<SquaredEuclidean<f32>>(near).execute();
        // Relative to the nearest, so that far from all of them the nearest decides instead of 0 / 0.
        let least = found.iter().map(|f| f.distance).fold(f32::INFINITY, f32::min);
        let weight = |distance: f32| (-0.5 * (distance - least)).exp();
        let sum: f32 = found.iter().map(|f| weight(f.distance)).sum();
        found.iter().map(|f| (f.item as usize, weight(f.distance) / sum)).collect()
    }

    /// Logarithm of the factor at a place with a normal; 0 where either is not finite.
    pub fn log_factor(&self, position: Vec3, normal: Vec3) -> Vec3 {
        let near = self.weights(position, normal);
        near.into_iter().map(|(j, w)| self.anchors[j].log_factor * w).sum()
    }

    /// The factor itself.
    pub fn factor(&self, position: Vec3, normal: Vec3) -> Vec3 {
        self.log_factor(position, normal).map(f32::exp)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn two() -> LocalLight {
        let anchor = |x: f32, l: f32| LightAnchor {
            position: Vec3::X * x,
            normal: Vec3::Z,
            log_factor: Vec3::splat(l),
        };
        LocalLight::new(vec![anchor(0.0, 1.0), anchor(10.0, -1.0)], 1.0).unwrap()
    }

    #[test]
    fn the_factor_is_that_of_what_is_near() {
        let light = two();
        assert!((light.log_factor(Vec3::ZERO, Vec3::Z).x - 1.0).abs() < 1e-4);
        assert!(light.log_factor(Vec3::X * 5.0, Vec3::Z).x.abs() < 1e-4, "halfway: the mean");
        let far = light.log_factor(Vec3::X * 1e6, Vec3::Z);
        assert!((far.x + 1.0).abs() < 1e-4, "far away the nearest decides: {far}");
        assert_eq!(light.log_factor(Vec3::splat(f32::NAN), Vec3::Z), Vec3::ZERO);
    }

    #[test]
    fn what_is_not_finite_is_no_light() {
        let anchor = LightAnchor { position: Vec3::ZERO, normal: Vec3::Z, log_factor: Vec3::NAN };
        assert!(LocalLight::new(vec![anchor], 1.0).is_none());
        assert!(LocalLight::new(Vec::new(), 1.0).is_none());
        let anchor = LightAnchor { log_factor: Vec3::ONE, ..anchor };
        assert!(LocalLight::new(vec![anchor], 0.0).is_none());
    }
}
