//! How deep a superpixel lies inside a region of its view.

use std::collections::BTreeSet;

use crate::index::SceneIndex;

/// Superpixels from `from` to the nearest one of its view outside a region, `from` counted: 0 where it is outside
/// itself, 1 at the edge. Where the region fills the view, to the farthest one.
pub(crate) fn depth_in_view(
    index: &SceneIndex,
    from: u32,
    is_inside: impl Fn(usize) -> bool,
) -> f32 {
    let from = from as usize;
    if !is_inside(from) {
        return 0.0;
    }
    let view = index.offsets.partition_point(|&o| o as usize <= from) - 1;
    let range = index.range(view);
    let mut seen = BTreeSet::from([from]);
    let (mut front, mut depth) = (vec![from], 0.0);
    while !front.is_empty() {
        depth += 1.0;
        let mut next = Vec::new();
        for &i in &front {
            for (j, _) in index.graph.row(i).filter(|(j, _)| range.contains(j)) {
                if !is_inside(j) {
                    return depth;
                }
                if seen.insert(j) {
                    next.push(j);
                }
            }
        }
        front = next;
    }
    depth
}
