//! Which requests are answered at all.

use std::net::SocketAddr;

use super::request::{Method, Request};
use super::response::{Response, Status};
use super::token::Token;

/// Knows the address of the page.
#[derive(Clone, Debug)]
pub struct Gate {
    /// `127.0.0.1:PORT`, the only `Host`.
    host: String,
    /// The only `Origin`.
    origin: String,
    token: Token,
}

impl Gate {
    /// Of a server at `address`.
    pub fn new(address: SocketAddr, token: Token) -> Self {
        let host = address.to_string();
        Self { origin: format!("http://{host}"), host, token }
    }

    /// The address of the page.
    pub fn url(&self) -> String {
        format!("{}/{}/", self.origin, self.token.digits())
    }

    /// The rest of the path behind the token.
    ///
    /// # Errors
    /// The answer to a request that is not for this page.
    pub fn pass<'r>(&self, request: &'r Request) -> Result<&'r str, Response> {
        let forbidden = |why: &str| Err(Response::error(Status::Forbidden, why));
        if request.header("host") != Some(&self.host) {
            return forbidden("this server has another name");
        }
        let origin = request.header("origin");
        if origin.is_some_and(|origin| origin != self.origin) {
            return forbidden("the page of another site asks");
        }
        // Browsers say themselves who asks: another site may not even load a picture.
        let site = request.header("sec-fetch-site");
        if site.is_some_and(|site| !["same-origin", "none"].contains(&site)) {
            return forbidden("the page of another site asks");
        }
        let path = request.path.strip_prefix('/').unwrap_or_default();
        let (token, rest) = path.split_once('/').unwrap_or((path, ""));
        if !self.token.is(token) {
            return forbidden("the address has not the token of this session");
        }
        // A form of another site cannot send JSON without asking first.
        let json = request.header("content-type").is_some_and(|kind| {
            kind.split(';')
                .next()
                .unwrap_or_default()
                .trim()
                .eq_ignore_ascii_case("application/json")
        });
        if request.method == Method::Post && !json {
            return Err(Response::error(Status::UnsupportedMedia, "bodies are application/json"));
        }
        Ok(rest)
    }
}
