//! Moving, and places beside other objects.

use edit::ops::{OpDocument, TransformOp};
use glam::DVec3;

use super::amount::{Length, length, world_units};
use super::direction::{Direction, direction};
use super::draft::{rounded3, width_of};
use super::error::{Misread, shown};
use super::reader::Reader;
use super::reference::Referent;

/// Room between two things side by side, of the sum of their half widths.
const SPACE: f64 = 0.1;

impl Reader<'_, '_> {
    /// A direction at the cursor.
    pub(crate) fn direction(&mut self) -> Option<Direction> {
        let before = self.cursor.at;
        if let Some(direction) = direction(&mut self.cursor) {
            return Some(direction);
        }
        self.cursor.eat_any(&["to", "toward", "towards", "on", "over to"]);
        self.cursor.eat("the");
        let found = direction(&mut self.cursor);
        if found.is_none() {
            self.cursor.at = before;
        }
        found.inspect(|_| {
            self.cursor.eat("side");
        })
    }

    pub(crate) fn vector(&self, direction: Direction) -> DVec3 {
        match direction {
            Direction::Left => -self.draft.right(),
            Direction::Right => self.draft.right(),
            Direction::Front => self.draft.front(),
            Direction::Back => -self.draft.front(),
            Direction::Up => self.draft.up(),
            Direction::Down => -self.draft.up(),
        }
    }

    /// World units of a length said of an object.
    pub(crate) fn measured(&self, said: Length, object: usize) -> Result<f64, Misread> {
        let object = self.draft.object(object);
        Ok(match said {
            Length::Metric(meters) => world_units(meters, self.draft.card.meters_per_unit)?,
            Length::World(units) => units,
            Length::Own(times) => times * width_of(object),
            Length::OwnHeight(times) => times * object.size.height,
        })
    }

    /// "move ... 20 cm to the left and up".
    pub(crate) fn movement(&mut self, only: Option<Direction>) -> Result<(), Misread> {
        let objects = self.objects("what is to move", false)?;
        let mut before = self.said_length()?;
        let mut steps = Vec::new();
        if let Some(only) = only {
            // "lift it up".
            self.cursor.eat_any(match only {
                Direction::Up => &["up", "upward", "upwards", "higher"],
                _ => &["down", "downward", "downwards", "lower"],
            });
            steps.push((only, before.take().or(self.said_length()?)));
        }
        while only.is_none() {
            let from = self.cursor.at;
            if !steps.is_empty() {
                self.cursor.eat("and");
                before = self.said_length()?;
            }
            let Some(direction) = self.direction().filter(|_| !self.cursor.sees("of")) else {
                self.cursor.at = from;
                break;
            };
            let amount = before.take().or(self.said_length()?);
            steps.push((direction, amount));
        }
        if steps.is_empty() {
            return self.put_at_place(&objects, before);
        }
        for &object in &objects {
            self.one_move(object, &steps)?;
        }
        Ok(())
    }

    /// "20 cm", "by 20 cm".
    pub(crate) fn said_length(&mut self) -> Result<Option<Length>, Misread> {
        let from = self.cursor.at;
        self.cursor.eat("by");
        let found = length(&mut self.cursor)?;
        if found.is_none() {
            self.cursor.at = from;
        }
        Ok(found)
    }

    fn one_move(
        &mut self,
        object: usize,
        steps: &[(Direction, Option<Length>)],
    ) -> Result<(), Misread> {
        let id = self.draft.target(object)?;
        // A distance said once holds for all directions.
        let shared = steps.iter().find_map(|(_, amount)| *amount);
        let mut shift = DVec3::ZERO;
        for (direction, amount) in steps {
            self.draft.says(&id, direction.axis(), direction.name())?;
            let length = match amount.or(shared) {
                Some(length) => self.measured(length, object)?,
                None => {
                    let text =
                        format!("no distance was said: {} moves by its own width", shown(&id));
                    self.draft.note(text);
                    width_of(self.draft.object(object))
                }
            };
            shift += self.vector(*direction) * length;
        }
        self.shift(id, shift)
    }

    fn shift(&mut self, id: String, shift: DVec3) -> Result<(), Misread> {
        let translate = Some(rounded3(shift));
        self.draft.ops.push(OpDocument::Transform(TransformOp {
            target: Some(id),
            translate,
            ..TransformOp::default()
        }));
        Ok(())
    }

    /// "put ... on the table", "... next to the lemon", "... 5 cm to the right of the mug": `gap` is what lies between.
    pub(crate) fn put_at_place(
        &mut self,
        objects: &[usize],
        gap: Option<Length>,
    ) -> Result<(), Misread> {
        let from = self.cursor.at;
        let gap = gap.map(|gap| self.measured(gap, objects[0])).transpose()?;
        let Some((to, height)) = self.place(objects[0], gap)? else {
            self.cursor.at = from;
            return Err(Misread::new(
                format!("it is not said where {} goes", self.finder.listed(objects)),
                "say a direction (left, right, forward, back, up, down), or \"next to\", \"on\", \"behind\" another object",
            ));
        };
        let &[object] = objects else {
            let cause = format!("{} cannot all go to one place", self.finder.listed(objects));
            return Err(Misread::new(cause, "move one after another"));
        };
        let moved = self.draft.object(object);
        let up = self.draft.up();
        let level = |p: DVec3| p - up * p.dot(up);
        let base = DVec3::from_array(moved.base);
        let shift = level(to - base) + up * height.map_or(0.0, |height| height - base.dot(up));
        let id = self.draft.target(object)?;
        self.draft.says(&id, "the place", &shown(&format!("{to}")))?;
        self.shift(id, shift)
    }

