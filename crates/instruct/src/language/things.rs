//! Removing, keeping, copying, swapping and inserting.

use edit::ops::{
    DeleteOp, DuplicateOp, ExtractOp, InsertOp, OpDocument, RemoveFloatersOp, SwapOp, TransformOp,
};
use edit::run::{Fill, PlaceDocument};
use glam::DVec3;

use super::amount::Length;
use super::amount::{number, world_units};
use super::direction::Direction;
use super::draft::{rounded, rounded3, width_of};
use super::error::{Misread, nearest, shown};
use super::reader::Reader;
use super::reference::Referent;

/// From one copy to the next without a distance, widths of the object.
const COPY_STEP: f64 = 1.2;
/// Copies of one command.
const MOST_COPIES: f64 = 100.0;

impl Reader<'_, '_> {
    /// "remove the bottle and its shadow", "remove everything but the ball", "remove floaters".
    pub(crate) fn removal(&mut self) -> Result<(), Misread> {
        let from = self.cursor.at;
        self.cursor.eat("the");
        if self.cursor.eat_any(&["floaters", "stray splats", "noise", "outliers"]).is_some() {
            return self.floaters();
        }
        self.cursor.at = from;
        if self
            .cursor
            .eat_any(&[
                "everything but",
                "everything except",
                "everything else but",
                "all but",
                "everything apart from",
            ])
            .is_some()
        {
            return self.keep();
        }
        let objects = self.objects("what is to go", true)?;
        self.shadow();
        for object in objects {
            let id = self.draft.target(object)?;
            self.draft.remove(&id);
            self.draft
                .ops
                .push(OpDocument::Delete(DeleteOp { target: Some(id), fill: Fill::default() }));
        }
        Ok(())
    }

    /// "take the bottle away", "get the chair out of here".
    pub(crate) fn taking(&mut self) -> Result<(), Misread> {
        const LEAVES: [&str; 10] = [
            "away",
            "out of here",
            "out of the scene",
            "out of the picture",
            "out of the room",
            "out of the way",
            "out",
            "off",
            "from the scene",
            "from here",
        ];
        let from = self.cursor.at;
        let objects = self.objects("what is to go", false)?;
        self.shadow();
        if self.cursor.eat_any(&LEAVES).is_none() {
            let cause = format!("it is not said where {} goes", self.finder.listed(&objects));
            let help = "say \"take it away\" to remove it, or \"move it to the left\"";
            return Err(Misread::new(cause, help));
        }
        let behind = self.cursor.at;
        self.cursor.at = from;
        self.removal()?;
        self.cursor.at = self.cursor.at.max(behind);
        Ok(())
    }

    /// "and its shadow", "with its shadow".
    fn shadow(&mut self) {
        const WORDS: [&str; 8] = [
            "and its shadow",
            "with its shadow",
            "together with its shadow",
            "along with its shadow",
            "and their shadows",
            "with their shadows",
            "and the shadow",
            "including its shadow",
        ];
        let from = self.cursor.at;
        self.cursor.eat_mark(',');
        match self.cursor.eat_any(&WORDS) {
            Some(_) => self.draft.shadows = true,
            None => self.cursor.at = from,
        }
    }

    pub(crate) fn floaters(&mut self) -> Result<(), Misread> {
        let op = RemoveFloatersOp { target: Some("all".into()), ..RemoveFloatersOp::default() };
        self.draft.ops.push(OpDocument::RemoveFloaters(op));
        Ok(())
    }

    pub(crate) fn keep(&mut self) -> Result<(), Misread> {
        let objects = self.objects("what is to stay", true)?;
        let &[object] = objects.as_slice() else {
            let cause = format!("{} cannot stay together", self.finder.listed(&objects));
            return Err(Misread::new(cause, "keep one object, or remove the others by name"));
        };
        let target = Some(self.draft.target(object)?);
        self.draft.ops.push(OpDocument::Extract(ExtractOp { target }));
        Ok(())
    }

