//! What the photos say about a shadow that the edit takes away.
//!
//! The model's light is never quite right: its shadows are a little too bright or too blue, and their edges lie beside those
//! in the photos. A ratio of model light would leave the difference as an outline and a stain. Matter of one plane is
//! the same, on average, inside and outside of a shadow, which corrects both:
//!
//! ```text
//! d = log L_before - log L_after            what the model says the shadow takes, per channel
//! κ = <log c - μ - log L_after> / <d>       over its inside; μ: mean of log c - log L around it
//! d <- κ d + s                              s: what is left of log c near the edge, averaged over cells
//! ```
//!
//! `c` is the plane as it looks from above. In `μ`, places count by the inverse square of their distance: every doubling has the
//! same say. `s` may take `d` no further than to the values that it has within the reach of an edge.
//!
//! Texture is not an error of the light. `κ` is the best guess between 1, from which it is [`SPREAD`] off as a rule, and what was
//! measured, which is off by as much as places beside the shadow, as large and as far apart, differ. `s` is made smaller by the
//! share of its mean square within the reach of an edge that texture has in three of four such places (Wiener, locally as in
//! Lee 1980). Both hold where the ground lies: nothing is known about the light on other things. Ground is a plane or a field
//! of heights.

use glam::{Vec3, Vec4};
use motes_math::median::quantile;

use super::grid::{Grid, boxed};
use super::looks::{unlit, window};
use super::support::Plane;

/// The model's edges are off by less than this share of the object's size.
const REACH: f32 = 0.08;
/// Reach over the width of a cell.
const CELLS_OF_REACH: f32 = 6.0;
/// Changes of the logarithm of light below do not make a shadow.
const LEAST_CHANGE: f32 = 0.05;
/// The inside of a shadow is darker than this.
const INSIDE: f32 = -0.15;
/// What is darker than the brighter part of the ground by this much, log units, lies in a shadow.
const SHADOWED: f32 = -0.5;
/// Cells of inside, and of surroundings, that a correction needs.
const LEAST_CELLS: usize = 32;
/// Beyond these nothing is believed.
const EXPONENT: [f32; 2] = [0.5, 2.0];
/// Standard deviation of κ before anything is measured: [`EXPONENT`] is two of them to each side, in logarithms.
const SPREAD: f32 = 0.35;
/// Radiance below says nothing but dark: seven of 255 steps of a photo. The logarithm of less would
/// outvote the rest.
const LEAST_RADIANCE: f32 = 2e-3;

/// What is known about the cells of a plane; `None` where it is not covered.
pub(super) struct Observed {
    /// As captured, linear.
    pub(super) radiance: Vec<Option<Vec3>>,
    /// Where the radiance is also that of what stood there.
    pub(super) blurred: Vec<bool>,
    /// Of white matte matter.
    pub(super) log_before: Vec<Vec3>,
    pub(super) log_after: Vec<Vec3>,
}

/// How to correct `log L_before - log L_after`.
#[derive(Debug)]
pub(super) struct Calibration {
    grid: Grid,
    /// κ per channel; `None` when there is no inside to learn it from.
    pub(super) exponent: Option<Vec3>,
    /// `s` per cell, along the direction in which the shadow changes color.
    shift: Vec<Vec3>,
    /// Linear color without light, continued where it is not known.
    unlit: Vec<Vec3>,
}

/// Cells around the places of a plane whose light changed.
pub(super) fn changed_grid(plane: Plane, object_size: f32, changed: &[Vec3]) -> Option<Grid> {
    let reach = REACH * object_size;
    Grid::over(plane, changed, reach / CELLS_OF_REACH, 4.0 * reach)
}

/// Whether light changed enough to be looked at.
pub(super) fn is_change(log_before: Vec3, log_after: Vec3) -> bool {
    mean(log_before - log_after).abs() > LEAST_CHANGE
}

