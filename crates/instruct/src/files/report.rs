//! What an instruction came to.

use std::fmt;
use std::path::PathBuf;

use edit::files::EditAnswer;
use edit::plan::EditPlanDocument;
use motes_protocol::ProviderUse;
use serde::Serialize;

/// What an instruction came to.
#[derive(Clone, Debug, Default, Serialize)]
pub struct Report {
    /// As it was given.
    pub instruction: String,
    /// A plan, or one per light.
    pub plans: Vec<PlanReport>,
    /// What was not said and had to be assumed.
    pub notes: Vec<String>,
    /// The scene card, where it was written.
    pub card: Option<PathBuf>,
    /// Who answered, where a provider did.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub provider: Option<ProviderUse>,
    /// Whether sentences are printed.
    #[serde(skip)]
    pub explained: bool,
}

/// A plan.
#[derive(Clone, Debug, Serialize)]
pub struct PlanReport {
    /// The light that it is for, where there are several.
    pub name: Option<String>,
    /// The plan, or what it made; null where nothing was written.
    pub output: Option<PathBuf>,
    /// Each operation as a sentence.
    pub explanation: Vec<String>,
    /// The operations.
    pub plan: EditPlanDocument,
    /// What `edit` answered, with `--apply`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub edited: Option<EditAnswer>,
}

impl fmt::Display for Report {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for plan in &self.plans {
            if let Some(name) = &plan.name {
                writeln!(f, "{name}:")?;
            }
            if self.explained || plan.output.is_none() {
                plan.explanation.iter().try_for_each(|sentence| writeln!(f, "  {sentence}"))?;
            }
            match (&plan.edited, &plan.output) {
                (Some(edited), _) => write!(f, "{edited}")?,
                (None, Some(output)) => {
                    writeln!(f, "{} operations: {}", plan.plan.ops.len(), output.display())?;
                }
                (None, None) => {}
            }
        }
        self.notes.iter().try_for_each(|note| writeln!(f, "note: {note}"))?;
        match &self.card {
            Some(card) => writeln!(f, "scene card: {}", card.display()),
            None => Ok(()),
        }
    }
}
