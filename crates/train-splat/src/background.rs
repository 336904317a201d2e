//! What lies behind everything that the points describe: one color, or Gaussians on a far sphere.
//!
//! A photo that looks past the subject shows things so far away that no point was triangulated on
//! them. Without a model the fit hangs a curtain near the cameras, which every other view sees in
//! the wrong place. The far shell puts Gaussians where parallax does not matter; they are ordinary
//! Gaussians from then on, fitted and divided like all others, and any viewer shows them.

use glam::{DVec3, Vec3};
use motes_math::adam::{AdamOptions, adam_step};
use motes_math::sh::SH_C0;
use motes_math::sigmoid::logit;
use motes_raster::{Frame, Modifiers, Planes, RenderOptions};
use motes_scene::{Gaussians, SparsePoints};

use crate::target::{Target, TrainingView};

/// Distance of the shell over the extent of the cameras: parallax below 1/20 radian over the whole capture.
const RADIUS_EXTENTS: f64 = 20.0;
/// Spacing of the shell's Gaussians as a share of the longer image side.
const SPACING: f64 = 1.0 / 40.0;
/// Factor on the opacities while coverage is judged: the first Gaussians are faint.
const COVER_GAIN: f32 = 3.0;
/// Transmittance above which a pixel counts as covered by nothing.
const OPEN: f32 = 0.5;
/// Learning rate of the color.
const RATE: f32 = 1e-2;
/// Distance of the [`surroundings`] over that of the shell: behind every Gaussian of it, near enough to
/// share its parallax.
const BEHIND: f64 = 1.3;
/// Width of the kernel that colors them, radians: a few of their Gaussians, which stand 0.14 apart.
const REACH: f64 = 0.25;
/// Weight of the mean color, where all points in one place have 1: it takes over at four widths.
const MEAN_WEIGHT: f64 = 1e-3;
/// Gaussians of a closed sphere: of the surroundings, and of what stands for a single color in the model
/// that is written.
const DOME: usize = 642;

/// A background color under optimization.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct BackgroundColor {
    /// sRGB-encoded.
    pub value: [f32; 3],
    /// Adam's first moments.
    pub first: [f32; 3],
    /// Adam's second moments.
    pub second: [f32; 3],
    /// Steps taken.
    pub steps: u64,
}

impl BackgroundColor {
    pub(crate) fn new(value: [f32; 3]) -> Self {
        Self { value, ..Self::default() }
    }

    /// One step; `image` holds the transmittance in plane 3, `gradient` the loss gradient by color.
    pub(crate) fn step(&mut self, image: &Planes, gradient: &Planes) {
        let d = color_gradient(image, gradient);
        self.steps += 1;
        adam_step(
            &mut self.value,
            &d,
            &mut self.first,
            &mut self.second,
            &[RATE],
            self.steps,
            &AdamOptions::default(),
        );
        self.value = self.value.map(|v| v.clamp(0.0, 1.0));
    }
}

/// `∂L/∂background = Σ_pixels T ∂L/∂color`
fn color_gradient(image: &Planes, gradient: &Planes) -> [f32; 3] {
    std::array::from_fn(|c| {
        let rows = (0..image.height).map(|y| {
            let products = image.row(3, y).iter().zip(gradient.row(c, y));
            products.map(|(t, g)| f64::from(*t) * f64::from(*g)).sum::<f64>()
        });
        rows.sum::<f64>() as f32
    })
}

/// What the photos show where no Gaussian is.
pub(crate) struct OpenSky {
    /// Share of the photos' pixels.
    pub(crate) share: f64,
    /// Mean color there.
    pub(crate) mean: [f32; 3],
    /// Per view of `views`: 1 where open, `[height, width]`.
    open: Vec<Vec<bool>>,
}