impl Calibration {
    /// From what is known about the cells, or none where there is too little of it.
    pub(super) fn new(grid: Grid, observed: &Observed, object_size: f32) -> Option<Self> {
        let Observed { radiance, blurred, log_before, log_after } = observed;
        let steps = CELLS_OF_REACH.ceil() as usize;
        let cells = 0..grid.cells();
        let known: Vec<bool> = radiance.iter().map(Option::is_some).collect();
        let log_c: Vec<Vec3> = radiance
            .iter()
            .map(|c| c.unwrap_or(Vec3::ONE).max(Vec3::splat(LEAST_RADIANCE)).map(f32::ln))
            .collect();
        let change = |c: usize| mean(log_before[c] - log_after[c]);
        let marks = |test: &dyn Fn(usize) -> bool| -> Vec<bool> {
            cells.clone().map(|c| known[c] && test(c)).collect()
        };
        let zone = grid.grown(&marks(&|c| change(c).abs() > LEAST_CHANGE), steps);
        // Where other things stand or throw their shadow, colors are those of hidden matter, or of another error of the light.
        let lit_from =
            upper_quartile(cells.clone().filter(|c| known[*c]).map(|c| mean(log_after[c])));
        let in_light = |c: usize| mean(log_after[c]) >= lit_from + SHADOWED;
        let all_around = marks(&|c| !zone[c]);
        let clear = marks(&|c| !zone[c] && !blurred[c] && in_light(c));
        // An island amid the change, such as what is left where the object stood, must not speak for all around it.
        let wide = grid.grown(&grid.shrunk(&clear, steps), steps);
        let wide: Vec<bool> = cells.clone().map(|c| clear[c] && wide[c]).collect();
        let enough = |marks: &[bool]| marks.iter().filter(|a| **a).count() >= LEAST_CELLS;
        let around = [wide, clear, all_around].into_iter().find(|marks| enough(marks))?;
        let unlit_around = mean_around(&grid, &around, 2 * steps, |c| log_c[c] - log_after[c]);
        let edge = grid.grown(&marks(&|c| change(c) > INSIDE), steps.div_ceil(2));
        let inside: Vec<usize> =
            cells.clone().filter(|&c| known[c] && !edge[c] && change(c) < INSIDE).collect();
        let sum = |f: &dyn Fn(usize) -> Vec3| inside.iter().map(|c| f(*c)).sum::<Vec3>();
        let seen = sum(&|c| log_c[c] - unlit_around[c] - log_after[c]);
        let modeled = sum(&|c| log_before[c] - log_after[c]);
        let learned = inside.len() >= LEAST_CELLS && modeled.max_element() < 0.0;
        let [least, most] = EXPONENT.map(Vec3::splat);
        let found = seen / modeled;
        // A larger factor is not the shadow of the removed object.
        if learned && !(mean(found) >= EXPONENT[0] && mean(found) <= EXPONENT[1]) {
            return None;
        }
        let beside = |c: usize| mean(log_c[c] - log_after[c]);
        let count = inside.len().max(1) as f32;
        let across = (0.5 * count.sqrt()) as usize;
        let apart = across + 2 * steps;
        let texture = Texture::new(&grid, &around, apart, beside);
        let expected = f64::from(SPREAD * mean(modeled) / count).powi(2);
        let sure = (expected / (expected + texture.power(across.max(1)))) as f32;
        let exponent = learned.then(|| Vec3::ONE + sure * (found.clamp(least, most) - Vec3::ONE));
        let kappa = exponent.unwrap_or(Vec3::ONE);
        let d: Vec<Vec3> = cells.clone().map(|c| kappa * (log_before[c] - log_after[c])).collect();
        let tint = kappa * modeled;
        let tint = if mean(tint) < 0.0 { tint / mean(tint) } else { Vec3::ONE };
        // Photos show the light before: they tell about shadows that go, not about those that come.
        let gone: Vec<Vec3> = d.iter().map(|d| d.min(Vec3::ZERO)).collect();
        let lit = |c: usize| log_after[c].max(log_before[c]);
        let left =
            smoothed(&grid, &known, 1, |c| mean(log_c[c] - unlit_around[c] - lit(c) - gone[c]));
        let bounded = |c: usize| {
            let own = mean(gone[c]);
            let (mut low, mut high) = (own, own);
            for n in grid.within(c, steps).filter(|n| known[*n]) {
                (low, high) = (low.min(mean(gone[n])), high.max(mean(gone[n])));
            }
            left[c].clamp(low - own, high - own)
        };
        let of_zone: Vec<bool> = cells.clone().map(|c| known[c] && zone[c]).collect();
        let bounded: Vec<f32> =
            cells.clone().map(|c| if of_zone[c] { bounded(c) } else { 0.0 }).collect();
        let signal = smoothed(&grid, &of_zone, steps, |c| bounded[c].powi(2));
        let noise = texture.usual_power(1, steps);
        let share = |c: usize| beyond(signal[c], noise);
        let shift: Vec<Vec3> = cells.clone().map(|c| share(c) * bounded[c] * tint).collect();
        let light: Vec<Vec3> =
            cells.clone().map(|c| (lit(c) + gone[c] + shift[c]).map(f32::exp)).collect();
        let unlit = unlit(&grid, blurred, radiance, &light, window(&grid, object_size));
        let unlit = unlit.into_iter().map(Vec3::from).collect();
        Some(Self { grid, exponent, shift, unlit })
    }

