//! Where photos are far apart: views between them, in the widest gaps.
//!
//! The cameras are joined by their minimum spanning tree (Prim 1957), whose edges are the gaps; each further view splits the edge
//! whose pieces are longest.

use glam::DVec3;

/// A place on the way from one photo to another.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Between {
    /// The photos, by number; the first one is nearer, or as near.
    pub photos: [usize; 2],
    /// Share of the way from the first to the second, in (0, 1/2].
    pub share: f64,
}

/// `count` places between cameras at `centers`, in the order of the edges that they lie on; fewer where all cameras are at one place.
pub fn between_photos(centers: &[DVec3], count: usize) -> Vec<Between> {
    let edges = spanning_tree(centers);
    let length = |edge: &[usize; 2]| centers[edge[0]].distance(centers[edge[1]]);
    let mut pieces = vec![1u32; edges.len()];
    for _ in 0..count {
        let piece = |e: usize| length(&edges[e]) / f64::from(pieces[e]);
        // The first of several that are as long.
        let longest = (0..edges.len()).reduce(|a, b| if piece(b) > piece(a) { b } else { a });
        match longest.filter(|&e| piece(e) > 0.0) {
            Some(e) => pieces[e] += 1,
            None => break,
        }
    }
    let places = edges.iter().zip(pieces).flat_map(|(&[a, b], pieces)| {
        (1..pieces).map(move |k| match f64::from(k) / f64::from(pieces) {
            share if share <= 0.5 => Between { photos: [a, b], share },
            share => Between { photos: [b, a], share: 1.0 - share },
        })
    });
    places.collect()
}

/// Edges of the minimum spanning tree, in the order in which they are found from the first point on.
fn spanning_tree(points: &[DVec3]) -> Vec<[usize; 2]> {
    let mut nearest: Vec<(f64, usize)> =
        points.iter().map(|p| (p.distance_squared(points[0]), 0)).collect();
    let mut left: Vec<usize> = (1..points.len()).collect();
    let mut edges = Vec::with_capacity(left.len());
    while let Some(at) =
        (0..left.len()).reduce(|a, b| match nearest[left[b]].0 < nearest[left[a]].0 {
            true => b,
            false => a,
        })
    {
        let next = left.remove(at);
        edges.push([nearest[next].1, next]);
        for &other in &left {
            let distance = points[other].distance_squared(points[next]);
            if distance < nearest[other].0 {
                nearest[other] = (distance, next);
            }
        }
    }
    edges
}

#[cfg(test)]
mod tests {
    use super::*;

    fn line(places: &[f64]) -> Vec<DVec3> {
        places.iter().map(|&x| DVec3::new(x, 1.0, 0.0)).collect()
    }

    #[test]
    fn the_widest_gaps_are_split_first() {
        // Gaps of 1, 4 and 2, whatever the order of the photos.
        let centers = line(&[5.0, 0.0, 1.0, 7.0]);
        let places = between_photos(&centers, 2);
        assert_eq!(places.len(), 2);
        let x = |p: &Between| centers[p.photos[0]].lerp(centers[p.photos[1]], p.share).x;
        let mut found: Vec<f64> = places.iter().map(x).collect();
        found.sort_by(f64::total_cmp);
        // 4 halves to 2, which is as long as the other: the first edge of the tree wins.
        assert!(found == [3.0, 6.0] || (found[0] - (1.0 + 4.0 / 3.0)).abs() < 1e-12, "{found:?}");
        let many = between_photos(&centers, 9);
        assert_eq!(many.len(), 9);
        assert!(many.iter().all(|p| p.share > 0.0 && p.share <= 0.5 && p.photos[0] != p.photos[1]));
    }

    #[test]
    fn nothing_lies_between_photos_of_one_place() {
        assert_eq!(between_photos(&line(&[2.0, 2.0, 2.0]), 3), []);
        assert_eq!(between_photos(&line(&[2.0]), 3), []);
    }
}
