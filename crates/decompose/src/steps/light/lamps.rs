//! Lamps: pieces of the surface that the photos show clipped, and that light what is around them.
//!
//! A clipped pixel says only that its surface sends at least so much. How much more is told by what it lights: the radiance of
//! every such piece is an unknown of the light, like that of a cell of the sky, but near. White things in the sun are clipped
//! too; their pieces end at what is seen of them, and are no lamps. A wall that a lamp overexposes fades into what is around it,
//! where a lamp ends. A channel that is not clipped shows all that a surface sends: what is clipped in one channel only has a
//! color, and light falls on it.

use std::collections::HashMap;

use glam::Vec3;
use motes_math::disjoint_sets::DisjointSets;
use motes_math::luminance::luminance;
use motes_math::median::median;
use motes_shading::emitters::Emitters;
use rayon::prelude::*;

use super::solve::LitPoints;
use crate::illumination::{CellLight, Lamp};
use crate::observation::{SeenView, TracedSurface};

/// Share of the photos of a vertex that have to show it clipped: what a lamp lights is clipped in long exposures only.
const CLIPPED_SHARE: f32 = 0.8;
/// Photos that have to show it at all, where there are so many.
const LEAST_VIEWS: usize = 2;
/// Triangles of the smallest piece.
const LEAST_TRIANGLES: usize = 6;
/// Most pieces, the largest first.
const MOST: usize = 12;
/// Rings of vertices around a piece that tell whether it ends there.
const RINGS: usize = 3;
/// What is around a lamp sends less than this share of what is seen of it, in one channel at least.
const MOST_AROUND: f32 = 0.6;
/// A lamp gives at least this share of all light that the points receive,
const LEAST_SHARE: f32 = 0.01;
/// and sends at least this many times what is seen of it.
const LEAST_EXCESS: f32 = 1.5;

/// Pieces of the surface that may be lamps.
#[derive(Clone, Debug, Default)]
pub(crate) struct Lamps {
    /// Per vertex of the surface: the piece, from 1; 0 for none. Empty where there is none.
    pub of_vertex: Vec<u32>,
    /// Every piece on its own, of radiance 1.
    pub emitters: Vec<Emitters>,
    /// What is seen of every piece.
    pub seen: Vec<Vec3>,
}