    /// `s` at a point of the plane.
    pub(super) fn shift_at(&self, p: Vec3) -> Vec3 {
        self.grid.cell(self.grid.plane.flat(p)).map_or(Vec3::ZERO, |cell| self.shift[cell])
    }

    /// Color without light at a point of the plane.
    pub(super) fn unlit_at(&self, p: Vec3) -> Option<Vec3> {
        self.grid.cell(self.grid.plane.flat(p)).map(|cell| self.unlit[cell])
    }
}

fn mean(v: Vec3) -> f32 {
    v.element_sum() / 3.0
}

/// The mean of `value` over the cells of `around`, as seen from each cell. Squares of `2 radius + 1` cells, squares twice as wide
/// and so on, until all is in, have as much say as they have cells of `around` for their size.
///
/// So beyond `radius` cells count by the inverse square of their distance (Shepard 1968): the few that are nearest do not
/// outvote the rest. `around` is not empty.
fn mean_around(
    grid: &Grid,
    around: &[bool],
    radius: usize,
    value: impl Fn(usize) -> Vec3,
) -> Vec<Vec3> {
    let own: Vec<[f32; 4]> = (0..grid.cells())
        .map(|c| if around[c] { value(c).extend(1.0).to_array() } else { [0.0; 4] })
        .collect();
    let mut sums = vec![Vec4::ZERO; grid.cells()];
    let mut radius = radius.max(1);
    loop {
        let share = ((2 * radius + 1) as f32).powi(-2);
        for (sum, square) in sums.iter_mut().zip(boxed(grid.size, &own, radius)) {
            *sum += share * Vec4::from(square);
        }
        if radius >= grid.size[0].max(grid.size[1]) {
            break;
        }
        radius *= 2;
    }
    sums.iter().map(|sum| sum.truncate() / sum.w).collect()
}

/// The share of a mean square that texture does not explain (Wiener).
fn beyond(signal: f32, texture: f32) -> f32 {
    if signal > texture { 1.0 - texture / signal } else { 0.0 }
}

/// How a value differs between places of `around` that are `distance` cells apart.
struct Texture<'a, F> {
    grid: &'a Grid,
    around: &'a [bool],
    distance: usize,
    value: F,
    /// Means over squares of `2 distance + 1` cells.
    wide: Vec<Vec3>,
}

impl<'a, F: Fn(usize) -> f32> Texture<'a, F> {
    fn new(grid: &'a Grid, around: &'a [bool], distance: usize, value: F) -> Self {
        let wide = mean_around(grid, around, distance, |c| Vec3::splat(value(c)));
        Self { grid, around, distance, value, wide }
    }

