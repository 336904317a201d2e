//! The flags of providers in Rust: describe yourself, answer a request, or stay and serve.

use std::fmt;
use std::io::{Write as _, stdin};
use std::path::{Path, PathBuf};

use clap::Args;
use motes_formats::documents::to_pretty_json;
use motes_formats::provider::{ProviderDescription, ProviderReply, ProviderRequest};
use motes_stage::Context;
use serde::Serialize;

use crate::serve::{answer, serve};

/// What a provider is started for: one of three. Flatten it as `CommonArgs`.
#[derive(Args, Clone, Debug, Serialize)]
#[group(id = "asked", required = true, multiple = false)]
pub struct Asked {
    /// Print what this provider is and stop
    #[arg(long)]
    pub describe: bool,

    /// Answer a request and stop
    #[arg(long, value_name = "FILE")]
    pub request: Option<PathBuf>,

    /// Answer requests, a line each, until the input ends
    #[arg(long)]
    pub serve: bool,
}

/// The report of a provider, which says nothing: what it has to say is in the reply.
#[derive(Debug, Serialize)]
pub struct Answered {}

impl fmt::Display for Answered {
    fn fmt(&self, _: &mut fmt::Formatter<'_>) -> fmt::Result {
        Ok(())
    }
}

impl Answered {
    /// Prints what a provider says about itself.
    ///
    /// # Errors
    /// The output is closed.
    pub fn described(description: &ProviderDescription, context: &Context) -> anyhow::Result<Self> {
        context.stdout().write_all(to_pretty_json(description).as_bytes())?;
        Ok(Self {})
    }
}

impl Asked {
    /// Has the request answered, or every one that comes. `work` puts its pictures into the folder that it gets.
    ///
    /// # Errors
    /// As [`answer`] and [`serve`].
    pub fn answer(
        &self,
        context: &Context,
        work: &mut dyn FnMut(&ProviderRequest, &Path) -> anyhow::Result<ProviderReply>,
    ) -> anyhow::Result<Answered> {
        match &self.request {
            Some(request) => {
                answer(request, work)?;
            }
            None => serve(stdin().lock(), context.stdout(), work)?,
        }
        Ok(Answered {})
    }
}