impl Lamps {
    /// Pieces that most photos show clipped and that end abruptly; `sent` is what the photos show of every vertex.
    pub(crate) fn candidates(scene: &TracedSurface, views: &[SeenView<'_>], sent: &[Vec3]) -> Self {
        let surface = &scene.surface;
        let least_views = LEAST_VIEWS.min(views.len());
        let clipped = |v: usize| -> Shown {
            let (p, n) = (Vec3::from(surface.vertices[v]), Vec3::from(surface.normals[v]));
            let pixels = views.iter().filter_map(|view| Some((view, view.shown_at(p, n)?)));
            let (mut seen, mut count, mut sum) = (0usize, 0usize, Vec3::ZERO);
            for (view, pixel) in pixels {
                seen += 1;
                if view.photo.clipped_channels(pixel).all() {
                    count += 1;
                    sum += view.photo.radiance_linear.at(pixel);
                }
            }
            match seen {
                0 => Shown::Nowhere,
                _ if seen >= least_views && count as f32 > CLIPPED_SHARE * seen as f32 => {
                    Shown::Clipped(sum / count as f32)
                }
                _ => Shown::Dark,
            }
        };
        let shown: Vec<Shown> = (0..surface.vertices.len()).into_par_iter().map(clipped).collect();
        let radiance: Vec<Option<Vec3>> = shown
            .iter()
            .map(|shown| if let Shown::Clipped(radiance) = shown { Some(*radiance) } else { None })
            .collect();
        let mut of_vertex = pieces(&surface.triangles, &radiance);
        let count = of_vertex.iter().copied().max().unwrap_or(0);
        if count == 0 {
            return Self::default();
        }
        let mut sums = vec![(Vec3::ZERO, 0.0f32); count as usize];
        for (piece, radiance) in of_vertex.iter().zip(&radiance) {
            if let (Some(k), Some(radiance)) = (piece.checked_sub(1), radiance) {
                let sum = &mut sums[k as usize];
                *sum = (sum.0 + *radiance, sum.1 + 1.0);
            }
        }
        let seen: Vec<Vec3> = sums.into_iter().map(|(sum, n)| sum / n.max(1.0)).collect();
        let unseen: Vec<bool> = shown.iter().map(|s| matches!(s, Shown::Nowhere)).collect();
        take_unseen(&surface.triangles, &unseen, &mut of_vertex);
        let around = around(&surface.triangles, &of_vertex, sent, &seen);
        let ends: Vec<bool> = around.iter().map(|a| a.is_none_or(|a| a < MOST_AROUND)).collect();
        let ending = Self { of_vertex, emitters: Vec::new(), seen }.renumbered(&ends);
        Self::of(scene, ending.of_vertex, ending.seen)
    }

    /// The pieces of a light that was found, on the surface as it is.
    pub(crate) fn known(
        scene: &TracedSurface,
        of_vertex: &[u32],
        light: Option<&CellLight>,
    ) -> Self {
        let seen = light.map_or_else(Vec::new, |l| l.lamps.iter().map(|lamp| lamp.seen).collect());
        Self::of(scene, of_vertex.to_vec(), seen)
    }

    fn of(scene: &TracedSurface, of_vertex: Vec<u32>, seen: Vec<Vec3>) -> Self {
        if seen.is_empty() {
            return Self::default();
        }
        let mesh = scene.mesh();
        let emitter = |k: usize| {
            let shines =
                |&piece: &u32| if piece as usize == k + 1 { Vec3::ONE } else { Vec3::ZERO };
            Emitters::new(&mesh, &of_vertex.iter().map(shines).collect::<Vec<_>>())
        };
        let all: Vec<Option<Emitters>> = (0..seen.len()).map(emitter).collect();
        let is_whole: Vec<bool> = all.iter().map(Option::is_some).collect();
        let emitters = all.into_iter().flatten().collect();
        let lamps = Self { of_vertex, emitters, seen };
        lamps.renumbered(&is_whole)
    }

    /// As they are before anything is known of them but what is seen.
    pub(crate) fn start(&self) -> Vec<Lamp> {
        self.seen.iter().map(|&seen| Lamp { radiance: seen * LEAST_EXCESS, seen }).collect()
    }

    /// The pieces that light what is around them, more than by what is seen of them, and that `saved` some of the cost of neighbors that
    /// they light differently. How much they save says less: clipped pieces that light next to nothing save as much.
    pub(crate) fn kept(self, light: &CellLight, lit: &LitPoints, saved: &[f64]) -> Self {
        let flux = lit.received_from(&light.sources());
        let total: f32 = flux.iter().sum();
        let of_lamps = &flux[light.cells.len()..];
        let is_lamp = |((lamp, flux), saved): ((&Lamp, &f32), &f64)| {
            *flux >= LEAST_SHARE * total
                && luminance(lamp.radiance) >= LEAST_EXCESS * luminance(lamp.seen)
                && *saved > 0.0
        };
        let kept: Vec<bool> = light.lamps.iter().zip(of_lamps).zip(saved).map(is_lamp).collect();
        let mut keep = kept.iter();
        let mut emitters = self.emitters;
        emitters.retain(|_| *keep.next().unwrap_or(&false));
        Self { emitters, ..self }.renumbered(&kept)
    }

    /// Numbers and what is seen of the pieces that are kept.
    fn renumbered(self, kept: &[bool]) -> Self {
        if !kept.contains(&true) {
            return Self::default();
        }
        let mut number = vec![0; kept.len() + 1];
        let mut next = 0;
        for (k, kept) in kept.iter().enumerate() {
            if *kept {
                next += 1;
                number[k + 1] = next;
            }
        }
        let of_vertex = self.of_vertex.iter().map(|&k| number[k as usize]).collect();
        let seen = self.seen.iter().zip(kept).filter(|(_, kept)| **kept).map(|(s, _)| *s).collect();
        Self { of_vertex, emitters: self.emitters, seen }
    }
}

/// What photos show of a vertex.
enum Shown {
    Nowhere,
    Dark,
    /// Mean radiance where it is clipped.
    Clipped(Vec3),
}

/// Lets every piece take in vertices next to it that no photo shows, ring by ring, until they are as many as it has: the far side
/// of a lamp shines, too.
fn take_unseen(triangles: &[[u32; 3]], unseen: &[bool], of_vertex: &mut [u32]) {
    let count = of_vertex.iter().copied().max().unwrap_or(0) as usize;
    let mut room = vec![0usize; count + 1];
    of_vertex.iter().for_each(|&piece| room[piece as usize] += 1);
    if count == 0 {
        return;
    }
    loop {
        let mut taken: Vec<(u32, u32)> = Vec::new();
        for triangle in triangles {
            let piece = triangle.iter().map(|&v| of_vertex[v as usize]).max().unwrap_or(0);
            let free = |&&v: &&u32| piece > 0 && of_vertex[v as usize] == 0 && unseen[v as usize];
            taken.extend(triangle.iter().filter(free).map(|&v| (v, piece)));
        }
        taken.sort_unstable();
        taken.dedup_by_key(|(v, _)| *v);
        taken.retain(|(_, piece)| {
            let left = &mut room[*piece as usize];
            *left = left.saturating_sub(1);
            *left > 0
        });
        taken.iter().for_each(|&(v, piece)| of_vertex[v as usize] = piece);
        if taken.is_empty() {
            return;
        }
    }
}

/// Median of what the outermost of some rings of vertices around every piece send over what is seen of the piece, in the channel
/// in which they differ most; none where nothing is around.
fn around(
    triangles: &[[u32; 3]],
    of_vertex: &[u32],
    sent: &[Vec3],
    seen: &[Vec3],
) -> Vec<Option<f32>> {
    let mut reached = of_vertex.to_vec();
    let mut last = Vec::new();
    for _ in 0..RINGS {
        last.clear();
        for triangle in triangles {
            let piece = triangle.iter().map(|&v| reached[v as usize]).max().unwrap_or(0);
            let fresh = triangle.iter().filter(|&&v| piece > 0 && reached[v as usize] == 0);
            last.extend(fresh.map(|&v| (v, piece)));
        }
        last.iter().for_each(|&(v, piece)| reached[v as usize] = piece);
    }
    let mut values = vec![Vec::new(); seen.len()];
    for &(v, piece) in &last {
        if let Some(sent) = sent.get(v as usize) {
            let k = piece as usize - 1;
            let ratio = *sent / seen[k].max(Vec3::splat(f32::MIN_POSITIVE));
            values[k].push(f64::from(ratio.min_element()));
        }
    }
    values.into_iter().map(|of| median(of).map(|m| m as f32)).collect()
}

/// Connected pieces of triangles with three clipped corners, from 1, the largest first; small ones and what is beyond
/// [`MOST`] are 0. Empty where there is none.
fn pieces(triangles: &[[u32; 3]], clipped: &[Option<Vec3>]) -> Vec<u32> {
    let mut sets = DisjointSets::new(clipped.len());
    let whole = || triangles.iter().filter(|t| t.iter().all(|&v| clipped[v as usize].is_some()));
    for &[a, b, c] in whole() {
        sets.join(a, b);
        sets.join(a, c);
    }
    let mut sizes: HashMap<u32, usize> = HashMap::new();
    for &[a, ..] in whole() {
        *sizes.entry(sets.root(a)).or_default() += 1;
    }
    let mut roots: Vec<(u32, usize)> =
        sizes.into_iter().filter(|(_, size)| *size >= LEAST_TRIANGLES).collect();
    roots.sort_by_key(|(root, size)| (std::cmp::Reverse(*size), *root));
    roots.truncate(MOST);
    if roots.is_empty() {
        return Vec::new();
    }
    let number: HashMap<u32, u32> =
        roots.iter().zip(1..).map(|((root, _), k)| (*root, k)).collect();
    let mut of_vertex = vec![0; clipped.len()];
    for triangle in whole() {
        let piece = number.get(&sets.root(triangle[0])).copied().unwrap_or(0);
        triangle.iter().for_each(|&v| of_vertex[v as usize] = piece);
    }
    of_vertex
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A strip of `n` squares of two triangles each.
    fn strip(n: u32) -> Vec<[u32; 3]> {
        (0..n)
            .flat_map(|i| [[2 * i, 2 * i + 1, 2 * i + 2], [2 * i + 1, 2 * i + 3, 2 * i + 2]])
            .collect()
    }

    #[test]
    fn what_fades_into_its_surroundings_is_told_from_what_ends() {
        let triangles = strip(20);
        let of_vertex: Vec<u32> = (0..42u32).map(|v| u32::from(v / 2 < 6)).collect();
        let fading: Vec<Vec3> = (0..42).map(|v| Vec3::splat(1.0 - 0.02 * (v / 2) as f32)).collect();
        let ending: Vec<Vec3> =
            (0..42).map(|v| Vec3::splat(if v / 2 < 6 { 1.0 } else { 0.2 })).collect();
        let of = |sent: &[Vec3]| around(&triangles, &of_vertex, sent, &[Vec3::ONE])[0];
        assert!(of(&fading).is_some_and(|v| (v - 0.84).abs() < 1e-5), "{:?}", of(&fading));
        assert!(of(&ending).is_some_and(|v| (v - 0.2).abs() < 1e-5));
        // Wood in the light of a lamp, as red as the lamp itself.
        let wood: Vec<Vec3> = fading
            .iter()
            .map(|v| if v.x > 0.885 { *v } else { Vec3::new(1.0, 0.6, 0.3) })
            .collect();
        assert!(of(&wood).is_some_and(|v| (v - 0.3).abs() < 1e-5), "{:?}", of(&wood));
        assert_eq!(around(&triangles, &[1; 42], &fading, &[Vec3::ONE]), [None]);
    }

    #[test]
    fn the_far_side_of_a_lamp_belongs_to_it_and_the_dark_beyond_does_not() {
        let triangles = strip(20);
        let lamp = |v: u32| u32::from(v / 2 < 6);
        let mut of_vertex: Vec<u32> = (0..42).map(lamp).collect();
        let unseen: Vec<bool> = (0..42u32).map(|v| (6..9).contains(&(v / 2))).collect();
        take_unseen(&triangles, &unseen, &mut of_vertex);
        assert_eq!([11, 12, 17, 18].map(|v: usize| of_vertex[v]), [1, 1, 1, 0]);
        let mut of_vertex: Vec<u32> = (0..42).map(lamp).collect();
        take_unseen(&triangles, &[true; 42], &mut of_vertex);
        let taken = of_vertex.iter().filter(|piece| **piece == 1).count();
        assert!((18..=24).contains(&taken), "{taken}");
        take_unseen(&[], &[], &mut []);
    }

    #[test]
    fn pieces_are_connected_and_large_enough() {
        let triangles = strip(20);
        // 4 squares, 6 squares and a single one are clipped.
        let clipped: Vec<Option<Vec3>> = (0..42u32)
            .map(|v| matches!(v / 2, 0..=4 | 8..=14 | 18..=19).then_some(Vec3::ONE))
            .collect();
        let of_vertex = pieces(&triangles, &clipped);
        assert_eq!([0, 9, 10, 16, 29, 36].map(|v: usize| of_vertex[v]), [2, 2, 0, 1, 1, 0]);
        assert!(pieces(&triangles, &[None; 42]).is_empty());
        assert!(pieces(&[], &[]).is_empty());
    }
}
