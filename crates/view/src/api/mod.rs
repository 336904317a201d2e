//! Requests to acts of the session, and what the page is told.
//!
//! | path | method | |
//! |---|---|---|
//! | (empty) | GET | the page |
//! | `manifest` | GET | cameras of photos, what is drawn |
//! | `state?after=N` | GET | what there is to know, as soon as it is newer than N |
//! | `block/ID/B` | GET | a compressed block of the Gaussians that are drawn, or of those at the start (ID 0) |
//! | `mask/ID` | GET | what is selected of them, a bit each |
//! | `photo/I` | GET | a photo, as JPEG |
//! | `plan`, `gaussians` | GET | the plan; the Gaussians as PLY |
//! | `prompt`, `keep`, `choose`, `act`, `light` | POST | |
//! | `clear`, `undo`, `redo`, `quit` | POST | |

mod manifest;
mod state;

use std::time::Duration;

use edit::ops::OpDocument;
use edit::plan::parse_op;
use export::html::ServedPage;
use motes_formats::documents::to_pretty_json;
use motes_formats::ply::write_gaussians_to;
use serde::Deserialize;
use serde::de::DeserializeOwned;
use serde_json::{Value, json};

use crate::http::{Method, Request, Response, Status, Stop};
use crate::session::{Act, ActError, Gesture, LightWish, Quality, Session};

/// How long news are waited for.
const NEWS_PATIENCE: Duration = Duration::from_secs(15);
const BINARY: &str = "application/octet-stream";

/// Photos of the views of a capture as JPEG files, by index into the views.
pub type Photos<'a> = &'a (dyn Fn(usize) -> Result<Vec<u8>, String> + Sync);

/// Everything that requests are answered from.
pub struct Api<'a> {
    /// The scene and what is done with it.
    pub session: &'a Session<'a>,
    /// The page.
    pub page: ServedPage,
    /// Photos of the capture.
    pub photos: Photos<'a>,
    /// Ends the program.
    pub stop: Stop,
}

impl Api<'_> {
    /// Answers a request for a path behind the token.
    pub fn answer(&self, path: &str, request: &Request) -> Response {
        let parts: Vec<&str> = path.split('/').collect();
        match (request.method, parts.as_slice()) {
            (Method::Get, [""]) => self.page(),
            (Method::Get, ["manifest"]) => Response::json(&manifest::manifest(self.session)),
            (Method::Get, ["state"]) => {
                if let Some(after) = request.number("after") {
                    self.session.wait_for_news(after, NEWS_PATIENCE);
                }
                Response::json(&state::state(self.session))
            }
            (Method::Get, ["block", id, block]) => self.block(id, block),
            (Method::Get, ["mask", id]) => {
                match id.parse().ok().and_then(|id| self.session.mask(id)) {
                    Some(bits) => Response::bytes(BINARY, bits),
                    None => Response::error(Status::Gone, "this is no longer drawn"),
                }
            }
            (Method::Get, ["photo", view]) => self.photo(view),
            (Method::Get, ["plan"]) => {
                let text = to_pretty_json(&self.session.plan());
                Response::bytes("application/json", text.into_bytes()).named("edit-plan.json")
            }
            (Method::Get, ["gaussians"]) => self.gaussians(),
            (Method::Post, [act]) => self.act(act, &request.body),
            _ => Response::error(Status::NotFound, "there is no such thing"),
        }
    }

    fn page(&self) -> Response {
        let html = self.page.html.clone().into_bytes();
        let mut response = Response::bytes("text/html; charset=utf-8", html);
        response.headers.push(("Content-Security-Policy", self.page.policy.clone()));
        response
    }

    fn block(&self, id: &str, block: &str) -> Response {
        let (id, block) = (id.parse::<u64>().ok(), block.parse::<usize>().ok());
        let drawn = self.session.drawn().into_iter().find(|shown| Some(shown.id) == id);
        let Some(shown) = drawn else {
            return Response::error(Status::Gone, "this is no longer drawn");
        };
        match block.and_then(|block| shown.packed.blocks.get(block)) {
            Some(bytes) => Response::bytes(BINARY, bytes.clone()),
            None => Response::error(Status::NotFound, "there is no such block"),
        }
    }

    fn photo(&self, view: &str) -> Response {
        let views = self.session.scene.pinhole_views();
        match view.parse::<usize>().ok().and_then(|view| views.get(view).copied()) {
            None => Response::error(Status::NotFound, "there is no such photo"),
            Some(view) => match (self.photos)(view) {
                Ok(bytes) => Response::bytes("image/jpeg", bytes),
                Err(why) => Response::error(Status::Unprocessable, &why),
            },
        }
    }

    /// The Gaussians as `edit` writes them, once light has followed.
    fn gaussians(&self) -> Response {
        let session = self.session;
        let [shown, _] = session.drawn();
        if shown.quality != Quality::Standard || !state::is_settled(session) {
            let why = "the light is still following: ask again when the quality is standard";
            return Response::error(Status::Conflict, why);
        }
        let mut bytes = Vec::new();
        let (name, options) = (&session.scene.plan_name, &session.scene.write_options);
        match write_gaussians_to(&mut bytes, &shown.gaussians, options, name) {
            Ok(()) => Response::bytes(BINARY, bytes).named("gaussians.ply"),
            Err(error) => Response::error(Status::Unprocessable, &error.to_string()),
        }
    }

    fn act(&self, name: &str, body: &[u8]) -> Response {
        let session = self.session;
        let done = match name {
            "prompt" => parsed::<Gesture>(body).and_then(|gesture| session.prompt(&gesture)),
            "keep" => parsed::<Named>(body).and_then(|named| session.keep(&named.name)),
            "choose" => parsed::<Named>(body).and_then(|named| session.choose(&named.name)),
            "act" => act_of(body).and_then(|act| session.act(act)),
            "light" => parsed::<LightWish>(body).and_then(|wish| session.light(wish)),
            "clear" => {
                session.clear();
                Ok(())
            }
            "undo" => session.undo(false),
            "redo" => session.undo(true),
            "quit" => {
                self.stop.now();
                // Those who wait for news go first.
                session.end();
                Ok(())
            }
            _ => return Response::error(Status::NotFound, "there is no such act"),
        };
        match done {
            Ok(()) => Response::json(&state::state_with_mask(session)),
            Err(ActError::Unfit(why)) => Response::error(Status::Unprocessable, &why),
            Err(ActError::Conflict(why)) => Response::error(Status::Conflict, &why),
        }
    }
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Named {
    name: String,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct ActBody {
    op: Value,
    #[serde(default)]
    replace: bool,
}

fn parsed<T: DeserializeOwned>(body: &[u8]) -> Result<T, ActError> {
    serde_json::from_slice(body)
        .map_err(|error| ActError::Unfit(format!("the body does not fit: {error}")))
}

/// An operation as a plan has it.
fn act_of(body: &[u8]) -> Result<Act, ActError> {
    let ActBody { op, replace } = parsed(body)?;
    let op: OpDocument = parse_op(op, "/op", std::path::Path::new("the page"))
        .map_err(|error| ActError::Unfit(error.to_string()))?;
    Ok(Act { op, replace })
}

/// Materials of the library, for the page.
fn materials() -> Value {
    let names = edit::changes::materials::MATERIALS.iter().map(|m| m.name);
    json!(names.collect::<Vec<_>>())
}
