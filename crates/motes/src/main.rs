//! Dispatcher.
fn main() {}