    /// "put the ball on the table", "put sofa.glb next to the chair".
    pub(crate) fn put(&mut self) -> Result<(), Misread> {
        let from = self.cursor.at;
        self.cursor.eat_article();
        if self.cursor.file().is_some() {
            return self.insertion();
        }
        self.cursor.at = from;
        let objects = self.objects("what is to move", false)?;
        self.put_at_place(&objects, None)
    }

    /// "duplicate the ball twice to the left", "copy it 20 cm to the right".
    pub(crate) fn copies(&mut self) -> Result<(), Misread> {
        let objects = self.objects("what is to be copied", false)?;
        let count = match () {
            () if self.cursor.eat("once") => 1.0,
            () if self.cursor.eat("twice") => 2.0,
            () => {
                let from = self.cursor.at;
                match number(&mut self.cursor)? {
                    Some(count) if self.cursor.eat("times") => count,
                    _ => {
                        self.cursor.at = from;
                        1.0
                    }
                }
            }
        };
        self.copied(&objects, count)
    }

    /// "make two copies of the ball".
    pub(crate) fn made_copies(&mut self) -> Result<(), Misread> {
        self.cursor.eat("a");
        let count = number(&mut self.cursor)?.unwrap_or(1.0);
        self.cursor.eat_any(&["more copies of", "copies of", "copy of", "duplicates of"]);
        let objects = self.objects("what is to be copied", false)?;
        self.copied(&objects, count)
    }

    fn copied(&mut self, objects: &[usize], count: f64) -> Result<(), Misread> {
        if !(count.fract() == 0.0 && (1.0..=MOST_COPIES).contains(&count)) {
            let cause = format!("{count} copies cannot be made by one command");
            return Err(Misread::new(cause, format!("say a whole number from 1 to {MOST_COPIES}")));
        }
        let from = self.cursor.at;
        self.cursor.eat_mark(',');
        let mut said = self.said_length()?;
        let direction = self.direction();
        if said.is_none() && direction.is_none() {
            self.cursor.at = from;
        }
        said = said.or(self.said_length()?);
        let direction = direction.unwrap_or_else(|| {
            self.draft.note("no direction was said: copies stand on the right");
            Direction::Right
        });
        for &object in objects {
            let length = match said {
                Some(length) => self.measured(length, object)?,
                None => COPY_STEP * width_of(self.draft.object(object)),
            };
            let target = Some(self.draft.target(object)?);
            let translate = rounded3(self.vector(direction) * length);
            let op = DuplicateOp { target, name: None, translate, count: count as u64 };
            self.draft.ops.push(OpDocument::Duplicate(op));
        }
        Ok(())
    }

    /// "swap the sofa for sofa.glb", "swap the ball and the lemon".
    pub(crate) fn swap(&mut self) -> Result<(), Misread> {
        let objects = self.objects("what is to be swapped", true)?;
        if let &[a, b] = objects.as_slice() {
            return self.trade_places(a, b);
        }
        if self.cursor.eat_any(&["for", "with", "by", "against"]).is_none() {
            return Err(Misread::new(
                "it is not said what comes in its place",
                self.known_assets(),
            ));
        }
        self.cursor.eat_article();
        let &[object] = objects.as_slice() else {
            let cause = format!("{} cannot become one thing", self.finder.listed(&objects));
            return Err(Misread::new(cause, "swap one after another"));
        };
        if self.cursor.file().is_none()
            && let Some(Referent::Objects(other)) =
                self.finder.referent(&mut self.cursor, &[], true)?
            && let &[other] = other.as_slice()
        {
            return self.trade_places(object, other);
        }
        let file = self.asset()?;
        let id = self.draft.target(object)?;
        self.draft.remove(&id);
        let op = SwapOp { target: Some(id), file, ..SwapOp::default() };
        self.draft.ops.push(OpDocument::Swap(op));
        Ok(())
    }

    fn trade_places(&mut self, a: usize, b: usize) -> Result<(), Misread> {
        let base = |i: usize| DVec3::from_array(self.draft.object(i).base);
        let shift = base(b) - base(a);
        for (object, shift) in [(a, shift), (b, -shift)] {
            let id = self.draft.target(object)?;
            self.draft.says(&id, "the place", "another")?;
            let op = TransformOp {
                target: Some(id),
                translate: Some(rounded3(shift)),
                ..TransformOp::default()
            };
            self.draft.ops.push(OpDocument::Transform(op));
        }
        Ok(())
    }

