//! Connections to the loopback address, a thread each.

use std::io::{self, Read as _};
use std::net::{Ipv4Addr, Shutdown, SocketAddr, TcpListener, TcpStream};
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::thread;
use std::time::{Duration, Instant};

use super::MOST_CONNECTIONS;
use super::gate::Gate;
use super::request::Request;
use super::response::{Response, Status};

/// How long a read waits before it looks at the clock.
const READ_STEP: Duration = Duration::from_millis(250);
/// How long a write may wait for the other side.
const WRITE_PATIENCE: Duration = Duration::from_secs(20);
/// How long an unwanted body is waited for.
const DRAIN_PATIENCE: Duration = Duration::from_secs(2);
/// Between looks for a connection.
const ACCEPT_STEP: Duration = Duration::from_millis(10);
/// Bytes of an unwanted body that are thrown away, so that the answer to it arrives.
const MOST_DRAINED: usize = 4 << 20;

/// Says that it is over.
#[derive(Clone, Debug, Default)]
pub struct Stop(Arc<AtomicBool>);

impl Stop {
    /// It is over.
    pub fn now(&self) {
        self.0.store(true, Ordering::SeqCst);
    }

    /// Whether it is.
    pub fn is_set(&self) -> bool {
        self.0.load(Ordering::SeqCst)
    }
}

/// A socket of the loopback address.
#[derive(Debug)]
pub struct Server {
    listener: TcpListener,
}

impl Server {
    /// At a port of 127.0.0.1; 0 takes a free one.
    ///
    /// # Errors
    /// When the port is taken.
    pub fn bind(port: u16) -> io::Result<Self> {
        let listener = TcpListener::bind((Ipv4Addr::LOCALHOST, port))?;
        listener.set_nonblocking(true)?;
        Ok(Self { listener })
    }

    /// Where it is.
    ///
    /// # Errors
    /// When the system does not know.
    pub fn address(&self) -> io::Result<SocketAddr> {
        self.listener.local_addr()
    }

    /// Answers until `stop`; `idle` is called between connections. `answer` gets the path behind the token.
    pub fn run(
        &self,
        gate: &Gate,
        stop: &Stop,
        answer: &(impl Fn(&str, &Request) -> Response + Sync),
        mut idle: impl FnMut(),
    ) {
        let open = AtomicUsize::new(0);
        thread::scope(|scope| {
            while !stop.is_set() {
                idle();
                let Ok((stream, from)) = self.listener.accept() else {
                    thread::sleep(ACCEPT_STEP);
                    continue;
                };
                let crowded = open.fetch_add(1, Ordering::SeqCst) >= MOST_CONNECTIONS;
                let open = &open;
                let work = move || {
                    // A panic is a bug, which the hook of the program says; the others are served on.
                    let _ = catch_unwind(AssertUnwindSafe(|| {
                        if from.ip().is_loopback() {
                            connection(stream, crowded, gate, stop, answer);
                        }
                    }));
                    open.fetch_sub(1, Ordering::SeqCst);
                };
                if crowded {
                    // No thread for what is turned away.
                    work();
                } else if thread::Builder::new().spawn_scoped(scope, work).is_err() {
                    open.fetch_sub(1, Ordering::SeqCst);
                }
            }
        });
    }
}

fn connection(
    mut stream: TcpStream,
    crowded: bool,
    gate: &Gate,
    stop: &Stop,
    answer: &(impl Fn(&str, &Request) -> Response + Sync),
) {
    let prepared = stream
        .set_nonblocking(false)
        .and_then(|()| stream.set_read_timeout(Some(READ_STEP)))
        .and_then(|()| stream.set_write_timeout(Some(WRITE_PATIENCE)))
        .and_then(|()| stream.set_nodelay(true));
    if prepared.is_err() {
        return;
    }
    if crowded {
        let _ = Response::error(Status::Busy, "too many connections").write(&mut stream);
        return;
    }
    let response = match Request::read(&mut stream, &|| stop.is_set()) {
        Ok(None) => return,
        Ok(Some(request)) => match gate.pass(&request) {
            Ok(path) => answer(path, &request),
            Err(refused) => refused,
        },
        Err(refused) => refused,
    };
    // The other side may be gone.
    let _ = response.write(&mut stream);
    let _ = stream.shutdown(Shutdown::Write);
    drain(&mut stream, stop);
}

/// Reads what is still being sent: closing earlier would cost the other side the answer.
fn drain(stream: &mut TcpStream, stop: &Stop) {
    let until = Instant::now() + DRAIN_PATIENCE;
    let mut buffer = [0; 16 << 10];
    let mut left = MOST_DRAINED;
    while let Ok(n @ 1..) = stream.read(&mut buffer) {
        left = left.saturating_sub(n);
        if left == 0 || Instant::now() >= until || stop.is_set() {
            return;
        }
    }
}
