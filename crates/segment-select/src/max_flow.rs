//! Minimum cuts: the augmenting-path algorithm with two search trees of Boykov and Kolmogorov (2004),
//! "An experimental comparison of min-cut/max-flow algorithms for energy minimization in vision".
//!
//! Capacities are integers, so that a cut is exact and the same everywhere.

use std::collections::VecDeque;

const NONE: u32 = u32::MAX;
/// Parents that are not arcs.
const TERMINAL: u32 = u32::MAX - 1;
const ORPHAN: u32 = u32::MAX - 2;

#[derive(Clone, Copy, Debug)]
struct Arc {
    head: u32,
    next: u32,
    capacity: i64,
}

#[derive(Clone, Copy, Debug)]
struct Node {
    first: u32,
    /// Arc to the parent, or one of the marks above.
    parent: u32,
    /// When `distance` was right.
    time: u32,
    distance: u32,
    in_sink_tree: bool,
    is_active: bool,
    /// Residual capacity from the source when positive, to the sink when negative.
    terminal: i64,
}

/// A graph between a source and a sink.
#[derive(Clone, Debug, Default)]
pub struct MaxFlow {
    nodes: Vec<Node>,
    arcs: Vec<Arc>,
    flow: i64,
    active: VecDeque<u32>,
    orphans: VecDeque<u32>,
    time: u32,
}

impl MaxFlow {
    /// A graph of unconnected nodes.
    pub fn new(nodes: usize) -> Self {
        let node = Node {
            first: NONE,
            parent: NONE,
            time: 0,
            distance: 0,
            in_sink_tree: false,
            is_active: false,
            terminal: 0,
        };
        Self { nodes: vec![node; nodes], ..Self::default() }
    }

    /// Adds capacities from the source and to the sink, each 0 or more: the costs of putting the
    /// node on the sink's or the source's side.
    pub fn add_terminal(&mut self, node: usize, from_source: i64, to_sink: i64) {
        let old = self.nodes[node].terminal;
        let (mut source, mut sink) = (from_source, to_sink);
        if old > 0 {
            source += old;
        } else {
            sink -= old;
        }
        self.flow += source.min(sink);
        self.nodes[node].terminal = source - sink;
    }

    /// Adds an edge with a capacity in each direction, each 0 or more.
    pub fn add_edge(&mut self, a: usize, b: usize, forward: i64, backward: i64) {
        let e = self.arcs.len() as u32;
        for (from, to, arc, capacity) in [(a, b, e, forward), (b, a, e + 1, backward)] {
            self.arcs.push(Arc { head: to as u32, next: self.nodes[from].first, capacity });
            self.nodes[from].first = arc;
        }
    }

    /// Whether a node is on the source's side of the cut, after [`Self::solve`].
    pub fn is_source_side(&self, node: usize) -> bool {
        self.nodes[node].parent != NONE && !self.nodes[node].in_sink_tree
    }

    /// Finds the maximum flow, which is the cost of the minimum cut.
    pub fn solve(&mut self) -> i64 {
        for i in 0..self.nodes.len() {
            let node = &mut self.nodes[i];
            if node.terminal != 0 {
                node.in_sink_tree = node.terminal < 0;
                node.parent = TERMINAL;
                node.distance = 1;
                self.activate(i as u32);
            }
        }
        let mut current = None;
        while let Some(i) = current.take().or_else(|| self.next_active()) {
            let Some(middle) = self.grow(i) else {
                continue;
            };
            self.time += 1;
            self.augment(middle);
            while let Some(orphan) = self.orphans.pop_front() {
                self.adopt(orphan);
            }
            // The node may have more to offer.
            if self.nodes[i as usize].parent != NONE {
                current = Some(i);
            }
        }
        self.flow
    }

    fn activate(&mut self, i: u32) {
        if !self.nodes[i as usize].is_active {
            self.nodes[i as usize].is_active = true;
            self.active.push_back(i);
        }
    }

    fn next_active(&mut self) -> Option<u32> {
        while let Some(i) = self.active.pop_front() {
            let node = &mut self.nodes[i as usize];
            node.is_active = false;
            if node.parent != NONE {
                return Some(i);
            }
        }
        None
    }

    /// Capacity of the arc toward the sink when `from_sink` is false, of its sister otherwise.
    fn residual(&self, arc: u32, from_sink: bool) -> i64 {
        self.arcs[(arc ^ u32::from(from_sink)) as usize].capacity
    }

