//! motes-formats
