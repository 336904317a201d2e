//! Turning.

use edit::ops::{OpDocument, TransformOp};
use edit::run::AxisAngleDocument;

use super::amount::degrees;
use super::draft::rounded3;
use super::error::Misread;
use super::reader::Reader;

impl Reader<'_, '_> {
    /// "rotate ... by 30 degrees clockwise".
    pub(crate) fn rotation(&mut self, objects: &[usize]) -> Result<(), Misread> {
        self.cursor.eat("by");
        let upside_down = self.cursor.eat("upside down");
        let mut sense = self.sense();
        self.cursor.eat("by");
        let said = if upside_down { Some(180.0) } else { degrees(&mut self.cursor)? };
        sense = sense.or_else(|| self.sense());
        let Some(deg) = said else {
            return Err(Misread::new(
                "it is not said how far it turns",
                "say degrees, as in \"30 degrees clockwise\", or \"a quarter turn\"",
            ));
        };
        let symmetric = deg == 180.0 || deg == 360.0;
        if sense.is_none() && !symmetric {
            self.draft.note("no sense of rotation was said: counter-clockwise, seen from above");
        }
        let axis = if upside_down { self.draft.front() } else { self.draft.up() };
        for &object in objects {
            let id = self.draft.target(object)?;
            let sign = if sense == Some("clockwise") { -1.0 } else { 1.0 };
            self.draft.says(&id, "the turn", &format!("{}", sign * deg))?;
            self.draft.ops.push(OpDocument::Transform(TransformOp {
                target: Some(id),
                rotate_axis: Some(AxisAngleDocument { axis: rounded3(axis), deg: sign * deg }),
                ..TransformOp::default()
            }));
        }
        Ok(())
    }

    fn sense(&mut self) -> Option<&'static str> {
        const SENSES: [(&str, &str); 8] = [
            ("counter clockwise", "counter-clockwise"),
            ("counterclockwise", "counter-clockwise"),
            ("anticlockwise", "counter-clockwise"),
            ("anti clockwise", "counter-clockwise"),
            ("clockwise", "clockwise"),
            // Seen from above, what turns to its viewer's right goes counter-clockwise: its front swings to the right.
            ("to the right", "counter-clockwise"),
            ("to the left", "clockwise"),
            ("right", "counter-clockwise"),
        ];
        SENSES.iter().find(|(words, _)| self.cursor.eat(words)).map(|(_, sense)| *sense)
    }
}