    /// Grows the tree of a node; the arc from the source tree to the sink tree when they meet.
    fn grow(&mut self, i: u32) -> Option<u32> {
        let Node { in_sink_tree, mut first, .. } = self.nodes[i as usize];
        while first != NONE {
            let arc = first;
            let Arc { head, next, .. } = self.arcs[arc as usize];
            first = next;
            if self.residual(arc, in_sink_tree) <= 0 {
                continue;
            }
            let (time, distance) = (self.nodes[i as usize].time, self.nodes[i as usize].distance);
            let other = &mut self.nodes[head as usize];
            if other.parent == NONE {
                other.in_sink_tree = in_sink_tree;
                other.parent = arc ^ 1;
                other.time = time;
                other.distance = distance + 1;
                self.activate(head);
            } else if other.in_sink_tree != in_sink_tree {
                return Some(if in_sink_tree { arc ^ 1 } else { arc });
            } else if other.time <= time && other.distance > distance && other.parent != TERMINAL {
                // A shorter way to the terminal.
                other.parent = arc ^ 1;
                other.time = time;
                other.distance = distance + 1;
            }
        }
        None
    }

    fn augment(&mut self, middle: u32) {
        let (sink_end, source_end) =
            (self.arcs[middle as usize].head, self.arcs[(middle ^ 1) as usize].head);
        let mut bottleneck = self.arcs[middle as usize].capacity;
        for (end, from_sink) in [(source_end, false), (sink_end, true)] {
            let mut i = end;
            loop {
                let node = self.nodes[i as usize];
                if node.parent == TERMINAL {
                    bottleneck = bottleneck.min(node.terminal.abs());
                    break;
                }
                // The parent arc leads to the terminal; flow in the source tree runs against it.
                bottleneck = bottleneck.min(self.residual(node.parent, !from_sink));
                i = self.arcs[node.parent as usize].head;
            }
        }
        self.push(middle, bottleneck);
        for (end, from_sink) in [(source_end, false), (sink_end, true)] {
            let mut i = end;
            loop {
                let node = self.nodes[i as usize];
                if node.parent == TERMINAL {
                    let left = node.terminal - bottleneck * node.terminal.signum();
                    self.nodes[i as usize].terminal = left;
                    if left == 0 {
                        self.nodes[i as usize].parent = ORPHAN;
                        self.orphans.push_front(i);
                    }
                    break;
                }
                self.push(node.parent ^ u32::from(!from_sink), bottleneck);
                if self.residual(node.parent, !from_sink) == 0 {
                    self.nodes[i as usize].parent = ORPHAN;
                    self.orphans.push_front(i);
                }
                i = self.arcs[node.parent as usize].head;
            }
        }
        self.flow += bottleneck;
    }

    fn push(&mut self, arc: u32, amount: i64) {
        self.arcs[arc as usize].capacity -= amount;
        self.arcs[(arc ^ 1) as usize].capacity += amount;
    }

    /// Distance of a node from its terminal; `None` when it hangs on an orphan.
    fn origin_distance(&mut self, start: u32) -> Option<u32> {
        let (mut i, mut steps) = (start, 0);
        let total = loop {
            let node = self.nodes[i as usize];
            if node.time == self.time && node.parent != ORPHAN && node.parent != NONE {
                break steps + node.distance;
            }
            match node.parent {
                TERMINAL => {
                    let node = &mut self.nodes[i as usize];
                    node.time = self.time;
                    node.distance = 1;
                    break steps + 1;
                }
                ORPHAN | NONE => return None,
                parent => i = self.arcs[parent as usize].head,
            }
            steps += 1;
        };
        // Remember it along the way.
        let (mut i, mut distance) = (start, total);
        while self.nodes[i as usize].time != self.time {
            let node = &mut self.nodes[i as usize];
            node.time = self.time;
            node.distance = distance;
            distance -= 1;
            i = self.arcs[node.parent as usize].head;
        }
        Some(total)
    }

