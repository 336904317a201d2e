//! What a term of the image loss is given and what it adds.

use motes_raster::Planes;
use rayon::prelude::*;

use crate::loss::ColorTransform;
use crate::loss::band::Rows;
use crate::loss::rows::PAD;
use crate::target::Target;

/// A term of the image loss: a file in this folder, named in [`super::LOSS_TERMS`].
pub trait LossTerm: Sync {
    /// Its name in `--loss-term NAME=WEIGHT`.
    fn name(&self) -> &'static str;

    /// A line for the help.
    fn about(&self) -> &'static str;

    /// The value; adds `weight` times the gradient by the rendering to `gradient`, `[3][height * width]`. Every pixel that
    /// does not [count](Picture::counts) has no influence on either.
    fn evaluate(&self, picture: &Picture<'_>, weight: f32, gradient: &mut [Vec<f32>; 3]) -> f64;
}

/// A rendering and its photo, sRGB-encoded, 0 to 1.
pub struct Picture<'a> {
    /// Columns.
    pub width: usize,
    /// Rows.
    pub height: usize,
    /// `[3][height * width]`: the rendering after the color transform of the view; that of the photo where a pixel does not count.
    pub rendering: [Vec<f32>; 3],
    /// `[3][height * width]`: the photo over the background.
    pub photo: [Vec<f32>; 3],
    weight: Option<&'a [u8]>,
}

impl<'a> Picture<'a> {
    pub(super) fn new(
        render: &Planes,
        target: &'a Target,
        background: [f32; 3],
        transform: ColorTransform,
    ) -> Self {
        let (width, height) = (target.width, target.height);
        let rows = Rows { render, target, background, transform };
        let channel = |c: usize| -> (Vec<f32>, Vec<f32>) {
            let (mut x, mut y) = (Vec::new(), Vec::new());
            let (mut x_row, mut y_row) = (vec![0.0; width + 2 * PAD], vec![0.0; width + 2 * PAD]);
            for row in 0..height {
                rows.load(c, row, &mut x_row, &mut y_row);
                x.extend_from_slice(&x_row[PAD..PAD + width]);
                y.extend_from_slice(&y_row[PAD..PAD + width]);
            }
            (x, y)
        };
        let mut loaded: Vec<_> = (0..3).into_par_iter().map(channel).collect();
        let mut rendering: [Vec<f32>; 3] = Default::default();
        let mut photo: [Vec<f32>; 3] = Default::default();
        for c in 0..3 {
            (rendering[c], photo[c]) = std::mem::take(&mut loaded[c]);
        }
        Self { width, height, rendering, photo, weight: target.weight.as_deref() }
    }

    /// Values in all channels.
    pub fn count(&self) -> usize {
        3 * self.width * self.height
    }

    /// Whether pixel `i`, row-major, is not masked out.
    pub fn counts(&self, i: usize) -> bool {
        self.weight.is_none_or(|weight| weight[i] != 0)
    }
}
