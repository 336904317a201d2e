//! Superpixels and what they touch, as a weighted graph.

use crate::coarsening::Hierarchy;

/// Two superpixels that touch in an image or show the same place.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Link {
    pub(crate) nodes: [u32; 2],
    /// Length of the border, superpixel sides.
    pub(crate) weight: f32,
    /// How strongly it parts, 0 to 1.
    pub(crate) strength: f32,
    /// Length of the border where the two touch in space, superpixel sides; 0 where one is only seen
    /// before the other, and between views.
    pub(crate) contact: f32,
}

/// A conductance falls to `exp(-PARTING)` at full strength; weak edges, which patterns are, cost little
/// because strength enters squared.
const PARTING: f32 = 8.0;
/// A walk tires with this probability per step: it reaches some 30 superpixels.
pub(crate) const TIRING: f32 = 1e-3;

/// Symmetric conductances between superpixels, as rows.
#[derive(Clone, Debug, Default)]
pub(crate) struct Graph {
    offsets: Vec<u32>,
    neighbors: Vec<u32>,
    conductances: Vec<f32>,
    contacts: Vec<f32>,
    /// Sum of each row.
    pub(crate) degrees: Vec<f32>,
    hierarchy: Hierarchy,
}

impl Graph {
    pub(crate) fn new(nodes: usize, links: &[Link]) -> Self {
        let mut offsets = vec![0u32; nodes + 2];
        for link in links {
            link.nodes.iter().for_each(|&n| offsets[n as usize + 2] += 1);
        }
        for i in 2..offsets.len() {
            offsets[i] += offsets[i - 1];
        }
        let mut neighbors = vec![0u32; 2 * links.len()];
        let mut conductances = vec![0.0f32; 2 * links.len()];
        let mut contacts = vec![0.0f32; 2 * links.len()];
        let mut degrees = vec![0.0f32; nodes];
        for link in links {
            let c = link.weight * (-PARTING * link.strength * link.strength).exp();
            for [a, b] in [link.nodes, [link.nodes[1], link.nodes[0]]] {
                let slot = &mut offsets[a as usize + 1];
                neighbors[*slot as usize] = b;
                conductances[*slot as usize] = c;
                contacts[*slot as usize] = link.contact;
                degrees[a as usize] += c;
                *slot += 1;
            }
        }
        offsets.pop();
        let hierarchy = Hierarchy::default();
        let mut graph = Self { offsets, neighbors, conductances, contacts, degrees, hierarchy };
        let diagonal = |d: &f32| (d * (1.0 + TIRING)).max(1e-12);
        graph.hierarchy =
            Hierarchy::new(graph.degrees.iter().map(diagonal).collect(), |i, list| {
                let others = graph.row(i).filter(|(j, _)| *j != i);
                list.extend(others.map(|(j, c)| (j as u32, c)));
            });
        graph
    }

    /// The equations of walks at coarser and coarser resolutions.
    pub(crate) fn hierarchy(&self) -> &Hierarchy {
        &self.hierarchy
    }

    pub(crate) fn contacts_of(&self, i: usize) -> impl Iterator<Item = (usize, f32)> + '_ {
        let range = self.offsets[i] as usize..self.offsets[i + 1] as usize;
        self.neighbors[range.clone()]
            .iter()
            .map(|&n| n as usize)
            .zip(self.contacts[range].iter().copied())
            .filter(|&(_, length)| length > 0.0)
    }

    pub(crate) fn row(&self, i: usize) -> impl Iterator<Item = (usize, f32)> + '_ {
        let range = self.offsets[i] as usize..self.offsets[i + 1] as usize;
        self.neighbors[range.clone()]
            .iter()
            .map(|&n| n as usize)
            .zip(self.conductances[range].iter().copied())
    }
}