impl OpenSky {
    /// Looks at one level of the views that `chosen` names.
    pub(crate) fn find(
        gaussians: &Gaussians,
        views: &[TrainingView],
        chosen: &[usize],
        level: usize,
    ) -> Self {
        let gains = vec![COVER_GAIN; gaussians.len()];
        let modifiers = Modifiers { filter_3d: None, opacity_gain: Some(&gains) };
        let options = RenderOptions { sh_degree_limit: Some(0), ..RenderOptions::default() };
        let mut frame = Frame::new();
        let (mut sums, mut count, mut pixels) = ([0.0; 3], 0.0, 0.0);
        let mut open = vec![Vec::new(); views.len()];
        for &view in chosen {
            let (transform, target) = &views[view].levels[level];
            let image = frame.forward(gaussians, transform, &modifiers, &options);
            let mut mask = Vec::with_capacity(target.width * target.height);
            for y in 0..target.height {
                for (x, &t) in image.row(3, y).iter().enumerate() {
                    let counts = counts(target, x, y);
                    mask.push(counts && t > OPEN);
                    pixels += f64::from(u8::from(counts));
                    if counts && t > OPEN {
                        count += 1.0;
                        for (c, sum) in sums.iter_mut().enumerate() {
                            *sum += f64::from(target.row(c, y)[x]) / 255.0;
                        }
                    }
                }
            }
            open[view] = mask;
        }
        let mean = sums.map(|s: f64| (s / f64::max(count, 1.0)) as f32);
        Self { share: count / f64::max(pixels, 1.0), mean, open }
    }

    /// Mean of the photos in direction `d` from afar, over the views that see nothing before it.
    fn color(&self, point: Vec3, views: &[TrainingView], level: usize) -> Option<[f32; 3]> {
        let (mut sum, mut count) = ([0.0f32; 3], 0.0f32);
        for (view, open) in views.iter().zip(&self.open).filter(|(_, open)| !open.is_empty()) {
            let (transform, target) = &view.levels[level];
            let p = transform.rotation * (point - transform.center);
            if !(p.z > 0.0) {
                continue;
            }
            let u = transform.focal[0] * p.x / p.z + transform.principal[0];
            let v = transform.focal[1] * p.y / p.z + transform.principal[1];
            let inside =
                u >= 0.0 && v >= 0.0 && (u as usize) < target.width && (v as usize) < target.height;
            if inside && open[v as usize * target.width + u as usize] {
                count += 1.0;
                for (c, sum) in sum.iter_mut().enumerate() {
                    *sum += f32::from(target.row(c, v as usize)[u as usize]) / 255.0;
                }
            }
        }
        (count > 0.0).then(|| sum.map(|s| s / count))
    }
}

fn counts(target: &Target, x: usize, y: usize) -> bool {
    target.weight.as_ref().is_none_or(|w| w[y * target.width + x] > 0)
}

/// Where the shell stands: its center and radius, beyond the cameras and nearly all points.
pub(crate) fn place(views: &[TrainingView], points: &SparsePoints, extent: f64) -> (DVec3, f64) {
    let centers: Vec<DVec3> = views.iter().map(|v| v.levels[0].0.center.as_dvec3()).collect();
    let center = centers.iter().sum::<DVec3>() / centers.len().max(1) as f64;
    let mut distances: Vec<f64> = points
        .positions
        .iter()
        .map(|p| (Vec3::from(*p).as_dvec3() - center).length())
        .filter(|d| d.is_finite())
        .collect();
    let far = match distances.len() {
        0 => 0.0,
        n => *distances.select_nth_unstable_by(n * 99 / 100, f64::total_cmp).1,
    };
    (center, (RADIUS_EXTENTS * extent).max(1.5 * far))
}

/// At most `most` Gaussians on the sphere, in the open directions of the photos.
pub(crate) fn shell(
    sky: &OpenSky,
    views: &[TrainingView],
    level: usize,
    (center, radius): (DVec3, f64),
    most: usize,
) -> Gaussians {
    let finest = views.iter().map(|view| {
        let t = &view.levels[level].0;
        t.size[0].max(t.size[1]) as f64 / f64::from(t.focal[0].max(t.focal[1]))
    });
    let angle = (finest.fold(f64::INFINITY, f64::min) * SPACING).clamp(2e-3, 0.5);
    let directions = (4.0 * std::f64::consts::PI / (angle * angle)) as usize;
    let mut found: Vec<(Vec3, [f32; 3])> = Vec::new();
    for i in 0..directions {
        let point = (center + radius * fibonacci(i, directions)).as_vec3();
        if let Some(color) = sky.color(point, views, level) {
            found.push((point, color));
        }
    }
    let take = found.len().min(most);
    let spread = (found.len() as f64 / take.max(1) as f64).sqrt();
    let mut g = Gaussians::empty(0);
    for i in 0..take {
        let (point, color) = found[(i as u64 * found.len() as u64 / take as u64) as usize];
        push(&mut g, point, color, (0.7 * angle * spread * radius) as f32, 0.9);
    }
    g
}

