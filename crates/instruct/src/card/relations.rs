//! How objects stand to each other.

use glam::DVec3;
use motes_formats::scene_card::{FrameDocument, ObjectDocument, Relation, RelationDocument};

/// Intervals may overlap by this share of the shorter one and still be beside each other.
const OVERLAP: f64 = 0.25;
/// What stands on something is no farther from its top than this share of the lower height.
const CONTACT: f64 = 0.25;

/// The relations that clearly hold, pair by pair in the order of the objects.
pub(super) fn relations(
    objects: &[ObjectDocument],
    frame: &FrameDocument,
) -> Vec<RelationDocument> {
    let mut found = Vec::new();
    for (i, a) in objects.iter().enumerate() {
        for (k, b) in objects.iter().enumerate() {
            if i == k {
                continue;
            }
            let holds = [
                (Relation::LeftOf, precedes(a, b, frame.right, |o| o.size.width)),
                (Relation::Behind, precedes(a, b, frame.front, |o| o.size.depth)),
                (Relation::On, is_on(a, b, frame)),
            ];
            for (relation, _) in holds.into_iter().filter(|(_, holds)| *holds) {
                let (subject, object) = (a.id.clone(), b.id.clone());
                found.push(RelationDocument { subject, relation, object });
            }
        }
    }
    found
}

fn place(object: &ObjectDocument, axis: [f64; 3]) -> f64 {
    DVec3::from_array(object.center).dot(DVec3::from_array(axis))
}

/// Whether `a` ends along an axis where `b` begins.
fn precedes(
    a: &ObjectDocument,
    b: &ObjectDocument,
    axis: [f64; 3],
    size: impl Fn(&ObjectDocument) -> f64,
) -> bool {
    let apart = place(b, axis) - place(a, axis);
    let (wide, narrow) = (size(a).max(size(b)), size(a).min(size(b)));
    apart > 0.5 * (wide + narrow) - OVERLAP * narrow
}

fn is_on(a: &ObjectDocument, b: &ObjectDocument, frame: &FrameDocument) -> bool {
    let up = DVec3::from_array(frame.up);
    let height = |p: [f64; 3]| DVec3::from_array(p).dot(up);
    let gap = height(a.base) - (height(b.base) + b.size.height);
    let over = |axis: [f64; 3], size: f64| (place(a, axis) - place(b, axis)).abs() <= 0.5 * size;
    gap.abs() <= CONTACT * a.size.height.min(b.size.height)
        && over(frame.right, b.size.width)
        && over(frame.front, b.size.depth)
}
