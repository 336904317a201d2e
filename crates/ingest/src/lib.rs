//! motes-ingest
