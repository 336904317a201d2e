//! Bytes of a connection to a request.

use std::io::{ErrorKind, Read};
use std::time::{Duration, Instant};

use super::response::{Response, Status};
use super::{MOST_BODY, MOST_HEAD};

/// A request must have arrived in so much time, however slowly it trickles.
const PATIENCE: Duration = Duration::from_secs(10);
/// Headers of a request.
const MOST_HEADERS: usize = 64;

/// What is asked for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Method {
    /// To look.
    Get,
    /// To act.
    Post,
}

/// A request that has arrived whole.
#[derive(Clone, Debug)]
pub struct Request {
    /// GET or POST.
    pub method: Method,
    /// The path, without the query.
    pub path: String,
    /// What is behind the question mark.
    pub query: String,
    headers: Vec<(String, String)>,
    /// At most [`MOST_BODY`] bytes.
    pub body: Vec<u8>,
}

impl Request {
    /// Reads one. `None` when the connection ended before anything came; gives up when it is `over`.
    ///
    /// # Errors
    /// The answer to what is no request, is too large or too slow.
    pub fn read(stream: &mut impl Read, over: &dyn Fn() -> bool) -> Result<Option<Self>, Response> {
        let start = Instant::now();
        let late = || start.elapsed() >= PATIENCE || over();
        let mut bytes = Vec::new();
        let end = loop {
            if let Some(end) = end_of_head(&bytes) {
                break end;
            }
            if bytes.len() >= MOST_HEAD {
                return Err(Response::error(Status::HeadTooLarge, "the headers are too long"));
            }
            if more(stream, &mut bytes, MOST_HEAD, &late)? == 0 {
                return match bytes.is_empty() {
                    true => Ok(None),
                    false => Err(Response::error(Status::BadRequest, "the request ends early")),
                };
            }
        };
        let mut request = head(&bytes[..end])?;
        let length = request.body_length()?;
        let mut body = bytes.split_off(end);
        body.truncate(length);
        while body.len() < length {
            if more(stream, &mut body, length, &late)? == 0 {
                return Err(Response::error(Status::BadRequest, "the body ends early"));
            }
        }
        request.body = body;
        Ok(Some(request))
    }

    /// The value of a header that is there once; names are lower case.
    pub fn header(&self, name: &str) -> Option<&str> {
        let mut found = self.headers.iter().filter(|(own, _)| own == name);
        match (found.next(), found.next()) {
            (Some((_, value)), None) => Some(value),
            _ => None,
        }
    }

    /// The value of a key of the query, when it is a number.
    pub fn number(&self, key: &str) -> Option<u64> {
        let pairs = self.query.split('&').filter_map(|pair| pair.split_once('='));
        pairs.filter(|(own, _)| *own == key).find_map(|(_, value)| value.parse().ok())
    }

    /// Bytes of the body by its header.
    fn body_length(&self) -> Result<usize, Response> {
        let bad = |why| Err(Response::error(Status::BadRequest, why));
        if self.headers.iter().any(|(name, _)| name == "transfer-encoding") {
            return bad("bodies have a length and no encoding");
        }
        for name in ["host", "origin", "content-length"] {
            if self.headers.iter().filter(|(own, _)| own == name).count() > 1 {
                return bad("a header is there twice");
            }
        }
        let Some(length) = self.header("content-length") else { return Ok(0) };
        let digits = !length.is_empty() && length.bytes().all(|b| b.is_ascii_digit());
        match length.parse::<u64>() {
            Ok(length) if digits && length <= MOST_BODY as u64 => Ok(length as usize),
            _ if digits => Err(Response::error(Status::BodyTooLarge, "the body is too large")),
            _ => bad("the length of the body is no number"),
        }
    }
}

/// Where the body begins.
fn end_of_head(bytes: &[u8]) -> Option<usize> {
    bytes.windows(4).position(|four| four == b"\r\n\r\n").map(|at| at + 4)
}

