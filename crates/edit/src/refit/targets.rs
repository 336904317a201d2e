//! Photos as they would be after the edit.

use glam::{DVec3, Vec3};
use motes_math::resample::{Filter, resize};
use motes_math::srgb;
use motes_math::tone_curve::ToneCurve;
use motes_raster::{Antialias, RenderOptions, ViewTransform, render, render_scalars};
use motes_scene::{Gaussians, ImageF32, Pinhole, Pose};
use train_splat::TrainingImage;

use super::{Fills, marks};
use crate::EditState;
use crate::grown::grown;

/// Pictures are cut out around what is fitted, and no larger than this: a filling is not as fine as photos can be.
const MOST_PIXELS: usize = 640;
/// Around it, share of its size in the picture: what the exposure of a photo is compared by.
const MARGIN: f64 = 0.25;
/// An object is in the way where it has more than this share of a pixel,
const IN_THE_WAY: f32 = 0.02;
/// and this close to where it has, share of the size of what is cut out.
const OUTLINE: f32 = 0.012;
/// Pixels that the fitted Gaussians have less of teach nothing.
const LEAST_SHARE: f32 = 0.02;
/// Light that changed by more is not believed: what is left of the photo there is noise.
const MOST_CHANGE: f32 = 8.0;
/// Linear values below are noise, too: one step of 255.
const DARK: f32 = 3e-3;
/// Values from here on are clipped.
const CLIPPED: f32 = 0.985;
/// Means are taken over squares of about this share of the side of what was filled.
const BLUR: f32 = 0.4;
/// Weight of what stays against what a photo says: one photo that sees a place outvotes those that do not.
const STAYING: f32 = 0.02;
/// Pixels that a gain is taken from.
const LEAST_PIXELS: usize = 256;
/// Light that changed less is the same.
const SAME: f32 = 0.01;

/// A picture to fit to.
pub(super) struct Target {
    pub(super) view: ViewTransform,
    /// sRGB-encoded, `[h w]`.
    pub(super) color: Vec<Vec3>,
    pub(super) weight: Vec<f32>,
    /// Whether the photo says it.
    pub(super) is_photo: Vec<bool>,
    /// Pixels where it does.
    pub(super) believed: usize,
}

/// What is needed to bring photos to the light of after.
pub(super) struct Sights<'a> {
    before: &'a Gaussians,
    after: &'a Gaussians,
    /// What left, of the rows before.
    gone: Vec<f32>,
    /// What is new and no filling, or of another material, of the rows after.
    arrived: Vec<f32>,
    filled: Vec<f32>,
    fitted: Vec<f32>,
    rows: &'a [u32],
    antialias: Antialias,
    tone_curve: ToneCurve,
}

impl<'a> Sights<'a> {
    pub(super) fn new(
        state: &'a EditState,
        before: &'a Gaussians,
        fills: &Fills,
        rows: &'a [u32],
        antialias: Antialias,
    ) -> Self {
        let change = state.change();
        let after = &state.gaussians;
        let mut arrived = marks(after, change.placed.into_iter().chain(change.material));
        rows.iter().for_each(|row| arrived[*row as usize] = 0.0);
        Self {
            before,
            after,
            gone: marks(before, change.removed),
            arrived,
            filled: marks(after, fills.filled.iter().copied()),
            fitted: marks(after, rows.iter().copied()),
            rows,
            antialias,
            tone_curve: state.tone_curve(),
        }
    }

