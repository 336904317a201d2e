//! motes-testkit