    /// The mean square by which means over squares of `2 radius + 1` cells differ from those of the other places.
    fn power(&self, radius: usize) -> f64 {
        let Self { grid, around, distance, value, wide } = self;
        let ([width, height], distance) = (grid.size, *distance);
        let smooth = smoothed(grid, around, radius, value);
        let pairs = (0..grid.cells()).filter(|c| around[*c]).flat_map(|c| {
            let (x, y) = (c % width, c / width);
            let right = (x + distance < width).then_some(c + distance);
            let left = x.checked_sub(distance).map(|_| c - distance);
            let up = (y + distance < height).then_some(c + distance * width);
            let down = y.checked_sub(distance).map(|_| c - distance * width);
            [right, left, up, down].into_iter().flatten().map(move |n| (c, n))
        });
        power(pairs.filter(|(_, n)| around[*n]).map(|(c, n)| smooth[c] - wide[n].x))
    }

    /// The mean square, within squares of `2 window + 1` cells, by which means over squares of `2 radius + 1` differ from far means:
    /// what it is in three of four places at most.
    fn usual_power(&self, radius: usize, window: usize) -> f32 {
        let Self { grid, around, value, wide, .. } = self;
        let smooth = smoothed(grid, around, radius, value);
        let powers = smoothed(grid, around, window, |c| (smooth[c] - wide[c].x).powi(2));
        upper_quartile((0..grid.cells()).filter(|c| around[*c]).map(|c| powers[c]))
    }
}

/// The mean square.
fn power(values: impl Iterator<Item = f32>) -> f64 {
    let add = |(sum, n): (f64, f64), v: f32| (sum + f64::from(v * v), n + 1.0);
    let (sum, count) = values.fold((0.0, 0.0), add);
    sum / count.max(1.0)
}

/// The mean of `value` over the known cells of the square of `2 radius + 1` around each.
fn smoothed(grid: &Grid, known: &[bool], radius: usize, value: impl Fn(usize) -> f32) -> Vec<f32> {
    let sums: Vec<[f32; 2]> =
        (0..grid.cells()).map(|c| if known[c] { [value(c), 1.0] } else { [0.0; 2] }).collect();
    let sums = boxed(grid.size, &sums, radius);
    sums.iter().map(|s| if s[1] > 0.0 { s[0] / s[1] } else { 0.0 }).collect()
}