    /// "where the bottle was", "where it stands": the base of another object.
    fn vacated_place(&mut self, not: &[usize]) -> Result<Option<DVec3>, Misread> {
        let from = self.cursor.at;
        if !self.cursor.eat("where") {
            return Ok(None);
        }
        // What was named before the clause, since the object of the clause is "it" by now.
        let said_it = self.cursor.eat("it");
        let other = if said_it {
            self.before_last.clone()
        } else {
            match self.finder.referent(&mut self.cursor, &self.last, false)? {
                Some(Referent::Objects(other)) => other,
                _ => Vec::new(),
            }
        };
        let stands = ["was", "is", "stood", "stands", "used to be", "has been", "sits", "sat"];
        match other.as_slice() {
            &[other] if !not.contains(&other) && self.cursor.eat_any(&stands).is_some() => {
                Ok(Some(DVec3::from_array(self.draft.object(other).base)))
            }
            _ => {
                self.cursor.at = from;
                let cause = format!("{} names no place", self.cursor.rest());
                Err(Misread::new(cause, "say it as in \"where the bottle was\""))
            }
        }
    }

    /// Where something of the size of `object` comes to stand: a point, and the height of its lowest part where that changes.
    fn place(
        &mut self,
        object: usize,
        gap: Option<f64>,
    ) -> Result<Option<(DVec3, Option<f64>)>, Misread> {
        let size = self.draft.object(object).size;
        let at = DVec3::from_array(self.draft.object(object).base);
        self.place_of([size.width, size.depth], gap, Some(at), &[object])
    }

    /// As [`Self::place`], for a width and a depth; `at` is where it is now. Without a `gap` a tenth of the widths lies between.
    pub(crate) fn place_of(
        &mut self,
        [width, depth]: [f64; 2],
        gap: Option<f64>,
        at: Option<DVec3>,
        not: &[usize],
    ) -> Result<Option<(DVec3, Option<f64>)>, Misread> {
        const PLACES: [&str; 19] = [
            "to the left of",
            "on the left of",
            "left of",
            "to the right of",
            "on the right of",
            "right of",
            "in front of",
            "to the front of",
            "at the front of",
            "behind",
            "to the back of",
            "at the back of",
            "next to",
            "beside",
            "near",
            "close to",
            "on top of",
            "onto",
            "on",
        ];
        if let Some(vacated) = self.vacated_place(not)? {
            return Ok(Some((vacated, Some(vacated.dot(self.draft.up())))));
        }
        let Some(place) = self.cursor.eat_any(&PLACES) else { return Ok(None) };
        let other = match self.finder.referent(&mut self.cursor, &self.last, false)? {
            Some(Referent::Objects(other)) if other.len() == 1 && !not.contains(&other[0]) => {
                other[0]
            }
            Some(Referent::Objects(other)) => {
                let cause = format!("{} cannot be the place", self.finder.listed(&other));
                return Err(Misread::new(cause, "name one other object"));
            }
            _ => {
                let cause = format!("there is no object in {}", self.cursor.rest());
                return Err(Misread::new(cause, self.finder.help()));
            }
        };
        let there = self.draft.object(other);
        let base = DVec3::from_array(there.base);
        let aside = |own: f64, its: f64| match gap {
            Some(gap) => 0.5 * (own + its) + gap,
            None => 0.5 * (own + its) * (1.0 + SPACE),
        };
        let (right, front) = (self.draft.right(), self.draft.front());
        let sideways = aside(width, there.size.width);
        let lengthways = aside(depth, there.size.depth);
        let id = there.id.clone();
        Ok(Some(match place {
            "on top of" | "onto" | "on" if gap.is_some() => {
                let cause = format!("a distance does not go with {}", shown(place));
                return Err(Misread::new(
                    cause,
                    "say \"put it on the table\", or \"move it 5 cm up\"",
                ));
            }
            "on top of" | "onto" | "on" => {
                (base, Some(base.dot(self.draft.up()) + there.size.height))
            }
            "behind" | "to the back of" | "at the back of" => (base - front * lengthways, None),
            "in front of" | "to the front of" | "at the front of" => {
                (base + front * lengthways, None)
            }
            place if place.ends_with("left of") => (base - right * sideways, None),
            place if place.ends_with("right of") => (base + right * sideways, None),
            _ => {
                let is_left = at.is_some_and(|at| (at - base).dot(right) < 0.0);
                let side = if is_left { "left" } else { "right" };
                self.draft.note(format!("next to {}: on its {side}", shown(&id)));
                (base + right * if is_left { -sideways } else { sideways }, None)
            }
        }))
    }
}
