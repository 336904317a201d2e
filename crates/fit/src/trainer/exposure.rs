//! Whether the photos differ so much in brightness that each gets an exposure of its own.

use motes_raster::{Modifiers, RenderOptions};

use rayon::prelude::*;

use super::Trainer;
use crate::exposure::{NEEDED_SPREAD, gain_spread};

/// Share of the run after which the need for exposures is judged.
const EXPOSURE_DECISION: f64 = 0.25;

impl Trainer {
    /// Whether per-photo exposures are being fitted.
    pub fn fits_exposure(&self) -> bool {
        self.exposure_on()
    }

    pub(super) fn exposure_on(&self) -> bool {
        self.state.exposure_on == Some(true)
    }

    /// Once the coarse colours stand, measures how much the photos' brightness differs.
    pub(super) fn decide_exposure(&mut self, progress: f64, stage: usize) {
        if self.state.exposure_on.is_some() || progress < EXPOSURE_DECISION {
            return;
        }
        self.views.par_iter().with_max_len(1).for_each(|view| {
            let _: usize = view.levels[stage].1.width;
        });
        let options = RenderOptions {
            background: self.background(),
            sh_degree_limit: Some(0),
            dials: self.options.raster,
            ..RenderOptions::default()
        };
        let modifiers = Modifiers::default();
        let mut pairs = Vec::with_capacity(self.views.len());
        for view in &self.views {
            let (transform, target) = &view.levels[stage];
            let image = self.frame.forward(&self.state.gaussians, transform, &modifiers, &options);
            pairs.push(target.brightness_pairs(image));
        }
        self.state.gain_spread = gain_spread(&pairs);
        self.state.exposure_on = Some(self.state.gain_spread > NEEDED_SPREAD);
    }
}
