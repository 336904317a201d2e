//! Rotation, uniform scale and translation.

use glam::{DMat3, DQuat, DVec3};

/// `p ↦ scale · (rotation p) + translation`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Similarity {
    /// Unit quaternion.
    pub rotation: DQuat,
    /// Uniform, above 0.
    pub scale: f64,
    /// World units.
    pub translation: DVec3,
}

impl Similarity {
    /// Changes nothing.
    pub const IDENTITY: Self =
        Self { rotation: DQuat::IDENTITY, scale: 1.0, translation: DVec3::ZERO };

    /// Rotation and scale about a point, then a shift.
    pub fn about(pivot: DVec3, rotation: DQuat, scale: f64, shift: DVec3) -> Self {
        Self { rotation, scale, translation: pivot - rotation * (pivot * scale) + shift }
    }

    /// A shift alone.
    pub fn translation(shift: DVec3) -> Self {
        Self { translation: shift, ..Self::IDENTITY }
    }

    /// This one after `first`.
    #[must_use]
    pub fn after(&self, first: &Self) -> Self {
        Self {
            rotation: (self.rotation * first.rotation).normalize(),
            scale: self.scale * first.scale,
            translation: self.point(first.translation),
        }
    }

    /// What undoes it.
    #[must_use]
    pub fn inverse(&self) -> Self {
        let rotation = self.rotation.conjugate();
        let scale = 1.0 / self.scale;
        Self { rotation, scale, translation: -(rotation * (self.translation * scale)) }
    }

    /// Where a point goes.
    pub fn point(&self, p: DVec3) -> DVec3 {
        self.rotation * (p * self.scale) + self.translation
    }

    /// Where a direction goes.
    pub fn direction(&self, d: DVec3) -> DVec3 {
        self.rotation * d
    }

    /// Rows of the rotation.
    pub fn rotation_rows(&self) -> [[f64; 3]; 3] {
        DMat3::from_quat(self.rotation).transpose().to_cols_array_2d()
    }

    /// Whether nothing would change: exactly the identity.
    pub fn is_identity(&self) -> bool {
        *self == Self::IDENTITY
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn composition_inverse_and_pivot_agree() {
        let pivot = DVec3::new(1.0, -2.0, 0.5);
        let turn = DQuat::from_axis_angle(DVec3::new(0.6, 0.0, 0.8), 0.7);
        let a = Similarity::about(pivot, turn, 2.0, DVec3::ZERO);
        assert!((a.point(pivot) - pivot).length() < 1e-12, "the pivot stays");
        let b = Similarity::about(DVec3::X, turn.conjugate(), 0.3, DVec3::new(0.0, 4.0, 1.0));
        let p = DVec3::new(0.2, 0.4, -3.0);
        assert!((b.after(&a).point(p) - b.point(a.point(p))).length() < 1e-12);
        assert!((a.inverse().point(a.point(p)) - p).length() < 1e-12);
        let rows = a.rotation_rows();
        let by_rows = DVec3::from_array(rows.map(|r| DVec3::from_array(r).dot(p)));
        assert!((by_rows - turn * p).length() < 1e-12);
    }
}