    /// "insert lamp.glb on the table", "add vase.glb left of the chair, 30 cm tall".
    pub(crate) fn insertion(&mut self) -> Result<(), Misread> {
        self.cursor.eat_article();
        let file = self.asset()?;
        let mut op = InsertOp { file, ..InsertOp::default() };
        let mut height = self.tall()?;
        if let Some((to, level)) = self.place_of([0.0; 2], None, None, &[])? {
            let up = self.draft.up();
            let at = level.map_or(to, |level| to + up * (level - to.dot(up)));
            op.at = Some(PlaceDocument::Point(rounded3(at)));
        } else if self.cursor.eat_any(&["at", "to"]).is_some() {
            op.at = Some(PlaceDocument::Point(self.point()?));
        } else {
            self.draft
                .note("no place was said: it stands on free ground near the middle of the scene");
        }
        let from = self.cursor.at;
        self.cursor.eat_mark(',');
        height = height.or(self.tall()?);
        if height.is_none() {
            self.cursor.at = from;
        }
        op.height = height.map(rounded);
        self.draft.ops.push(OpDocument::Insert(op));
        Ok(())
    }

    /// "30 cm tall".
    fn tall(&mut self) -> Result<Option<f64>, Misread> {
        let from = self.cursor.at;
        if let Some(length) = self.said_length()?
            && self.cursor.eat_any(&["tall", "high", "in height"]).is_some()
        {
            return match length {
                Length::Metric(meters) => {
                    world_units(meters, self.draft.card.meters_per_unit).map(Some)
                }
                Length::World(units) => Ok(Some(units)),
                _ => Err(Misread::new(
                    "it has no height of its own yet",
                    "say a length, as in \"30 cm tall\"",
                )),
            };
        }
        self.cursor.at = from;
        Ok(None)
    }

    /// "1, 2, 0.5": world coordinates.
    fn point(&mut self) -> Result<[f64; 3], Misread> {
        let from = self.cursor.at;
        let mut point = [0.0; 3];
        for (k, value) in point.iter_mut().enumerate() {
            if k > 0 {
                self.cursor.eat_mark(',');
            }
            let Some(number) = self.cursor.number().filter(|v| v.abs() <= 1e6) else {
                let cause = format!("{} is no point of the world", self.cursor.since(from));
                return Err(Misread::new(cause, "say three numbers, as in \"at 0.1, 0.2, 0\""));
            };
            self.cursor.step();
            *value = number;
        }
        Ok(point)
    }

    /// The file at the cursor, when it is one of the assets.
    ///
    /// # Errors
    /// It is none of them.
    fn asset(&mut self) -> Result<String, Misread> {
        let Some(name) = self.cursor.file() else {
            let cause = match self.cursor.word() {
                Some(_) => format!("{} is no file", self.cursor.rest()),
                None => "no file is named".into(),
            };
            return Err(Misread::new(cause, self.known_assets()));
        };
        let assets = &self.draft.card.assets;
        if let Some(asset) = assets.iter().find(|asset| asset.as_str() == name) {
            self.cursor.step();
            return Ok(asset.clone());
        }
        let outside = name.starts_with('/')
            || name.contains('\\')
            || name.split('/').any(|part| part == "..");
        let cause = match outside {
            true => format!("{} lies outside the folder of --assets", shown(name)),
            false => format!("there is no asset {}", shown(name)),
        };
        let near = nearest(name, assets.iter().map(String::as_str));
        let near = near.map(|near| format!("did you mean {}? ", shown(near))).unwrap_or_default();
        Err(Misread::new(cause, format!("{near}{}", self.known_assets())))
    }

    fn known_assets(&self) -> String {
        let assets = &self.draft.card.assets;
        match assets.as_slice() {
            [] => "give the folder of what may be inserted with --assets DIR, and name a file of it, as in sofa.glb".into(),
            some => format!("the assets are {}", some.iter().take(20).cloned().collect::<Vec<_>>().join(", ")),
        }
    }
}
