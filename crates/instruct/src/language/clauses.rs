//! Clauses: verbs, what follows them, and what comes between.

use super::direction::Direction;
use super::draft::Draft;
use super::error::{Misread, nearest, shown};
use super::reader::{Reader, Verb};
use super::reference::Referent;

/// Words of the verbs; the longest that fits counts.
const VERBS: &[(&str, Verb)] = &[
    ("relight", Verb::Relight),
    ("light", Verb::Relight),
    ("illuminate", Verb::Relight),
    ("move", Verb::Move),
    ("shift", Verb::Move),
    ("slide", Verb::Move),
    ("push", Verb::Move),
    ("pull", Verb::Move),
    ("nudge", Verb::Move),
    ("drag", Verb::Move),
    ("bring", Verb::Move),
    ("scoot", Verb::Move),
    ("shove", Verb::Move),
    ("carry", Verb::Move),
    ("reposition", Verb::Move),
    ("relocate", Verb::Move),
    ("lift", Verb::Lift),
    ("raise", Verb::Lift),
    ("elevate", Verb::Lift),
    ("lower", Verb::Lower),
    ("drop", Verb::Lower),
    ("sink", Verb::Lower),
    ("put", Verb::Put),
    ("stand", Verb::Put),
    ("position", Verb::Put),
    ("place", Verb::Put),
    ("set", Verb::Change),
    ("rotate", Verb::Rotate),
    ("spin", Verb::Rotate),
    ("twist", Verb::Rotate),
    ("swivel", Verb::Rotate),
    ("pivot", Verb::Rotate),
    ("tilt", Verb::Rotate),
    ("tip", Verb::Rotate),
    ("turn", Verb::Turn),
    ("flip", Verb::Flip),
    ("scale", Verb::Scale),
    ("resize", Verb::Scale),
    ("enlarge", Verb::Enlarge),
    ("grow", Verb::Enlarge),
    ("magnify", Verb::Enlarge),
    ("expand", Verb::Enlarge),
    ("scale up", Verb::Enlarge),
    ("blow up", Verb::Enlarge),
    ("shrink", Verb::Shrink),
    ("scale down", Verb::Shrink),
    ("downsize", Verb::Shrink),
    ("reduce", Verb::Shrink),
    ("double the size of", Verb::Double),
    ("double the height of", Verb::Double),
    ("double the width of", Verb::Double),
    ("double", Verb::Double),
    ("halve the size of", Verb::Halve),
    ("halve", Verb::Halve),
    ("remove", Verb::Delete),
    ("delete", Verb::Delete),
    ("erase", Verb::Delete),
    ("get rid of", Verb::Delete),
    ("take away", Verb::Delete),
    ("take out", Verb::Delete),
    ("throw away", Verb::Delete),
    ("throw out", Verb::Delete),
    ("clear away", Verb::Delete),
    ("dispose of", Verb::Delete),
    ("do away with", Verb::Delete),
    ("eliminate", Verb::Delete),
    ("discard", Verb::Delete),
    ("hide", Verb::Delete),
    ("take", Verb::Take),
    ("get", Verb::Take),
    ("throw", Verb::Take),
    ("clear", Verb::Take),
    ("keep only", Verb::Keep),
    ("keep just", Verb::Keep),
    ("isolate", Verb::Keep),
    ("extract", Verb::Keep),
    ("duplicate", Verb::Copy),
    ("copy", Verb::Copy),
    ("clone", Verb::Copy),
    ("swap out", Verb::Swap),
    ("swap", Verb::Swap),
    ("switch", Verb::Swap),
    ("substitute", Verb::Swap),
    ("replace", Verb::Swap),
    ("exchange", Verb::Swap),
    ("insert", Verb::Insert),
    ("add", Verb::Insert),
    ("drop in", Verb::Insert),
    ("paint", Verb::Paint),
    ("color", Verb::Paint),
    ("colour", Verb::Paint),
    ("recolor", Verb::Paint),
    ("dye", Verb::Paint),
    ("tint", Verb::Paint),
    ("make", Verb::Make),
    ("turn into", Verb::Make),
    ("cover", Verb::Cover),
    ("coat", Verb::Cover),
    ("give", Verb::Give),
    ("change", Verb::Change),
    ("clean up", Verb::Clean),
    ("clean", Verb::Clean),
];

