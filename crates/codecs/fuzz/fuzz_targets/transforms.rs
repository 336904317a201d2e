#![no_main]

#[path = "../parsers.rs"]
#[allow(dead_code, reason = "a target uses one parser")]
mod parsers;

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| {
    let name = format!("motes-fuzz-{}-transforms.json", std::process::id());
    parsers::transforms_file(bytes, &std::env::temp_dir().join(name));
});