/// A value that a quarter reaches; 0 of nothing.
fn upper_quartile(values: impl Iterator<Item = f32>) -> f32 {
    let mut values: Vec<f32> = values.filter(|v| v.is_finite()).collect();
    quantile(&mut values, 0.75).unwrap_or(0.0)
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::*;

    /// A shadow on the left of a plane with blotches of texture; in the photos it is `depth` times as deep and its edge `off` cells
    /// farther right.
    ///
    /// Returns the error of the light with and without `s`, root mean squares.
    fn errors_of_light(texture: f32, off: usize, depth: f32) -> Option<[f32; 2]> {
        errors_with_island(texture, off, depth, false)
    }

    /// The same, with something dark amid the shadow whose light does not change.
    fn errors_with_island(texture: f32, off: usize, depth: f32, island: bool) -> Option<[f32; 2]> {
        let plane = Plane::new(DVec3::Z, DVec3::ZERO);
        let corners = [[-1.0, -1.0], [1.0, 1.0]].map(|f| plane.point(f));
        let grid = Grid::over(plane, &corners, 0.02, 0.0).expect("a grid");
        let width = grid.size[0];
        let edge = width / 2;
        let dark = |c: usize, edge: usize| if c % width < edge { -1.0 } else { 0.0 };
        let blotch = |c: usize| {
            let (x, y) = (c % width / 5, c / width / 5);
            let wave = (x as f32 * 12.9898 + y as f32 * 78.233).sin() * 43_758.547;
            texture * (2.0 * wave.fract().abs() - 1.0)
        };
        let cells = 0..grid.cells();
        let is_island = |c: usize| {
            island
                && (width / 8..width / 8 + 20).contains(&(c % width))
                && (40..60).contains(&(c / width))
        };
        let color = |c: usize| {
            let stain = if is_island(c) { -3.0 } else { 0.0 };
            Some(Vec3::splat((depth * dark(c, edge + off) + blotch(c) - 1.5 + stain).exp()))
        };
        let observed = Observed {
            radiance: cells.clone().map(color).collect(),
            blurred: vec![false; grid.cells()],
            log_before: cells
                .clone()
                .map(|c| Vec3::splat(if is_island(c) { 0.0 } else { dark(c, edge) }))
                .collect(),
            log_after: vec![Vec3::ZERO; grid.cells()],
        };
        let found = Calibration::new(grid, &observed, 0.25)?;
        let truth = |c: usize| depth * dark(c, edge + off);
        let kappa = found.exponent.expect("an inside").x;
        Some([1.0, 0.0].map(|share| {
            let error = |c| kappa * dark(c, edge) + share * found.shift[c].x - truth(c);
            power(cells.clone().filter(|&c| !is_island(c)).map(error)).sqrt() as f32
        }))
    }

    #[test]
    fn what_is_left_amid_a_shadow_says_nothing_about_the_ground_around() {
        let [with, without] = errors_with_island(0.02, 0, 1.2, true).expect("a shadow");
        assert!(without < 0.05, "the depth: {without}");
        assert!(with < 0.2, "{with}");
    }

    #[test]
    fn cells_count_by_the_inverse_square_of_their_distance() {
        let plane = Plane::new(DVec3::Z, DVec3::ZERO);
        let corners = [[-1.0, -1.0], [1.0, 1.0]].map(|f| plane.point(f));
        let grid = Grid::over(plane, &corners, 0.02, 0.0).expect("a grid");
        let width = grid.size[0];
        let at = |x: usize, y: usize| y * width + x;
        // Four dark cells near by, and ground farther off.
        let is_chip = |c: usize| (40..42).contains(&(c % width)) && (50..52).contains(&(c / width));
        let mut around: Vec<bool> =
            (0..grid.cells()).map(|c| c % width >= 60 || is_chip(c)).collect();
        let value =
            |c: usize| Vec3::new(if is_chip(c) { -3.0 } else { 0.0 }, (c % width) as f32, 2.0);
        let means = mean_around(&grid, &around, 4, value);
        let seen = means[at(30, 50)];
        assert!(seen.x < 0.0 && seen.x > -0.3 && (seen.z - 2.0).abs() < 1e-4, "{seen}");
        let (near, middle) = (means[at(65, 50)].y, means[at(80, 50)].y);
        assert!(middle - near > 5.0, "what is near counts: {near} {middle}");
        // Of two cells alone the one half as far has about four times the say.
        around.fill(false);
        [at(20, 50), at(80, 50)].iter().for_each(|c| around[*c] = true);
        let value = |c: usize| Vec3::splat(if c == at(20, 50) { 1.0 } else { 0.0 });
        let share = mean_around(&grid, &around, 1, value)[at(40, 50)].x;
        assert!((0.65..0.9).contains(&share), "{share}");
    }

    #[test]
    fn an_edge_beside_that_of_the_photos_is_moved_and_texture_is_no_edge() {
        let [with, without] = errors_of_light(0.05, 4, 1.0).expect("a shadow");
        assert!(with < 0.4 * without, "the edge: {with} of {without}");
        let [with, without] = errors_of_light(0.8, 0, 1.0).expect("a shadow");
        assert!(with < 1.3 * without, "texture: {with} of {without}");
    }

    #[test]
    fn a_deeper_shadow_is_believed_and_one_of_something_else_is_not() {
        let [with, _] = errors_of_light(0.05, 0, 1.5).expect("a shadow");
        assert!(with < 0.03, "{with}");
        assert!(errors_of_light(0.05, 0, 3.0).is_none());
    }
}
