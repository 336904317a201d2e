//! A language model instead of the grammar: what it is told, and what of its answer is taken.
//!
//! The model answers with a plan. The plan is checked like any other, and beyond that it may read nothing but the selections and assets of
//! the card, and start nothing.

use std::path::Path;

use edit::ops::OpDocument;
use edit::plan::{EditPlanDocument, parse_edit_plan};
use motes_formats::FormatError;
use motes_formats::documents::{Document as _, schema, to_pretty_json};
use motes_formats::error::quoted;
use motes_formats::provider::{ChatMessage, ChatRole, ChatTask};
use motes_formats::scene_card::SceneCardDocument;
use serde_json::Value;

const RULES: &str = "You turn an instruction about a 3D scene into an edit plan: one JSON object that follows the schema, and nothing \
else. Use only what the scene card lists. To act on an object, first select it: {\"op\": \"select\", \"id\": ID, \"steps\": [{\"by\": \
\"file\", \"path\": SELECTION}]} with the id and the selection of the card, then name the id as \"target\". Lengths are world units; \
meters_per_unit says how long a unit is, where it is known. Directions are those of the frame of the card: right, front (toward \
the viewer), up, as vectors in world. Light is {\"op\": \"set_environment\", \"sun\": NAME} with a value of the card's lights. Files to \
insert are those of its assets. If the instruction cannot be followed, answer with an empty list of operations.";

/// The task for a model. `pictures` are files beside the request.
pub fn task(card: &SceneCardDocument, instruction: &str, pictures: Vec<String>) -> ChatTask {
    let message = |role, text: String, pictures| ChatMessage { role, text, pictures };
    let version = EditPlanDocument::version();
    let rules = format!(
        "{RULES} The plan begins with \"format\": \"{}\", \"version\": \"{version}\".",
        EditPlanDocument::FORMAT
    );
    let said = format!("Scene card:\n{}\nInstruction: {instruction}", to_pretty_json(card));
    ChatTask {
        messages: vec![
            message(ChatRole::System, rules, Vec::new()),
            message(ChatRole::User, said, pictures),
        ],
        schema: schema::<EditPlanDocument>().1,
    }
}

/// The task again, with the answer and what is wrong with it.
pub fn repair(mut task: ChatTask, answer: &Value, error: &FormatError) -> ChatTask {
    let message = |role, text| ChatMessage { role, text, pictures: Vec::new() };
    let refused = format!("This plan is refused: {error}. Answer with the whole plan, corrected.");
    task.messages.push(message(ChatRole::Assistant, answer.to_string()));
    task.messages.push(message(ChatRole::User, refused));
    task
}

/// The plan of an answer.
///
/// # Errors
/// It is no valid plan, has no operation, names a file that is neither a selection nor an asset of the card, or an operation that
/// starts a program. The place is a JSON pointer.
pub fn plan_of(answer: &Value, card: &SceneCardDocument) -> Result<EditPlanDocument, FormatError> {
    let name = Path::new("the answer of the provider");
    // Some models answer with the text of the object.
    let text = match answer {
        Value::String(text) => text.clone(),
        value => value.to_string(),
    };
    let mut plan = parse_edit_plan(text.as_bytes(), name)?.document;
    plan.record = None;
    if plan.ops.is_empty() {
        return Err(FormatError::invalid(name, "/ops", "the plan has no operation")
            .with_remedy("say the instruction in other words"));
    }
    for (i, op) in plan.ops.iter().enumerate() {
        check(op, card).map_err(|(place, cause)| {
            FormatError::invalid(name, format!("/ops/{i}{place}"), cause)
                .with_remedy("a model may name the selections and the assets of the scene card")
        })?;
    }
    Ok(plan)
}

fn check(op: &OpDocument, card: &SceneCardDocument) -> Result<(), (String, String)> {
    if matches!(op, OpDocument::Stylize(_)) {
        return Err(("/op".into(), "this operation would start a program".into()));
    }
    let is_selection = matches!(op, OpDocument::Select(_));
    let is_known = |name: &str| match is_selection {
        true => card.objects.iter().any(|object| object.selection == name),
        false => card.assets.iter().any(|asset| asset == name),
    };
    match op.clone().files().into_iter().find(|(_, name)| !is_known(name)) {
        None => Ok(()),
        Some((place, name)) => {
            let kind = if is_selection { "no selection" } else { "no asset" };
            Err((place, format!("{} is {kind} of the scene card", quoted(&*name))))
        }
    }
}
