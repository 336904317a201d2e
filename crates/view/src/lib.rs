//! A local page: look at a splat or a scene, click, light and edit, and take home the plan.
//!
//! - [`session`]: the scene, the plan so far and the selection that is being made; workers that make light follow.
//! - [`http`]: the server, on the loopback address alone.
//! - [`api`]: requests to acts of the session, and what the page is told.
//! - [`page`]: the viewer of `export` with the panel that edits.

pub mod api;
pub mod files;
pub mod http;
pub mod page;
pub mod session;
