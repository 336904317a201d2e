//! The part of a wall that photos do not show, and do not look through either.

use glam::{Vec2, Vec3};
use rayon::prelude::*;

use super::{CLOSE, MOST_CELLS, Sheet};
use crate::steps::surface::room::{Room, Shown};

/// What photos tell of a cell of a wall.
#[derive(Clone, Copy, PartialEq)]
enum Cell {
    Wall,
    /// In no picture.
    Unseen,
    /// In pictures, behind something.
    Hidden,
    /// Looked through, behind another wall, or beyond what photos show of this one.
    Open,
}

impl Sheet {
    /// An upright wall with what photos leave out of it: the cells from which a straight way up, down or aside leads to it through nothing
    /// that photos look through. A wall ends where the last photo of it does, and at other walls. `None` where nothing is left out.
    pub(in crate::steps::surface) fn completed(&self, room: &Room<'_>) -> Option<Self> {
        let plane = &self.plane;
        let up = room.up().reject_from_normalized(plane.normal).normalize();
        let sides = [plane.normal.cross(up), up];
        let [low, high] = self.rectangle(sides)?;
        let place = |c: Vec2| plane.normal * plane.offset + sides[0] * c.x + sides[1] * c.y;
        let corners = [low, high, Vec2::new(low.x, high.y), Vec2::new(high.x, low.y)];
        let mut whole = self.grown(corners.map(place))?;
        let is_in = |p: Vec3| {
            let flat = Vec2::from(sides.map(|side| side.dot(p)));
            flat.cmpge(low).all() && flat.cmple(high).all() && room.holds(p)
        };
        let of = |i: usize| match whole.center(i) {
            _ if whole.filled[i] => Cell::Wall,
            p if whole.open[i] || !is_in(p) => Cell::Open,
            p => match room.shown(plane, p) {
                Shown::Nowhere => Cell::Unseen,
                Shown::Hidden => Cell::Hidden,
                Shown::Through => Cell::Open,
            },
        };
        let mut cells: Vec<Cell> = (0..whole.filled.len()).into_par_iter().map(of).collect();
        whole.go_on(&mut cells, sides.map(|d| Vec2::from(self.axes.map(|axis| axis.dot(d)))));
        let before = std::mem::take(&mut whole.filled);
        whole.filled = cells.iter().map(|c| *c == Cell::Wall).collect();
        whole.close();
        let grew = whole.filled.iter().zip(&before).any(|(after, before)| *after && !before);
        grew.then_some(whole)
    }

    /// Least and largest components of what is shown, along two directions.
    fn rectangle(&self, along: [Vec3; 2]) -> Option<[Vec2; 2]> {
        let filled = (0..self.filled.len()).filter(|i| self.filled[*i]);
        let flat = filled.map(|i| Vec2::from(along.map(|d| d.dot(self.center(i)))));
        flat.map(|p| [p, p]).reduce(|[low, high], [p, _]| [low.min(p), high.max(p)])
    }

    /// The same cells on a grid that holds these points, too; `None` where it would have too many.
    fn grown(&self, points: [Vec3; 4]) -> Option<Self> {
        let (mut low, mut high) = (Vec2::ZERO, self.size.as_vec2());
        for p in points.map(|p| self.cell_under(p)) {
            (low, high) = (low.min(p - CLOSE as f32), high.max(p + (CLOSE + 1) as f32));
        }
        if !((high - low).element_product() <= MOST_CELLS) {
            return None;
        }
        let (low, size) = (low.as_ivec2(), (high - low).as_ivec2());
        let moved = (self.axes[0] * low.x as f32 + self.axes[1] * low.y as f32) * self.cell;
        let none = vec![false; (size.x * size.y) as usize];
        let (mut filled, mut open) = (none.clone(), none);
        for i in 0..self.filled.len() {
            let c = self.column_and_row(i) - low;
            let to = (c.y * size.x + c.x) as usize;
            (filled[to], open[to]) = (self.filled[i], self.open[i]);
        }
        Some(Self { origin: self.origin + moved, size, filled, open, ..*self })
    }

    /// Makes cells wall that lie straight over, under or beside wall.
    fn go_on(&self, cells: &mut [Cell], along: [Vec2; 2]) {
        let ways = |cells: &[Cell], i: usize, d: Vec2| {
            [d, -d].into_iter().filter(|d| self.reaches(cells, i, *d)).count()
        };
        let mut turn = |kind: Cell, is_wall: &(dyn Fn(&[Cell], usize) -> bool + Sync)| {
            let before = cells.to_vec();
            cells.par_iter_mut().enumerate().filter(|(_, c)| **c == kind).for_each(|(i, cell)| {
                if is_wall(&before, i) {
                    *cell = Cell::Wall;
                }
            });
        };
        turn(Cell::Unseen, &|cells, i| along.iter().any(|d| ways(cells, i, *d) > 0));
        // A corner between a part over what is shown and one beside it.
        turn(Cell::Unseen, &|cells, i| along.iter().all(|d| ways(cells, i, *d) > 0));
        turn(Cell::Hidden, &|cells, i| along.iter().any(|d| ways(cells, i, *d) == 2));
    }

    /// Whether a straight way from a cell leads to wall through nothing that is open.
    fn reaches(&self, cells: &[Cell], i: usize, step: Vec2) -> bool {
        let mut at = self.column_and_row(i).as_vec2() + 0.5;
        loop {
            at += step;
            match self.index(at.floor().as_ivec2()).map(|k| cells[k]) {
                Some(Cell::Wall) => return true,
                Some(Cell::Unseen | Cell::Hidden) => {}
                Some(Cell::Open) | None => return false,
            }
        }
    }

    /// Middle of a cell, in the unit world.
    fn center(&self, i: usize) -> Vec3 {
        let c = (self.column_and_row(i).as_vec2() + 0.5) * self.cell;
        self.origin + self.axes[0] * c.x + self.axes[1] * c.y
    }
}

#[cfg(test)]
mod tests;
