//! The light as cells of a lat-long map, finer where there is more of it.

use std::f32::consts::{PI, TAU};

use glam::{DVec3, Vec3};
use motes_scene::ImageF32;
use motes_shading::environment::{
    Environment, EnvironmentMap, MapOptions, Orientation, direction_from_uv, uv_from_direction,
};

/// A rectangle of the map, `u` and `v` in [0, 1].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Cell {
    /// Left edge.
    pub u: f32,
    /// Upper edge.
    pub v: f32,
    /// Width.
    pub du: f32,
    /// Height.
    pub dv: f32,
    /// How often it was divided.
    pub level: u32,
}

impl Cell {
    /// Solid angle, steradians.
    pub fn solid_angle(&self) -> f32 {
        self.du * TAU * ((PI * self.v).cos() - (PI * (self.v + self.dv)).cos())
    }

    /// World direction of the point at fractions (`s`, `t`) of the cell, uniform in solid angle.
    pub fn direction(&self, s: f32, t: f32, orientation: &Orientation) -> Vec3 {
        let (top, bottom) = ((PI * self.v).cos(), (PI * (self.v + self.dv)).cos());
        let v = (top + (bottom - top) * t).clamp(-1.0, 1.0).acos() / PI;
        let map: DVec3 = direction_from_uv(f64::from(self.u + self.du * s), f64::from(v));
        orientation.world_from_map(map).as_vec3()
    }

    /// Columns and rows of the pixels that it covers of a map of this size.
    pub(crate) fn texels(
        &self,
        width: usize,
        height: usize,
    ) -> impl Iterator<Item = (usize, usize)> + use<> {
        let range = |a: f32, d: f32, n: usize| {
            let (from, to) = ((a * n as f32 + 0.5) as usize, ((a + d) * n as f32 + 0.5) as usize);
            from.min(n)..to.min(n)
        };
        let columns = range(self.u, self.du, width);
        range(self.v, self.dv, height).flat_map(move |y| columns.clone().map(move |x| (x, y)))
    }

    fn quarters(&self) -> [Self; 4] {
        let (du, dv, level) = (0.5 * self.du, 0.5 * self.dv, self.level + 1);
        [(0.0, 0.0), (du, 0.0), (0.0, dv), (du, dv)].map(|(a, b)| Self {
            u: self.u + a,
            v: self.v + b,
            du,
            dv,
            level,
        })
    }

    /// Whether a place of the map, `u` and `v` in [0, 1), is part of it.
    pub(crate) fn holds(&self, [u, v]: [f32; 2]) -> bool {
        (self.u..self.u + self.du).contains(&u) && (self.v..self.v + self.dv).contains(&v)
    }

    /// Whether the cells share an edge or a corner; the map wraps in `u`.
    pub fn touches(&self, other: &Self) -> bool {
        let gap = 1e-4;
        let vertical = self.v <= other.v + other.dv + gap && other.v <= self.v + self.dv + gap;
        let horizontal = [-1.0, 0.0, 1.0].into_iter().any(|turn| {
            self.u + turn <= other.u + other.du + gap && other.u <= self.u + turn + self.du + gap
        });
        vertical && horizontal
    }
}

/// A piece of the surface that shines.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Lamp {
    /// Linear radiance, photo units; the same in all directions.
    pub radiance: Vec3,
    /// What the photos show of it before they clip.
    pub seen: Vec3,
}

/// Cells that tile the sphere, with one radiance each, and lamps in the scene.
#[derive(Clone, Debug, PartialEq)]
pub struct CellLight {
    /// The tiles.
    pub cells: Vec<Cell>,
    /// Linear radiance of each, photo units.
    pub radiance: Vec<Vec3>,
    /// The lamps; which vertices they are is told beside the light.
    pub lamps: Vec<Lamp>,
    /// Axes of the map.
    pub orientation: Orientation,
}

impl CellLight {
    /// Radiance of all that light comes from: the cells, then the lamps.
    pub(crate) fn sources(&self) -> Vec<Vec3> {
        self.radiance.iter().copied().chain(self.lamps.iter().map(|lamp| lamp.radiance)).collect()
    }

    /// The same light, brighter by a factor.
    pub(crate) fn scale(&mut self, factor: Vec3) {
        let lamps = self.lamps.iter_mut().map(|lamp| &mut lamp.radiance);
        self.radiance.iter_mut().chain(lamps).for_each(|e| *e *= factor);
    }

