//! Fuzzes the reader of native scenes.
#![no_main]

use gradfarm_core::scene::read::Format;
use libfuzzer_sys::fuzz_target;

fuzz_target!(|bytes: &[u8]| gradfarm_fuzz::scene(Format::Native, bytes));
