//! motes-stage
