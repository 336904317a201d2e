//! What an operation of a plan is made of.

use serde::de::DeserializeOwned;
use serde_json::{Map, Value};

use crate::EditState;
use crate::run::{EditError, Fault, Outcome, Program, Run};

/// An operation of a plan: its keys, which the struct declares for the reader and for the JSON Schema, and what happens to them.
pub(crate) trait Operation: DeserializeOwned {
    /// Flags of the command line, in the order of the help.
    const FLAGS: &'static [Flag];
    /// Flags that hold for several operations and that this one knows, each the name of one of its keys: `pivot`, `fill`, `editor`.
    const SHARED: &'static [&'static str] = &[];

    /// What the types of the keys cannot say: ranges, keys that exclude each other.
    fn check(&self) -> Result<(), Fault> {
        Ok(())
    }

    /// The key that names an earlier selection, and the name.
    fn refers_to(&self) -> Option<(&'static str, &str)> {
        None
    }

    /// The key that names the selection which the operation makes, and the name.
    fn defines(&self) -> Option<(&'static str, &str)> {
        None
    }

    /// Names of files that are read, relative to the plan, each with the rest of its JSON pointer.
    fn files(&mut self) -> Vec<(String, &mut String)> {
        Vec::new()
    }

    /// The key that names a material of the library, and the name.
    fn material(&self) -> Option<(&'static str, &str)> {
        None
    }

    /// The program that is started.
    fn program(&self) -> Program<'_> {
        Program::None
    }

    /// Why the keys of a broken operation are none, where the reader of the type cannot tell.
    fn mistake(_keys: &Map<String, Value>) -> Option<String> {
        None
    }

    /// Changes the state. `at` is the JSON pointer to the operation.
    ///
    /// # Errors
    /// A target is empty, a selection is stale, a file is broken, or the user asked to stop.
    fn apply(
        &self,
        run: &mut Run<'_>,
        state: &mut EditState,
        at: &str,
    ) -> Result<Outcome, EditError>;
}

/// A flag that stands for an operation. Its value is one key, or all keys as a JSON object.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Flag {
    /// Without the dashes.
    pub(crate) name: &'static str,
    /// What a value becomes that is not a JSON object.
    pub(crate) short: Short,
    /// The value, as the help shows it.
    pub(crate) value_name: &'static str,
    /// Whether the flag may stand alone.
    pub(crate) alone: bool,
    /// A key that the flag sets unless the value does.
    pub(crate) sets: Option<(&'static str, &'static str)>,
    /// A sentence for the help.
    pub(crate) help: &'static str,
}

impl Flag {
    /// A flag with a value.
    pub(crate) const fn of(
        name: &'static str,
        short: Short,
        value_name: &'static str,
        help: &'static str,
    ) -> Self {
        Self { name, short, value_name, alone: false, sets: None, help }
    }

    /// A flag that stands alone, or has a JSON object.
    pub(crate) const fn switch(name: &'static str, help: &'static str) -> Self {
        Self { name, short: Short::Nothing, value_name: "JSON", alone: true, sets: None, help }
    }

    /// The same flag, which may also stand alone.
    pub(crate) const fn or_alone(self) -> Self {
        Self { alone: true, ..self }
    }

    /// The same flag, which sets a key.
    pub(crate) const fn setting(self, key: &'static str, value: &'static str) -> Self {
        Self { sets: Some((key, value)), ..self }
    }
}

/// What the value of a flag is when it is not a JSON object.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Short {
    /// Text for a key.
    Text(&'static str),
    /// A number for a key.
    Number(&'static str),
    /// Numbers for a key, separated by commas.
    Numbers(&'static str, usize),
    /// `X,Y,Z,DEG` for `rotate_axis`.
    AxisAngle,
    /// A step of a selection.
    Step,
    /// A `selection.json`.
    SelectionFile,
    /// `X0,Y0,Z0,X1,Y1,Z1` for `box`.
    Box,
    /// None: the flag stands alone, or has a JSON object.
    Nothing,
}
