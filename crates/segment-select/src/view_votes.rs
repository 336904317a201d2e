//! What the masks of some views say about Gaussians, and so about the other views.

use crate::view_data::{Segment, ViewData};

/// A Gaussian that masked views show less than this, pixels, is not known.
const SEEN_PX: f32 = 0.05;
/// From this share of the known on, a superpixel shows the object.
const MOSTLY: f32 = 0.5;
/// Of a superpixel that shows the object as much is known.
const LEAST_KNOWN: f32 = 0.2;

/// Votes of masked views: contributions of each Gaussian inside the masks, and in all, pixels.
#[derive(Clone, Debug)]
pub(crate) struct ViewVotes {
    inside: Vec<f32>,
    all: Vec<f32>,
}

/// Votes as a view shows them, per superpixel, shares of it.
#[derive(Clone, Debug)]
pub(crate) struct Projection {
    /// What belongs.
    pub(crate) inside: Vec<f32>,
    /// What is known, whether it belongs or not.
    pub(crate) known: Vec<f32>,
}

impl ViewVotes {
    pub(crate) fn new(gaussians: usize) -> Self {
        Self { inside: vec![0.0; gaussians], all: vec![0.0; gaussians] }
    }

    /// Adds the mask of a view, shares of its superpixels; `weight` -1 takes it back.
    pub(crate) fn add(&mut self, view: &ViewData, mask: &[f32], weight: f32) {
        for (s, &m) in mask.iter().enumerate() {
            for (i, w) in view.votes.of(s) {
                self.inside[i as usize] += weight * m * w;
                self.all[i as usize] += weight * w;
            }
        }
    }

    /// The votes as a view shows them.
    pub(crate) fn projected(&self, view: &ViewData) -> Projection {
        let of = |s: usize| {
            let (mut inside, mut known, mut all) = (0.0f32, 0.0f32, 0.0f32);
            for (i, w) in view.votes.of(s) {
                let seen = self.all[i as usize];
                all += w;
                if seen > SEEN_PX {
                    known += w;
                    inside += w * (self.inside[i as usize] / seen).clamp(0.0, 1.0);
                }
            }
            if all > 0.0 { (inside / all, known / all) } else { (0.0, 0.0) }
        };
        let (inside, known) = (0..view.segments.len()).map(of).unzip();
        Projection { inside, known }
    }
}

impl Projection {
    /// Whether a superpixel shows the object.
    pub(crate) fn shows(&self, s: usize) -> bool {
        self.inside[s] >= MOSTLY * self.known[s] && self.known[s] >= LEAST_KNOWN
    }

    /// The superpixels that show the object.
    pub(crate) fn object(&self) -> Vec<bool> {
        (0..self.inside.len()).map(|s| self.shows(s)).collect()
    }

    /// Area of the object, and of what is not known on it and beside it, pixels.
    pub(crate) fn areas(&self, view: &ViewData, object: &[bool]) -> [f32; 2] {
        let mut near = object.to_vec();
        for border in &view.borders {
            let [a, b] = border.segments.map(|s| s as usize);
            (near[a], near[b]) = (near[a] || object[b], near[b] || object[a]);
        }
        let mut areas = [0.0; 2];
        for (s, segment) in view.segments.iter().enumerate() {
            areas[0] += if object[s] { segment.area_px } else { 0.0 };
            areas[1] += if near[s] { segment.area_px * (1.0 - self.known[s]) } else { 0.0 };
        }
        areas
    }

    /// Intersection over union with the mask of a view, where something is known.
    pub(crate) fn agreement(&self, segments: &[Segment], mask: &[f32]) -> f64 {
        let (mut both, mut either) = (0.0f64, 0.0f64);
        for (s, segment) in segments.iter().enumerate() {
            let (area, inside) = (f64::from(segment.area_px), self.inside[s]);
            let masked = mask[s] * self.known[s];
            both += area * f64::from(inside.min(masked));
            either += area * f64::from(inside.max(masked));
        }
        if either > 0.0 { both / either } else { 0.0 }
    }
}

/// How many superpixels deep each of a set lies in it, 1 at its edge, 0 outside; the border of the picture is no edge.
pub(crate) fn depths(view: &ViewData, object: &[bool]) -> Vec<u32> {
    let mut neighbors = vec![Vec::new(); object.len()];
    for border in &view.borders {
        let [a, b] = border.segments.map(|s| s as usize);
        neighbors[a].push(b);
        neighbors[b].push(a);
    }
    let mut depth: Vec<u32> = object.iter().map(|&o| if o { u32::MAX } else { 0 }).collect();
    let at_edge = |s: &usize| object[*s] && neighbors[*s].iter().any(|&n| !object[n]);
    let mut layer: Vec<usize> = (0..object.len()).filter(at_edge).collect();
    let mut level = 1;
    while !layer.is_empty() {
        layer.iter().for_each(|&s| depth[s] = level);
        let mut next: Vec<usize> = layer.iter().flat_map(|&s| neighbors[s].clone()).collect();
        next.retain(|&s| depth[s] == u32::MAX);
        next.sort_unstable();
        next.dedup();
        (layer, level) = (next, level + 1);
    }
    depth.iter_mut().filter(|d| **d == u32::MAX).for_each(|d| *d = level);
    depth
}
