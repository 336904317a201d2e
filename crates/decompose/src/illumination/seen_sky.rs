//! What photos show of the sky: light that need not be found.

use glam::{BVec3, DVec3, Vec3};
use motes_shading::environment::{Orientation, direction_from_uv, uv_from_direction};
use rayon::prelude::*;

use super::cells::Cell;
use super::sky_dome::{Seen, SkyDome, open};

/// Columns and rows of the map that what is seen is gathered in: 2.8 degrees.
const SIZE: [usize; 2] = [128, 64];
/// Least share of a cell that photos show, below which it is not known.
const LEAST_SHARE: f32 = 0.25;
/// Half the range within which a cell stays of what photos show of it, natural logarithm.
const ROOM: f32 = 0.1;
/// Radiance below which no logarithm is taken, photo units.
const DARKEST: f32 = 1e-5;

/// A pixel of the sky.
#[derive(Clone, Copy, Debug)]
pub(crate) struct SkyPixel {
    /// Unit, world.
    pub direction: Vec3,
    /// Linear, photo units.
    pub radiance: Vec3,
    /// Channels in which the sky may be brighter than the photo can say.
    pub is_clipped: BVec3,
}

/// What photos show of the sky, on a map.
#[derive(Clone, Debug, Default)]
pub(crate) struct SeenSky {
    /// Per texel, row by row; none where photos show nothing.
    seen: Vec<Option<Seen>>,
    /// Per texel: logarithm of the radiance that is expected there; none where nothing is.
    expected: Vec<Option<Vec3>>,
}

/// What the pixels of a texel add up to, per channel.
#[derive(Clone, Copy, Debug, Default)]
struct Sums {
    log_radiance: Vec3,
    count: f32,
    /// The same of those that are not clipped.
    open_log_radiance: Vec3,
    open: Vec3,
}

impl Sums {
    fn add(&mut self, pixel: &SkyPixel) {
        let log = pixel.radiance.max(Vec3::splat(DARKEST)).map(f32::ln);
        let open = open(pixel.is_clipped);
        self.log_radiance += log;
        self.count += 1.0;
        self.open_log_radiance += open * log;
        self.open += open;
    }

    /// A channel is clipped where most pixels are.
    fn seen(&self, direction: DVec3) -> Option<Seen> {
        let is_clipped = self.open.cmplt(Vec3::splat(0.5 * self.count));
        let (all, open) = (self.log_radiance / self.count, self.open_log_radiance / self.open);
        let log_radiance = Vec3::select(is_clipped, all, open);
        (self.count > 0.0).then_some(Seen { direction, log_radiance, is_clipped })
    }
}

/// The texel at a place of the map.
fn texel_at(u: f64, v: f64) -> usize {
    let [columns, rows] = SIZE;
    let column = ((u.rem_euclid(1.0) * columns as f64) as usize).min(columns - 1);
    ((v * rows as f64) as usize).min(rows - 1) * columns + column
}

impl SeenSky {
    /// Gathers pixels on a map with these axes. `ground` is the radiance below the horizon, linear, photo units.
    pub(crate) fn new(
        pixels: &[SkyPixel],
        ground: Option<Vec3>,
        orientation: &Orientation,
    ) -> Self {
        let [columns, rows] = SIZE;
        let direction = |i: usize| {
            let (u, v) = ((i % columns) as f64 + 0.5, (i / columns) as f64 + 0.5);
            direction_from_uv(u / columns as f64, v / rows as f64)
        };
        let mut sums = vec![Sums::default(); columns * rows];
        for pixel in pixels {
            let (u, v) = uv_from_direction(orientation.map_from_world(pixel.direction.as_dvec3()));
            sums[texel_at(u, v)].add(pixel);
        }
        let seen: Vec<Option<Seen>> =
            sums.iter().enumerate().map(|(i, sums)| sums.seen(direction(i))).collect();
        let shown: Vec<Seen> = seen.iter().flatten().copied().collect();
        let dome = SkyDome::fit(&shown);
        let ground = ground.map(|l| l.max(Vec3::splat(DARKEST)).map(f32::ln));
        let expected =
            |i: usize| if direction(i).y > 0.0 { dome.log_radiance(direction(i)) } else { ground };
        let expected = (0..seen.len()).into_par_iter().map(expected).collect();
        Self { seen, expected }
    }

    /// Whether photos show none of it.
    pub(crate) fn is_empty(&self) -> bool {
        self.seen.is_empty()
    }

    /// Whether the scale of the light follows: photos show some of it, and in one channel most of that is not clipped.
    pub(crate) fn sets_scale(&self) -> bool {
        let (open, count) = count_open(self.seen.iter().flatten());
        count > 0.0 && (2.0 * open).max_element() > count
    }

    /// Whether photos show some of it, most of that clipped in every channel: it is at least as bright.
    pub(crate) fn is_clipped(&self) -> bool {
        !self.is_empty() && !self.sets_scale()
    }

