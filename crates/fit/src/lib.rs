//! motes-fit