/// Words before a clause that ask politely or order the clauses.
const OPENERS: &[&str] = &[
    "please",
    "kindly",
    "can you",
    "could you",
    "would you",
    "will you",
    "i want you to",
    "i want to",
    "i would like you to",
    "i would like to",
    "id like to",
    "id like you to",
    "id like to see",
    "i would like to see",
    "i want to see",
    "lets see",
    "let it be",
    "let me see",
    "show me",
    "give me",
    "can i see",
    "can i have",
    "what would",
    "what does",
    "how would",
    "show",
    "try",
    "how about",
    "what about",
    "maybe",
    "perhaps",
    "go ahead and",
    "please do",
    "we need to",
    "we want to",
    "you should",
    "see",
    "let",
    "can",
    "could",
    "lets",
    "let us",
    "now",
    "just",
    "first",
    "next",
    "finally",
    "also",
    "then",
    "after that",
    "afterwards",
    "hey",
    "ok",
    "okay",
    "and",
    "but",
];
const CLOSERS: &[&str] = &["please", "thanks", "thank you", "now", "too", "as well", "instead"];

impl<'c> Reader<'c, '_> {
    pub(crate) fn read(mut self) -> Result<Draft<'c>, Misread> {
        self.separators();
        while !self.cursor.is_done() {
            let from = self.cursor.at;
            self.clause()?;
            self.modifiers()?;
            while self.cursor.eat_any(CLOSERS).is_some() {}
            let end = self.cursor.at;
            let separated = self.separators();
            if self.cursor.is_done() {
                break;
            }
            if !separated || self.cursor.at == from {
                self.cursor.at = end;
                return Err(self.lost());
            }
        }
        if self.draft.ops.is_empty() && self.draft.lights.is_empty() {
            return Err(Misread::new(
                "nothing is to change",
                "say what to do, as in \"remove the bottle\"",
            ));
        }
        Ok(self.draft)
    }

    /// Takes what stands between clauses; whether there was something.
    fn separators(&mut self) -> bool {
        let from = self.cursor.at;
        loop {
            let mark =
                self.cursor.eat_mark(',') || self.cursor.eat_mark('.') || self.cursor.eat_mark(';');
            if !mark && self.cursor.eat_any(OPENERS).is_none() {
                return self.cursor.at > from;
            }
        }
    }

    fn clause(&mut self) -> Result<(), Misread> {
        let from = self.cursor.at;
        let found = VERBS.iter().filter(|(words, _)| self.cursor.sees(words));
        if let Some((words, verb)) = found.max_by_key(|(words, _)| words.len()) {
            self.cursor.eat(words);
            self.verb = Some(*verb);
            return self.with_verb(*verb);
        }
        if self.light_alone()?
            || self.stuff_and_objects()?
            || self.should_be()?
            || self.whole_with_changes()
        {
            return Ok(());
        }
        self.cursor.at = from;
        if let Some(verb) = self.verb
            && self.begins_object()
        {
            return self.with_verb(verb);
        }
        Err(self.unknown_verb())
    }

    fn with_verb(&mut self, verb: Verb) -> Result<(), Misread> {
        match verb {
            Verb::Relight => self.relight(),
            Verb::Move => self.movement(None),
            Verb::Lift => self.movement(Some(Direction::Up)),
            Verb::Lower => self.movement(Some(Direction::Down)),
            Verb::Put => self.put(),
            Verb::Rotate | Verb::Flip => {
                let objects = self.objects("what is to turn", true)?;
                self.rotation(&objects)
            }
            Verb::Turn => self.turn(),
            Verb::Scale | Verb::Enlarge | Verb::Shrink => {
                let objects = self.objects("what is to get another size", true)?;
                let grows =
                    [Verb::Enlarge, Verb::Shrink].contains(&verb).then_some(verb == Verb::Enlarge);
                self.rescale(&objects, grows)
            }
            Verb::Double | Verb::Halve => {
                let objects = self.objects("what is to get another size", true)?;
                self.cursor.eat_any(&["in size", "the size", "its size"]);
                self.scaled(&objects, if verb == Verb::Double { 2.0 } else { 0.5 })
            }
            Verb::Delete => self.removal(),
            Verb::Take => self.taking(),
            Verb::Keep => self.keep(),
            Verb::Copy => self.copies(),
            Verb::Swap => self.swap(),
            Verb::Insert => self.insertion(),
            Verb::Paint | Verb::Make | Verb::Cover | Verb::Give => self.looks(verb),
            Verb::Change => self.change(),
            Verb::Clean => {
                self.cursor.eat("up");
                self.cursor.eat_any(&["the scene", "it", "the splat", "everything"]);
                self.floaters()
            }
        }
    }

    /// "the kitchen with walnut cabinets", "the scene at noon": what follows says what changes.
    fn whole_with_changes(&mut self) -> bool {
        let from = self.cursor.at;
        let whole = self.cursor.eat_any(&super::nouns::WHOLE).is_some();
        self.cursor.eat_any(&["look like", "look"]);
        let follows = ["with", "at", "under", "in", "during"].iter().any(|w| self.cursor.sees(w));
        if !(whole && follows) {
            self.cursor.at = from;
        }
        whole && follows
    }

    /// "turn it 30 degrees", "turn the ball red", "turn this into a sunset".
    fn turn(&mut self) -> Result<(), Misread> {
        let from = self.cursor.at;
        if let Ok(Some(Referent::Objects(objects))) =
            self.finder.referents(&mut self.cursor, &self.last, true)
        {
            let behind = self.cursor.at;
            self.cursor.eat("by");
            let turns = self.cursor.number().is_some()
                || [
                    "around",
                    "a quarter",
                    "quarter",
                    "half",
                    "a half",
                    "clockwise",
                    "counter",
                    "counterclockwise",
                    "upside",
                    "to the",
                ]
                .iter()
                .any(|words| self.cursor.sees(words))
                || super::amount::number(&mut self.cursor.clone()).is_ok_and(|n| n.is_some());
            self.cursor.at = behind;
            if turns {
                self.last.clone_from(&objects);
                return self.rotation(&objects);
            }
        }
        self.cursor.at = from;
        self.looks(Verb::Make)
    }

    /// "with brass handles", "under sunrise, midday and evening", "at sunset".
    fn modifiers(&mut self) -> Result<(), Misread> {
        loop {
            let from = self.cursor.at;
            self.cursor.eat_mark(',');
            self.cursor.eat("and");
            let with = self.cursor.eat("with");
            if (with && self.stuff_and_objects()?) || self.light_behind()? {
                continue;
            }
            self.cursor.at = from;
            return Ok(());
        }
    }

    /// What is left of a clause that was understood so far.
    fn lost(&self) -> Misread {
        let known = VERBS.iter().flat_map(|(words, _)| words.split(' '));
        let words = super::lexicon::COLORS.iter().map(|(name, _)| *name);
        let lights = super::lexicon::LIGHTS.iter().map(|(name, _)| *name);
        let others = [
            "left",
            "right",
            "forward",
            "back",
            "degrees",
            "clockwise",
            "bigger",
            "smaller",
            "matte",
            "glossy",
            "metallic",
        ];
        let near = self
            .cursor
            .word()
            .and_then(|word| nearest(word, known.chain(words).chain(lights).chain(others)));
        let near = near
            .map(|near| format!("the nearest known word is {}; ", shown(near)))
            .unwrap_or_default();
        Misread::new(
            format!("{} is not understood here", self.cursor.rest()),
            format!(
                "{near}say one command per clause, as in \"move the ball to the right and make it red\""
            ),
        )
    }

    fn unknown_verb(&self) -> Misread {
        let rest = self.cursor.rest();
        if let Some((word, why)) =
            super::lexicon::NO_LIGHTS.iter().find(|(word, _)| self.cursor.sees(word))
        {
            return super::light::no_light(word, why);
        }
        let near = self
            .cursor
            .word()
            .and_then(|word| nearest(word, VERBS.iter().map(|(words, _)| *words)));
        let near = match near {
            Some(near) => format!("the nearest known word is {}; ", shown(near)),
            None => String::new(),
        };
        Misread::new(
            format!("{rest} is no command that is known"),
            format!(
                "{near}the commands are relight, move, put, rotate, scale, remove, keep only, copy, swap, insert, paint and make"
            ),
        )
    }
}