    /// `columns x rows` equal rectangles of the same radiance.
    pub fn uniform(columns: usize, rows: usize, radiance: Vec3, orientation: Orientation) -> Self {
        let (du, dv) = (1.0 / columns as f32, 1.0 / rows as f32);
        let cells: Vec<Cell> = (0..columns * rows)
            .map(|i| Cell {
                u: (i % columns) as f32 * du,
                v: (i / columns) as f32 * dv,
                du,
                dv,
                level: 0,
            })
            .collect();
        Self { radiance: vec![radiance; cells.len()], lamps: Vec::new(), cells, orientation }
    }

    /// Divides the cells of `which` into four each; the radiance is inherited.
    pub fn divide(&mut self, which: &[bool]) {
        let (mut cells, mut radiance) = (Vec::new(), Vec::new());
        for ((cell, value), divide) in self.cells.iter().zip(&self.radiance).zip(which) {
            if *divide {
                cells.extend(cell.quarters());
                radiance.extend([*value; 4]);
            } else {
                cells.push(*cell);
                radiance.push(*value);
            }
        }
        (self.cells, self.radiance) = (cells, radiance);
    }

    /// The cell in the direction of a unit vector, world.
    pub(crate) fn cell_toward(&self, direction: Vec3) -> Option<usize> {
        let (u, v) = uv_from_direction(self.orientation.map_from_world(direction.as_dvec3()));
        let at = [u.rem_euclid(1.0), v].map(|x| (x as f32).min(1.0 - f32::EPSILON));
        self.cells.iter().position(|cell| cell.holds(at))
    }

    /// Pairs of cells that touch, each once.
    pub fn neighbors(&self) -> Vec<(u32, u32)> {
        let mut pairs = Vec::new();
        for (i, a) in self.cells.iter().enumerate() {
            for (j, b) in self.cells.iter().enumerate().skip(i + 1) {
                if a.touches(b) {
                    pairs.push((i as u32, j as u32));
                }
            }
        }
        pairs
    }

    /// Columns of a map whose pixels are as wide as the narrowest cell.
    pub(crate) fn finest_columns(&self) -> usize {
        let finest = self.cells.iter().map(|c| c.du).fold(1.0, f32::min);
        (1.0 / finest).round() as usize
    }

    /// The map as an image of `width x width / 2`.
    pub fn image(&self, width: usize) -> ImageF32 {
        let height = width / 2;
        let mut image = ImageF32::filled(width, height, 3, 0.0);
        for (cell, value) in self.cells.iter().zip(&self.radiance) {
            for (x, y) in cell.texels(width, height) {
                image.pixel_mut(x, y).copy_from_slice(&value.to_array());
            }
        }
        image
    }
}

/// `light` as something that can be sampled.
pub fn environment(light: &CellLight) -> Environment {
    let width = light.finest_columns().clamp(64, 1024);
    let options = MapOptions { exposure: 1.0, orientation: light.orientation };
    // The shape and the exposure are right by construction.
    Environment::new(EnvironmentMap::new(&light.image(width), &options).ok(), None)
}

#[cfg(test)]
mod tests {
    use motes_shading::environment::Convention;

    use super::*;

    #[test]
    fn cells_tile_the_sphere_also_when_divided() {
        let mut light = CellLight::uniform(16, 8, Vec3::ONE, Orientation::new(Convention::Blender));
        let which: Vec<bool> = (0..128).map(|i| i % 5 == 0).collect();
        light.divide(&which);
        let total: f32 = light.cells.iter().map(Cell::solid_angle).sum();
        assert!((total - 2.0 * TAU).abs() < 1e-3, "{total}");
        assert!(light.image(64).data.iter().all(|&v| v == 1.0));
        assert_eq!(light.cells.len(), 128 + 3 * 26);
    }

    #[test]
    fn neighbors_wrap_round_the_map() {
        let light = CellLight::uniform(8, 4, Vec3::ONE, Orientation::new(Convention::OpenExr));
        let pairs = light.neighbors();
        assert!(pairs.contains(&(0, 7)) && pairs.contains(&(0, 1)) && pairs.contains(&(0, 15)));
        assert!(!pairs.contains(&(0, 2)) && !pairs.contains(&(0, 16)));
    }
}
