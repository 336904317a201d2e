//! A bounding volume hierarchy with eight children per node, boxes and triangles eight to a vector.
//!
//! Made from a binary tree by opening the child with the largest surface until eight are there
//! (Wald, Benthin & Boulos 2008). Subtrees of eight triangles or fewer become one packet.

use std::cell::RefCell;

use fearless_simd::{Level, Simd, dispatch, f32x8, prelude::*};
use glam::Vec3;
use obvhs::bvh2::Bvh2;

use super::packet::{LANES, Packet};

/// Marks a child that is a packet.
const LEAF: u32 = 1 << 31;

/// Boxes of eight children: `[min x, y, z, max x, y, z][lane]`. Empty lanes are inside out.
#[derive(Clone, Debug)]
#[repr(C, align(64))]
struct Node {
    bounds: [[f32; LANES]; 6],
    children: [u32; LANES],
}

/// The tree; node 0 is the root, no nodes for no triangles.
#[derive(Clone, Debug, Default)]
pub(super) struct WideTree {
    nodes: Vec<Node>,
    packets: Vec<Packet>,
}

/// A ray in the coordinates of the tree.
#[derive(Clone, Copy, Debug)]
pub(super) struct InnerRay {
    pub(super) origin: Vec3,
    pub(super) direction: Vec3,
    pub(super) t_min: f32,
    pub(super) t_max: f32,
    /// Triangles pass rays that start less than this far behind them.
    pub(super) one_sided_within: f32,
}

/// The nearest triangle.
#[derive(Clone, Copy, Debug)]
pub(super) struct Nearest {
    pub(super) distance: f32,
    pub(super) index: u32,
    pub(super) weights: [f32; 2],
}

thread_local! {
    /// Children to visit and where the ray enters them. Deep trees only make it longer.
    static STACK: RefCell<Vec<(u32, f32)>> = const { RefCell::new(Vec::new()) };
}

fn level() -> Level {
    static LEVEL: std::sync::OnceLock<Level> = std::sync::OnceLock::new();
    *LEVEL.get_or_init(Level::new)
}

impl WideTree {
    /// From a binary tree whose leaves hold one primitive each; `triangle` gives each with its number in the mesh.
    pub(super) fn new(binary: &Bvh2, triangle: impl Fn(u32) -> ([Vec3; 3], u32)) -> Self {
        let mut tree = Self::default();
        let counts = counts(binary);
        let packets = packets_below(binary, &counts);
        tree.packets.reserve_exact(packets);
        // Few nodes have less than four children.
        tree.nodes.reserve(packets / 3 + 1);
        tree.nodes.push(Node::EMPTY);
        let mut work = vec![(0u32, 0usize)];
        let (mut open, mut members) = (Vec::with_capacity(LANES), Vec::with_capacity(LANES));
        while let Some((from, to)) = work.pop() {
            children(binary, &counts, from, &mut open);
            for (lane, &child) in open.iter().enumerate() {
                let aabb = binary.nodes[child as usize].aabb();
                let reference = if counts[child as usize] <= LANES as u32 {
                    members.clear();
                    gather(binary, child, &mut |i| members.push(triangle(i)));
                    tree.packets.push(Packet::new(&members));
                    LEAF | (tree.packets.len() - 1) as u32
                } else {
                    tree.nodes.push(Node::EMPTY);
                    work.push((child, tree.nodes.len() - 1));
                    (tree.nodes.len() - 1) as u32
                };
                let node = &mut tree.nodes[to];
                node.children[lane] = reference;
                for axis in 0..3 {
                    node.bounds[axis][lane] = aabb.min[axis];
                    node.bounds[3 + axis][lane] = aabb.max[axis];
                }
            }
        }
        tree
    }

    pub(super) fn is_empty(&self) -> bool {
        self.nodes.is_empty()
    }

    /// Whether the ray meets anything.
    #[inline]
    pub(super) fn occluded(&self, ray: &InnerRay) -> bool {
        STACK.with_borrow_mut(|stack| dispatch!(level(), simd => occluded(simd, self, ray, stack)))
    }