/// At most `most` Gaussians on a closed sphere behind the `shell`, for the directions that no photo shows:
/// the mean of the shell nearby, and far from all of it `mean`. Black there would be seen as soon as a view
/// turns a little farther than the photos did.
pub(crate) fn surroundings(
    shell: &Gaussians,
    mean: [f32; 3],
    (center, radius): (DVec3, f64),
    most: usize,
) -> Gaussians {
    let seen: Vec<(DVec3, [f64; 3])> = (0..shell.len())
        .map(|i| {
            let direction = Vec3::from(shell.means[i]).as_dvec3() - center;
            let color = std::array::from_fn(|c| 0.5 + SH_C0 * f64::from(shell.sh_of(i)[c]));
            (direction.normalize_or_zero(), color)
        })
        .collect();
    let color = |direction: DVec3| {
        let mut sum = mean.map(|m| MEAN_WEIGHT * f64::from(m));
        let mut weights = MEAN_WEIGHT;
        for (other, color) in &seen {
            let kernel = ((direction.dot(*other) - 1.0) / (REACH * REACH)).exp();
            let weight = kernel / seen.len() as f64;
            weights += weight;
            for (sum, c) in sum.iter_mut().zip(color) {
                *sum += weight * c;
            }
        }
        sum.map(|s| (s / weights) as f32)
    };
    sphere(color, (center, BEHIND * radius), DOME.min(most))
}

/// A closed sphere of `count` nearly opaque Gaussians, colored by their directions.
fn sphere(
    color: impl Fn(DVec3) -> [f32; 3],
    (center, radius): (DVec3, f64),
    count: usize,
) -> Gaussians {
    let spacing = (4.0 * std::f64::consts::PI / count.max(1) as f64).sqrt() * radius;
    let mut g = Gaussians::empty(0);
    for i in 0..count {
        let direction = fibonacci(i, count);
        let point = (center + radius * direction).as_vec3();
        push(&mut g, point, color(direction), spacing as f32, 0.99);
    }
    g
}

/// A closed sphere of one color: what a background color becomes in a file that has none.
pub(crate) fn dome(color: [f32; 3], center: DVec3, radius: f64) -> Gaussians {
    sphere(|_| color, (center, radius), DOME)
}

/// Point `i` of `n` nearly evenly spread on the unit sphere: the golden angle.
fn fibonacci(i: usize, n: usize) -> DVec3 {
    let z = 1.0 - (2.0 * i as f64 + 1.0) / n as f64;
    let azimuth = i as f64 * std::f64::consts::PI * (3.0 - 5f64.sqrt());
    let r = (1.0 - z * z).max(0.0).sqrt();
    DVec3::new(r * azimuth.cos(), r * azimuth.sin(), z)
}

fn push(g: &mut Gaussians, mean: Vec3, color: [f32; 3], scale: f32, opacity: f32) {
    g.means.push(mean.to_array());
    g.rotations.push([1.0, 0.0, 0.0, 0.0]);
    g.log_scales.push([scale.max(f32::MIN_POSITIVE).ln(); 3]);
    g.opacity_logits.push(logit(opacity));
    g.sh.extend(color.map(|c| (c - 0.5) / SH_C0 as f32));
}

/// Appends `more`, brought to the degree of `gaussians`.
pub(crate) fn append(gaussians: &mut Gaussians, more: &Gaussians) {
    let more = more.with_sh_degree(gaussians.sh_degree);
    gaussians.means.extend(more.means);
    gaussians.rotations.extend(more.rotations);
    gaussians.log_scales.extend(more.log_scales);
    gaussians.opacity_logits.extend(more.opacity_logits);
    gaussians.sh.extend(more.sh);
}

#[cfg(test)]
mod tests;
