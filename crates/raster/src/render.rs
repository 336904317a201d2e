//! One picture with its AOVs.

use motes_scene::{Gaussians, ImageF32, Pinhole, Pose};

use crate::aovs::{tile_aovs, tile_depth_median};
use crate::frame::Frame;
use crate::options::{Modifiers, RenderOptions};
use crate::planes::Planes;
use crate::view::ViewTransform;

/// Depth and normals of a rendering.
#[derive(Clone, Debug, PartialEq)]
pub struct Aovs {
    /// Mean depth weighted by contribution, `[h, w, 1]`: camera z, world units; 0 where nothing is. A Gaussian lies where the ray passes
    /// its densest point, up to three standard deviations from its center.
    pub depth_expected: ImageF32,
    /// Depth of the Gaussian at which the transmittance passes 1/2, same units; 0 where it never does.
    pub depth_median: ImageF32,
    /// Unit normal in world axes, `[h, w, 3]`: shortest axes of the Gaussians, facing the camera,
    /// weighted by contribution; 0 where nothing is.
    pub normal_in_world: ImageF32,
}

/// A rendered view.
#[derive(Clone, Debug, PartialEq)]
pub struct Rendering {
    /// `[h, w, 3]`, sRGB-encoded, over the background, may exceed 1.
    pub color: ImageF32,
    /// `[h, w, 1]` in [0, 1].
    pub alpha: ImageF32,
    /// Present when asked for.
    pub aovs: Option<Aovs>,
}

/// Renders `gaussians` through `camera` placed at `camera_from_world`.
///
/// Zero Gaussians, Gaussians with non-finite values and empty images are fine: what cannot be
/// drawn is left out.
pub fn render(
    gaussians: &Gaussians,
    camera: &Pinhole,
    camera_from_world: &Pose,
    options: &RenderOptions,
) -> Rendering {
    let (painter, mut rendering) = Painter::new(gaussians, camera, camera_from_world, options);
    let Painter { frame, view, .. } = &painter;
    rendering.aovs = options.aovs.then(|| tile_aovs(frame, gaussians, view, &options.parameters));
    rendering
}

/// Depth of the Gaussian at which the transmittance passes 1/2, `[h, w, 1]`, camera z, world units; 0 where the coverage is less
/// than `least_alpha` (at least 1/2). The same as [`Aovs::depth_median`] there, in less time: nothing is looked at behind it.
pub fn render_depth_median(
    gaussians: &Gaussians,
    camera: &Pinhole,
    camera_from_world: &Pose,
    options: &RenderOptions,
    least_alpha: f32,
) -> ImageF32 {
    let (painter, _) = Painter::new(gaussians, camera, camera_from_world, options);
    let Painter { frame, view, .. } = &painter;
    tile_depth_median(frame, gaussians, view, &options.parameters, least_alpha)
}

/// Gaussians before a camera, to be drawn in more than one set of colors: where they are on the image, their
/// order and their lists per tile are found once, which is more than half of a picture.
#[derive(Debug)]
pub struct Painter {
    frame: Frame,
    view: ViewTransform,
    options: RenderOptions,
}

impl Painter {
    /// Also draws `gaussians` in their own colors, without AOVs.
    pub fn new(
        gaussians: &Gaussians,
        camera: &Pinhole,
        camera_from_world: &Pose,
        options: &RenderOptions,
    ) -> (Self, Rendering) {
        let view = ViewTransform::new(camera, camera_from_world);
        let mut frame = Frame::new();
        let first = rendering(frame.forward(gaussians, &view, &Modifiers::default(), options));
        (Self { frame, view, options: options.clone() }, first)
    }

    /// Draws them in other colors, `color` of Gaussian `i`, numbers from 0 on; what is below 0 or NaN becomes 0.
    pub fn paint(&mut self, color: impl Fn(usize) -> [f32; 3] + Sync) -> Rendering {
        rendering(self.frame.repaint(color, &self.options))
    }

    /// Draws them in the colors of `others`, which differ from them in nothing else.
    ///
    /// # Panics
    /// When their number differs.
    pub fn paint_as(&mut self, others: &Gaussians) -> Rendering {
        rendering(self.frame.repaint_as(others, &self.options))
    }
}

fn rendering(planes: &Planes) -> Rendering {
    let color = planes.to_image(0, 3);
    let mut alpha = planes.to_image(3, 1);
    for value in &mut alpha.data {
        *value = 1.0 - *value;
    }
    Rendering { color, alpha, aovs: None }
}