    /// Finds another parent for an orphan, or frees it and orphans its children.
    fn adopt(&mut self, i: u32) {
        let Node { in_sink_tree, first, .. } = self.nodes[i as usize];
        let mut best: Option<(u32, u32)> = None;
        let mut arc = first;
        while arc != NONE {
            let Arc { head, next, .. } = self.arcs[arc as usize];
            // Flow comes from the parent in the source tree and goes to it in the sink tree.
            let other = self.nodes[head as usize];
            if self.residual(arc, !in_sink_tree) > 0
                && other.parent != NONE
                && other.in_sink_tree == in_sink_tree
                && let Some(distance) = self.origin_distance(head)
                && best.is_none_or(|(d, _)| distance < d)
            {
                best = Some((distance, arc));
            }
            arc = next;
        }
        if let Some((distance, arc)) = best {
            let node = &mut self.nodes[i as usize];
            node.parent = arc;
            node.time = self.time;
            node.distance = distance + 1;
            return;
        }
        self.nodes[i as usize].parent = NONE;
        let mut arc = first;
        while arc != NONE {
            let Arc { head, next, .. } = self.arcs[arc as usize];
            let other = self.nodes[head as usize];
            if other.parent != NONE && other.in_sink_tree == in_sink_tree {
                if self.residual(arc, !in_sink_tree) > 0 {
                    self.activate(head);
                }
                let is_child = other.parent != TERMINAL
                    && other.parent != ORPHAN
                    && self.arcs[other.parent as usize].head == i;
                if is_child {
                    self.nodes[head as usize].parent = ORPHAN;
                    self.orphans.push_back(head);
                }
            }
            arc = next;
        }
    }
}

#[cfg(test)]
mod tests {
    use motes_math::rng::keyed_rng;
    use rand::RngExt as _;

    use super::*;

    /// The cheapest of all cuts, tried one by one.
    fn brute_force(n: usize, terminals: &[(i64, i64)], edges: &[(usize, usize, i64, i64)]) -> i64 {
        (0..1u32 << n)
            .map(|sides| {
                let source = |i: usize| sides >> i & 1 == 1;
                let mut cost = 0;
                for (i, &(from_source, to_sink)) in terminals.iter().enumerate() {
                    cost += if source(i) { to_sink } else { from_source };
                }
                for &(a, b, forward, backward) in edges {
                    cost += match (source(a), source(b)) {
                        (true, false) => forward,
                        (false, true) => backward,
                        _ => 0,
                    };
                }
                cost
            })
            .min()
            .unwrap()
    }

    #[test]
    fn cuts_are_minimal() {
        for case in 0..400 {
            let mut rng = keyed_rng(5, case, 0);
            let n = rng.random_range(1..=9usize);
            let terminals: Vec<(i64, i64)> = (0..n)
                .map(|_| (rng.random_range(0..6) * rng.random_range(0..2), rng.random_range(0..6)))
                .collect();
            let edges: Vec<(usize, usize, i64, i64)> = (0..rng.random_range(0..20))
                .map(|_| {
                    let (a, b) = (rng.random_range(0..n), rng.random_range(0..n));
                    (a, b, rng.random_range(0..5), rng.random_range(0..5))
                })
                .filter(|e| e.0 != e.1)
                .collect();
            let mut graph = MaxFlow::new(n);
            for (i, t) in terminals.iter().enumerate() {
                graph.add_terminal(i, t.0, t.1);
            }
            for e in &edges {
                graph.add_edge(e.0, e.1, e.2, e.3);
            }
            let flow = graph.solve();
            assert_eq!(flow, brute_force(n, &terminals, &edges), "case {case}");
            // The sides that it names cost what it says.
            let sides: Vec<bool> = (0..n).map(|i| graph.is_source_side(i)).collect();
            let mut cost = 0;
            for (i, t) in terminals.iter().enumerate() {
                cost += if sides[i] { t.1 } else { t.0 };
            }
            for e in &edges {
                cost += match (sides[e.0], sides[e.1]) {
                    (true, false) => e.2,
                    (false, true) => e.3,
                    _ => 0,
                };
            }
            assert_eq!(cost, flow, "sides of case {case}");
        }
    }

    #[test]
    fn a_long_chain_breaks_at_its_weakest_link() {
        let n = 10_000;
        let mut graph = MaxFlow::new(n);
        graph.add_terminal(0, 1000, 0);
        graph.add_terminal(n - 1, 0, 1000);
        for i in 1..n {
            let capacity = if i == 7001 { 3 } else { 5 };
            graph.add_edge(i - 1, i, capacity, capacity);
        }
        assert_eq!(graph.solve(), 3);
        assert!(graph.is_source_side(7000) && !graph.is_source_side(7001));
    }
}