    /// What a photo says about the fitted Gaussians; none when it does not show them.
    pub(super) fn target(&self, photo: &TrainingImage) -> Option<Target> {
        let cut = self.cut(&photo.camera, &photo.camera_from_world)?;
        let (camera, pose) = (&cut.camera, &photo.camera_from_world);
        let options = RenderOptions { antialias: self.antialias, ..RenderOptions::default() };
        let before = linear(&render(self.before, camera, pose, &options).color);
        let shown = render(self.after, camera, pose, &options).color;
        let after = linear(&shown);
        let gone = render_scalars(self.before, &[&self.gone], camera, pose, &options);
        let planes = [&self.arrived[..], &self.filled, &self.fitted];
        let now = render_scalars(self.after, &planes, camera, pose, &options);
        let [arrived, filled, fitted] = [0, 1, 2].map(|c| plane(&now, c));
        let (seen, is_known) = cut.photo(photo, self.tone_curve);
        let size = [camera.width, camera.height];
        let outline = (OUTLINE * camera.width.max(camera.height) as f32).ceil() as usize;
        let in_the_way = |p: usize| gone.data[3 * p].max(arrived[p]) > IN_THE_WAY;
        let hidden: Vec<bool> = (0..fitted.len()).map(in_the_way).collect();
        let hidden = grown(size, &hidden, outline.max(2));
        let clear = |p: usize| is_known[p] && !hidden[p];
        let gain = gain(&seen, &before, &after, |p| clear(p) && filled[p] < LEAST_SHARE);
        let seen: Vec<Vec3> = seen.iter().map(|c| *c * gain).collect();
        let lit = |p: usize| clear(p) && seen[p].min_element() > DARK;
        let area = filled.iter().sum::<f32>();

        let radius = ((0.5 * BLUR * area.sqrt()).round() as usize).max(1);
        // What was filled is compared with what was filled: beside it the light may be another.
        let weight: Vec<f32> =
            (0..seen.len()).map(|p| if lit(p) { filled[p].max(1e-3) } else { 0.0 }).collect();
        let [smooth_after, smooth_seen] =
            [&after, &seen].map(|image| blurred(size, image, &weight, radius));
        let mut target = Target {
            view: ViewTransform::new(camera, pose),
            color: shown.data.chunks_exact(3).map(Vec3::from_slice).collect(),
            weight: vec![0.0; seen.len()],
            is_photo: vec![false; seen.len()],
            believed: 0,
        };
        for p in (0..seen.len()).filter(|p| fitted[*p] >= LEAST_SHARE) {
            let log = |a: Vec3, b: Vec3| {
                (a.max(Vec3::splat(DARK)) / b.max(Vec3::splat(DARK))).map(f32::ln)
            };
            let own = log(after[p], before[p]);
            let smooth = log(smooth_after[p], smooth_seen[p]);
            let f = filled[p].clamp(0.0, 1.0);
            let change = (own * (1.0 - f) + smooth * f).map(f32::exp);
            let is_same = (change - Vec3::ONE).abs().max_element() < SAME;
            let clipped = seen[p].max_element() > CLIPPED && !is_same;
            let believed = lit(p)
                && !clipped
                && change.max_element() < MOST_CHANGE
                && change.min_element() > 1.0 / MOST_CHANGE;
            target.weight[p] = STAYING;
            if believed {
                target.color[p] = (seen[p] * change).clamp(Vec3::ZERO, Vec3::ONE).map(srgb::encode);
                // Noise of a photo is as many times larger as it is made brighter.
                target.weight[p] = change.max_element().max(1.0).powi(-2).max(STAYING);
                target.is_photo[p] = true;
                target.believed += 1;
            }
        }
        target.weight.iter().any(|w| *w > 0.0).then_some(target)
    }

    /// The part of a picture that shows the fitted Gaussians.
    fn cut(&self, camera: &Pinhole, camera_from_world: &Pose) -> Option<Cut> {
        let (mut low, mut high) = ([f64::INFINITY; 2], [f64::NEG_INFINITY; 2]);
        for &row in self.rows {
            let mean = Vec3::from(self.after.means[row as usize]).as_dvec3();
            let p: DVec3 = camera_from_world.transform_point(mean);
            let scales = self.after.log_scales[row as usize];
            let reach = 3.0 * f64::from(scales.into_iter().fold(f32::MIN, f32::max).exp());
            if !(p.z > reach && reach.is_finite()) {
                continue;
            }
            let at = [camera.fx * p.x / p.z + camera.cx, camera.fy * p.y / p.z + camera.cy];
            let reach = reach * camera.fx.max(camera.fy) / p.z;
            for k in 0..2 {
                (low[k], high[k]) = (low[k].min(at[k] - reach), high[k].max(at[k] + reach));
            }
        }
        let margin = MARGIN * (high[0] - low[0]).max(high[1] - low[1]);
        let full = [camera.width, camera.height];
        let first = [0, 1].map(|k| (low[k] - margin).floor().clamp(0.0, full[k] as f64) as usize);
        let last = [0, 1].map(|k| (high[k] + margin).ceil().clamp(0.0, full[k] as f64) as usize);
        let size = [0, 1].map(|k: usize| last[k].saturating_sub(first[k]));
        if size[0] < 8 || size[1] < 8 {
            return None;
        }
        let part = Pinhole {
            cx: camera.cx - first[0] as f64,
            cy: camera.cy - first[1] as f64,
            width: size[0],
            height: size[1],
            ..*camera
        };
        let coarser = (size[0].max(size[1]) as f64 / MOST_PIXELS as f64).max(1.0);
        let side = |n: usize| ((n as f64 / coarser).round() as usize).max(1);
        Some(Cut { first, size, camera: part.resized(side(size[0]), side(size[1])) })
    }
}

/// A part of a photo, maybe coarser.
struct Cut {
    first: [usize; 2],
    size: [usize; 2],
    camera: Pinhole,
}

