//! motes-report