    /// What the ray meets first.
    #[inline]
    pub(super) fn nearest(&self, ray: &InnerRay) -> Option<Nearest> {
        STACK.with_borrow_mut(|stack| dispatch!(level(), simd => nearest(simd, self, ray, stack)))
    }
}

impl Node {
    const EMPTY: Self = Self {
        bounds: [
            [f32::INFINITY; LANES],
            [f32::INFINITY; LANES],
            [f32::INFINITY; LANES],
            [f32::NEG_INFINITY; LANES],
            [f32::NEG_INFINITY; LANES],
            [f32::NEG_INFINITY; LANES],
        ],
        children: [LEAF; LANES],
    };
}

/// What the slab test needs of a ray, once per ray.
#[derive(Clone, Copy)]
struct Slabs<S: Simd> {
    origin: [f32x8<S>; 3],
    inverse: [f32x8<S>; 3],
    /// Row of [`Node::bounds`] that the ray meets first, per axis.
    near: [usize; 3],
    t_min: f32x8<S>,
}

impl<S: Simd> Slabs<S> {
    #[inline(always)]
    fn new(simd: S, ray: &InnerRay) -> Self {
        // A direction along an axis: far enough from 0 that 0 times its inverse is a number.
        let inverse = |d: f32| 1.0 / if d.abs() < 1e-18 { 1e-18f32.copysign(d) } else { d };
        let [ix, iy, iz] = ray.direction.to_array().map(inverse);
        let near = |inverse: f32, axis: usize| if inverse < 0.0 { axis + 3 } else { axis };
        let o = ray.origin;
        Self {
            origin: [f32x8::splat(simd, o.x), f32x8::splat(simd, o.y), f32x8::splat(simd, o.z)],
            inverse: [f32x8::splat(simd, ix), f32x8::splat(simd, iy), f32x8::splat(simd, iz)],
            near: [near(ix, 0), near(iy, 1), near(iz, 2)],
            t_min: f32x8::splat(simd, ray.t_min),
        }
    }

    /// Children that the ray enters before `t_max`, and where.
    #[inline(always)]
    fn enter(&self, simd: S, node: &Node, t_max: f32) -> (u32, f32x8<S>) {
        let plane = |axis: usize, row: usize| {
            (f32x8::from_slice(simd, &node.bounds[row]) - self.origin[axis]) * self.inverse[axis]
        };
        let [x, y, z] = self.near;
        // Row 0 and 3 are opposite sides of one axis, and so on.
        let far = |row: usize| if row < 3 { row + 3 } else { row - 3 };
        let enters = plane(0, x).max(plane(1, y)).max(plane(2, z).max(self.t_min));
        let leaves = plane(0, far(x)).min(plane(1, far(y))).min(plane(2, far(z)));
        let leaves = leaves.min(f32x8::splat(simd, t_max));
        (enters.simd_le(leaves).to_bitmask() as u32, enters)
    }
}

#[inline(always)]
fn occluded<S: Simd>(
    simd: S,
    tree: &WideTree,
    ray: &InnerRay,
    stack: &mut Vec<(u32, f32)>,
) -> bool {
    let slabs = Slabs::new(simd, ray);
    stack.clear();
    let mut next = Some((0u32, 0.0f32));
    while let Some((child, _)) = next {
        let node = &tree.nodes[child as usize];
        let (mut lanes, _) = slabs.enter(simd, node, ray.t_max);
        while lanes != 0 {
            let child = node.children[lanes.trailing_zeros() as usize];
            lanes &= lanes - 1;
            if child & LEAF == 0 {
                stack.push((child, 0.0));
                continue;
            }
            let packet = &tree.packets[(child & !LEAF) as usize];
            if packet.meet(simd, ray, ray.t_max).lanes != 0 {
                return true;
            }
        }
        next = stack.pop();
    }
    false
}