#[cfg(test)]
mod tests {
    use glam::{DQuat, DVec3};

    use super::*;
    use crate::options::Antialias;

    #[test]
    fn painting_anew_is_rendering_with_the_other_colors() {
        let n = 3000;
        let at = |i: usize, k: f32| (i as f32 * k).sin();
        let mut first = Gaussians {
            means: (0..n).map(|i| [at(i, 1.3), at(i, 2.7), at(i, 0.7)]).collect(),
            rotations: (0..n).map(|i| [1.0, at(i, 3.1), at(i, 0.3), 0.2]).collect(),
            log_scales: (0..n).map(|i| [-3.0 + at(i, 5.0), -3.5, -4.0]).collect(),
            opacity_logits: (0..n).map(|i| 3.0 * at(i, 7.7)).collect(),
            sh_degree: 2,
            sh: (0..27 * n).map(|i| 0.4 * at(i, 0.77)).collect(),
            extra: Vec::new(),
        };
        // One that is nowhere.
        first.means[17] = [f32::NAN; 3];
        let mut second = first.clone();
        second.sh.iter_mut().for_each(|v| *v = 0.3 - *v);
        let camera = Pinhole { width: 93, height: 61, fx: 80.0, fy: 80.0, cx: 46.0, cy: 31.0 };
        let pose = Pose { rotation: DQuat::IDENTITY, translation: DVec3::new(0.1, 0.0, 2.5) };
        let options = RenderOptions { antialias: Antialias::Mip, ..RenderOptions::default() };
        let (mut painter, drawn) = Painter::new(&first, &camera, &pose, &options);
        assert_eq!(drawn, render(&first, &camera, &pose, &options));
        assert_eq!(painter.paint_as(&second), render(&second, &camera, &pose, &options));
        let flat = first.colored(|i| [0.1, (i % 7) as f32 / 7.0, 0.9]);
        let expected = render(&flat, &camera, &pose, &options).color.data;
        let painted = painter.paint(|i| [0.1, (i % 7) as f32 / 7.0, 0.9]).color.data;
        let apart = painted.iter().zip(&expected).map(|(a, b)| (a - b).abs()).fold(0.0, f32::max);
        assert!(apart < 1e-6, "{apart}");
        let dark = painter.paint(|i| if i % 2 == 0 { [f32::NAN; 3] } else { [-1.0; 3] });
        assert!(dark.color.data.iter().all(|v| *v == 0.0));
    }

    #[test]
    fn the_median_alone_is_that_of_all_aovs_where_enough_is_covered() {
        let n = 800;
        let at = |i: usize, k: f32| (i as f32 * k).sin();
        let gaussians = Gaussians {
            means: (0..n).map(|i| [at(i, 1.3), at(i, 2.7), at(i, 0.7)]).collect(),
            rotations: (0..n).map(|i| [1.0, at(i, 3.1), at(i, 0.3), 0.2]).collect(),
            log_scales: vec![[-2.3, -2.0, -3.5]; n],
            opacity_logits: (0..n).map(|i| 2.0 * at(i, 5.3)).collect(),
            sh_degree: 0,
            sh: (0..3 * n).map(|i| at(i, 1.9)).collect(),
            extra: Vec::new(),
        };
        let camera = Pinhole { fx: 60.0, fy: 60.0, cx: 32.0, cy: 24.0, width: 64, height: 48 };
        let pose = Pose { rotation: DQuat::IDENTITY, translation: DVec3::new(0.0, 0.0, 3.0) };
        let options = RenderOptions { aovs: true, ..RenderOptions::default() };
        let all = render(&gaussians, &camera, &pose, &options);
        let alone = render_depth_median(&gaussians, &camera, &pose, &options, 0.6);
        let median = &all.aovs.as_ref().expect("asked for").depth_median.data;
        let mut counts = [0, 0];
        for ((alone, median), alpha) in alone.data.iter().zip(median).zip(&all.alpha.data) {
            if *alpha > 0.601 {
                assert_eq!(alone, median);
                counts[1] += 1;
            } else if *alpha < 0.599 {
                assert_eq!(*alone, 0.0);
                counts[0] += 1;
            }
        }
        assert!(counts.iter().all(|&c| c > 100), "{counts:?}");
    }
}
