#![no_main]

#[path = "../parsers.rs"]
#[allow(dead_code, reason = "a target uses one parser")]
mod parsers;

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| parsers::reports(bytes));
