//! A floor that shading tells, half of which the depth of all photos shows a little before itself.

use glam::Vec3;

use super::super::super::extract::tests::pictures_of;
use super::super::tests::{FLOOR, VOXEL, all_regions, crossed, glow};
use super::*;

/// Photos of the floor, their depth, which lies `rise` above the floor on one side, and what is left of two planes.
fn run(rise: f32, planes: [Plane; 2]) -> (Vec<Plane>, Vec<View>, Vec<DepthMap>) {
    let (views, mut maps) = pictures_of(|_, view, at| {
        let (z, p) = crossed(view, at, 0.0);
        (glow(p), if p.x > 0.0 { crossed(view, at, rise).0 } else { z })
    });
    let regions = all_regions(&views, &maps);
    let left = joined(planes.to_vec(), &regions, &views, &mut maps, VOXEL);
    (left, views, maps)
}

fn raised(rise: f32) -> Plane {
    Plane { offset: rise, ..FLOOR }
}

#[test]
fn of_two_sheets_of_a_floor_the_one_that_explains_the_photos_is_left() {
    for planes in [[FLOOR, raised(0.03)], [raised(0.03), FLOOR]] {
        let (left, views, maps) = run(0.03, planes);
        assert_eq!(left, [FLOOR]);
        let pixels = views.iter().zip(&maps).flat_map(|(view, map)| {
            (0..map.depth.len()).map(|i| view.place(view.at(i as u32), map.depth[i]))
        });
        let highest = pixels.map(|at| at.z.abs()).fold(0.0, f32::max);
        assert!(highest < 1e-4, "{highest}");
    }
}

#[test]
fn a_table_over_a_floor_and_a_slope_stay() {
    let slope = Plane { normal: Vec3::new(0.2, 0.0, 1.0).normalize(), offset: 0.02 };
    for other in [raised(0.3), slope] {
        assert_eq!(run(other.offset, [FLOOR, other]).0, [FLOOR, other]);
    }
}

#[test]
fn what_no_pixel_lies_on_stays() {
    let planes = [raised(-0.5), raised(-0.52)];
    assert_eq!(run(0.0, planes).0, planes);
}
