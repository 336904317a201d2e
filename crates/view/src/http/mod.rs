//! The server: HTTP/1.1 on the loopback address, for one page and the people who were given its address.
//!
//! A request passes only when it comes to the address that was printed ([`Gate`]): the token in the path, the header `Host`
//! and, where a browser sends one, the header `Origin` must be ours. So neither a page of another site, nor a name that was
//! pointed at this machine (DNS rebinding), nor another user of the machine who does not know the token gets an answer.
//! Sizes, times and the number of connections are bounded.

mod gate;
mod request;
mod response;
mod serve;
mod token;

pub use gate::Gate;
pub use request::{Method, Request};
pub use response::{Response, Status};
pub use serve::{Server, Stop};
pub use token::Token;

/// Longest request line and headers together, bytes.
pub const MOST_HEAD: usize = 16 << 10;
/// Longest body, bytes.
pub const MOST_BODY: usize = 1 << 20;
/// Connections that are open at a time; more are turned away.
pub const MOST_CONNECTIONS: usize = 48;
