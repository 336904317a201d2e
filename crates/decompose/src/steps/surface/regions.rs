//! Regions of one brightness in a photo: graph-based segmentation (Felzenszwalb & Huttenlocher 2004).

use motes_math::disjoint_sets::DisjointSets;

use super::silhouettes::blurred;
use super::view::View;

/// Side of the square that brightness is averaged over first, pixels.
const WINDOW: usize = 3;
/// Regions join across a difference of brightness (raised to 1/2.2, 0 to 1) below their own plus this over their size in pixels.
const SCALE: f32 = 1.0;

/// Pixels of the regions of a photo that are at least `least` pixels large, and whose pixels `counts` admits, in order of their first
/// pixels.
pub(super) fn regions(view: &View, counts: &[bool], least: usize) -> Vec<Vec<u32>> {
    let (w, h) = (view.width, view.height);
    let shade = blurred(&view.luma, w, h, WINDOW);
    let mut edges: Vec<(f32, u32, u32)> = Vec::with_capacity(2 * shade.len());
    for k in 0..shade.len() {
        let (right, down) = (k % w + 1 < w, k / w + 1 < h);
        for next in [right.then_some(k + 1), down.then_some(k + w)].into_iter().flatten() {
            if counts[k] && counts[next] {
                edges.push(((shade[k] - shade[next]).abs(), k as u32, next as u32));
            }
        }
    }
    edges.sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then((a.1, a.2).cmp(&(b.1, b.2))));
    let mut areas = Areas::new(shade.len());
    for (difference, a, b) in edges {
        areas.join(a, b, difference);
    }
    let mut members: Vec<Vec<u32>> = vec![Vec::new(); shade.len()];
    for k in (0..shade.len() as u32).filter(|&k| counts[k as usize]) {
        members[areas.sets.root(k) as usize].push(k);
    }
    let mut regions: Vec<Vec<u32>> =
        members.into_iter().filter(|m| m.len() >= least.max(1)).collect();
    regions.sort_unstable_by_key(|m| m[0]);
    regions
}

/// Disjoint sets, with what each differs by inside.
struct Areas {
    sets: DisjointSets,
    size: Vec<u32>,
    most: Vec<f32>,
}

impl Areas {
    fn new(count: usize) -> Self {
        Self { sets: DisjointSets::new(count), size: vec![1; count], most: vec![SCALE; count] }
    }

    /// Joins the sets of two pixels that differ by no more than either allows. Differences come in ascending order.
    fn join(&mut self, a: u32, b: u32, difference: f32) {
        let (a, b) = (self.sets.root(a), self.sets.root(b));
        if a == b || difference > self.most[a as usize].min(self.most[b as usize]) {
            return;
        }
        self.sets.join(a, b);
        let size = self.size[a as usize] + self.size[b as usize];
        let joint = self.sets.root(a) as usize;
        self.size[joint] = size;
        self.most[joint] = difference + SCALE / size as f32;
    }
}

#[cfg(test)]
mod tests {
    use glam::DVec3;
    use motes_scene::UnitWorld;

    use super::super::extract::tests::photos;
    use super::*;

    #[test]
    fn noise_and_gradients_belong_to_one_region_and_steps_part_two() {
        let mut photo = photos(1, 1.0, DVec3::ZERO).remove(0);
        let width = photo.camera.width;
        let half = |k: usize| k % width < width / 2;
        for (k, pixel) in photo.radiance_linear.floats_mut().iter_mut().enumerate() {
            let noise = 0.01 * ((k * 7919) as f32).sin();
            let gradient = 0.2 * (k / width) as f32 / 120.0;
            pixel.fill((noise + gradient + if half(k) { 0.3 } else { 0.6 }).powf(2.2));
        }
        let view = View::new(&photo, &UnitWorld::IDENTITY);
        let mut counts = vec![true; view.luma.len()];
        counts[..10 * width].fill(false);
        let found = regions(&view, &counts, 1000);
        assert_eq!(found.len(), 2);
        for (region, left) in found.iter().zip([true, false]) {
            let right_side = region.iter().filter(|&&k| half(k as usize) == left).count();
            assert!(right_side * 50 > region.len() * 49, "{right_side} of {}", region.len());
            assert!(region.len() * 10 > view.luma.len() * 4, "{}", region.len());
            assert!(region.iter().all(|&k| counts[k as usize]));
        }
    }
}