    /// Least and largest logarithm of the radiance of a cell, per channel; none where photos show too little of it.
    pub(crate) fn range(&self, cell: &Cell) -> Option<[Vec3; 2]> {
        let all: Vec<Option<&Seen>> = texels(cell, &self.seen).collect();
        let seen = || all.iter().flatten().copied();
        let (open, count) = count_open(seen());
        if count < (LEAST_SHARE * all.len() as f32).max(1.0) {
            return None;
        }
        let mean = seen().map(|texel| texel.log_radiance).sum::<Vec3>() / count;
        let is_clipped = (2.0 * open).cmplt(Vec3::splat(count));
        let above = Vec3::select(is_clipped, Vec3::INFINITY, Vec3::splat(ROOM));
        Some([mean - ROOM, mean + above])
    }

    /// Mean logarithm of the radiance that is expected of a cell; none where nothing is.
    pub(crate) fn expected(&self, cell: &Cell) -> Option<Vec3> {
        let known: Vec<Vec3> = texels(cell, &self.expected).flatten().copied().collect();
        (!known.is_empty()).then(|| known.iter().sum::<Vec3>() / known.len() as f32)
    }
}

/// How many texels are not clipped, per channel, and how many there are.
fn count_open<'a>(seen: impl Iterator<Item = &'a Seen>) -> (Vec3, f32) {
    seen.fold((Vec3::ZERO, 0.0), |(sum, count), texel| (sum + open(texel.is_clipped), count + 1.0))
}

/// What a map has of a cell; of one that is smaller than a texel, nothing.
fn texels<'a, T>(cell: &Cell, map: &'a [Option<T>]) -> impl Iterator<Item = Option<&'a T>> {
    let [columns, rows] = SIZE;
    let on_map = if map.is_empty() { None } else { Some(cell.texels(columns, rows)) };
    on_map.into_iter().flatten().map(move |(x, y)| map[y * columns + x].as_ref())
}

#[cfg(test)]
mod tests {
    use motes_shading::environment::Convention;

    use super::*;
    use crate::illumination::CellLight;

    /// The sky of one half of the compass, up to 40 degrees, and a light of large cells.
    fn half(radiance: Vec3, is_clipped: BVec3) -> (SeenSky, CellLight) {
        let orientation = Orientation::new(Convention::Blender);
        let places = (0..180).flat_map(|i| (0..40).map(move |j| (i, j)));
        let pixel = |(i, j): (u32, u32)| {
            let (u, v) = (f64::from(i) + 0.5, 90.0 - f64::from(j) - 0.5);
            let map = direction_from_uv(u / 360.0, v / 180.0);
            SkyPixel { direction: orientation.world_from_map(map).as_vec3(), radiance, is_clipped }
        };
        let pixels: Vec<SkyPixel> = places.map(pixel).collect();
        let light = CellLight::uniform(32, 16, Vec3::ONE, orientation);
        (SeenSky::new(&pixels, Some(Vec3::splat(0.1)), &orientation), light)
    }

    #[test]
    fn cells_that_photos_show_are_known_and_no_others() {
        let (sky, light) = half(Vec3::new(0.2, 0.4, 0.6), BVec3::FALSE);
        let known: Vec<usize> =
            (0..light.cells.len()).filter(|&k| sky.range(&light.cells[k]).is_some()).collect();
        // 16 columns of four rows above the horizon, which is below row 7.
        assert_eq!(known.len(), 64);
        assert!(sky.sets_scale());
        assert!(known.iter().all(|k| k % 32 < 16 && (4..8).contains(&(k / 32))), "{known:?}");
        let [least, most] = sky.range(&light.cells[7 * 32]).unwrap();
        let log = Vec3::new(0.2, 0.4, 0.6).map(f32::ln);
        assert!((0.5 * (least + most) - log).abs().max_element() < 1e-4);
        assert!((most - least - 2.0 * ROOM).abs().max_element() < 1e-5);
    }

    #[test]
    fn a_clipped_sky_may_be_brighter() {
        let (sky, light) = half(Vec3::ONE, BVec3::TRUE);
        let [least, most] = sky.range(&light.cells[7 * 32]).unwrap();
        assert!(
            least.is_finite() && most.x == f32::INFINITY && !sky.sets_scale() && sky.is_clipped()
        );
    }

    #[test]
    fn a_blue_sky_that_is_clipped_in_blue_sets_the_scale() {
        let shown = Vec3::new(0.6, 0.8, 1.0);
        let (sky, light) = half(shown, BVec3::new(false, false, true));
        let [_, most] = sky.range(&light.cells[7 * 32]).unwrap();
        assert!(sky.sets_scale() && most.z == f32::INFINITY && most.y < 0.0, "{most}");
    }

    #[test]
    fn what_is_expected_below_the_horizon_is_the_ground() {
        let (sky, light) = half(Vec3::new(0.2, 0.4, 0.6), BVec3::FALSE);
        let ground = sky.expected(&light.cells[12 * 32 + 20]).unwrap();
        assert!((ground.x - 0.1f32.ln()).abs() < 1e-5);
        // Beside what is seen, the sky goes on.
        let beside = sky.expected(&light.cells[6 * 32 + 17]).unwrap();
        assert!((beside.map(f32::exp) - Vec3::new(0.2, 0.4, 0.6)).abs().max_element() < 0.15);
        let none = SeenSky::default();
        assert!(none.is_empty() && !none.sets_scale() && none.range(&light.cells[0]).is_none());
        assert!(none.expected(&light.cells[0]).is_none());
    }
}
