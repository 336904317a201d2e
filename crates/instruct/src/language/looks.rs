//! Colors and materials.

use edit::changes::materials::material_names;
use edit::ops::{OpDocument, RecolorOp, SetMaterialOp};
use edit::run::{ColorChangeDocument, ColorModeDocument};

use super::draft::rounded;
use super::error::{Misread, nearest, shown};
use super::lexicon::{BEYOND, COLORS, Stuff, stuff};
use super::reader::{Reader, Verb};
use super::reference::Referent;

/// Words between an object and what it becomes.
const INTO: [&str; 24] = [
    "to look like it is made of",
    "look like it is made of",
    "look as if made of",
    "to look like",
    "look like",
    "looks like",
    "to be made of",
    "to be made out of",
    "be made of",
    "made of",
    "made out of",
    "out of",
    "look",
    "appear",
    "become",
    "to be",
    "be",
    "into",
    "in",
    "with",
    "of",
    "from",
    "to",
    "as",
];

impl Reader<'_, '_> {
    /// "make the ball matte black", "paint it red", "cover the chair in gold", "give the table a marble finish".
    pub(crate) fn looks(&mut self, verb: Verb) -> Result<(), Misread> {
        let from = self.cursor.at;
        if verb == Verb::Make && self.stuff_and_objects()? {
            return Ok(());
        }
        self.cursor.at = from;
        if verb == Verb::Make && self.makes_light()? {
            return Ok(());
        }
        self.cursor.at = from;
        let is_copies =
            || self.cursor.clone().eat_any(&["copies", "two copies", "a copy"]).is_some();
        if verb == Verb::Make && (is_copies() || self.counts_copies()) {
            self.cursor.at = from;
            return self.made_copies();
        }
        let objects = self.targets()?;
        // "the chair's material to marble".
        self.cursor.eat_any(&["material", "color", "colour", "finish"]);
        if let Targets::Some(found) = &objects
            && verb == Verb::Make
            && self.size(found)?
        {
            return Ok(());
        }
        while self.cursor.eat_any(&INTO).is_some() {}
        self.cursor.eat_any(&["a", "an"]);
        let stuff = self.stuff()?;
        self.finish();
        self.named_again(&objects);
        self.apply(&objects, &stuff)
    }

    /// "make it a sunset", "make this look like noon", "turn the scene into a sunrise".
    fn makes_light(&mut self) -> Result<bool, Misread> {
        self.cursor.eat_any(&[
            "the whole scene",
            "the scene",
            "this scene",
            "everything",
            "this",
            "it",
        ]);
        while self.cursor.eat_any(&INTO).is_some() {}
        self.lights()
    }

    /// "make the bottle a metal bottle": the noun once more.
    fn named_again(&mut self, targets: &Targets) {
        let from = self.cursor.at;
        let Targets::Some(named) = targets else { return };
        let again = self.finder.referent(&mut self.cursor, &[], false);
        let is_same = matches!(&again, Ok(Some(Referent::Objects(found))) if found == named);
        if !is_same {
            self.cursor.at = from;
        }
    }

    fn counts_copies(&self) -> bool {
        let mut ahead = self.cursor.clone();
        super::amount::number(&mut ahead).is_ok_and(|n| n.is_some())
            && ahead.eat_any(&["more copies", "copies", "copy", "duplicates"]).is_some()
    }

    /// What follows the name of a material and says nothing more.
    fn finish(&mut self) {
        self.cursor.eat_any(&[
            "finish", "look", "surface", "material", "paint", "color", "colored", "all over",
        ]);
    }

    /// "matte black cabinets": a material and its objects, without a verb.
    pub(crate) fn stuff_and_objects(&mut self) -> Result<bool, Misread> {
        let from = self.cursor.at;
        let article = self.cursor.eat_article();
        let Some(mut found) = stuff(&mut self.cursor) else {
            self.cursor.at = from;
            return Ok(false);
        };
        // "the red ball ..." is an object that is red; "red balls" are to become so.
        let objects = match self.objects_of_one_stuff() {
            Some(objects) if !article => objects,
            _ => {
                self.cursor.at = from;
                return Ok(false);
            }
        };
        if objects.is_empty() {
            self.cursor.at = from;
            return Ok(false);
        }
        self.last.clone_from(&objects);
        self.apply(&Targets::Some(objects), &std::mem::take(&mut found))?;
        Ok(true)
    }

    /// Objects with "and" between them, up to one before which another material stands.
    fn objects_of_one_stuff(&mut self) -> Option<Vec<usize>> {
        let Ok(Some(Referent::Objects(mut all))) =
            self.finder.referent(&mut self.cursor, &self.last, false)
        else {
            return None;
        };
        loop {
            let before = self.cursor.at;
            let separated = self.cursor.eat_mark(',') | self.cursor.eat("and");
            let is_another = stuff(&mut self.cursor.clone()).is_some();
            if separated
                && !is_another
                && self.begins_object()
                && let Ok(Some(Referent::Objects(more))) =
                    self.finder.referent(&mut self.cursor, &self.last, false)
            {
                all.extend(more);
                continue;
            }
            self.cursor.at = before;
            return Some(all);
        }
    }

