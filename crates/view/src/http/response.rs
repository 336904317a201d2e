//! Answers.

use std::io::{self, Write};

use serde_json::{Value, json};

/// How it went.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[expect(missing_docs, reason = "the names of RFC 9110")]
pub enum Status {
    Ok,
    BadRequest,
    Forbidden,
    NotFound,
    MethodNotAllowed,
    Timeout,
    Conflict,
    Gone,
    BodyTooLarge,
    UnsupportedMedia,
    Unprocessable,
    HeadTooLarge,
    Busy,
}

impl Status {
    /// The number.
    pub fn code(self) -> u16 {
        self.parts().0
    }

    fn parts(self) -> (u16, &'static str) {
        match self {
            Self::Ok => (200, "OK"),
            Self::BadRequest => (400, "Bad Request"),
            Self::Forbidden => (403, "Forbidden"),
            Self::NotFound => (404, "Not Found"),
            Self::MethodNotAllowed => (405, "Method Not Allowed"),
            Self::Timeout => (408, "Request Timeout"),
            Self::Conflict => (409, "Conflict"),
            Self::Gone => (410, "Gone"),
            Self::BodyTooLarge => (413, "Content Too Large"),
            Self::UnsupportedMedia => (415, "Unsupported Media Type"),
            Self::Unprocessable => (422, "Unprocessable Content"),
            Self::HeadTooLarge => (431, "Request Header Fields Too Large"),
            Self::Busy => (503, "Service Unavailable"),
        }
    }
}

/// An answer.
#[derive(Clone, Debug)]
pub struct Response {
    /// How it went.
    pub status: Status,
    /// Its media type.
    pub kind: &'static str,
    /// More headers.
    pub headers: Vec<(&'static str, String)>,
    /// Its bytes.
    pub body: Vec<u8>,
}

impl Response {
    /// Bytes of a media type.
    pub fn bytes(kind: &'static str, body: Vec<u8>) -> Self {
        Self { status: Status::Ok, kind, headers: Vec::new(), body }
    }

    /// A JSON document.
    pub fn json(value: &Value) -> Self {
        Self::bytes("application/json", value.to_string().into_bytes())
    }

    /// What is wrong, as `{"error": ...}`.
    pub fn error(status: Status, why: &str) -> Self {
        Self { status, ..Self::json(&json!({ "error": why })) }
    }

    /// The same, to be saved under a name.
    #[must_use]
    pub fn named(mut self, file: &str) -> Self {
        let value = format!("attachment; filename=\"{file}\"");
        self.headers.push(("Content-Disposition", value));
        self
    }

    /// Writes it; the connection ends after it.
    ///
    /// # Errors
    /// When the other side is gone.
    pub fn write(&self, to: &mut impl Write) -> io::Result<()> {
        let (code, reason) = self.status.parts();
        let mut head = format!(
            "HTTP/1.1 {code} {reason}\r\nContent-Type: {}\r\nContent-Length: {}\r\n\
             Connection: close\r\nCache-Control: no-store\r\nX-Content-Type-Options: nosniff\r\n\
             Referrer-Policy: no-referrer\r\nCross-Origin-Resource-Policy: same-origin\r\n\
             Cross-Origin-Opener-Policy: same-origin\r\n",
            self.kind,
            self.body.len()
        );
        for (name, value) in &self.headers {
            head.push_str(&format!("{name}: {value}\r\n"));
        }
        head.push_str("\r\n");
        to.write_all(head.as_bytes())?;
        to.write_all(&self.body)?;
        to.flush()
    }
}
