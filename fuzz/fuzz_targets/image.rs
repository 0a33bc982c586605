//! Fuzzes the reader of images.
#![no_main]

use libfuzzer_sys::fuzz_target;

fuzz_target!(|bytes: &[u8]| gradfarm_fuzz::image(bytes));