impl Cut {
    /// Linear values without the tone curve, brought to the exposure of the model, and whether they are known.
    fn photo(&self, photo: &TrainingImage, curve: ToneCurve) -> (Vec<Vec3>, Vec<bool>) {
        let image = &photo.image;
        let gain = photo.exposure_gain.max(1e-3);
        let mut values = Vec::with_capacity(4 * self.size[0] * self.size[1]);
        for y in self.first[1]..self.first[1] + self.size[1] {
            for x in self.first[0]..self.first[0] + self.size[0] {
                let pixel = image.pixel(x, y);
                let channel = |c: usize| f32::from(pixel[c.min(image.channels - 1)]) / 255.0 / gain;
                values.extend([0, 1, 2].map(|c| srgb::decode(curve.invert(channel(c)))));
                let masked = photo.mask.as_ref().is_some_and(|m| m.pixel(x, y)[0] < 128);
                let transparent = pixel.get(3).is_some_and(|alpha| *alpha < 128);
                values.push(f32::from(u8::from(!masked && !transparent)));
            }
        }
        let to = (self.camera.width, self.camera.height);
        if to != (self.size[0], self.size[1]) {
            values = resize(&values, (self.size[0], self.size[1], 4), to, Filter::Box);
        }
        let pixels = || values.chunks_exact(4);
        (pixels().map(Vec3::from_slice).collect(), pixels().map(|p| p[3] > 0.99).collect())
    }
}

fn linear(image: &ImageF32) -> Vec<Vec3> {
    let pixel = |p: &[f32]| Vec3::from_slice(p).clamp(Vec3::ZERO, Vec3::ONE).map(srgb::decode);
    image.data.chunks_exact(3).map(pixel).collect()
}

fn plane(image: &ImageF32, channel: usize) -> Vec<f32> {
    image.data.iter().skip(channel).step_by(image.channels).copied().collect()
}

/// Factor per channel that makes the photo as bright as the model where nothing changed; 1 where too little says so.
fn gain(seen: &[Vec3], before: &[Vec3], after: &[Vec3], is_clear: impl Fn(usize) -> bool) -> Vec3 {
    let (mut model, mut photo, mut count) = (Vec3::ZERO, Vec3::ZERO, 0);
    for p in (0..seen.len()).filter(|p| is_clear(*p)) {
        let bound = SAME * before[p].max_element();
        let is_same = (after[p] - before[p]).abs().max_element() <= bound;
        if is_same && seen[p].max_element() < CLIPPED {
            (model, photo, count) = (model + before[p], photo + seen[p], count + 1);
        }
    }
    let known = count >= LEAST_PIXELS && photo.min_element() > 0.0;
    let gain = if known { model / photo } else { Vec3::ONE };
    gain.clamp(Vec3::splat(0.25), Vec3::splat(4.0))
}

/// Means over squares, twice; black where nothing has weight.
fn blurred(
    [width, height]: [usize; 2],
    values: &[Vec3],
    weight: &[f32],
    radius: usize,
) -> Vec<Vec3> {
    let mut sums: Vec<[f32; 4]> =
        values.iter().zip(weight).map(|(v, w)| (*v * *w).extend(*w).to_array()).collect();
    let along = |sums: &[[f32; 4]], lines: usize, length: usize, stride: usize, step: usize| {
        let mut out = vec![[0.0f32; 4]; sums.len()];
        for line in 0..lines {
            for i in 0..length {
                let sum = &mut out[line * stride + i * step];
                for j in i.saturating_sub(radius)..(i + radius + 1).min(length) {
                    let from = sums[line * stride + j * step];
                    sum.iter_mut().zip(from).for_each(|(s, v)| *s += v);
                }
            }
        }
        out
    };
    for _ in 0..2 {
        sums = along(&sums, height, width, width, 1);
        sums = along(&sums, width, height, 1, width);
    }
    let mean = |[r, g, b, w]: [f32; 4]| {
        if w > 0.0 { Vec3::new(r, g, b) / w } else { Vec3::ZERO }
    };
    sums.into_iter().map(mean).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn marks_grow_by_squares_and_means_ignore_what_has_no_weight() {
        let size = [7, 5];
        let mut one = vec![false; 35];
        one[2 * 7 + 3] = true;
        let marks = grown(size, &one, 1);
        let expected = |p: usize| (2..=4).contains(&(p % 7)) && (1..=3).contains(&(p / 7));
        assert!((0..35).all(|p| marks[p] == expected(p)), "{marks:?}");
        let values: Vec<Vec3> =
            (0..35).map(|p| Vec3::splat(if p < 7 { 9.0 } else { 0.5 })).collect();
        let weight: Vec<f32> = (0..35).map(|p| if p < 7 { 0.0 } else { 2.0 }).collect();
        let means = blurred(size, &values, &weight, 1);
        assert!(means.iter().all(|m| (*m - Vec3::splat(0.5)).abs().max_element() < 1e-5));
    }
}
