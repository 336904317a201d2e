//! Lamps before a wall. They are small, and nothing but light tells of them, so they count as surface where other pieces would be noise.

use glam::Vec3;

use super::sheet::Sheet;
use super::view::{Shown, View};

/// Share of the photos of a place that show it burnt out before a sheet, and how many do at least.
const SHARE: f32 = 0.5;
const LEAST: usize = 2;

/// Whether photos show a place burnt out, and a sheet behind it. A burnt-out sky has none.
pub(super) fn is_lamp(p: Vec3, views: &[View], sheets: &[Sheet]) -> bool {
    let (mut seen, mut burnt_out) = (0, 0);
    for view in views {
        let Some(q) = view.project(p) else { continue };
        let Some(pixel) = view.pixel(q.x, q.y) else { continue };
        seen += 1;
        let is_before = |sheet: &Sheet| {
            sheet.met(view, view.ray(q.x, q.y)).is_some_and(|behind| behind.depth > q.z)
        };
        if view.shown[pixel] == Shown::BurntOut && sheets.iter().any(is_before) {
            burnt_out += 1;
        }
    }
    burnt_out >= LEAST && burnt_out as f32 >= SHARE * seen as f32
}

#[cfg(test)]
mod tests {
    use super::super::extract::tests::pictures_of;
    use super::super::planes::Plane;
    use super::*;

    #[test]
    fn what_is_burnt_out_before_a_sheet_is_a_lamp() {
        let voxel = 0.01;
        let level = |offset| Plane { normal: Vec3::Z, offset };
        let depth =
            |plane: Plane, view: &View, at| plane.depth(view, view.pixel_ray(at)).unwrap_or(0.0);
        let (mut views, maps) = pictures_of(|_, view, at| (0.5, depth(level(0.0), view, at)));
        let lamp = Vec3::new(0.05, 0.0, 0.3);
        for view in &mut views {
            for k in 0..view.shown.len() {
                let at = view.at(k as u32);
                let place = view.place(at, depth(level(lamp.z), view, at));
                if (place - lamp).length() < 0.1 {
                    view.shown[k] = Shown::BurntOut;
                }
            }
        }
        let floor = Sheet::new(level(0.0), &views, &maps, voxel, voxel, 4.0 * voxel);
        let floor: Vec<Sheet> = floor.into_iter().collect();
        assert!(is_lamp(lamp, &views, &floor));
        assert!(!is_lamp(lamp + Vec3::X * 0.3, &views, &floor), "it is dark there");
        assert!(!is_lamp(lamp, &views, &[]), "there is nothing behind");
        assert!(!is_lamp(lamp, &views[..1], &floor), "one photo tells nothing");
    }
}