#[inline(always)]
fn nearest<S: Simd>(
    simd: S,
    tree: &WideTree,
    ray: &InnerRay,
    stack: &mut Vec<(u32, f32)>,
) -> Option<Nearest> {
    let slabs = Slabs::new(simd, ray);
    stack.clear();
    let mut best: Option<Nearest> = None;
    let mut t_max = ray.t_max;
    let mut next = Some((0u32, ray.t_min));
    while let Some((child, enters)) = next {
        if enters >= t_max && best.is_some() {
            next = stack.pop();
            continue;
        }
        if child & LEAF != 0 {
            let packet = &tree.packets[(child & !LEAF) as usize];
            let met = packet.meet(simd, ray, t_max);
            let mut lanes = met.lanes;
            while lanes != 0 {
                let lane = lanes.trailing_zeros() as usize;
                lanes &= lanes - 1;
                if met.distance[lane] < t_max {
                    t_max = met.distance[lane];
                    let weights = [met.weights[0][lane], met.weights[1][lane]];
                    best = Some(Nearest { distance: t_max, index: packet.index[lane], weights });
                }
            }
            next = stack.pop();
            continue;
        }
        let node = &tree.nodes[child as usize];
        let (mut lanes, enters) = slabs.enter(simd, node, t_max);
        let mut at = [0.0; LANES];
        enters.store_slice(&mut at);
        // Nearest on top: an insertion sort of the few that were entered.
        let first = stack.len();
        while lanes != 0 {
            let lane = lanes.trailing_zeros() as usize;
            lanes &= lanes - 1;
            stack.push((node.children[lane], at[lane]));
            let mut i = stack.len() - 1;
            while i > first && stack[i - 1].1 < stack[i].1 {
                stack.swap(i - 1, i);
                i -= 1;
            }
        }
        next = stack.pop();
    }
    best
}

/// Primitives below every node of a binary tree.
fn counts(binary: &Bvh2) -> Vec<u32> {
    let mut counts = vec![0; binary.nodes.len()];
    // Parents are visited before their children, so the reverse order sums up.
    let mut order = vec![0u32];
    let mut i = 0;
    while i < order.len() {
        let node = &binary.nodes[order[i] as usize];
        if node.is_leaf() {
            counts[order[i] as usize] = node.prim_count;
        } else {
            order.extend([node.first_index, node.first_index + 1]);
        }
        i += 1;
    }
    for &i in order.iter().rev() {
        let node = &binary.nodes[i as usize];
        if !node.is_leaf() {
            let first = node.first_index as usize;
            counts[i as usize] = counts[first] + counts[first + 1];
        }
    }
    counts
}

/// Subtrees that become one packet each: of eight primitives or fewer, below a node of more. The
/// packets of a whole tree are one allocation, which must not move while it grows.
fn packets_below(binary: &Bvh2, counts: &[u32]) -> usize {
    let is_packet = |i: u32| counts[i as usize] <= LANES as u32;
    let mut packets = usize::from(is_packet(0));
    for (node, &count) in binary.nodes.iter().zip(counts) {
        if count > LANES as u32 && !node.is_leaf() {
            let children = [node.first_index, node.first_index + 1];
            packets += children.into_iter().filter(|&child| is_packet(child)).count();
        }
    }
    packets
}

/// Up to eight nodes below `root` that together hold all of it.
fn children(binary: &Bvh2, counts: &[u32], root: u32, open: &mut Vec<u32>) {
    let opens = |i: u32| counts[i as usize] > LANES as u32;
    open.clear();
    open.push(root);
    while open.len() < LANES {
        let area = |&i: &u32| binary.nodes[i as usize].aabb().half_area();
        let largest = (0..open.len())
            .filter(|&k| opens(open[k]))
            .max_by(|&a, &b| area(&open[a]).total_cmp(&area(&open[b])));
        let Some(k) = largest else { break };
        let first = binary.nodes[open[k] as usize].first_index;
        open[k] = first;
        open.push(first + 1);
    }
}

/// Calls `found` with every primitive below a node.
fn gather(binary: &Bvh2, root: u32, found: &mut impl FnMut(u32)) {
    let mut stack = vec![root];
    while let Some(i) = stack.pop() {
        let node = &binary.nodes[i as usize];
        if node.is_leaf() {
            let first = node.first_index as usize;
            binary.primitive_indices[first..first + node.prim_count as usize]
                .iter()
                .for_each(|&i| found(i));
        } else {
            stack.extend([node.first_index, node.first_index + 1]);
        }
    }
}