    /// "the ball should be red", "I want the chair in gold": the objects first.
    pub(crate) fn should_be(&mut self) -> Result<bool, Misread> {
        let from = self.cursor.at;
        self.cursor.eat_any(&["i want", "i would like", "id like"]);
        let found = self.finder.referents(&mut self.cursor, &self.last, true);
        if let Ok(Some(Referent::Objects(objects))) = found {
            let linked = self
                .cursor
                .eat_any(&[
                    "should be made of",
                    "should look like",
                    "should become",
                    "should be",
                    "shall be",
                    "must be",
                    "needs to be",
                    "ought to be",
                    "made of",
                    "made out of",
                    "out of",
                    "to be made of",
                    "to be",
                    "be made of",
                    "be",
                    "in",
                    "as",
                ])
                .is_some();
            self.cursor.eat_any(&["a", "an"]);
            if linked && let Some(found) = stuff(&mut self.cursor) {
                self.last.clone_from(&objects);
                self.apply(&Targets::Some(objects), &found)?;
                return Ok(true);
            }
        }
        self.cursor.at = from;
        Ok(false)
    }

    /// "change the color of the ball to red", "set the light to noon", "change the ball to gold".
    pub(crate) fn change(&mut self) -> Result<(), Misread> {
        const LIGHT: [&str; 9] = [
            "the lighting of the scene",
            "the lighting",
            "the light",
            "the lights",
            "lighting",
            "the sun",
            "the time of day",
            "the illumination",
            "light",
        ];
        if self.cursor.eat_any(&LIGHT).is_some() {
            return self.relight();
        }
        let from = self.cursor.at;
        if self.cursor.eat_any(&["the scene", "this scene", "everything", "it"]).is_some() {
            self.cursor.eat_any(&["to", "into", "in", "at", "under"]);
            if self.lights()? {
                return Ok(());
            }
        }
        self.cursor.at = from;
        self.cursor.eat("the");
        let aspects = ["color of", "material of", "colour of", "look of", "finish of", "size of"];
        if self.cursor.eat_any(&aspects).is_none() {
            self.cursor.at = from;
        }
        self.looks(Verb::Paint)
    }

    fn targets(&mut self) -> Result<Targets, Misread> {
        let from = self.cursor.at;
        if let Some(Referent::Scene) =
            self.finder.referent(&mut self.cursor, &self.last, true).ok().flatten()
        {
            return Ok(Targets::All);
        }
        self.cursor.at = from;
        self.objects("what is to look different", true).map(Targets::Some)
    }

    /// The material at the cursor.
    ///
    /// # Errors
    /// None is there.
    fn stuff(&mut self) -> Result<Stuff, Misread> {
        if let Some(found) = stuff(&mut self.cursor) {
            return Ok(found);
        }
        if let Some((word, why)) = BEYOND.iter().find(|(word, _)| self.cursor.sees(word)) {
            let cause = format!("nothing here can be made of {word}: {why}");
            return Err(Misread::new(cause, known_stuff()));
        }
        if self.cursor.word().is_none() {
            return Err(Misread::new("it is not said what it becomes", known_stuff()));
        }
        let names = material_names();
        let known = names.split(", ").chain(COLORS.iter().map(|(name, _)| *name));
        let known = known
            .chain(["matte", "glossy", "shiny", "metallic", "wood", "steel", "bigger", "smaller"]);
        let near = self.cursor.word().and_then(|word| nearest(word, known));
        let near = near.map(|near| format!("the nearest is {}; ", shown(near))).unwrap_or_default();
        let cause = format!("{} is no color, material or size that is known", self.cursor.rest());
        Err(Misread::new(cause, format!("{near}{}", known_stuff())))
    }

    /// Gives objects a color or material.
    fn apply(&mut self, targets: &Targets, stuff: &Stuff) -> Result<(), Misread> {
        let ids = match targets {
            Targets::All => vec!["all".to_owned()],
            Targets::Some(objects) => {
                objects.iter().map(|&i| self.draft.target(i)).collect::<Result<Vec<_>, _>>()?
            }
        };
        for id in ids {
            if let Some((name, _)) = &stuff.color {
                self.draft.says(&id, "the color", name)?;
            }
            if let Some(name) = stuff.name {
                self.draft.says(&id, "the material", name)?;
            }
            let op = self.look_of(id, stuff);
            self.draft.ops.push(op);
        }
        Ok(())
    }

    fn look_of(&mut self, id: String, stuff: &Stuff) -> OpDocument {
        let rgb = stuff.color.as_ref().map(|(_, rgb)| rgb.map(rounded));
        if let (Some(rgb_linear), true) = (rgb, stuff.is_color_alone()) {
            let mode = ColorModeDocument::Replace;
            return OpDocument::Recolor(RecolorOp { target: Some(id), mode, rgb_linear });
        }
        if !self.draft.card.decomposed {
            self.draft.note(format!(
                "{} gets the color alone: how a plain splat reflects is not known",
                shown(&id)
            ));
        }
        let mode = ColorModeDocument::Replace;
        OpDocument::SetMaterial(SetMaterialOp {
            target: Some(id),
            name: stuff.name.map(str::to_owned),
            base_color: rgb.map(|rgb_linear| ColorChangeDocument { mode, rgb_linear }),
            roughness: stuff.roughness,
            metallic: stuff.metallic,
        })
    }
}

/// What changes its look.
pub(crate) enum Targets {
    All,
    Some(Vec<usize>),
}

fn known_stuff() -> String {
    let colors: Vec<&str> = COLORS.iter().map(|(name, _)| *name).collect();
    format!(
        "the materials are {}, wood, steel, metal; matte, satin, glossy, polished, metallic; the colors {}",
        material_names(),
        colors.join(", ")
    )
}