/// Appends what has arrived, to at most `most` bytes in all; 0 bytes mean the end.
fn more(
    stream: &mut impl Read,
    bytes: &mut Vec<u8>,
    most: usize,
    late: &dyn Fn() -> bool,
) -> Result<usize, Response> {
    let mut buffer = [0; 4096];
    let room = buffer.len().min(most - bytes.len());
    loop {
        if late() {
            return Err(Response::error(Status::Timeout, "the request came too slowly"));
        }
        match stream.read(&mut buffer[..room]) {
            Ok(n) => {
                bytes.extend_from_slice(&buffer[..n]);
                return Ok(n);
            }
            // The stream has a short timeout of its own.
            Err(error) => match error.kind() {
                ErrorKind::WouldBlock | ErrorKind::TimedOut | ErrorKind::Interrupted => {}
                _ => return Err(Response::error(Status::BadRequest, "the connection was lost")),
            },
        }
    }
}

fn head(bytes: &[u8]) -> Result<Request, Response> {
    let bad = |why: &str| Response::error(Status::BadRequest, why);
    let mut headers = [httparse::EMPTY_HEADER; MOST_HEADERS];
    let mut parsed = httparse::Request::new(&mut headers);
    match parsed.parse(bytes) {
        Ok(httparse::Status::Complete(_)) => {}
        Ok(httparse::Status::Partial) => return Err(bad("the request ends early")),
        Err(error) => return Err(bad(&format!("this is no HTTP request: {error}"))),
    }
    let method = match parsed.method {
        Some("GET") => Method::Get,
        Some("POST") => Method::Post,
        _ => return Err(Response::error(Status::MethodNotAllowed, "GET and POST are known")),
    };
    let target = parsed.path.unwrap_or_default();
    let (path, query) = target.split_once('?').unwrap_or((target, ""));
    let text = |header: &httparse::Header<'_>| {
        let value = String::from_utf8(header.value.to_vec());
        value.map(|value| (header.name.to_ascii_lowercase(), value))
    };
    let headers = parsed.headers.iter().map(text).collect::<Result<_, _>>();
    let headers = headers.map_err(|_| bad("a header is not UTF-8"))?;
    let (path, query) = (path.to_owned(), query.to_owned());
    Ok(Request { method, path, query, headers, body: Vec::new() })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn parsed(text: &str) -> Result<Option<Request>, u16> {
        Request::read(&mut text.as_bytes(), &|| false).map_err(|answer| answer.status.code())
    }

    #[test]
    fn a_request_is_read_whole() {
        let text = "POST /a/b?x=3&y=4 HTTP/1.1\r\nHost: h\r\nContent-Length: 2\r\n\r\n{}rest";
        let request = parsed(text).unwrap().unwrap();
        assert_eq!((request.method, request.path.as_str()), (Method::Post, "/a/b"));
        assert_eq!((request.number("y"), request.number("z")), (Some(4), None));
        assert_eq!((request.body.as_slice(), request.header("host")), (&b"{}"[..], Some("h")));
        assert!(parsed("").unwrap().is_none());
    }

    #[test]
    fn what_is_no_request_is_refused() {
        let long = format!("GET / HTTP/1.1\r\nA: {}\r\n\r\n", "a".repeat(MOST_HEAD));
        let length = |text: &str| format!("POST / HTTP/1.1\r\nContent-Length: {text}\r\n\r\n");
        for (text, code) in [
            ("GET", 400),
            ("\0\0\r\n\r\n", 400),
            ("PUT / HTTP/1.1\r\n\r\n", 405),
            (&long, 431),
            (&length("99999999999999999999999"), 413),
            (&length("1048577"), 413),
            (&length("-1"), 400),
            (&length("+1"), 400),
            (&length("5"), 400),
            ("GET / HTTP/1.1\r\nHost: a\r\nHost: b\r\n\r\n", 400),
            ("POST / HTTP/1.1\r\nTransfer-Encoding: chunked\r\n\r\n0\r\n\r\n", 400),
        ] {
            assert_eq!(parsed(text).unwrap_err(), code, "{}", &text[..text.len().min(60)]);
        }
    }
}
